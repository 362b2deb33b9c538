"""Solids in motion: waves, flight, the ledger, contact, rupture; bits do not depend on restarts or threads."""

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.scene import (
    Box,
    Brick,
    Cells,
    InitialVelocity,
    LemaitreChaboche,
    Material,
    NodalForce,
    Numerics,
    Output,
    Perfect,
    Pinball,
    Plate,
    PrescribedVelocity,
    Probe,
    Rigid,
    Rod,
    Rotation,
    Scene,
    Shell,
    Solid,
    Spring,
)

from ..exact import restarts_exactly, threads_change_nothing
from ..solids import STEEL, group_of, solid_scene, start

C = np.sqrt(210e9 / 7800.0)
FOOT = PrescribedVelocity(where=Box(hi=(1e-6, None, None)), velocity=(0, 0, 0))
BREAKS = {
    "strength": Perfect(yield_stress=3e8),
    "damage": LemaitreChaboche(threshold=0.01, rupture=0.06, critical=0.5),
    "critical_damage": 0.4,
}


def energies_close(world, percent):
    found = world.energies()
    assert abs(found["closed_residual_percent"]) < percent, found
    return found


@pytest.mark.parametrize("form", ["trilinear", pytest.param("particles", marks=pytest.mark.long)])
def test_a_bar_rings_with_its_period(form):
    """A bar of 1 m held at one end, pulled by a step: u of the end swings about F L / E A with 4 L / c, to twice that."""
    scene = solid_scene(
        Brick(size=(1, 0.1, 0.1)),
        {"poisson": 0.0},
        spacing=0.05,
        duration=8 / C,
        motions=[FOOT],
        forces=[NodalForce(where=Box(lo=(1 - 1e-6, None, None)), total=(1e5, 0, 0))],
        output=Output(probes=[Probe(name="end", point=(1, 0.05, 0.05))]),
        solid={"formulation": form},
    )
    world = start(scene)
    still = 1e5 / (210e9 * 0.01)
    world.advance_to(2 / C)
    assert world.probes()["end"]["u_x"] == pytest.approx(2 * still, rel=0.05)
    energies_close(world, 0.01)
    world.advance_to(4 / C)
    assert abs(world.probes()["end"]["u_x"]) < 0.1 * still


def test_a_block_that_flies_and_turns_keeps_its_momentum_and_energy():
    spin = Rotation(axis=(0, 0, 1), rate=200.0, centre=(0.2, 0.1, 0.1))
    scene = solid_scene(
        Brick(size=(0.4, 0.2, 0.2)), spacing=0.1, duration=0.1, initial=[InitialVelocity(velocity=(30, 0, 0), rotation=spin)]
    )
    world = start(scene)
    group = group_of(world)
    mass = runtime.get(group.nodes.mass, group.nodes.n)
    world.advance_to(0.02)  # four radians and more
    v = runtime.get(group.nodes.v, group.nodes.n)
    assert mass @ v == pytest.approx([30 * mass.sum(), 0, 0], abs=1e-9 * 30 * mass.sum())
    energies_close(world, 0.01)
    x = group.mesh.points + runtime.get(group.nodes.u, group.nodes.n)
    arm = x - mass @ x / mass.sum()
    assert np.linalg.norm(arm, axis=1).max() == pytest.approx(np.sqrt(0.2**2 + 0.1**2 + 0.1**2), rel=2e-3)


def metal(threads: int = 1):
    return start(
        solid_scene(
            Brick(size=(0.4, 0.2, 0.2)),
            BREAKS,
            spacing=0.1,
            duration=2e-3,
            motions=[FOOT, PrescribedVelocity(where=Box(lo=(0.4 - 1e-6, None, None)), velocity=(20, 5, 0))],
        ),
        threads,
    )


def test_a_torn_block():
    """Cells die one after the other, what they held is booked, and the pieces fly on."""
    world = metal()
    world.advance_to(1.5e-3)
    group = group_of(world)
    broken = runtime.get(group.cells.broken, group.cells.n)
    found = energies_close(world, 0.5)
    assert 0 < broken.sum() < group.cells.n and found["released"] > 0 and found["plastic"] > 0 and found["damage"] > 0
    frame = world.frame().body("body")
    shown = frame.cell_data["broken"] == 0
    assert shown.sum() > 0 and frame.kind == "solid"


def test_frames_show_nodes_without_a_live_cell_as_fragments():
    world = start(solid_scene(Brick(size=(0.3, 0.1, 0.1)), BREAKS, spacing=0.1))
    group = group_of(world)
    runtime.put(group.cells.broken, (group.mesh.centres[:, 0] < 0.2).astype(np.int32))
    shown = world.frame().body("body").point_data
    assert shown["fragment"].tolist() == (group.mesh.points[:, 0] < 0.15).astype(int).tolist()


