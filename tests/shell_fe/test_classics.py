"""Classical cases of shells by finite elements, coarse (A3 to A9): what `benchmarks/elements.py` shows at all qualities."""

import math
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

from taichi_sph.scene import Box, Modes, NodalForce, Numerics, Plate, PrescribedVelocity, Scene, Shell, StepLimit, load_scene
from taichi_sph.scene.supports import Edge, held

from ..shells import STEEL, shell_scene, start
from ..world import ritz
from .linear import answer

SCENES = Path(__file__).parents[2] / "scenes"
FORMS = ("elements_1", pytest.param("elements", marks=pytest.mark.long))


def scene_of(name: str, **settings) -> Scene:
    return load_scene(SCENES / f"{name}.py", {"quality": "draft"} | settings)


def ratio(scene: Scene) -> float:
    """The deflection over the scene's reference."""
    options = scene.quantities[0].options
    place = [options.get(axis, 0.0) for axis in "xyz"]
    return answer(scene, place)["xyz".index(options.get("axis", "z"))] / options["reference"]


@pytest.mark.parametrize("form", FORMS)
def test_a_clamped_plate_does_not_lock(form):
    """A3: 12 elements a side, nodes regular and moved, e/L from 1e-1 to 1e-4."""
    plate = spec_from_file_location("clamped_plate", SCENES / "clamped_plate.py")
    module = module_from_spec(plate)
    plate.loader.exec_module(module)
    for slenderness in (1e-1, 1e-4):
        for nodes in ("regular", "irregular"):
            assert ratio(module.one("draft", slenderness, nodes, "quad", form, 13)) == pytest.approx(1.0, abs=0.02)


@pytest.mark.long
@pytest.mark.parametrize("form", FORMS)
def test_a_cantilever_does_not_lock(form):
    """A4."""
    for slenderness in (1e-1, 1e-4):
        said = scene_of("cantilever", load="force", slenderness=slenderness, nodes="irregular", formulation=form)
        assert ratio(said) == pytest.approx(1.0, abs=0.01)


@pytest.mark.long
@pytest.mark.parametrize("form", FORMS)
def test_a_roof(form):
    """A5: 14 nodes along the straight side; quads, and triangles, which are stiffer within the surface: 0.93 here, 0.987 with 40."""
    assert ratio(scene_of("scordelis_lo", nodes="regular", formulation=form)) == pytest.approx(1.0, abs=0.03)
    if form == "elements":
        assert ratio(scene_of("scordelis_lo", nodes="irregular", cells="triangle", formulation=form)) == pytest.approx(1.0, abs=0.08)


@pytest.mark.long
@pytest.mark.parametrize("form", FORMS)
def test_a_pinched_cylinder(form):
    """A6: a force spread over a disc, 16 nodes along the arc."""
    assert ratio(scene_of("pinched_cylinder", load="spread", nodes="regular", cells="quad", formulation=form)) == pytest.approx(
        1.0, abs=0.06
    )


@pytest.mark.parametrize("form", FORMS)
def test_a_pinched_hemisphere(form):
    """Inextensional bending of a doubly curved shell, 16 elements along a quarter: 0.0940 (MacNeal and Harder 1985)."""
    assert ratio(scene_of("hemisphere", nodes="regular", formulation=form)) == pytest.approx(1.0, abs=0.01)
    assert ratio(scene_of("hemisphere", nodes="irregular", formulation=form)) == pytest.approx(1.0, abs=0.08)


@pytest.mark.long
def test_frequencies():
    """A8: free and simply supported, 12 elements a side."""
    n, e = 12, 0.01
    scale = math.sqrt(210e9 * e**2 / 12 / (1 - 0.3**2) / 7800) / (2 * math.pi)
    x, y, up = (0, None, None), (None, 0, None), (None, None, 0)
    sides = [Edge("x", 0.0, "above", up, x), Edge("x", 1.0, "below", up, x)]
    ends = [Edge("y", 0.0, "above", up, y), Edge("y", 1.0, "below", up, y)]
    for points in (4, 1):
        for motions, wanted in (((), ritz.free_frequencies(e)), (held("shell", 1.0 / n, sides, ends), ritz.supported_frequencies(e))):
            said = shell_scene("flat", n=n, thickness=e, irregularity=0.0, duration=6.0, modes=Modes(count=6), motions=motions)
            sim = start(said.derive(**{"numerics.formulation": {"kind": "elements", "points": points}}))
            assert sim.instead.frequency / scale == pytest.approx(wanted, rel=0.035)


@pytest.mark.long
@pytest.mark.parametrize("thickness, cells", [(1e-3, "quad"), (1.0, "triangle"), (10.0, "quad")])
def test_the_step_is_at_the_limit(thickness, cells):
    """A9: the predicted step is never above the measured limit and at most 10 % below, from thin to thick."""
    said = shell_scene("flat", n=6, cells=cells, thickness=min(thickness / 6, 1.0), duration=1.0, limit=StepLimit())
    sim = start(said.derive(**{"numerics.formulation": {"kind": "elements", "points": 1 if thickness == 10.0 else 4}}))
    sim.advance(1)
    assert 0.9 < sim.status()["ratio"] <= 1.0


@pytest.mark.parametrize("form, rows, least, most", [("elements", 1, 0.6, 0.8), ("elements", 4, 0.96, 1.0), ("elements_1", 1, 0.98, 1.02)])
def test_bending_within_the_plane(form, rows, least, most):
    """A beam of square elements under a shear force. A row with four points is too stiff by its shear; with one point it is not."""
    height, length, e = 0.1, 1.0, 0.01
    said = Scene(
        name="beam",
        title="a beam in its plane",
        source="tests",
        shells=[Shell(name="beam", surface=Plate(length=length, width=height), thickness=e, material={**STEEL, "poisson": 0.0})],
        motions=[PrescribedVelocity(shell="beam", where=Box(hi=(1e-6, None, None)), velocity=(0, 0, None))],
        forces=[NodalForce(shell="beam", where=Box(lo=(length - 1e-6, None, None)), total=(0, 1.0, 0))],
        duration=1e-3,
        numerics=Numerics(spacing=height / rows, formulation={"kind": "elements", "points": 1 if form == "elements_1" else 4}),
    )
    theory = length**3 / (3 * 210e9 * e * height**3 / 12) + 1.2 * length / (210e9 / 2 * e * height)
    assert least < answer(said, (length, 0, 0))[1] / theory < most
