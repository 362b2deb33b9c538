"""Slits of zero width: nodes in one place, each with its own cells. What lies across a slit is hidden from the start. NumPy only.

A lip is an edge of one cell whose two ends coincide with those of another such edge. Lines of sight start a little inside the cells of a
node, and not at the node itself: two nodes in one place then look from the two sides of the slit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ... import runtime
from ...geometry.mesh import SurfaceMesh
from .links import Links

SAME = 1e-3  # of the spacing: nodes nearer than this stand in one place
INSIDE = 0.02  # of the way to the middle of its cells: where a place is looked from
TOUCH = 1e-6  # of the length of a lip


@dataclass(frozen=True)
class Slits:
    """Lips: start, end (K, 3), across (K, 3) unit, in the surface. Looked from: nodes (N, 3), edges (R, 3) moves, centres (M, 3)."""

    start: np.ndarray
    end: np.ndarray
    across: np.ndarray
    nodes: np.ndarray
    edge_moves: np.ndarray
    centres: np.ndarray

    def hide(self, links: Links, rows: np.ndarray, sources: np.ndarray) -> None:
        """Cuts the pairs of `links` that see each other through a lip. rows (R, 2, 3), sources (S, 3): as looked from."""
        from scipy.spatial import cKDTree

        first, source = runtime.get(links.start, links.n + 1), runtime.get(links.source, links.pairs)
        cut = runtime.get(links.cut, links.pairs)
        reach = 2.0 * float(runtime.get(links.h, links.n).max())
        length = np.linalg.norm(self.end - self.start, axis=1)
        near = cKDTree(rows.mean(axis=1)).query_ball_point(0.5 * (self.start + self.end), reach + length)
        for k, some in enumerate(near):
            row = np.array(some, np.int64)
            count = first[row + 1] - first[row]
            pair = np.repeat(first[row] - np.cumsum(count) + count, count) + np.arange(count.sum())
            row = np.repeat(row, count)
            along = (self.end[k] - self.start[k]) / length[k]
            to = sources[source[pair]] - self.start[k]
            for g in (0, 1):
                at = rows[row, g] - self.start[k]
                a, b = at @ self.across[k], to @ self.across[k]
                apart = np.where((np.abs(a) > TOUCH * length[k]) & (np.abs(b) > TOUCH * length[k]) & (a * b < 0), a - b, 1.0)
                where = at @ along + (to - at) @ along * a / apart
                through = (apart != 1.0) & (where > -TOUCH * length[k]) & (where < (1 + TOUCH) * length[k])
                cut[pair[through]] |= np.int8(1 << g)
        runtime.put(links.cut, cut)


def slits(mesh: SurfaceMesh, body: np.ndarray | None = None) -> Slits | None:
    """The slits of a mesh, None where there are none. body (N,): number of each node's body; None: there is one."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    edges, n = mesh.edges, len(mesh.points)
    border = np.flatnonzero(edges.sides[:, 1] < 0)
    ends = np.unique(edges.nodes[border])
    if not len(ends):
        return None
    twins = ends[cKDTree(mesh.points[ends]).query_pairs(SAME * float(mesh.node_spacing[ends].min()), output_type="ndarray")]
    if body is not None:
        twins = twins[body[twins[:, 0]] == body[twins[:, 1]]]
    if not len(twins):
        return None
    place = connected_components(coo_array((np.ones(len(twins)), twins.T), shape=(n, n)), directed=False)[1]
    key = np.sort(place[edges.nodes[border]], axis=1)
    _, same, times = np.unique(key, axis=0, return_inverse=True, return_counts=True)
    lips = border[times[same.ravel()] > 1]
    if not len(lips):
        return None
    start, end = mesh.points[edges.nodes[lips, 0]], mesh.points[edges.nodes[lips, 1]]
    across = np.cross(mesh.frames[edges.sides[lips, 0] // 4, 2], end - start)
    node = mesh.cells[mesh.cells >= 0]
    cell = np.repeat(np.arange(len(mesh.cells)), mesh.corners)
    middle = np.stack([np.bincount(node, c, minlength=n) for c in mesh.centres[cell].T], axis=1) / np.bincount(node, minlength=n)[:, None]
    sides = np.where(edges.sides < 0, edges.sides[:, :1], edges.sides) // 4
    between = mesh.points[edges.nodes].mean(axis=1)
    return Slits(
        start=start,
        end=end,
        across=across / np.linalg.norm(across, axis=1)[:, None],
        nodes=mesh.points + INSIDE * (middle - mesh.points),
        edge_moves=INSIDE * (mesh.centres[sides].mean(axis=1) - between),
        centres=mesh.centres,
    )
