"""Solids as couplings see them: a node is a mover that does not turn, and a rounded disc just below the surface.

The disc lies half its thickness below its node, so that its outer side is the surface itself. With its rim it reaches as far as the nearest
node along an edge: to the edge of the body and not beyond it, also where the cells beside the edge are pressed flat. Where faces meet at an
angle (an edge, a corner, the lip of a crater) the disc is a small ball that touches all of them from inside. A node without live cells, a
fragment, is a ball about itself. A node inside, among live cells alone, is not met. A face is on the surface while one of its two cells
lives. It goes through the middles of the discs at its corners and is as thick as they are, so nodes of other bodies meet the surface itself
between its nodes as well.
"""

from typing import Any

import numpy as np

from ... import runtime
from ...pool import Pool
from ...runtime import ti
from ..body import Now, Span
from ..faces import NOWHERE, lay_face
from ..nodal.loads import history
from ..surface import BODY, DISC, FACE, FIRST, MOVER, THIN, Discs, Faces, Surface

SLIM = 0.2  # half the thickness of a disc over the shortest edge about its node in the reference
FLAT = 0.9  # cosine between the normal of a node and that of its faces: below it the node is on an edge
SHARP = 0.4  # of that cosine: what lies deeper than the ball of such an edge is left to its neighbours


class Skin(Pool):
    """The nodes that may come to the surface, all where cells break, and the faces around them."""

    def __init__(self, mesh: Any, breaks: bool, name: str = "skin"):
        super().__init__(name)
        on = np.ones(len(mesh.points), bool) if breaks else mesh.node_areas > 0
        self.numbers = np.flatnonzero(on)
        self.n = n = len(self.numbers)
        faces = slice(None) if breaks else mesh.skin
        nodes, cells = mesh.faces.nodes[faces], mesh.faces.cells[faces]
        slot = np.full(len(mesh.points), -1)
        slot[self.numbers] = np.arange(n)
        at = nodes.ravel()
        face = np.repeat(np.arange(len(nodes)), 4)[at >= 0]
        at = slot[at[at >= 0]]
        order = np.argsort(at, kind="stable")
        self.node = self.field("node", n, dtype="i32", doc="of a mover")
        self.corner = self.field("corner", len(nodes), 4, "i32", doc="nodes of a face, -1 behind a triangle, round its outer normal")
        self.cells = self.field("cells", len(nodes), 2, "i32", doc="cells of a face, the second -1 on the surface of the reference")
        self.start = self.field("start", n + 1, dtype="i32", doc="where the faces of a mover begin in face")
        self.face = self.field("face", len(order), dtype="i32", doc="faces, by mover")
        self.half = self.field("half", n, dtype="f64", unit="m", doc="half the thickness of the disc of a mover")
        runtime.put(self.node, self.numbers.astype(np.int32))
        runtime.put(self.corner, nodes.astype(np.int32))
        runtime.put(self.cells, cells.astype(np.int32))
        runtime.put(self.start, np.r_[0, np.cumsum(np.bincount(at, minlength=n))].astype(np.int32))
        runtime.put(self.face, face[order].astype(np.int32))
        size = np.full(len(mesh.points), np.inf)
        for side in range(4):
            one, other = mesh.faces.nodes[:, side], mesh.faces.nodes[:, (side + 1) % 4]
            one, other = np.where(one < 0, mesh.faces.nodes[:, 2], one), np.where(other < 0, mesh.faces.nodes[:, 0], other)
            length = np.linalg.norm(mesh.points[one] - mesh.points[other], axis=1)
            np.minimum.at(size, one, length)
            np.minimum.at(size, other, length)
        self.shortest = float(size.min())
        self.halves = SLIM * size[self.numbers]
        self.movers = np.where(nodes < 0, -1, slot[nodes])  # at the corners of each face
        runtime.put(self.half, self.halves)


