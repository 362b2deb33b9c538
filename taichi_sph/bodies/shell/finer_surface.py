"""The surface of shells for water that is finer than they are: points within the cells, EACH along each side of one.

A particle sees a surface by a sum over its points (couplings/wetted). Points that stand farther apart than particles do would let some of
them stand where the sum is small. What a point is pushed with goes to the corners of its cell by the shape functions that place the point:
so force, moment and power are those at the point.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import runtime
from ...runtime import ti
from ..wettable import SurfacePoints
from .surface import ShellPoints, place

if TYPE_CHECKING:
    from .group import ShellGroup


class CellPoints(ShellPoints):
    """Points of shells that stand one after the other in their group; water may stand on both sides of them."""

    def __init__(self, name: str, group: "ShellGroup", shells: Sequence[Any], each: int):
        """each: points along a side of a cell."""
        super().__init__(name, group, shells)
        self.begin_cell, self.n_cells, self.n_nodes = shells[0].cells.first, sum(body.cells.n for body in shells), self.n
        self.each = each * each
        self.n = self.n_cells * self.each
        quads, triangles = _quads(each), _triangles(each)
        self.shape = self.field("shape", 2 * self.each, 4, "f64", doc="of the corners at the points of a quadrilateral, then of a triangle")
        self.at = self.field("at", self.each, 2, "f64", doc="xi, eta of the points of a quadrilateral")
        runtime.put(self.shape, np.concatenate([_bilinear(quads), triangles]))
        runtime.put(self.at, quads)

    def lay(self, points: SurfacePoints, first: int, since: float) -> None:
        _lay(points, self, first, self.begin, self.begin_cell, self.n_cells, since)

    def bear(self, points: SurfacePoints, first: int, times: int) -> None:
        if times:
            _bear(points, self, first, self.begin, self.n_nodes, self.begin_cell, times)


def _quads(each: int) -> np.ndarray:
    """(each^2, 2) xi, eta of the middles of the squares into which [-1, 1]^2 is cut."""
    a = (2.0 * np.arange(each) + 1.0) / each - 1.0
    return np.stack(np.meshgrid(a, a, indexing="ij"), axis=-1).reshape(-1, 2)


def _bilinear(at: np.ndarray) -> np.ndarray:
    """(N, 4) shape functions of the corners (-1, -1), (1, -1), (1, 1), (-1, 1)."""
    xi, eta = at[:, 0], at[:, 1]
    return 0.25 * np.column_stack([(1 - xi) * (1 - eta), (1 + xi) * (1 - eta), (1 + xi) * (1 + eta), (1 - xi) * (1 + eta)])


def _triangles(each: int) -> np.ndarray:
    """(each^2, 4) shares of the corners at the middles of the triangles into which a triangle is cut; the fourth is 0."""
    upright = [(i + 1 / 3, j + 1 / 3) for i in range(each) for j in range(each - i)]
    turned = [(i + 2 / 3, j + 2 / 3) for i in range(each - 1) for j in range(each - 1 - i)]
    a = np.array(upright + turned) / each
    return np.column_stack([1.0 - a.sum(axis=1), a, np.zeros(len(a))])


@ti.kernel
def _lay(points: ti.template(), shell: ti.template(), first: ti.i32, begin: ti.i32, begin_cell: ti.i32, n: ti.i32, since: ti.f64):
    for c in range(n):
        s = begin_cell + c
        corner = shell.cells.corner[s]
        quad = shell.cells.n_corners[s] == 4
        x0, x1, x2 = place(shell.nodes, corner[0]), place(shell.nodes, corner[1]), place(shell.nodes, corner[2])
        x3 = x0 * 1.0
        if quad:
            x3 = place(shell.nodes, corner[3])
        for q in range(ti.static(shell.each)):
            shape = shell.shape[q + ti.select(quad, 0, ti.static(shell.each))]
            # the area of a triangle is the same all over it
            one, two, share = x1 - x0, x2 - x0, 0.5 / ti.static(shell.each)
            if quad:
                xi, eta = shell.at[q][0], shell.at[q][1]
                one = 0.25 * ((1.0 - eta) * (x1 - x0) + (1.0 + eta) * (x2 - x3))
                two = 0.25 * ((1.0 - xi) * (x3 - x0) + (1.0 + xi) * (x2 - x1))
                share = 4.0 / ti.static(shell.each)
            a = share * shell.turn[s] * one.cross(two)
            if shell.cells.broken[s] == 1:
                a *= 0.0
            x, v, half = a * 0.0, a * 0.0, a[0] * 0.0
            for k in ti.static(range(4)):
                if corner[k] >= 0:
                    x += shape[k] * place(shell.nodes, corner[k])
                    v += shape[k] * ti.cast(shell.nodes.v[corner[k]], ti.f64)
                    half += shape[k] * shell.half_of[corner[k] - begin]
            points.note(first + c * ti.static(shell.each) + q, x, a, v, half, 1, since)


@ti.kernel
def _bear(points: ti.template(), shell: ti.template(), first: ti.i32, begin: ti.i32, n: ti.i32, begin_cell: ti.i32, times: ti.i32):
    for k in range(n):
        i = begin + k
        push = ti.Vector([0.0, 0.0, 0.0], float)
        for m in range(shell.cells.start_of_node[i], shell.cells.start_of_node[i + 1]):
            s = shell.cells.of_node[m]
            row = first + (s - begin_cell) * ti.static(shell.each)
            shift = ti.select(shell.cells.n_corners[s] == 4, 0, ti.static(shell.each))
            for c in ti.static(range(4)):
                if shell.cells.corner[s][c] == i:
                    for q in range(ti.static(shell.each)):
                        push += ti.cast(shell.shape[q + shift][c], float) * points.push[row + q]
        shell.nodes.force[i] += times * push
