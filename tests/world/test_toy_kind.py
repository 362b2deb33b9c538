"""What a kind of body is: one folder and nothing else, shown by a kind that this file brings along.

`Bob` and `Bobs` are a whole kind: a mass on a spring that holds it to its place. Nothing in the package knows of them, and yet they move,
meet a rigid ball, restart bit for bit, have frames and close the ledger.
"""

import numpy as np
import pytest

from taichi_sph import bodies, runtime
from taichi_sph.bodies.body import Entries, Rest, Span
from taichi_sph.bodies.surface import Balls, Surface
from taichi_sph.frame import NO_CELLS, BodyFrame
from taichi_sph.pool import Pool
from taichi_sph.runtime import ti
from taichi_sph.scene import Numerics, Pinball, Rigid, Scene
from taichi_sph.scene.base import Body, Point
from taichi_sph.scene.kinds import Kind
from taichi_sph.world.world import World

from ..exact import restarts_exactly

# --- the kind: what a user says, the group, its surface, its kernels -----------------------------------------------------------------


class Bob(Body):
    kind: str = "bob"
    place: Point
    mass: float
    stiffness: float
    radius: float = 0.05


@ti.data_oriented
class Bobs(Rest, Pool):
    kind = "bob"

    def __init__(self, said):
        Pool.__init__(self, "bobs")
        self.said, self.n = said, len(said)
        self.bodies = [Span(bob.name, k, 1) for k, bob in enumerate(said)]
        self.home, self.mass, self.stiffness = (np.array([getattr(b, k) for b in said], float) for k in ("place", "mass", "stiffness"))
        self.x = self.field("x", self.n, 3, "f64", unit="m", keeps=True)
        self.v = self.field("v", self.n, 3, "f64", unit="m/s", keeps=True)
        self.f = self.field("f", self.n, 3, "f64", unit="N")
        self.energy = self.field("energy", self.n, 2, "f64", unit="J", doc="kinetic, elastic", keeps=True)
        self.given_by = [self.field(name, self.n, *size, "f64") for name, *size in (("home", 3), ("mass", 0), ("stiffness", 0))]
        for field, values in zip(self.given_by, (self.home, self.mass, self.stiffness)):
            runtime.put(field, values)
        runtime.put(self.x, self.home)

    def pools(self):
        return [self]

    def start(self):
        """All is there."""

    def force(self, now):
        _pull(self, *self.given_by, self.n)

    def move(self, now):
        _drift(self, self.given_by[1], self.n, now.dt_before, now.dt)

    def longest_step(self):
        return {"the bobs": 0.1 * float(np.sqrt(self.mass / self.stiffness).min())}

    def entries(self):
        kinetic, elastic = runtime.get(self.energy, self.n).sum(axis=0)
        return Entries(kinetic, 0.0, {"elastic": elastic})

    def frames(self):
        x, v = runtime.get(self.x, self.n), runtime.get(self.v, self.n)
        radius = [np.array([bob.radius]) for bob in self.said]
        return [
            BodyFrame(b.name, x[[k]], NO_CELLS, {"reference": self.home[[k]], "velocity": v[[k]], "radius": radius[k]}, {}, kind="bob")
            for k, b in enumerate(self.said)
        ]

    def surface(self):
        return BobSurface(self)


class BobSurface(Surface):
    few = True

    def __init__(self, bobs):
        self.group, self.bodies, self.n, self.bounce = bobs, bobs.bodies, bobs.n, [0.0] * bobs.n
        radius = np.array([bob.radius for bob in bobs.said])
        self.length, one = 0.5 * float(radius.min()), np.arange(bobs.n)
        self.balls = Balls(one, one, np.column_stack([radius, radius]))

    def look(self, port, places):
        _look(port, self.group, self.n, self.first.body, self.first.ball)

    def offer(self, port, first, last, now):
        _offer(port, self.group, self.group.given_by[1], first, last, self.first.mover, now.kick)

    def take(self, port, first, last, now):
        _take(port, self.group, first, last, self.first.mover, 1.0 / now.kick)


@ti.kernel
def _pull(bobs: ti.template(), home: ti.template(), mass: ti.template(), stiffness: ti.template(), n: ti.i32):
    for k in range(n):
        bobs.f[k] = stiffness[k] * (home[k] - bobs.x[k])
        bobs.energy[k][1] = 0.5 * stiffness[k] * (home[k] - bobs.x[k]).norm_sqr()


