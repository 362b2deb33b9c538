"""The mid-surface as nodes and cells, and what follows from it: areas, edges, tangent frames. NumPy only.

Nodes carry mass and motion. Cells (Delaunay triangles or quadrangles) carry the stress points. The edges of the cells carry the mean
values from which the gradients of the cells are made (docs/method.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import SceneError


@dataclass(frozen=True)
class SurfaceMesh:
    """points (N, 3) [m]; cells (M, 4) int32, a triangle has -1 in its last column; spacing D [m];
    normals (N, 3) unit, where the generator knows them exactly. Of a file: regions (M,) masks of cells by name (a cell
    may be in several), thickness [m] by region where the file says it, notes on what was mended or left out."""

    points: np.ndarray
    cells: np.ndarray
    spacing: float
    normals: np.ndarray | None = None
    regions: dict[str, np.ndarray] = field(default_factory=dict)
    thickness: dict[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @cached_property
    def corners(self) -> np.ndarray:
        """(M,) number of corners of each cell, 3 or 4."""
        return np.where(self.cells[:, 3] < 0, 3, 4).astype(np.int32)

    @cached_property
    def area_vectors(self) -> np.ndarray:
        """(M, 3) normal times area [m2], exact for plane cells."""
        p = self.points[np.where(self.cells < 0, self.cells[:, :1], self.cells)]
        return (
            0.5 * np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]) * np.where(self.corners == 4, 1.0, 0.0)[:, None]
            + 0.5 * np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]) * np.where(self.corners == 3, 1.0, 0.0)[:, None]
        )

    @cached_property
    def areas(self) -> np.ndarray:
        """(M,) cell areas [m2]."""
        return np.linalg.norm(self.area_vectors, axis=1)

    @cached_property
    def volume(self) -> float:
        """Inside a closed surface [m3], negative where it points inward; no meaning where it is open."""
        p = self.points - self.points.mean(axis=0)
        a, b, c, d = (p[np.where(self.cells < 0, self.cells[:, :1], self.cells)[:, k]] for k in range(4))
        return float((np.einsum("mi,mi->m", a, np.cross(b, c)) + np.einsum("mi,mi->m", a, np.cross(c, d))).sum() / 6)

    @cached_property
    def centres(self) -> np.ndarray:
        """(M, 3) mean of the corners: where the stress point stands."""
        p = self.points[np.where(self.cells < 0, 0, self.cells)]
        return np.where((self.cells < 0)[:, :, None], 0.0, p).sum(axis=1) / self.corners[:, None]

    def cells_about(self, point: np.ndarray, reach: float) -> np.ndarray:
        """Numbers of the cells whose centre is within reach [m] of a point, in their order."""
        return np.array(sorted(self._tree.query_ball_point(point, reach)), dtype=int)

    @cached_property
    def _tree(self) -> Any:
        """Of the centres, in space."""
        from scipy.spatial import cKDTree

        return cKDTree(self.centres)

    @cached_property
    def frames(self) -> np.ndarray:
        """(M, 3, 3) rows t1, t2, n: orthonormal tangent frame of each cell; t1 along x where it can be."""
        return tangent_frames(self.area_vectors / self.areas[:, None])

    @cached_property
    def node_areas(self) -> np.ndarray:
        """(N,) area that each node owns [m2]: of a quadrangle a quarter, of a triangle its Voronoi share.

        Equal thirds would give a regular lattice of triangles masses of 1 to 2; waves then run 2 % late.
        """
        return self.shared(np.ones(len(self.cells)))

    def shared(self, of_cells: np.ndarray) -> np.ndarray:
        """(N,) what cells with so much per area (M,) give each node, by its share of them as in `node_areas`."""
        share = np.repeat(self.areas / self.corners, 4).reshape(-1, 4)
        triangle = self.corners == 3
        share[triangle, :3] = _voronoi_shares(self.points[self.cells[triangle, :3]], self.areas[triangle])
        share *= of_cells[:, None]
        node = self.cells.ravel()
        return np.bincount(node[node >= 0], share.ravel()[node >= 0], minlength=len(self.points))

    @cached_property
    def node_spacing(self) -> np.ndarray:
        """(N,) local spacing [m]: side of the square that a node owns, smoothed over the cells around it."""
        square = np.sqrt(self.areas * np.where(self.corners == 4, 1.0, 2.0))
        for _ in range(3):
            node = self._mean_over_cells(square)
            corner = node[np.where(self.cells < 0, 0, self.cells)]
            square = np.where(self.cells < 0, 0.0, corner).sum(axis=1) / self.corners
        return node

    def _mean_over_cells(self, of_cell: np.ndarray) -> np.ndarray:
        node = self.cells.ravel()
        value = np.repeat(of_cell, 4)[node >= 0]
        node = node[node >= 0]
        n = len(self.points)
        return np.bincount(node, value, minlength=n) / np.bincount(node, minlength=n)

    @cached_property
    def edges(self) -> Edges:
        """The edges of the cells, each once."""
        return _edges(self)

    @cached_property
    def node_normals(self) -> np.ndarray:
        """(N, 3) unit normals: the generator's, or area-weighted over the cells around a node."""
        if self.normals is not None:
            return self.normals
        normal = np.zeros_like(self.points)
        for corner in range(4):
            has = self.cells[:, corner] >= 0
            np.add.at(normal, self.cells[has, corner], self.area_vectors[has])
        return normal / np.linalg.norm(normal, axis=1)[:, None]


