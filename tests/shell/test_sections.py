"""Thickness and material by region and by group: series springs, masses, refusals; both forms of shells."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.errors import SceneError
from taichi_sph.run.plan import plan
from taichi_sph.scene import (
    Box,
    Cylinder,
    Group,
    Material,
    Net,
    NodalForce,
    Numerics,
    Outside,
    Perfect,
    Plate,
    PrescribedVelocity,
    Scene,
    Section,
    Shell,
    Static,
    SurfacePressure,
    checked,
)

from ..geometry.writers import box
from ..shells import STEEL, of_nodes, start

L, W, E, D = 1.0, 0.25, 0.02, 1 / 16
HALF = Box(lo=(0.5 * L, None, None))
SOFT = Material(**STEEL | {"name": "soft", "young": 70e9, "density": 2700.0, "poisson": 0.0})
HARD = Material(**STEEL | {"poisson": 0.0})
THIN = Section(where=HALF, thickness=0.5 * E, material=SOFT)


def strip(form: str = "galerkin", motion: str = "in_plane", section: Section = THIN, own: Material = HARD, **more) -> Scene:
    """A strip that hangs at its left end, its right half thinner and softer."""
    wide = Plate(length=L, width=W)
    shell = Shell(name="strip", surface=wide, thickness=E, material=own, motion=motion, sections=(section,))
    held = PrescribedVelocity(where=Box(hi=(1e-6, None, None)), velocity=(0, 0, 0) if motion == "free" else (0, 0, None))
    if motion == "free":
        held = held.model_copy(update={"spin": (0, 0, 0)})
    options = {"forces": [NodalForce(where=Box(lo=(L - 1e-6, None, None)), total=(1e3, 0, 0))], "static": Static(increments=1)}
    numerics = Numerics(spacing=D, formulation=form)
    return Scene(name="strip", title="", source="tests", shells=[shell], motions=[held], duration=1e-3, numerics=numerics, **options | more)


@pytest.mark.parametrize("form", ["galerkin", pytest.param("elements", marks=pytest.mark.long)])
def test_two_halves_stretch_as_springs_in_series(form):
    """P (l / E1 e1 + l / E2 e2) / w; with Poisson's ratio 0 the field is that of bars."""
    sim = start(strip(form))
    sim.advance(1)
    points, mesh = sim.shell.points, sim.shell.mesh
    strain, area = runtime.get(points.strain, points.n)[:, 0].astype(float), runtime.get(points.area, points.n)
    stretch = (strain * area).sum() / W  # a force on nodes dents its own edge
    for k, tight in ((0.5 - D / 2, HARD.young * E), (0.5 + D / 2, 0.5 * SOFT.young * E)):
        beside = np.abs(np.repeat(mesh.centres[:, 0], points.n // len(mesh.cells)) - k) < 1e-6
        assert strain[beside] == pytest.approx(np.full(beside.sum(), 1e3 / W / tight), rel=0.002)
    exact = 1e3 / W * 0.5 * L * (1 / (HARD.young * E) + 1 / (SOFT.young * 0.5 * E))
    assert stretch == pytest.approx(exact, rel=0.002)
    mass = runtime.get(sim.shell.nodes.mass, sim.shell.nodes.n).astype(float).sum()
    assert mass == pytest.approx(0.5 * L * W * E * (HARD.density + 0.5 * SOFT.density), rel=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("form", ["galerkin", "elements"])
def test_a_cantilever_of_two_thicknesses_bends_as_beams_in_series(form):
    """Under a force at its end: the moments of the two halves over their own E I, integrated."""
    force = NodalForce(where=Box(lo=(L - 1e-6, None, None)), total=(0, 0, 10.0))
    sim = start(strip(form, "free", forces=[force], static=Static(increments=1)))
    sim.advance(1)
    end = sim.shell.mesh.points[:, 0] > L - 1e-6
    found = of_nodes(sim, "u")[end, 2].mean()
    a = 0.5 * L
    stiff, thin = (m.young * W * e**3 / 12 for m, e in ((HARD, E), (SOFT, 0.5 * E)))
    exact = 10.0 * ((L**3 - a**3) / (3 * stiff) + a**3 / (3 * thin))
    assert found == pytest.approx(exact, rel=0.02)


@pytest.mark.long
def test_a_ring_of_two_thicknesses_stretches_by_its_springs():
    """Half of a ring is twice as thick; under pressure both carry N = p R, so that the hoop grows by the mean of N / (E e). Bending
    where they meet is small: the ring is free to move as one."""
    R, p = 1.0, 1e5
    surface = Cylinder(radius=R, length=3 * D, axis="z")
    right = Section(where=Box(lo=(0, None, None)), thickness=2 * E)
    shell = Shell(name="ring", surface=surface, thickness=E, material=HARD, motion="free", sections=(right,))
    # axes of symmetry: nodes on y = 0 stay on it
    held = [
        PrescribedVelocity(where=Box(lo=(None, -1e-6, None), hi=(-0.5, 1e-6, None)), velocity=(0, 0, 0), spin=(0, 0, 0)),
        PrescribedVelocity(where=Box(lo=(0.5, -1e-6, None), hi=(None, 1e-6, None)), velocity=(None, 0, 0), spin=(0, 0, 0)),
    ]
    scene = Scene(
        name="ring", title="", source="tests", shells=[shell], motions=held, pressures=[SurfacePressure(value=p)], duration=1.0,
        static=Static(increments=1), numerics=Numerics(spacing=D),
    )  # fmt: skip
    sim = start(scene)
    sim.advance(1)
    g = runtime.get(sim.shell.cells.strain, sim.shell.cells.n).astype(float)
    mesh = sim.shell.mesh
    hoop = np.abs(g[:, 0] + g[:, 1])  # no Poisson's ratio: the axial strain is small
    grown = (hoop * mesh.areas).sum() / mesh.areas.sum()
    exact = p * R / HARD.young * 0.5 * (1 / E + 1 / (2 * E))
    assert grown == pytest.approx(exact, rel=0.03)


def test_groups_of_a_mesh_say_sections_loads_and_supports():
    """A closed box of two groups: mass by cells; a pressure on one group pushes it alone; the plan says what it is made of."""
    points, cells = box((4, 4, 4), 0.1)
    top = np.flatnonzero((points[cells][:, :, 2] > 0.4 - 1e-9).all(axis=1)).tolist()
    surface = Net(points=points, cells=cells, groups={"lid": top, "all": list(range(len(cells)))})
    lid = Section(where=Group(name="Lid"), thickness="6 mm")
    shell = Shell(name="box", surface=surface, thickness="2 mm", material=HARD, motion="free", sections=(lid,))
    scene = Scene(
        name="box", title="", source="tests", shells=[shell], duration=1e-4, numerics=Numerics(spacing=0.1),
        pressures=[SurfacePressure(value=1e4, where=Group(name="lid"))],
        motions=[PrescribedVelocity(where=Outside(of=Group(name="lid")), velocity=(0, 0, 0))],
    )  # fmt: skip
    body = plan(scene).bodies[0]
    assert body.mass == pytest.approx(HARD.density * 0.16 * (5 * 2e-3 + 6e-3))
    assert "16 cells of 6 mm steel" in body.note
    sim = start(scene)
    sim.advance(1)
    force = runtime.get(sim.shell.pressures.force, sim.shell.pressures.n).astype(float)
    # the lid alone, upward; its outer cells are seen over a sharp edge, and lean by some percent to the particles' operator
    assert len(force) == 16 and np.abs(force[:, :2].sum(axis=0)).max() < 1e-9 * force[:, 2].sum()
    assert force[:, 2].max() == pytest.approx(1e4 * 0.01) and force[:, 2].sum() == pytest.approx(1e4 * 0.16, rel=0.05)
    frame = sim.frame().bodies[0]
    assert (frame.cell_data["areal_mass"] * sim.shell.mesh.areas).sum() == pytest.approx(body.mass)


@pytest.mark.long
def test_a_metal_of_two_strengths_yields_where_it_is_weak():
    weak = Material(**STEEL | {"name": "weak", "poisson": 0.0, "strength": Perfect(yield_stress=1e6)})
    strong = weak.model_copy(update={"name": "strong", "strength": Perfect(yield_stress=1e9)})
    pull = NodalForce(where=Box(lo=(L - 1e-6, None, None)), total=(2e6 * W * E, 0, 0))
    sim = start(strip(section=Section(where=HALF, material=weak), own=strong, forces=[pull], static=None))
    sim.advance_to(5e-4)
    plastic = runtime.get(sim.shell.points.plastic, sim.shell.points.n)
    right = sim.shell.mesh.centres[:, 0] > 0.5 * L
    assert plastic[right].max() > 1e-6 and plastic[~right].max() == 0.0


@pytest.mark.parametrize(
    ("section", "form", "said"),
    [
        ({"where": HALF}, "galerkin", "thickness and material are missing: give what differs there"),
        ({"where": HALF, "thickness": -1}, "galerkin", "sections[0].thickness = -1 must be greater than 0"),
        ({"where": HALF, "thickness": 0.01}, "collocation", "sections: not possible yet with numerics.formulation 'collocation'"),
        (
            {"where": HALF, "material": SOFT.model_copy(update={"strength": Perfect(yield_stress=1e9)})},
            "galerkin",
            "sections[0].material has other laws than the shell's own",
        ),
        ({"where": Box(lo=(2.0, None, None)), "thickness": 0.01}, "galerkin", "sections[0].where catches no cell of shell 'strip'"),
        ({"where": Group(name="lid"), "thickness": 0.01}, "galerkin", "sections[0].where: group 'lid': the mesh has no group of that name"),
    ],
)  # fmt: skip
def test_refusals(section, form, said):
    def made() -> Scene:
        shell = Shell(name="strip", surface=Plate(length=L, width=W), thickness=E, material=HARD, sections=(section,))
        return Scene(
            name="s", title="", source="tests", shells=[shell], duration=1e-3, numerics=Numerics(spacing=D, formulation=form)
        )  # fmt: skip

    with pytest.raises(SceneError) as error:
        plan(checked(Scene, made))
    assert said in str(error.value)


@pytest.mark.parametrize(("own", "section", "said"), [(E, 1.5, "1.5 m"), (3.0, None, "3 m"), (E, 1.0, None)])
def test_a_given_mesh_is_not_thicker_than_it_is_wide(own, section, said):
    """The search about such walls would reach everything: of a filled tank it took seconds and gigabytes."""
    surface = Net(points=[(0, 0, 0), (0.5, 0, 0), (0.5, 1, 0), (0, 1, 0)], cells=[(0, 1, 2, 3)], groups={"all": [0]})
    sections = [Section(where=Group(name="all"), thickness=section)] if section else []
    shell = Shell(name="lid", surface=surface, thickness=own, material=HARD, sections=sections)
    scene = Scene(name="s", title="", source="tests", shells=[shell], duration=1e-3, numerics=Numerics(spacing=0.5))
    if said is None:
        plan(scene)
        return
    with pytest.raises(SceneError, match=f"^thickness {said} of shell 'lid' is larger than its mesh, 1 m across$"):
        plan(scene)
