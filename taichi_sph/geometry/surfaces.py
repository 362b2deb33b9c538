"""Meshes of the surfaces that a scene names by their dimensions, with exact normals. NumPy only.

A surface is one patch or three (wall and two ends). A patch is a net of quadrangles in a plane chart, and the map that bends the chart into
space. Nodes are moved at random, and triangulated anew, in the chart, so they stay in the surface. Charts keep angles (unrolled wall,
stereographic cap), so Delaunay's triangles in a chart are those of the surface.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from weakref import WeakValueDictionary

import numpy as np

from ..errors import SceneError
from ..scene import Numerics, Scene, Shell
from ..scene.plausible import MAX_NODES
from ..scene.surfaces import CappedTank, Cylinder, Disc, Generated, MeshFile, Plate, Roof, SpherePatch
from ..scene.units import show
from .mesh import SurfaceMesh, delaunay, plate
from .meshfile import read_mesh
from .ogrid import ogrid, proportions

TURN = {"x": [2, 0, 1], "y": [1, 2, 0], "z": [0, 1, 2]}  # local (x, y, z), z along the axis, to the scene's
SHARPEST = 0.2  # smallest sine at a corner of a quadrangle that random moves may leave


@dataclass(frozen=True)
class Patch:
    """chart (N, 2) [m], quads (M, 4) counter-clockwise in it, inner (N,) nodes off the border, bend: chart ->
    points (N, 3), unit normals (N, 3); period: columns and width [m] of a chart that closes on itself in x."""

    chart: np.ndarray
    quads: np.ndarray
    inner: np.ndarray
    bend: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
    period: float | None = None


def generate(surface: Generated, numerics: Numerics) -> SurfaceMesh:
    """The mesh of any generated surface with the spacing, cells and irregularity of `numerics`."""
    d, cells, irregularity, seed = numerics.spacing, numerics.cells, numerics.irregularity, numerics.seed
    rng = np.random.default_rng(seed)

    def finish(patch: Patch) -> SurfaceMesh:
        return _finish(patch, cells, irregularity, rng)

    match surface:
        case Plate():
            return plate(surface.length, surface.width, d, cells, irregularity, seed, surface.origin)
        case Disc():
            mesh = finish(_cap(_rim(surface.radius, d), surface.radius, 0.0))
        case SpherePatch():
            radius = surface.radius * np.sin(surface.half_angle)
            mesh = finish(_cap(_rim(radius, d), radius, surface.half_angle))
            mesh = _moved(mesh, (0.0, 0.0, surface.radius * np.cos(surface.half_angle)))
        case Roof():
            # the axis along x has local x along y and local y along z: the crown stands at 90 deg
            start, angle = np.pi / 2 - surface.half_angle, surface.half_angle - surface.start
            mesh = _turned(finish(_wall(surface.radius, surface.length, start, angle, d)), "x")
        case Cylinder() if surface.ends == "open":
            part = None if surface.whole else surface.angle
            mesh = _turned(finish(_wall(surface.radius, surface.length, surface.start_angle, part, d)), surface.axis)
        case Cylinder() | CappedTank():
            half_angle = surface.half_angle if isinstance(surface, CappedTank) else 0.0
            start = surface.start_angle if isinstance(surface, Cylinder) else 0.0
            mesh = _turned(_closed(surface.radius, surface.length, start, half_angle, d, finish), surface.axis)
    return _moved(mesh, surface.origin)


def _rim(radius: float, spacing: float) -> int:
    """Columns round a circle: a multiple of 8, which has two planes of symmetry and their bisectors, or of 4 where
    eights are too far apart."""
    around = 2 * np.pi * radius / spacing
    eights = 8 * max(1, round(around / 8))
    return eights if abs(eights / around - 1) < 0.08 else 4 * max(2, round(around / 4))


def _wall(radius: float, length: float, start: float, angle: float | None, spacing: float) -> Patch:
    """Cylinder about z from z = 0, counter-clockwise from `start`, whole where `angle` is None [rad]."""
    columns = _rim(radius, spacing) if angle is None else max(1, round(radius * angle / spacing))
    rows = max(1, round(length / spacing))
    width = radius * (2 * np.pi if angle is None else angle)
    along = columns if angle is None else columns + 1  # nodes in a row
    x, z = np.meshgrid(width * np.arange(along) / columns, np.linspace(0, length, rows + 1))
    number = np.arange(x.size).reshape(x.shape)
    after = np.roll(number, -1, axis=1) if angle is None else number[:, 1:]
    number_ = number if angle is None else number[:, :-1]
    quads = np.stack([number_[:-1], after[:-1], after[1:], number_[1:]], axis=-1).reshape(-1, 4)
    inner = (number >= along) & (number < rows * along)
    if angle is not None:
        inner[:, [0, -1]] = False

    def bend(chart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        phi = start + chart[:, 0] / radius
        normal = np.column_stack([np.cos(phi), np.sin(phi), np.zeros_like(phi)])
        return np.column_stack([radius * normal[:, :2], chart[:, 1]]), normal

    chart = np.column_stack([x.ravel(), z.ravel()])
    return Patch(chart, quads, inner.ravel(), bend, width if angle is None else None)


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


def _closed(
    radius: float, length: float, start: float, half_angle: float, spacing: float, finish: Callable[[Patch], SurfaceMesh]
) -> SurfaceMesh:
    """A wall with a cap on each rim, whose nodes they share. There the normal is the mean of the two sides'."""
    wall = finish(_wall(radius, length, start, None, spacing))
    rim = _rim(radius, spacing)
    n_wall = len(wall.points)
    first = (np.arange(rim) - rim // 8) % rim  # of the rim's nodes of a cap, in the wall's lowest row
    turn = np.array([[np.cos(start), np.sin(start), 0], [-np.sin(start), np.cos(start), 0], [0, 0, 1]])
    points, normals, cells = [wall.points], [wall.node_normals.copy()], [wall.cells]
    for top in (False, True):
        cap = finish(_cap(rim, radius, half_angle))
        own = len(cap.points) - rim
        at, normal, cell = cap.points @ turn, cap.node_normals @ turn, cap.cells
        if not top:  # a mirror image, its cells turned round
            at, normal = at * [1, 1, -1], normal * [1, 1, -1]
            cell = np.where(cell[:, 3:] < 0, cell[:, [0, 2, 1, 3]], cell[:, [0, 3, 2, 1]])
        place = sum(len(p) for p in points)
        number = np.concatenate([place + np.arange(own), first + (n_wall - rim if top else 0), [-1]])
        cells.append(number[cell])
        points.append(at[:own] + [0, 0, length if top else 0])
        normals.append(normal[:own])
        normals[0][number[own:-1]] += normal[own:]
    normal = np.concatenate(normals)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return _mesh(np.concatenate(points), np.concatenate(cells), normal)


def _finish(patch: Patch, cells: str, irregularity: float, rng: np.random.Generator) -> SurfaceMesh:
    """Moves the inner nodes, cuts the quadrangles if triangles are asked for, bends the chart."""
    chart, quads = patch.chart, patch.quads
    if irregularity > 0:
        chart = _shaken(patch, irregularity, rng)
    if cells == "quad":
        connectivity = quads
    elif irregularity > 0 and patch.inner.any():
        connectivity = delaunay(chart) if patch.period is None else _delaunay_round(chart, patch.period)
    else:
        connectivity = _halved(patch)
    full = np.full((len(connectivity), 4), -1, np.int32)
    full[:, : connectivity.shape[1]] = connectivity
    points, normals = patch.bend(chart)
    return _mesh(points, full, normals)


def _mesh(points: np.ndarray, cells: np.ndarray, normals: np.ndarray) -> SurfaceMesh:
    """With D the side of the square that a node owns on average."""
    cells = cells.astype(np.int32)
    mesh = SurfaceMesh(points, cells, 0.0)
    squares = np.where(mesh.corners == 4, 1.0, 0.5).sum()
    return SurfaceMesh(points, cells, float(np.sqrt(mesh.areas.sum() / squares)), normals)


def _sides(chart: np.ndarray, quads: np.ndarray, period: float | None) -> np.ndarray:
    """(M, 4, 2) vectors along the sides of the quadrangles, the short way round."""
    p = chart[quads]
    side = np.roll(p, -1, axis=1) - p
    if period is not None:
        side[..., 0] -= period * np.round(side[..., 0] / period)
    return side


def _shaken(patch: Patch, irregularity: float, rng: np.random.Generator) -> np.ndarray:
    """The chart with its inner nodes moved by up to `irregularity` local spacings in each direction; less where a
    quadrangle would lose its convexity."""
    side = _sides(patch.chart, patch.quads, patch.period)
    area = 0.5 * _cross(side[:, 0] + side[:, 1], side[:, 1] + side[:, 2])
    node = patch.quads.ravel()
    n = len(patch.chart)
    spacing = np.sqrt(np.bincount(node, np.repeat(area, 4), minlength=n) / np.bincount(node, minlength=n))
    move = irregularity * spacing[:, None] * rng.uniform(-1, 1, (n, 2)) * patch.inner[:, None]
    sharpest = np.minimum(SHARPEST, 0.9 * _sines(side).min())
    while True:
        chart = patch.chart + move
        bad = (_sines(_sides(chart, patch.quads, patch.period)) < sharpest).any(axis=1)
        if not bad.any():
            return chart
        move[np.unique(patch.quads[bad])] *= 0.8


def _sines(side: np.ndarray) -> np.ndarray:
    """(M, 4) sine of the angle at each corner, negative where the quadrangle is folded in."""
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
    n = len(patch.chart)
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


def _turned(mesh: SurfaceMesh, axis: str) -> SurfaceMesh:
    turn = TURN[axis]
    return SurfaceMesh(mesh.points[:, turn], mesh.cells, mesh.spacing, mesh.node_normals[:, turn])


def _moved(mesh: SurfaceMesh, by: tuple[float, float, float]) -> SurfaceMesh:
    return SurfaceMesh(mesh.points + np.asarray(by), mesh.cells, mesh.spacing, mesh.normals)


COUNTED = 10**18  # more nodes than this are not told apart


def count(surface: Generated, numerics: Numerics) -> int:
    """Nodes of a generated surface, known before any of them exists; of round ends above a thousand columns to a hundredth."""
    d = numerics.spacing

    def along(length: float) -> float:
        ratio = length / d
        return max(1, round(ratio)) if ratio < COUNTED else float(COUNTED)

    def cap(radius: float, half_angle: float) -> float:
        """Nodes of a round end, its rim included."""
        around = 2 * math.pi * radius / d
        rim = _rim(radius, d) if around < COUNTED else COUNTED
        some = min(rim, 1000)  # rings are as many for each column of the rim, whatever their number
        return (rim // 4 + 1) ** 2 + proportions(some, half_angle)[0] * rim * (rim / some)

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
        plane=shell.motion == "in_plane",
        part=file.part,
        merge=file.merge,
        spacing=numerics.spacing,
        time_limit=file.time_limit,
    )
