"""Finite elements on the nodes of a mesh, to compare with: what the method has to be as good as.

Plane stress: constant-strain triangles, bilinear quadrangles. Shells: degenerated MITC3 and MITC4 (Dvorkin and Bathe
1984, Lee and Bathe 2004), written like bodies/shell/stress.py with positions x and directors n, linear about the reference:

    e_ab = sym(X_,a . u_,b)    kappa_ab = sym(X_,a . d_,b + N_,a . u_,b)    gamma_a = X_,a . d + N . u_,a (tied)

Both as sparse matrices of full integration; no element is used in the time loop.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ..geometry.mesh import SurfaceMesh

G = 1 / np.sqrt(3)
QUAD_POINTS = [(-G, -G, 1.0), (G, -G, 1.0), (G, G, 1.0), (-G, G, 1.0)]  # r, s, weight
TRIANGLE_POINTS = [(0.5, 0.0, 1 / 6), (0.5, 0.5, 1 / 6), (0.0, 0.5, 1 / 6)]


def plane_stress(young: float, poisson: float) -> np.ndarray:
    """(3, 3) [Pa], for E_11, E_22, 2 E_12."""
    return young / (1 - poisson**2) * np.array([[1, poisson, 0], [poisson, 1, 0], [0, 0, (1 - poisson) / 2]])


def shape(corners: int, r: float, s: float) -> tuple[np.ndarray, np.ndarray]:
    """(corners,) values and (corners, 2) slopes to r, s of the shape functions: of the triangle 0 <= r, s, r + s <= 1, or
    of the square -1 <= r, s <= 1."""
    if corners == 3:
        return np.array([1 - r - s, r, s]), np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    sign = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    along, up = 1 + sign[:, 0] * r, 1 + sign[:, 1] * s
    return 0.25 * along * up, 0.25 * np.column_stack([sign[:, 0] * up, sign[:, 1] * along])


def element_stiffness(mesh: SurfaceMesh, young: float, poisson: float, thickness: float) -> Any:
    """Sparse (2N, 2N) stiffness in the plane [N/m]."""
    C = thickness * plane_stress(young, poisson)

    def of_cell(nodes: np.ndarray) -> np.ndarray:
        x = mesh.points[nodes, :2]
        k = np.zeros((2 * len(nodes), 2 * len(nodes)))
        for r, s, weight in _points(len(nodes)):
            slopes = shape(len(nodes), r, s)[1]
            J = slopes.T @ x
            slopes = slopes @ np.linalg.inv(J).T
            B = np.zeros((3, 2 * len(nodes)))
            B[0, 0::2] = B[2, 1::2] = slopes[:, 0]
            B[1, 1::2] = B[2, 0::2] = slopes[:, 1]
            k += weight * abs(np.linalg.det(J)) * B.T @ C @ B
        return k

    return _assembled(mesh, 2, of_cell)


def shell_stiffness(mesh: SurfaceMesh, young: float, poisson: float, thickness: float) -> Any:
    """Sparse (6N, 6N) stiffness of a shell on the unknowns u, d of each node [N/m, N, N m]. What of d points along the
    director has none: leave it out."""
    C = thickness * plane_stress(young, poisson)
    shear = 5 / 6 * young * thickness / (2 * (1 + poisson))

    def of_cell(nodes: np.ndarray) -> np.ndarray:
        X, N = mesh.points[nodes], mesh.node_normals[nodes]
        k = np.zeros((6 * len(nodes), 6 * len(nodes)))
        for r, s, weight in _points(len(nodes)):
            slopes = shape(len(nodes), r, s)[1]
            a, n = slopes.T @ X, slopes.T @ N  # (2, 3): slopes of position and director
            normal = np.cross(*a)
            area = np.linalg.norm(normal)
            e1 = a[0] / np.linalg.norm(a[0])
            frame = np.array([e1, np.cross(normal / area, e1)])
            to = np.linalg.inv(a @ frame.T)  # (orthonormal, r s)
            membrane, bending = np.zeros((2, 2, len(nodes), 6)), np.zeros((2, 2, len(nodes), 6))
            for p in range(2):
                for q in range(2):
                    for i, j in ((p, q), (q, p)):
                        membrane[p, q, :, :3] += 0.5 * slopes[:, j, None] * a[i]
                        bending[p, q, :, 3:] += 0.5 * slopes[:, j, None] * a[i]
                        bending[p, q, :, :3] += 0.5 * slopes[:, j, None] * n[i]
            tied = np.einsum("ip,p...->i...", to, _tied(X, N, r, s)).reshape(2, -1)
            k += weight * area * shear * tied.T @ tied
            for strain, stiffness in ((membrane, C), (bending, thickness**2 / 12 * C)):
                local = np.einsum("ip,jq,pq...->ij...", to, to, strain).reshape(2, 2, -1)
                B = np.array([local[0, 0], local[1, 1], 2 * local[0, 1]])
                k += weight * area * B.T @ stiffness @ B
        return k

    return _assembled(mesh, 6, of_cell)


def _tied(X: np.ndarray, N: np.ndarray, r: float, s: float) -> np.ndarray:
    """(2, corners, 6) transverse shears gamma_r, gamma_s at (r, s), from those in the middles of the sides."""

    def at(r: float, s: float, along: int) -> np.ndarray:
        values, slopes = shape(len(X), r, s)
        return np.hstack([slopes[:, along, None] * (values @ N), values[:, None] * (slopes[:, along] @ X)])

    if len(X) == 4:
        low, high = at(0, -1, 0), at(0, 1, 0)
        left, right = at(-1, 0, 1), at(1, 0, 1)
        return np.array([0.5 * (1 - s) * low + 0.5 * (1 + s) * high, 0.5 * (1 - r) * left + 0.5 * (1 + r) * right])
    along, up = at(0.5, 0, 0), at(0, 0.5, 1)
    turn = up - along - at(0.5, 0.5, 1) + at(0.5, 0.5, 0)
    return np.array([along + turn * s, up - turn * r])


def _points(corners: int) -> list[tuple[float, float, float]]:
    return QUAD_POINTS if corners == 4 else TRIANGLE_POINTS


def _assembled(mesh: SurfaceMesh, unknowns: int, of_cell: Callable[[np.ndarray], np.ndarray]) -> Any:
    from scipy.sparse import coo_array

    rows, columns, values = [], [], []
    for nodes in _cells(mesh):
        k = of_cell(nodes)
        at = (unknowns * nodes[:, None] + np.arange(unknowns)).ravel()
        rows.append(np.repeat(at, len(at)))
        columns.append(np.tile(at, len(at)))
        values.append(k.ravel())
    size = unknowns * len(mesh.points)
    return coo_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(size, size)).tocsc()


def _cells(mesh: SurfaceMesh) -> Iterator[np.ndarray]:
    for cell, corners in zip(mesh.cells, mesh.corners):
        yield cell[:corners]
