"""What a kind of body is: one folder and nothing else, shown by a kind that this file brings along.

`Bob` and `Bobs` are a whole kind: a mass on a spring that holds it to its place. Nothing in the package knows of them, and yet they move,
meet a rigid ball, bear forces, gravity and springs, restart bit for bit, have frames and close the ledger. `Stone` is a second kind that
says almost nothing of itself.
"""

from typing import ClassVar

import numpy as np
import pytest

from taichi_sph import bodies, runtime
from taichi_sph.bodies.body import Entries, Rest, Span
from taichi_sph.bodies.masses import MassSurface
from taichi_sph.errors import SceneError
from taichi_sph.frame import NO_CELLS, BodyFrame
from taichi_sph.geometry.regions import inside
from taichi_sph.pool import Pool
from taichi_sph.run.plan import plan
from taichi_sph.runtime import ti
from taichi_sph.scene import Ball, NodalForce, Numerics, Output, Pinball, Probe, Rigid, Scene, Spring
from taichi_sph.scene.base import Body, Point
from taichi_sph.scene.kinds import Kind
from taichi_sph.world.world import World

from ..exact import restarts_exactly

# --- the kind: what a user says, the group, its kernels ------------------------------------------------------------------------------


class Bob(Body):
    bears: ClassVar[frozenset[str]] = frozenset({"forces", "probes"})
    what: ClassVar[str] = "bob"
    holds_springs: ClassVar[bool] = True
    kind: str = "bob"
    place: Point
    mass: float
    stiffness: float
    radius: float = 0.05

    def places(self):
        return np.array([self.place])


class Bobs(Rest, Pool):
    kind = "bob"

    def __init__(self, scene, said):
        Pool.__init__(self, "bobs")
        self.said, self.n, n = said, len(said), len(said)
        self.bodies = [Span(bob.name, k, 1) for k, bob in enumerate(said)]
        forces = np.zeros((n, 3))
        for k, bob in enumerate(said):
            for load in scene.loads_of("forces", bob.name):
                if inside(load.where, bob.places()).all():
                    forces[k] += load.total
            forces[k] += bob.mass * np.array(scene.gravity or (0.0, 0.0, 0.0))
        self.x = self.field("x", n, 3, "f64", unit="m", keeps=True)
        self.v = self.field("v", n, 3, "f64", unit="m/s", keeps=True)
        self.f = self.field("f", n, 3, "f64", unit="N")
        self.home = self.field("home", n, 3, "f64", unit="m")
        self.load = self.field("load", n, 3, "f64", unit="N", doc="forces of the scene, and weight")
        self.mass = self.field("mass", n, dtype="f64", unit="kg")
        self.stiffness = self.field("stiffness", n, dtype="f64", unit="N/m")
        self.energy = self.field("energy", n, 3, "f64", unit="J", doc="kinetic, elastic, done by the load", keeps=True)
        for field, key in ((self.x, "place"), (self.home, "place"), (self.mass, "mass"), (self.stiffness, "stiffness")):
            runtime.put(field, np.array([getattr(bob, key) for bob in said], float))
        runtime.put(self.load, forces)

    def pools(self):
        return [self]

    def force(self, now):
        _pull(self, self.n)

    def move(self, now):
        _drift(self, self.n, now.dt_before, now.dt)

    def longest_step(self):
        return {"the bobs": min(0.1 * float(np.sqrt(bob.mass / bob.stiffness)) for bob in self.said)}

    def entries(self):
        kinetic, elastic, done = runtime.get(self.energy, self.n).sum(axis=0)
        return Entries(kinetic, done, {"elastic": elastic})

    def frames(self):
        x, v, home = (runtime.get(field, self.n) for field in (self.x, self.v, self.home))
        return [
            BodyFrame(
                b.name, x[[k]], NO_CELLS, {"reference": home[[k]], "velocity": v[[k]], "radius": np.array([b.radius])}, {}, kind="bob"
            )
            for k, b in enumerate(self.said)
        ]

    def probed(self, point, name=None):
        return next(span.first for span in self.bodies if name in (None, span.name))

    def probe(self, i):
        u, v = runtime.get(self.x, self.n)[i] - runtime.get(self.home, self.n)[i], runtime.get(self.v, self.n)[i]
        return {f"{letter}_{axis}": float(values[c]) for letter, values in (("u", u), ("v", v)) for c, axis in enumerate("xyz")}

    def surface(self):
        return MassSurface(self, self, self.bodies, np.array([bob.radius for bob in self.said]))


@ti.kernel
def _pull(bobs: ti.template(), n: ti.i32):
    for k in range(n):
        away = bobs.home[k] - bobs.x[k]
        bobs.f[k] = bobs.load[k] + bobs.stiffness[k] * away
        bobs.energy[k][1] = 0.5 * bobs.stiffness[k] * away.norm_sqr()
        bobs.energy[k][2] = -bobs.load[k].dot(away)


@ti.kernel
def _drift(bobs: ti.template(), n: ti.i32, dt_before: ti.f64, dt: ti.f64):
    for k in range(n):
        before = bobs.v[k]
        after = before + 0.5 * (dt_before + dt) / bobs.mass[k] * bobs.f[k]
        bobs.v[k], bobs.x[k] = after, bobs.x[k] + dt * after
        if dt_before == 0.0:
            before = 2.0 * before - after  # v was given at t = 0
        bobs.energy[k][0] = 0.5 * bobs.mass[k] * before.dot(after)