def test_restart():
    restarts_exactly(metal, 40, 20)


@pytest.mark.long
def test_threads():
    threads_change_nothing(metal, 120)


def struck(threads: int = 1, speed: float = 20.0):
    """A ball falls on a block that lies on nothing."""
    ball = Rigid(name="ball", mass=4.0, pinballs=[Pinball(centre=(0.2, 0.2, 0.255), radius=0.05)], velocity=(0, 0, -speed))
    block = Solid(name="block", shape=Brick(size=(0.4, 0.4, 0.2)), material=Material(**STEEL))
    return start(
        Scene(name="struck", title="Struck", source="tests", duration=2e-3, solids=[block], rigids=[ball], numerics=Numerics(spacing=0.05)),
        threads,
    )


def test_a_ball_bounces_off_a_block():
    """The ball turns round at the surface itself (half a spacing above nothing); momentum of both stays."""
    world = struck()
    group = group_of(world)
    mass = runtime.get(group.nodes.mass, group.nodes.n)
    lowest = 1.0
    for _ in range(40):
        world.advance(5)
        lowest = min(lowest, runtime.get(world.rigids.x, 1)[0, 2])
    assert 0.2 + 0.05 - 0.003 < lowest < 0.2 + 0.05
    total = 4.0 * runtime.get(world.rigids.v, 1)[0] + mass @ runtime.get(group.nodes.v, group.nodes.n)
    assert total == pytest.approx([0, 0, -80.0], abs=1e-6)
    assert runtime.get(world.rigids.v, 1)[0, 2] > -20.0
    energies_close(world, 0.1)


@pytest.mark.long
def test_contact_restarts_and_threads():
    restarts_exactly(struck, 40, 40)
    threads_change_nothing(struck, 80)


def test_a_fine_sheet_meets_the_faces_of_a_coarse_block():
    """Of 25 nodes of the sheet over each face of the block none sinks in, though 9 in 10 are far from its nodes."""
    block = Solid(name="block", shape=Brick(size=(0.24, 0.24, 0.08)), material=Material(**STEEL), spacing=0.08)
    sheet = Shell(
        name="sheet", surface=Plate(length=0.2, width=0.2, origin=(0.02, 0.02, 0.081)), thickness=1e-3, material=Material(**STEEL),
        motion="free", spacing=0.016,
    )  # fmt: skip
    scene = Scene(
        name="sheet", title="Sheet", source="tests", duration=2e-4, shells=[sheet], solids=[block],
        initial=[InitialVelocity(body="sheet", velocity=(0, 0, -10))], numerics=Numerics(spacing=0.016),
    )  # fmt: skip
    world = start(scene)
    world.advance_to(scene.duration)
    shell, group = world.shell, group_of(world)
    height = shell.mesh.points[:, 2] + runtime.get(shell.nodes.u, shell.nodes.n)[:, 2] - 0.5e-3
    top = group.mesh.points[:, 2] > 0.079
    surface = group.mesh.points[top, 2] + runtime.get(group.nodes.u, group.nodes.n)[top, 2]
    assert height.min() > surface.min() - 1e-6
    momentum = runtime.get(shell.nodes.mass, shell.nodes.n) @ runtime.get(shell.nodes.v, shell.nodes.n)
    momentum += runtime.get(group.nodes.mass, group.nodes.n) @ runtime.get(group.nodes.v, group.nodes.n)
    assert momentum == pytest.approx([0, 0, -10 * 7800 * 0.2**2 * 1e-3], abs=1e-9)
    energies_close(world, 0.5)


