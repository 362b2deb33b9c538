"""Surface meshes from files: whatever meshio reads, made into a SurfaceMesh or refused in one sentence.

Triangles and quadrangles only. Refused: what would run and be wrong (coincident nodes, flat cells, edges
shared by three cells, a bow-tie quadrangle). Mended: cells turned the wrong way round, nodes that no cell
uses (points of the geometry, left by most mesh generators).
"""

from __future__ import annotations

import contextlib
import io
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import SceneError
from .mesh import SurfaceMesh
from .normals import fitted_normals

READABLE = (".msh", ".inp", ".vtu", ".vtk", ".stl", ".ply", ".obj", ".off", ".bdf", ".nas", ".med", ".xdmf", ".mesh")
FLAT = 1e-3  # a cell whose smallest height is below this part of its longest side is a sliver
CELLS = {"triangle": 3, "quad": 4}
IGNORED = ("vertex", "line")  # curves and points of the geometry


def read_mesh(path: Path | str, scale: float = 1.0, plane: bool = False) -> SurfaceMesh:
    """The mesh of a file, its coordinates times `scale` [m per unit of the file].

    `plane`: the body moves in its plane, so all points must have the same z. Numbers of nodes and cells in
    sentences count from 1, as mesh generators do.
    """
    path = Path(path)
    raw = _read(path)
    points, cells = _arrays(path.name, raw)
    points = points * scale
    points, cells = _used(points, cells)
    _check_points(path.name, points, scale)
    _check_cells(path.name, points, cells)
    cells = _oriented(path.name, points, cells, plane)
    mesh = SurfaceMesh(points, cells, _spacing(points, cells))
    if plane and np.ptp(points[:, 2]) > 1e-9 * np.ptp(points, axis=0).max():
        node = int(np.argmax(np.abs(points[:, 2] - np.median(points[:, 2]))))
        raise SceneError(
            f"mesh {path.name}: node {node + 1} has z = {points[node, 2]:.6g} m, others {np.median(points[:, 2]):.6g} m; "
            "a body with motion 'in_plane' needs a plane mesh, z = constant"
        )
    return mesh if plane else replace(mesh, normals=fitted_normals(mesh))


def _read(path: Path) -> Any:
    if not path.is_file():
        near = [p.name for p in path.parent.glob("*") if p.suffix.lower() in READABLE] if path.parent.is_dir() else []
        there = f"; the folder has {', '.join(sorted(near)[:5])}" if near else ""
        raise SceneError(f"there is no mesh file '{path}'{there}")
    if path.suffix.lower() not in READABLE:
        raise SceneError(f"mesh {path.name}: '{path.suffix}' is no mesh format; readable are {', '.join(READABLE)}")
    if path.stat().st_size == 0:
        raise SceneError(f"mesh {path.name} is an empty file")
    import meshio

    try:
        # meshio prints, and ends the program, where the readers of an ending have all failed
        said = io.StringIO()
        with warnings.catch_warnings(), contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            warnings.simplefilter("ignore")
            with np.errstate(all="ignore"):
                return meshio.read(path)
    except (Exception, SystemExit) as error:
        why = "" if isinstance(error, SystemExit) else " ".join(str(error).split())[:120]
        raise SceneError(f"mesh {path.name} cannot be read as {path.suffix}{f' ({why})' if why else ''}") from None


def _arrays(name: str, raw: Any) -> tuple[np.ndarray, np.ndarray]:
    """points (N, 3) f64 and cells (M, 4) int64 with -1 behind triangles."""
    points = np.asarray(raw.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] not in (2, 3) or len(points) == 0:
        raise SceneError(f"mesh {name} has no points")
    if points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    blocks = []
    for block in raw.cells:
        if block.type in CELLS:
            corners = CELLS[block.type]
            full = np.full((len(block.data), 4), -1, np.int64)
            full[:, :corners] = block.data
            blocks.append(full)
        elif not block.type.startswith(IGNORED):
            raise SceneError(
                f"mesh {name} has {len(block.data)} cells of type '{block.type}'; a shell is made of triangles and "
                "quadrangles of first order"
            )
    cells = np.concatenate(blocks) if blocks else np.empty((0, 4), np.int64)
    if len(cells) == 0:
        raise SceneError(f"mesh {name} has no triangles or quadrangles")
    return points, cells


