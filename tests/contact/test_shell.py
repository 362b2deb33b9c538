"""Rigid bodies against the shell: momentum, penetration, energy, restart."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.scene import Disc, Material, Numerics, Pinball, Plate, Rigid, Scene, Shell

from ..exact import restarts_exactly, threads_change_nothing

STEEL = Material(name="steel", young=210e9, poisson=0.3, density=7800.0)
RADIUS, THICKNESS = 11e-3, 0.8e-3
TOP = RADIUS + 0.5 * THICKNESS


def start(surface=None, velocity=(0.0, 0.0, -40.0), centre=(0.0, 0.0, TOP + 1e-6), spacing=1e-3, rigids=None, **more):
    from taichi_sph.world.world import World

    striker = Rigid(name="striker", mass=0.154, pinballs=[Pinball(centre=centre, radius=RADIUS)], velocity=velocity)
    shell = Shell(
        name="plate", surface=surface or Disc(radius=15e-3), thickness=THICKNESS, material=STEEL, motion="free",
        self_contact=more.pop("self_contact", None),
    )  # fmt: skip
    scene = Scene(
        name="hit",
        title="a ball on a plate",
        source="tests",
        shells=[shell],
        rigids=[striker] if rigids is None else rigids,
        duration=30e-6,
        numerics=Numerics(spacing=spacing, **more),
    )
    return World(scene)


def shell_momentum(sim):
    mass = runtime.get(sim.shell.nodes.mass, sim.shell.nodes.n).astype(float)
    return mass @ runtime.get(sim.shell.nodes.v, sim.shell.nodes.n).astype(float)


def test_what_the_striker_loses_the_shell_gains():
    sim = start()
    sim.advance_to(30e-6)
    lost = 0.154 * (np.array([0, 0, -40.0]) - runtime.get(sim.rigids.v, 1)[0])
    gained = shell_momentum(sim)
    assert abs(lost[2]) > 0.02
    assert gained == pytest.approx(lost, rel=1e-10, abs=1e-12)
    entries = sim.energies()
    assert entries["contact"] > 0
    assert abs(entries["B_percent"]) < 1e-3
    assert sim.contact.penetration < 0.02 * THICKNESS  # the normals turn within a step
    assert sim.contact.unsolved == 0


@pytest.mark.long
def test_a_light_plate_struck_flat_takes_the_speed_of_the_striker():
    """One column of four nodes under a flat many-ball striker: at once M V / (M + m), and the plastic loss of theory."""
    side = 4e-3
    centres = [(x, y, 2e-3 + 0.5 * THICKNESS + 30e-6) for x in (0.0, side) for y in (0.0, side)]
    striker = Rigid(name="striker", mass=0.01, pinballs=[Pinball(centre=c, radius=2e-3) for c in centres], velocity=(0, 0, -10.0))
    sim = start(Plate(length=side, width=side), spacing=side, rigids=[striker])
    sim.advance_to(3.0e-6 + 3 * sim.dt)
    m = side**2 * THICKNESS * 7800.0
    v = 10.0 * 0.01 / (0.01 + m)
    assert runtime.get(sim.rigids.v, 1)[0, 2] == pytest.approx(-v, rel=1e-6)
    assert runtime.get(sim.shell.nodes.v, 4)[:, 2] == pytest.approx(np.full(4, -v), rel=1e-4)
    assert sim.energies()["contact"] == pytest.approx(0.5 * 0.01 * m / (0.01 + m) * 100.0, rel=1e-3)


@pytest.mark.long
def test_a_striker_that_leaves_is_not_held_back():
    sim = start(velocity=(0.0, 0.0, 40.0))
    sim.advance_to(10e-6)
    assert runtime.get(sim.rigids.v, 1)[0] == pytest.approx([0, 0, 40.0], abs=0)
    assert np.abs(shell_momentum(sim)).max() == 0


@pytest.mark.long
def test_from_below_it_pushes_up():
    sim = start(velocity=(0, 0, 40.0), centre=(0, 0, -TOP - 1e-6))
    sim.advance_to(10e-6)
    assert shell_momentum(sim)[2] > 0
    assert runtime.get(sim.rigids.v, 1)[0, 2] < 40.0


@pytest.mark.long
def test_a_ball_rolling_off_the_border_is_pushed_away_from_it():
    """Beside the border of the plate the normal leans outward: there is no ghost of the plate there."""
    edge = 15e-3 + 0.5e-3
    # 0.1 mm beside the point of the rim's round edge at 45 degrees, coming straight down
    reach = (RADIUS + 0.5 * THICKNESS + 0.1e-3) / np.sqrt(2)
    sim = start(velocity=(0, 0, -40.0), centre=(edge + reach, 0, reach))
    sim.advance_to(10e-6)
    v = runtime.get(sim.rigids.v, 1)[0]
    assert v[0] > 1e-3
    assert v[2] > -40.0
    assert shell_momentum(sim)[0] < 0


def test_the_side_of_a_striker_does_not_drag_the_rim_of_its_hole():
    """A ball squeezed past a rim at its equator is pushed sideways, not along its path: by the director (T 3.19, 3.20) it would be
    pushed along."""
    rim = 15e-3 + 0.6e-3  # the discs of border nodes reach half a cell farther
    sim = start(velocity=(-40.0, 0, -40.0), centre=(rim + RADIUS + 0.5 * THICKNESS + 0.02e-3, 0, -0.5e-3))
    sim.advance_to(3e-6)
    gained = runtime.get(sim.rigids.v, 1)[0] - [-40.0, 0, -40.0]
    assert gained[0] > 1e-3
    assert abs(gained[2]) < 0.1 * gained[0]


def test_start_inside_the_shell_is_refused():
    from taichi_sph.errors import SceneError

    with pytest.raises(SceneError, match="rigid 'striker' starts 0.5 mm inside shell 'plate'"):
        start(centre=(0, 0, TOP - 0.5e-3))


@pytest.mark.parametrize("precision", ["f64", pytest.param("f32", marks=pytest.mark.long)])
def test_restart_is_exact(precision):
    restarts_exactly(lambda: start(precision=precision), 60, 60)


@pytest.mark.long
def test_the_number_of_threads_changes_nothing():
    from taichi_sph.world.world import World

    scene = start().scene
    threads_change_nothing(lambda threads: World(scene, threads=threads), 150)


def two_plates(path, self_contact):
    """One shell in two pieces, 4 mm apart, that fly at each other with 20 m/s each."""
    import meshio

    from taichi_sph.scene import Box, InitialVelocity, MeshFile
    from taichi_sph.world.world import World

    n, side = 6, 6e-3
    x, y = np.meshgrid(np.linspace(0, side, n + 1), np.linspace(0, side, n + 1), indexing="ij")
    low = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    points = np.concatenate([low, low + [0.0, 0.0, 4e-3]])
    k = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1, 4)
    meshio.write_points_cells(path, points, [("quad", np.concatenate([quads, quads + len(low)]))])
    shell = Shell(name="plates", surface=MeshFile(path=path), thickness=THICKNESS, material=STEEL, motion="free", self_contact=self_contact)
    push = [
        InitialVelocity(shell="plates", where=Box(hi=(None, None, 1e-3)), velocity=(0, 0, 20.0)),
        InitialVelocity(shell="plates", where=Box(lo=(None, None, 1e-3)), velocity=(0, 0, -20.0)),
    ]
    scene = Scene(name="plates", title="t", source="tests", shells=[shell], initial=push, duration=150e-6, numerics=Numerics(spacing=1e-3))
    return World(scene)


@pytest.mark.long
def test_two_pieces_of_one_shell_meet_only_with_self_contact(tmp_path):
    """They close 3.2 mm at 40 m/s in 80 us. Without self-contact they have passed each other by 150 us."""
    gaps = {}
    for self_contact in (None, True):
        sim = two_plates(tmp_path / "plates.vtu", self_contact)
        before = shell_momentum(sim)
        sim.advance_to(150e-6)
        X = sim.shell.mesh.points
        z = X[:, 2] + runtime.get(sim.shell.nodes.u, sim.shell.nodes.n)[:, 2]
        order = np.lexsort(np.round(X / 1e-3).T)  # the lower plate first, both in the same order
        low, high = np.split(z[order], 2)
        gaps[self_contact] = (high - low).min()
        assert shell_momentum(sim) == pytest.approx(before, abs=1e-12)
        if self_contact:
            assert sim.contact.penetration < 0.01 * THICKNESS
            assert abs(sim.energies()["B_percent"]) < 0.1
    assert gaps[None] < -0.5e-3
    assert gaps[True] > 0.99 * THICKNESS


@pytest.mark.long
def test_a_fragment_still_makes_contact():
    """All cells are broken: every node is a flake of its own, keeps its mass, and is struck like any other (T 2.3.6.3)."""
    sim = start(velocity=(0, 0, -40.0), centre=(0, 0, TOP + 1e-6))
    sim.shell.rupture.cut(np.arange(sim.shell.cells.n))
    assert runtime.get(sim.shell.nodes.fragment, sim.shell.nodes.n).all()
    sim.advance_to(20e-6)
    lost = 0.154 * (np.array([0, 0, -40.0]) - runtime.get(sim.rigids.v, 1)[0])
    assert shell_momentum(sim) == pytest.approx(lost, rel=1e-10, abs=1e-12)
    z = runtime.get(sim.shell.nodes.v, sim.shell.nodes.n)[:, 2]
    struck = z != 0
    assert 0 < struck.sum() < sim.shell.nodes.n / 2
    # a free flake leaves with the speed of the ball or, struck aslant, with what of it lies along the normal
    assert z[struck].min() == pytest.approx(-40.0, rel=0.02)
    assert sim.contact.penetration < 0.02 * THICKNESS


def test_a_grazing_striker_only_brushes_the_plate():
    """It slides along at a tenth of a degree: no friction, so hardly anything of its speed is lost."""
    sim = start(velocity=(40.0, 0, -0.07), centre=(-5e-3, 0, TOP + 0.5e-6))
    sim.advance_to(30e-6)
    v = runtime.get(sim.rigids.v, 1)[0]
    assert v[0] == pytest.approx(40.0, rel=1e-4)
    assert -0.07 < v[2] <= 1e-3
    assert sim.contact.penetration < 1e-3 * THICKNESS
