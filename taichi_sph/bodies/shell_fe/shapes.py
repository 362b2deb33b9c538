"""Shape functions of the elements on a mesh: slopes, tied shears and what one point leaves out, for all cells at once. NumPy only.

A cell has the corners 0 to 3 of the square -1 <= r, s <= 1, or 0 to 2 of the triangle 0 <= r, s, r + s <= 1. Side k leads from corner k to
the next one. In a triangle the first corner stands in place of the fourth as well, and all coefficients of the fourth are zero. So the same
loops serve both shapes.

The transverse shear along a side, from its ends' positions x and directors n, is

    sigma_k = (x_j - x_k) . (n_j + n_k) / 2,    less the same of the reference,

and the shear at a point is a sum of those of the sides: MITC4 (Dvorkin and Bathe 1984), MITC3 (Lee and Bathe 2004).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.mesh import SurfaceMesh

G = 1.0 / np.sqrt(3.0)
QUAD_POINTS = {1: np.array([[0.0, 0.0, 4.0]]), 4: np.array([[-G, -G, 1.0], [G, -G, 1.0], [G, G, 1.0], [-G, G, 1.0]])}  # r, s, weight
TRIANGLE_POINT = np.array([[1.0 / 3.0, 1.0 / 3.0, 0.5]])
CORNER = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
HOURGLASS = np.array([1.0, -1.0, 1.0, -1.0])


@dataclass
class Reference:
    """Of the M cells of a mesh with P points each; rows that stand for nothing are zero.

    slopes (M P, 2, 4) [1/m]: dN_k/dX_a at a point, a along its frame; ties (M P, 2, 4) [1/m]: from the shears of the sides to gamma_a
    there; areas (M P,) [m2].

    What the points of a cell leave out, as quadratic forms with the moduli E e, E e^3/12 and G_s over `held` (M,) [m2], which is the area
    where there is any: hourglass (M, 4), gamma_k, and along (M, 2, 2), rho_ia, of the changes of membrane strain and curvature over a
    quadrangle; twists (M, 2, 4): rows of the changes of shear, over the sides.
    """

    slopes: np.ndarray
    ties: np.ndarray
    areas: np.ndarray
    held: np.ndarray
    hourglass: np.ndarray
    along: np.ndarray
    twists: np.ndarray


def reference(mesh: SurfaceMesh, points: int) -> Reference:
    """Of all cells; `points` of a quadrangle: 1 or 4. A triangle has one, the first of its rows."""
    m = len(mesh.cells)
    found = Reference(
        np.zeros((m, points, 2, 4)),
        np.zeros((m, points, 2, 4)),
        np.zeros((m, points)),
        np.zeros(m),
        np.zeros((m, 4)),
        np.zeros((m, 2, 2)),
        np.zeros((m, 2, 4)),
    )
    quad = mesh.cells[:, 3] >= 0
    for k, point in enumerate(QUAD_POINTS[points]):
        _quadrangles(found, mesh, np.flatnonzero(quad), k, point)
    if points == 1:
        _held_quadrangles(found, mesh, np.flatnonzero(quad))
    _triangles(found, mesh, np.flatnonzero(~quad))
    found.slopes, found.ties = found.slopes.reshape(-1, 2, 4), found.ties.reshape(-1, 2, 4)
    found.areas = found.areas.reshape(-1)
    return found


def _local(along: np.ndarray, axis: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(K, 2, 3) X_,r and X_,s, (K, 3) direction near the first axis -> (K, 2, 3) axes, (K, 2, 2) J_pa = X_,p . axis_a, (K,) area."""
    normal = np.cross(along[:, 0], along[:, 1])
    area = np.linalg.norm(normal, axis=1)
    normal = normal / area[:, None]
    first = axis - np.einsum("ki,ki->k", axis, normal)[:, None] * normal
    first = first / np.linalg.norm(first, axis=1)[:, None]
    axes = np.stack([first, np.cross(normal, first)], axis=1)
    return axes, np.einsum("kpi,kai->kpa", along, axes), area


def quad_slopes(r: float, s: float) -> np.ndarray:
    """(2, 4) dN_k/dr, dN_k/ds of a quadrangle."""
    return 0.25 * np.stack([CORNER[:, 0] * (1.0 + CORNER[:, 1] * s), CORNER[:, 1] * (1.0 + CORNER[:, 0] * r)])