@ti.kernel
def _drift(bobs: ti.template(), mass: ti.template(), n: ti.i32, dt_before: ti.f64, dt: ti.f64):
    for k in range(n):
        before = bobs.v[k]
        after = before + 0.5 * (dt_before + dt) / mass[k] * bobs.f[k]
        bobs.v[k], bobs.x[k] = after, bobs.x[k] + dt * after
        if dt_before == 0.0:
            before = 2.0 * before - after  # v was given at t = 0
        bobs.energy[k][0] = 0.5 * mass[k] * before.dot(after)


@ti.kernel
def _look(port: ti.template(), bobs: ti.template(), n: ti.i32, body: ti.i32, ball: ti.i32):
    for k in range(n):
        port.speed[body + k], port.ball_x[ball + k] = bobs.v[k].norm(), bobs.x[k]


@ti.kernel
def _offer(port: ti.template(), bobs: ti.template(), mass: ti.template(), first: ti.i32, last: ti.i32, base: ti.i32, kick: ti.f64):
    for m in range(first, last):
        k = port.who[m] - base
        port.x[m], port.before[m], port.free[m] = bobs.x[k], bobs.v[k], bobs.v[k] + kick / mass[k] * bobs.f[k]
        port.ease[m] = ti.Vector([1.0, 1.0, 1.0], ti.f64) / mass[k]


@ti.kernel
def _take(port: ti.template(), bobs: ti.template(), first: ti.i32, last: ti.i32, base: ti.i32, per_kick: ti.f64):
    for m in range(first, last):
        bobs.f[port.who[m] - base] += per_kick * port.impulse[m]


# --- what it shows -----------------------------------------------------------------------------------------------------------------


@pytest.fixture(autouse=True)
def kind():
    bodies.register(Kind("bob", "others", Bob, lambda scene, groups: [Bobs(said)] if (said := scene.others) else []))
    yield
    bodies.kinds.registered.clear()


def start(speed: float = 1.0, threads: int = 1) -> World:
    """Two bobs on a line, a ball that flies at the first one."""
    bobs = [{"kind": "bob", "name": f"bob{k}", "place": (0.2 * k, 0, 0), "mass": 1.0, "stiffness": 400.0} for k in range(2)]
    ball = Rigid(name="ball", mass=0.5, pinballs=[Pinball(centre=(-0.12, 0, 0), radius=0.05)], velocity=(speed, 0, 0))
    scene = Scene(name="bobs", title="Bobs", source="tests", duration=0.4, others=bobs, rigids=[ball], numerics=Numerics(spacing=0.01))
    return World(scene, threads=threads)


def test_it_moves_and_meets_a_ball():
    """A plastic blow: ball and bob go on together at v m / (m + M), and the ledger books what is missing."""
    world = start()
    bob = world.groups[-1]
    world.advance_to(0.03)  # the ball has 20 mm to go
    v = runtime.get(bob.v, 2)[0, 0]
    assert v == pytest.approx(1.0 / 3.0, rel=0.03) and v == pytest.approx(runtime.get(world.rigids.v, 1)[0, 0], rel=0.03)
    assert world.energies()["contact"] == pytest.approx(0.5 * 0.5 * 1.0 * (1 - 1 / 3), rel=0.05)
    assert abs(world.energies()["closed_residual_percent"]) < 1.0


def test_it_swings_with_its_period():
    """Alone after the blow (the ball has bounced off nothing: it stays behind), omega = sqrt(k / m)."""
    world = start(speed=0.0)
    runtime.put(world.groups[-1].v, np.array([[0, 1.0, 0], [0, 0, 0]]))
    rows = []
    for _ in range(60):
        world.advance(1)
        rows.append((world.time, runtime.get(world.groups[-1].x, 2)[0, 1]))
    t, y = np.array(rows).T
    assert y == pytest.approx(np.sin(20.0 * t) / 20.0, abs=2e-3)


def test_it_restarts_bit_for_bit():
    restarts_exactly(start, 12, 12)


def test_it_has_frames_and_a_place_in_the_status():
    world = start()
    world.advance(20)
    frame = world.frame()
    assert [b.name for b in frame.bodies] == ["ball", "bob0", "bob1"] and frame.body("bob0").kind == "bob"
    assert frame.body("bob0").points[0, 0] > 0 and world.dt_rule == "the bobs"
