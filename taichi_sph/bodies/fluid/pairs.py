"""Everything that two neighbours in a fluid do to each other, in one pass over the lists (T 1.21 to 1.28).

With x = x_i - x_j, v = v_i - v_j, G = W'(r) / r < 0, so that grad_i W = G x, and V = D^3 = m / rho:

    div_i   = - sum_j V_j G v.x                                               continuity, d rho/dt = -rho div (T 1.21)
    f_i     = - V_i sum_j V_j (p_i + p_j + Pi_ij) G x                          momentum (T 1.26), g m_i beside it
    Pi_ij   = rho_0 (-alpha c h mu + beta h^2 mu^2) where mu = v.x / (r^2 + eps^2) < 0, eps = 0.1 h   (T 1.24, 1.25)
              or, "riemann", rho_0 u min(c, 3 u) where u = -v.x / r > 0        (Zhang, Hu and Adams 2017, their eq. 15)
    h_ij    = phi (D_i + D_j) / 2,   D_i = D_0 (1 + s_i)^(-1/3)                (T 1.27, and 1.28 integrated)
    ds_i/dt = -(1 + s_i) div_i - 2 delta h / (rho_0 c) sum_j V_j G (p_j - p_i + rho_0 g.x)      density diffusion

The weight V_i V_j (p_i + p_j) stands in place of T 1.23's m_i m_j (p_i / rho_i^2 + p_j / rho_j^2), from which it differs by the variation
of density. With it the force is the transpose of T 1.21, so pressure does the work that the density stores. Viscosity enters with the sign
of a pressure (in T 1.26 it has that of -sigma). The diffusion (Molteni and Colagrossi 2009) leaves alone what is
hydrostatic (Fourtakas et al. 2019): water at rest feels none.

The stress between the two states of a Riemann problem is p_i + p_j + rho_0 c u: what acts in a shock. In a flow slower than sound that
stress would be far above rho_0 u^2, which the flow itself has; with the limiter it is not, and no speed of sound is left in it.

The pass needs the present pressure of the neighbours, which follows from density rates that the same pass computes. So the pass acts with
the extrapolated s* = s_n-1 + dt (2 rate_n-1 - rate_n-2), and corrects s_n. For a wave of frequency w this damps amplitudes by
(w dt)^4 / 2 a step and is stable up to w dt = 0.70, against 2 for two passes; the energy it takes is booked (`lag`).
The extrapolated rates are those of the fluid alone: what surfaces did to a density over the step is known when its pressure is needed.

div_i above is that of the places at the end of the step, and v that of its middle. The work of pressure is of both ends, 1/2 dt
(f_n-1 + f_n) . v_n-1/2, and f_n-1 stands to div at x_n-1 as f_n to div at x_n. So the density stores 1/2 dt V p (div_n - div_n-1) too
much in a step, which in a run is of first order in dt. Where a striker ploughs through water G changes within a step, and 0.6 % of its
energy came from nowhere in the filled tank. With `divergence` "mean" the density follows the mean of both. The pair was at x - dt v, so
one more kernel a pair gives div_n-1 of the same velocities. What is left is of second order: D, T and the covers are those of the end.
Forces stay as they are.

Fluids of different density meet in the same sums: forces are of volumes, so the pressure is one across their interface (Hu and Adams 2006,
Grenier et al. 2009). Viscosity across it is the harmonic mean of the two fluids'; density diffuses within one fluid only. Both keep every
pair symmetric, so that momentum is kept and the energy taken is booked.
"""

from typing import Any

from ... import runtime
from ...laws import eos_acoustic, eos_tait
from ...numerics.kernel import w2_slope
from ...numerics.neighbours import Neighbours
from ...runtime import ti
from . import columns
from .pool import NARROWEST, WIDEST, FluidParticles
from .walls import MOST, NONE, RIM, Walls

RECORD = ti.types.vector(columns.COUNT, ti.f64)
HALF, OF_KERNEL, OF_MU, OF_ALPHA, OF_BETA = range(3, 8)  # of the record that `_act` reads: 1 / 2D_0, 1 / 2h_0, eps^2, viscosity


