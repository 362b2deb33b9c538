"""The surface of rigid bodies for water: even points on their faces, or on the outside of their pinballs."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ... import runtime
from ...geometry.near import sampled
from ...numerics.turns import turned
from ...pool import Pool
from ...runtime import ti
from ..wettable import SurfacePoints
from .faces import points as face_points
from .pool import spin_of
from .said import Rigid
from .solid import Solid

if TYPE_CHECKING:
    from .group import RigidGroup


class RigidPoints(Pool):
    """Points of a group of rigid bodies; water stands on their outside only."""

    thin = False
    halves: Sequence[float] = ()

    def __init__(self, name: str, group: "RigidGroup", bodies: Sequence[Solid], spacing: float, meets: Callable[[str], bool]):
        """spacing [m] of the points."""
        super().__init__(name)
        self.rigids = group.rigids
        arms, facing, owner = [np.zeros((0, 3))], [np.zeros((0, 3))], [np.zeros(0, np.int32)]
        self.lightest = np.inf
        for r, body in enumerate(bodies):
            if not meets(body.name):
                continue
            points, areas = surface(body, spacing)
            arms, facing, owner = [*arms, points], [*facing, areas], [*owner, np.full(len(points), r, np.int32)]
            if body.said.free:  # a third of its surface is wet: the projection of a ball on a plane
                self.lightest = min(self.lightest, float(3.0 * body.mass / np.linalg.norm(areas, axis=1).sum()))
        self.n = n = sum(map(len, owner))
        self.arm = self.field("arm", n, 3, "f64", unit="m", doc="from the centre of mass, at t = 0")
        self.facing = self.field("facing", n, 3, "f64", unit="m2", doc="vector area, outward, at t = 0")
        self.owner = self.field("owner", n, dtype="i32", doc="body of the point")
        self.first = self.field("first", len(bodies) + 1, dtype="i32", doc="first point of each body")
        self.last = self.field("last", len(bodies), 3, "f64", unit="N", keeps=True, doc="of this water on the body, since its last step")
        runtime.put(self.arm, np.concatenate(arms))
        runtime.put(self.facing, np.concatenate(facing))
        runtime.put(self.owner, np.concatenate(owner))
        runtime.put(self.first, np.searchsorted(np.concatenate(owner), np.arange(len(bodies) + 1)).astype(np.int32))

    def pools(self) -> Sequence[Pool]:
        return [self]

    def lay(self, points: SurfacePoints, first: int, since: float) -> None:
        _lay(points, self, first, self.n, since)

    def bear(self, points: SurfacePoints, first: int, times: int) -> None:
        _bear(points, self, first, self.rigids.n, times)


def surface(body: Solid, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """(K, 3) points of what is met of a body, from its centre of mass [m], and (K, 3) vector areas to the side where it is met [m2]."""
    if body.mesh is None:
        return _of_pinballs(body.said, spacing)
    points, areas = sampled(body.mesh, spacing)
    return points - body.centre, areas


def _of_pinballs(body: Rigid, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """(K, 3) points, from the centre of mass of a body [m], and (K, 3) vector areas outward [m2], at t = 0, about `spacing` [m] apart: on
    its faces, or where none are said on the outside of its pinballs; even ones on each sphere, those inside another pinball left out."""
    if body.faces:
        made = [face_points(face, spacing) for face in body.faces]
        return np.concatenate([x for x, _ in made]) - body.centre, np.concatenate([a for _, a in made])
    points, areas = [], []
    for one in body.pinballs:
        n = max(24, int(np.ceil(4 * np.pi * one.radius**2 / spacing**2)))
        z = 1 - (2 * np.arange(n) + 1) / n
        turn = np.pi * (1 + 5**0.5) * np.arange(n)  # the golden angle: Fibonacci's sphere
        across = np.sqrt(1 - z * z)
        normal = np.column_stack([across * np.cos(turn), across * np.sin(turn), z])
        x = np.array(one.centre) + one.radius * normal
        outside = np.ones(n, bool)
        for other in body.pinballs:
            if other is not one:
                outside &= np.linalg.norm(x - np.array(other.centre), axis=1) >= other.radius * (1 - 1e-9)
        points.append(x[outside] - body.centre)
        areas.append(4 * np.pi * one.radius**2 / n * normal[outside])
    return np.concatenate(points), np.concatenate(areas)


@ti.kernel
def _lay(points: ti.template(), t: ti.template(), first: ti.i32, n: ti.i32, since: ti.f64):
    for b in range(n):
        r = t.owner[b]
        arm = turned(t.rigids.q[r], t.arm[b])
        x = t.rigids.x[r] + arm
        a = turned(t.rigids.q[r], t.facing[b])
        v = t.rigids.v[r] + spin_of(t.rigids, r).cross(arm)
        points.note(first + b, x, a, v, 0.0, 0, since)


@ti.kernel
def _bear(points: ti.template(), t: ti.template(), first: ti.i32, bodies: ti.i32, times: ti.i32):
    """times: how many steps of the clock the water's blow stands for, 0: it takes no step now."""
    for r in range(bodies):
        if times > 0:
            force, torque = t.rigids.force[r], t.rigids.torque[r]
            water = force * 0.0
            for b in range(t.first[r], t.first[r + 1]):
                push = ti.cast(points.push[first + b], ti.f64)
                water += push
                torque += times * (points.x[first + b] - t.rigids.x[r]).cross(push)
            t.rigids.force[r], t.rigids.torque[r], t.last[r] = force + times * water, torque, water
        t.rigids.spread[r] += (1 - times) * t.last[r]