def _used(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Without the points that no cell uses; numbers out of range are kept for the check to find."""
    real = cells[cells >= 0]
    if real.max() >= len(points) or cells[:, :3].min() < 0:
        return points, cells
    used = np.zeros(len(points), bool)
    used[real] = True
    if used.all():
        return points, cells
    number = np.where(used, np.cumsum(used) - 1, -1)
    return points[used], np.where(cells >= 0, number[cells], -1)


def _check_points(name: str, points: np.ndarray, scale: float) -> None:
    bad = ~np.isfinite(points).all(axis=1)
    if bad.any():
        raise SceneError(f"mesh {name}: node {np.argmax(bad) + 1} has a coordinate that is not a number")
    size = float(np.ptp(points, axis=0).max())
    if not 1e-6 <= size <= 1e4:
        raise SceneError(
            f"mesh {name} is {size:.3g} m large with scale = {scale:g}; a body is between 1e-6 m and 1e4 m: "
            "is it in millimetres (scale = 0.001)?"
        )
    from scipy.spatial import cKDTree

    pairs = cKDTree(points).query_pairs(1e-7 * size, output_type="ndarray")
    if len(pairs):
        a, b = sorted(pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))][0])
        raise SceneError(
            f"mesh {name}: nodes {a + 1} and {b + 1} coincide at {_place(points[a])} ({len(pairs)} such pairs); merge "
            "them, and make cracks with cuts"
        )


def _check_cells(name: str, points: np.ndarray, cells: np.ndarray) -> None:
    real = cells[cells >= 0]
    if real.max() >= len(points) or cells[:, :3].min() < 0:
        cell = int(np.argmax((cells >= len(points)).any(axis=1) | (cells[:, :3] < 0).any(axis=1)))
        raise SceneError(f"mesh {name}: cell {cell + 1} refers to a node that does not exist ({len(points)} nodes)")
    corners = np.sort(np.where(cells < 0, -1 - np.arange(4), cells), axis=1)
    twice = (np.diff(corners, axis=1) == 0).any(axis=1)
    if twice.any():
        raise SceneError(f"mesh {name}: cell {np.argmax(twice) + 1} uses the same node twice")
    _, first, count = np.unique(corners, axis=0, return_index=True, return_counts=True)
    if count.max() > 1:
        raise SceneError(f"mesh {name}: cell {first[np.argmax(count)] + 1} is there {count.max()} times")
    triangle = cells[:, 3] < 0
    p = points[np.where(cells < 0, cells[:, :1], cells)]
    sides = np.linalg.norm(np.where(cells[:, :, None] < 0, 0, p - np.roll(p, -1, axis=1)), axis=2)
    longest = sides.max(axis=1)
    # twice the area of the triangle at every corner; a quadrangle needs all four of one sign
    at = np.cross(np.roll(p, -1, axis=1) - p, np.roll(p, 1, axis=1) - p)
    at[triangle] = np.cross(p[triangle, 1] - p[triangle, 0], p[triangle, 2] - p[triangle, 0])[:, None, :]
    height = np.linalg.norm(at, axis=2).min(axis=1) / longest**2
    if (height < FLAT).any():
        cell = int(np.argmin(height))
        raise SceneError(
            f"mesh {name}: cell {cell + 1} at {_place(p[cell].mean(axis=0))} is flat: its height is {height[cell]:.1e} "
            f"of its longest side, at least {FLAT:g} is needed"
        )
    folded = (np.einsum("mci,mdi->mcd", at, at) < 0).any(axis=(1, 2))
    if folded.any():
        cell = int(np.argmax(folded))
        raise SceneError(f"mesh {name}: quadrangle {cell + 1} at {_place(p[cell].mean(axis=0))} crosses itself or is not convex")


def _oriented(name: str, points: np.ndarray, cells: np.ndarray, plane: bool) -> np.ndarray:
    """Cells turned so that neighbours agree; in the plane, counter-clockwise seen from +z."""
    from collections import deque

    count = np.where(cells[:, 3] < 0, 3, 4)
    side = np.arange(4)[None, :]
    after = np.take_along_axis(cells, np.where(side == count[:, None] - 1, 0, np.minimum(side + 1, 3)), axis=1)
    real = side < count[:, None]
    owner = np.broadcast_to(np.arange(len(cells))[:, None], cells.shape)[real]
    a, b = cells[real], after[real]
    key = np.minimum(a, b) * len(points) + np.maximum(a, b)
    order = np.argsort(key, kind="stable")
    starts = np.flatnonzero(np.r_[True, np.diff(key[order]) != 0])
    uses = np.diff(np.r_[starts, len(order)])
    if uses.max() > 2:
        half = order[starts[np.argmax(uses)]]
        raise SceneError(
            f"mesh {name}: the edge between nodes {a[half] + 1} and {b[half] + 1} bounds {uses.max()} cells; a surface "
            "has at most 2 on an edge"
        )
    one, two = order[starts[uses == 2]], order[starts[uses == 2] + 1]
    agree = a[one] == b[two]  # neighbours that agree run along their edge in opposite directions
    flip = np.zeros(len(cells), bool)
    if not agree.all():
        around: list[list[tuple[int, bool]]] = [[] for _ in cells]
        for i, j, same in zip(owner[one], owner[two], agree):
            around[i].append((j, not same))
            around[j].append((i, not same))
        seen = np.zeros(len(cells), bool)
        for seed in range(len(cells)):
            if seen[seed]:
                continue
            seen[seed] = True
            queue = deque([seed])
            while queue:
                i = queue.popleft()
                for j, other in around[i]:
                    if not seen[j]:
                        seen[j], flip[j] = True, flip[i] ^ other
                        queue.append(j)
                    elif flip[j] != flip[i] ^ other:
                        raise SceneError(
                            f"mesh {name}: the surface has one side only (a Moebius strip) near cell {j + 1}; it cannot be given a normal"
                        )
    turned = _turned(cells, flip)
    if plane:
        p = points[np.where(turned < 0, turned[:, :1], turned)]
        downward = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])[:, 2]
        triangle = turned[:, 3] < 0
        downward[triangle] = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])[triangle, 2]
        turned = _turned(turned, downward < 0)
    return turned.astype(np.int32)


def _turned(cells: np.ndarray, which: np.ndarray) -> np.ndarray:
    """The cells with the order of their corners reversed where asked (first corner kept)."""
    result = cells.copy()
    triangle = cells[:, 3] < 0
    three, four = which & triangle, which & ~triangle
    result[three] = cells[three][:, [0, 2, 1, 3]]
    result[four] = cells[four][:, [0, 3, 2, 1]]
    return result


def _spacing(points: np.ndarray, cells: np.ndarray) -> float:
    """D [m]: side of the square that a node owns on average, area shared as in a boundless lattice."""
    p = points[np.where(cells < 0, cells[:, :1], cells)]
    triangle = cells[:, 3] < 0
    area = 0.5 * np.linalg.norm(np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]), axis=1)
    area[triangle] = 0.5 * np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)[triangle]
    return float(np.sqrt(area.sum() / (0.5 * triangle.sum() + (~triangle).sum())))


def _place(point: np.ndarray) -> str:
    return "(" + ", ".join(f"{x:.4g}" for x in point) + ") m"
