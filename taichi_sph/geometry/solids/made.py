"""The mesh of a solid, generated or read, made once as long as somebody holds it."""

from __future__ import annotations

import math
from collections.abc import Hashable
from typing import Any
from weakref import WeakValueDictionary

import numpy as np

from ...errors import SceneError
from ...scene import Scene
from ...scene.plausible import MAX_NODES
from ...scene.solids import Brick, Cells, Made, Ogive, Rod
from ...scene.surfaces import MeshFile
from ...scene.units import show
from ..meshfile import APART, UNITS
from ..meshfiles import foreign
from ..meshfiles.raw import refused
from .mesh import SolidMesh

FLAT = 1e-2  # of the mean: a Jacobian determinant at a corner that is not above is that of a folded or flat cell
LEAST = 0.5  # of a fine cell: less room than this beyond the fine stretch of a brick gets no cell of its own
MAX_LAYERS = 10_000  # along one axis beyond the fine stretch of a brick
_MADE: WeakValueDictionary[Hashable, SolidMesh] = WeakValueDictionary()


def mesh_key(solid: Any, scene: Scene) -> Hashable:
    """What the mesh of a solid follows from."""
    shape, spacing = solid.shape, scene.numerics_of(solid).spacing
    written = shape.path.stat().st_mtime_ns if isinstance(shape, MeshFile) and shape.path.is_file() else 0
    return shape, written, spacing


def mesh_of(solid: Any, scene: Scene) -> SolidMesh:
    """The mesh of a solid; SceneError where it cannot be used."""
    key = mesh_key(solid, scene)
    mesh = _MADE.get(key)
    if mesh is None:
        mesh = _MADE[key] = _mesh_of(solid, scene.numerics_of(solid).spacing)
    return mesh


def _mesh_of(solid: Any, spacing: float) -> SolidMesh:
    shape = solid.shape
    if isinstance(shape, MeshFile):
        raw = foreign.read_solid(shape.path, shape.time_limit, shape.part)
        return checked(f"mesh {shape.path.name}", shape.scale * raw.points, raw.cells, spacing)
    if isinstance(shape, Cells):
        cells = np.full((len(shape.cells), 8), -1, np.int64)
        for row, cell in enumerate(shape.cells):
            cells[row, : len(cell)] = cell
        return checked(f"cells of solid '{solid.name}'", np.asarray(shape.points, dtype=np.float64), cells, spacing)
    if (nodes := count(shape, spacing)) > MAX_NODES:
        raise SceneError(
            f"numerics.spacing {show(spacing, 'm')} gives solid '{solid.name}' {nodes:.2g} nodes; at most {MAX_NODES / 1e6:g} million "
            "are allowed"
        )
    return brick(shape, spacing, solid.name) if isinstance(shape, Brick) else turned(shape, spacing)


def checked(name: str, points: np.ndarray, cells: np.ndarray, spacing: float | None = None) -> SolidMesh:
    """Nodes that no cell uses are dropped, cells that are inside out are turned, what is folded or flat is refused."""
    if not np.isfinite(points).all():
        raise refused(f"{name}: node {int(np.argmin(np.isfinite(points).all(axis=1)))} has a coordinate that is not a number")
    used = np.zeros(len(points), bool)
    used[cells[cells >= 0]] = True
    cells = np.where(cells >= 0, (np.cumsum(used) - 1)[cells], -1)
    points = points[used]
    twice = np.sort(np.where(cells < 0, -1 - np.arange(8), cells), axis=1)
    if (np.diff(twice, axis=1) == 0).any():
        raise refused(f"{name}: cell {int(np.argmax((np.diff(twice, axis=1) == 0).any(axis=1)))} uses the same node twice")
    mesh = SolidMesh(points, cells.astype(np.int32))
    inverted = mesh.volumes < 0
    notes: tuple[str, ...] = ()
    if inverted.any():
        mended = cells.copy()
        hexa, tetra = inverted & (cells[:, 4] >= 0), inverted & (cells[:, 4] < 0)
        mended[hexa] = cells[hexa][:, [4, 5, 6, 7, 0, 1, 2, 3]]
        mended[tetra, :4] = cells[tetra][:, [0, 2, 1, 3]]
        notes = (f"{int(inverted.sum())} cells were numbered inside out and are turned",)
        mesh = SolidMesh(points, mended.astype(np.int32), notes)
    bad = ~(mesh.straightness > FLAT)
    if bad.any():
        row = int(np.argmax(bad))
        where = ", ".join(f"{x:.4g}" for x in mesh.centres[row])
        raise refused(
            f"{name}: cell {row} at ({where}) m is inverted or flat: its Jacobian determinant at a corner is "
            f"{mesh.straightness[row]:.2g} of the mean one, above {FLAT:g} is needed"
        )
    size = float(np.ptp(points, axis=0).max())
    own = mesh.spacing
    if spacing is not None and not 1 / APART <= own / spacing <= APART:
        unit = next((u for u, f in UNITS.items() if 0.3 < own / spacing * f < 3), None)
        hint = f"is it in {unit}? (scale = {UNITS[unit]:g})" if unit else "numerics.spacing should be about that of the mesh"
        raise refused(f"{name}: spacing {show(own, 'm')} of the mesh against {show(spacing, 'm')} of the numerics: {hint}")
    if not 1e-6 <= size <= 1e4:
        raise refused(f"{name} is {size:.3g} m large; a body is between 1e-6 m and 1e4 m: is it in millimetres (scale = 0.001)?")
    try:
        _ = mesh.faces
    except ValueError as error:
        raise refused(f"{name}: {error}") from None
    return mesh


