"""Points within the cells or faces of a surface: where they are, which area they stand for, and what the corners get of a force on them.

A quadrilateral is cut into each x each in its coordinates xi, eta; a triangle into each^2 alike. The shape functions that place a point
from the corners also share its force among them, so that force, moment and power are those at the point.
"""

import numpy as np

from .. import runtime
from ..pool import Pool
from ..runtime import ti

EVEN, COARSE = 2.2, 2.8  # of the spacing that points of rigid surfaces have: how far apart points are, at most, and nodes that are points


def each_of(spacing: float, fine: float) -> int:
    """Points along the side of a cell of that spacing [m], where those of rigid surfaces are `fine` [m] apart; 1 where that is 0."""
    return max(1, int(np.ceil(spacing / (EVEN * fine)))) if fine else 1


class Within(Pool):
    """The tables of the points of one cell: `n` of them."""

    def __init__(self, name: str, each: int):
        super().__init__(name)
        self.n = each * each
        at = _quads(each)
        self.shape = self.field("shape", 2 * self.n, 4, "f64", doc="of the corners at the points of a quadrilateral, then of a triangle")
        self.at = self.field("at", self.n, 2, "f64", doc="xi, eta of the points of a quadrilateral")
        runtime.put(self.shape, np.concatenate([_bilinear(at), _triangles(each)]))
        runtime.put(self.at, at)

    @ti.func
    def shares(self, quad, q):
        """Of the corners of a cell at its point q."""
        return self.shape[q + ti.select(quad, 0, ti.static(self.n))]

    @ti.func
    def area(self, x: ti.template(), quad, q):
        """Vector area [m2] of point q of a cell whose corners are the rows of x (4, 3); of a triangle the fourth is not asked for."""
        x0, x1, x2 = row(x, 0), row(x, 1), row(x, 2)
        one, two, share = x1 - x0, x2 - x0, 0.5 / ti.static(self.n)  # the same all over a triangle
        if quad:
            xi, eta, x3 = self.at[q][0], self.at[q][1], row(x, 3)
            one = 0.25 * ((1.0 - eta) * (x1 - x0) + (1.0 + eta) * (x2 - x3))
            two = 0.25 * ((1.0 - xi) * (x3 - x0) + (1.0 + xi) * (x2 - x1))
            share = 4.0 / ti.static(self.n)
        return share * one.cross(two)


@ti.func
def row(x: ti.template(), k: ti.template()):
    return ti.Vector([x[k, 0], x[k, 1], x[k, 2]])


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
