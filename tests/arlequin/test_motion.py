"""A patched shell in motion: momenta, energy, the ledger, restarts, threads, and surfaces that are curved."""

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.couplings.arlequin import tie
from taichi_sph.scene import (
    Ball,
    Box,
    Cylinder,
    InitialVelocity,
    NodalForce,
    NodalMoment,
    Perfect,
    Pinball,
    Plate,
    PrescribedVelocity,
    Ramp,
    Rigid,
    SurfacePressure,
)

from ..exact import restarts_exactly, same_state, threads_change_nothing
from .scenes import of_nodes, patched, start, tied

ARC = Cylinder(radius=0.5, length=1.0, start_angle=0, angle="90 deg")
INSIDE = (Ball(centre=(0.354, 0.354, 0.5), radius=0.15),)
LOADS = {
    "motions": [PrescribedVelocity(body="shell", where=Box(hi=(1e-6, None, None)), velocity=(0, 0, 0), spin=(0, 0, 0))],
    "forces": [NodalForce(body="shell", where=Box(lo=(0.2, None, None)), total=(0, 2e5, 1e5))],
    "moments": [NodalMoment(body="shell", where=Box(lo=(0.99, None, None)), total=(0, 2e4, 0), history=Ramp(rise=2e-4))],
    "pressures": [SurfacePressure(body="shell", value=1e6, history=Ramp(rise=1e-4))],
}


def set_spinning(sim, omega: np.ndarray, velocity: np.ndarray, bend: float = 0.0) -> None:
    """A rigid turn about the middle of the shell, and with `bend` a motion that is rigid on neither side."""
    whole = tied(sim).split.whole.points
    middle, length = whole.mean(axis=0), np.ptp(whole[:, 0])
    for group in sim.groups:
        X, N = group.mesh.points, of_nodes(group, "N")
        v = np.cross(omega, X - middle) + velocity
        turn = omega - (N @ omega)[:, None] * N
        if bend:
            s, size = (X[:, 0] - middle[0]) / length, bend * np.linalg.norm(omega)
            v[:, 2] += size * length * np.cos(np.pi * s) ** 2
            turn[:, 1] += size * np.pi * np.sin(2 * np.pi * s)
        runtime.put(group.nodes.v, v)
        runtime.put(group.nodes.omega, turn)
    tied(sim).start()


def momenta(sim) -> tuple[np.ndarray, np.ndarray]:
    p, turn = np.zeros(3), np.zeros(3)
    for group in sim.groups:
        mass, v = of_nodes(group, "mass"), of_nodes(group, "v")
        x = group.mesh.points + of_nodes(group, "u")
        p += mass @ v
        turn += mass @ np.cross(x - 0.5 * sim.dt * v, v) + of_nodes(group, "inertia") @ of_nodes(group, "omega")
    return p, turn


def flown(scene, turns: float, bend: float) -> tuple[float, float, float, float]:
    """Relative changes of energy, momentum and angular momentum, and what is left of the differences of directors."""
    sim = start(scene)
    omega = np.array([100.0, 300.0, 50.0])
    set_spinning(sim, omega, np.array([3.0, -20.0, 5.0]), bend)
    sim.advance(1)
    (p, turn), energy = momenta(sim), sim.energies()
    sim.advance_to(turns * 2 * np.pi / np.linalg.norm(omega))
    (p_end, turn_end), end = momenta(sim), sim.energies()
    whole = energy["kinetic"] + energy["elastic"]
    left = tied(sim).left()
    assert left[0] < 1e-13
    return (
        abs(end["kinetic"] + end["elastic"] - whole) / whole,
        float(np.abs(p_end - p).max() / np.abs(p).max()),
        float(np.abs(turn_end - turn).max() / np.abs(turn).max()),
        left[1],
    )


@pytest.fixture(scope="module")
def curved() -> tuple[float, float, float, float]:
    """A tenth of a turn of a cylinder whose patch has corners: the folds of its elements do not hold the turn back."""
    return flown(patched(ARC, INSIDE), 0.1, 0.0)


@pytest.mark.long
def test_a_curved_shell_turns(curved):
    energy, momentum, turning, left = curved
    assert energy < 1e-4 and momentum < 1e-12 and turning < 2e-5 and left < 1e-2


@pytest.mark.long
@pytest.mark.xfail(reason="C d = 0 asks directors for more than they can do where they lean: 3.6e-5 (docs/method.md, 15)", strict=True)
def test_a_curved_shell_turns_without_loss(curved):
    assert curved[0] < 2e-5


def test_the_work_of_the_tie_on_directors_is_booked():
    """The same turn: what multipliers take of directors that cannot obey them stands in the ledger, which closes as without that tie
    (1.9e-6). It did not stand there, and 3.6e-5 were open."""
    sim = start(patched(ARC, INSIDE))
    omega = np.array([100.0, 300.0, 50.0])
    set_spinning(sim, omega, np.array([3.0, -20.0, 5.0]))
    sim.advance_to(0.1 * 2 * np.pi / np.linalg.norm(omega))
    booked = sim.energies()
    assert booked["overlap"] > 2e-5 * booked["injected"]
    assert abs(booked["closed_residual_percent"]) < 3e-4


@pytest.fixture(scope="module")
def three_turns() -> tuple[float, float, float, float]:
    """COUPLING's target: e/l 0.3."""
    return flown(patched(), 3.0, 0.1)


@pytest.mark.long
def test_three_turns_with_bending(three_turns):
    energy, momentum, _, _ = three_turns
    assert energy < 1e-4 and momentum < 1e-12
    energy, momentum, turning, _ = flown(patched(directors=False), 3.0, 0.1)
    assert energy < 1e-4 and momentum < 1e-12 and turning < 1e-12


