"""Hexahedra of a mesh divided n x n x n. NumPy only.

Points of the lattice in a hexahedron are where its trilinear functions put them. So the faces of the fine cells lie where the coarse
one has them, and both have the same linear fields, however skew the cells are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .mesh import CORNERS, SolidMesh

NONE = np.iinfo(np.int64).max


@dataclass(frozen=True)
class Subdivided:
    """mesh; of its cells parent (M,), the number of the hexahedron in the old mesh, and place (M, 3), where each stands in its lattice."""

    mesh: SolidMesh
    parent: np.ndarray
    place: np.ndarray


def subdivided(mesh: SolidMesh, cells: np.ndarray, n: int) -> Subdivided:
    """The hexahedra `cells` (K,) of a mesh, each as n x n x n."""
    at = _lattice(n + 1)
    corner = CORNERS.astype(int)
    weight = np.where(corner[None] == 1, at[:, None], n - at[:, None]).prod(axis=2)  # (points, 8), n^3 in sum
    node = np.where(weight[None] > 0, mesh.cells[cells].astype(np.int64)[:, None, :], NONE)
    order = np.argsort(node, axis=2, kind="stable")  # a point shared by two cells is called the same by both: nodes and weights
    node = np.take_along_axis(node, order, axis=2).reshape(-1, 8)
    share = np.take_along_axis(np.broadcast_to(weight[None], order.shape), order, axis=2).reshape(-1, 8)
    _, first, number = np.unique(np.column_stack([node, share]), axis=0, return_index=True, return_inverse=True)
    rank = np.empty(len(first), int)
    by = np.argsort(first, kind="stable")  # neighbours in space stay neighbours in memory
    rank[by] = np.arange(len(first))
    number = rank[number.ravel()].reshape(len(cells), n + 1, n + 1, n + 1)
    node, share = node[first[by]], share[first[by]] / n**3
    points = np.zeros((len(node), 3))
    for k in range(8):
        points += share[:, k, None] * mesh.points[np.where(node[:, k] == NONE, 0, node[:, k])]
    place = _lattice(n)
    fine = np.stack([number[:, p[:, 2], p[:, 1], p[:, 0]] for p in (place + c for c in corner)], axis=2)
    made = SolidMesh(points, fine.reshape(-1, 8).astype(np.int32))
    return Subdivided(made, np.repeat(cells, n**3), np.tile(place, (len(cells), 1)))


def _lattice(n: int) -> np.ndarray:
    """(n^3, 3) places 0 .. n - 1 along each axis, the first one fastest."""
    z, y, x = np.meshgrid(np.arange(n), np.arange(n), np.arange(n), indexing="ij")
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()])