def test_faces_of_a_graded_block_stand_where_its_surface_is():
    """Cells of 20 mm beside cells of 2 mm: a sheet a hair above them is not inside, and one that lies on them stops there."""
    x, y = np.array([0.0, 0.02, 0.04, 0.042, 0.044, 0.046]), np.array([0.0, 0.02, 0.04])
    k, j, i = np.meshgrid(np.arange(2), np.arange(len(y)), np.arange(len(x)), indexing="ij")
    points = np.column_stack([x[i.ravel()], y[j.ravel()], 0.02 * k.ravel()])
    row, layer = len(x), len(x) * len(y)
    foot = np.array([[c, c + 1, c + row + 1, c + row] for c in (b * row + a for b in range(len(y) - 1) for a in range(len(x) - 1))])
    block = Solid(name="block", shape=Cells(points=points, cells=np.column_stack([foot, foot + layer])), material=Material(**STEEL))
    sheet = Shell(
        name="sheet", surface=Plate(length=0.036, width=0.03, origin=(0.005, 0.005, 0.02 + 0.5e-3 + 1e-6)), thickness=1e-3,
        material=Material(**STEEL), motion="free", spacing=3e-3,
    )  # fmt: skip
    scene = Scene(
        name="graded", title="Graded", source="tests", duration=2e-5, shells=[sheet], solids=[block],
        initial=[InitialVelocity(body="sheet", velocity=(0, 0, -5))], numerics=Numerics(spacing=3e-3),
    )  # fmt: skip
    world = start(scene)
    world.advance_to(scene.duration)
    shell = world.shell
    height = shell.mesh.points[:, 2] + runtime.get(shell.nodes.u, shell.nodes.n)[:, 2] - 0.5e-3
    # 0.1 mm without contact; the discs are 8 mm and 0.8 mm thick, and between them the outside of a face is not quite plane
    assert height.min() > 0.02 - 6e-5


@pytest.mark.long
def test_a_bar_hits_a_rigid_plane():
    """An elastic bar bounces off a held ball of large radius, and leaves after 2 L / c."""
    bar = Solid(name="bar", shape=Rod(radius=0.05, length=1.0, origin=(0, 0, 1e-5)), material=Material(**{**STEEL, "poisson": 0.0}))
    plane = Rigid(name="plane", mass=1.0, pinballs=[Pinball(centre=(0, 0, -50), radius=50)], held=True)
    scene = Scene(
        name="bar",
        title="Bar",
        source="tests",
        duration=4.2 / C,
        solids=[bar],
        rigids=[plane],
        initial=[InitialVelocity(velocity=(0, 0, -5))],
        numerics=Numerics(spacing=0.02),
    )
    world = start(scene)
    group = group_of(world)
    mass = runtime.get(group.nodes.mass, group.nodes.n)
    world.advance_to(1.0 / C)
    force = runtime.get(world.rigids.felt, 1)[0]
    assert np.linalg.norm(force) == pytest.approx(7800 * C * 5 * np.pi * 0.05**2, rel=0.1)
    world.advance_to(2.6 / C)
    mean = mass @ runtime.get(group.nodes.v, group.nodes.n) / mass.sum()
    assert mean[2] == pytest.approx(5.0, rel=0.05)
    energies_close(world, 0.5)


@pytest.mark.long
def test_two_solids_meet():
    one = Solid(name="one", shape=Brick(size=(0.2, 0.2, 0.2)), material=Material(**STEEL))
    other = Solid(name="other", shape=Brick(size=(0.2, 0.2, 0.2), origin=(0.205, 0.03, 0.02)), material=Material(**STEEL))
    scene = Scene(
        name="two",
        title="Two",
        source="tests",
        duration=1e-3,
        solids=[one, other],
        initial=[InitialVelocity(body="one", velocity=(20, 0, 0))],
        numerics=Numerics(spacing=0.05),
    )
    world = start(scene)
    group = group_of(world)
    mass, first = runtime.get(group.nodes.mass, group.nodes.n), group.bodies[0].rows
    world.advance_to(6e-4)
    v = runtime.get(group.nodes.v, group.nodes.n)
    assert mass @ v == pytest.approx([20 * mass[first].sum(), 0, 0], abs=1e-7)
    assert (mass[first] @ v[first])[0] / mass[first].sum() < 8.0  # most of it has gone over
    x = group.mesh.points + runtime.get(group.nodes.u, group.nodes.n)
    assert x[first, 0].max() < x[group.bodies[1].rows, 0].min() + 0.01
    energies_close(world, 0.5)


@pytest.mark.long
def test_a_block_on_a_spring_swings():
    """A quarter of its period: the way of its middle is v / omega."""
    spring = Spring(name="s", between=("body", None), points=((0.2, 0.1, 0.1), (1.2, 0.1, 0.1)), stiffness=1e8, radius=0.15)
    scene = solid_scene(
        Brick(size=(0.2, 0.2, 0.2)), spacing=0.05, duration=1e-2, springs=[spring], initial=[InitialVelocity(velocity=(-1, 0, 0))]
    )
    world = start(scene)
    group = group_of(world)
    mass = runtime.get(group.nodes.mass, group.nodes.n)
    omega = np.sqrt(1e8 / mass.sum())
    world.advance_to(0.5 * np.pi / omega)
    assert (mass @ runtime.get(group.nodes.u, group.nodes.n))[0] / mass.sum() == pytest.approx(-1 / omega, rel=0.03)
    energies_close(world, 0.01)
