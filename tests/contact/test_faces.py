"""The nearest point of a cell, against a dense search."""

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.couplings.contact.faces import nearest
from taichi_sph.pool import Pool
from taichi_sph.runtime import ti


class Cells(Pool):
    """n cells, a place for each, and what was found."""

    def __init__(self, n):
        super().__init__("cells")
        self.corner = self.field("corner", 4 * n, 3, "f64")
        self.x, self.q = self.field("x", n, 3, "f64"), self.field("q", n, 3, "f64")
        self.split = self.field("split", n, 4, "f64")


@ti.kernel
def find(cells: ti.template(), n: ti.i32, sides: ti.i32):
    for k in range(n):
        c = ti.static(cells.corner)
        cells.split[k], cells.q[k] = nearest(c[4 * k], c[4 * k + 1], c[4 * k + 2], c[4 * k + 3], sides, cells.x[k])


@pytest.mark.parametrize("sides", [3, 4])
def test_the_nearest_point_of_a_warped_cell(sides):
    n, rng = 200, np.random.default_rng(1)
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) + 0.2 * rng.standard_normal((n, 4, 3))
    x = np.array([0.5, 0.5, 0.0]) + 0.7 * rng.standard_normal((n, 3))
    runtime.start("cpu", "f64", 1)
    cells = Cells(n)
    runtime.put(cells.corner, corners.reshape(-1, 3))
    runtime.put(cells.x, x)
    find(cells, n, sides)
    split, q = runtime.get(cells.split, n), runtime.get(cells.q, n)
    assert split.min() >= 0 and split.sum(axis=1) == pytest.approx(np.ones(n), abs=1e-12)
    assert np.einsum("nk,nki->ni", split, corners) == pytest.approx(q, abs=1e-12)
    s, t = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, 81), np.linspace(0, 1, 81)))
    s, t = s[s + t <= 1], t[s + t <= 1]
    parts = np.stack([1 - s - t, s, t], axis=1)
    middle = corners[:, :sides].mean(axis=1)
    around = [np.stack([corners[:, k], corners[:, (k + 1) % sides], middle], axis=1) for k in range(sides)]
    dense = np.concatenate([np.einsum("pk,nki->npi", parts, one) for one in around], axis=1)
    least = np.linalg.norm(dense - x[:, None], axis=2).min(axis=1)
    found = np.linalg.norm(q - x, axis=1)
    assert (found <= least + 1e-12).all() and (found > least - 0.02).all()