class SolidSurface(Surface):
    """Of a group of solids."""

    def __init__(self, group: Any) -> None:
        self.group, self.nodes, self.cells, self.loads, self.skin = group, group.nodes, group.cells, group.loads, group.skin
        self.bodies, self.n = group.bodies, self.skin.n
        self.length = self.skin.shortest
        self.bounce = [None] * len(self.bodies)
        body = np.repeat(np.arange(len(self.bodies)), [span.n for span in self.bodies])[self.skin.numbers]
        still = np.zeros(self.n, np.int32)
        self.faces = Faces(self.skin.movers)
        self.discs = Discs(body, self.skin.halves, (1.0 / SLIM - 1.0) * self.skin.halves, still, group.mesh.points[self.skin.numbers])

    @property
    def renumbered(self) -> bool:
        """Faces come to the surface where cells broke: what may touch is looked for anew."""
        return self.group.new

    def grip(self, span: Span, point: np.ndarray, radius: float | None) -> tuple[np.ndarray, np.ndarray]:
        """The nearest node of the surface, or those within `radius`."""
        own = np.flatnonzero((self.skin.numbers >= span.first) & (self.skin.numbers < span.first + span.n))
        away = np.linalg.norm(self.group.mesh.points[self.skin.numbers[own]] - point, axis=1)
        return own[[int(np.argmin(away))]] if radius is None else own[away <= radius], np.zeros(3)

    def look(self, port: Any, places: bool) -> None:
        _look(port, self, self.n, len(self.bodies), self.first, int(places), int(port.thin))
        if port.thin and places:
            _look_faces(port, self, len(self.skin.movers), len(self.bodies), self.first)

    def offer(self, port: Any, first: int, last: int, now: Now) -> None:
        shaped = hasattr(port, "disc_radius")  # contact looks at discs, springs do not
        _offer(port, self, first, last, self.first, now.kick, now.half_time, shaped)

    def take(self, port: Any, first: int, last: int, now: Now) -> None:
        _take(port, self.skin, self.nodes, first, last, self.first.mover, 1.0 / now.kick)


@ti.func
def _place(nodes: ti.template(), i):
    return nodes.X[i] + ti.cast(nodes.u[i], ti.f64)


@ti.func
def _disc(skin: ti.template(), nodes: ti.template(), cells: ti.template(), k):
    """(middle of the disc, director, radius) of a mover now; radius 0: a ball."""
    x = _place(nodes, skin.node[k])
    sum_ = ti.Vector([0.0, 0.0, 0.0], ti.f64)
    for m in range(skin.start[k], skin.start[k + 1]):
        sum_ += _normal(skin, nodes, cells, skin.face[m])
    radius, n = ti.cast(0.0, ti.f64), ti.Vector([0.0, 0.0, 1.0], ti.f64)
    if sum_.norm_sqr() > 1e-6:
        n = sum_.normalized()
        least = ti.cast(1.0, ti.f64)
        for m in range(skin.start[k], skin.start[k + 1]):
            one = _normal(skin, nodes, cells, skin.face[m])
            if one.norm_sqr() > 0.0:
                least = ti.min(least, one.dot(n))
        if least > FLAT:
            radius = ti.max(_nearest(skin, nodes, cells, k) - skin.half[k], 0.0)
        x -= skin.half[k] / ti.max(least, SHARP) * n
    return x, n, radius


@ti.func
def _within(skin: ti.template(), cells: ti.template(), k):
    """1 of a mover inside the body: all cells around it live, and none of its faces is on the surface. Nothing meets it."""
    result = 1
    for m in range(skin.start[k], skin.start[k + 1]):
        one, other = skin.cells[skin.face[m]][0], skin.cells[skin.face[m]][1]
        if other < 0:
            result = 0
        elif cells.broken[one] + cells.broken[other] > 0:
            result = 0
    return result


@ti.func
def _nearest(skin: ti.template(), nodes: ti.template(), cells: ti.template(), k):
    """Length now of the shortest edge of the surface at a mover [m]."""
    i = skin.node[k]
    x, least = _place(nodes, i), ti.cast(1e30, ti.f64)
    for m in range(skin.start[k], skin.start[k + 1]):
        f = skin.face[m]
        if _normal(skin, nodes, cells, f).norm_sqr() > 0.0:
            c = skin.corner[f]
            corners = ti.select(c[3] < 0, 3, 4)
            for j in range(corners):
                if c[j] == i:
                    least = ti.min(least, (_place(nodes, c[(j + 1) % corners]) - x).norm())
                    least = ti.min(least, (_place(nodes, c[(j + corners - 1) % corners]) - x).norm())
    return least


