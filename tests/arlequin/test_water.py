"""Water on a shell of elements with particles in it: it presses once, and neither pressure nor leak sees where the parts begin."""

from pathlib import Path

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.bodies.fluid.columns import STIFFNESS
from taichi_sph.bodies.shell.parts import split_of
from taichi_sph.errors import SceneError
from taichi_sph.geometry.regions import inside
from taichi_sph.scene import (
    Ball,
    Box,
    Cylinder,
    FiniteElements,
    Fluid,
    FluidBox,
    Galerkin,
    Material,
    Mazars,
    Numerics,
    Outside,
    Patch,
    Plate,
    PrescribedVelocity,
    Scene,
    Shell,
    ShellFill,
    Wall,
)
from taichi_sph.scene.script import load_scene
from taichi_sph.world import growth
from taichi_sph.world.growth import widened

from ..exact import restarts_exactly, same_state, threads_change_nothing
from ..fluid.test_wetted import powers, rates, shake, wetted
from .scenes import STEEL, of_nodes, start

ROOT = Path(__file__).parents[2]
D, RADIUS, HEIGHT = 0.0125, 0.06, 0.15  # m
THICK = 4e-3  # m, of the plate
FRONT = np.array([RADIUS, 0.0, 0.5 * HEIGHT])


def can(patched: bool = True, material=None, grows: bool = False, **water) -> Scene:
    """A closed can full of water: elements 1.5 D wide, and particles half as far apart as those of the water, or half of that, about its
    front."""
    patch = Patch(where=(Ball(centre=FRONT.tolist(), radius=0.03),), spacing=0.5 * D, grows=grows) if patched else None
    return Scene(
        name="can",
        title="a can in parts",
        source="tests",
        shells=[
            Shell(
                name="can", surface=Cylinder(radius=RADIUS, length=HEIGHT, ends="discs"), thickness=1e-3, motion="free", spacing=1.5 * D,
                material=Material(**STEEL | (material or {})), formulation=FiniteElements(points=1), patch=patch,
            )
        ],
        fluids=[Fluid(name="water", fill=ShellFill(shell="can"), spacing=D, alpha=0.0, delta=0.0, **water)],
        duration=1e-3,
        numerics=Numerics(spacing=D),
    )  # fmt: skip


def shells(sim) -> list:
    """The groups of elements and, where there are some, of particles."""
    found = [group for group in sim.groups if group.kind == "shell"]
    return sorted(found, key=lambda group: group.shells[0].name)


def pressed(scene) -> tuple[np.ndarray, float, float]:
    """Force (3,) [N] of water at one pressure on all nodes, sum of F.x about the middle of the can [N m], and the sum of |F| [N]."""
    sim = start(scene, threads=1)
    runtime.put(sim.fluid.p.s, np.full(sim.fluid.p.n, 1e-3))
    for group in shells(sim):
        runtime.put(group.nodes.force, np.zeros((group.nodes.n, 3)))
    rates(sim, 0.0, 1e-6)
    each = [(group.mesh.points - [0, 0, 0.5 * HEIGHT], of_nodes(group, "force")) for group in shells(sim)]
    return (
        sum(f.sum(axis=0) for _, f in each),
        sum(float((f * x).sum()) for x, f in each),
        sum(float(np.linalg.norm(f, axis=1).sum()) for _, f in each),
    )


def test_one_pressure_presses_once():
    """Sum F.x is 3 p V, whatever computes the wall; the particles stand 0.7 mm outside of the chords of the elements."""
    (_, whole, _), (force, parted, size) = pressed(can(False)), pressed(can())
    print(parted / whole, np.abs(force).max() / size)
    assert parted == pytest.approx(whole, rel=5e-3)
    assert np.abs(force).max() < 5e-3 * size