@ti.data_oriented
class FluidPairs:
    """The pass over a pool `p` (FluidParticles) with lists `near` (Neighbours). `wet`: Surroundings, where there is something to wet."""

    def __init__(
        self, p: FluidParticles, near: Neighbours, walls: Walls, support: float, tait: bool, cut: bool, riemann: bool, mean: bool = False
    ) -> None:
        """support phi = h / D; tait: the law of all; cut: some have a least pressure; riemann: the dissipation of all; mean: densities
        follow the mean of both ends of a step (`divergence`)."""
        self.p, self.near, self.walls, self.support = p, near, walls, support
        self.wet: Any = None
        self.wets = False
        self.tait, self.cut, self.riemann, self.mean = tait, cut, riemann, mean
        self.mixes = len(p.masses) > 1
        self.alone = tuple(runtime.get(p.constants, 1)[0].tolist())

    def pack(self, dt: float) -> None:
        """Records of the particles at the positions now, dt after the last pass; with the pressure that will act."""
        _pack(self, self.p.n, dt, self.alone)

    def mark(self) -> None:
        """Who may have a neighbour with a side: after every new list, of particles or of what they wet."""
        _mark(self, self.near.near, self.p.n, self.near.width)

    def act(self, dt_before: float, dt: float) -> None:
        """force, rate, s; books what viscosity, diffusion and lag take."""
        if self.wets:
            _meet(self, self.p.n, dt_before, self.alone)
        _act(self, self.near.near, self.p.n, self.near.width, dt_before, dt, self.alone)

    @ti.func
    def constants_of(self, i, alone):
        """Constants of the fluid of particle i; alone: those of the only one, which kernels are given as an argument."""
        result = alone
        if ti.static(self.mixes):
            result = self.p.constants[self.p.body[i]]
        return result

    @ti.func
    def viscous(self, along, square, eps2, linear, quadratic):
        """Pi of a pair with v.x = along and r^2 = square; linear, quadratic: columns.LINEAR and QUADRATIC."""
        result = along * 0.0
        if ti.static(self.riemann):
            closing = ti.max(-along, 0.0) / ti.sqrt(square + 1e-3 * eps2)
            result = closing * ti.min(linear, quadratic * closing)
        else:
            mu = ti.min(along, 0.0) / (square + eps2)
            result = mu * (quadratic * mu - linear)
        return result

    @ti.func
    def pressure(self, stiffness, gamma, least, s):
        result = eos_acoustic.pressure(stiffness, gamma, s)
        if ti.static(self.tait):
            result = eos_tait.pressure(stiffness, gamma, s)
        if ti.static(self.cut):
            result = ti.max(result, least)
        return result


@ti.kernel
def _pack(t: ti.template(), n: ti.i32, dt: float, alone: RECORD):
    for i in range(n):
        k = t.constants_of(i, alone)
        s = t.p.s[i] + dt * (2.0 * t.p.rate[i] - t.p.rate_before[i])
        size = ti.min(ti.max((1.0 + ti.max(s, -0.9)) ** (-1.0 / 3.0), NARROWEST), WIDEST)
        x = t.p.x[i] - vector(k, columns.ORIGIN)  # single precision needs records that are relative to a place in their middle
        v = t.p.v[i]
        for c in ti.static(range(3)):
            t.p.pair[i][c] = ti.cast(x[c], float)
            t.p.pair[i][4 + c] = v[c]
        own = ti.cast(k[columns.OWN], float)
        if ti.static(t.p.sized):
            own *= t.p.size[i]
        t.p.pair[i][3] = own * size
        t.p.pair[i][7] = t.pressure(
            ti.cast(k[columns.STIFFNESS], float), ti.cast(k[columns.GAMMA], float), ti.cast(k[columns.LEAST], float), s
        )


@ti.kernel
def _meet(t: ti.template(), n: ti.i32, dt: float, alone: RECORD):
    """The pressures that will act, with what surfaces did to the densities over the step: that is known already, and extrapolated it would
    feed the fastest modes of a shell (docs/method.md, 11)."""
    for i in range(n):
        if t.wet.start[i + 1] > t.wet.start[i]:
            k = t.constants_of(i, alone)
            before = t.p.s[i]
            closing = t.wet.met[i][3]
            if ti.static(t.mean):
                closing = t.wet.swept[i]
            s = before + dt * (2.0 * t.p.rate[i] - t.p.rate_before[i]) - (1.0 + before) * dt * 2.0 * closing
            t.p.pair[i][7] = t.pressure(
                ti.cast(k[columns.STIFFNESS], float), ti.cast(k[columns.GAMMA], float), ti.cast(k[columns.LEAST], float), s
            )


