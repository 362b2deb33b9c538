"""Where the particles of a fluid stand at the start: a cubic lattice in a box or in a closed shell. NumPy only.

In a shell the lattice is centred on the axis of the fill; its layers fit the level. The lowest layer stands e/2 and the distance of
CONTACT above the bottom. That distance, from the surface of the wall, is also what every particle should have from every wall.

A lattice point is kept when it lies inside the shell (a ray along the axis crosses the surface an odd number of times above the point) and
lacks no more than D/2 of that distance. Kept points that lack some of it are moved away from the wall until they have it. So a round wall
leaves as much of its lattice out as in: the water is neither packed nor loose, and keeps its level when it settles. The volume is the
true one: mass = rho_0 volume / N, and D_0 = (volume / N)^(1/3).

Other shells that the fluid meets (baffles) are walls with water on both sides: the particles keep off them as well.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from weakref import WeakValueDictionary

import numpy as np
from scipy.spatial import cKDTree

from ...errors import SceneError
from ...geometry.holes import lids, rims
from ...geometry.mesh import SurfaceMesh
from ...geometry.near import away_from, moved_off, triangles_of
from ...geometry.regions import inside
from ...geometry.surfaces import mesh_key
from ...scene.plausible import MAX_NODES
from ...scene.schema import Scene
from ...scene.surfaces import CappedTank, Cylinder, Shaped, Surface
from ..shell.sections import sheets_of
from .said import Finer, Fluid, FluidBox, FluidRound

AXES = {"x": 0, "y": 1, "z": 2}
CONTACT = {None: 0.5, "pinballs": 0.74}  # of D_0: where a particle stands at a sound shell (docs/method.md)
PINBALL = 0.25  # of D_0: its radius where pressure carries the fluid: contact stands behind it (couplings/wetted)
PITCHES = tuple(1 + 0.01 * k for k in (0, -1, 1, -2, 2, -3, 3, -4, 4, -5, 5))  # of D: tried until the lattice holds what it should
ENOUGH, FEW = 0.01, 20_000  # ... to this; above so many particles a row of them does not matter
CLOSER = 1e-6  # of D: nearer to a wall than this below its distance is rounding
NEAREST = 0.3  # of D_0: how near to the surface of a wall a particle may come when a filling is evened out: outside PINBALL


@dataclass(frozen=True)
class Filling:
    """points (N, 3) [m]; volume [m3] that they stand for; spacing D_0 [m]; lattice [m]; mass of one [kg]; walls (T, 3, 3) [m], the
    triangles of the shells around and inside; half (T,) [m] their thickness; split (N,): into how many along each axis the whole particle
    was split that each comes from, None: all are whole. Spacing and mass are those of whole ones."""

    points: np.ndarray
    volume: float
    lattice: float
    density: float
    walls: np.ndarray = field(default_factory=lambda: np.zeros((0, 3, 3)))
    half: np.ndarray = field(default_factory=lambda: np.zeros(0))
    split: np.ndarray | None = None

    @property
    def whole(self) -> float:
        """How many there would be if none were split."""
        return len(self.points) if self.split is None else float((1.0 / self.parts**3).sum())

    @property
    def parts(self) -> np.ndarray:
        """(N,) `split`, of ones where it is None."""
        return np.ones(len(self.points), np.int64) if self.split is None else self.split

    @property
    def spacing(self) -> float:
        return float(np.cbrt(self.volume / self.whole))

    @property
    def finest(self) -> float:
        """The least D_0 [m]."""
        return self.spacing / int(self.parts.max())

    @property
    def mass(self) -> float:
        return self.density * self.volume / self.whole

    def kept_off(self, points: np.ndarray) -> np.ndarray:
        """The points of the filling at places (N, 3) to which they were moved: those nearer to a wall than NEAREST moved off it, those
        beyond it where they were. Between the nodes of a shell that is coarser than the water the pressure that evens a filling out is
        low, in corners most of all."""
        if not len(self.walls):
            return points
        reach = self.spacing + self.half.max()
        now, before = (away_from(x, self.walls, reach)[0] for x in (points, self.points))
        near = np.isfinite(now).all(axis=1) & np.isfinite(before).all(axis=1)
        turned = (now[near] * before[near]).sum(axis=1) / np.prod(
            [np.maximum(np.linalg.norm(x[near], axis=1), 1e-100) for x in (now, before)], axis=0
        )
        beyond = np.flatnonzero(near)[turned < -0.5]
        points = points.copy()
        points[beyond] = self.points[beyond]
        return moved_off(points, self.walls, self.half, NEAREST * self.finest)

    @property
    def sentence(self) -> str:
        """For the log: how many, and what the lattice left out."""
        taken = self.whole * self.lattice**3 / self.volume
        sizes, counts = np.unique(self.parts, return_counts=True)
        of = ", ".join(f"{n} of {1e3 * self.spacing / k:.4g} mm" for k, n in zip(sizes.tolist(), counts.tolist()))
        return (
            f"{len(self.points)} particles of {1e3 * self.spacing:.4g} mm" if len(sizes) == 1 else f"{len(self.points)} particles, {of}"
        ) + f", {self.density * self.volume:.6g} kg; the lattice alone would hold {100 * taken:.2f} % of that"


_MADE: WeakValueDictionary[Hashable, Filling] = WeakValueDictionary()


def fill_fluid(fluid: Fluid, scene: Scene, meshes: Mapping[str, SurfaceMesh]) -> Filling:
    """The particles of a fluid of a scene; meshes: of its shells. As long as somebody holds the filling (the plan of a run does), it is
    not made again."""
    spacing, name = scene.numerics_of(fluid).spacing, getattr(fluid.fill, "shell", None)
    if name is None:
        return fill(fluid, spacing)
    shell = next((s for s in scene.shells if s.name == name), None)
    baffles = [s for s in scene.shells if s is not shell and scene.met(fluid.name, s.name).meet and _beside(meshes[s.name], meshes[name])]
    tank = scene.body(name)
    walls = tuple((getattr(s, "thickness", 0.0), getattr(s, "sections", ()), mesh_key(s, scene)) for s in (tank, *baffles))
    key = (fluid.fill, fluid.water.density, fluid.contact, spacing, fluid.finer, walls)
    found = _MADE.get(key)
    if found is None:
        within = [(meshes[s.name], sheets_of(s, meshes[s.name]).thickness) for s in baffles]
        thickness = 0.0 if shell is None else sheets_of(shell, meshes[name]).thickness  # a rigid tank has the surface that is met
        found = _MADE[key] = fill(fluid, spacing, meshes[name], thickness, tank.surface, within)
    return found


def _beside(one: SurfaceMesh, other: SurfaceMesh) -> bool:
    """Whether the boxes around two meshes have a place in common."""
    low, high = (np.array([getattr(mesh.points, end)(axis=0) for mesh in (one, other)]) for end in ("min", "max"))
    return bool((low.max(axis=0) <= high.min(axis=0)).all())


def fill(
    fluid: Fluid,
    spacing: float,
    mesh: SurfaceMesh | None = None,
    thickness: float | np.ndarray = 0.0,
    surface: Surface | None = None,
    baffles: Sequence[tuple[SurfaceMesh, float | np.ndarray]] = (),
) -> Filling:
    """As `_whole`, with the particles split that are to be finer."""
    filling = _whole(fluid, spacing, mesh, thickness, surface, baffles)
    for number, finer in enumerate(fluid.finer or ()):
        filling = _split(filling, finer, CONTACT[fluid.contact], f"fluid '{fluid.name}': finer[{number}]")
    _check_jumps(filling, f"fluid '{fluid.name}': finer")
    return filling


def _check_jumps(filling: Filling, what: str) -> None:
    """SceneError where neighbours differ by more than two to one."""
    parts = filling.parts
    for part in np.unique(parts):
        small, large = filling.points[parts >= 4 * part], filling.points[parts == part]
        d = filling.spacing / part
        if len(small) and len(large) and cKDTree(small).query(large, distance_upper_bound=d)[0].min() < d:
            raise SceneError(
                f"{what}: particles of {0.25 * d:.4g} m or less stand beside some of {d:.4g} m, and waves come back from a jump of 4 to 1;"
                f" keep each region at least {1.5 * d:.4g} m inside the one that it refines"
            )


def _split(filling: Filling, finer: Finer, clear: float, what: str) -> Filling:
    """Each particle that lies there becomes eight: a cube of its own volume, `clear` of their spacing off all walls."""
    caught = inside(finer.within, filling.points)
    if not caught.any():
        low, high = filling.points.min(axis=0), filling.points.max(axis=0)
        raise SceneError(
            f"{what}.within holds none of its particles, which stand from ({low[0]:.4g}, {low[1]:.4g}, {low[2]:.4g}) m to"
            f" ({high[0]:.4g}, {high[1]:.4g}, {high[2]:.4g}) m"
        )
    parts, count = filling.parts, np.where(caught, 8, 1)
    if count.sum() > MAX_NODES:
        raise SceneError(
            f"{what} gives {count.sum():.2g} particles; at most {MAX_NODES / 1e6:g} million are allowed: make the region smaller"
        )
    cube = np.stack(np.meshgrid(*3 * [(-0.25, 0.25)], indexing="ij"), axis=-1).reshape(-1, 3)
    points, parts = np.repeat(filling.points, count, axis=0), np.repeat(parts, count)
    of_split = np.repeat(caught, count)
    whole = points[of_split]
    aside = np.tile(cube, (int(caught.sum()), 1)) * (filling.spacing / parts[of_split])[:, None]
    parts[of_split] *= 2
    points[of_split] = whole + aside
    if len(filling.walls):
        for part in np.unique(parts[of_split]):
            own = parts[of_split] == part
            now = _beside_walls(filling, whole[own], aside[own], clear * filling.spacing / part)
            if now is None:
                raise SceneError(f"{what}: particles of {filling.spacing / part:.4g} m come to lie behind a wall; make its region smaller")
            points[np.flatnonzero(of_split)[own]] = now
    return replace(filling, points=points, split=parts)


def _beside_walls(filling: Filling, whole: np.ndarray, aside: np.ndarray, clear: float) -> np.ndarray | None:
    """(N, 3) places `aside` from those of whole particles [m], `clear` off the walls where there is room, and in any case on the side where
    the whole one is; None where that cannot be."""
    reach = 2.0 * filling.spacing + filling.half.max()

    def behind(points: np.ndarray) -> np.ndarray:
        """(N,) bool: the wall nearest to a place lies between it and the whole particle."""
        away = away_from(points, filling.walls, reach)[0]
        near = np.isfinite(away).all(axis=1)
        found = np.zeros(len(points), bool)
        found[near] = ((whole - points + away)[near] * away[near]).sum(axis=1) < 0.0
        return found

    found = moved_off(whole + aside, filling.walls, filling.half, clear)
    for share in (1.0, 0.5, 0.25):
        lost = behind(found)
        if not lost.any():
            return found
        found[lost] = whole[lost] + share * aside[lost]
    return None if behind(found).any() else found


def _whole(
    fluid: Fluid,
    spacing: float,
    mesh: SurfaceMesh | None = None,
    thickness: float | np.ndarray = 0.0,
    surface: Surface | None = None,
    baffles: Sequence[tuple[SurfaceMesh, float | np.ndarray]] = (),
) -> Filling:
    """The particles of a fluid. mesh, thickness of its cells [m], surface: of the shell that it fills (surface: as the scene has it);
    baffles: meshes and thicknesses of what stands inside."""
    d = fluid.spacing or spacing
    if isinstance(fluid.fill, FluidBox):
        lo, hi = np.array(fluid.fill.lo), np.array(fluid.fill.hi)
        n = np.maximum(1, np.round((hi - lo) / d).astype(int))
        return Filling(_lattice(lo + 0.5 * (hi - lo) / n, (hi - lo) / n, n), fluid.fill.volume, d, fluid.water.density)
    if isinstance(fluid.fill, FluidRound):
        return Filling(_rings(fluid.fill, d), fluid.fill.volume, d, fluid.water.density)
    assert mesh is not None, "what fills a shell needs its mesh"
    if (mesh.edges.sides[:, 1] < 0).any():
        _check_lids(fluid, mesh, surface)
    filled = fluid.fill
    axis = AXES[filled.axis]
    turn = [(axis + 1) % 3, (axis + 2) % 3, axis]
    covers, even = lids(mesh), bool(np.ptp(thickness) == 0)
    triangles = np.concatenate([triangles_of(mesh), covers])[:, :, turn]
    half = _halves(mesh, thickness)
    half = np.append(half, np.full(len(covers), half.mean()))
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    edge = 1e-9 * (high[2] - low[2])
    upper, lower = half[triangles[:, :, 2].max(axis=1) >= high[2] - edge].max(), half[triangles[:, :, 2].min(axis=1) <= low[2] + edge].max()
    top = high[2] - upper
    level = top if fluid.fill.level is None else fluid.fill.level
    if level > top * (1 + 1e-9) + 1e-9 * d or level <= low[2] + lower:
        raise SceneError(
            f"fluid '{fluid.name}': level {level:g} m lies outside the shell '{fluid.fill.shell}', whose inside reaches"
            f" from {low[2] + lower:g} to {top:g} m along {fluid.fill.axis}"
        )
    above = fluid.fill.above
    if above is not None and not low[2] + lower < above < level:
        raise SceneError(
            f"fluid '{fluid.name}': above {above:g} m does not lie between the bottom of the shell '{fluid.fill.shell}',"
            f" {low[2] + lower:g} m, and the level, {level:g} m, along {fluid.fill.axis}"
        )

    def up_to(height: float) -> float:
        found = _revolved(surface if even else None, 2.0 * float(half[0]), filled.axis, height)
        return _measured(triangles, half, upper, height, d) if found is None else found

    def wet(places: np.ndarray) -> np.ndarray:
        return places < level if above is None else (places < level) & (places > above)

    volume = up_to(level) if above is None else up_to(level) - up_to(above)
    bare = _area(triangles[wet(triangles[:, :, 2].mean(axis=1))])
    walls, thin = triangles, float(half.min())
    for baffle, e in baffles:
        sides = triangles_of(baffle)[:, :, turn]
        middle = sides.mean(axis=1)
        own, there = _halves(baffle, e), wet(middle[:, 2]) & _inside(middle, triangles)
        volume, bare = volume - 2.0 * _under(sides[there], own[there]), bare + 2.0 * _area(sides[there])
        rim, rim_half = _rim(baffle, e)
        walls, half = np.concatenate([walls, sides, rim[:, :, turn]]), np.concatenate([half, own, rim_half])
    clear = CONTACT[fluid.contact]
    wanted = max(volume - (clear - 0.5) * d * bare, min(d, 1e50) ** 3)
    best = np.inf
    for pitch in PITCHES:
        there, cell = _lattice_in(triangles, walls, half, (lower, thin), d * pitch, level, clear, above)
        found = abs(len(there) * cell / wanted - 1)
        if found < best:
            points, lattice, best = there, float(np.cbrt(cell)), found
        if best < ENOUGH or volume > FEW * d**3:
            break
    if len(points) == 0:
        raise SceneError(f"fluid '{fluid.name}': no particle of {d:g} m fits into the shell '{fluid.fill.shell}'; lower its spacing")
    back = np.argsort(turn)
    return Filling(points[:, back], volume, lattice, fluid.water.density, walls[:, :, back], half)


def _check_lids(fluid: Fluid, mesh: SurfaceMesh, surface: Surface | None) -> None:
    """SceneError where the openings of a shell have no plane lids that would close it, or its normals point inward."""
    name = getattr(fluid.fill, "shell", "")
    if isinstance(surface, Shaped):
        if not surface.holds:
            raise SceneError(f"fluid '{fluid.name}': shell '{name}' is open, so it has no inside to fill; close it")
        return
    for rim, normal in rims(mesh):
        if np.ptp(rim @ normal) > 0.05 * np.ptp(rim, axis=0).max():
            raise SceneError(
                f"fluid '{fluid.name}': shell '{name}' is open and an opening is not plane, so it has no inside to fill; close it"
            )
    if mesh.volume < 0:
        raise SceneError(
            f"fluid '{fluid.name}': the normals of shell '{name}' point inward; turn its cells round, so that they point outward"
        )


def _halves(mesh: SurfaceMesh, thickness: float | np.ndarray) -> np.ndarray:
    """(T,) half the thickness of the triangles of a mesh [m]."""
    each = 0.5 * np.broadcast_to(thickness, len(mesh.cells))
    return np.append(each, each[mesh.cells[:, 3] >= 0])


def _rim(mesh: SurfaceMesh, thickness: float | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(T, 3, 3) triangles beyond the free rim of a baffle, as far as its discs reach there (couplings/contact), half a spacing, and (T,)
    half their thickness [m]: no particle may start in them."""
    open_ = np.flatnonzero(mesh.edges.sides[:, 1] < 0)
    ends, cell = mesh.edges.nodes[open_], mesh.edges.sides[open_, 0] // 4
    a, b = mesh.points[ends[:, 0]], mesh.points[ends[:, 1]]
    along = (b - a) / np.linalg.norm(b - a, axis=1)[:, None]
    out = 0.5 * (a + b) - mesh.centres[cell]
    out -= np.einsum("ni,ni->n", out, along)[:, None] * along
    out *= (0.5 * mesh.node_spacing[ends].mean(axis=1) / np.linalg.norm(out, axis=1))[:, None]
    each = 0.5 * np.broadcast_to(thickness, len(mesh.cells))[cell]
    return np.concatenate([np.stack([a, b, b + out], axis=1), np.stack([a, b + out, a + out], axis=1)]), np.concatenate([each, each])


