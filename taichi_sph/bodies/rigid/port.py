"""Rigid bodies as couplings see them: movers that turn, each with several balls, and a skin where its surface is said."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...numerics.turns import product, turned
from ...runtime import ti
from ..body import Now, Span
from ..surface import BODY, FIRST, POINT, WALL, Balls, Surface, Walls
from .pool import free_velocity, spin_of, spin_to_come
from .solid import Solid


class RigidSurface(Surface):
    """A mover is a body, a ball one of its pinballs."""

    turns, few = True, True

    def __init__(self, group: Any) -> None:
        self.group, self.rigids = group, group.rigids
        rigids = self.rigids
        self.bodies, self.n = group.bodies, rigids.n
        self.bounce = [body.restitution for body in group.scene.rigids]
        self.led = [not body.free for body in group.scene.rigids]
        self.length = 0.5 * float(rigids.ball_radius.min())
        self.balls = Balls(rigids.ball_body, rigids.ball_body, np.repeat(rigids.ball_radius[:, None], 2, axis=1), rigids.ball_arm)
        self.walls = _walls(group.solids)

    def grip(self, span: Span, point: np.ndarray, radius: float | None) -> tuple[np.ndarray, np.ndarray]:
        """The body itself, wherever the point is."""
        return np.array([span.first]), point - self.group.solids[span.first].centre

    def look(self, port: Any, places: bool) -> None:
        _look(port, self.rigids, self.n, self.n_balls, self.first.body, self.first.ball, int(places))
        if places and self.walls is not None and port.walled:
            _look_walls(port, self.rigids, len(self.walls.arm), len(self.walls.corners), self.first)

    def offer(self, port: Any, first: int, last: int, now: Now) -> None:
        _offer(port, self.rigids, first, last, self.first.mover, port.turning, now.kick)

    def take(self, port: Any, first: int, last: int, now: Now) -> None:
        _take(port, self.rigids, first, last, self.first.mover, port.turning, 1.0 / now.kick)


def _walls(solids: Sequence[Solid]) -> Walls | None:
    """The skins of those bodies that have one."""
    owner, arms, tips, corners, n = [], [], [], [], 0
    for r, solid in enumerate(solids):
        if solid.mesh is not None:
            triangles, tip = solid.walls()
            owner.append(np.full(len(tip), r))
            arms.append(solid.mesh.points - solid.centre)
            tips.append(tip)
            corners.append(n + triangles)
            n += len(tip)
    if not n:
        return None
    return Walls(np.concatenate(owner), np.concatenate(owner), np.concatenate(arms), np.concatenate(tips), np.concatenate(corners))


@ti.kernel
def _look_walls(port: ti.template(), rigids: ti.template(), points: ti.i32, walls: ti.i32, first: FIRST):
    for k in range(points):
        p = first[POINT] + k
        r = port.ball_body[p] - first[BODY]
        port.ball_x[p] = rigids.x[r] + turned(rigids.q[r], port.ball_arm[p])
    for k in range(walls):
        w = first[WALL] + k
        at = port.wall_point[w]
        port.wall_x[w] = (port.ball_x[at[0]] + port.ball_x[at[1]] + port.ball_x[at[2]]) / 3.0


@ti.kernel
def _look(port: ti.template(), rigids: ti.template(), n: ti.i32, balls: ti.i32, body: ti.i32, ball: ti.i32, places: ti.i32):
    ti.loop_config(serialize=True)
    for r in range(n):
        port.speed[body + r] = rigids.v[r].norm() + spin_of(rigids, r).norm() * rigids.reach[r]
    ti.loop_config(serialize=True)
    for k in range(balls):
        r = port.ball_body[ball + k] - body
        arm = port.ball_arm[ball + k]
        speed = rigids.v[r].norm() + spin_of(rigids, r).norm() * arm.norm()
        port.speed[body + r] = ti.max(port.speed[body + r], speed)
        if places == 1:
            port.ball_x[ball + k] = rigids.x[r] + turned(rigids.q[r], arm)


@ti.kernel
def _offer(port: ti.template(), rigids: ti.template(), first: ti.i32, last: ti.i32, base: ti.i32, turning: ti.i32, kick: ti.f64):
    for m in range(first, last):
        r, t = port.who[m] - base, m - turning
        port.x[m] = rigids.x[r]
        port.before[m] = rigids.v[r]
        port.free[m] = free_velocity(rigids, r, kick)
        port.ease[m] = rigids.way[r] / rigids.mass[r]
        port.q[t] = rigids.q[r]
        port.pose[t] = product(rigids.q[r], rigids.axes[r])
        port.moments[t] = rigids.moments[r]
        port.loose_turn[t] = rigids.free[r]
        port.spin_before[t] = spin_of(rigids, r)
        port.spin_free[t] = spin_to_come(rigids, r, rigids.q[r], rigids.L[r] + kick * rigids.torque[r])


@ti.kernel
def _take(port: ti.template(), rigids: ti.template(), first: ti.i32, last: ti.i32, base: ti.i32, turning: ti.i32, per_kick: ti.f64):
    for m in range(first, last):
        r, t = port.who[m] - base, m - turning
        if port.pushed[port.whose[m]] == 1:
            rigids.force[r] += per_kick * port.impulse[m]
            rigids.torque[r] += per_kick * port.twist[t]
