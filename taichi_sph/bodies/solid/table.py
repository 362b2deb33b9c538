"""Mean gradients over cells as a table of coefficients: what makes a solid one of finite elements or of particles. NumPy only.

    B_i = (1/V) sum over faces of the integral of n Phi_i dS

Finite elements take the functions of a cell's own corners. Particles take moving least squares of order 1 on the faces, two by two Gauss
points each (three on a triangle), which both cells of a face share. With either, the sums over cells of V B_i telescope to the surface,
sum_i B_i = 0 and sum_i X_i B_i = 1 to rounding: rigid turns strain nothing, and the patch test holds on any mesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import SceneError
from ...geometry.solids import SolidMesh

WORST, WIDER = 1e5, 8  # condition of the moments that is allowed; how often the reach of a place is raised to get there
GAUSS = (0.5 - 0.5 / np.sqrt(3.0), 0.5 + 0.5 / np.sqrt(3.0))


@dataclass(frozen=True)
class Table:
    """first (M + 1,): where the entries of a cell begin, its corners before all others; node (K,) and B (K, 3) [1/m] of an entry."""

    first: np.ndarray
    node: np.ndarray
    B: np.ndarray


def table_of(mesh: SolidMesh, form: Any) -> Table:
    """The coefficients of a mesh in that form."""
    return trilinear(mesh) if form.kind == "trilinear" else particles(mesh, form.support)


def trilinear(mesh: SolidMesh) -> Table:
    """The corners' own functions: exact means."""
    real = mesh.cells >= 0
    B = mesh.gradients / mesh.volumes[:, None, None]
    return Table(np.r_[0, np.cumsum(mesh.corners)].astype(np.int32), mesh.cells[real].astype(np.int32), B[real])


def particles(mesh: SolidMesh, support: float) -> Table:
    """Moving least squares of order 1 on the faces; the kernel reaches 2 support spacings."""
    from scipy.sparse import csr_matrix

    places, area, face, _ = _gauss(mesh)
    phi = _least_squares(mesh, places, support * _local(mesh, face))
    m, g = len(mesh.cells), len(places)
    at = np.concatenate([np.arange(g), np.arange(g)])
    cell = mesh.faces.cells[face]
    sign = np.r_[np.ones(g), -np.ones(g)]
    cell = np.r_[cell[:, 0], cell[:, 1]]
    there = cell >= 0
    parts = []
    for axis in range(3):
        weights = np.r_[area[:, axis], area[:, axis]] * sign
        parts.append((csr_matrix((weights[there], (cell[there], at[there])), shape=(m, g)) @ phi).tocsr())
    pattern = sum(abs(part) for part in parts).tocsr()
    rows = np.repeat(np.arange(m), np.diff(pattern.indptr))
    B = np.stack([np.asarray(part[rows, pattern.indices]).ravel() for part in parts], axis=1) / mesh.volumes[rows, None]
    # corners first, in their order, then the others by number
    place = np.full(len(rows), 8)
    for k in range(8):
        place[mesh.cells[rows, k] == pattern.indices] = k
    order = np.lexsort((pattern.indices, place, rows))
    if (np.bincount(rows[place < 8], minlength=m) < mesh.corners).any():
        raise SceneError("formulation.support is too small for this mesh: a cell does not see its own corners; raise it")
    return Table(pattern.indptr.astype(np.int32), pattern.indices[order].astype(np.int32), B[order])


def _local(mesh: SolidMesh, face: np.ndarray) -> np.ndarray:
    """(G,) local spacing [m] at points on faces: that of the larger of its cells."""
    size = np.cbrt(mesh.volumes * np.where(mesh.corners == 8, 1.0, 6.0))
    cells = mesh.faces.cells[face]
    return np.maximum(size[cells[:, 0]], np.where(cells[:, 1] < 0, 0.0, size[cells[:, 1]]))


@dataclass(frozen=True)
class OnFaces:
    """The quadrature of some faces, four points each. area (G, 3): out of the first cell [m2]; face (G,): its place among them; shares
    (G, 4): of its corners in the place of a point; functions (G, N): of the nodes there, sparse."""

    area: np.ndarray
    face: np.ndarray
    shares: np.ndarray
    functions: Any