def count(shape: Made, spacing: float) -> float:
    """Nodes that a shape will have, about."""
    if isinstance(shape, Brick):
        return math.prod(n + 1 for n in _layers(shape, spacing)) if shape.graded is None else math.prod(map(len, _graded(shape, spacing)))
    return shape.volume / spacing**3


def _layers(shape: Brick, spacing: float) -> tuple[int, int, int]:
    x, y, z = shape.layers or tuple(max(1, round(side / spacing)) for side in shape.size)
    return x, y, z


def brick(shape: Brick, spacing: float, name: str = "brick") -> SolidMesh:
    """Nodes in the order of z, then y, then x. `name`: of the solid, for errors."""
    if shape.graded is not None:
        axes = _graded(shape, spacing)
        n = (len(axes[0]) - 1, len(axes[1]) - 1, len(axes[2]) - 1)
    else:
        n = _layers(shape, spacing)
        axes = [np.linspace(0.0, side, k + 1) + start for side, k, start in zip(shape.size, n, shape.origin)]
    z, y, x = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")
    points, cells = np.column_stack([x.ravel(), y.ravel(), z.ravel()]), _lattice(*n)
    return SolidMesh(points, cells) if shape.pilot is None else _bored(shape, points, cells, name)


def _bored(shape: Brick, points: np.ndarray, cells: np.ndarray, name: str) -> SolidMesh:
    """With its pilot hole: squares about the edge become smaller, the first one as wide as the hole. SceneError naming
    the solid where the first cells are no squares, for the hole would be none either."""
    pilot, corner = shape.pilot, np.asarray(shape.origin[:2])
    assert pilot is not None
    across = points[:, :2] - corner
    wide = across.max(axis=1)
    along_x, along_y = (float(column[column > 1e-9 * column.max()].min()) for column in across.T)
    if abs(along_x - along_y) > 1e-6 * along_x:
        raise SceneError(
            f"solid '{name}': pilot: the first cells of the brick must be squares across z; they are {show(along_x, 'm')} along x and "
            f"{show(along_y, 'm')} along y"
        )
    first = np.unique(np.round(wide, 12))[1]
    if not pilot.radius < first < pilot.reach:
        raise SceneError(
            f"solid '{name}': pilot: its radius {show(pilot.radius, 'm')} must be below the first cell of the brick, "
            f"{show(first, 'm')}, and its reach {show(pilot.reach, 'm')} above it"
        )
    drawn = (wide > 0.5 * first) & (wide < pilot.reach)
    now = pilot.radius + (wide - first) * ((pilot.reach - pilot.radius) / (pilot.reach - first))
    points[:, :2] = np.where(drawn[:, None], corner + across * (now / np.where(drawn, wide, 1.0))[:, None], points[:, :2])
    cells = cells[wide[cells].min(axis=1) > 0.5 * first]
    used = np.zeros(len(points), bool)
    used[cells] = True
    return SolidMesh(points[used], (np.cumsum(used) - 1)[cells].astype(np.int32))


def _graded(shape: Brick, spacing: float) -> list[np.ndarray]:
    """Coordinates of the layers of nodes along each axis [m]."""
    graded, found = shape.graded, []
    assert graded is not None
    largest = math.inf if graded.largest is None else graded.largest
    if largest < spacing * (1 - 1e-9):
        raise SceneError(f"graded: largest {show(largest, 'm')} must be at least the spacing, {show(spacing, 'm')}, from which cells grow")
    for start, side, lo, hi in zip(shape.origin, shape.size, graded.lo, graded.hi):
        a, b = start if lo is None else max(lo, start), start + side if hi is None else min(hi, start + side)
        fine = min(max(1, round((b - a) / spacing)), MAX_NODES)
        least = LEAST * (b - a) / fine
        if 0.0 < a - start < least or 0.0 < start + side - b < least:  # no room for a cell: the fine stretch takes it
            a, b = start if a - start < least else a, start + side if start + side - b < least else b
            fine = min(max(1, round((b - a) / spacing)), MAX_NODES)
        below, above = (_growing(room, (b - a) / fine, graded.growth, largest) for room in (a - start, start + side - b))
        found.append(np.concatenate([a - below[:0:-1], np.linspace(a, b, fine + 1), b + above[1:]]))
    return found