@pytest.mark.long
def test_three_turns_keep_the_angular_momentum(three_turns):
    assert three_turns[2] < 1e-6


def test_constraints_do_not_see_linear_fields():
    """On a cylinder C (1, X, N) = 0 to rounding, so no rigid motion is held back."""
    coupling = tied(start(patched(ARC, INSIDE)))
    rows, length = coupling.factor.rows, coupling.factor.rows.length[:, None]
    mine, theirs = coupling.elements.mesh, coupling.split.fine.mesh
    of_elements = np.column_stack([np.ones(len(mine.points)), mine.points, mine.node_normals])
    of_particles = np.column_stack([np.ones(len(theirs.points)), theirs.points, theirs.node_normals * length])
    size = np.abs(rows.elements).sum(axis=1).max()
    assert np.abs(rows(of_elements, of_particles)).max() < 1e-9 * size
    H = rows.elements @ (rows.elements.T / coupling.mass[0][:, None]) + rows.particles @ (rows.particles.T / coupling.mass[1][:, None])
    assert np.abs(coupling.factor.dense @ coupling.factor.dense.T - H).max() < 1e-12
    assert coupling.factor.blocks.tolist() == [0, H.shape[0]]  # one ring


def test_overlaps_that_do_not_touch_are_blocks_of_their_own():
    """Two patches, one thread for each: nothing of L leads from one to the other."""
    both = (Box(lo=(0.1, None, None), hi=(0.3, None, None)), Box(lo=(0.7, None, None), hi=(0.9, None, None)))
    factor = tied(start(patched(Plate(length=1.0, width=0.4), both, motion="in_plane"))).factor
    ends = factor.blocks
    assert len(ends) >= 3 and ends[0] == 0 and ends[-1] == len(factor.first)
    L = factor.dense
    for first, last in zip(ends[:-1], ends[1:]):
        assert not L[first:last, :first].any() and not L[last:, first:last].any()


def test_the_ledger_closes_and_the_masses_are_whole():
    """Forces shared by both parts, moments, a pressure over all, a support; the step is that of the parts alone."""
    sim = start(patched(duration=4e-3, **LOADS))
    mass = sum(of_nodes(group, "mass").sum() for group in sim.groups)
    assert mass == pytest.approx(1.0 * 0.4 * 0.03 * 7800.0, rel=1e-12)
    assert sim.dt >= 0.97 * min(group.stable.dt for group in sim.groups)  # a whole number of steps to each sample
    total = sum(of_nodes_of_load(group).sum(axis=0) for group in sim.groups)
    assert total == pytest.approx(np.array([0.0, 2e5, 1e5]), rel=1e-12, abs=1e-6)
    sim.advance_to(2e-3)
    energies = sim.energies()
    assert energies["kinetic"] > 0.05 * energies["external"] and energies["elastic"] > 0.05 * energies["external"]
    assert abs(energies["closed_residual_percent"]) < 2e-3
    assert tied(sim).left()[0] < 1e-13


@pytest.mark.long
def test_a_blow_on_the_overlap_is_booked_by_the_velocities_that_come_of_it():
    """A ball strikes elements and particles where they are tied: the tie comes after contact and changes what the blow made of velocities.
    Booked before it, 2.2 % of the ball's energy were missing."""
    place = Pinball(centre=(0.45, 0.2, 0.0551), radius=0.04)
    ball = Rigid(name="ball", mass=20.0, pinballs=[place], velocity=(0, 0, -30.0))
    sim = start(patched(rigids=[ball], duration=2e-3))
    sim.advance_to(1e-3)
    energies = sim.energies()
    assert energies["contact"] > 0.1 * energies["injected"] and energies["elastic"] > 0.1 * energies["injected"]
    assert abs(energies["closed_residual_percent"]) < 5e-3


def of_nodes_of_load(group) -> np.ndarray:
    return runtime.get(group.loads.force.total, group.nodes.n) if group.loads.pushes else np.zeros((1, 3))


PULL = {"forces": [NodalForce(body="shell", where=Box(lo=(0.99, None, None)), total=(1e5, 3e4, 0))]}


def test_restart_and_threads_in_the_plane():
    restarts_exactly(lambda: start(patched(motion="in_plane", **PULL)), 12, 12)
    threads_change_nothing(lambda threads: start(patched(motion="in_plane", **PULL), threads=threads), 12)


@pytest.mark.long
def test_one_thread_ties_as_all_do(monkeypatch):
    """Both ways of a processor give the same bits."""
    ends = []
    for few in (tie.FEW, 0):
        monkeypatch.setattr(tie, "FEW", few)
        sim = start(patched(**LOADS))
        sim.advance(12)
        ends.append({name: np.copy(values) for name, values in sim.state().items()})
    assert same_state(*ends) == []


@pytest.mark.long
def test_restart_and_threads_of_a_metal():
    material = {"strength": Perfect(yield_stress=2e8)}
    start_one = {"initial": [InitialVelocity(body="shell", where=Box(lo=(0.6, None, None)), velocity=(0, 0, 30.0))]}
    restarts_exactly(lambda: start(patched(points=1, material=material, **LOADS, **start_one)), 60, 60)
    threads_change_nothing(lambda threads: start(patched(points=1, material=material, **LOADS, **start_one), threads=threads), 60)


@pytest.mark.long
def test_single_precision():
    """The same motion to 1e-3."""
    ends = []
    for precision in ("f64", "f32"):
        sim = start(patched(precision=precision, **LOADS))
        sim.advance_to(1e-3)
        ends.append(of_nodes(tied(sim).particles, "u"))
    assert np.abs(ends[1] - ends[0]).max() < 1e-3 * np.abs(ends[0]).max()
