"""Kick, walls and drift of a fluid, and its sums."""

import numpy as np

from ... import runtime
from ...laws import eos_acoustic, eos_tait
from ...numerics.reduce import BLOCK, Reducer
from ...runtime import ti
from . import columns
from .pairs import RECORD, FluidPairs


@ti.kernel
def drift(p: ti.template(), walls: ti.template(), n: ti.i32, dt_before: float, dt: float, spacing: float, pushed: ti.i32):
    # the work of contact is booked where its forces are made (couplings.contact.multipliers), that of walls here
    kick = 0.5 * (dt_before + dt)
    for i in range(n):
        before = p.v[i]
        push = before * 0.0  # of the walls
        after = before + kick / p.mass[i] * p.force[i]
        if pushed == 1:
            after += kick / p.mass[i] * p.push[i]
        for k in range(walls.n):
            if walls.stands(k, p.x[i]):
                gap = walls.height(k, p.x[i]) - 0.5 * spacing
                if ti.static(p.sized):
                    gap += 0.5 * spacing * (1.0 - p.size[i])
                normal = ti.cast(walls.normal[k], float)
                short = -ti.cast(ti.max(gap, 0.0), float) / dt - after.dot(normal)
                if short > 0.0:
                    after += short * normal
                    push += p.mass[i] / kick * short * normal
        if any(push != 0.0) or p.ahead[i] != 0.0:
            p.work[i] += p.ahead[i] + ti.cast(0.5 * dt_before * push.dot(before), ti.f64)
            p.ahead[i] = ti.cast(0.5 * dt * push.dot(after), ti.f64)
        p.v[i] = after
        p.x[i] += ti.cast(dt, ti.f64) * ti.cast(after, ti.f64)
        if dt_before == 0.0:
            before = 2.0 * before - after  # v_0 was given at t = 0: this is the half step before it
        p.kinetic[i] = 0.5 * p.mass[i] * before.dot(after)


def stored_energy(pairs: FluidPairs, reducer: Reducer) -> float:
    """Energy of compression [J]."""
    p = pairs.p
    blocks = -(-p.n // BLOCK)
    _stored(reducer.partial, pairs, p.n, blocks, pairs.alone)
    return float(np.sum(runtime.get(reducer.partial, blocks)))


@ti.kernel
def _stored(partial: ti.template(), t: ti.template(), n: ti.i32, blocks: ti.i32, alone: RECORD):
    for b in range(blocks):
        total = ti.cast(0.0, ti.f64)
        for i in range(b * BLOCK, ti.min(n, (b + 1) * BLOCK)):
            c = t.constants_of(i, alone)
            stiffness, gamma, least = c[columns.STIFFNESS], c[columns.GAMMA], c[columns.LEAST]
            s = ti.cast(t.p.s[i], ti.f64)
            beyond = ti.cast(0.0, ti.f64)
            if ti.static(t.cut):
                # below the compression of p_min the pressure stays
                bottom = eos_acoustic.compression(stiffness, gamma, least)
                if ti.static(t.tait):
                    bottom = eos_tait.compression(stiffness, gamma, least)
                if s < bottom:
                    beyond = least / c[columns.DENSITY] * (1.0 / (1.0 + bottom) - 1.0 / (1.0 + s))
                    s = bottom
            e = eos_acoustic.energy(gamma, s)
            if ti.static(t.tait):
                e = eos_tait.energy(gamma, s)
            total += ti.cast(t.p.mass[i], ti.f64) * (c[columns.SOUND2] * e + beyond)
        partial[b] = total
