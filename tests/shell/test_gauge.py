"""Strain gauges of shells: what they read of motions whose strain is known, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.bodies.body import Now
from taichi_sph.errors import SceneError
from taichi_sph.run.plan import plan
from taichi_sph.scene import (
    Ball,
    FiniteElements,
    Galerkin,
    Material,
    Numerics,
    Output,
    Patch,
    Plate,
    Scene,
    Shell,
    StrainGauge,
    checked,
)  # fmt: skip
from taichi_sph.world.world import World

THICKNESS, ROUND, LONGER = 0.02, 2.0, 1.03  # m, m: radius that it is bent to, stretch across
MIDDLE = (0.5, 0.5, 0.0)
NAMES = {"top": "outer", "between": "middle", "below": "inner"}


def scene(formulation, gauges) -> Scene:
    steel = Material(name="steel", young=210e9, poisson=0.3, density=7800.0)
    shell = Shell(name="plate", surface=Plate(length=1, width=1), thickness=THICKNESS, material=steel, motion="free")
    numerics = Numerics(spacing=1 / 12, formulation=formulation)
    return Scene(name="g", title="t", source="tests", shells=[shell], duration=1e-3, numerics=numerics, output=Output(gauges=gauges))


def bent(X: np.ndarray, N: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Displacements and changes of directors of a plate rolled about y, the side of its directors outside, and stretched along y; then
    turned as a whole."""
    angle = X[:, 0] / ROUND
    x = np.column_stack([ROUND * np.sin(angle), LONGER * X[:, 1], ROUND * np.cos(angle)])
    n = np.column_stack([np.sin(angle), 0 * angle, np.cos(angle)])
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    return x @ turn.T - X, n @ turn.T - N


@pytest.mark.parametrize("formulation", [Galerkin(), FiniteElements(points=4)], ids=lambda f: f.kind)
@pytest.mark.parametrize("length", [None, 0.3])
def test_a_gauge_reads_bending_and_stretch(formulation, length):
    along = {name: StrainGauge(name=name, point=MIDDLE, along=(2, 0, 0), side=side, length=length) for name, side in NAMES.items()}
    across = StrainGauge(name="across", point=MIDDLE, along=(0, 1, 0), length=length)
    slanting = StrainGauge(name="slanting", point=MIDDLE, along=(1, 1, 0), side="middle", length=length)
    world = World(scene(formulation, [*along.values(), across, slanting]), threads=1)
    (group,) = world.groups
    N = runtime.get(group.nodes.N, group.nodes.n)
    u, d = bent(group.mesh.points, N)
    runtime.put(group.nodes.u, u)
    runtime.put(group.nodes.d, d)
    group.strain(Now())
    found = {name: row for name, row in world.tracks(look=False).items() if name.startswith("gauge_")}
    assert world.track_units()["gauge_top"] == {"strain": "-", "membrane": "-", "bending": "-"}
    for name, part in {"top": 1, "between": 0, "below": -1}.items():
        expected = np.sqrt(1 + part * THICKNESS / ROUND) - 1  # by half the thickness over the radius
        assert found[f"gauge_{name}"]["strain"] == pytest.approx(expected, rel=0.02, abs=1e-4)
        assert found[f"gauge_{name}"]["membrane"] == pytest.approx(0.0, abs=2e-4)
    assert found["gauge_across"]["strain"] == pytest.approx(LONGER - 1, rel=0.01)
    half = np.sqrt(1 + 0.5 * (LONGER**2 - 1)) - 1
    assert found["gauge_slanting"]["strain"] == pytest.approx(half, rel=0.02)
    runtime.fill(group.points.broken, 1)
    assert np.isnan(world.tracks(look=False)["gauge_top"]["strain"])


@pytest.mark.parametrize(
    "wrong, said",
    [
        ({"along": (0, 0, 0)}, r"along is \(0, 0, 0\)"),
        ({"body": "plates"}, r"output.gauges\[0\].body: there is no body 'plates'.*'plate'"),
        ({"side": "top"}, "outer"),
        ({"length": 0.0}, "length"),
    ],
)
def test_what_is_no_gauge_is_refused(wrong, said):
    good = {"name": "g", "point": MIDDLE, "along": (1, 0, 0)}
    data = scene(Galerkin(), []).model_dump() | {"output": {"gauges": [good | wrong]}}
    with pytest.raises(SceneError, match=said):
        checked(Scene, lambda: Scene(**data))


def test_two_gauges_have_two_names():
    with pytest.raises(ValueError, match=r"output.gauges\[1\].name: 'g' is taken"):
        scene(Galerkin(), [StrainGauge(name="g", point=MIDDLE, along=(1, 0, 0))] * 2)


def test_a_gauge_lies_in_its_shell():
    with pytest.raises(SceneError, match="points out of the shell 'plate'"):
        World(scene(Galerkin(), [StrainGauge(name="g", point=MIDDLE, along=(0, 0, 1))]), threads=1)


@pytest.mark.parametrize(
    "wrong, said",
    [
        (
            {"point": (9, 9, 9)},
            r"gauges\[0\].point \(9 m, 9 m, 9 m\) is 14.* m from shell 'plate': its nearest cell is at \(958.3 mm, 958.3 mm, 0 m\)",
        ),
        ({"point": (0.5, 0.5, 0.11)}, "may be 93.33 mm off"),
        ({"along": (0, 0, 3)}, r"gauges\[0\].along \(0.0, 0.0, 3.0\) is the normal of shell 'plate' there"),
    ],
)
def test_a_gauge_off_its_shell_is_no_plan(wrong, said):
    with pytest.raises(SceneError, match=said):
        plan(scene(Galerkin(), [StrainGauge(**{"name": "g", "point": MIDDLE, "along": (1, 0, 0)} | wrong)]))


def test_a_gauge_at_an_edge_or_on_the_surface_is_on_its_shell():
    places = {"corner": (1.0, 1.0, 0.0), "glued": (0.3, 0.7, 0.5 * THICKNESS), "slanting": (0.5, 0.0, 0.0)}
    plan(scene(Galerkin(), [StrainGauge(name=name, point=point, along=(1, 0, 2)) for name, point in places.items()]))


@pytest.mark.long
def test_of_a_shell_in_parts_the_part_that_bears_is_read():
    """In the patch the particles, in the middle of an element that they replace too; far from it the elements. Both read one stretch."""
    places = {"in": (0.5 + 1 / 24, 0.5 + 1 / 24, 0.0), "out": (0.1, 0.1, 0.0)}
    gauges = [StrainGauge(name=name, point=point, along=(1, 0, 0), side="middle") for name, point in places.items()]
    patch = Patch(where=[Ball(centre=MIDDLE, radius=0.3)], spacing=1 / 24)
    whole = scene(FiniteElements(points=1), gauges)
    shell = whole.shells[0].model_copy(update={"patch": patch})
    world = World(whole.model_copy(update={"shells": (shell,)}), threads=1)
    inside, outside = world.strain_gauges
    elements, particles = sorted(world.groups, key=lambda group: len(group.bodies[0].name))
    assert inside.points is particles.points and outside.points is elements.points
    for group in world.groups:
        X = group.mesh.points
        runtime.put(group.nodes.u, np.column_stack([0.02 * X[:, 0], 0 * X[:, 1], 0 * X[:, 2]]))
        group.strain(Now())
    for gauge in world.strain_gauges:
        assert gauge.read()["strain"] == pytest.approx(0.02, rel=1e-6)
