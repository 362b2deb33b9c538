"""A filling made even before the run: moved until a uniform pressure would leave every particle where it is.

A lattice in a round vessel is uneven along the wall; under load it would pack, and the level sink. Here each particle
follows

    b_i = 1/2 sum_j V_j (T_i + T_j) grad_i W_ij - w_i,      x_i <- x_i - RATE D^2 b_i, by D/20 at most,

where b_i is the force of a uniform pressure with its sign turned (as in the transport velocity of Adami et al. 2013), and T_i and w_i are
those of wetted.py. Near a free level b_i is never zero, so nothing moves along the axis there.

Where water is finer in a part of it (Finer), two lattices meet in a plane, and b_i is not zero there either: `settle_jumps` moves those
that have a neighbour of another size. D is then that of the particle, and the kernel that of the pair.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ... import runtime
from ...numerics.kernel import w2_slope
from ...runtime import ti
from . import columns
from .pairs import along, vector
from .walls import NONE

RATE, FARTHEST = 0.25, 0.05  # of D^2 b, of D
ENOUGH, MOST = 4e-3, 40  # of D: the largest move of a round that is small enough; rounds at most
FREE = 0.8  # of the sum of V r W', 1 within a fluid: with less a particle lies at a free surface
NEAR = 1.2  # |w| over 1 / 2h where a particle is 0.4 D off an even wall


def even_out(body: Any, axes: Sequence[str], levels: Sequence[float | None]) -> np.ndarray:
    """(N, 3) places of the particles of a FluidBody whose fluids stand up to `levels` [m] along their axes (None: no level is free)."""
    p, near, pairs = body.p, body.near, body.pairs
    h = body.support * p.spacing
    up, top = runtime.new("packing.up", len(axes), 3, "f64"), runtime.new("packing.top", len(axes), dtype="f64")
    runtime.put(up, np.array([np.eye(3)["xyz".index(axis)] for axis in axes]))
    runtime.put(top, np.array([1e300 if level is None else level - 2.1 * h for level in levels]))
    for _ in range(MOST):
        if near.moved() >= body.skin:
            body.sort()
        pairs.pack(0.0)
        body.surroundings.see(True, 0.0)
        farthest = _move(pairs, near.near, p.n, near.width, 0.5 / h, up, top)
        if farthest < ENOUGH * p.finest:
            break
    order = np.argsort(runtime.get(p.id, p.n))
    return runtime.get(p.x, p.n)[order]


@ti.kernel
def _move(
    t: ti.template(), near: ti.template(), n: ti.i32, width: ti.i32, inverse_0: float, ups: ti.template(), tops: ti.template()
) -> ti.f64:
    farthest = ti.cast(0.0, ti.f64)
    for i in range(n):
        a = t.p.pair[i]
        x = ti.Vector([a[0], a[1], a[2]])
        b = x * 0.0
        D = t.p.spacing
        if ti.static(t.p.sized):
            D *= t.p.size[i]
        for m in range(t.near.begin(i, width), t.near.begin(i, width) + t.near.number[i]):
            j = near[m]
            y = x - ti.Vector([t.p.pair[j][0], t.p.pair[j][1], t.p.pair[j][2]])
            felt = y
            if a[3] < 0.0:
                felt += 0.5 * along(t.wet.side[i], y)
            if t.p.pair[j][3] < 0.0:
                felt += 0.5 * along(t.wet.side[j], y)
            if ti.static(t.p.sized):
                D_j = t.p.spacing * t.p.size[j]
                b += D_j * D_j * D_j * w2_slope(y.norm(), inverse_0 * 2.0 * t.p.spacing / (D + D_j)) * felt
            else:
                b += D * D * D * w2_slope(y.norm(), inverse_0) * felt
        w = x * 0.0
        if t.wet.start[i + 1] > t.wet.start[i]:
            w = ti.Vector([t.wet.met[i][0], t.wet.met[i][1], t.wet.met[i][2]])
        shift = ti.cast(-RATE * D * D * (b - w), ti.f64)
        up = ups[t.p.body[i]]
        if t.p.x[i].dot(up) > tops[t.p.body[i]]:
            shift -= shift.dot(up) * up
        near_wall = ti.cast(w.norm(), ti.f64)
        inverse = inverse_0
        if ti.static(t.p.sized):
            inverse /= t.p.size[i]
        if near_wall > NEAR * inverse:  # no nearer to a wall
            n_wall = ti.cast(w, ti.f64) / near_wall
            shift -= ti.min(shift.dot(n_wall), 0.0) * n_wall
        size = shift.norm()
        if size > FARTHEST * D:
            shift *= FARTHEST * D / size
        ti.atomic_max(farthest, ti.min(size, FARTHEST * D))
        t.p.x[i] += shift
    return farthest


def settle_jumps(body: Any) -> np.ndarray:
    """(N, 3) places of the particles of a FluidBody beside no surface, between planes at most. What a free surface is in reach of stays."""
    p, near, pairs = body.p, body.near, body.pairs
    whole = runtime.new("packing.whole", p.n)
    for _ in range(MOST):
        if near.moved() >= body.skin:
            body.sort()
        pairs.pack(0.0)
        _uneven(pairs, near.near, whole, p.n, near.width, body.inverse)
        if _settle(pairs, near.near, whole, p.n, near.width) < ENOUGH:
            break
    order = np.argsort(runtime.get(p.id, p.n))
    return runtime.get(p.x, p.n)[order]


@ti.kernel
def _uneven(t: ti.template(), near: ti.template(), whole: ti.template(), n: ti.i32, width: ti.i32, inverse_0: float):
    """b of each particle, in `force`, and the sum of V r W', in `whole`: 1 within a fluid."""
    for i in range(n):
        D = t.p.spacing * t.p.size[i]
        x = ti.Vector([t.p.pair[i][0], t.p.pair[i][1], t.p.pair[i][2]])
        b, sum_ = x * 0.0, D * 0.0
        found, count = ti.Vector(NONE), 0
        if ti.static(t.walls.n > 0):
            found, count = t.walls.near(t.p.x[i], 1.0 / inverse_0, t.p.finest)
        for image in range(1 << count):
            seen = x
            if ti.static(t.walls.n > 0):
                if not t.walls.shows(found, image, t.p.x[i], 1.0 / inverse_0):
                    continue
                seen = t.walls.mirrored(found, image, x, vector(t.p.constants[0], columns.ORIGIN))
            one = x * 0.0
            for m in range(t.near.begin(i, width), t.near.begin(i, width) + t.near.number[i]):
                j = near[m]
                y = seen - ti.Vector([t.p.pair[j][0], t.p.pair[j][1], t.p.pair[j][2]])
                D_j = t.p.spacing * t.p.size[j]
                part = D_j * D_j * D_j * w2_slope(y.norm(), inverse_0 * 2.0 * t.p.spacing / (D + D_j)) * y
                one += part
                sum_ -= part.dot(y) / 3.0
            if ti.static(t.walls.n > 0):
                one = t.walls.turned(found, image, one)
            b += one
        t.p.force[i], whole[i] = b, sum_


@ti.kernel
def _settle(t: ti.template(), near: ti.template(), whole: ti.template(), n: ti.i32, width: ti.i32) -> float:
    """The largest move, in D of its particle."""
    farthest = ti.cast(0.0, float)
    for i in range(n):
        amid, least = 0, whole[i]  # 1: amid particles that differ in size
        for m in range(t.near.begin(i, width), t.near.begin(i, width) + t.near.number[i]):
            j = near[m]
            amid = ti.max(amid, ti.select(ti.abs(t.p.size[j] - t.p.size[i]) > 0.01, 1, 0))
            least = ti.min(least, whole[j])
        if amid == 1 and least > FREE:
            D = t.p.spacing * t.p.size[i]
            shift = -RATE * D * D * t.p.force[i]
            size = shift.norm()
            if size > FARTHEST * D:
                shift *= FARTHEST * D / size
            ti.atomic_max(farthest, ti.min(size / D, FARTHEST))
            t.p.x[i] += ti.cast(shift, ti.f64)
    return farthest
