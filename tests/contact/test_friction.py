"""Coulomb's friction between bodies, against closed forms."""

from __future__ import annotations

from math import atan, cos, sin

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.scene import InitialVelocity, Meeting, Numerics, Pinball, PinballContact, Plate, Rigid, Scene, Shell
from taichi_sph.world.world import World

from ..balls import ball
from ..exact import restarts_exactly, same_state, threads_change_nothing
from .test_several import STEEL, THICKNESS, momentum, of, plate

G = 9.81


def floor():
    """A plane: a ball of 100 km, held."""
    return Rigid(name="floor", mass=1.0, pinballs=[Pinball(centre=(0, 0, -1e5), radius=1e5)], held=True)


def block(**more):
    """Four feet, 0.2 m apart, whose points of contact lie 0.05 m under the centre."""
    feet = [Pinball(centre=(x, y, 0.05), radius=0.05) for x in (-0.1, 0.1) for y in (-0.1, 0.1)]
    return Rigid(name="block", mass=2.0, pinballs=feet, inertia=(0.02, 0.02, 0.02), **more)


def on_floor(body, mu, slope=0.0, duration=0.5, threads=None, e=None):
    scene = Scene(
        name="rubs", title="t", source="tests", rigids=[body, floor()], duration=duration, gravity=(G * sin(slope), 0, -G * cos(slope)),
        meetings=[Meeting(between=(body.name, "floor"), friction=mu, restitution=e)],
        numerics=Numerics(spacing=0.1, contact=PinballContact(tolerance=1e-8)),
    )  # fmt: skip
    return World(scene, threads=threads)


def closed(sim):
    return abs(sim.energies()["closed_residual_percent"])


@pytest.mark.parametrize("share", [0.9, pytest.param(1.2, marks=pytest.mark.long), 3.0])
def test_a_block_on_a_slope(share):
    """It sticks below tan = mu, and slides with g (sin - mu cos) above."""
    slope = atan(0.3 * share)
    sim = on_floor(block(), 0.3, slope, duration=0.2)
    sim.advance_to(0.2)
    v, time = runtime.get(sim.rigids.v, 2)[0], sim.time - 0.5 * sim.dt
    expected = max(0.0, G * (sin(slope) - 0.3 * cos(slope))) * time
    assert v == pytest.approx([expected, 0, 0], rel=2e-3, abs=2e-5)
    if share > 1:  # normal force times mu over the way
        assert sim.energies()["friction"] == pytest.approx(0.3 * 2.0 * G * cos(slope) * 0.5 * expected * time, rel=1e-2)
    assert closed(sim) < 1e-6


def test_a_sliding_block_stops_after_v2_over_2_mu_g():
    sim = on_floor(block(velocity=(1.0, 0, 0)), 0.3)
    sim.advance_to(0.5)
    assert runtime.get(sim.rigids.v, 2)[0] == pytest.approx([0, 0, 0], abs=1e-6)
    assert runtime.get(sim.rigids.x, 2)[0, 0] == pytest.approx(1.0 / (2 * 0.3 * G), rel=2e-3)
    found = sim.energies()
    assert found["friction"] == pytest.approx(1.0, rel=1e-3) and abs(found["contact"]) < 1e-3 and closed(sim) < 1e-6


def test_a_sliding_ball_comes_to_roll():
    """After 2 v / 7 mu g it rolls with 5/7 of its speed (solid ball), and friction has taken 2/7 of its energy."""
    sim = on_floor(ball("ball", (0, 0, 0.1), (1.0, 0, 0)), 0.3)
    end = 2.0 / (7 * 0.3 * G)
    sim.advance_to(0.5 * end)
    assert runtime.get(sim.rigids.v, 2)[0, 0] == pytest.approx(1.0 - 0.3 * G * (sim.time - 0.5 * sim.dt), rel=5e-3)
    sim.advance_to(0.3)
    from taichi_sph.bodies.rigid.pool import spins

    v = runtime.get(sim.rigids.v, 2)[0, 0]
    assert v == pytest.approx(5 / 7, rel=5e-3) and spins(sim.rigids)[0, 1] == pytest.approx(v / 0.1, rel=1e-5)
    assert sim.energies()["friction"] == pytest.approx(1 / 7, rel=2e-2) and closed(sim) < 1e-6


def test_two_balls_that_graze_turn_each_other():
    """Momentum and moment of momentum of the two stay, the tangential impulse is mu times the normal one."""
    balls = ball("a", (-0.2, 0.1, 0), (3.0, 0, 0), mass=2.0), ball("b", (0.0, 0, 0))
    scene = Scene(
        name="graze", title="t", source="tests", rigids=balls, duration=0.05, numerics=Numerics(spacing=0.1),
        meetings=[Meeting(between=("a", "b"), friction=0.1, restitution=0.5)],
    )  # fmt: skip
    sim = World(scene)
    sim.advance_to(0.05)
    from taichi_sph.bodies.rigid.pool import spins

    m, v, x = runtime.get(sim.rigids.mass, 2), runtime.get(sim.rigids.v, 2), runtime.get(sim.rigids.x, 2)
    w, inertia = spins(sim.rigids), 0.4 * m * 0.1**2
    assert m @ v == pytest.approx([6.0, 0, 0], abs=1e-12)
    assert (m[:, None] * np.cross(x, v) + inertia[:, None] * w).sum(axis=0) == pytest.approx([0, 0, -0.6], abs=1e-9)
    J = m[1] * v[1]  # on the one that lay still
    tangential = inertia[1] * np.linalg.norm(w[1]) / 0.1
    assert tangential == pytest.approx(0.1 * np.sqrt(J @ J - tangential**2), rel=1e-6)
    assert closed(sim) < 1e-6 and sim.energies()["friction"] > 0


