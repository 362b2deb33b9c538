"""Rigid bodies that go their way whatever pushes them: platens, shaken anvils, spinning arms."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.scene import Driven, Pinball, Ramp, Rigid, TimeTable

from ..balls import ball, start
from ..exact import restarts_exactly


def velocities(sim):
    return runtime.get(sim.rigids.v, sim.rigids.n)


def closed(sim) -> float:
    return abs(sim.energies()["closed_residual_percent"])


@pytest.mark.long
@pytest.mark.parametrize("e", [0.0, 1.0])
def test_a_ball_leaves_a_platen_as_newton_says(e):
    """A wall that moves at 3 m/s: the ball that waits for it leaves at 3 (1 + e); what that takes is the work of the drive."""
    platen = ball("platen", (-0.3, 0, 0), mass=1e-3, restitution=e, driven=Driven(velocity=(3.0, 0, 0)))
    sim = start(platen, ball("b", (0, 0, 0), mass=2.0))
    sim.advance_to(0.1)
    v = velocities(sim)
    assert v[0] == pytest.approx([3.0, 0, 0], abs=0) and v[1] == pytest.approx([3.0 * (1 + e), 0, 0], abs=1e-9)
    assert runtime.get(sim.rigids.x, 2)[0] == pytest.approx([-0.3 + 3.0 * sim.time, 0, 0], abs=1e-12)
    found = sim.energies()
    gained = 0.5 * 2.0 * (3.0 * (1 + e)) ** 2
    lost = 0.5 * 2.0 * 9.0 * (1 - e)  # the plastic impact against an infinite mass
    assert found["external"] == pytest.approx(gained + lost, rel=1e-6)
    assert found["contact"] == pytest.approx(lost, rel=1e-6, abs=1e-9) and closed(sim) < 1e-6


def test_a_history_is_followed_and_gravity_does_not_matter():
    """Shaken to and fro: the place is the integral of the velocity, and the work of the drive against gravity closes the ledger."""
    table = TimeTable(points=((0.0, 0.0), (0.02, 1.0), (0.06, -1.0), (0.1, 0.5)))
    sim = start(ball("anvil", (0, 0, 0), driven=Driven(velocity=(0.5, 0, 2.0), history=table)), gravity=(0, 0, -9.81))
    times, factors = np.array(table.points).T
    for end in (0.03, 0.1):
        sim.advance_to(end)
        t = np.linspace(0, sim.time, 20001)
        way = np.trapezoid(np.interp(t, times, factors), t)
        assert runtime.get(sim.rigids.x, 1)[0] == pytest.approx([0.5 * way, 0, 2.0 * way], abs=2e-5)
        assert closed(sim) < 1e-6


def test_a_driven_arm_turns_at_its_rate():
    """Two balls on an oblique line, turned about z: after a quarter turn they stand a quarter further; the arm keeps its energy."""
    rate = 0.5 * np.pi / 0.1
    balls = [Pinball(centre=(0.1 * s, 0, 0.05 * s), radius=0.02) for s in (1, -1)]
    sim = start(Rigid(name="arm", mass=1.0, pinballs=balls, driven=Driven(spin=(0, 0, rate))))
    sim.advance_to(0.1)
    angle = rate * sim.time
    first = sim.rigids.ball_places()[0]
    assert first == pytest.approx([0.1 * np.cos(angle), 0.1 * np.sin(angle), 0.05], abs=1e-9)
    inertia = 0.1**2 + 0.4 * 0.02**2
    assert sim.energies()["kinetic"] == pytest.approx(0.5 * inertia * rate**2, rel=1e-9) and closed(sim) < 1e-9
    assert sim.frame().body("arm").point_data["velocity"][0] == pytest.approx(
        0.1 * rate * np.array([-np.sin(angle), np.cos(angle), 0]), abs=2e-2
    )


def test_restart_is_exact():
    platen = ball("platen", (-0.25, 0, 0), driven=Driven(velocity=(3.0, 0, 0), spin=(0, 1.0, 0), history=Ramp(rise=0.02)))
    restarts_exactly(lambda: start(platen, ball("b", (0, 0, 0)), ball("c", (0.25, 0.02, 0))), 30, 30)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"driven": {}}, "velocity and spin are all 0: a body that stays is held = true"),
        ({"driven": Driven(velocity=(1, 0, 0)), "held": True}, "driven: rigid 'a' is held in place as well; leave one out"),
        ({"driven": Driven(velocity=(1, 0, 0)), "velocity": (0, 1, 0)}, "driven: rigid 'a' has a velocity or spin of its own as well"),
    ],
)
def test_what_cannot_be(more, words):
    with pytest.raises(ValueError, match=words):
        ball("a", (0, 0, 0), **more)