@pytest.mark.long
def test_parts_of_the_overlap_share_what_water_sees():
    """Points of elements and particles have one area together, and each part of it the mass that it would have alone."""
    sim = start(can(), threads=1)
    wet, (elements, particles) = wetted(sim), shells(sim)
    split, records = particles.shells[0].split, runtime.get(wet.points.record, wet.n)
    area = np.linalg.norm(records[:, 3:6], axis=1)
    assert [surface.n for surface in wet.surfaces] == [particles.nodes.n, 4 * elements.cells.n]
    of_elements = area[wet.first[1] :].reshape(-1, 4).sum(axis=1)
    np.testing.assert_allclose(of_elements, np.where(split.overlap[split.cells], 0.5, 1.0) * elements.mesh.areas, rtol=2e-3)
    fine = particles.shells[0].mesh
    assert area[: wet.first[1]].sum() == pytest.approx((split.of_particles * fine.areas).sum(), rel=5e-3)  # of chords
    assert [surface.lightest for surface in wet.surfaces] == pytest.approx([7.8, 7.8], rel=1e-6)


def test_pressure_does_the_work_that_the_density_stores():
    """As in tests/fluid/test_wetted.py, on points of both parts, wherever they are."""
    sim = start(can(), threads=1)
    rng = np.random.default_rng(5)
    for group in shells(sim):
        shake(group.nodes)
        runtime.put(group.nodes.u, 0.02 * D * rng.uniform(-1, 1, (group.nodes.n, 3)))
    stored, done, felt = powers(sim)
    each = [(of_nodes(group, "force"), of_nodes(group, "v")) for group in shells(sim)]
    done += sum((F * v).sum() for F, v in each)
    force = felt.sum(axis=0) + sum(F.sum(axis=0) for F, _ in each)
    assert all(np.abs(F).max() > 1.0 for F, _ in each)
    assert done == pytest.approx(stored, rel=1e-9)
    assert np.abs(force).max() < 1e-9 * np.abs(felt).sum()


WIDTHS = (0.03, 0.05, 0.2)  # m, of bulges


def plate(patched: bool) -> Scene:
    """A clamped plate of elements under still water between four walls."""
    side, wide = 0.2, 0.025
    patch = (
        Patch(where=(Box(lo=(0.075, 0.075, None), hi=(0.125, 0.125, None)),), spacing=wide / 3, formulation=Galerkin(shear_bound=0))
        if patched
        else None
    )
    walls = [Wall(point=at, normal=n) for at in ((0, 0, 0), (side, side, 0)) for n in ((1, 0, 0), (0, 1, 0))]
    walls = [wall if not any(wall.point) else wall.model_copy(update={"normal": tuple(-c for c in wall.normal)}) for wall in walls]
    rim = Outside(of=Box(lo=(1e-4, 1e-4, None), hi=(side - 1e-4, side - 1e-4, None)))
    return Scene(
        name="plate",
        title="a plate in parts under water",
        source="tests",
        shells=[
            Shell(
                name="plate", surface=Plate(length=side, width=side), thickness=THICK, motion="free", material=Material(**STEEL),
                formulation=FiniteElements(shear_bound=0), patch=patch,
            )
        ],
        fluids=[Fluid(name="water", fill=FluidBox(lo=(0, 0, 0.5 * THICK), hi=(side, side, 0.06 + 0.5 * THICK)), spacing=0.02)],
        walls=walls,
        gravity=(0, 0, -9.81),
        motions=[PrescribedVelocity(body="plate", where=rim, velocity=(0, 0, 0), spin=(0, 0, 0))],
        duration=8e-4,
        numerics=Numerics(spacing=wide),
    )  # fmt: skip


@pytest.mark.long
def test_an_even_pressure_does_not_see_the_patch():
    """Its work in bulges of several widths about the middle of a plate is that where all of the plate is elements, and the scene's own
    pressure: as far as loads go, the plate bends alike."""
    found = []
    for patched in (False, True):
        sim = start(plate(patched), threads=1)
        runtime.put(sim.fluid.p.s, np.full(sim.fluid.p.n, 1e-3))
        for group in shells(sim):
            runtime.put(group.nodes.force, np.zeros((group.nodes.n, 3)))
        rates(sim, 0.0, 1e-6)
        pressure, work, area = sim.fluid.constants[0, STIFFNESS] * 1e-3, np.zeros(len(WIDTHS)), np.zeros(len(WIDTHS))
        for group in shells(sim):
            away = np.linalg.norm(group.mesh.points[:, :2] - 0.1, axis=1)
            bulges = np.exp(-((away / np.array(WIDTHS)[:, None]) ** 2))
            work -= bulges @ of_nodes(group, "force")[:, 2]
            area += bulges @ group.shells[0].node_areas
        found.append(work / (pressure * area))
    print(*found)
    np.testing.assert_allclose(found[1], found[0], rtol=0.01)
    np.testing.assert_allclose(found[1], 1.0, rtol=0.02)