@ti.func
def _normal(skin: ti.template(), nodes: ti.template(), cells: ti.template(), f):
    """Unit normal of a face out of its live cell; 0 where it is not on the surface."""
    one, other = skin.cells[f][0], skin.cells[f][1]
    lives, across = 1 - cells.broken[one], 0
    if other >= 0:
        across = 1 - cells.broken[other]
    n = ti.Vector([0.0, 0.0, 0.0], ti.f64)
    if lives != across:
        c = skin.corner[f]
        fourth = ti.select(c[3] < 0, c[0], c[3])
        n = (_place(nodes, c[2]) - _place(nodes, c[0])).cross(_place(nodes, fourth) - _place(nodes, c[1]))
        n *= (lives - across) / ti.max(n.norm(), 1e-300)
    return n


@ti.kernel
def _look(port: ti.template(), of: ti.template(), n: ti.i32, bodies: ti.i32, at: FIRST, places: ti.i32, balls: ti.i32):
    for b in range(at[BODY], at[BODY] + bodies):
        port.speed[b] = 0.0
        if places == 1 and port.due[b] == 1:
            port.largest[b] = 0.0
    for k in range(n):
        d = at[DISC] + k
        b = port.disc_body[d]
        speed = ti.cast(of.nodes.v[of.skin.node[k]].norm(), ti.f64)
        if speed > port.speed[b]:
            ti.atomic_max(port.speed[b], speed)
        if places == 1:
            x, normal, radius = _disc(of.skin, of.nodes, of.cells, k)
            if _within(of.skin, of.cells, k) == 1:
                x = ti.Vector([-NOWHERE, -NOWHERE, -NOWHERE], ti.f64)  # across from the faces that are not met
            port.disc_x[d], port.disc_n[d] = x, normal
            if balls == 1:
                port.ball_x[at[THIN] + k] = x
            if port.due[b] == 1:
                port.disc_sound[d], port.disc_radius[d] = ti.select(radius > 0.0, 1, 0), radius
                if radius > port.largest[b]:
                    ti.atomic_max(port.largest[b], radius)


@ti.kernel
def _look_faces(port: ti.template(), of: ti.template(), n: ti.i32, bodies: ti.i32, at: FIRST):
    """After `_look`, which has put the discs below their nodes. Faces that are not on the surface have no reach."""
    for b in range(at[BODY], at[BODY] + bodies):
        port.widest_face[b] = 0.0
    for f in range(n):
        lay_face(port, at[FACE] + f, _normal(of.skin, of.nodes, of.cells, f).norm_sqr() > 0.0)


@ti.kernel
def _offer(
    port: ti.template(), of: ti.template(), first: ti.i32, last: ti.i32, at: FIRST, kick: ti.f64, half_time: ti.f64, shaped: ti.template()
):
    for m in range(first, last):
        k = port.who[m] - at[MOVER]
        i = of.skin.node[k]
        x, normal, radius = _disc(of.skin, of.nodes, of.cells, k)
        if ti.static(shaped):
            port.disc_radius[at[DISC] + k] = radius
        port.x[m], port.director[m] = x, normal
        port.before[m] = ti.cast(of.nodes.v[i], ti.f64)
        force = of.nodes.force[i]
        if ti.static(of.loads.pushes):
            force += of.loads.force.total[i]
        v = ti.cast(of.nodes.v[i] + kick / of.nodes.mass[i] * force, ti.f64)
        w = ti.Vector([1.0, 1.0, 1.0], ti.f64) / ti.cast(of.nodes.mass[i], ti.f64)
        if ti.static(of.loads.moves):
            if of.nodes.fixed[i] > 0:
                g = of.nodes.fixed[i] - 1
                for c in ti.static(range(3)):
                    if of.loads.mask[g][c] == 1:
                        w[c] = 0.0
                        v[c] = ti.cast(of.loads.velocity[g][c] * history(half_time, of.loads.curves, of.loads.curve[g]), ti.f64)
        port.free[m], port.ease[m] = v, w


@ti.kernel
def _take(port: ti.template(), skin: ti.template(), nodes: ti.template(), first: ti.i32, last: ti.i32, base: ti.i32, per_kick: ti.f64):
    for m in range(first, last):
        if port.pushed[port.whose[m]] == 1:
            nodes.force[skin.node[port.who[m] - base]] += ti.cast(per_kick * port.impulse[m], float)
