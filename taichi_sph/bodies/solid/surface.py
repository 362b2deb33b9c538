"""The surface of solids for water: points within their faces; water stands on their outside only.

A face counts while one of its two cells lives. Where cells break, the faces behind them come to the surface.
"""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ... import runtime
from ...pool import Pool
from ...runtime import ti
from ..wettable import SurfacePoints
from ..within import Within

if TYPE_CHECKING:
    from .group import SolidGroup


class SolidPoints(Pool):
    """Points of the faces of a group of solids, of all that may come to the surface."""

    thin = False
    halves: Sequence[float] = ()

    def __init__(self, name: str, group: "SolidGroup", each: int, meets: Callable[[str], bool]):
        """each: points along a side of a face; meets: which solids are met, by name."""
        super().__init__(name)
        self.nodes, self.cells, self.skin = group.nodes, group.cells, group.skin
        self.within = Within(f"{name}.within", each)
        met = np.concatenate([np.full(s.nodes.n, meets(s.name)) for s in group.solids])
        corner = runtime.get(self.skin.corner, len(self.skin.movers))
        number = np.flatnonzero(met[corner[:, 0]])
        self.faces = len(number)
        self.n = self.faces * self.within.n
        slot = np.full(len(corner), -1, np.int32)
        slot[number] = np.arange(self.faces)
        self.number = self.field("number", self.faces, dtype="i32", doc="of a face that water meets, in the skin")
        self.slot = self.field("slot", len(corner), dtype="i32", doc="of a face of the skin among them, -1: no water meets it")
        runtime.put(self.number, number.astype(np.int32))
        runtime.put(self.slot, slot)
        own = met & (group.mesh.node_areas > 0)
        density = np.concatenate([np.full(s.nodes.n, s.said.material.density) for s in group.solids])
        self.lightest = float((density[own] * group.mesh.node_volumes[own] / group.mesh.node_areas[own]).min(initial=np.inf))

    def pools(self) -> Sequence[Pool]:
        return [self, self.within]

    def lay(self, points: SurfacePoints, first: int, since: float) -> None:
        _lay(points, self, first, self.faces, since)

    def bear(self, points: SurfacePoints, first: int, times: int) -> None:
        if times:
            _bear(points, self, first, self.skin.n, times)


@ti.func
def _outward(of: ti.template(), f):
    """1 where a face points out of its live cell, -1 where into it, 0 where it is not on the surface."""
    one, other = of.skin.cells[f][0], of.skin.cells[f][1]
    across = 0
    if other >= 0:
        across = 1 - of.cells.broken[other]
    return 1 - of.cells.broken[one] - across


@ti.kernel
def _lay(points: ti.template(), of: ti.template(), first: ti.i32, n: ti.i32, since: ti.f64):
    for p in range(n):
        f = of.number[p]
        corner, side = of.skin.corner[f], _outward(of, f)
        quad = corner[3] >= 0
        x = ti.Matrix.zero(ti.f64, 4, 3)
        for k in ti.static(range(4)):
            if corner[k] >= 0:
                at = of.nodes.X[corner[k]] + ti.cast(of.nodes.u[corner[k]], ti.f64)
                for m in ti.static(range(3)):
                    x[k, m] = at[m]
        for q in range(ti.static(of.within.n)):
            shares = of.within.shares(quad, q)
            a = side * of.within.area(x, quad, q)
            there, v = a * 0.0, a * 0.0
            for k in ti.static(range(4)):
                if corner[k] >= 0:
                    there += shares[k] * ti.Vector([x[k, 0], x[k, 1], x[k, 2]])
                    v += shares[k] * ti.cast(of.nodes.v[corner[k]], ti.f64)
            points.note(first + p * ti.static(of.within.n) + q, there, a, v, 0.0, 0, since)


@ti.kernel
def _bear(points: ti.template(), of: ti.template(), first: ti.i32, n: ti.i32, times: ti.i32):
    for k in range(n):
        i = of.skin.node[k]
        push = ti.Vector([0.0, 0.0, 0.0], float)
        for m in range(of.skin.start[k], of.skin.start[k + 1]):
            f = of.skin.face[m]
            p = of.slot[f]
            for c in ti.static(range(4)):
                if p >= 0 and of.skin.corner[f][c] == i:
                    for q in range(ti.static(of.within.n)):
                        share = of.within.shares(of.skin.corner[f][3] >= 0, q)[c]
                        push += ti.cast(share, float) * points.push[first + p * ti.static(of.within.n) + q]
        of.nodes.force[i] += times * push