def joined(meshes: Sequence[SurfaceMesh]) -> SurfaceMesh:
    """Several surfaces as one, one after the other; no two share a node. `spacing` is the smallest."""
    if len(meshes) == 1:
        return meshes[0]
    first = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    cells = [np.where(mesh.cells < 0, -1, mesh.cells + n) for mesh, n in zip(meshes, first)]
    normals = None
    if any(mesh.normals is not None for mesh in meshes):
        normals = np.concatenate([mesh.node_normals for mesh in meshes])
    points = np.concatenate([mesh.points for mesh in meshes])
    return SurfaceMesh(points, np.concatenate(cells).astype(np.int32), min(mesh.spacing for mesh in meshes), normals)


@dataclass(frozen=True)
class Edges:
    """nodes (R, 2); cell_edges (M, 4) edge of each side of a cell, -1 for a triangle's fourth;
    sides (R, 2): 4 * cell + side of the one or two cells that an edge bounds, -1 where there is none."""

    nodes: np.ndarray
    cell_edges: np.ndarray
    sides: np.ndarray


def _voronoi_shares(p: np.ndarray, areas: np.ndarray) -> np.ndarray:
    """(K, 3, 3) corners and (K,) areas of triangles -> (K, 3) part of each corner (Meyer et al. 2003): its Voronoi
    cell in the triangle; of an obtuse one half for the wide corner and a quarter for the others."""
    square = np.stack([((p[:, (k + 1) % 3] - p[:, (k + 2) % 3]) ** 2).sum(axis=1) for k in range(3)], axis=1)  # opposite k
    cot = np.stack([(square[:, (k + 1) % 3] + square[:, (k + 2) % 3] - square[:, k]) / (4 * areas) for k in range(3)], axis=1)
    part = square * cot / 8.0
    share = np.stack([part[:, (k + 1) % 3] + part[:, (k + 2) % 3] for k in range(3)], axis=1)
    wide = cot < -1e-12
    return np.where(np.any(wide, axis=1)[:, None], np.where(wide, 0.5, 0.25) * areas[:, None], share)


