"""A mesh in two parts that overlap, a shell's or a solid's: which cells are elements, which are particles, how both are numbered.

    patched     cells that are particles alone
    overlap     those around them, one wide: both
    the rest    elements alone

Particles of both are the nodes of their cells, divided n times along each edge. Rows of cells end with -1 where a cell has fewer corners
than its row. NumPy only.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np


@dataclass(frozen=True, eq=False)
class Parted:
    """whole: the mesh; n: particles along the edge of an element; patched, overlap (M,) bool of its cells; fine: the particles."""

    whole: Any
    n: int
    patched: np.ndarray
    overlap: np.ndarray
    fine: Any

    @property
    def spacing(self) -> float:
        """Of the particles [m]."""
        return float(self.fine.mesh.spacing)

    @cached_property
    def cells(self) -> np.ndarray:
        """Numbers of the elements in the whole mesh."""
        return np.flatnonzero(~self.patched)

    @cached_property
    def nodes(self) -> np.ndarray:
        """Numbers of their nodes in the whole mesh."""
        node = np.unique(self.whole.cells[self.cells])
        return np.asarray(node[node >= 0])

    @cached_property
    def number(self) -> np.ndarray:
        """(N,) number of a node of the whole mesh among those of the elements, -1: it is not there."""
        found = np.full(len(self.whole.points), -1)
        found[self.nodes] = np.arange(len(self.nodes))
        return found

    @cached_property
    def numbered(self) -> np.ndarray:
        """(elements, corners) i32: their cells, by the numbers of their own nodes."""
        cells = self.whole.cells[self.cells]
        return np.where(cells < 0, -1, self.number[cells]).astype(np.int32)


def corners_of(cells: np.ndarray) -> np.ndarray:
    """(M, K) nodes of cells; one with fewer corners than its row has its first one again."""
    return np.where(cells < 0, cells[:, :1], cells)


def around(corner: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """(M,) bool: the cells that are chosen, and all that share a node with them."""
    node = np.zeros(corner.max() + 1, bool)
    node[corner[chosen]] = True
    return np.asarray(node[corner].any(axis=1))


def closed(patched: np.ndarray, corner: np.ndarray) -> np.ndarray:
    """(M,) bool: with cells all of whose nodes are those of others."""
    while True:
        node = np.zeros(corner.max() + 1, bool)
        node[corner[patched]] = True
        grown = patched | node[corner].all(axis=1)
        if (grown == patched).all():
            return patched
        patched = grown


def touching(n: int, corner: np.ndarray, patched: np.ndarray, overlap: np.ndarray) -> np.ndarray:
    """Numbers, of n nodes, of those that the overlaps of two patches share."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    cells, many = corner[patched], corner.shape[1]
    ends = np.repeat(cells[:, :1], many, axis=1)
    _, label = connected_components(coo_array((np.ones(cells.size), (ends.ravel(), cells.ravel())), shape=(n, n)), directed=False)
    own = np.full(n, -1)
    own[cells] = label[cells]
    beside = corner[overlap]
    first, last = np.where(own[beside] < 0, n, own[beside]).min(axis=1), own[beside].max(axis=1)
    low, high = np.full(n, n), np.full(n, -1)
    np.minimum.at(low, beside.ravel(), np.repeat(first, many))
    np.maximum.at(high, beside.ravel(), np.repeat(last, many))
    return np.flatnonzero((high >= 0) & (low != high))
