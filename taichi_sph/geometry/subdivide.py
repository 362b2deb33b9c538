"""Quadrangles of a mesh divided n x n. NumPy only.

Corners stay where they are. A point inside a quadrangle lies on the surface that its four sides span (Coons). A side is straight, or
the parabola that leaves both ends across their normals (Nagata 2005, of its bulge the part that is even): on a cylinder or a sphere that is
the arc, to the fourth order of its angle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .mesh import SurfaceMesh


@dataclass(frozen=True)
class Subdivided:
    """mesh; of its cells parent (M,), the number of the quadrangle in the old mesh, and place (M, 2), column and row in it; tied (N,) bool:
    nodes on the sides and inside of quadrangles whose sides are straight; length (N,): there of the normal that the shape functions of the
    old mesh give, elsewhere 1."""

    mesh: SurfaceMesh
    parent: np.ndarray
    place: np.ndarray
    tied: np.ndarray
    length: np.ndarray


def subdivided(mesh: SurfaceMesh, cells: np.ndarray, n: int, straight: np.ndarray) -> Subdivided:
    """The quadrangles `cells` (K,) of a mesh, each as n x n; straight (K,) bool: those whose sides are straight."""
    quads = mesh.cells[cells]
    count, edges = len(cells), mesh.edges.cell_edges[cells]
    flat = np.zeros(len(mesh.edges.nodes), bool)
    flat[edges[straight]] = True
    bulge = np.where(flat[:, None], 0.0, bulges(mesh))
    u = np.arange(n + 1) / n
    X = mesh.points[quads]
    N = mesh.node_normals[quads]
    at, normal, key = (np.zeros((count, n + 1, n + 1, c)) for c in (3, 3, 3))
    forward = mesh.edges.nodes[edges, 0] == quads  # side k of a cell runs as its edge does
    for i in range(n + 1):
        for j in range(n + 1):
            r, s = u[i], u[j]
            shape = np.array([(1 - r) * (1 - s), r * (1 - s), r * s, (1 - r) * s])
            at[:, i, j] = np.einsum("c,kci->ki", shape, X)
            for k, (t, share) in enumerate(((r, 1 - s), (s, r), (1 - r, s), (1 - s, 1 - r))):
                at[:, i, j] += share * t * (1 - t) * bulge[edges[:, k]]
            normal[:, i, j] = np.einsum("c,kci->ki", shape, N)
            key[:, i, j] = _key(quads, edges, forward, i, j, n)
    key[..., 2] += np.where(key[..., 0] == 2, (np.arange(count) * (n + 1) ** 2)[:, None, None], 0)
    _, first, number = np.unique(key.reshape(-1, 3), axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")  # neighbours in space stay neighbours in memory
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    number = rank[number.ravel()].reshape(count, n + 1, n + 1)
    points, normals = np.empty((len(order), 3)), np.empty((len(order), 3))
    points[number.ravel()], normals[number.ravel()] = at.reshape(-1, 3), normal.reshape(-1, 3)
    tied = np.zeros(len(order), bool)
    tied[number[straight].ravel()] = True
    row, column = (a.ravel() for a in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    around = ((column, row), (column + 1, row), (column + 1, row + 1), (column, row + 1))
    corner = np.stack([number[:, c, r] for c, r in around], axis=2)
    length = np.linalg.norm(normals, axis=1)
    normals /= length[:, None]
    fine = SurfaceMesh(points, corner.reshape(-1, 4).astype(np.int32), mesh.spacing / n, normals)
    return Subdivided(fine, np.repeat(cells, n * n), np.tile(np.column_stack([column, row]), (count, 1)), tied, np.where(tied, length, 1.0))


def bulges(mesh: SurfaceMesh) -> np.ndarray:
    """(R, 3) b of every edge of a mesh: its point at 0 <= t <= 1 is that of the chord and t (1 - t) b."""
    a, b = mesh.edges.nodes.T
    chord = mesh.points[b] - mesh.points[a]
    n, m = mesh.node_normals[a], mesh.node_normals[b]
    rise = np.einsum("ri,ri->r", n, chord) - np.einsum("ri,ri->r", m, chord)
    return -(0.5 * rise / (1.0 + np.einsum("ri,ri->r", n, m)))[:, None] * (n + m)


def _key(quads: np.ndarray, edges: np.ndarray, forward: np.ndarray, i: int, j: int, n: int) -> np.ndarray:
    """(K, 3) what a point of the lattice in a quadrangle is called by all quadrangles that have it: (0, node, 0), (1, edge, how far
    along it) or (2, 0, place)."""
    corners = {(0, 0): 0, (n, 0): 1, (n, n): 2, (0, n): 3}
    if (i, j) in corners:
        node = quads[:, corners[i, j]]
        return np.column_stack([np.zeros_like(node), node, np.zeros_like(node)])
    side = 0 if j == 0 else 1 if i == n else 2 if j == n else 3 if i == 0 else -1
    if side < 0:
        return np.tile([2, 0, i * (n + 1) + j], (len(quads), 1))
    along = (i, j, n - i, n - j)[side]
    return np.column_stack([np.ones(len(quads)), edges[:, side], np.where(forward[:, side], along, n - along)])