@ti.kernel
def _mark(t: ti.template(), near: ti.template(), n: ti.i32, width: ti.i32):
    """amid (wetted.py): more than have a side now, so that it holds until the next list."""
    for i in range(n):
        amid = 0
        for m in range(t.near.begin(i, width), t.near.begin(i, width) + t.near.number[i]):  # i itself is in its list
            amid = ti.max(amid, ti.select(t.wet.start[near[m] + 1] > t.wet.start[near[m]], 1, 0))
        t.wet.amid[i] = amid


@ti.func
def _pair(t: ti.template(), a, b, x, v, c, linear, quadratic, back):
    """Of one neighbour: what it adds to force (3), div, spread, power, all over V_i, and G V_j. a, b: records of i and j
    (FluidParticles.pair); x and v are those of i relative to j; c: see `_act`; back [s]: the step that led here. Last (3), with `mean`, the
    mean of G x now and where the pair was before."""
    D, p, D_j, p_j = a[3], a[7], ti.abs(b[3]), b[7]
    square = x[0] * x[0] + x[1] * x[1] + x[2] * x[2]
    # 1 / (2 h_ij) by its series about D_0: no division, and right to 1e-6 for 6 % of compression
    e = 1.0 - (D + D_j) * c[HALF]
    inverse, eps2, diffused = c[OF_KERNEL] * (1.0 + e * (1.0 + e * (1.0 + e))), c[OF_MU], 1.0
    if ti.static(t.p.sized):  # D may be half of D_0 or less; what goes with h of the pair is symmetric
        q = (D + D_j) * c[HALF]
        inverse, eps2, diffused = c[OF_KERNEL] / q, c[OF_MU] * q * q, q
        if ti.static(not t.riemann):
            linear, quadratic = linear * q, quadratic * q * q
    G = w2_slope(ti.sqrt(square), inverse) * (D_j * D_j * D_j)
    along = v[0] * x[0] + v[1] * x[1] + v[2] * x[2]
    viscous = t.viscous(along, square, eps2, linear, quadratic)
    f = -G * (p + p_j + viscous)
    spread = -G * (p_j - p + c[0] * x[0] + c[1] * x[1] + c[2] * x[2])
    if ti.static(t.p.sized):
        spread *= diffused
    mean = x * 0.0
    if ti.static(t.mean):
        y = x - back * v
        mean = 0.5 * G * x + 0.5 * w2_slope(y.norm(), inverse) * (D_j * D_j * D_j) * y
    return f * x[0], f * x[1], f * x[2], -G * along, spread, G * along * viscous, G, mean[0], mean[1], mean[2]


