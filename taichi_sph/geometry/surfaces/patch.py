"""Patches: nets of quadrangles in a chart, with the map that bends it; where they stand; several as one mesh. NumPy only."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..mesh import SurfaceMesh

TURN = {"x": [2, 0, 1], "y": [1, 2, 0], "z": [0, 1, 2]}  # local (x, y, z), z along the axis, to the scene's
Place = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]  # points and normals (N, 3) of a patch -> those in the scene


@dataclass(frozen=True)
class Patch:
    """chart (N, 2) [m], quads (M, 4) counter-clockwise in it, inner (N,) nodes off the border, bend: chart ->
    points (N, 3), unit normals (N, 3); period: width [m] of a chart that closes on itself in x; triangles (K, 3) beside the quads: at the
    holes of a perforated one; planes: nodes on x = 0 and y = 0 of the chart are not moved at random, for it will be parted there."""

    chart: np.ndarray
    quads: np.ndarray
    inner: np.ndarray
    bend: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
    period: float | None = None
    triangles: np.ndarray = field(default_factory=lambda: np.empty((0, 3), np.int64))
    perforated: bool = False
    planes: bool = False


Finish = Callable[[Patch, Place], SurfaceMesh]


def along(axis: str, origin: tuple[float, float, float]) -> Place:
    """From z along the axis of a surface, from 0, to the scene."""
    turn = TURN[axis]
    return lambda points, normals: (points[:, turn] + np.asarray(origin), normals[:, turn])


def stood(frame: np.ndarray, origin: Sequence[float] | np.ndarray) -> Place:
    """From x, y, z along the rows of a frame to the scene."""
    return lambda points, normals: (points @ frame + np.asarray(origin), normals @ frame)


def then(first: Place, second: Place) -> Place:
    return lambda points, normals: second(*first(points, normals))


def put(mesh: SurfaceMesh, place: Place) -> SurfaceMesh:
    points, normals = place(mesh.points, mesh.node_normals)
    return SurfaceMesh(points, mesh.cells, mesh.spacing, normals)


def mesh_from(points: np.ndarray, cells: np.ndarray, normals: np.ndarray) -> SurfaceMesh:
    """With D the side of the square that a node owns on average."""
    cells = cells.astype(np.int32)
    mesh = SurfaceMesh(points, cells, 0.0)
    squares = np.where(mesh.corners == 4, 1.0, 0.5).sum()
    return SurfaceMesh(points, cells, float(np.sqrt(mesh.areas.sum() / squares)), normals)


def strip(width: float, columns: int, heights: np.ndarray, whole: bool, bend: Callable) -> Patch:
    """Rows of `columns` cells at the heights of a chart `width` wide, which closes on itself where it is whole."""
    rows = len(heights) - 1
    along = columns if whole else columns + 1  # nodes in a row
    x, z = np.meshgrid(width * np.arange(along) / columns, heights)
    number = np.arange(x.size).reshape(x.shape)
    after = np.roll(number, -1, axis=1) if whole else number[:, 1:]
    number_ = number if whole else number[:, :-1]
    quads = np.stack([number_[:-1], after[:-1], after[1:], number_[1:]], axis=-1).reshape(-1, 4)
    inner = (number >= along) & (number < rows * along)
    if not whole:
        inner[:, [0, -1]] = False
    return Patch(np.column_stack([x.ravel(), z.ravel()]), quads, inner.ravel(), bend, width if whole else None)


def mirrored(cells: np.ndarray) -> np.ndarray:
    """Cells turned round."""
    return np.where(cells[:, 3:] < 0, cells[:, [0, 2, 1, 3]], cells[:, [0, 3, 2, 1]])


def welded(parts: Sequence[SurfaceMesh]) -> SurfaceMesh:
    """Patches whose borders stand on each other as one mesh; there the normal is the mean of theirs."""
    points = np.concatenate([part.points for part in parts])
    normals = np.concatenate([part.node_normals for part in parts])
    first = np.cumsum([0] + [len(part.points) for part in parts])
    cells = np.concatenate([np.where(part.cells < 0, -1, part.cells + n) for part, n in zip(parts, first)])
    stands_for = _firsts(points, 1e-6 * parts[0].spacing)
    total = np.zeros_like(normals)
    np.add.at(total, stands_for, normals)
    normal = total[_kept(stands_for)]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return mesh_from(*_without(points, cells, stands_for), normal)


def one_of_each(points: np.ndarray, cells: np.ndarray, near: float) -> tuple[np.ndarray, np.ndarray]:
    """Points and cells without the points that stand on earlier ones."""
    return _without(points, cells, _firsts(points, near))


def _firsts(points: np.ndarray, near: float) -> np.ndarray:
    """(N,) the first of the points that stand where each of them stands."""
    from scipy.spatial import cKDTree

    pairs = np.sort(cKDTree(points).query_pairs(near, output_type="ndarray"), axis=1)
    found = np.arange(len(points))
    np.minimum.at(found, pairs[:, 1], pairs[:, 0])
    return found


def _kept(firsts: np.ndarray) -> np.ndarray:
    """(N,) bool: points that stand on no earlier one."""
    return firsts == np.arange(len(firsts))


def _without(points: np.ndarray, cells: np.ndarray, firsts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The points that are kept, and the cells with their new numbers."""
    number = np.cumsum(_kept(firsts)) - 1
    return points[_kept(firsts)], np.where(cells < 0, -1, number[firsts[cells]])
