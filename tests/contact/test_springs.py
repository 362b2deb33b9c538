"""Springs and dampers between bodies and the ground, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.errors import SceneError
from taichi_sph.run.plan import plan
from taichi_sph.scene import Material, Numerics, Plate, Scene, Shell, Spring
from taichi_sph.world.world import World

from .. import balls
from ..exact import restarts_exactly
from ..shells import STEEL

K, M = 800.0, 2.0


def ball(name: str, x: float, mass: float, **more):
    return balls.ball(name, (x, 0, 0), mass=mass, radius=0.05, **more)


def world(springs, rigids, duration: float = 1.0, safety: float = 0.9, **more):
    return balls.start(*rigids, duration=duration, springs=springs, threads=1, spacing=0.01, time_step_safety=safety, **more)


def place(sim, r: int = 0) -> np.ndarray:
    return runtime.get(sim.rigids.x, sim.rigids.n)[r]


def to_ground(**more) -> Spring:
    return Spring(**{"name": "s", "between": ("a", None), "points": ((0, 0, 0), (-0.5, 0, 0)), "stiffness": K} | more)


def swing(spring: Spring, v: float, duration: float = 1.0, safety: float = 0.1, **more):
    """Times and places of ball a, thrown with v along x; and its world."""
    sim = world([spring], [ball("a", 0.0, M, velocity=(v, 0, 0))], duration, safety, **more)
    rows = [(sim.time, *place(sim))]
    while sim.time < duration * (1 - 1e-9):
        sim.advance(1)
        rows.append((sim.time, *place(sim)))
    return np.array(rows), sim


def test_a_ball_on_a_spring_swings_with_its_period():
    rows, sim = swing(to_ground(), 1.0)
    omega = math.sqrt(K / M)
    assert rows[:, 1] == pytest.approx(np.sin(omega * rows[:, 0]) / omega, abs=0.02 / omega)
    energies = sim.energies()
    assert abs(energies["closed_residual_percent"]) < 1e-9 and energies["elastic"] > 0
    assert sim.dt_rule == "springs" and sim.dt <= 0.1 * 2 / omega


def test_a_spring_softer_than_the_bodies_does_not_name_the_step():
    """It shortens the step of the sheet a little; what rules the step is the sheet."""
    sheet = Shell(name="sheet", surface=Plate(length=0.1, width=0.1), thickness=1e-3, material=Material(**STEEL), motion="free")
    scene = Scene(
        name="soft",
        title="a soft spring",
        source="tests",
        shells=[sheet],
        rigids=[ball("a", 0.5, M)],
        springs=[to_ground(points=((0.5, 0, 0), (-0.5, 0, 0)))],
        duration=1e-4,
        numerics=Numerics(spacing=0.01),
    )
    sim = World(scene, threads=1)
    (alone,) = (step for group in sim.groups for step in group.longest_step().values())
    assert longest(sim) > 100 * alone
    assert "omega_max" in sim.dt_rule and sim.longest < alone
    assert sim.longest == pytest.approx((longest(sim) ** -2 + alone**-2) ** -0.5, rel=1e-12)


@pytest.mark.parametrize(
    "more",
    [
        {"damping": 1e9},
        {"damping": 1e300},
        {"stiffness": 1e300},
        {"stiffness": 1e20, "between": (None, "a"), "points": ((-0.5, 0, 0), (0, 0, 0))},
    ],
)
def test_a_spring_that_asks_for_too_many_steps_is_refused_before_the_run(more):
    scene = Scene(
        name="s", title="s", source="tests", rigids=[ball("a", 0.0, M)], springs=[to_ground(**more)], duration=1.0,
        numerics=Numerics(spacing=0.01),
    )  # fmt: skip
    with pytest.raises(SceneError, match=r"time steps of .* which 's' asks for; at most 20 million"):
        plan(scene)


def test_the_plan_knows_the_step_of_a_spring():
    """As the run has it, to the masses that are known."""
    scene = Scene(
        name="s", title="s", source="tests", rigids=[ball("a", 0.0, M)], springs=[to_ground(damping=30.0)], duration=1.0,
        numerics=Numerics(spacing=0.01, time_step_safety=0.5),
    )  # fmt: skip
    zeta = 30.0 / (2 * math.sqrt(K * M))
    longest = 0.5 * 2 / math.sqrt(K / M) * (math.sqrt(1 + zeta**2) - zeta)
    assert plan(scene).dt == pytest.approx((longest**-2 + 0.01**-2) ** -0.5, rel=1e-9)
    assert World(scene, threads=1).longest <= longest


def test_damping_takes_what_the_closed_form_says():
    c = 8.0
    rows, sim = swing(to_ground(damping=c), 1.0)
    delta, omega = c / (2 * M), math.sqrt(K / M - (c / (2 * M)) ** 2)
    t = rows[:, 0]
    assert rows[:, 1] == pytest.approx(np.exp(-delta * t) * np.sin(omega * t) / omega, abs=0.02 / omega)
    energies = sim.energies()
    assert energies["damped"] == pytest.approx(0.5 * M * (1 - math.exp(-2 * delta)), rel=0.05)
    assert abs(energies["closed_residual_percent"]) < 1e-9


@pytest.mark.parametrize(("only", "free"), [("pull", -1.0), ("push", 1.0)])
def test_a_spring_that_only_pulls_or_pushes_lets_go(only, free):
    """Thrown to the side that the spring does not resist, the ball keeps its speed."""
    rows, sim = swing(to_ground(only=only), free, 0.2)
    assert rows[-1, 1] == pytest.approx(free * 0.2, rel=1e-9) and sim.energies()["elastic"] == 0.0
    rows, _ = swing(to_ground(only=only), -free, 0.2)
    assert abs(rows[:, 1]).max() < 1.05 / math.sqrt(K / M)


def longest(sim) -> float:
    """The longest step of the springs alone [s]."""
    return min(step for coupling in sim.couplings for step in coupling.longest_step().values())


def swings(springs: list[Spring], steps: float, **thrown) -> float:
    """How far ball a gets in 400 steps of so many times the longest one [m]."""
    sim = world(springs, [ball("a", 0.0, M, **thrown)], safety=1.0)
    dt = steps * longest(sim)
    for _ in range(400):
        sim.dt = dt
        sim.take(sim.clock.dt_before, dt)
        sim.clock.dt_before = dt
        if not np.isfinite(place(sim)).all() or abs(place(sim)).max() > 10.0:
            return math.inf
    return float(abs(place(sim)).max())


@pytest.mark.parametrize(
    ("springs", "thrown", "below", "above"),
    [
        ([to_ground()], {"velocity": (1.0, 0, 0)}, 1.0, math.inf),
        ([to_ground(name=f"s{k}") for k in range(4)], {"velocity": (1.0, 0, 0)}, 1.0, math.inf),  # omega^2 = 4 k / m
        (
            [to_ground(name=f"s{x}", points=((0, 0, 0), (x, 0, 0)), stiffness=0.0, preload=400.0) for x in (-0.5, 0.5)],
            {"velocity": (0, 0.1, 0)},
            0.02,  # m; v / omega is 0.0035
            0.04,  # the farther out, the softer
        ),
    ],
)
def test_the_longest_step_is_that_of_all_springs_of_a_body(springs, thrown, below, above):
    """Just below the limit the ball swings, a tenth above it flies off: several springs, and the stiffness across a pull."""
    assert swings(springs, 0.98, **thrown) < below
    assert swings(springs, 1.1, **thrown) >= above


def test_a_spring_at_the_rim_turns_its_ball_too():
    """k (1/m + r^2 / I), I = 2/5 m R^2 and r = R: 3.5 k / m. The ball is made to turn about the point of the spring."""
    radius = 0.05
    spring = Spring(name="s", between=("a", None), points=((0, radius, 0), (-0.5, radius, 0)), stiffness=K)
    sim = world([spring], [ball("a", 0.0, M)], safety=1.0)
    assert longest(sim) == pytest.approx(2.0 / math.sqrt(3.5 * K / M), rel=1e-9)
    assert swings([spring], 0.98, spin=(0, 0, 1.0)) < 1.0


def test_preload_and_gravity_balance():
    """Hung under its own weight from a spring with that preload, the ball stays."""
    g = 9.81
    hung = Spring(name="s", between=("a", None), points=((0, 0, 0), (0, 0, 0.5)), stiffness=K, preload=M * g)
    rows, _ = swing(hung, 0.0, 0.5, gravity=(0, 0, -g))
    assert abs(rows[:, 1:]).max() < 1e-12


def test_two_balls_keep_momentum_and_moment_of_momentum():
    spring = Spring(name="s", between=("a", "b"), points=((0, 0.03, 0), (0.4, -0.02, 0)), stiffness=K, damping=3.0, length=0.3)
    sim = world([spring], [ball("a", 0.0, 1.0, velocity=(0, 0.3, 0)), ball("b", 0.4, 3.0, spin=(0, 0, 5.0))], safety=0.05)
    r = sim.rigids

    def sums():
        m, x, v, L = (runtime.get(f, 2) for f in (r.mass, r.x, r.v, r.L))
        return (m[:, None] * v).sum(axis=0), (m[:, None] * np.cross(x, v) + L).sum(axis=0)

    before = sums()
    sim.advance(200)
    after = sums()
    assert after[0] == pytest.approx(before[0], abs=1e-12)
    # x is at n + 1 and v at n + 1/2: forces turn with the line between, so the moment is kept to second order
    assert after[1] == pytest.approx(before[1], abs=2e-3)
    assert abs(sim.energies()["closed_residual_percent"]) < 0.5


def test_a_restart_goes_on_exactly():
    def start():
        spring = Spring(name="s", between=("a", "b"), points=((0, 0.03, 0), (0.4, -0.02, 0)), stiffness=K, damping=3.0, only="pull")
        return world([spring], [ball("a", 0.0, 1.0, velocity=(-1, 0.3, 0)), ball("b", 0.4, 3.0, spin=(0, 0, 5.0))])

    restarts_exactly(start, 30, 30)


def test_the_watchdog_is_not_woken_by_rounding():
    """Balls at rest on a spring of their own distance, but for its last bit: 1e-28 J come and go, which is no energy from nowhere."""
    spring = Spring(name="s", between=("a", "b"), points=((0.1, 0, 0), (0.4, 0, 0)), length=0.3, stiffness=1e6)
    sim = world([spring], [ball("a", 0.1, M), ball("b", 0.4, M)], duration=0.1)
    sim.advance(200)
    energies, nothing = sim.energies(), sum(group.negligible(sim.dt) for group in sim.groups)
    print({k: energies[k] for k in ("kinetic", "elastic", "closed_residual_percent")}, nothing)
    assert 0.0 < abs(energies["kinetic"]) + energies["elastic"] < nothing < 1e-15
