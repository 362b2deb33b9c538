"""Nodal normals of a mesh that comes without them: the slope of a quadratic fitted round each node. NumPy only."""

from __future__ import annotations

import numpy as np

from .mesh import SurfaceMesh, tangent_frames

SHARP = np.radians(40.0)  # cells that lean more than this against a node's normal are beyond an edge of the body


def fitted_normals(mesh: SurfaceMesh) -> np.ndarray:
    """(N, 3) unit normals from heights over the tangent plane, fitted by least squares with a x + b y + c x2 + d xy
    + e y2 over two rings of neighbours, twice: the second time over the plane that the first one found.

    On a sphere or a cylinder the error is O(D^3), and O(D) on a border; that of an area-weighted mean is O(D^2). Cells beyond a sharp edge
    are left out of the fit. A node on such an edge gets the mean of the normals around it, weighted by the angle that each cell takes up
    at the node: the normal lies halfway between wall and end disc, whatever their cells. A node with too few neighbours for the fit gets
    the same mean.
    """
    from scipy.sparse import csr_array

    guess = _angle_weighted(mesh)
    n, m = len(mesh.points), len(mesh.cells)
    cell = np.repeat(np.arange(m), 4)[mesh.cells.ravel() >= 0]
    node = mesh.cells.ravel()[mesh.cells.ravel() >= 0]
    has = csr_array((np.ones(len(node)), (node, cell)), shape=(n, m))
    cell_normal = mesh.frames[:, 2]
    upright = np.einsum("ki,ki->k", guess[node], cell_normal[cell]) > np.cos(SHARP)
    on_edge = np.zeros(n, bool)
    on_edge[node[~upright]] = True
    near = (has @ (has.T @ has)).tocoo()  # (node, cell): every cell of the two rings
    keep = np.einsum("ki,ki->k", guess[near.row], cell_normal[near.col]) > np.cos(SHARP)
    rings = csr_array((np.ones(keep.sum()), (near.row[keep], near.col[keep])), shape=(n, m)) @ has.T
    pair = rings.tocoo()
    other = pair.row != pair.col
    i, j = pair.row[other], pair.col[other]
    arm = (mesh.points[j] - mesh.points[i]) / mesh.node_spacing[i, None]
    far = np.einsum("ki,ki->k", arm, arm) > 1e-6  # off the other lip of a slit of zero width
    i, j, arm = i[far], j[far], arm[far]
    weight = 1.0 / np.einsum("ki,ki->k", arm, arm)
    count = np.bincount(i, minlength=n)

    normal = guess
    for _ in range(2):
        frame = tangent_frames(normal)
        x, y, z = np.einsum("kai,ki->ak", frame[i], arm)
        basis = np.stack([x, y, x * x, x * y, y * y])
        system, right = np.empty((n, 5, 5)), np.empty((n, 5))
        for a in range(5):
            right[:, a] = np.bincount(i, weight * basis[a] * z, minlength=n)
            for b in range(a, 5):
                system[:, a, b] = system[:, b, a] = np.bincount(i, weight * basis[a] * basis[b], minlength=n)
        fits = ~on_edge & (count >= 5)
        values = np.linalg.eigvalsh(system)
        fits &= values[:, 0] > 1e-6 * values[:, 4]  # nodes in a row, say, fix no slope across it
        slope = np.zeros((n, 5))
        slope[fits] = np.linalg.solve(system[fits], right[fits][:, :, None])[:, :, 0]
        leaning = frame[:, 2] - slope[:, :1] * frame[:, 0] - slope[:, 1:2] * frame[:, 1]
        normal = np.where(fits[:, None], leaning / np.linalg.norm(leaning, axis=1)[:, None], guess)
    return normal


def _angle_weighted(mesh: SurfaceMesh) -> np.ndarray:
    """(N, 3) unit mean of the normals of the cells around a node, weighted by their angles there."""
    total = np.zeros_like(mesh.points)
    for k in range(4):
        has = k < mesh.corners
        cell, last = mesh.cells[has], mesh.corners[has] - 1
        at = mesh.points[cell[:, k]]
        after = mesh.points[np.where(k == last, cell[:, 0], cell[:, min(k + 1, 3)])] - at
        before = mesh.points[cell[np.arange(len(cell)), last] if k == 0 else cell[:, k - 1]] - at
        cross, dot = np.linalg.norm(np.cross(after, before), axis=1), np.einsum("mi,mi->m", after, before)
        np.add.at(total, cell[:, k], np.arctan2(cross, dot)[:, None] * mesh.frames[has, 2])
    return total / np.linalg.norm(total, axis=1)[:, None]


def report(mesh: SurfaceMesh) -> str:
    """Whether the surface is watertight, what follows ('closed, volume 3 m^3', '12 open edges in 1 loop'), and what the
    reader of a file has to say."""
    said = [_closed(mesh), *mesh.notes]
    if mesh.regions:
        some = [f"{name} ({mask.sum()} cells)" for name, mask in list(mesh.regions.items())[:6]]
        said.append(f"regions {', '.join(some)}" + (f" and {len(mesh.regions) - 6} more" if len(mesh.regions) > 6 else ""))
    if mesh.thickness:
        some = [f"{name} {1e3 * value:.4g} mm" for name, value in list(mesh.thickness.items())[:6]]
        said.append(
            f"thicknesses of the file (surface.thicknesses takes them): {', '.join(some)}{', ...' if len(mesh.thickness) > 6 else ''}"
        )
    return "; ".join(said)


def _closed(mesh: SurfaceMesh) -> str:
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    def parts(a: np.ndarray, b: np.ndarray) -> int:
        label = connected_components(coo_array((np.ones(len(a)), (a, b)), shape=(len(mesh.points),) * 2), directed=False)[1]
        return len(np.unique(label[a]))

    nodes, open_ = mesh.edges.nodes, mesh.edges.sides[:, 1] < 0
    pieces = parts(nodes[:, 0], nodes[:, 1])
    among = f" in {pieces} pieces" if pieces > 1 else ""
    if open_.any():
        loops = parts(nodes[open_, 0], nodes[open_, 1])
        return f"open{among}: {open_.sum()} edges bound one cell, in {loops} loop{'s' if loops > 1 else ''}"
    inward = ", normals point inward" if mesh.volume < 0 else ""
    return f"closed (watertight){among}, volume {abs(mesh.volume):.6g} m^3{inward}"