class Stone(Body):
    """A second kind, which stays where it is and says no more of itself than it must."""

    kind: str = "stone"
    what: ClassVar[str] = "stone"
    place: Point


class Stones(Rest):
    kind = "stone"

    def __init__(self, said):
        self.said, self.bodies = said, [Span(stone.name, k, 1) for k, stone in enumerate(said)]

    def move(self, now):
        """It stays."""

    def entries(self):
        return Entries()

    def frames(self):
        return [BodyFrame(s.name, np.array([s.place]), NO_CELLS, {"reference": np.array([s.place])}, {}, kind="stone") for s in self.said]


# --- what it shows -----------------------------------------------------------------------------------------------------------------


@pytest.fixture(autouse=True)
def kind():
    bodies.register(Kind("bob", "others", Bob, lambda scene, groups, own: [Bobs(scene, own)] if own else []))
    bodies.register(Kind("stone", "others", Stone, lambda scene, groups, own: [Stones(own)] if own else []))
    yield
    bodies.kinds.registered.clear()


def said(duration: float = 0.4, **more) -> Scene:
    """Two bobs on a line."""
    bobs = [{"kind": "bob", "name": f"bob{k}", "place": (0.2 * k, 0, 0), "mass": 1.0, "stiffness": 400.0} for k in range(2)]
    more = {"others": bobs, "numerics": Numerics(spacing=0.01)} | more
    return Scene(name="bobs", title="Bobs", source="tests", duration=duration, **more)


def start(speed: float = 1.0, threads: int = 1) -> World:
    """Two bobs on a line, a ball that flies at the first one."""
    ball = Rigid(name="ball", mass=0.5, pinballs=[Pinball(centre=(-0.12, 0, 0), radius=0.05)], velocity=(speed, 0, 0))
    return World(said(rigids=[ball]), threads=threads)


def test_it_moves_and_meets_a_ball():
    """A plastic blow: ball and bob go on together at v m / (m + M), and the ledger books what is missing."""
    world = start()
    bob = world.groups[-1]
    world.advance_to(0.03)  # the ball has 20 mm to go
    v = runtime.get(bob.v, 2)[0, 0]
    assert v == pytest.approx(1.0 / 3.0, rel=0.03) and v == pytest.approx(runtime.get(world.rigids.v, 1)[0, 0], rel=0.03)
    assert world.energies()["contact"] == pytest.approx(0.5 * 0.5 * 1.0 * (1 - 1 / 3), rel=0.05)
    assert abs(world.energies()["closed_residual_percent"]) < 1e-9


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


PUSH = {"where": Ball(centre=(0, 0, 0), radius=0.01), "total": (0, 0, 3.0)}


def test_it_bears_forces_gravity_and_a_spring():
    """Along z: u = F / k (1 - cos omega t) with all stiffness that a bob has; what is stored and done closes to rounding."""
    spring = Spring(name="s", between=("bob0", None), points=((0, 0, 0), (0, 0, 0.5)), stiffness=500.0)
    probes = [Probe(name=f"p{k}", body=f"bob{k}", point=(0.2 * k, 0, 0)) for k in range(2)]
    scene = said(
        gravity=(0, 0, -9.81), forces=[NodalForce(body="bob0", **PUSH)], springs=[spring], output=Output(probes=probes), duration=0.2
    )
    assert [body.name for body in plan(scene).bodies] == ["bob0", "bob1"]
    world = World(scene, threads=1)
    for _ in range(20):
        world.advance(1)
        for name, stiffness, load in (("p0", 900.0, 3.0 - 9.81), ("p1", 400.0, -9.81)):
            u = load / stiffness * (1.0 - np.cos(np.sqrt(stiffness) * world.time))
            assert world.probes()[name]["u_z"] == pytest.approx(u, abs=0.02 * abs(load) / stiffness)
        assert abs(world.energies()["closed_residual_percent"]) < 1e-9


def test_a_region_that_catches_nothing_is_refused():
    scene = said(forces=[NodalForce(body="bob1", **PUSH)])
    with pytest.raises(SceneError, match=r"forces\[0\].where catches no point of bob 'bob1', which is at x 200 mm, y 0 m, z 0 m"):
        plan(scene)


def stones(**more) -> list[dict]:
    return [{"kind": "stone", "name": name, "place": (0, 0, 1.0)} | more for name in ("one", "two")]


def test_two_kinds_do_not_take_each_others_bodies():
    world = World(said(others=[*stones(), *said().others]), threads=1)
    assert {group.kind: [span.name for span in group.bodies] for group in world.groups} == {
        "bob": ["bob0", "bob1"],
        "stone": ["one", "two"],
    }
    assert [body.name for body in world.frame().bodies] == ["bob0", "bob1", "one", "two"]


def test_a_kind_that_says_nothing_of_its_step_has_one():
    world = World(said(others=stones()), threads=1)
    assert world.dt == pytest.approx(0.004) and world.dt_rule == "a hundredth of the duration"
    world.advance(3)
    assert world.energies()["kinetic"] == 0.0 and world.tracks() == {} and world.stress_points == 0


def test_springs_and_loads_of_a_kind_that_bears_none_are_refused():
    with pytest.raises(ValueError, match=r"springs\[0\].between: 'one' is a stone, which holds no spring"):
        said(others=stones(), springs=[Spring(name="s", between=("one", None), points=((0, 0, 1), (0, 0, 2)), stiffness=1.0)])
    with pytest.raises(ValueError, match="'one' is a stone; forces of it are not possible yet"):
        said(others=stones(), forces=[NodalForce(body="one", **PUSH)])
