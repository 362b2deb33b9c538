"""Drag of a striker that is narrower than a few particles, and what the fluid gets of it.

A sphere that leaves an open cavity behind loses 1/2 rho C_d A v^2 dx on its way dx. The water before it gets that momentum, and nearly all
of the energy drives it aside, which opens the cavity: 1/2 rho C_d A v^2 = pi rho N (R dR/dt)^2. Particles as wide as the striker cannot
make either of it: none goes round, and what lies within r + D/2 is pushed. So both are given to the particles in the half ball of radius
H before the striker, H = 4 r or the fluid's own support where that is more. With e the direction of flight, y_i the part of x_i - x across
e, W the kernel with the radius H, the weights g_i = 2 m_i W_i and their sum G,

    F   = 1/2 rho_0 C_d A u^2 min(1, G / s rho_0),      u = (e.v - sum g_i e.v_i / G) / (1 - b)
    f_i = g_i / G (F e + q (d_i - d)),      d_i = y_i / sqrt(y_i^2 + r^2),      d = sum g_i d_i / G

The forces f_i sum to F e. q is the positive root of the equation which says that the power of all f_i is what the striker loses, with
velocities at the middle of the kick; so momentum and energy are exact, whatever the step.

G is rho_0 in still water, and less where the half ball ends in a surface or where water has begun to part before the striker. The drag is
whole from G = s rho_0 on: so much stands before a striker half a radius off a surface, whose nose is then wet as far as water follows it;
s = 7 t^6 - 9 t^7 + 3 t^8 with t = 1 - r / 2H. It is half of that where the nose touches.

b is what the striker itself has done to the water that is asked: in a steady flight that water goes along by F / (2 rho_0 v) times the
integral of P^2 over a plane across e, P the kernel summed along e; the integral is SQUARE / H^2.

H does not follow the spacing below r, so that waves and cavities are alike at all spacings. What the water takes up at the surface within
the first microseconds (the slap) is not in the law.
"""

import math
from typing import Any

from ... import runtime
from ...numerics.kernel import w2
from ...pool import Pool
from ...runtime import ti

WIDE = 4.0  # radii of the striker: H
SQUARE = 1.1412  # H^2 times the integral over a plane of (the kernel summed across it)^2
BLOCK = 256
SUMS = 13  # G | g v (3) | g d (3) | g d.v | g^2/m | g^2/m d (3) | g^2/m d^2