def _lattice_in(
    triangles: np.ndarray,
    walls: np.ndarray,
    half: np.ndarray,
    least_half: tuple[float, float],
    d: float,
    level: float,
    clear: float,
    above: float | None,
) -> tuple[np.ndarray, float]:
    """The points of a lattice of spacing d (upright: what fits the level) in a closed surface, `clear` d off all walls, and the volume of
    its cell [m3]. above [m]: where another fluid ends, on which the lattice stands. walls (T, 3, 3): the triangles of the surface, then
    those of baffles; half (T,) [m]: half the thickness of each; least_half [m]: that of the bottom, and of the thinnest wall."""
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    bottom, thin = least_half
    margin = clear * d + bottom
    least = max((clear - 0.5) * d + thin, thin)  # on a round wall
    fits = 1e-6 if thin > 0 else -1e-6  # none stands on a wall without thickness
    n = np.floor((high - low - 2 * least) / d + 1 + fits).astype(int)
    lowest = low[2] + margin if above is None else above + 0.5 * d
    room = level - 0.5 * d - low[2] - margin if above is None else level - 0.5 * d - lowest  # between the lowest and the highest layer
    n[2] = int(np.round(room / d)) + 1
    if (n < 1).any() or room < -1e-6 * d:
        return np.zeros((0, 3)), min(d, 1e50) ** 3
    step = np.array([d, d, room / (n[2] - 1) if n[2] > 1 else d])
    first = np.append(0.5 * (low + high - (n - 1) * d)[:2], lowest)
    points = _lattice(first, step, n)
    points = points[_inside(points, triangles)]
    away, wall = away_from(points, walls, clear * d + half.max())
    keep = np.linalg.norm(away, axis=1) > max(clear - 0.5, 0.0) * d + half[wall] - CLOSER * d
    return moved_off(points[keep], walls, half, clear * d), float(step.prod())


