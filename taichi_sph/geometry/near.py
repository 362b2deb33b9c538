"""What is near a surface: the nearest places of it, places moved off it, even samples of it. NumPy only."""

from __future__ import annotations

import numpy as np

from .mesh import SurfaceMesh


def triangles_of(mesh: SurfaceMesh) -> np.ndarray:
    """(T, 3, 3) corners; a quadrangle gives two: its first one stands among those of all cells, its second one behind them."""
    c = mesh.cells
    four = c[c[:, 3] >= 0]
    return mesh.points[np.concatenate([c[:, :3], four[:, [0, 2, 3]]])]


def sampled(mesh: SurfaceMesh, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """(K, 3) points of a surface at most about `spacing` [m] apart and (K, 3) their vector areas [m2]: each cell is cut into equal parts,
    and a point is the middle of one."""
    points, areas = [], []
    corner = mesh.points[np.where(mesh.cells < 0, mesh.cells[:, :1], mesh.cells)]
    triangle = mesh.cells[:, 3] < 0
    sides = np.linalg.norm(corner - np.roll(corner, -1, axis=1), axis=2)
    longest = np.where(triangle, sides[:, :3].max(axis=1), np.maximum(sides[:, 0], sides[:, 2]))
    other = np.where(triangle, longest, np.maximum(sides[:, 1], sides[:, 3]))
    n = np.maximum(1, np.ceil(np.column_stack([longest, other]) / spacing - 1e-9)).astype(int)
    for a, b in np.unique(n, axis=0):
        own = (n == (a, b)).all(axis=1)
        four, three = corner[own & ~triangle], corner[own & triangle]
        u, v = ((np.arange(k) + 0.5) / k for k in (a, b))
        u, v = (x.ravel() for x in np.meshgrid(u, v))
        for quad in four:
            points.append(_bilinear(quad, u, v))
            along, across = (
                _bilinear(quad[[1, 1, 2, 2]] - quad[[0, 0, 3, 3]], u, v),
                _bilinear(quad[[3, 2, 2, 3]] - quad[[0, 1, 1, 0]], u, v),
            )
            areas.append(np.cross(along, across) / (a * b))
        i, j = (x.ravel() for x in np.meshgrid(np.arange(a), np.arange(a)))
        up, down = i + j < a, i + j < a - 1
        s, t = np.concatenate([(i + 1 / 3)[up], (i + 2 / 3)[down]]) / a, np.concatenate([(j + 1 / 3)[up], (j + 2 / 3)[down]]) / a
        for p, q, r, _ in three:
            points.append(p + s[:, None] * (q - p) + t[:, None] * (r - p))
            areas.append(np.tile(0.5 * np.cross(q - p, r - p) / a**2, (len(s), 1)))
    return np.concatenate(points), np.concatenate(areas)


def _bilinear(quad: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    weight = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v], axis=1)
    return weight @ quad


def moved_off(points: np.ndarray, walls: np.ndarray, half: np.ndarray, clear: float) -> np.ndarray:
    """The points, those that stand nearer to the surface of a wall than `clear` [m] moved off it; in corners off one wall after the other.
    half (T,) [m]: half the thickness of each triangle of walls (T, 3, 3)."""
    points, near = points.copy(), np.arange(len(points))
    for _ in range(4):
        away, wall = away_from(points[near], walls, clear + half.max())
        distance, margin = np.linalg.norm(away, axis=1), clear + half[wall]
        upon = distance == 0  # in the very plane of a wall: to the side of its normal
        normal = np.cross(walls[wall[upon], 1] - walls[wall[upon], 0], walls[wall[upon], 2] - walls[wall[upon], 0])
        away[upon] = 1e-3 * margin[upon, None] * normal / np.linalg.norm(normal, axis=1)[:, None]
        distance = np.linalg.norm(away, axis=1)
        short = (distance < margin * (1 - 1e-9)) & (distance > 0)
        near, away = near[short], away[short]
        points[near] += (margin[short] / distance[short] - 1)[:, None] * away
    return points


def away_from(points: np.ndarray, triangles: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """(N, 3) way from the nearest triangle to each point [m], and (N,) its number. Beyond `reach` only the length counts: infinite."""
    from scipy.spatial import cKDTree

    centre = triangles.mean(axis=1)
    radius = np.linalg.norm(triangles - centre[:, None], axis=2).max()
    tree = cKDTree(centre)
    result, number = np.full(points.shape, np.inf), np.zeros(len(points), int)
    middle = tree.query(points)[0]  # of a triangle: the nearest one is no farther than that
    close = np.nonzero(middle < reach + radius)[0]
    within = np.minimum(reach, middle * (1 + 1e-9)) + radius
    for part in np.array_split(close, max(1, len(close) // 20_000)):
        lists = tree.query_ball_point(points[part], within[part])
        count = np.array([len(k) for k in lists])
        if not count.sum():
            continue
        t = np.concatenate([np.asarray(k, int) for k in lists])
        i = np.repeat(part, count)
        away = points[i] - feet(points[i], triangles[t])
        order = np.lexsort((np.linalg.norm(away, axis=1), i))
        i, away, t = i[order], away[order], t[order]
        first = np.append(True, i[1:] != i[:-1])
        result[i[first]], number[i[first]] = away[first], t[first]
    return result, number


def feet(p: np.ndarray, t: np.ndarray) -> np.ndarray:
    """(K, 3) points of triangles (K, 3, 3) nearest to points: the foot on the plane where it lies inside, else on a side."""
    a, u, v = t[:, 0], t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]
    w = p - a
    normal = np.cross(u, v)
    square = np.einsum("ki,ki->k", normal, normal)
    l2 = np.einsum("ki,ki->k", np.cross(u, w), normal) / square
    l1 = np.einsum("ki,ki->k", np.cross(w, v), normal) / square
    result = a + l1[:, None] * u + l2[:, None] * v
    found = np.linalg.norm(p - result, axis=1)
    found[(l1 < 0) | (l2 < 0) | (l1 + l2 > 1)] = np.inf
    for k in range(3):
        start, side = t[:, k], t[:, (k + 1) % 3] - t[:, k]
        along = np.einsum("ki,ki->k", p - start, side) / np.einsum("ki,ki->k", side, side)
        foot = start + np.clip(along, 0, 1)[:, None] * side
        distance = np.linalg.norm(p - foot, axis=1)
        result[distance < found] = foot[distance < found]
        found = np.minimum(found, distance)
    return result