@ti.func
def _neighbours(t: ti.template(), near: ti.template(), i, first, a, own, c, back, found, image, sided: ti.template(), holed: ti.template()):
    """Sums of `_pair` over the list of particle i, whose record is a and whose side is `own`: force (3), div, spread, power; c: see `_act`.

    sided: some of them, or i, may have a side (wetted.py). holed: a is that of an image of i in walls with holes, which is not whole near
    them. No branch otherwise, so that several neighbours are taken at once."""
    x, v, D, p = ti.Vector([a[0], a[1], a[2]]), ti.Vector([a[4], a[5], a[6]]), a[3], a[7]
    f0, f1, f2, div, spread, power = D * 0.0, D * 0.0, D * 0.0, D * 0.0, D * 0.0, D * 0.0
    here, cover = ti.Vector([own[0], own[1], own[2]]), D * 0.0
    if ti.static(sided):
        if own[3] > 0.0:
            cover = t.wet.cover[i]
    for m in range(first, first + t.near.number[i]):
        j = near[m]
        b = t.p.pair[j]
        y, w = x - ti.Vector([b[0], b[1], b[2]]), v - ti.Vector([b[4], b[5], b[6]])
        whole = D * 0.0 + 1.0
        if ti.static(holed):
            for k in ti.static(range(MOST)):
                if (image >> k) & 1:
                    if t.walls.radius[found[k]] > 0.0:  # i as j, so that forces and rates stay each other's transpose
                        shares = t.walls.share(found[k], t.p.x[i], RIM * t.p.finest) * t.walls.share(found[k], t.p.x[j], RIM * t.p.finest)
                        whole *= ti.cast(shares, float)
        n, size = here, D * 0.0
        if ti.static(sided):
            other = t.wet.side[j]
            n, size = ti.Vector([other[0], other[1], other[2]]), ti.select(b[3] < 0.0, other[3], 0.0)
            behind = ti.select(here.dot(n) < -0.5, 1.0, 0.0) * ti.select(y.dot(here - n) > 0.0, 1.0, 0.0) * ti.select(b[3] < 0.0, 1.0, 0.0)
            whole *= 1.0 - 0.5 * ti.cast(behind, float) * (cover + t.wet.cover[j])
        linear, quadratic, within = c[OF_ALPHA], c[OF_BETA], whole
        if ti.static(t.mixes):
            other = t.p.body[j]
            alike = ti.select(other == t.p.body[i], 1.0, 0.0)
            within = whole * ti.cast(alike, float)  # density diffuses in one fluid only
            # viscous stress is one on both sides: the harmonic mean (Hu and Adams 2006)
            there, too = ti.cast(t.p.constants[other][columns.LINEAR], float), ti.cast(t.p.constants[other][columns.QUADRATIC], float)
            linear = ti.select(alike > 0.5, linear, 2.0 * linear * there / ti.max(linear + there, 1e-30))
            quadratic = ti.select(alike > 0.5, quadratic, 2.0 * quadratic * too / ti.max(quadratic + too, 1e-30))
        one = _pair(t, a, b, y, w, c, linear, quadratic, back)
        f0, f1, f2 = f0 + whole * one[0], f1 + whole * one[1], f2 + whole * one[2]
        spread, power = spread + within * one[4], power + whole * one[5]
        mean = whole * ti.Vector([one[7], one[8], one[9]])
        if ti.static(t.mean):
            div -= mean.dot(w)
        else:
            div += whole * one[3]
        if ti.static(sided):
            mine, his = along(own, y), size * (y - y.dot(n) * n)
            more, G = p * mine + b[7] * his, whole * one[6]
            f0, f1, f2 = f0 - G * more[0], f1 - G * more[1], f2 - G * more[2]
            if ti.static(t.mean):
                div -= w.dot(along(own, mean))
            else:
                div -= G * w.dot(mine)
    return ti.Vector([f0, f1, f2, div, spread, power])