def _area(triangles: np.ndarray) -> float:
    """[m2]"""
    return float(_areas(triangles).sum())


def _under(triangles: np.ndarray, half: np.ndarray) -> float:
    """What half the thickness of each triangle takes [m3]."""
    even = len(half) == 0 or bool((half == half[0]).all())
    return float(half[0]) * _area(triangles) if even and len(half) else float(_areas(triangles) @ half)


def _areas(triangles: np.ndarray) -> np.ndarray:
    """(T,) [m2]"""
    return 0.5 * np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)


def _lattice(first: np.ndarray, step: np.ndarray, n: np.ndarray) -> np.ndarray:
    """(N, 3) points first + step * k, the last axis slowest."""
    z, y, x = np.meshgrid(*(np.arange(k) for k in n[::-1]), indexing="ij")
    return first + step * np.column_stack([x.ravel(), y.ravel(), z.ravel()])


def _rings(filled: FluidRound, d: float) -> np.ndarray:
    """(N, 3) rings of particles about an axis, each particle with the same volume; the first ones stand d/2 off the walls."""
    columns = []
    for radius, low, high in filled.columns:
        layers, rings = max(1, round((high - low) / d)), max(1, round(radius / d))
        quarter = max(1, round(0.25 * np.pi * (radius / d) ** 2))  # of a layer
        within = np.maximum(np.round(quarter * ((np.arange(rings + 1)) / rings) ** 2), np.arange(rings + 1)).astype(int)
        edges = radius * np.sqrt(within / within[-1])
        plane = []
        for inner, outer, n in zip(edges, edges[1:], np.diff(within)):
            turn = 0.5 * np.pi * (np.arange(filled.quarters * n) + 0.5) / n
            plane.append(0.5 * (inner + outer) * np.column_stack([np.cos(turn), np.sin(turn)]))
        across = np.concatenate(plane) + np.array(filled.at)
        z = low + (high - low) * (np.arange(layers) + 0.5) / layers
        columns.append(np.column_stack([np.tile(across, (layers, 1)), np.repeat(z, len(across))]))
    return np.concatenate(columns)


