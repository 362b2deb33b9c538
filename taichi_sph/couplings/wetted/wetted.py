"""Pressure between water and what it wets: shells on either side, and rigid bodies.

Beyond a surface the kernel of a particle finds no water. What is missing there is an integral over the surface, because
the gradient of W over a volume is W over its boundary (Kulasegaram et al. 2004, Ferrand et al. 2013):

    integral beyond the surface of grad_i W dV = -w_i,     w_i = sum_k W(x_i - x_k) A_k

A_k is the vector area of the piece of surface at the point k, towards the water. The half space there mirrors pressure
and normal velocity of the particle itself, so that T 1.21 and T 1.26 gain

    div_i = ... + 2 w_i . (v_i - v_k)
    f_i   = ... + V_i (2 p_i + Pi_i) w_i      and each point k its part of the opposite

and, n along w_i, along the surface the mirror image of what is on this side, which is the same as weighing that more:

    grad W_ij becomes T_i grad W_ij beside v and p_i, and T_j grad W_ij beside p_j,     T_i = 1 + (1/gamma_i - 1) (1 - n n)

with gamma_i the part of the kernel that lies in water. Without T a flow that turns along a wall would press its own
layer together: half of its divergence would be missing there. The two are each other's transpose: pressure does on
particle and surface together exactly the work that the density stores, and nothing is lost in a blow, as it is between
pinballs. In water at one pressure the layers at D/2, 3D/2 ... bear the wall with 0.995 p (h/D = 1.165). Pi_i is T 1.24
of the particle against its own image at D/2.

A shell node carries the vector area of its sound cells as they lie now: stretch, holes and petals are in it, and a
fragment, which has none left, is for the pinballs alone. It acts on the side where the particle is, e/2 off the
mid-surface, and fades out over the last D/10 before its plane, so that water in a hole feels its rim evenly. Rigid
bodies carry points on the outside of their pinballs. Where a shell lies between water and a body (a striker that still
pushes its plug) the body's share is what w of the shell leaves of it.

Water on the other side of a wall is not seen through it: a pair whose normals oppose each other (n_i.n_j < -1/2) and that lies across
the wall (x_ij.(n_i - n_j) > 0) counts

    1 - (c_i + c_j) / 2,     c = |w| over that of an even wall without end at the mean distance of the points (at most 1)

so that towards a rim or a hole, where both see each other past the edge, it fades in as w fades out: linear, as w is in what is there
of a wall.

Rigid planes show a particle images of the surfaces as well as of its neighbours.

The pinballs remain behind this, at PINBALL D: they stop what no pressure stops, and keep a sound wall tight.
"""

from dataclasses import dataclass

import numpy as np

from ... import runtime
from ...bodies.fluid.walls import MOST, NONE, RIM
from ...bodies.rigid.pool import spin_of, surface
from ...numerics.cells import CellGrid, bucket, cube, running
from ...numerics.kernel import w2
from ...numerics.turns import turned
from ...pool import Pool
from ...runtime import ti

FINE = 0.45  # D between the points of a rigid body's surface
FADE = 0.1  # of D
SKIN = 0.25  # of D, of the lists
FULL = 1.5  # |w| on a plane through the particle, over 1 / 2h: the integral of W over it


@dataclass(frozen=True)
class Wettable:
    """What a fluid can wet. mesh, nodes, cells, thickness [m] of the shell, or None; rigids: RigidBodies or None, and their
    scene.Rigid; held (N,) bool: nodes that nothing moves."""

    mesh: object = None
    nodes: object = None
    cells: object = None
    thickness: float = 0.0
    rigids: object = None
    bodies: tuple = ()
    held: np.ndarray | None = None


