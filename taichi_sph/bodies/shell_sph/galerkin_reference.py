"""Reference of the galerkin form: side coefficients, tangents, areas and directors of the cells, and what the fits of the nodes miss of
the surface. The operator itself makes all of them, so a rigid motion strains nothing.

They are made at the start, and again where a rupture has renewed the rows (galerkin.Galerkin.restrain).
"""

import numpy as np

from ...geometry.mesh import SurfaceMesh
from ...numerics.kernel import b3
from ...runtime import ti


def _ends(mesh: SurfaceMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(M, 4) bool where there is a side, (M, 4, 2) its two ends in the plane of the cell, from its centre."""
    last = mesh.corners[:, None] - 1
    k = np.arange(4)[None, :]
    following = np.take_along_axis(mesh.cells, np.where(k == last, 0, np.minimum(k + 1, 3)), axis=1)
    frame = mesh.frames[:, :2]
    first = np.einsum("mki,mai->mka", mesh.points[mesh.cells] - mesh.centres[:, None], frame)
    second = np.einsum("mki,mai->mka", mesh.points[following] - mesh.centres[:, None], frame)
    return k <= last, first, second


def sides(mesh: SurfaceMesh) -> tuple[np.ndarray, np.ndarray]:
    """(M, 4, 2) outward normal times length over area of every side, in the frame of its cell; (M,) areas."""
    there, first, second = _ends(mesh)
    along = second - first
    normal = np.stack([along[..., 1], -along[..., 0]], axis=2) / mesh.areas[:, None, None]
    return np.where(there[:, :, None], normal, 0.0), mesh.areas


def shares(mesh: SurfaceMesh) -> np.ndarray:
    """(M, 4) area of the triangle of each side with the centroid of its cell, over the cell's area."""
    there, first, second = _ends(mesh)
    cross = np.where(there, first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0], 0.0)
    weight = np.where(there, cross, 0.0)[..., None]
    centroid = ((first + second) * weight).sum(axis=1) / (3.0 * cross.sum(axis=1))[:, None]
    a, b = first - centroid[:, None], second - centroid[:, None]
    triangle = np.where(there, a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0], 0.0)
    return triangle / triangle.sum(axis=1)[:, None]


@ti.func
def _cell_reference(term: ti.template(), s):
    """Tangents, area and director of cell s as its rows see them.

    A curved surface is not met exactly by its edge means: the side coefficients are rescaled by the inverse root of
    the metric, so that the tangents are orthonormal.
    """
    cells = term.cells
    origin = cells.centre[s]
    t1, t2 = origin * 0.0, origin * 0.0
    n, n_1, n_2 = origin * 0.0, origin * 0.0, origin * 0.0
    for k in range(cells.n_corners[s]):
        r = cells.edge[s][k]
        X, N = origin * 0.0, origin * 0.0
        for p in range(term.rows.start[r], term.rows.start[r + 1]):
            j = term.rows.source[p]
            c = ti.cast(term.rows.coef[p], ti.f64)
            X += c * (term.nodes.X[j] - origin)
            N += c * term.nodes.N[j]
        g = term.side0[4 * s + k]
        t1 += g[0] * X
        t2 += g[1] * X
        n += term.share[4 * s + k] * N
        n_1 += g[0] * N
        n_2 += g[1] * N
    m11, m12, m22 = t1.dot(t1), t1.dot(t2), t2.dot(t2)
    det = ti.sqrt(ti.max(m11 * m22 - m12 * m12, 1e-30))
    scale = 1.0 / (det * ti.sqrt(m11 + m22 + 2.0 * det))
    r11, r12, r22 = (m22 + det) * scale, -m12 * scale, (m11 + det) * scale  # (metric)^-1/2
    for k in range(cells.n_corners[s]):
        g = term.side0[4 * s + k]
        term.side[4 * s + k] = ti.Vector([r11 * g[0] + r12 * g[1], r12 * g[0] + r22 * g[1]])
    cells.area[s] = term.area0[s] * det
    cells.a1[s] = r11 * t1 + r12 * t2
    cells.a2[s] = r12 * t1 + r22 * t2
    cells.director[s] = n
    cells.director_1[s] = r11 * n_1 + r12 * n_2
    cells.director_2[s] = r12 * n_1 + r22 * n_2


