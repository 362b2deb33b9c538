"""Meshes of the surfaces that a scene names by their dimensions, with exact normals. NumPy only.

A surface is one patch or several (wall and two ends, six walls of a box). A patch is a net of quadrangles in a plane chart, and the map
that bends the chart into space. Nodes are moved at random, and triangulated anew, in the chart, so they stay in the surface. Charts
keep angles (unrolled wall, stereographic cap), so Delaunay's triangles in a chart are those of the surface. Holes are cut into the
finished patch (holes.py).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field, replace
from weakref import WeakValueDictionary

import numpy as np

from ..errors import SceneError
from ..scene import Numerics, Scene, Shell
from ..scene.plausible import MAX_NODES
from ..scene.surfaces import (
    BoxTank,
    CappedTank,
    Cylinder,
    Disc,
    Frustum,
    Generated,
    MeshFile,
    Net,
    Plate,
    Roof,
    Sphere,
    SpherePatch,
    frame_of,
)
from ..scene.units import show
from .heads import meridian
from .holes import Cutter
from .mesh import SurfaceMesh, delaunay, plate
from .meshfile import read_mesh
from .meshfile import surface as surface_of
from .meshfiles.raw import Raw
from .ogrid import coons, of_sphere, ogrid, proportions

TURN = {"x": [2, 0, 1], "y": [1, 2, 0], "z": [0, 1, 2]}  # local (x, y, z), z along the axis, to the scene's
Place = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]  # points and normals (N, 3) of a patch -> those in the scene
SHARPEST = 0.2  # smallest sine at a corner of a quadrangle that random moves may leave


@dataclass(frozen=True)
class Patch:
    """chart (N, 2) [m], quads (M, 4) counter-clockwise in it, inner (N,) nodes off the border, bend: chart ->
    points (N, 3), unit normals (N, 3); period: width [m] of a chart that closes on itself in x; triangles (K, 3) beside the quads: at the
    holes of a perforated one."""

    chart: np.ndarray
    quads: np.ndarray
    inner: np.ndarray
    bend: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
    period: float | None = None
    triangles: np.ndarray = field(default_factory=lambda: np.empty((0, 3), np.int64))
    perforated: bool = False


Finish = Callable[[Patch, Place], SurfaceMesh]


def generate(surface: Generated, numerics: Numerics) -> SurfaceMesh:
    """The mesh of any generated surface with the spacing, cells and irregularity of `numerics`."""
    d, cells, irregularity, seed = numerics.spacing, numerics.cells, numerics.irregularity, numerics.seed
    if isinstance(surface, Plate) and not surface.holes:
        if not surface.turned:
            return plate(surface.length, surface.width, d, cells, irregularity, seed, surface.origin)
        return _put(plate(surface.length, surface.width, d, cells, irregularity, seed), _stood(surface.frame, surface.origin))
    rng, cutter = np.random.default_rng(seed), Cutter(surface.holes, d)
    mesh = _generated(surface, d, lambda patch, place: _finish(patch, cells, irregularity, rng, cutter, place))
    cutter.check()
    return mesh


def _generated(surface: Generated, d: float, finish: Finish) -> SurfaceMesh:
    """Its patches, finished and put where they stand in the scene."""
    if isinstance(surface, BoxTank):
        return _box(surface, d, finish)
    there = _along(getattr(surface, "axis", "z"), surface.origin)
    match surface:
        case Plate():
            there = _stood(surface.frame, surface.origin)
            patch = _sheet(surface.length, surface.width, d)
        case Disc():
            there = there if surface.normal is None else _stood(frame_of(surface.normal), surface.origin)
            patch = _cap(_rim(surface.radius, d), surface.radius, 0.0)
        case SpherePatch():
            radius = surface.radius * np.sin(surface.half_angle)
            there = _then(_along("z", (0.0, 0.0, surface.radius * np.cos(surface.half_angle))), there)
            patch = _cap(_rim(radius, d), radius, surface.half_angle)
        case Roof():
            # the axis along x has local x along y and local y along z: the crown stands at 90 deg
            start, angle = np.pi / 2 - surface.half_angle, surface.half_angle - surface.start
            there = _along("x", surface.origin)
            patch = _wall(surface.radius, surface.length, start, angle, d)
        case Sphere():
            return _put(_sphere(surface, d, finish, there), there)
        case Cylinder() if surface.ends == "open":
            patch = _wall(surface.radius, surface.length, surface.start_angle, None if surface.whole else surface.angle, d)
        case Frustum() if surface.ends == "open":
            patch = _cone(surface, None if surface.whole else surface.angle, d)
        case Cylinder():
            caps = [_cap(_rim(surface.radius, d), surface.radius, 0.0)] * 2
            wall = _wall(surface.radius, surface.length, surface.start_angle, None, d)
            return _put(_closed(wall, surface.length, surface.start_angle, caps, finish, there), there)
        case Frustum():
            rim = _rim((surface.radius + surface.end_radius) / 2, d)
            caps = [_cap(rim, radius, 0.0) for radius in (surface.radius, surface.end_radius)]
            return _put(_closed(_cone(surface, None, d), surface.length, surface.start_angle, caps, finish, there), there)
        case CappedTank():
            # a cone has a node at its tip, which eights of columns have
            rim = 8 * max(1, round(2 * np.pi * surface.radius / d / 8)) if surface.cap == "conical" else _rim(surface.radius, d)
            caps = [_head(surface, rim)] * 2
            wall = _wall(surface.radius, surface.length, 0.0, None, d, rim)
            return _put(_closed(wall, surface.length, 0.0, caps, finish, there), there)
    return _put(finish(patch, there), there)


def _along(axis: str, origin: tuple[float, float, float]) -> Place:
    """From z along the axis of a surface, from 0, to the scene."""
    turn = TURN[axis]
    return lambda points, normals: (points[:, turn] + np.asarray(origin), normals[:, turn])


def _stood(frame: np.ndarray, origin: Sequence[float] | np.ndarray) -> Place:
    """From x, y, z along the rows of a frame to the scene."""
    return lambda points, normals: (points @ frame + np.asarray(origin), normals @ frame)


def _then(first: Place, second: Place) -> Place:
    return lambda points, normals: second(*first(points, normals))


def _put(mesh: SurfaceMesh, place: Place) -> SurfaceMesh:
    points, normals = place(mesh.points, mesh.node_normals)
    return SurfaceMesh(points, mesh.cells, mesh.spacing, normals)


def _rim(radius: float, spacing: float) -> int:
    """Columns round a circle: a multiple of 8, which has two planes of symmetry and their bisectors, or of 4 where
    eights are too far apart."""
    around = 2 * np.pi * radius / spacing
    eights = 8 * max(1, round(around / 8))
    return eights if abs(eights / around - 1) < 0.08 else 4 * max(2, round(around / 4))


def _wall(radius: float, length: float, start: float, angle: float | None, spacing: float, columns: int = 0) -> Patch:
    """Cylinder about z from z = 0, counter-clockwise from `start`, whole where `angle` is None [rad]; columns: where they are given."""
    columns = columns or (_rim(radius, spacing) if angle is None else max(1, round(radius * angle / spacing)))
    rows = max(1, round(length / spacing))

    def bend(chart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        phi = start + chart[:, 0] / radius
        normal = np.column_stack([np.cos(phi), np.sin(phi), np.zeros_like(phi)])
        return np.column_stack([radius * normal[:, :2], chart[:, 1]]), normal

    return _strip(radius * (2 * np.pi if angle is None else angle), columns, np.linspace(0, length, rows + 1), angle is None, bend)


def _strip(width: float, columns: int, heights: np.ndarray, whole: bool, bend: Callable) -> Patch:
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


def _sheet(length: float, width: float, spacing: float) -> Patch:
    """Rectangle in z = 0 from the origin."""
    return _flat(length, np.linspace(0, width, max(1, round(width / spacing)) + 1), max(1, round(length / spacing)))


def _flat(length: float, heights: np.ndarray, columns: int) -> Patch:
    def bend(chart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        zero = np.zeros(len(chart))
        return np.column_stack([chart, zero]), np.column_stack([zero, zero, zero + 1])

    return _strip(length, columns, heights, False, bend)


def _cone(surface: Frustum, angle: float | None, spacing: float) -> Patch:
    """Wall of a frustum about z from z = 0. Its chart is as wide as the first end: y grows as ds / r along the slant s."""
    first, mean = surface.radius, (surface.radius + surface.end_radius) / 2
    opening, leaning = (surface.end_radius - first) / surface.slant, surface.length / surface.slant  # sine and cosine
    columns = _rim(mean, spacing) if angle is None else max(1, round(mean * angle / spacing))
    s = np.linspace(0, surface.slant, max(1, round(surface.slant / spacing)) + 1)

    def bend(chart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        s = first * np.expm1(chart[:, 1] * opening / first) / opening
        phi = surface.start_angle + chart[:, 0] / first
        x, y, r = np.cos(phi), np.sin(phi), first + s * opening
        return np.column_stack([r * x, r * y, s * leaning]), np.column_stack([leaning * x, leaning * y, np.full_like(x, -opening)])

    heights = first * np.log1p(s * opening / first) / opening
    return _strip(first * (2 * np.pi if angle is None else angle), columns, heights, angle is None, bend)


def _zone(surface: Sphere, top: float, columns: int | None, spacing: float) -> Patch:
    """Part of a sphere about 0 between two angles from +z, `top` and that of the surface (Mercator's chart)."""
    radius, bottom, angle = surface.radius, surface.bottom, min(surface.angle, 2 * np.pi)
    mean = radius * (np.cos(top) - np.cos(bottom)) / (bottom - top)
    if columns is None:
        columns = _rim(mean, spacing) if surface.whole else max(1, round(mean * angle / spacing))
    rows = max(1, round(radius * (bottom - top) / spacing))

    def bend(chart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        phi, up = surface.start_angle + chart[:, 0] / radius, np.tanh(chart[:, 1] / radius)
        flat = 1 / np.cosh(chart[:, 1] / radius)
        normal = np.column_stack([flat * np.cos(phi), flat * np.sin(phi), up])
        return radius * normal, normal

    heights = radius * np.arctanh(np.cos(np.linspace(bottom, top, rows + 1)))
    return _strip(radius * angle, columns, heights, surface.whole, bend)


def _cap(rim: int, radius: float, half_angle: float) -> Patch:
    """Spherical cap, flat for half_angle = 0, above the circle of `radius` in z = 0, with `rim` nodes on it."""
    xy, quads = ogrid(rim, half_angle)
    curvature = np.sin(half_angle) / radius
    if half_angle > 0:  # arc length from the pole -> stereographic distance
        far = np.linalg.norm(xy, axis=1)
        xy = xy * np.where(far > 0, 2 * np.tan(far * half_angle / 2) / np.where(far > 0, far, 1.0), 0.0)[:, None] / curvature
    else:
        xy = radius * xy

    def bend(chart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        t2 = (0.5 * curvature) ** 2 * np.einsum("ni,ni->n", chart, chart)  # tan^2 of half the angle from the pole
        flat, cosine = chart / (1 + t2)[:, None], (1 - t2) / (1 + t2)
        up = (cosine - np.cos(half_angle)) / curvature if half_angle > 0 else np.zeros(len(chart))
        return np.column_stack([flat, up]), np.column_stack([flat * curvature, cosine])

    return Patch(xy, quads, np.arange(len(xy)) < len(xy) - rim, bend)


def _head(tank: CappedTank, rim: int) -> Patch:
    """A head of a tank over its rim in z = 0."""
    if tank.cap in ("flat", "dome"):
        return _cap(rim, tank.radius, tank.half_angle)
    line = meridian(tank)
    xy, quads = ogrid(rim, bent=(line.arc[-1] / tank.radius, line.width))
    inner = np.arange(len(xy)) < len(xy) - rim
    if tank.cap == "conical":
        inner[np.argmin(np.linalg.norm(xy, axis=1))] = False  # the tip stays where it is
    return Patch(line.laid_out(xy), quads, inner, line.bend)


def _closed(wall_: Patch, length: float, start: float, caps: Sequence[Patch], finish: Finish, there: Place) -> SurfaceMesh:
    """A wall with a cap on each rim, whose nodes they share. There the normal is the mean of the two sides'."""
    wall = finish(wall_, there)
    rim = _columns(wall_)
    n_wall = len(wall.points)
    first = (np.arange(rim) - rim // 8) % rim  # of the rim's nodes of a cap, in the wall's lowest row
    turn = np.array([[np.cos(start), np.sin(start), 0], [-np.sin(start), np.cos(start), 0], [0, 0, 1]])
    points, normals, cells = [wall.points], [wall.node_normals.copy()], [wall.cells]
    for top in (False, True):
        seat = _seated(turn, top, length)
        cap = finish(caps[top], _then(seat, there))
        own = len(cap.points) - rim
        at, normal = seat(cap.points, cap.node_normals)
        cell = cap.cells
        if not top:  # a mirror image, its cells turned round
            cell = _mirrored(cell)
        place = sum(len(p) for p in points)
        number = np.concatenate([place + np.arange(own), first + (n_wall - rim if top else 0), [-1]])
        cells.append(number[cell])
        points.append(at[:own])
        normals.append(normal[:own])
        normals[0][number[own:-1]] += normal[own:]
    normal = np.concatenate(normals)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return _mesh(np.concatenate(points), np.concatenate(cells), normal)


def _columns(wall: Patch) -> int:
    """Nodes in a row of a wall that closes on itself."""
    return int(np.count_nonzero(wall.chart[:, 1] == wall.chart[0, 1]))


def _seated(turn: np.ndarray, top: bool, length: float) -> Place:
    """From a cap on z = 0 to its place on a wall: turned, the lower one mirrored, the upper one lifted."""

    def seat(points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        points, normals = points @ turn, normals @ turn
        if not top:
            points, normals = points * [1, 1, -1], normals * [1, 1, -1]
        return points + [0, 0, length if top else 0], normals

    return seat


def _sphere(surface: Sphere, d: float, finish: Finish, there: Place) -> SurfaceMesh:
    """About 0: two hemispheres, a cap, a zone, a cap on a zone, or a sector."""
    radius, half = surface.radius, np.pi / 2
    if surface.top > 0:
        return finish(_zone(surface, surface.top, None, d), there)
    if not surface.whole:
        return finish(_sector(surface, d), there)
    if surface.bottom <= half * (1 + 1e-9):
        up = _along("z", (0.0, 0.0, radius * np.cos(surface.bottom)))
        circle = radius * np.sin(surface.bottom)
        return _put(finish(_cap(_rim(circle, d), circle, surface.bottom), _then(up, there)), up)
    rim = _rim(radius, d)
    c, s = np.cos(surface.start_angle), np.sin(surface.start_angle)
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    parts = []
    for top in (True, False):
        if top or surface.to_pole:
            seat = _seated(turn, top, 0.0)
            part = _put(finish(_cap(rim, radius, half), _then(seat, there)), seat)
            parts.append(part if top else SurfaceMesh(part.points, _mirrored(part.cells), part.spacing, part.normals))
        else:
            parts.append(finish(_zone(surface, half, rim, d), there))
    return _welded(parts)


def _box(surface: BoxTank, d: float, finish: Finish) -> SurfaceMesh:
    """Its walls, from outside: normals on edges and in corners are the mean of those that meet there."""
    lines = [np.linspace(0, size, max(1, round(size / d)) + 1) for size in surface.size]
    parts = []
    for face in surface.faces:
        across, outward = "xyz".index(face[1]), face[0] == "+"
        one, two = (
            [(1, 2), (2, 0), (0, 1)][across] if outward else [(2, 1), (0, 2), (1, 0)][across]
        )  # from one to two turns about the normal
        frame = np.zeros((3, 3))
        frame[0, one] = frame[1, two] = 1.0
        frame[2, across] = 1.0 if outward else -1.0
        corner = np.zeros(3)
        corner[across] = surface.size[across] if outward else 0.0
        stood = _then(_stood(frame, corner), _along("z", surface.origin))
        parts.append(_put(finish(_flat(surface.size[one], lines[two], len(lines[one]) - 1), stood), stood))
    return _welded(parts)


def _welded(parts: Sequence[SurfaceMesh]) -> SurfaceMesh:
    """Patches whose borders stand on each other as one mesh; there the normal is the mean of theirs."""
    from scipy.spatial import cKDTree

    points = np.concatenate([part.points for part in parts])
    normals = np.concatenate([part.node_normals for part in parts])
    first = np.cumsum([0] + [len(part.points) for part in parts])
    cells = np.concatenate([np.where(part.cells < 0, -1, part.cells + n) for part, n in zip(parts, first)])
    pairs = np.sort(cKDTree(points).query_pairs(1e-6 * parts[0].spacing, output_type="ndarray"), axis=1)
    stands_for = np.arange(len(points))
    np.minimum.at(stands_for, pairs[:, 1], pairs[:, 0])
    total = np.zeros_like(normals)
    np.add.at(total, stands_for, normals)
    kept = stands_for == np.arange(len(points))
    number = np.cumsum(kept) - 1
    normal = total[kept] / np.linalg.norm(total[kept], axis=1)[:, None]
    return _mesh(points[kept], np.where(cells < 0, -1, number[stands_for[cells]]), normal)


def _mirrored(cells: np.ndarray) -> np.ndarray:
    """Cells turned round."""
    return np.where(cells[:, 3:] < 0, cells[:, [0, 2, 1, 3]], cells[:, [0, 3, 2, 1]])


def _sector(surface: Sphere, d: float) -> Patch:
    """Sector of a sphere about 0 that holds the pole: three nets of quadrangles about a node within, in arc length from the pole."""
    radius, angle, reach = surface.radius, surface.angle, surface.bottom
    p = max(1, round(radius * np.sin(reach) * angle / (2 * d)))  # cells on half of its base, and on a straight side as far from the pole
    r = max(1, round(radius * reach / d) - p)  # on the rest of a straight side
    part = p / (p + r)
    a, b = [np.array([np.cos(phi), np.sin(phi)]) for phi in (-angle / 2, angle / 2)]
    centre = np.array([min(part / np.sqrt(np.cos(angle / 2)), 1 - 0.7 * (1 - part)), 0.0])

    def straight(start: np.ndarray, end: np.ndarray, cells: int) -> np.ndarray:
        return start + (end - start) * np.linspace(0, 1, cells + 1)[:, None]

    def arc(start: float, end: float) -> np.ndarray:
        phi = np.linspace(start, end, p + 1)
        return np.column_stack([np.cos(phi), np.sin(phi)])

    pole, q, s, m = np.zeros(2), part * a, part * b, np.array([1.0, 0.0])
    inward = straight(centre, m, r)
    nets = [
        (straight(pole, q, p), straight(s, centre, p), straight(pole, s, p), straight(q, centre, p)),
        (straight(q, a, r), inward, straight(q, centre, p), arc(-angle / 2, 0)),
        (inward, straight(s, b, r), straight(centre, s, p), arc(0, angle / 2)),
    ]
    points, quads, n = [], [], 0
    for lower, upper, left, right in nets:  # sides of each, in u and in v
        net = coons(lower, upper, left, right)
        number = n + np.arange(net.shape[0] * net.shape[1]).reshape(net.shape[:2])
        quads.append(np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4))
        points.append(net.reshape(-1, 2))
        n += number.size
    xy, cells = _one_of_each(np.concatenate(points), np.concatenate(quads), 1e-9)
    far = np.linalg.norm(xy, axis=1)
    chart = xy * np.where(far > 0, 2 * np.tan(far * reach / 2) / np.where(far > 0, far, 1.0), 0.0)[:, None] * radius
    turn = surface.start_angle + angle / 2

    def bend(chart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        t2 = np.einsum("ni,ni->n", chart, chart) / (4 * radius**2)
        x, y = (chart / (1 + t2)[:, None] / radius).T
        normal = np.column_stack([x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn), (1 - t2) / (1 + t2)])
        return radius * normal, normal

    return Patch(chart, cells, _within(cells, len(chart)), bend)


def _one_of_each(points: np.ndarray, cells: np.ndarray, near: float) -> tuple[np.ndarray, np.ndarray]:
    """Points and cells without the points that stand on earlier ones."""
    from scipy.spatial import cKDTree

    pairs = np.sort(cKDTree(points).query_pairs(near, output_type="ndarray"), axis=1)
    stands_for = np.arange(len(points))
    np.minimum.at(stands_for, pairs[:, 1], pairs[:, 0])
    kept = stands_for == np.arange(len(points))
    return points[kept], np.where(cells < 0, -1, (np.cumsum(kept) - 1)[stands_for[cells]])


def _within(quads: np.ndarray, n: int) -> np.ndarray:
    """(n,) bool: nodes that are on no side of a single quadrangle."""
    sides = np.sort(np.stack([quads.ravel(), np.roll(quads, -1, axis=1).ravel()], axis=1), axis=1)
    side, count = np.unique(sides, axis=0, return_counts=True)
    inner = np.ones(n, bool)
    inner[side[count == 1]] = False
    return inner


def _finish(patch: Patch, cells: str, irregularity: float, rng: np.random.Generator, cutter: Cutter, place: Place) -> SurfaceMesh:
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
    return _mesh(points, _rows(connectivity), normals)


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


def _mesh(points: np.ndarray, cells: np.ndarray, normals: np.ndarray) -> SurfaceMesh:
    """With D the side of the square that a node owns on average."""
    cells = cells.astype(np.int32)
    mesh = SurfaceMesh(points, cells, 0.0)
    squares = np.where(mesh.corners == 4, 1.0, 0.5).sum()
    return SurfaceMesh(points, cells, float(np.sqrt(mesh.areas.sum() / squares)), normals)


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
    move = irregularity * spacing[:, None] * rng.uniform(-1, 1, (n, 2)) * patch.inner[:, None]
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


COUNTED = 10**18  # more nodes than this are not told apart


def count(surface: Generated, numerics: Numerics) -> int:
    """Nodes of a generated surface, known before any of them exists; of round ends above a thousand columns to a hundredth, of other
    ends, tapering walls, spheres and boxes by their area."""
    d = numerics.spacing

    def along(length: float) -> float:
        ratio = length / d
        return max(1, round(ratio)) if ratio < COUNTED else float(COUNTED)

    def cap(radius: float, half_angle: float) -> float:
        """Nodes of a round end, its rim included."""
        around = 2 * math.pi * radius / d
        rim = _rim(radius, d) if around < COUNTED else COUNTED
        some = min(rim, 1000)  # rings are as many for each column of the rim, whatever their number
        return (rim // 4 + 1) ** 2 + proportions(some, *of_sphere(half_angle))[0] * rim * (rim / some)

    match surface:
        case Plate():
            nodes = (along(surface.length) + 1) * (along(surface.width) + 1)
        case Disc():
            nodes = cap(surface.radius, 0.0)
        case SpherePatch():
            nodes = cap(surface.radius * math.sin(surface.half_angle), surface.half_angle)
        case Roof():
            nodes = (along(surface.radius * (surface.half_angle - surface.start)) + 1) * (along(surface.length) + 1)
        case Cylinder() if surface.ends == "open" and not surface.whole:
            nodes = (along(surface.radius * surface.angle) + 1) * (along(surface.length) + 1)
        case Frustum() | Sphere() | BoxTank():
            nodes = surface.gross / d / d
        case CappedTank() if surface.cap not in ("flat", "dome"):
            nodes = surface.gross / d / d
        case Cylinder() | CappedTank():
            rim = _rim(surface.radius, d) if 2 * math.pi * surface.radius / d < COUNTED else COUNTED
            nodes = rim * (along(surface.length) + 1)
            if isinstance(surface, CappedTank):
                nodes += 2 * (cap(surface.radius, surface.half_angle) - rim)
            elif surface.ends == "discs":
                nodes += 2 * (cap(surface.radius, 0.0) - rim)
    return int(min(nodes, COUNTED))


_MADE: WeakValueDictionary[Hashable, SurfaceMesh] = WeakValueDictionary()


def mesh_key(shell: Shell, scene: Scene) -> Hashable:
    """What the mesh of a shell follows from."""
    surface = shell.surface
    if isinstance(surface, MeshFile):
        written = surface.path.stat().st_mtime_ns if surface.path.is_file() else 0
        return surface, written, shell.motion == "in_plane", scene.numerics_of(shell).spacing
    n = scene.numerics_of(shell)
    if isinstance(surface, Net):
        return surface, shell.motion == "in_plane"
    return surface, n.spacing, n.cells, n.irregularity, n.seed


def mesh_of(shell: Shell, scene: Scene) -> SurfaceMesh:
    """The mid-surface of a shell, generated or read; refused by its count where it is too large.

    As long as somebody holds a mesh (the plan of a run does), the mesh is not made again.
    """
    key = mesh_key(shell, scene)
    mesh = _MADE.get(key)
    if mesh is None:
        mesh = _MADE[key] = _mesh_of(shell, scene)
    return mesh


def _mesh_of(shell: Shell, scene: Scene) -> SurfaceMesh:
    numerics = scene.numerics_of(shell)
    plane = shell.motion == "in_plane"
    if isinstance(shell.surface, Net):
        return _of_arrays(shell.surface, plane)
    if not isinstance(shell.surface, MeshFile):
        nodes = count(shell.surface, numerics)
        if nodes > MAX_NODES:
            raise SceneError(
                f"numerics.spacing {show(numerics.spacing, 'm')} gives shell '{shell.name}' {nodes:.2g} nodes; at most "
                f"{MAX_NODES / 1e6:g} million are allowed"
            )
        return generate(shell.surface, numerics)
    file = shell.surface
    return read_mesh(
        file.path,
        file.scale,
        plane=plane,
        part=file.part,
        merge=file.merge,
        spacing=numerics.spacing,
        time_limit=file.time_limit,
    )


def _of_arrays(net: Net, plane: bool) -> SurfaceMesh:
    """Checked as what a file says; its points and cells count from 0."""
    points = np.asarray(net.points, dtype=np.float64)
    cells = np.full((len(net.cells), 4), -1, np.int64)
    for row, cell in enumerate(net.cells):
        cells[row, : len(cell)] = cell
    raw = Raw(points, cells, np.arange(len(points)), np.arange(len(cells)), first=0)
    return surface_of("net", raw, plane=plane, merge=net.merge)