@ti.data_oriented
class Wetted(Pool):
    """Surface points: first the shell's nodes, then those of the rigid bodies; lists both ways; forces on the points."""

    def __init__(self, what: Wettable, particles, support: float, origin, walls):
        """particles: FluidParticles; support h / D; origin [m]: records are relative to it; walls: Walls, whose images of the surfaces
        press as well."""
        super().__init__("wet")
        self.walls = walls
        self.nodes, self.cells, self.rigids, self.p = what.nodes, what.cells, what.rigids, particles
        self.has_shell, self.has_rigids = what.nodes is not None, what.rigids is not None
        self.ns = what.nodes.n if self.has_shell else 0
        self.half = 0.5 * what.thickness
        self.origin = ti.Vector([*origin], ti.f64)
        self.spacing = particles.spacing
        arms, facing, owner = [np.zeros((0, 3))], [np.zeros((0, 3))], [np.zeros(0, np.int32)]
        for r, body in enumerate(what.bodies):
            points, areas = surface(body, FINE * self.spacing)
            arms, facing, owner = [*arms, points], [*facing, areas], [*owner, np.full(len(points), r, np.int32)]
        arms, facing, owner = np.concatenate(arms), np.concatenate(facing), np.concatenate(owner)
        self.nb = len(arms)
        self.n = n = self.ns + self.nb
        new = self.field
        self.record = new("record", n, 12, doc="place from the origin, vector area, velocity: what a particle needs of a point")
        self.x = new("x", n, 3, "f64", unit="m", doc="where the point is now")
        self.push = new("push", n, 3, unit="N", doc="of the water on the point")
        self.stress = new("stress", particles.n, unit="N m", doc="V (2 p + Pi) of each particle")
        self.side = new("side", particles.n, 4, doc="n, and 1 / gamma - 1")
        self.cover = new("cover", particles.n, doc="c, of those with a side")
        self.amid = new("amid", particles.n, dtype="i32", doc="1: the particle or a neighbour of it has points within reach")
        self.share = new("share", particles.n, doc="part of the rigid points' w that the shell does not cover")
        self.met = new("met", particles.n, 4, doc="w [1/m], and sum of w_k . (v - v_k) [1/s], of this step")
        self.was = new("was", n, 3, "f64", unit="m", keeps=True, doc="x at the fluid's step before")
        self.built = new("built", n, 3, "f64", unit="m", keeps=True, doc="x when the lists were made")
        self.built_particles = new("built_particles", particles.n, 3, "f64", unit="m", keeps=True, doc="places of the particles then")
        self.start = new("start", particles.n + 1, dtype="i32", doc="the points of particle i are point[start[i]] on")
        self.start_back = new("start_back", n + 1, dtype="i32", doc="the particles of point k are particle[start_back[k]] on")
        if self.has_shell:
            self.turn = new("turn", what.cells.n, dtype="f64", doc="1: corners are numbered round the director, -1: against it")
            runtime.put(self.turn, _turns(what.mesh))
        if self.nb:
            self.arm = new("arm", self.nb, 3, "f64", unit="m", doc="from the centre of mass, at t = 0")
            self.facing = new("facing", self.nb, 3, "f64", unit="m2", doc="vector area, outward, at t = 0")
            self.owner = new("owner", self.nb, dtype="i32", doc="rigid body of the point")
            self.first = new("first", len(what.bodies) + 1, dtype="i32", doc="first point of each rigid body")
            runtime.put(self.arm, arms)
            runtime.put(self.facing, facing)
            runtime.put(self.owner, owner)
            runtime.put(self.first, np.searchsorted(owner, np.arange(len(what.bodies) + 1)).astype(np.int32))
        # kg/m2 of the lightest wet body that is free to move, a rigid one wet on a third of its surface: the projection of a ball on a
        # plane
        weights = [np.inf]
        if self.has_shell:
            free = ~what.held
            weights += list(runtime.get(what.nodes.mass, self.ns)[free] / what.mesh.node_areas[free])
        for r, body in enumerate(what.bodies):
            if not body.held:
                weights.append(3.0 * body.mass / np.linalg.norm(facing[owner == r], axis=1).sum())
        self.lightest = float(np.min(weights))
        self.skin = SKIN * self.spacing
        # 1.03: a particle's own support grows with its D (bodies.fluid.pool.WIDEST)
        self.reach = 1.03 * 2.0 * support * self.spacing + self.half + self.skin
        _lay(self, self.ns, self.nb, 0.0)
        self.grid = CellGrid("wet.grid", self.built, n, self.reach)
        self.room = 0
        self.relist()

    def face(self, inverse: float) -> None:
        """`met`, `side` and `share` of the particles whose records are new; those with a side get a negative D. inverse: 1 / 2h_0."""
        _face(self, self.point, self.p.n, inverse)

    def follow(self, renumbered: bool, since: float = 0.0) -> bool:
        """Points where their bodies are now, and lists that still hold; True when they are new. renumbered: the particles stand in
        another order; since [s]: the points' velocities are the means over that time, 0 for those of their bodies now."""
        _lay(self, self.ns, self.nb, since)
        worn = renumbered or _travelled(self, self.p.n, self.n) > self.skin
        if worn:
            self.relist()
        return worn

    def relist(self) -> None:
        """Lists of the pairs within reach, as all lie now."""
        _keep(self, self.p.n, self.n)
        self.renew()

    def renew(self) -> None:
        """The lists, as all lay when they were made."""
        self.grid.rebuild()
        inverse = 1.0 / self.reach
        if not self.room:
            self._widen(64)
        _pair(self, self.point, self.p.n, inverse, self.grid.table, 0)
        found = running(self.start, self.p.n)
        if found > self.room:
            self._widen(found)
        _pair(self, self.point, self.p.n, inverse, self.grid.table, 1)
        _turn_round(self, self.point, self.particle, self.p.n, self.n)

    def _widen(self, found: int) -> None:
        self.room = max(64, 3 * found // 2)
        self.point = self.field("point", self.room, dtype="i32", grows=True, doc="points near each particle")
        self.particle = self.field("particle", self.room, dtype="i32", grows=True, doc="particles near each point")

    def bear(self, inverse: float, times: int = 1) -> None:
        """The forces of the particles, once their `stress` is known, onto nodes and bodies. inverse: 1 / 2h_0; times: as one blow of so
        many steps."""
        _gather(self, self.particle, self.n, inverse)
        if self.has_shell:
            _onto_nodes(self, self.ns, times)
        if self.nb:
            _onto_bodies(self, self.rigids.n, times)

    @ti.func
    def facet(self, k, x, D, inverse):
        """w of the point k for a particle at x with spacing D."""
        a = ti.Vector([self.record[k][3], self.record[k][4], self.record[k][5]])
        r = x - ti.Vector([self.record[k][0], self.record[k][1], self.record[k][2]])
        if ti.static(self.has_shell):
            if k < self.ns:
                area = a.norm()
                unit = a / ti.max(area, 1e-30)
                up = r.dot(unit)
                side = ti.min(ti.max(up / (FADE * D), -1.0), 1.0)
                a *= side
                if up > 0.0:
                    r -= self.half * unit
                else:
                    r += self.half * unit
        return w2(r.norm(), inverse) * a

    @ti.func
    def above(self, k, x):
        """Height of x over the surface at the point k [m], on either side of a shell."""
        a = ti.Vector([self.record[k][3], self.record[k][4], self.record[k][5]])
        r = x - ti.Vector([self.record[k][0], self.record[k][1], self.record[k][2]])
        up = r.dot(a) / ti.max(a.norm(), 1e-30)
        if k < self.ns:
            up = ti.abs(up) - self.half
        return ti.max(up, 0.0)

    @ti.func
    def images(self, i, inverse):
        """The walls that show particle i images of the surfaces, and how many they are."""
        found, count = ti.Vector(NONE), 0
        if ti.static(self.walls.n > 0):
            found, count = self.walls.near(self.p.x[i], 1.0 / inverse, RIM * self.spacing)
        return found, count

    @ti.func
    def seen(self, found, image, x):
        """Where an image surface sees a particle that is at x: its own image, before the surface itself."""
        result = x
        if ti.static(self.walls.n > 0):
            result = self.walls.mirrored(found, image, x, self.origin)
        return result

    @ti.func
    def whole(self, found, image, i):
        """How much of an image particle i gets: less around the hole of a wall, as of the images of its neighbours."""
        result = ti.cast(1.0, ti.f64)
        if ti.static(self.walls.n > 0):
            for c in ti.static(range(MOST)):
                if (image >> c) & 1:
                    result *= self.walls.share(found[c], self.p.x[i], RIM * self.spacing)
        return ti.cast(result, float)

    @ti.func
    def reflected(self, found, image, a):
        result = a
        if ti.static(self.walls.n > 0):
            result = self.walls.turned(found, image, a)
        return result


def _turns(mesh) -> np.ndarray:
    x, c = mesh.points, mesh.cells
    last = np.where(c[:, 3] < 0, c[:, 0], c[:, 3])
    area = np.cross(x[c[:, 2]] - x[c[:, 0]], x[last] - x[c[:, 1]])
    return np.where((area * mesh.node_normals[c[:, 0]]).sum(axis=1) < 0, -1.0, 1.0)


@ti.func
def place(nodes: ti.template(), i):
    """Where node i is [m], f64."""
    return nodes.X[i] + ti.cast(nodes.u[i], ti.f64)


@ti.func
def _note(t: ti.template(), k, x, a, v, since):
    if since > 0.0:
        v = (x - t.was[k]) / since
    t.x[k], t.was[k] = x, x
    for c in ti.static(range(3)):
        t.record[k][c] = ti.cast(x[c] - t.origin[c], float)
        t.record[k][3 + c] = ti.cast(a[c], float)
        t.record[k][6 + c] = ti.cast(v[c], float)


@ti.kernel
def _lay(t: ti.template(), ns: ti.i32, nb: ti.i32, since: ti.f64):
    """Records of the points now."""
    if ti.static(t.has_shell):
        for i in range(ns):
            x = place(t.nodes, i)
            a = ti.Vector([0.0, 0.0, 0.0], ti.f64)
            for m in range(t.cells.start_of_node[i], t.cells.start_of_node[i + 1]):
                s = t.cells.of_node[m]
                if t.cells.broken[s] == 0:
                    last = t.cells.n_corners[s] - 1
                    # half the cross product of the diagonals; of a triangle the second one is a side
                    one = place(t.nodes, t.cells.corner[s][2]) - place(t.nodes, t.cells.corner[s][0])
                    two = place(t.nodes, t.cells.corner[s][3 if last == 3 else 0]) - place(t.nodes, t.cells.corner[s][1])
                    a += 0.5 * t.turn[s] / (last + 1.0) * one.cross(two)
            v = ti.cast(t.nodes.v[i], ti.f64)
            _note(t, i, x, a, v, since)
    if ti.static(t.has_rigids):
        for b in range(nb):
            r = t.owner[b]
            arm = turned(t.rigids.q[r], t.arm[b])
            x = t.rigids.x[r] + arm
            a = turned(t.rigids.q[r], t.facing[b])
            v = t.rigids.v[r] + spin_of(t.rigids, r).cross(arm)
            _note(t, ns + b, x, a, v, since)


@ti.kernel
def _travelled(t: ti.template(), n: ti.i32, points: ti.i32) -> ti.f64:
    """How far a particle and a point can have moved relative to each other since the lists were made [m]."""
    one, two = ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64)
    for i in range(n):
        ti.atomic_max(one, (t.p.x[i] - t.built_particles[i]).norm_sqr())
    for k in range(points):
        ti.atomic_max(two, (t.x[k] - t.built[k]).norm_sqr())
    return ti.sqrt(one) + ti.sqrt(two)


