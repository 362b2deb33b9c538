"""Openings too narrow for water are named: at the start by `validate`, at the end by the answer of the run."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from taichi_sph.frame import BodyFrame, Frame
from taichi_sph.output.answer import quantity_text
from taichi_sph.output.folder import RunFolder
from taichi_sph.output.frames import FramesWriter
from taichi_sph.output.measures import openings
from taichi_sph.output.measures.openings import too_narrow
from taichi_sph.run.plan import plan
from taichi_sph.scene import (
    Box,
    Cylinder,
    Disc,
    Fluid,
    FluidBox,
    Hole,
    HoleIn,
    Material,
    Meeting,
    Numerics,
    Plate,
    PrescribedVelocity,
    Scene,
    Shell,
    ShellFill,
    Wall,
    dump,
)

D = 0.01


def tank(*, radius: float = 0.05, hole: float = 0.05, **more) -> Scene:
    """Water beside a gate that stands on the floor; holes in the gate and in the floor."""
    gate = Plate(length=0.3, width=0.3, origin=(0, 0, 0.155), holes=(HoleIn(centre=(0.15, 0.15, 0.155), radius=hole),))
    return Scene(
        name="gate",
        title="gate",
        source="tests",
        duration=1.0,
        numerics=Numerics(spacing=0.02),
        shells=[
            Shell(name="gate", surface=gate, thickness=0.01, motion="free", material=Material(name="m", young=1e9, poisson=0, density=1000))
        ],
        fluids=[Fluid(name="water", fill=FluidBox(lo=(0, 0, 0), hi=(0.3, 0.3, 0.15)), spacing=D)],
        walls=[
            Wall(point=(0, 0, 0), normal=(2, 0, 0)),
            Wall(point=(0, 0, 0), normal=(0, 0, 1), hole=Hole(centre=(0.1, 0.1, 0), radius=radius)),
        ],
        **more,
    )


def said(scene: Scene) -> str:
    return next(body for body in plan(scene).bodies if body.name == "water").note


def test_validate_names_a_narrow_hole():
    """Of a wall, in spacings of the water, with the spacing that would do; not of a wide one, nor where the two never meet."""
    assert "mm wide" not in said(tank())
    note = said(tank(radius=0.009))
    assert "the hole of walls[1] is 18 mm wide, 1.8 D of 'water'" in note and "a spacing of 4.5 mm lets it flow" in note
    coarse = tank(hole=0.04)
    coarse = coarse.model_copy(update={"fluids": [coarse.fluids[0].model_copy(update={"spacing": 0.05})]})
    assert "holes[0] of 'gate' is 80 mm wide, 1.6 D of 'water'" in said(coarse)
    assert "holes[0]" not in said(coarse.model_copy(update={"meetings": (Meeting(between=("gate", "water"), meet=False),)}))


@pytest.mark.parametrize(
    "slides, hole, expected", [(True, 0.02, None), (False, 0.02, "the gap between 'disc'"), (True, 0.009, "the gap between")]
)
def test_a_plane_of_symmetry_mirrors_an_opening(slides, hole, expected):
    """A quarter of a disc with a hole about its middle: the wall shows half of the hole, unless the disc is clamped to the wall."""
    along = None if slides else 0
    held = [
        PrescribedVelocity(body="disc", where=Box(hi=(1e-3, None, None)), velocity=(0, along, along)),
        PrescribedVelocity(body="disc", where=Box(lo=(1e-3, None, None), hi=(None, 1e-3, None)), velocity=(along, 0, along)),
    ]
    disc = Disc(radius=0.15, quarter=True, origin=(0, 0, 0.1), holes=[HoleIn(centre=(0, 0, 0.1), radius=hole)])
    metal = Material(name="m", young=1e9, poisson=0, density=1000)
    scene = Scene(
        name="disc",
        title="disc",
        source="tests",
        duration=1.0,
        numerics=Numerics(spacing=0.005),
        shells=[Shell(name="disc", surface=disc, thickness=1e-3, motion="free", material=metal)],
        motions=held,
        fluids=[Fluid(name="water", fill=FluidBox(lo=(0, 0, 0), hi=(0.1, 0.1, 0.08)), spacing=D)],
        walls=[Wall(point=(0, 0, 0), normal=(1, 0, 0)), Wall(point=(0, 0, 0), normal=(0, 1, 0)), Wall(point=(0, 0, 0), normal=(0, 0, 1))],
    )
    note = said(scene)
    assert (expected in note) if expected else ("gap" not in note)


@pytest.mark.parametrize("lifted, expected", [(0.0, None), (0.002, None), (0.016, "16 mm wide, 1.6 D of 'water'"), (0.025, None)])
def test_the_answer_names_the_gap_below_a_gate(tmp_path, lifted, expected):
    scene = tank()
    (tmp_path / "scene.json").write_text(dump(scene))
    x, y = np.meshgrid(np.linspace(0, 0.3, 16), np.linspace(0, 0.3, 16), indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), np.full(x.size, 0.155)], axis=1)
    k = np.arange(256).reshape(16, 16)
    cells = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1, 4).astype(np.int32)
    writer = FramesWriter(tmp_path / "frames")
    for n, up in enumerate((0.0, lifted)):
        data = {"reference": points, "velocity": np.zeros_like(points)}
        writer.append(Frame(float(n), n, (BodyFrame("gate", points + [up, 0, 0], cells, data, {}),)))
    lines = too_narrow(RunFolder(tmp_path), quantity_text)
    if expected is None:
        assert lines == []
    else:
        assert len(lines) == 1 and lines[0].startswith(f"The gap between 'gate' and walls[0] is {expected}")


def test_a_torn_tank_is_told_of_its_own_water_alone(monkeypatch):
    steel = Material(name="m", young=1e9, poisson=0, density=1000)
    cans = [Cylinder(radius=0.1, length=0.2, ends="discs", origin=(x, 0, 0)) for x in (0.0, 1.0)]
    scene = tank().model_copy(
        update={
            "shells": tuple(Shell(name=n, surface=can, thickness=0.01, motion="free", material=steel) for n, can in zip("ab", cans)),
            "fluids": tuple(Fluid(name=f"of_{n}", fill=ShellFill(shell=n), spacing=D) for n in "ab"),
        }
    )
    monkeypatch.setattr(openings, "torn", lambda run, shell: 1.6 * D)
    monkeypatch.setattr(openings, "gap", lambda *_: None)
    lines = too_narrow(SimpleNamespace(scene=scene, bodies=lambda: ["a", "b", "of_a", "of_b"]), quantity_text)
    assert [("'a'" in line, "'of_a'" in line) for line in lines] == [(True, True), (False, False)]


def gate(up: float, held: bool = False) -> Scene:
    """A gate that stands upright, `up` [m] above the floor, beside the water."""
    surface = Plate(length=0.2, width=0.3, origin=(0.305, 0, up), normal=(1, 0, 0))
    material = Material(name="m", young=1e9, poisson=0, density=1000)
    motions = [PrescribedVelocity(body="gate", where=Box(lo=(None, None, None)), velocity=(0, 0, 0))] if held else []
    return Scene(
        name="gate", title="gate", source="tests", duration=1.0, numerics=Numerics(spacing=0.02), motions=motions,
        shells=[Shell(name="gate", surface=surface, thickness=0.01, motion="free", material=material)],
        fluids=[Fluid(name="water", fill=FluidBox(lo=(0, 0, 0), hi=(0.3, 0.3, 0.15)), spacing=D)],
        walls=[Wall(point=(0, 0, 0), normal=(0, 0, 1))],
    )  # fmt: skip


@pytest.mark.parametrize(
    ("up", "held", "expected"),
    [
        (0.0, False, "'gate' stands on walls[0] and may lift: through a gap below 20 mm, 2 D of 'water', water passes haltingly"),
        (0.0, True, None),
        (0.015, True, "the gap between 'gate' and walls[0] is 15 mm wide, 1.5 D of 'water'"),
        (0.03, False, None),
    ],
)
def test_validate_names_the_gap_below_a_gate(up, held, expected):
    note = said(gate(up, held))
    assert ("walls[0]" not in note) if expected is None else (expected in note)