@ti.func
def _node_reference(term: ti.template(), i, r):
    """What the residual of node i (row r) leaves of the surface and of its directors."""
    X, N = term.nodes.X[i] * 0.0, term.nodes.X[i] * 0.0
    for p in range(term.rows.start[r], term.rows.start[r + 1]):
        j = term.rows.source[p]
        c = ti.cast(term.rows.coef[p], ti.f64)
        X += c * (term.nodes.X[j] - term.nodes.X[i])
        N += c * term.nodes.N[j]
    n = term.nodes.N[i]
    term.left[i] = X.dot(n)
    term.left_d[i] = N.dot(n)
    term.across[i] = (N - N.dot(n) * n).norm()


@ti.func
def _turn_of(term: ti.template(), i, r):
    """b_ij of node i: the part t_i that its directors leave across N_i, as a sum of the nodes around."""
    rows = term.rows
    origin, n = term.nodes.X[i], term.nodes.N[i]
    N = origin * 0.0
    total, mean1, mean2 = n[0] * 0.0, n[0] * 0.0, n[0] * 0.0
    for p in range(rows.start[r], rows.start[r + 1]):
        N += ti.cast(rows.coef[p], ti.f64) * term.nodes.N[rows.source[p]]
        x = term.nodes.X[rows.source[p]] - origin
        w = _seen(term, r, p, x)
        total += w
        mean1 += w * rows.t1[r].dot(x)
        mean2 += w * rows.t2[r].dot(x)
    mean1 /= ti.max(total, 1e-30)
    mean2 /= ti.max(total, 1e-30)
    m11, m12, m22 = n[0] * 0.0, n[0] * 0.0, n[0] * 0.0
    for p in range(rows.start[r], rows.start[r + 1]):
        x = term.nodes.X[rows.source[p]] - origin
        w = _seen(term, r, p, x)
        x1, x2 = rows.t1[r].dot(x) - mean1, rows.t2[r].dot(x) - mean2
        m11 += w * x1 * x1
        m12 += w * x1 * x2
        m22 += w * x2 * x2
    det = m11 * m22 - m12 * m12
    b1, b2 = rows.t1[r].dot(N), rows.t2[r].dot(N)
    alpha1, alpha2 = (m22 * b1 - m12 * b2) / det, (m11 * b2 - m12 * b1) / det
    if not (det > 1e-8 * (m11 + m22) ** 2):
        alpha1, alpha2 = 0.0 * b1, 0.0 * b2  # too few nodes in sight: the part is left as it is
    along = n[0] * 0.0
    for p in range(rows.start[r], rows.start[r + 1]):
        x = term.nodes.X[rows.source[p]] - origin
        w = _seen(term, r, p, x)
        b = w * (alpha1 * (rows.t1[r].dot(x) - mean1) + alpha2 * (rows.t2[r].dot(x) - mean2))
        along += b * n.dot(x)
        term.turn[p] = b
        term.t_turn[rows.slot[p]] = b
    term.left_d[i] = N.dot(n) - along


@ti.func
def _seen(term: ti.template(), r, p, x):
    """Kernel weight of pair p of row r, 0 where the link is cut."""
    w = b3(x.norm() / term.rows.h[r])
    if term.rows.cut[p] != 0:
        w *= 0.0
    return w


@ti.kernel
def references(term: ti.template(), n_edges: ti.i32, n_cells: ti.i32, n_nodes: ti.i32):
    for s in range(n_cells):
        _cell_reference(term, s)
    for i in range(n_nodes):
        _node_reference(term, i, n_edges + i)


@ti.kernel
def turns(term: ti.template(), n_edges: ti.i32, n_nodes: ti.i32):
    for i in range(n_nodes):
        _turn_of(term, i, n_edges + i)


@ti.kernel
def references_touched(term: ti.template(), n_touched: ti.i32, n_edges: ti.i32):
    for m in range(n_touched):
        r = term.rows.touched[m]
        if r >= n_edges:
            _node_reference(term, r - n_edges, r)
        else:
            for k in range(2):
                side = term.cells.sides[r][k]
                if side >= 0 and term.cells.broken[side // 4] == 0:
                    _cell_reference(term, side // 4)


@ti.kernel
def turns_touched(term: ti.template(), n_touched: ti.i32, n_edges: ti.i32):
    for m in range(n_touched):
        r = term.rows.touched[m]
        if r >= n_edges:
            _turn_of(term, r - n_edges, r)
