"""The surface of shells for water that is finer than they are: points within the cells.

A particle sees a surface by a sum over its points (couplings/wetted). Points that stand farther apart than particles do would let some of
them stand where the sum is small.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ...pool import Pool
from ...runtime import ti
from ..wettable import SurfacePoints
from ..within import Within
from .surface import ShellPoints, place

if TYPE_CHECKING:
    from .group import ShellGroup


class CellPoints(ShellPoints):
    """Points of shells that stand one after the other in their group; water may stand on both sides of them."""

    def __init__(self, name: str, group: "ShellGroup", shells: Sequence[Any], each: int):
        """each: points along a side of a cell."""
        super().__init__(name, group, shells)
        self.begin_cell, self.n_cells, self.n_nodes = shells[0].cells.first, sum(body.cells.n for body in shells), self.n
        self.within = Within(f"{name}.within", each)
        self.n = self.n_cells * self.within.n

    def pools(self) -> Sequence[Pool]:
        return [self, self.within]

    def lay(self, points: SurfacePoints, first: int, since: float) -> None:
        _lay(points, self, first, self.begin, self.begin_cell, self.n_cells, since)

    def bear(self, points: SurfacePoints, first: int, times: int) -> None:
        if times:
            _bear(points, self, first, self.begin, self.n_nodes, self.begin_cell, times)


@ti.kernel
def _lay(points: ti.template(), shell: ti.template(), first: ti.i32, begin: ti.i32, begin_cell: ti.i32, n: ti.i32, since: ti.f64):
    for c in range(n):
        s = begin_cell + c
        corner, quad = shell.cells.corner[s], shell.cells.n_corners[s] == 4
        x = ti.Matrix.zero(ti.f64, 4, 3)
        for k in ti.static(range(4)):
            if corner[k] >= 0:
                at = place(shell.nodes, corner[k])
                for m in ti.static(range(3)):
                    x[k, m] = at[m]
        for q in range(ti.static(shell.within.n)):
            shares = shell.within.shares(quad, q)
            a = shell.turn[s] * (1 - shell.cells.broken[s]) * shell.within.area(x, quad, q)
            there, v, half = a * 0.0, a * 0.0, a[0] * 0.0
            for k in ti.static(range(4)):
                if corner[k] >= 0:
                    there += shares[k] * ti.Vector([x[k, 0], x[k, 1], x[k, 2]])
                    v += shares[k] * ti.cast(shell.nodes.v[corner[k]], ti.f64)
                    half += shares[k] * shell.half_of[corner[k] - begin]
            points.note(first + c * ti.static(shell.within.n) + q, there, a, v, half, 1, since)


@ti.kernel
def _bear(points: ti.template(), shell: ti.template(), first: ti.i32, begin: ti.i32, n: ti.i32, begin_cell: ti.i32, times: ti.i32):
    for k in range(n):
        i = begin + k
        push = ti.Vector([0.0, 0.0, 0.0], float)
        for m in range(shell.cells.start_of_node[i], shell.cells.start_of_node[i + 1]):
            s = shell.cells.of_node[m]
            base = first + (s - begin_cell) * ti.static(shell.within.n)
            for c in ti.static(range(4)):
                if shell.cells.corner[s][c] == i:
                    for q in range(ti.static(shell.within.n)):
                        share = shell.within.shares(shell.cells.n_corners[s] == 4, q)[c]
                        push += ti.cast(share, float) * points.push[base + q]
        shell.nodes.force[i] += times * push
