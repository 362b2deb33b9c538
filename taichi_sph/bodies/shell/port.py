"""Shells as couplings see them: a node is a mover that does not turn, and a disc across its director; a cell is a face."""

from typing import Any

import numpy as np

from ...runtime import ti
from ..body import Now, Span
from ..faces import lay_face
from ..nodal.loads import history
from ..surface import BODY, DISC, FACE, FIRST, THIN, Discs, Faces, Surface
from .surface import place


class ShellSurface(Surface):
    """Of a group whose nodes bend: a shell that stays in its plane has no side that is met."""

    def __init__(self, group: Any) -> None:
        self.group, self.nodes, self.cells, self.loads = group, group.nodes, group.cells, group.loads
        self.bodies, self.n = group.bodies, self.nodes.n
        self.length = group.spacing
        self.bounce = [None] * len(self.bodies)
        border = np.zeros(self.n, np.int32)
        sides = np.asarray(group.mesh.edges.sides)
        border[np.unique(group.mesh.edges.nodes[(sides < 0).any(axis=1)])] = 1
        body = np.repeat(np.arange(len(self.bodies)), [span.n for span in self.bodies])
        half = np.concatenate([0.5 * shell.thickness for shell in group.shells])
        self.discs = Discs(body, half, 0.5 * group.mesh.node_spacing, border, group.mesh.points)
        self.faces = Faces(np.asarray(group.mesh.cells))

    def grip(self, span: Span, point: np.ndarray, radius: float | None) -> tuple[np.ndarray, np.ndarray]:
        """The nearest node, or the nodes within `radius`."""
        away = np.linalg.norm(self.group.mesh.points[span.first : span.first + span.n] - point, axis=1)
        near = [int(np.argmin(away))] if radius is None else np.flatnonzero(away <= radius)
        return span.first + np.asarray(near), np.zeros(3)

    def look(self, port: Any, places: bool) -> None:
        _look(port, self.nodes, self.cells, self.n, len(self.bodies), self.first, int(places), int(port.thin))
        if port.thin and places:
            _look_faces(port, self.cells, self.cells.n, len(self.bodies), self.first)

    def offer(self, port: Any, first: int, last: int, now: Now) -> None:
        _offer(port, self.nodes, self.loads, first, last, self.first.mover, now.kick, now.half_time)

    def take(self, port: Any, first: int, last: int, now: Now) -> None:
        _take(port, self.nodes, first, last, self.first.mover, 1.0 / now.kick)


@ti.kernel
def _look(
    port: ti.template(), nodes: ti.template(), cells: ti.template(), n: ti.i32, bodies: ti.i32, first: FIRST, places: ti.i32, balls: ti.i32
):
    """A sound node's disc reaches half way to the farthest corner of its cells, so that the discs cover the surface
    without a hole; at a lip or border half way to the next node, so that an opening is as wide as it is (T 3.19). A
    node without a live cell, a fragment, keeps the disc it had: a flake that flies and turns on."""
    for b in range(first[BODY], first[BODY] + bodies):
        port.speed[b] = 0.0
        if places == 1 and port.due[b] == 1:
            port.largest[b] = 0.0
    for i in range(n):
        d = first[DISC] + i
        b = port.disc_body[d]
        speed = ti.cast(nodes.v[i].norm(), ti.f64)
        if speed > port.speed[b]:
            ti.atomic_max(port.speed[b], speed)
        if places == 1:
            x = place(nodes, i)
            port.disc_x[d], port.disc_n[d] = x, ti.cast(nodes.N[i] + nodes.d[i], ti.f64)
            if balls == 1:
                port.ball_x[first[THIN] + i] = x
            if port.due[b] == 1:
                near, far = ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64)
                alive = 0
                sound = 1 - port.disc_border[d]
                for m in range(cells.start_of_node[i], cells.start_of_node[i + 1]):
                    s = cells.of_node[m]
                    if cells.broken[s] == 1:
                        sound = 0
                    else:
                        alive += 1
                        corners = cells.n_corners[s]
                        for k in range(corners):
                            if cells.corner[s][k] == i:
                                after = cells.corner[s][(k + 1) % corners]
                                before = cells.corner[s][(k + corners - 1) % corners]
                                opposite = cells.corner[s][(k + 2) % corners]
                                near = ti.max(near, (place(nodes, after) - x).norm())
                                near = ti.max(near, (place(nodes, before) - x).norm())
                                far = ti.max(far, (place(nodes, opposite) - x).norm())
                port.disc_sound[d] = sound
                radius = port.disc_radius[d]
                if sound == 1:
                    radius = 0.5 * ti.max(near, far)
                elif alive > 0:
                    radius = 0.5 * near
                port.disc_radius[d] = radius
                if radius > port.largest[b]:
                    ti.atomic_max(port.largest[b], radius)


@ti.kernel
def _look_faces(port: ti.template(), cells: ti.template(), n: ti.i32, bodies: ti.i32, first: FIRST):
    """After `_look`, which has put the discs where their nodes are."""
    for b in range(first[BODY], first[BODY] + bodies):
        port.widest_face[b] = 0.0
    for s in range(n):
        lay_face(port, first[FACE] + s, cells.broken[s] == 0)


@ti.kernel
def _offer(
    port: ti.template(), nodes: ti.template(), loads: ti.template(), first: ti.i32, last: ti.i32, base: ti.i32, kick: ti.f64,
    half_time: ti.f64,
):  # fmt: skip
    for m in range(first, last):
        i = port.who[m] - base
        port.x[m] = place(nodes, i)
        port.director[m] = ti.cast(nodes.N[i] + nodes.d[i], ti.f64)
        port.before[m] = ti.cast(nodes.v[i], ti.f64)
        force = nodes.force[i]
        if ti.static(loads.pushes):
            force += loads.force.total[i]
        v = ti.cast(nodes.v[i] + kick / nodes.mass[i] * force, ti.f64)
        w = ti.Vector([0.0, 0.0, 0.0], ti.f64)
        w += 1.0 / ti.cast(nodes.mass[i], ti.f64)
        if ti.static(loads.moves):
            if nodes.fixed[i] > 0:
                g = nodes.fixed[i] - 1
                for c in ti.static(range(3)):
                    if loads.mask[g][c] == 1:
                        w[c] = 0.0
                        v[c] = ti.cast(loads.velocity[g][c] * history(half_time, loads.curves, loads.curve[g]), ti.f64)
        port.free[m], port.ease[m] = v, w


@ti.kernel
def _take(port: ti.template(), nodes: ti.template(), first: ti.i32, last: ti.i32, base: ti.i32, per_kick: ti.f64):
    for m in range(first, last):
        if port.pushed[port.whose[m]] == 1:
            force = per_kick * port.impulse[m]
            nodes.force[port.who[m] - base] += ti.cast(force, float)