def quad_ties(r: float, s: float) -> np.ndarray:
    """(2, 4) gamma_r, gamma_s of MITC4 at (r, s) over the shears of the sides."""
    return 0.25 * np.array([[1.0 - s, 0.0, -1.0 - s, 0.0], [0.0, 1.0 + r, 0.0, r - 1.0]])


def _quadrangles(found: Reference, mesh: SurfaceMesh, cells: np.ndarray, k: int, point: np.ndarray) -> None:
    """Point k of the quadrangles."""
    r, s, weight = point
    slopes = quad_slopes(r, s)
    along = np.einsum("pk,mki->mpi", slopes, mesh.points[mesh.cells[cells]])
    _, J, area = _local(along, mesh.frames[cells, 0])
    to = np.linalg.inv(J)  # to_ap: from slopes to r and s to those along the axes
    found.slopes[cells, k] = np.einsum("map,pk->mak", to, slopes)
    found.ties[cells, k] = np.einsum("map,pk->mak", to, quad_ties(r, s))
    found.areas[cells, k] = weight * area


def _held_quadrangles(found: Reference, mesh: SurfaceMesh, cells: np.ndarray) -> None:
    """What one point leaves of a quadrangle. Over its middle x_,r = x_r + s x_h and x_,s = x_s + r x_h, x_h = 1/4 sum +-x_k.

    E_rr changes with s by m_1 = x_r . x_h and E_ss with r by m_2 = x_s . x_h, kappa alike; the shears gamma_r, gamma_s by those of opposite
    sides. The change of E_rs is left out: in bending within the plane the shear is not (assumed strain). x_h is freed of what a linear
    field has of it (Flanagan and Belytschko 1981), so that constant strains leave nothing.
    """
    X = mesh.points[mesh.cells[cells]]
    axes, J, _ = _local(np.einsum("pk,mki->mpi", quad_slopes(0.0, 0.0), X), mesh.frames[cells, 0])
    to = np.linalg.inv(J)
    slopes, ties = found.slopes[cells, 0], found.ties[cells, 0]
    places = np.einsum("mki,mai->mka", X, axes)
    skew = 0.25 * np.einsum("k,mka->ma", HOURGLASS, places)  # X_h along the axes
    found.held[cells] = found.areas[cells, 0]
    found.hourglass[cells] = 0.25 * HOURGLASS - np.einsum("ma,mak->mk", skew, slopes)
    square = np.einsum("map,map->mp", to, to)  # |g^r|^2, |g^s|^2
    found.along[cells] = square[:, :, None] * J / np.sqrt(3.0)
    rows = 0.25 * np.array([[-1.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 1.0]])
    twists = rows[None] - np.einsum("ma,mak->mk", skew, ties)[:, None, :]
    found.twists[cells] = np.sqrt(square / 3.0)[:, :, None] * twists


def _triangles(found: Reference, mesh: SurfaceMesh, cells: np.ndarray) -> None:
    """The point of the triangles. Only the shear changes over them: gamma_r = sigma_0 + c s, gamma_s = -sigma_2 - c r,
    c = -(sigma_0 + sigma_1 + sigma_2)."""
    r, s, weight = TRIANGLE_POINT[0]
    slopes = np.array([[-1.0, 1.0, 0.0, 0.0], [-1.0, 0.0, 1.0, 0.0]])
    corner = np.where(mesh.cells[cells] < 0, mesh.cells[cells, :1], mesh.cells[cells])
    _, J, area = _local(np.einsum("pk,mki->mpi", slopes, mesh.points[corner]), mesh.frames[cells, 0])
    to = np.linalg.inv(J)
    c = np.array([-1.0, -1.0, -1.0, 0.0])
    ties = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0]]) + np.outer([s, -r], c)
    found.slopes[cells, 0] = np.einsum("map,pk->mak", to, slopes)
    found.ties[cells, 0] = np.einsum("map,pk->mak", to, ties)
    found.areas[cells, 0] = weight * area
    found.held[cells] = weight * area
    # mean of |(s - 1/3) g^r - (r - 1/3) g^s|^2 over the triangle
    square = (np.einsum("map,map->m", to, to) + np.einsum("ma,ma->m", to[:, :, 0], to[:, :, 1])) / 18.0
    found.twists[cells, 0] = np.sqrt(square)[:, None] * c