@pytest.mark.long
def test_no_particle_passes_a_sound_wall():
    """Water thrown against the wall in parts stays within, and its energy is kept."""
    sim = start(can(velocity=(20.0, 5.0, 0.0)))
    sim.advance_to(2e-4)
    x = runtime.get(sim.fluid.p.x, sim.fluid.p.n)
    elements, particles = shells(sim)
    assert np.linalg.norm(of_nodes(particles, "u"), axis=1).max() > 1e-5
    sim.leak.look(sim.time)
    inside = np.hypot(x[:, 0], x[:, 1]).max(), x[:, 2].min(), x[:, 2].max() - HEIGHT
    print(inside, sim.energies()["closed_residual_percent"], sim.contact_report())
    assert sim.leak.row["escaped_count"] == 0
    assert inside[0] < RADIUS and inside[1] > 0.0 and inside[2] < 0.0
    assert abs(sim.energies()["closed_residual_percent"]) < 1.0


@pytest.mark.long
def test_the_gauge_of_leaks_sees_both_parts_as_one_tank():
    """A plug cut out of the particles is no wall; what stands beyond elements or particles is outside; the hole of the plug is open."""
    sim = start(can(), threads=1)
    leak, p, (elements, particles) = sim.leak, sim.fluid.p, shells(sim)
    n = elements.nodes.n + particles.nodes.n
    assert len(leak._whole()) == n
    away = np.linalg.norm(particles.mesh.centres - FRONT, axis=1)
    plug = np.unique(particles.mesh.cells[away < 8e-3])
    broken = runtime.get(particles.cells.broken, particles.cells.n)
    broken[(away > 8e-3) & np.isin(particles.mesh.cells, plug).any(axis=1)] = 1
    runtime.put(particles.cells.broken, broken)
    gone = set(range(n)) - set(leak._whole().tolist())
    assert gone == {elements.nodes.n + i for i in plug.tolist()}
    x = runtime.get(p.x, p.n)
    x[:3] = FRONT + [0.02, 0, 0], [-RADIUS - 0.01, 0, 0.05], [0, 0, HEIGHT + 0.01]
    runtime.put(p.x, x)
    assert leak.look(1e-3)["escaped_count"] == 3
    within = np.isin(particles.mesh.cells, plug).any(axis=1)
    assert leak.opening() == pytest.approx(particles.mesh.areas[within].sum(), rel=0.02)  # of a wall that bends


@pytest.mark.long
def test_a_restart_and_another_number_of_threads_change_no_bit():
    restarts_exactly(lambda: start(can(velocity=(20.0, 0.0, 0.0))), 12, 12)
    threads_change_nothing(lambda threads: start(can(velocity=(20.0, 0.0, 0.0)), threads=threads), 12)


BRITTLE = {"damage": Mazars(threshold=0.9, A=1, B=100), "critical_damage": 0.99}  # beyond all strains here: it grows when it is told to


def grown(every: int | None = None):
    """A can whose patch may grow, after 20 steps beside water that moves."""
    sim = start(can(grows=True, material=BRITTLE, velocity=(20.0, 5.0, 0.0), every=every))
    sim.advance(20)
    return sim


