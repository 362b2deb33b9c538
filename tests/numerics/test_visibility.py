"""Which segments cross a broken cell: drawn cases, and random ones against points sampled on the segment."""

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.numerics.visibility import along, crosses
from taichi_sph.runtime import ti

SQUARE = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
TRIANGLE = np.array([[0.0, 0], [1, 0], [0, 1]])
TOLERANCE = 1e-6


@ti.kernel
def _crosses(ends: ti.types.ndarray(), polygon: ti.types.ndarray(), n: ti.i32, tolerance: ti.f64, result: ti.types.ndarray()):
    for k in range(ends.shape[0]):
        corners = ti.Matrix.zero(ti.f64, 4, 2)
        for c in range(n):
            corners[c, 0] = polygon[c, 0]
            corners[c, 1] = polygon[c, 1]
        a = ti.Vector([ends[k, 0], ends[k, 1]])
        b = ti.Vector([ends[k, 2], ends[k, 3]])
        result[k] = crosses(a, b, corners, n, tolerance)


@ti.kernel
def _along(ends: ti.types.ndarray(), tolerance: ti.f64, result: ti.types.ndarray()):
    for k in range(ends.shape[0]):
        a = ti.Vector([ends[k, 0], ends[k, 1]])
        b = ti.Vector([ends[k, 2], ends[k, 3]])
        result[k] = along(a, b, ti.Vector([0.0, 0.0]), ti.Vector([1.0, 0.0]), tolerance)


@pytest.fixture(scope="module", autouse=True)
def taichi():
    runtime.start()


def ask(ends, polygon):
    ends = np.asarray(ends, float)
    result = np.zeros(len(ends), np.int32)
    full = np.zeros((4, 2))
    full[: len(polygon)] = polygon
    _crosses(ends, full, len(polygon), TOLERANCE, result)
    return result.tolist()


def test_drawn_cases():
    through = [[-1, 0.5, 2, 0.5], [0.5, -1, 0.5, 2], [-0.2, 0.5, 0.5, 1.2], [0.2, 0.2, 0.8, 0.8], [0, 0, 1, 1], [0.5, 0.5, 3, 0.5]]
    past = [[-1, 1.5, 2, 1.5], [-1, 0.5, -0.1, 0.5], [0, 0, 1, 0], [-1, 0, 2, 0], [1, 1, 2, 2], [-0.5, 0.5, 0, 0.5], [-1, 1, 1, 3]]
    assert ask(through, SQUARE) == [1] * len(through)
    assert ask(past, SQUARE) == [0] * len(past)
    assert ask([[-1, 0.25, 2, 0.25], [0, 1, 1, 0], [0.6, 0.6, 2, 2], [0, 0, 0.5, 0.5]], TRIANGLE) == [1, 0, 0, 1]


@pytest.mark.parametrize("polygon", [SQUARE, TRIANGLE], ids=["square", "triangle"])
def test_random_segments(polygon):
    rng = np.random.default_rng(3)
    ends = rng.uniform(-1, 2, (500, 4))
    t = np.linspace(0, 1, 2001)[None, :, None]
    x = ends[:, None, :2] * (1 - t) + ends[:, None, 2:] * t
    side = np.roll(polygon, -1, axis=0) - polygon
    depth = np.min([(s[0] * (x[..., 1] - p[1]) - s[1] * (x[..., 0] - p[0])) / np.hypot(*s) for p, s in zip(polygon, side)], axis=0).max(
        axis=1
    )  # how deep inside the deepest sample lies
    clear = np.abs(depth) > 3e-3
    assert clear.sum() > 400
    assert np.array_equal(np.array(ask(ends, polygon))[clear], (depth > 0)[clear])
    assert ask(ends, polygon) == ask(ends[:, [2, 3, 0, 1]], polygon), "seeing must be mutual"


def test_along_a_side():
    yes = [[0, 0, 1, 0], [-1, 0, 2, 0], [0.2, 0, 0.4, 0], [0.9, 0, 3, 0], [2, 0, 0.5, 0]]
    no = [[1, 0, 2, 0], [-1, 0, 0, 0], [0, 0.1, 1, 0.1], [0, 0, 1, 0.01], [0.5, -1, 0.5, 1], [0.5, 0, 0.5, 1]]
    result = np.zeros(len(yes + no), np.int32)
    _along(np.array(yes + no, float), TOLERANCE, result)
    assert result.tolist() == [1] * len(yes) + [0] * len(no)