def _crossings(xy: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where vertical lines through xy (C, 2) cross the triangles: number of the line, height [m]."""
    order = np.argsort(xy[:, 0], kind="stable")
    x = xy[order, 0]
    lo, hi = triangles[:, :, :2].min(axis=1), triangles[:, :, :2].max(axis=1)
    start, stop = np.searchsorted(x, lo[:, 0]), np.searchsorted(x, hi[:, 0], side="right")
    lines, heights = [np.zeros(0, int)], [np.zeros(0)]
    for part in np.array_split(np.arange(len(triangles)), max(1, int((stop - start).sum() // 4_000_000) + 1)):
        count = (stop - start)[part]
        t = np.repeat(part, count)
        line = order[np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + np.repeat(start[part], count)]
        p = xy[line]
        near = (p[:, 1] >= lo[t, 1]) & (p[:, 1] <= hi[t, 1])
        t, line, p = t[near], line[near], p[near]
        a, b, c = (triangles[t, k] for k in range(3))
        u, v, w = b[:, :2] - a[:, :2], c[:, :2] - a[:, :2], p - a[:, :2]
        area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
        area[area == 0] = np.inf  # stands upright: no line through it but at its edge
        l1, l2 = (w[:, 0] * v[:, 1] - w[:, 1] * v[:, 0]) / area, (u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0]) / area
        hit = (l1 >= 0) & (l2 >= 0) & (l1 + l2 <= 1) & np.isfinite(area)
        lines.append(line[hit])
        heights.append((a[:, 2] + l1 * (b[:, 2] - a[:, 2]) + l2 * (c[:, 2] - a[:, 2]))[hit])
    return np.concatenate(lines), np.concatenate(heights)


def _inside(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(N,) whether each point of a lattice is inside. The lines are moved a hair aside, off edges and corners."""
    size = np.ptp(triangles, axis=(0, 1)).max()
    columns, column = np.unique(points[:, :2], axis=0, return_inverse=True)
    line, height = _crossings(columns + size * np.array([1.234e-7, 0.777e-7]), triangles)
    order = np.lexsort((height, line))
    line, height = line[order], height[order]
    # how many crossings of its line lie above a point: by one search in (line, height) laid end to end
    far = 4 * (np.abs(height).max(initial=0) + np.abs(points[:, 2]).max() + size)
    below = np.searchsorted(line * far + height, column.ravel() * far + points[:, 2])
    end = np.searchsorted(line, column.ravel(), side="right")
    return (end - below) % 2 == 1


def _revolved(surface: Surface | None, thickness: float, axis: str, level: float) -> float | None:
    """Volume inside a tank up to a level along its own axis [m3], by its radius over the height; None for other bodies."""
    if not isinstance(surface, (Cylinder, CappedTank)) or surface.axis != axis or getattr(surface, "cap", "flat") not in ("flat", "dome"):
        return None
    half = surface.half_angle if isinstance(surface, CappedTank) else 0.0
    bottom, e = surface.origin[AXES[axis]], 0.5 * thickness
    R = surface.radius - e
    sphere = surface.radius / np.sin(half) if half > 0 else 0.0  # radius of the domes
    cap = sphere * (1 - np.cos(half)) if half > 0 else 0.0
    start, stop = bottom - cap + e, min(level, bottom + surface.length + cap - e)
    z = start + (stop - start) * (np.arange(200_000) + 0.5) / 200_000
    outside = np.maximum(np.maximum(bottom - z, z - bottom - surface.length), 0.0)  # height above the rim, in a dome
    square = np.full_like(z, R * R)
    if half > 0:
        dome = np.maximum((sphere - e) ** 2 - (sphere * np.cos(half) + outside) ** 2, 0.0)
        square = np.where(outside > 0, np.minimum(square, dome), square)
    return float(np.pi * square.mean() * (stop - start))


def _measured(triangles: np.ndarray, half: np.ndarray, upper: float, level: float, d: float) -> float:
    """Volume inside a mesh up to a level [m3], by lines D/4 apart, less the half of the walls that stands inside. half (T,), upper [m]:
    half the thickness of each triangle, and at the top."""
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    n = np.ceil((high - low)[:2] / (0.25 * d)).astype(int)
    step = (high - low)[:2] / n
    # a hair aside, by another one in y: off the edges and the diagonals of a regular lattice
    x, y = np.meshgrid(*(low[c] + step[c] * (np.arange(n[c]) + aside) for c, aside in enumerate((0.5001, 0.50037))))
    line, height = _crossings(np.column_stack([x.ravel(), y.ravel()]), triangles)
    order = np.lexsort((height, line))
    inside = np.minimum(height[order], level + upper)  # in at odd crossings, out at even ones
    volume = float(step.prod() * np.sum(inside[1::2] - inside[::2]))
    wet = triangles.mean(axis=1)[:, 2] < level
    return volume - _under(triangles[wet], half[wet])