@ti.kernel
def _keep(t: ti.template(), n: ti.i32, points: ti.i32):
    for i in range(n):
        t.built_particles[i] = t.p.x[i]
    for k in range(points):
        t.built[k] = t.x[k]


@ti.kernel
def _pair(t: ti.template(), point: ti.template(), n: ti.i32, inverse: ti.f64, table: ti.i32, write: ti.i32):
    for i in range(n):
        x = t.built_particles[i]
        found = 0
        if write == 0 or t.start[i + 1] > t.start[i]:
            home = cube(x, inverse)
            for dx, dy, dz in ti.ndrange((-1, 2), (-1, 2), (-1, 2)):
                there = home + ti.Vector([dx, dy, dz])
                b = bucket(there, table)
                for m in range(t.grid.start[b], t.grid.start[b + 1]):
                    k = t.grid.sorted[m]
                    away = t.built[k] - x
                    if away.norm_sqr() * inverse * inverse < 1.0 and all(cube(t.built[k], inverse) == there):
                        if write == 1:
                            point[t.start[i] + found] = k
                        found += 1
        if write == 0:
            t.start[i + 1] = found


@ti.kernel
def _turn_round(t: ti.template(), point: ti.template(), particle: ti.template(), n: ti.i32, points: ti.i32):
    """The particles of each point, in the order of the particles."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        for k in range(points + 1):
            t.start_back[k] = 0
        for e in range(t.start[n]):
            t.start_back[point[e] + 1] += 1
        for k in range(points):
            t.start_back[k + 1] += t.start_back[k]
        for i in range(n):
            for e in range(t.start[i], t.start[i + 1]):
                k = point[e]
                particle[t.start_back[k]] = i
                t.start_back[k] += 1
        for m in range(points):  # each start stands at its end now
            k = points - m
            t.start_back[k] = t.start_back[k - 1]
        t.start_back[0] = 0


@ti.func
def beyond(u):
    """1 - gamma over an even wall with |w| = u times its largest: a fit of two polynomials of d, within 0.01; 0.85 of the integral, as
    the layers of a lattice at D/2, 3D/2 have it. A layer that has come nearer than D/2 (u = 0.728) has brought those behind it along, so
    that its kernel lacks no more than there."""
    s = ti.sqrt(1.0 - ti.min(u, 0.728))
    square = s * s
    return 0.425 * (1.0 - s * (1.137 - 0.137 * square * square))


@ti.func
def even(q):
    """|w| at the height q, over 2h, above an even wall without end, over that on it."""
    t = ti.max(1.0 - q, 0.0)
    return 14.0 * t * t * t * t * t * (1.0 - 1.5 * t + 4.0 / 7.0 * t * t)


@runtime.in_any_order
@ti.kernel
def _face(t: ti.template(), point: ti.template(), n: ti.i32, inverse_0: float):
    for i in range(n):
        if t.start[i + 1] > t.start[i]:
            D = t.p.pair[i][3]
            x = ti.Vector([t.p.pair[i][0], t.p.pair[i][1], t.p.pair[i][2]])
            v = ti.Vector([t.p.pair[i][4], t.p.pair[i][5], t.p.pair[i][6]])
            shell, body = x * 0.0, x * 0.0
            closing, closing_body, sizes, heights = D * 0.0, D * 0.0, D * 0.0, D * 0.0
            inverse = inverse_0 * t.spacing / D
            found, count = t.images(i, inverse)
            for image in range(1 << count):
                seen, moving = t.seen(found, image, x), t.reflected(found, image, v)
                whole = t.whole(found, image, i)
                for e in range(t.start[i], t.start[i + 1]):
                    k = point[e]
                    w = whole * t.facet(k, seen, D, inverse)
                    nearing = w.dot(moving - ti.Vector([t.record[k][6], t.record[k][7], t.record[k][8]]))
                    w = t.reflected(found, image, w)
                    sizes += w.norm()
                    heights += w.norm() * t.above(k, seen)
                    if k < t.ns:
                        shell += w
                        closing += nearing
                    else:
                        body += w
                        closing_body += nearing
            share = D * 0.0 + 1.0
            square = body.norm_sqr()
            if square > 0.0:
                share = 1.0 - ti.min(ti.max(shell.dot(body) / square, 0.0), 1.0)
            t.share[i] = share
            w = shell + share * body
            t.met[i] = ti.Vector([w[0], w[1], w[2], closing + share * closing_body])
            size = w.norm()
            missing = beyond(size / (FULL * inverse))
            if missing > 1e-4:
                t.side[i] = ti.Vector([w[0] / size, w[1] / size, w[2] / size, missing / (1.0 - missing)])
                t.cover[i] = ti.min(size / ti.max(FULL * inverse * even(inverse * heights / sizes), 1e-30), 1.0)
                t.p.pair[i][3] = -D


@runtime.in_any_order
@ti.kernel
def _gather(t: ti.template(), particle: ti.template(), points: ti.i32, inverse_0: float):
    for k in range(points):
        push = ti.Vector([inverse_0 * 0.0, inverse_0 * 0.0, inverse_0 * 0.0])
        for e in range(t.start_back[k], t.start_back[k + 1]):
            i = particle[e]
            D = ti.abs(t.p.pair[i][3])
            x = ti.Vector([t.p.pair[i][0], t.p.pair[i][1], t.p.pair[i][2]])
            inverse = inverse_0 * t.spacing / D
            found, count = t.images(i, inverse)
            for image in range(1 << count):
                w = t.whole(found, image, i) * t.facet(k, t.seen(found, image, x), D, inverse)
                if k >= t.ns:
                    w *= t.share[i]
                push -= t.stress[i] * w
        t.push[k] = push


@ti.kernel
def _onto_nodes(t: ti.template(), ns: ti.i32, times: ti.i32):
    for i in range(ns):
        t.nodes.force[i] += times * t.push[i]


@ti.kernel
def _onto_bodies(t: ti.template(), bodies: ti.i32, times: ti.i32):
    for r in range(bodies):
        force, torque = t.rigids.force[r], t.rigids.torque[r]
        water = force * 0.0
        for b in range(t.first[r], t.first[r + 1]):
            push = ti.cast(t.push[t.ns + b], ti.f64)
            water += push
            torque += times * (t.x[t.ns + b] - t.rigids.x[r]).cross(push)
        t.rigids.force[r], t.rigids.torque[r], t.rigids.water[r] = force + times * water, torque, water