class DragLaw(Pool):
    """Of one rigid body (`number` in the pool `rigids`) in fluid `of` of the particles p."""

    def __init__(
        self, name: str, rigids: Any, number: int, p: Any, of: int, coefficient: float, radius: float, support: float, density: float
    ):
        """density [kg/m3] of the fluid at rest; radius [m] of the frontal area; support [m]: 2h of the fluid."""
        super().__init__(name)
        self.rigids, self.number, self.p, self.of = rigids, number, p, of
        self.radius, self.half = radius, max(WIDE * radius, support)
        self.area = coefficient * math.pi * radius**2
        self.density = density
        t = 1.0 - 0.5 * radius / self.half
        self.wet = density * (7.0 * t**6 - 9.0 * t**7 + 3.0 * t**8)  # s rho_0
        self.own = 0.25 * self.area * SQUARE / self.half**2  # b
        self.blocks = -(-p.n // BLOCK)
        self.partial = self.field("partial", self.blocks, SUMS, "f64", doc="sums over blocks of particles")
        self.push = self.field("push", 1, 5, "f64", doc="F / G and q / G, d (3); of the step")
        self.last = self.field("last", 1, 3, "f64", unit="N", keeps=True, doc="of the fluid on the body, since its last step")
        self.taken = self.field("taken", 1, dtype="f64", unit="J", keeps=True, doc="of the striker's energy that no particle got")

    @property
    def lost(self) -> float:
        return float(runtime.get(self.taken, 1)[0])

    def act(self, kick: float, times: int) -> None:
        """The forces at the positions now, as one blow of so many steps of the clock, `kick` [s] long each; times 0: there is none."""
        if times:
            numbers = self.p.n, self.blocks, self.number, self.of
            _act(self, *numbers, kick, times, self.radius, 1.0 / self.half, self.density, self.wet, self.area, self.own)
        _share(self, self.number, times)


@ti.func
def _weight(t: ti.template(), i, x, e, of, radius, inverse):
    """g of particle i, 0 where it does not lie before a striker at x that flies along e, and d of it."""
    g, y = ti.cast(0.0, ti.f64), e * 0.0
    if t.p.body[i] == of:
        away = ti.cast(t.p.x[i], ti.f64) - x
        ahead = away.dot(e)
        if ahead > 0.0 and away.norm_sqr() * inverse * inverse < 1.0:
            g = 2.0 * ti.cast(t.p.mass[i], ti.f64) * w2(away.norm(), inverse)
            y = away - ahead * e
            y /= ti.sqrt(y.norm_sqr() + radius * radius)
    return g, y


@ti.kernel
def _act(
    t: ti.template(), n: ti.i32, blocks: ti.i32, r: ti.i32, of: ti.i32, step: ti.f64, times: ti.i32, radius: ti.f64, inverse: ti.f64,
    density: ti.f64, wet: ti.f64, area: ti.f64, own: ti.f64,
):  # fmt: skip
    kick = times * step
    for b in range(blocks):
        x, v = t.rigids.x[r], t.rigids.v[r]
        e = v / ti.max(v.norm(), 1e-300)
        for c in ti.static(range(SUMS)):
            t.partial[b][c] = 0.0
        for i in range(b * BLOCK, ti.min(n, (b + 1) * BLOCK)):
            g, d = _weight(t, i, x, e, of, radius, inverse)
            if g > 0.0:
                m = ti.cast(t.p.mass[i], ti.f64)
                u = ti.cast(t.p.v[i], ti.f64) + 0.5 * kick / m * ti.cast(t.p.force[i], ti.f64)
                t.partial[b][0] += g
                for c in ti.static(range(3)):
                    t.partial[b][1 + c] += g * u[c]
                    t.partial[b][4 + c] += g * d[c]
                    t.partial[b][9 + c] += g * g / m * d[c]
                t.partial[b][7] += g * d.dot(u)
                t.partial[b][8] += g * g / m
                t.partial[b][12] += g * g / m * d.norm_sqr()
    ti.loop_config(serialize=True)
    for _ in range(1):
        sums = ti.Vector([0.0] * SUMS, ti.f64)
        for b in range(blocks):
            sums += t.partial[b]
        v, M = t.rigids.v[r], t.rigids.mass[r]
        speed, G = v.norm(), sums[0]
        e = v / ti.max(speed, 1e-300)
        t.push[0] *= 0.0
        t.last[0] *= 0.0
        if G > 0.0 and speed > 0.0:
            water = ti.Vector([sums[1], sums[2], sums[3]]) / G
            d = ti.Vector([sums[4], sums[5], sums[6]]) / G
            across = ti.Vector([sums[9], sums[10], sums[11]])
            u = ti.max(speed - water.dot(e), 0.0) / (1.0 - own)
            F = 0.5 * density * ti.min(1.0, G / wet) * area * u * u
            speed += 0.5 / M * (step * t.rigids.force[r].dot(e) - kick * F)
            # a q^2 + b q = c
            a = 0.5 * kick / (G * G) * (sums[12] - 2.0 * d.dot(across) + d.norm_sqr() * sums[8])
            b = sums[7] / G - d.dot(water)
            c = F * (speed - e.dot(water)) - 0.5 * kick * F * F * sums[8] / (G * G)
            q = ti.cast(0.0, ti.f64)
            if c > 0.0 and a > 1e-12 * kick / M:
                q = 2.0 * c / (b + ti.sqrt(b * b + 4.0 * a * c))
            t.taken[0] += kick * (c - q * (a * q + b))
            t.push[0] = ti.Vector([F / G, q / G, d[0], d[1], d[2]])
            t.last[0] = -F * e
            t.rigids.force[r] -= times * F * e
    for i in range(n):
        if t.push[0][0] > 0.0:
            x, v = t.rigids.x[r], t.rigids.v[r]
            e = v / ti.max(v.norm(), 1e-300)
            g, d = _weight(t, i, x, e, of, radius, inverse)
            if g > 0.0:
                push = t.push[0]
                f = g * (push[0] * e + push[1] * (d - ti.Vector([push[2], push[3], push[4]])))
                t.p.force[i] += ti.cast(f, float)


@ti.kernel
def _share(t: ti.template(), r: ti.i32, times: ti.i32):
    """What the body feels in each step of the clock (bodies.rigid.pool: spread)."""
    t.rigids.spread[r] += (1 - times) * t.last[0]