def _edges(mesh: SurfaceMesh) -> Edges:
    m = len(mesh.cells)
    last = mesh.corners[:, None] - 1
    side = np.arange(4)[None, :]
    a = mesh.cells
    b = np.take_along_axis(mesh.cells, np.where(side == last, 0, np.minimum(side + 1, 3)), axis=1)
    real = side <= last
    cell_side = (4 * np.arange(m)[:, None] + side)[real]
    ends = np.sort(np.stack([a[real], b[real]], axis=1), axis=1).astype(np.int64)
    key = ends[:, 0] * len(mesh.points) + ends[:, 1]
    unique, first, inverse, count = np.unique(key, return_index=True, return_inverse=True, return_counts=True)
    if count.max(initial=0) > 2:
        bad = ends[first[np.argmax(count)]]
        raise SceneError(f"mesh: the edge between nodes {bad[0]} and {bad[1]} bounds {count.max()} cells; at most 2 are allowed")
    # keep the edges in the order in which the cells meet them: neighbours in space stay neighbours in memory
    order = np.argsort(first, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    edge = rank[inverse].astype(np.int32)
    cell_edges = np.full((m, 4), -1, np.int32)
    cell_edges[real] = edge
    sides = np.full((len(unique), 2), -1, np.int32)
    by_edge = np.argsort(edge, kind="stable")
    start = np.r_[True, edge[by_edge][1:] != edge[by_edge][:-1]]
    sides[edge[by_edge][start], 0] = cell_side[by_edge][start]
    sides[edge[by_edge][~start], 1] = cell_side[by_edge][~start]
    return Edges(ends[first[order]].astype(np.int32), cell_edges, sides)


def tangent_frames(normals: np.ndarray) -> np.ndarray:
    """(K, 3) unit normals -> (K, 3, 3) rows t1, t2, n, with t1 the projection of x (of y near the poles)."""
    axis = np.zeros_like(normals)
    near = np.abs(normals[:, 0]) > 0.9
    axis[~near, 0] = 1.0
    axis[near, 1] = 1.0
    t1 = axis - normals * np.einsum("ki,ki->k", axis, normals)[:, None]
    t1 /= np.linalg.norm(t1, axis=1)[:, None]
    return np.stack([t1, np.cross(normals, t1), normals], axis=1)


def plate(
    length: float,
    width: float,
    spacing: float,
    cells: str = "quad",
    irregularity: float = 0.0,
    seed: int = 0,
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> SurfaceMesh:
    """Rectangle [0, length] x [0, width] + origin, nodes on the boundary, about `spacing` apart.

    `irregularity`: inner nodes are moved at random by up to that many spacings in x and y. Triangles: on a
    regular lattice the diagonals alternate; on an irregular one the triangulation is Delaunay's.
    """
    nx, ny = max(1, round(length / spacing)), max(1, round(width / spacing))
    x, y = np.meshgrid(np.linspace(0, length, nx + 1), np.linspace(0, width, ny + 1))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    inner = (x > 0) & (x < length) & (y > 0) & (y < width)
    if irregularity > 0:
        move = np.random.default_rng(seed).uniform(-1, 1, (x.size, 2)) * inner.ravel()[:, None]
        points[:, :2] += irregularity * move * [length / nx, width / ny]
    corner = (np.arange(ny)[:, None] * (nx + 1) + np.arange(nx)[None, :]).ravel()
    quads = np.stack([corner, corner + 1, corner + nx + 2, corner + nx + 1], axis=1)
    if cells == "quad":
        connectivity = quads
    elif irregularity > 0:
        connectivity = delaunay(points[:, :2])
    else:
        even = ((corner % (nx + 1)) + corner // (nx + 1)) % 2 == 0
        one = np.where(even[:, None], quads[:, [0, 1, 2]], quads[:, [0, 1, 3]])
        two = np.where(even[:, None], quads[:, [0, 2, 3]], quads[:, [1, 2, 3]])
        connectivity = np.stack([one, two], axis=1).reshape(-1, 3)
    full = np.full((len(connectivity), 4), -1, np.int32)
    full[:, : connectivity.shape[1]] = connectivity
    d = np.sqrt(length * width / (nx * ny))
    return SurfaceMesh(points + np.asarray(origin), full, float(d))


def delaunay(xy: np.ndarray) -> np.ndarray:
    """Counter-clockwise Delaunay triangles in the order of their first node; flat ones on the hull dropped."""
    from scipy.spatial import Delaunay

    t = Delaunay(xy).simplices
    p = xy[t]
    area = 0.5 * ((p[:, 1, 0] - p[:, 0, 0]) * (p[:, 2, 1] - p[:, 0, 1]) - (p[:, 2, 0] - p[:, 0, 0]) * (p[:, 1, 1] - p[:, 0, 1]))
    t = np.where(area[:, None] < 0, t[:, [0, 2, 1]], t)
    t = t[np.abs(area) > 1e-9 * np.median(np.abs(area))]
    return t[np.lexsort((t.max(axis=1), t.min(axis=1)))]