def _growing(room: float, first: float, growth: float, largest: float) -> np.ndarray:
    """Coordinates from 0 to `room` [m] of cells that grow from `first`; all a little shorter than that, so that they end there, and none
    shorter than half of `first`. SceneError where they are too many."""
    if room <= 1e-9 * first:
        return np.zeros(1)
    ends, cell = [0.0], min(first * growth, largest)
    while ends[-1] < room * (1 - 1e-9):
        if len(ends) > MAX_LAYERS:
            raise SceneError(
                f"graded: {show(room, 'm')} beyond the fine stretch would be more than {MAX_LAYERS} cells, which start at "
                f"{show(first, 'm')} and grow by {growth:g}: give a larger spacing, growth or largest"
            )
        ends.append(ends[-1] + cell)
        cell = min(cell * growth, largest)
    return np.array(ends) * (room / ends[-1])


def _lattice(nx: int, ny: int, nz: int) -> np.ndarray:
    """(nx ny nz, 8) corners of the cells of a lattice whose nodes count along x first."""
    k, j, i = np.meshgrid(np.arange(nz), np.arange(ny), np.arange(nx), indexing="ij")
    c = ((k * (ny + 1) + j) * (nx + 1) + i).ravel()
    row, layer = nx + 1, (nx + 1) * (ny + 1)
    foot = np.stack([c, c + 1, c + row + 1, c + row], axis=1)
    return np.concatenate([foot, foot + layer], axis=1).astype(np.int32)


def disc(rings: int, half: int, core: float) -> tuple[np.ndarray, np.ndarray]:
    """A unit disc of quadrangles: a core of 2 half x 2 half cells, then rings, the rim with 8 half nodes at equal angles. Returns (N, 2)
    points and (M, 4) corners."""
    side = 2 * half
    s = np.linspace(-1.0, 1.0, side + 1)
    y, x = np.meshgrid(s, s, indexing="ij")
    # the core bulges half way to a circle of its corners
    far = np.maximum(np.abs(x), np.abs(y))
    angle = np.arctan2(y, x)
    square = core * np.stack([x, y], axis=-1)
    round_ = core * 1.2 * far[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    inner = 0.5 * (square + round_)
    points = [inner.reshape(-1, 2)]
    # counter-clockwise from (-1, -1)
    rim = [(0, i) for i in range(side)] + [(j, side) for j in range(side)]
    rim += [(side, i) for i in range(side, 0, -1)] + [(j, 0) for j in range(side, 0, -1)]
    ring = np.array([j * (side + 1) + i for j, i in rim])
    start = points[0][ring]
    turn = 2.0 * np.pi * (np.arange(len(rim)) / len(rim) - 0.375)  # evenly: what touches the rim sees no corners of the core
    edge = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    k = np.arange(side * side)
    corner = (k // side) * (side + 1) + k % side
    cells = [np.stack([corner, corner + 1, corner + side + 2, corner + side + 1], axis=1)]
    last, total, m = ring, (side + 1) ** 2, len(ring)
    for r in range(1, rings + 1):
        share = r / rings
        points.append((1 - share) * start + share * edge)
        now = total + np.arange(m)
        cells.append(np.stack([last, now, np.roll(now, -1), np.roll(last, -1)], axis=1))
        last, total = now, total + m
    return np.concatenate(points), np.concatenate(cells)


def turned(shape: Rod | Ogive, spacing: float) -> SolidMesh:
    """A disc of quadrangles, drawn along the axis."""
    core = shape.core if isinstance(shape, Rod) else 0.45
    half = max(1, round(core * shape.radius / spacing))
    rings = max(1, round((1 - core * 1.1) * shape.radius / spacing))
    flat, quads = disc(rings, half, core)
    p = flat[quads]
    one, two = p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]
    area = 0.5 * (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]).sum()
    flat *= math.sqrt(math.pi / area)  # the polygon is as large as the circle
    total = shape.length if isinstance(shape, Rod) else shape.length + shape.nose
    layers = max(1, round(total / spacing))
    along = np.linspace(0.0, total, layers + 1)
    wide = np.array([shape.radius if isinstance(shape, Rod) else shape.wide(a) for a in along])
    up = along if isinstance(shape, Rod) or not shape.turned else -along
    n = len(flat)
    points = np.concatenate([np.column_stack([w * flat, np.full(n, z)]) for w, z in zip(wide, up)])
    below = np.concatenate([quads + k * n for k in range(layers)])
    above = below + n
    cells = np.concatenate([below, above] if up[-1] > 0 else [above, below], axis=1).astype(np.int32)
    order = {"z": (0, 1, 2), "x": (2, 0, 1), "y": (1, 2, 0)}[shape.axis]
    return SolidMesh(points[:, order] + np.asarray(shape.origin), cells)