@runtime.in_any_order
@ti.kernel
def _act(t: ti.template(), near: ti.template(), n: ti.i32, width: ti.i32, dt_before: float, dt: float, alone: RECORD):
    for i in range(n):
        a = t.p.pair[i]
        x, v, D, p = ti.Vector([a[0], a[1], a[2]]), ti.Vector([a[4], a[5], a[6]]), ti.abs(a[3]), a[7]
        k = t.constants_of(i, alone)
        stiffness, gamma, least = ti.cast(k[columns.STIFFNESS], float), ti.cast(k[columns.GAMMA], float), ti.cast(k[columns.LEAST], float)
        density, spacing, inverse_0 = (
            ti.cast(k[columns.DENSITY], float),
            ti.cast(k[columns.SPACING], float),
            ti.cast(k[columns.INVERSE], float),
        )
        linear, quadratic, eps2 = ti.cast(k[columns.LINEAR], float), ti.cast(k[columns.QUADRATIC], float), ti.cast(k[columns.EPS2], float)
        diffusion = ti.cast(k[columns.DIFFUSION], float)
        gravity = ti.cast(vector(k, columns.GRAVITY), float)
        g = density * gravity
        # what a pair has to know of the fluid of i: rho_0 g, then HALF to OF_BETA
        c = ti.Vector([g[0], g[1], g[2], 0.5 / spacing, inverse_0, eps2, linear, quadratic])
        first = t.near.begin(i, width)
        own = ti.Vector([D * 0.0, D * 0.0, D * 0.0, D * 0.0])
        amid = False
        if ti.static(t.wets):
            amid = t.wet.amid[i] == 1
            if a[3] < 0.0:
                own = t.wet.side[i]
        found, count = ti.Vector(NONE), 0
        if ti.static(t.walls.n > 0):
            rim = RIM * spacing
            if ti.static(t.p.sized):
                rim = RIM * t.p.finest
            found, count = t.walls.near(t.p.x[i], 1.0 / inverse_0, rim)
        f, div, spread, power = x * 0.0, D * 0.0, D * 0.0, D * 0.0
        # what the images of its neighbours in walls do to i is what they themselves do to its image: image 0 is i itself
        for image in range(1 << count):
            y, w, side, whole = x, v, own, True
            if ti.static(t.walls.n > 0):
                if not t.walls.shows(found, image, t.p.x[i], 1.0 / inverse_0):
                    continue
                y, w = t.walls.mirrored(found, image, x, vector(k, columns.ORIGIN)), t.walls.turned(found, image, v)
                turned = t.walls.turned(found, image, ti.Vector([own[0], own[1], own[2]]))
                side = ti.Vector([turned[0], turned[1], turned[2], own[3]])
            one = ti.Vector([y[0], y[1], y[2], D, w[0], w[1], w[2], p])
            sums = ti.Vector([0, 0, 0, 0, 0, 0], float)
            if ti.static(t.walls.holed):
                if t.walls.pierced(found, image):
                    whole = False
                    sums = _neighbours(t, near, i, first, one, side, c, dt_before, found, image, t.wets, True)
            if whole:
                if ti.static(t.wets):
                    if amid:
                        sums = _neighbours(t, near, i, first, one, side, c, dt_before, found, image, True, False)
                if not amid:
                    sums = _neighbours(t, near, i, first, one, side, c, dt_before, found, image, False, False)
            force = ti.Vector([sums[0], sums[1], sums[2]])
            if ti.static(t.walls.n > 0):
                force = t.walls.turned(found, image, force)
            f += force
            div, power = div + sums[3], power + sums[5]
            if image == 0:
                spread = sums[4]
        V = D * D * D
        wall = D * 0.0  # divergence by what the surfaces do
        if ti.static(t.wets):
            w, approach = x * 0.0, D * 0.0
            if t.wet.start[i + 1] > t.wet.start[i]:
                w, approach = ti.Vector([t.wet.met[i][0], t.wet.met[i][1], t.wet.met[i][2]]), t.wet.met[i][3]
            closing = 2.0 * ti.min(approach, 0.0) / ti.max(w.norm(), 1e-30)  # -u against its image at D/2 behind the surface
            viscous = D * 0.0
            if ti.static(t.p.sized and not t.riemann):
                q = D / spacing
                linear, quadratic = linear * q, quadratic * q * q
            if ti.static(t.riemann):
                viscous = -closing * ti.min(linear, -quadratic * closing)
            else:
                mu = 2.0 / D * ti.min(approach, 0.0) / ti.max(w.norm(), 1e-30)
                viscous = mu * (quadratic * mu - linear)
            stress = 2.0 * p + viscous
            f += stress * w
            wall = 2.0 * approach
            if ti.static(t.mean):
                wall *= 0.0
                if t.wet.start[i + 1] > t.wet.start[i]:
                    wall = 2.0 * t.wet.swept[i]
            power -= 2.0 * viscous * approach
            t.wet.stress[i] = V * stress
        t.p.force[i] = V * f + t.p.mass[i] * gravity
        before = t.p.s[i]
        mean = 1.0 + before + 0.5 * dt_before * t.p.rate[i]
        spread *= diffusion
        rate = -mean * div  # extrapolated with the diffusion it would be stable only up to kappa dt = 2/7, not 2
        now = before + dt_before * (rate + spread - mean * wall)
        was, there = t.pressure(stiffness, gamma, least, before), t.pressure(stiffness, gamma, least, now)
        t.p.lag[i] += 0.5 * V * dt_before * (div + wall) * (t.p.missed[i] + there - p)
        t.p.diffused[i] -= 0.5 * V * dt_before * spread / mean * (was + there)
        t.p.viscous[i] += 0.25 * (dt_before + dt) * V * power
        t.p.missed[i] = there - p
        t.p.s[i] = now
        if dt_before > 0.0:
            t.p.rate_before[i] = t.p.rate[i]
        else:
            t.p.rate_before[i] = rate
        t.p.rate[i] = rate


@ti.func
def vector(record, k: ti.template()):
    """The vector that begins in column k of a record."""
    return ti.Vector([record[k], record[k + 1], record[k + 2]])


@ti.func
def along(side: ti.template(), x):
    """(T - 1) x of wetted.py."""
    n = ti.Vector([side[0], side[1], side[2]])
    return side[3] * (x - x.dot(n) * n)
