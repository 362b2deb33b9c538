"""Which nodes a region of the scene means. NumPy only; decided once, on reference positions."""

from __future__ import annotations

import numpy as np

from ..scene.regions import Ball, Box, Outside, Region


def extent(points: np.ndarray) -> float:
    """Largest width [m] of points along an axis."""
    return float(np.ptp(points, axis=0).max(initial=0.0))


def inside(region: Region, points: np.ndarray, size: float | None = None) -> np.ndarray:
    """(N, 3) reference positions [m] -> (N,) bool. Rounding does not decide: the border is 1e-9 sizes thick. size: their `extent`, where
    it is known."""
    slack = 1e-9 * (extent(points) if size is None else size)
    return ~_inside(region.of, points, -slack) if isinstance(region, Outside) else _inside(region, points, slack)


def _inside(region: Box | Ball, points: np.ndarray, slack: float) -> np.ndarray:
    if isinstance(region, Ball):
        with np.errstate(over="ignore"):  # of a centre beyond all measure
            return np.linalg.norm(points - np.asarray(region.centre), axis=1) <= region.radius + slack
    caught = np.ones(len(points), bool)
    for axis in range(3):
        lo, hi = region.lo[axis], region.hi[axis]
        if lo is not None:
            caught &= points[:, axis] >= lo - slack
        if hi is not None:
            caught &= points[:, axis] <= hi + slack
    return caught