def on_faces(mesh: SolidMesh, form: Any, faces: np.ndarray) -> OnFaces:
    """Of the quadrangles `faces` (F,) of a mesh of particles."""
    places, area, face, shares = _gauss(mesh, faces)
    place = np.full(len(mesh.faces.nodes), -1)
    place[faces] = np.arange(len(faces))
    return OnFaces(area, place[face], shares, _least_squares(mesh, places, form.support * _local(mesh, face)))


def _gauss(mesh: SolidMesh, some: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(G, 3) places, (G, 3) area vectors out of the first cell, (G,) faces of the quadrature of some faces, by itself of all, and (G, 4)
    the shares of their corners."""
    nodes = mesh.faces.nodes
    of_all = np.ones(len(nodes), bool) if some is None else np.isin(np.arange(len(nodes)), some)
    quad, triangle = of_all & (nodes[:, 3] >= 0), of_all & (nodes[:, 3] < 0)
    x = mesh.points
    places, areas, faces, shares = [], [], [], []
    p = x[nodes[quad]]
    for a in GAUSS:
        for b in GAUSS:
            shape = np.array([(1 - a) * (1 - b), a * (1 - b), a * b, (1 - a) * b])
            along = (1 - b) * (p[:, 1] - p[:, 0]) + b * (p[:, 2] - p[:, 3])
            across = (1 - a) * (p[:, 3] - p[:, 0]) + a * (p[:, 2] - p[:, 1])
            places.append(np.einsum("k,fki->fi", shape, p))
            areas.append(0.25 * np.cross(along, across))
            faces.append(np.flatnonzero(quad))
            shares.append(np.tile(shape, (len(p), 1)))
    t = x[nodes[triangle][:, :3]]
    for k in range(3):
        shape = np.full(3, 1 / 6)
        shape[k] = 2 / 3
        places.append(np.einsum("k,fki->fi", shape, t))
        areas.append(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]) / 6.0)
        faces.append(np.flatnonzero(triangle))
        shares.append(np.tile(np.r_[shape, 0.0], (len(t), 1)))
    return np.concatenate(places), np.concatenate(areas), np.concatenate(faces), np.concatenate(shares)


def _least_squares(mesh: SolidMesh, places: np.ndarray, h: np.ndarray) -> Any:
    """(G, N) sparse: functions of the nodes at the places, kernel B3 of smoothing lengths h (G,) [m]."""
    from scipy.sparse import csr_matrix
    from scipy.spatial import cKDTree

    tree, h = cKDTree(mesh.points), h.copy()
    for _ in range(WIDER):
        near = tree.query_ball_point(places, 2.0 * h, return_sorted=True)
        count = np.array([len(one) for one in near])
        row, node = np.repeat(np.arange(len(places)), count), np.concatenate(near).astype(int)
        arm = (mesh.points[node] - places[row]) / h[row, None]
        q = np.linalg.norm(arm, axis=1)
        weight = np.where(q < 1.0, 1.0 - 1.5 * q**2 + 0.75 * q**3, 0.25 * np.maximum(2.0 - q, 0.0) ** 3)
        basis = np.column_stack([np.ones(len(row)), arm])
        moment = np.zeros((len(places), 4, 4))
        start = np.r_[0, np.cumsum(count)[:-1]]
        there = count > 0
        moment[there] = np.add.reduceat(weight[:, None, None] * basis[:, :, None] * basis[:, None, :], start[there], axis=0)
        with np.errstate(all="ignore"):
            bad = ~(np.linalg.cond(moment) < WORST)
        if not bad.any():
            break
        h[bad] *= 1.2  # beside cells that are longer than wide
    else:
        raise SceneError("formulation: a place on a face of this mesh sees nodes of one plane alone; use 'trilinear', or raise support")
    first = np.linalg.solve(moment, np.tile([[1.0], [0.0], [0.0], [0.0]], (len(places), 1, 1)))[:, :, 0]
    phi = weight * np.einsum("kc,kc->k", basis, first[row])
    return csr_matrix((phi, (row, node)), shape=(len(places), len(mesh.points)))