@pytest.mark.long
@pytest.mark.parametrize("every", [None, pytest.param(2, marks=pytest.mark.long)])
def test_water_does_not_feel_growth(every):
    """The patch grows while water presses: momentum of all is kept, no energy is made, and what the particles of water find of the wall
    is the same but for the chords of elements. A restart after it is exact."""
    sim = grown(every)
    met, before = _seen(sim), sim.entries()
    first, nodes = _momentum(sim), sim.n_nodes
    coupling = next(one for one in sim.couplings if hasattr(one, "tie"))
    split = coupling.split
    middle = np.abs(split.whole.centres[:, 2] - 0.5 * HEIGHT) < 2 * 1.5 * D
    growth.grow(sim, {"can": tuple(np.flatnonzero(split.overlap & middle & (split.whole.centres[:, 1] > 0)).tolist())})
    after = sim.entries()
    assert sim.n_nodes > nodes and sim.grown.events == 1
    assert _momentum(sim) == pytest.approx(first, rel=1e-9, abs=1e-12 * np.abs(first).max())
    assert sum(_energy(after)) == pytest.approx(sum(_energy(before)), rel=1e-6)
    print("booked", dict(zip(sim.grown.names, sim.grown.booked.tolist())), "met", np.abs(_seen(sim) - met).max() / np.abs(met).max())
    assert np.abs(_seen(sim) - met).max() < 0.05 * np.abs(met).max()
    half = {name: np.copy(value) for name, value in sim.state().items()}
    sim.advance(20)
    end, energies = sim.state(), sim.energies()
    assert abs(energies["closed_residual_percent"]) < 1.0 and sim.leak.look(sim.time)["escaped_count"] == 0
    again = start(can(grows=True, material=BRITTLE, velocity=(20.0, 5.0, 0.0), every=every))
    again.restore(half)
    assert same_state(again.state(), half) == []
    again.advance(20)
    assert same_state(again.state(), end) == [] and again.energies() == energies


def _seen(sim) -> np.ndarray:
    """(N, 3) w of the particles of water as surfaces lie now [1/m], in the order of the start."""
    wet, p = wetted(sim), sim.fluid.p
    sim.fluid.pairs.pack(0.0)
    wet.see(False)
    near = np.diff(runtime.get(wet.s.start, p.n + 1)) > 0
    found = np.where(near[:, None], runtime.get(wet.s.met, p.n)[:, :3], 0.0)[np.argsort(runtime.get(p.id, p.n))]
    next(one for one in sim.couplings if hasattr(one, "wetted")).begin_anew()  # as if nobody had looked
    return found


def _momentum(sim) -> np.ndarray:
    p = sim.fluid.p
    water = runtime.get(p.mass, p.n) @ runtime.get(p.v, p.n)
    return water + sum(of_nodes(group, "mass") @ of_nodes(group, "v") for group in shells(sim))


def _energy(found) -> list[float]:
    return [found.kinetic, *found.internal.values(), *found.numerical.values()]


@pytest.mark.long
def test_a_patch_grows_up_to_the_edges_of_a_can():
    """Elements beside the fold between wall and end cannot become particles, and the others around them do."""
    scene = can(grows=True, material=BRITTLE)
    split = split_of(scene.shells[0], scene)
    wide = widened(scene, {"can": split.wider(split.overlap)})
    after = split_of(wide.shells[0], wide)
    assert after.patched.sum() > split.patched.sum()
    assert np.abs(after.whole.centres[after.overlap, 2] - 0.5 * HEIGHT).max() < 0.5 * HEIGHT
    assert split.wider(np.ones(len(split.patched), bool)) == tuple(np.flatnonzero(split.able & ~split.said).tolist())


def test_the_filled_tank_in_parts():
    """Particles stand over the height of its front; what stands alone in a key is refused."""
    scene = load_scene(ROOT / "scenes" / "tank_leak.py", {"quality": "draft", "coupled": True})
    split = split_of(scene.shells[0], scene)
    front = split.whole.points[np.unique(split.whole.cells[split.patched])]
    front = front[front[:, 0] > 0.0]
    assert np.ptp(front[:, 2]) > 0.45 and front[:, 1].max() > 0.05
    for number in range(len(scene.motions)):
        assert inside(scene.motions[number].where, split.elements.points).any()
    with pytest.raises(SceneError, match="grows = True: .* set coupled = True as well"):
        load_scene(ROOT / "scenes" / "tank_leak.py", {"quality": "draft", "grows": True})


def test_contact_alone_does_not_carry_water_on_a_patch():
    with pytest.raises(SceneError, match=r"shells\[0\]\.patch: fluid 'water' has contact 'pinballs', which would strike elements and"):
        can().derive(**{"fluids.water.contact": "pinballs"})
