"""Patches of rectangles. NumPy only."""

from __future__ import annotations

import numpy as np

from .patch import Patch, strip


def sheet(length: float, width: float, spacing: float) -> Patch:
    """Rectangle in z = 0 from the origin."""
    return flat(length, np.linspace(0, width, max(1, round(width / spacing)) + 1), max(1, round(length / spacing)))


def flat(length: float, heights: np.ndarray, columns: int) -> Patch:
    def bend(chart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        zero = np.zeros(len(chart))
        return np.column_stack([chart, zero]), np.column_stack([zero, zero, zero + 1])

    return strip(length, columns, heights, False, bend)