@pytest.mark.parametrize("along", [pytest.param(1.0, marks=pytest.mark.long), 40.0])
def test_a_flat_striker_drags_a_plate_along(along):
    """Plastic and flat: the impulse is M m V / (M + m), and along the plate mu times that, or what it takes to move together."""
    side, mu, M = 4e-3, 0.2, 0.01
    centres = [(x, y, 2e-3 + 0.5 * THICKNESS + 30e-6) for x in (0.0, side) for y in (0.0, side)]
    striker = Rigid(
        name="striker", mass=M, pinballs=[Pinball(centre=c, radius=2e-3) for c in centres], velocity=(along, 0, -10.0), inertia=(1, 1, 1)
    )
    shell = Shell(name="plate", surface=Plate(length=side, width=side), thickness=THICKNESS, material=STEEL, motion="free")
    scene = Scene(
        name="drags", title="t", source="tests", shells=[shell], rigids=[striker], duration=30e-6, numerics=Numerics(spacing=side),
        meetings=[Meeting(between=("striker", "plate"), friction=mu)],
    )  # fmt: skip
    sim = World(scene)
    sim.advance_to(3e-6 + 3 * sim.dt)
    m = side**2 * THICKNESS * 7800.0
    mass = M * m / (M + m)
    pushed = of(sim, "plate", "mass") @ of(sim, "plate", "v")
    assert pushed[2] == pytest.approx(-mass * 10.0, rel=1e-3)
    assert pushed[0] == pytest.approx(min(mu * mass * 10.0, mass * along), rel=1e-2)
    assert momentum(sim) == pytest.approx([M * along, 0, -M * 10.0], rel=1e-12, abs=1e-15)
    assert abs(sim.energies()["B_percent"]) < 1e-3


def rubbing_plates(along=40.0, threads=None):
    """The upper plate falls on the lower one with 20 m/s and slides along it."""
    shells = [plate("low", 0.0), plate("high", THICKNESS + 0.05e-3)]
    scene = Scene(
        name="rub", title="t", source="tests", shells=shells, duration=150e-6, numerics=Numerics(spacing=1e-3),
        initial=[InitialVelocity(body="high", velocity=(along, 0, -20.0))],
        meetings=[Meeting(between=("low", "high"), friction=0.2)],
    )  # fmt: skip
    return World(scene, threads=threads)


@pytest.mark.parametrize("along", [pytest.param(2.0, marks=pytest.mark.long), 40.0])
def test_two_plates_rub(along):
    """Equal plates: m V / 2 across, and along mu m V / 2, or m / 2 times the whole speed, after which they go together."""
    sim = rubbing_plates(along)
    before = momentum(sim)
    sim.advance_to(4e-6)
    m = of(sim, "low", "mass")
    gained = m @ of(sim, "low", "v") / m.sum()
    assert gained[2] == pytest.approx(-10.0, rel=1e-2)
    assert gained[0] == pytest.approx(min(0.2 * 10.0, 0.5 * along), rel=2e-2)
    assert momentum(sim) == pytest.approx(before, rel=1e-12, abs=1e-15)
    found, m = sim.energies(), m.sum()
    loss = 0.5 * m * 20.0**2 / 2
    assert found["contact"] == pytest.approx(loss, rel=2e-2)
    slid = 0.2 * 10.0 * m * (along - 0.2 * 10.0) if along > 4 else 0.25 * m * along**2
    assert found["friction"] == pytest.approx(slid, rel=5e-2)
    assert abs(found["B_percent"]) < 1e-3


@pytest.mark.long
def test_restart_is_exact():
    restarts_exactly(rubbing_plates, 40, 40)


@pytest.mark.long
def test_one_thread_and_all_of_them_find_the_same_bits(monkeypatch):
    """Short lists of pairs are solved by one thread in one call, long ones by loops of all."""
    states = []
    for few in (10**6, 0):
        monkeypatch.setattr("taichi_sph.couplings.contact.multipliers.SMALL_LIST", few)
        sim = rubbing_plates()
        sim.advance(60)
        states.append(sim.state())
    assert same_state(*states) == [] and sim.contact.all_iterations > 0


@pytest.mark.long
def test_the_number_of_threads_changes_nothing():
    threads_change_nothing(lambda threads: rubbing_plates(threads=threads), 80)


@pytest.mark.long
def test_scenes_without_friction_have_no_entry_for_it():
    sim = on_floor(block(velocity=(1.0, 0, 0)), 0.0, duration=0.05)
    sim.advance_to(0.05)
    assert "friction" not in sim.energies()
    assert runtime.get(sim.rigids.v, 2)[0, 0] == pytest.approx(1.0, abs=1e-6)
