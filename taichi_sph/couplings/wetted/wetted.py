"""Pressure between a fluid and all surfaces that it wets: thin ones from both sides, solid ones from outside.

The kernel of a particle near a surface reaches beyond the surface, where there are no particles. The missing part of its sums is an
integral over the surface, because the gradient of W over a volume is W over its boundary (Kulasegaram et al. 2004, Ferrand et al. 2013):

    integral beyond the surface of grad_i W dV = -w_i,     w_i = sum_k W(x_i - x_k) A_k

The sum runs over the points k of the surface (bodies/wettable.py). A_k is the vector area of point k and points into the fluid. V_i is the
volume of particle i. The half space beyond mirrors the pressure and the normal velocity of the particle itself. T 1.21 and T 1.26 then gain

    div_i = ... + 2 w_i . (v_i - v_k)
    f_i   = ... + V_i (2 p_i + Pi_i) w_i      and each point k its part of the opposite

Pi_i is T 1.24 of the particle against its own image at D/2. The mirror would also show particle i the images of its neighbours. Across the
wall w_i stands for these images. Along the wall nothing does, so the neighbours that are there count more along the wall: n is the
direction of w_i, and T_i multiplies what lies across n by 1/gamma_i.

    grad W_ij becomes T_i grad W_ij beside v and p_i, and T_j grad W_ij beside p_j,     T_i = 1 + (1/gamma_i - 1) (1 - n n)

gamma_i is the part of the kernel that lies in the fluid. Without T half of the divergence of a flow that turns along a wall would be
missing, and such a flow would press its own layer together.

With `divergence` "mean" of the fluid (bodies/fluid/pairs.py) w_k . (v_i - v_k) of the density is the mean of w_k now and where the two
were before, x_i - x_k - dt (v_i - v_k); viscosity keeps that of now.

Force and divergence are each other's transpose. So pressure does exactly the work on particle and surface that the density stores, and a
blow loses no energy. (Blows between pinballs do lose some.) In a fluid at one pressure the layers at D/2, 3D/2 ... bear the wall with 0.995
p (h/D = 1.165).

A thin point acts on the side where the particle is, half a thickness off its middle. Its action fades out over the last D/10 before its
middle plane, so that a particle in a hole feels the rim evenly. A shell's points are its nodes with the area of their sound cells as they
lie now: stretch, holes and petals are in them; a fragment has no cell left and is met by pinballs alone. A thin surface may hide a solid
one: a plug hides the striker that pushes it. The w of the solid surface then counts by 1 - (w_thin . w_solid) / |w_solid|^2, between 0
and 1.

A wall parts two particles when their normals oppose each other (n_i . n_j < -1/2) and the pair lies across the wall
(x_ij . (n_i - n_j) > 0). Force and rate of such a pair are multiplied by 1 - (c_i + c_j) / 2. The cover c_i is |w_i| over the |w| of an
even endless wall at the same height, 1 at most. Towards a rim or a hole both particles see past the edge: c falls with w, and the pair
fades in.

Rigid planes show a particle images of the surfaces as well as of its neighbours. Pinballs stand behind the pressure, at a quarter of D:
they stop what no pressure stops, and keep a sound wall tight.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ... import runtime
from ...bodies.fluid.surroundings import Surroundings
from ...bodies.fluid.walls import MOST, NONE, RIM
from ...bodies.wettable import SurfacePoints, Wettable
from ...numerics.cells import CUBES, CellGrid, alone, beside, cube, group, running
from ...numerics.kernel import w2
from ...pool import Pool
from ...runtime import ti
from ..carried import Carried

if TYPE_CHECKING:
    from ...bodies.fluid.body import FluidBody

FINE = 0.45  # D between the points of a rigid body's surface
FADE = 0.1  # of D
SKIN = 0.25  # of D, of the lists
FULL = 1.5  # |w| on a plane through the particle, over 1 / 2h: the integral of W over it


class Wetted(Pool):
    """The points of all surfaces that one group of fluids can press on; lists of who is near whom, both ways.

    s: what the particles read of it (Surroundings), which belongs to the fluid.
    """

    def __init__(self, name: str, surfaces: Sequence[Wettable], fluid: "FluidBody", hidden: Carried | None = None):
        """hidden: strikers that hide what they touch."""
        super().__init__(name)
        self.surfaces, self.fluid, self.p, self.walls, self.hidden = surfaces, fluid, fluid.p, fluid.walls, hidden
        self.first = [0, *np.cumsum([surface.n for surface in surfaces]).tolist()]
        self.n = n = self.first[-1]
        self.thin = any(surface.thin for surface in surfaces)  # some points have water on both sides
        halves = sorted({half for surface in surfaces for half in surface.halves})
        self.even, self.one_half = len(halves) == 1, halves[0] if halves else 0.0  # one thickness of all is a constant of the kernels
        self.points = SurfacePoints(f"{name}.points", n, fluid.origin)
        particles, new = self.p.n, self.field
        self.s = Surroundings(f"{name}.surroundings", particles, self.see, min(surface.lightest for surface in surfaces), fluid.pairs.mean)
        self.share = new("share", particles, doc="part of the w of solid surfaces that thin ones do not cover")
        self.built = new("built", n, 3, "f64", unit="m", keeps=True, doc="places of the points when the lists were made")
        self.built_particles = new("built_particles", particles, 3, "f64", unit="m", keeps=True, doc="places of the particles then")
        self.start_back = new("start_back", n + 1, dtype="i32", doc="the particles of point k are particle[start_back[k]] on")
        self.skin = SKIN * self.p.finest
        # 1.03: a particle's own support grows with its D (bodies.fluid.pool.WIDEST)
        self.shortest = max(halves, default=0.0) + self.skin
        self.reach = 1.03 * 2.0 * fluid.support * self.p.spacing + self.shortest
        self.fine = self.p.spacing / self.p.finest
        self.mean = fluid.pairs.mean
        self._lay(0.0)
        self.grid = CellGrid(f"{name}.grid", self.built, n, self.reach)
        self.room = 0
        fluid.surround(self.s)
        self.relist()

    def pools(self) -> list[Pool]:
        """All that is kept; lists come last."""
        hidden = [] if self.hidden is None else [self.hidden]
        return [self.points, self.s, *(pool for surface in self.surfaces for pool in surface.pools()), *hidden, self]

    def see(self, renumbered: bool, since: float = 0.0) -> None:
        """What the particles find of surfaces where all lie now (Surroundings.see)."""
        self._lay(since)
        if renumbered or _travelled(self, self.p.n, self.n) > self.skin:
            self.relist()
        _face(self, self.point, self.p.n, self.fluid.inverse, self.p.spacing, self.fluid.dt)

    def bear(self, times: int = 1) -> None:
        """The forces of the particles, once their `stress` is known, onto all surfaces, as one blow of so many steps; times 0: there is
        none."""
        if times:
            _gather(self, self.particle, self.n, self.fluid.inverse, self.p.spacing)
        for first, surface in zip(self.first, self.surfaces):
            surface.bear(self.points, first, times)

    def _lay(self, since: float) -> None:
        for first, surface in zip(self.first, self.surfaces):
            surface.lay(self.points, first, since)
        if self.hidden is not None:
            _hide(self.points, self.hidden, self.n, self.hidden.n)

    def begin_anew(self, since: float) -> None:
        """Points and lists where bodies are now, whatever they were before; since [s]: as `see` will be told."""
        self._lay(0.0)
        if since > 0.0:
            x, record = runtime.get(self.points.x, self.n), runtime.get(self.points.record, self.n)
            runtime.put(self.points.was, x - since * record[:, 6:9])
        self.relist()

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
        found = running(self.s.start, self.p.n)
        if found > self.room:
            self._widen(found)
        _pair(self, self.point, self.p.n, inverse, self.grid.table, 1)
        if runtime.one_by_one():
            _turn_round(self, self.point, self.particle, self.p.n, self.n)
        else:
            self._turned_round(found)
        self.fluid.pairs.mark()

    def _turned_round(self, found: int) -> None:
        """The same as `_turn_round`, in NumPy."""
        group(self.point, self.start_back, self.particle, found, self.n)
        first = runtime.get(self.s.start, self.p.n + 1)
        owner = np.repeat(np.arange(self.p.n, dtype=np.int32), np.diff(first))
        runtime.put(self.particle, owner[runtime.get(self.particle, found)])

    def _widen(self, found: int) -> None:
        self.room = max(64, 3 * found // 2)
        self.point = self.field("point", self.room, dtype="i32", grows=True, doc="points near each particle")
        self.particle = self.field("particle", self.room, dtype="i32", grows=True, doc="particles near each point")

    @ti.func
    def half(self, k):
        """Half the thickness at the thin point k [m]."""
        result = ti.cast(0.0, float)
        if ti.static(self.even):
            result = self.one_half
        else:
            result = self.points.half(k)
        return result

    @ti.func
    def facet(self, k, x, steep):
        """Point k as a particle at x sees it: its area, which changes its sign across a thin one, its normal, the distance to it, and the
        height of x over it, on either side of a thin one. w is area times W(distance) times normal. steep: 1 / (FADE D)."""
        normal, size = self.points.normal(k), self.points.size(k)
        r = x - self.points.place(k)
        up = r.dot(normal)
        height = up
        if ti.static(self.thin):
            thin, half = self.points.thin(k), self.half(k)
            height = ti.select(thin, ti.abs(up) - half, up)
            size *= ti.select(thin, ti.min(ti.max(up * steep, -1.0), 1.0), 1.0)
            r -= ti.select(thin, ti.select(up > 0.0, half, -half), 0.0) * normal
        return size, normal, r.norm(), ti.max(height, 0.0)

    @ti.func
    def images(self, i, inverse, spacing):
        """The walls that show particle i images of the surfaces, and how many they are."""
        found, count = ti.Vector(NONE), 0
        if ti.static(self.walls.n > 0):
            found, count = self.walls.near(self.p.x[i], 1.0 / inverse, RIM * spacing / self.fine)
        return found, count

    @ti.func
    def seen(self, found, image, x):
        """Where an image surface sees a particle that is at x: its own image, before the surface itself."""
        result = x
        if ti.static(self.walls.n > 0):
            result = self.walls.mirrored(found, image, x, self.points.origin[0])
        return result

    @ti.func
    def whole(self, found, image, i, spacing):
        """How much of an image particle i gets: less around the hole of a wall, as of the images of its neighbours."""
        result = ti.cast(1.0, ti.f64)
        if ti.static(self.walls.n > 0):
            for c in ti.static(range(MOST)):
                if (image >> c) & 1:
                    result *= self.walls.share(found[c], self.p.x[i], RIM * spacing / self.fine)
        return ti.cast(result, float)

    @ti.func
    def reflected(self, found, image, a):
        result = a
        if ti.static(self.walls.n > 0):
            result = self.walls.turned(found, image, a)
        return result


@ti.kernel
def _hide(points: ti.template(), hidden: ti.template(), n: ti.i32, strikers: ti.i32):
    """Thin points that a striker touches have no area: half the diagonal of a square of its area is how far a point reaches."""
    for k in range(n):
        if points.thin(k):
            half = 0.7072 * ti.sqrt(ti.cast(points.size(k), ti.f64))
            for s in range(strikers):
                if hidden.touches(s, points.x[k], half):
                    points.hide(k)


@ti.kernel
def _travelled(t: ti.template(), n: ti.i32, points: ti.i32) -> ti.f64:
    """How far a particle and a point can have moved relative to each other since the lists were made [m]. What is no part of a surface any
    more, the fastest of all as a rule, does not count."""
    one, two = ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64)
    for i in range(n):
        ti.atomic_max(one, (t.p.x[i] - t.built_particles[i]).norm_sqr())
    for k in range(points):
        if not t.points.lost(k):
            ti.atomic_max(two, (t.points.x[k] - t.built[k]).norm_sqr())
    return ti.sqrt(one) + ti.sqrt(two)


@ti.kernel
def _keep(t: ti.template(), n: ti.i32, points: ti.i32):
    for i in range(n):
        t.built_particles[i] = t.p.x[i]
    for k in range(points):
        t.built[k] = t.points.x[k]


@ti.func
def _off(within, c):
    """How far cube c of the CUBES is from a place in the middle one, whose sides are 1; within: the place there."""
    step = ti.Vector([c // 9 - 1, c // 3 % 3 - 1, c % 3 - 1])
    square = ti.cast(0.0, ti.f64)
    for k in ti.static(range(3)):
        away = ti.cast(0.0, ti.f64)
        if step[k] < 0:
            away = within[k]
        elif step[k] > 0:
            away = 1.0 - within[k]
        square += away * away
    return ti.sqrt(square)


@ti.kernel
def _pair(t: ti.template(), point: ti.template(), n: ti.i32, inverse: ti.f64, table: ti.i32, write: ti.i32):
    for i in range(n):
        x = t.built_particles[i]
        found, nearer = 0, inverse
        if ti.static(t.p.sized):  # finer particles reach less far
            nearer = 1.0 / (t.shortest + (t.reach - t.shortest) * ti.cast(t.p.size[i], ti.f64))
        looks = 0
        if write == 1:
            looks = t.s.start[i + 1] - t.s.start[i]
        elif not alone(t.grid, x, inverse, table):
            looks = 1
        if looks > 0:
            for c in range(CUBES):
                there, first, last = beside(t.grid, x, c, inverse, table)
                if ti.static(t.p.sized):  # of the cubes around a finer particle it reaches into a few
                    if _off(x * inverse - ti.floor(x * inverse), c) > inverse / nearer:
                        last = first
                for m in range(first, last):
                    k = t.grid.sorted[m]
                    away = t.built[k] - x
                    if away.norm_sqr() * nearer * nearer < 1.0 and all(cube(t.built[k], inverse) == there):
                        if write == 1:
                            point[t.s.start[i] + found] = k
                        found += 1
        if write == 0:
            t.s.start[i + 1] = found


@ti.kernel
def _turn_round(t: ti.template(), point: ti.template(), particle: ti.template(), n: ti.i32, points: ti.i32):
    """The particles of each point, in the order of the particles."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        for k in range(points + 1):
            t.start_back[k] = 0
        for e in range(t.s.start[n]):
            t.start_back[point[e] + 1] += 1
        for k in range(points):
            t.start_back[k + 1] += t.start_back[k]
        for i in range(n):
            for e in range(t.s.start[i], t.s.start[i + 1]):
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
def _face(t: ti.template(), point: ti.template(), n: ti.i32, inverse_0: float, spacing: float, back: float):
    for i in range(n):
        if t.s.start[i + 1] > t.s.start[i]:
            D = t.p.pair[i][3]
            x = ti.Vector([t.p.pair[i][0], t.p.pair[i][1], t.p.pair[i][2]])
            v = ti.Vector([t.p.pair[i][4], t.p.pair[i][5], t.p.pair[i][6]])
            thin, solid = x * 0.0, x * 0.0
            closing, closing_solid, sizes, heights = D * 0.0, D * 0.0, D * 0.0, D * 0.0
            sweeping, sweeping_solid = D * 0.0, D * 0.0
            inverse = inverse_0 * spacing / D
            steep = inverse / (FADE * inverse_0 * spacing)
            found, count = t.images(i, inverse, spacing)
            for image in range(1 << count):
                seen, moving = t.seen(found, image, x), t.reflected(found, image, v)
                whole = t.whole(found, image, i, spacing)
                for e in range(t.s.start[i], t.s.start[i + 1]):
                    k = point[e]
                    size, normal, away, height = t.facet(k, seen, steep)
                    size *= whole * w2(away, inverse)
                    w = size * normal
                    past = moving - t.points.velocity(k)
                    nearing = w.dot(past)
                    swept = nearing
                    if ti.static(t.mean):
                        size_before, _, away_before, _ = t.facet(k, seen - back * past, steep)
                        swept = 0.5 * nearing + 0.5 * size_before * whole * w2(away_before, inverse) * normal.dot(past)
                    w = t.reflected(found, image, w)
                    sizes += ti.abs(size)
                    heights += ti.abs(size) * height
                    part = D * 0.0
                    if ti.static(t.thin):
                        part = ti.select(t.points.thin(k), 1.0, 0.0)
                        thin += part * w
                        closing += part * nearing
                        sweeping += part * swept
                    solid += (1.0 - part) * w
                    closing_solid += (1.0 - part) * nearing
                    sweeping_solid += (1.0 - part) * swept
            share = D * 0.0 + 1.0
            square = solid.norm_sqr()
            if square > 0.0:
                share = 1.0 - ti.min(ti.max(thin.dot(solid) / square, 0.0), 1.0)
            t.share[i] = share
            w = thin + share * solid
            t.s.met[i] = ti.Vector([w[0], w[1], w[2], closing + share * closing_solid])
            if ti.static(t.mean):
                t.s.swept[i] = sweeping + share * sweeping_solid
            size = w.norm()
            missing = beyond(size / (FULL * inverse))
            if missing > 1e-4:
                t.s.side[i] = ti.Vector([w[0] / size, w[1] / size, w[2] / size, missing / (1.0 - missing)])
                t.s.cover[i] = ti.min(size / ti.max(FULL * inverse * even(inverse * heights / sizes), 1e-30), 1.0)
                t.p.pair[i][3] = -D


@runtime.in_any_order
@ti.kernel
def _gather(t: ti.template(), particle: ti.template(), points: ti.i32, inverse_0: float, spacing: float):
    for k in range(points):
        push = ti.Vector([inverse_0 * 0.0, inverse_0 * 0.0, inverse_0 * 0.0])
        for e in range(t.start_back[k], t.start_back[k + 1]):
            i = particle[e]
            D = ti.abs(t.p.pair[i][3])
            x = ti.Vector([t.p.pair[i][0], t.p.pair[i][1], t.p.pair[i][2]])
            inverse = inverse_0 * spacing / D
            steep = inverse / (FADE * inverse_0 * spacing)
            found, count = t.images(i, inverse, spacing)
            for image in range(1 << count):
                size, normal, away, height = t.facet(k, t.seen(found, image, x), steep)
                size *= t.whole(found, image, i, spacing) * w2(away, inverse)
                if not t.points.thin(k):
                    size *= t.share[i]
                push -= (t.s.stress[i] * size) * normal
        t.points.push[k] = push
