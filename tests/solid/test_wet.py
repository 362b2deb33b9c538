"""Water on solids: exact power, the push of still water, as a rigid body of the same shape."""

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.errors import SceneError
from taichi_sph.run.plan import plan
from taichi_sph.scene import (
    Box,
    Brick,
    Fluid,
    FluidBox,
    InitialVelocity,
    JohnsonCook,
    LemaitreChaboche,
    Material,
    Numerics,
    PrescribedVelocity,
    Scene,
    Solid,
    Wall,
    Water,
)

from ..exact import restarts_exactly, threads_change_nothing
from ..fluid.test_wetted import powers, shake, wetted

STEEL = Material(name="steel", young=210e9, poisson=0.3, density=7800.0)
D = 0.01


def start(scene, threads=1):
    from taichi_sph.world.world import World

    return World(scene, threads=threads)


def block(spacing: float = 0.006, **more) -> Scene:
    """A brick that stands in the middle of a block of water, wet from four sides and above."""
    settings = {
        "fluids": [Fluid(name="water", fill=FluidBox(lo=(0.02, -0.06, -0.06), hi=(0.12, 0.06, 0.06)), alpha=0.0, delta=0.0)],
        "duration": 1e-4,
    } | more
    return Scene(
        name="block", title="a brick in water", source="tests",
        solids=[Solid(name="brick", shape=Brick(size=(0.02, 0.04, 0.04), origin=(0.0, -0.02, -0.02)), material=STEEL, spacing=spacing)],
        numerics=Numerics(spacing=D), **settings,
    )  # fmt: skip


@pytest.mark.parametrize("spacing", [0.006, pytest.param(0.02, marks=pytest.mark.long)])  # one point a face, and nine
def test_pressure_does_the_work_that_the_density_stores(spacing):
    """sum f.v over particles and nodes = sum V p div v, and what the water gets the solid loses."""
    sim = start(block(spacing))
    nodes = next(group.nodes for group in sim.groups if group.kind == "solid")
    shake(nodes)
    stored, done, felt = powers(sim)
    push = runtime.get(nodes.force, nodes.n)
    done += (push * runtime.get(nodes.v, nodes.n)).sum()
    assert push[:, 0].sum() < -1.0  # the water stands beyond its face at x = 0.02
    assert done == pytest.approx(stored, rel=1e-9)
    assert np.abs(felt.sum(axis=0) + push.sum(axis=0)).max() < 1e-9 * np.abs(felt).sum()


def test_points_of_a_solid_are_its_surface():
    sim = start(block())
    points = wetted(sim).points
    area = runtime.get(points.record, points.n)[:, 3:6]
    np.testing.assert_allclose(area.sum(axis=0), 0.0, atol=1e-12)
    assert np.linalg.norm(area, axis=1).sum() == pytest.approx(2 * 0.04 * 0.04 + 4 * 0.02 * 0.04, rel=1e-9)
    x = runtime.get(points.x, points.n)
    assert np.einsum("ni,ni->", x, area) / 3 == pytest.approx(0.02 * 0.04 * 0.04, rel=1e-9)  # they point outward


def test_a_floor_bears_its_water():
    """Water 6 cm deep on a brick of rubber: what holds the brick's own floor bears the weight of both."""
    at = {(1, 0, 0): 0.0, (-1, 0, 0): 0.06, (0, 1, 0): 0.0, (0, -1, 0): 0.06}
    planes = [Wall(point=[a * abs(n) for n in normal], normal=normal) for normal, a in at.items()]
    water = Fluid(name="water", fill=FluidBox(lo=(0, 0, 0), hi=(0.06, 0.06, 0.06)), water=Water(sound=20, tension=None), alpha=0.1)
    rubber = Material(name="rubber", young=1e6, poisson=0.3, density=1000.0)
    floor = Brick(size=(0.12, 0.12, 0.01), origin=(-0.03, -0.03, -0.01))
    sim = start(
        Scene(
            name="tank", title="water on a brick", source="tests", fluids=[water], walls=planes, gravity=(0, 0, -9.81), duration=0.5,
            solids=[Solid(name="brick", shape=floor, spacing=0.01, material=rubber)],
            motions=[PrescribedVelocity(body="brick", where=Box(hi=(None, None, -0.01)), velocity=(0, 0, 0))],
            numerics=Numerics(spacing=D),
        )
    )  # fmt: skip
    borne = []
    while sim.steps_left:
        sim.advance(min(20, sim.steps_left))
        borne.append(sim.tracks()["support_1"]["fz"])
    weight = 9.81 * (1000 * 0.06**3 + 1000 * 0.12 * 0.12 * 0.01)
    mean = float(np.mean(borne[len(borne) // 3 :]))
    print(f"{mean / weight:.4f} of the weight, {sim.time:.3g} s")
    assert abs(mean) == pytest.approx(weight, rel=0.03)


@pytest.mark.parametrize("more", [{}, {"every": 3}])
def test_restart_and_threads(more):
    def make(threads=1):
        moving = InitialVelocity(body="brick", velocity=(20.0, 0, 0))
        scene = block(initial=[moving])
        return start(scene.model_copy(update={"fluids": (scene.fluids[0].model_copy(update=more),)}), threads)

    restarts_exactly(make, 12, 12)
    threads_change_nothing(make, 24)


@pytest.mark.long
def test_faces_behind_a_broken_cell_are_wet():
    """What is left of a brick of which cells are gone is closed, and its points say its volume."""
    breaks = STEEL.model_copy(update={
        "strength": JohnsonCook(A=200e6, B=0.0, n=1.0, C=0.0, rate0=1.0),
        "damage": LemaitreChaboche(threshold=0.0, rupture=1.0, critical=0.5), "critical_damage": 0.5,
    })  # fmt: skip
    scene = block(spacing=0.01)
    solid = scene.solids[0].model_copy(update={"material": breaks})
    sim = start(scene.model_copy(update={"solids": (solid,)}))
    group = next(group for group in sim.groups if group.kind == "solid")
    broken = np.zeros(group.cells.n, np.int32)
    broken[[0, 5, 6, 17]] = 1
    runtime.put(group.cells.broken, broken)
    w = wetted(sim)
    w.see(True)
    area, x = runtime.get(w.points.record, w.points.n)[:, 3:6], runtime.get(w.points.x, w.points.n)
    np.testing.assert_allclose(area.sum(axis=0), 0.0, atol=1e-12)
    assert np.einsum("ni,ni->", x, area) / 3 == pytest.approx(group.mesh.volumes[broken == 0].sum(), rel=1e-9)


def test_water_does_not_start_in_a_solid():
    box = FluidBox(lo=(-0.06, -0.06, -0.06), hi=(0.06, 0.06, 0.06))
    with pytest.raises(SceneError, match=r"fluid 'water' starts .* mm inside solid 'brick': move one of them away"):
        plan(block(fluids=[Fluid(name="water", fill=box)]))
    plan(block())
