"""How wide a torn shell is open: the area within the lips of what its largest piece has lost. NumPy and SciPy."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components


def opening(
    places: np.ndarray, cells: np.ndarray, sides: np.ndarray, areas: np.ndarray, broken: np.ndarray, loose: np.ndarray, whole: np.ndarray
) -> float:
    """Area that is open [m2]: that of all regions of `openings`."""
    return float(openings(places, cells, sides, areas, broken, loose, whole)[1].sum()) if broken.any() else 0.0


def openings(
    places: np.ndarray, cells: np.ndarray, sides: np.ndarray, areas: np.ndarray, broken: np.ndarray, loose: np.ndarray, whole: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The region of each cell (M,), and the area that is open within each region [m2] (as many as cells, 0 beyond the last region).

    places (N, 3) [m] of the nodes now; cells (M, 4), -1 for a triangle's fourth corner; sides (R, 2) of edges: 4 * cell + side, -1 beyond
    a border (geometry/mesh.py); areas (M,) [m2] at t = 0; broken (M,) bool; loose (N,) bool: nodes without a live cell; whole (M,) bool:
    live cells of the largest piece.

    Cells that no longer belong to the largest piece lie in regions, each within loops of lips. The vector area of the loops is what one
    sees through them at most. A crack is a row of broken cells and has no width at first: their areas are taken off. Those beside what
    has fallen out (a plug, a loose node) are not: the hole there is as wide as its lips are apart.
    """
    n, gone = len(cells), ~whole
    first, other = sides.T // 4
    inner = other >= 0
    corners = np.where(cells < 0, cells[:, :1], cells)
    out = loose.copy()  # nodes of what fell out
    out[corners[gone & ~broken]] = True
    beside = gone & out[corners].any(axis=1)
    both = inner & gone[first] & gone[other]
    _, region = connected_components(coo_array((np.ones(both.sum()), (first[both], other[both])), shape=(n, n)), directed=False)
    lips = np.concatenate([sides[gone[first] & ~(inner & gone[other]), 0], sides[inner & gone[other] & ~gone[first], 1]])
    cell, side = lips // 4, lips % 4
    last = np.where(cells[:, 3] < 0, 2, 3)[cell]
    a, b = cells[cell, side], cells[cell, np.where(side == last, 0, side + 1)]
    loops = np.zeros((n, 3))
    np.add.at(loops, region[cell], 0.5 * np.cross(places[a], places[b]))
    taken = np.bincount(region, np.where(gone & ~beside, areas, 0.0), minlength=n)
    return region, np.clip(np.linalg.norm(loops, axis=1) - taken, 0.0, None)
