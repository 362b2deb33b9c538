"""A patch as a mesh: holes cut, inner nodes moved at random, quadrangles halved, the chart bent. NumPy only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..holes import Cutter
from ..mesh import SurfaceMesh, delaunay
from .patch import Patch, Place, mesh_from

SHARPEST = 0.2  # smallest sine at a corner of a quadrangle that random moves may leave


def finish(patch: Patch, cells: str, irregularity: float, rng: np.random.Generator, cutter: Cutter, place: Place) -> SurfaceMesh:
    """Cuts the holes, moves the inner nodes, cuts the quadrangles if triangles are asked for, bends the chart."""
    patch = _perforated(patch, cutter, place)
    if irregularity > 0:
        patch = replace(patch, chart=_shaken(patch, irregularity, rng))
    if cells == "quad":
        connectivity = [patch.quads, patch.triangles]
    elif irregularity > 0 and patch.inner.any() and not patch.perforated:  # Delaunay's triangles would close holes
        connectivity = [delaunay(patch.chart) if patch.period is None else _delaunay_round(patch.chart, patch.period)]
    else:
        connectivity = [_halved(patch), patch.triangles]
    points, normals = patch.bend(patch.chart)
    return mesh_from(points, _rows(connectivity), normals)


def _rows(connectivity: Sequence[np.ndarray]) -> np.ndarray:
    """Triangles and quadrangles as rows of four, -1 behind a triangle."""
    full = np.full((sum(len(part) for part in connectivity), 4), -1, np.int32)
    n = 0
    for part in connectivity:
        full[n : n + len(part), : part.shape[1]] = part
        n += len(part)
    return full


def _perforated(patch: Patch, cutter: Cutter, place: Place) -> Patch:
    """The patch without the holes that lie in it."""
    cut = cutter.cut(patch.chart, _rows([patch.quads]), patch.inner, lambda chart: place(*patch.bend(chart)), patch.period)
    if cut is None:
        return patch
    four = cut.cells[:, 3] >= 0
    return replace(patch, chart=cut.chart, quads=cut.cells[four], inner=cut.inner, triangles=cut.cells[~four, :3], perforated=True)


def _sides(chart: np.ndarray, quads: np.ndarray, period: float | None) -> np.ndarray:
    """(M, 4, 2) vectors along the sides of quadrangles (of triangles (M, 3, 2)), the short way round."""
    p = chart[quads]
    side = np.roll(p, -1, axis=1) - p
    if period is not None:
        side[..., 0] -= period * np.round(side[..., 0] / period)
    return side


def _shaken(patch: Patch, irregularity: float, rng: np.random.Generator) -> np.ndarray:
    """The chart with its inner nodes moved by up to `irregularity` local spacings in each direction; less where a
    cell would lose its convexity."""
    kinds = [cells for cells in (patch.quads, patch.triangles) if len(cells)]
    sides = [_sides(patch.chart, cells, patch.period) for cells in kinds]
    n = len(patch.chart)
    whole, count = np.zeros(n), np.zeros(n, int)
    for cells, side in zip(kinds, sides):
        square = 0.5 * _cross(side[:, 0] + side[:, 1], side[:, 1] + side[:, 2]) if cells.shape[1] == 4 else _cross(side[:, 0], side[:, 1])
        node = cells.ravel()
        whole = whole + np.bincount(node, np.repeat(square, cells.shape[1]), minlength=n)
        count = count + np.bincount(node, minlength=n)
    spacing = np.sqrt(whole / count)
    moves = patch.inner & (~patch.planes | (np.abs(patch.chart) > 1e-6 * spacing[:, None]).all(axis=1))
    move = irregularity * spacing[:, None] * rng.uniform(-1, 1, (n, 2)) * moves[:, None]
    sharpest = np.minimum(SHARPEST, 0.9 * min(_sines(side).min() for side in sides))
    while True:
        chart = patch.chart + move
        folded = []
        for cells in kinds:
            folded.append(cells[(_sines(_sides(chart, cells, patch.period)) < sharpest).any(axis=1)].ravel())
        bad = np.unique(np.concatenate(folded))
        if not len(bad):
            return chart
        move[bad] *= 0.8


def _sines(side: np.ndarray) -> np.ndarray:
    """(M, 4) sine of the angle at each corner, negative where the cell is folded in."""
    length = np.linalg.norm(side, axis=2)
    return _cross(np.roll(side, 1, axis=1), side) / (np.roll(length, 1, axis=1) * length)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _halved(patch: Patch) -> np.ndarray:
    """Two triangles of each quadrangle: cut along the shorter diagonal, in turns where they are equally long."""
    q = patch.quads
    side = _sides(patch.chart, q, patch.period)
    one, two = np.linalg.norm(side[:, 0] + side[:, 1], axis=1), np.linalg.norm(side[:, 1] + side[:, 2], axis=1)
    turn = np.abs(one - two) < 1e-6 * one
    first = np.where(turn, _chequered(patch), one < two)[:, None]
    a = np.where(first, q[:, [0, 1, 2]], q[:, [0, 1, 3]])
    b = np.where(first, q[:, [0, 2, 3]], q[:, [1, 2, 3]])
    return np.stack([a, b], axis=1).reshape(-1, 3)


def _chequered(patch: Patch) -> np.ndarray:
    """(M,) whether the first corner of a quadrangle is a black node, nodes being coloured along the sides."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import breadth_first_order

    a, b = patch.quads.ravel(), np.roll(patch.quads, -1, axis=1).ravel()
    n = len(patch.chart)  # beside holes the colours may meet, and the diagonals there are what they are
    graph = coo_array((np.ones(len(a)), (a, b)), shape=(n, n)).tocsr()
    order, before = breadth_first_order(graph, 0, directed=False)
    black = np.zeros(n, bool)
    for node in order[1:]:
        black[node] = not black[before[node]]
    return black[patch.quads[:, 0]]


def _delaunay_round(chart: np.ndarray, period: float) -> np.ndarray:
    """Delaunay triangles of a chart that closes on itself: of three copies side by side, those whose leftmost corner
    belongs to the middle one."""
    n = len(chart)
    copies = np.concatenate([chart + [k * period, 0.0] for k in (-1, 0, 1)])
    triangles = delaunay(copies)
    left = np.take_along_axis(triangles, copies[triangles, 0].argmin(axis=1)[:, None], axis=1)[:, 0]
    found = triangles[(left >= n) & (left < 2 * n)] % n
    return found[np.lexsort((found.max(axis=1), found.min(axis=1)))]
