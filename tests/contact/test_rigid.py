"""Rigid bodies and their contact, against mechanics."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.scene import Numerics, Pinball, PinballContact, Rigid, Scene

from ..balls import ball, start
from ..exact import restarts_exactly


def velocities(sim):
    return runtime.get(sim.rigids.v, sim.rigids.n)


def momentum(sim):
    return runtime.get(sim.rigids.mass, sim.rigids.n) @ velocities(sim)


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_two_balls_that_meet_head_on_part_as_newton_says(e):
    a = ball("a", (-0.2, 0, 0), (3.0, 0, 0), mass=2.0, restitution=e)
    b = ball("b", (0.2, 0, 0), (-1.0, 0, 0), mass=0.5)
    sim = start(a, b)
    sim.advance_to(0.1)
    common = (2.0 * 3.0 - 0.5 * 1.0) / 2.5
    v = velocities(sim)
    assert v[0] == pytest.approx([common - e * 0.5 / 2.5 * 4.0, 0, 0], abs=1e-9)
    assert v[1] == pytest.approx([common + e * 2.0 / 2.5 * 4.0, 0, 0], abs=1e-9)
    entries = sim.energies()
    loss = 0.5 * (2.0 * 0.5 / 2.5) * (1 - e**2) * 4.0**2
    assert entries["contact"] == pytest.approx(loss, rel=1e-9, abs=1e-12)
    assert abs(entries["closed_residual_percent"]) < 1e-9


def test_an_oblique_impact_leaves_the_tangential_speed_alone():
    n, t = np.array([0.6, 0.8, 0.0]), np.array([-0.8, 0.6, 0.3])
    u = 2.0 * n + t
    sim = start(ball("a", tuple(-0.15 * n), tuple(u), restitution=1.0), ball("b", tuple(0.15 * n)))
    sim.advance_to(0.1)
    # the line of centres when they touch: |-0.3 n + u s| = 0.2
    s = np.roots([u @ u, -2 * 0.3 * (n @ u), 0.3**2 - 0.2**2]).min()
    line = (0.3 * n - u * s) / 0.2
    v = velocities(sim)
    assert v[1] == pytest.approx((u @ line) * line, abs=2e-2)  # found within a step, in which the line turns by 1 deg
    assert v.sum(axis=0) == pytest.approx(u, abs=1e-12)
    assert (v**2).sum() == pytest.approx(u @ u, rel=1e-9)


def test_the_largest_force_of_all_steps_is_kept():
    """A knock lasts one step: a row of the history taken long after still has its force, and the next one has not."""
    sim = start(ball("a", (-0.15, 0, 0), (1.0, 0, 0)), ball("b", (0.15, 0, 0)), duration=0.2)
    sim.advance_to(0.15)
    pushed = runtime.get(sim.rigids.v, 2)[1, 0] * runtime.get(sim.rigids.mass, 2)[1] / sim.dt
    again = sim.state()["rigid.f_max"].copy()
    rows = sim.tracks()
    assert pushed > 0 and rows["rigid_a"]["fx"] == 0.0
    assert [rows[f"rigid_{name}"]["f_max"] for name in "ab"] == pytest.approx([pushed, pushed], rel=1e-9)
    assert np.array_equal(again, [row["f_max"] for row in rows.values()])  # a restart has it too
    assert sim.tracks()["rigid_a"]["f_max"] == 0.0


def test_a_grazing_ball_passes_untouched():
    sim = start(ball("a", (-0.5, 0.2001, 0), (5.0, 0, 0)), ball("b", (0, 0, 0)), duration=0.2)
    sim.advance_to(0.2)
    assert velocities(sim) == pytest.approx(np.array([[5.0, 0, 0], [0, 0, 0]]), abs=0)


def test_a_stack_stands():
    """Five balls on a held one: each contact carries what lies above it, and nothing sinks."""
    floor = ball("floor", (0, 0, -0.5), radius=0.5, held=True, mass=100.0)
    stack = [ball(f"b{k}", (0, 0, 0.1 + 0.2 * k)) for k in range(5)]
    sim = start(floor, *stack, duration=0.2, gravity=(0, 0, -9.81), contact=PinballContact(tolerance=1e-8))
    sim.advance_to(0.2)
    z = runtime.get(sim.rigids.x, 6)[1:, 2]
    assert z == pytest.approx([0.1 + 0.2 * k for k in range(5)], abs=1e-6)
    assert runtime.get(sim.rigids.force, 6)[0, 2] == pytest.approx(-5 * 9.81, rel=1e-6)
    assert sim.contact.unsolved == 0


def test_a_wedge_parts_two_blocks():
    """A ball pressed between two equal ones pushes them apart evenly; momentum along the others stays 0."""
    bodies = ball("wedge", (0, 0, 0.18), (0, 0, -2.0)), ball("left", (-0.101, 0, 0)), ball("right", (0.101, 0, 0))
    sim = start(*bodies, duration=0.05)
    sim.advance_to(0.05)
    v = velocities(sim)
    assert v[1, 0] < -0.1 and v[2, 0] == pytest.approx(-v[1, 0], rel=1e-6)
    assert momentum(sim) == pytest.approx([0, 0, -2.0], abs=1e-12)
    assert sim.contact.penetration < 1e-4


def test_a_free_body_keeps_spin_energy_and_momentum():
    """A dumb-bell and a lone third ball: torque-free tumbling of unequal moments over many turns."""
    body = Rigid(
        name="body",
        mass=1.0,
        pinballs=[Pinball(centre=(x, y, 0), radius=0.1) for x, y in ((-0.3, 0), (0.3, 0), (0, 0.4))],
        velocity=(1.0, 0, 0),
        spin=(3.0, 4.0, 5.0),
    )
    sim = start(body, duration=2.0)
    from taichi_sph.bodies.rigid.pool import spins

    assert sim.dt < 2e-3  # the spin rules it
    sim.dt = 1e-3
    L = body.moments @ np.array([3.0, 4.0, 5.0])
    low, high = 1.0, 1.0
    energy = 0.5 * L @ np.array([3.0, 4.0, 5.0])
    for _ in range(20):
        sim.advance(100)
        ratio = 0.5 * L @ spins(sim.rigids)[0] / energy
        low, high = min(low, ratio), max(high, ratio)
    assert np.array_equal(runtime.get(sim.rigids.L, 1)[0], L)
    assert 1 - 1e-5 < low and high < 1 + 1e-5
    assert abs(sim.energies()["closed_residual_percent"]) < 1e-3
    assert runtime.get(sim.rigids.x, 1)[0] == pytest.approx(body.centre + [2.0, 0, 0], abs=1e-9)


def test_restart_is_exact():
    balls = (ball("a", (-0.2, 0.02, 0), (3.0, 0, 0), restitution=0.3), ball("b", (0.2, 0, 0)), ball("c", (0.5, 0, 0)))
    restarts_exactly(lambda: start(*balls, duration=0.2), 40, 40)


def test_bodies_that_start_in_each_other_are_refused():
    from taichi_sph.errors import SceneError

    with pytest.raises(SceneError, match="rigid 'b' starts 20 mm inside rigid 'a'"):
        start(ball("a", (0, 0, 0)), ball("b", (0.18, 0, 0)))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"inertia": (1.0, 1.0, 5.0)}, "no body has one moment above the sum"),
        ({"held": True}, "cannot have a velocity"),
        ({"mass": 1e9}, "check the units"),
        ({"mass": -1.0}, "mass"),
    ],
)
def test_bad_rigid_bodies_are_refused_in_words(changes, said):
    with pytest.raises(ValueError, match=said):
        ball("a", (0, 0, 0), (1.0, 0, 0), **changes)


def test_contact_in_the_first_step_is_booked_from_the_energy_given():
    """Touching at t = 0: what is injected is 1/2 M V^2, and the plastic loss is all booked."""
    sim = start(ball("a", (-0.1, 0, 0), (4.0, 0, 0), mass=2.0), ball("b", (0.1, 0, 0)))
    sim.advance(5)
    entries = sim.energies()
    assert entries["injected"] == pytest.approx(16.0, rel=1e-12)
    assert entries["contact"] == pytest.approx(0.5 * (2.0 / 3.0) * 16.0, rel=1e-9)
    assert abs(entries["closed_residual_percent"]) < 1e-9


def test_settings_of_contact_where_nothing_meets_are_refused():
    with pytest.raises(ValueError, match="no two bodies of this scene can meet"):
        Scene(
            name="plate",
            title="t",
            source="tests",
            shells=[{"name": "p", "surface": {"kind": "plate", "length": 1, "width": 1}, "thickness": 0.01,
                     "material": {"name": "s", "young": 2e11, "poisson": 0.3, "density": 7800}}],
            duration=1e-3,
            numerics=Numerics(spacing=0.1, contact=PinballContact()),
        )  # fmt: skip
