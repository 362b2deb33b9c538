"""What a broken shell fell into: fragments, plug, hole, petals, crack, read from its last frame.

Two nodes belong together when a chain of live cells joins them. A fragment is such a set; a node without a live cell
is dust. Areas are shares of the reference cells, broken ones included, so that the areas (and masses) of all fragments
and of the dust add up to those of the body. Some fragments are "held": those with a node that a motion of the scene holds, and
the largest where it is more than half of the body. They are what remains; what is missing from them is the hole. A ring that
bursts in free flight has none. Where the scene is not known, the nodes on the body's border count as held.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from ...frame import BodyFrame
from ...geometry.mesh import SurfaceMesh
from ...geometry.regions import inside, nodes_in
from ...geometry.surfaces import mesh_of
from ...observers.opening import openings
from ...scene import Scene, Shell
from ..folder import RunFolder
from ..histories import write_history
from .pattern import LINK, SMALL, cell_centres, node_spacing

LEAST = 4  # a smaller gap in what is held (nodes) is no hole
SOLID = "solid_"
COMPACT = 0.6  # its diameter over its extent, from which on a gap without a missing cell is a hole
ACROSS = 3.1  # spacings between two nodes on either side of a crack
STEADY = 3  # rings in a row that must show as many cracks

UNITS = {
    "fragment": "-", "nodes": "-", "mass": "kg", "area": "m2", "size": "m", "x": "m", "y": "m", "z": "m",
    "vx": "m/s", "vy": "m/s", "vz": "m/s", "held": "-",
}  # fmt: skip


def border(cells: np.ndarray) -> np.ndarray:
    """(E, 2) node numbers of the edges that belong to one cell only: the outline of the whole body."""
    following = np.roll(cells, -1, axis=1)
    triangles = cells[:, 3] < 0
    following[triangles, 2] = cells[triangles, 0]
    edges = np.sort(np.column_stack([cells.ravel(), following.ravel()]), axis=1)
    edges = edges[(edges >= 0).all(axis=1)]
    nodes = int(cells.max(initial=0)) + 1
    key, count = np.unique(edges[:, 0].astype(np.int64) * nodes + edges[:, 1], return_counts=True)
    return np.column_stack(np.divmod(key[count == 1], nodes))


def cell_areas(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """(M,) [m2]: half of the product of the diagonals; of the sides where the cell is a triangle."""
    a, b, c, d = (points[cells[:, k]] for k in range(4))
    triangle = (cells[:, 3] < 0)[:, None]
    return 0.5 * np.linalg.norm(np.cross(c - a, np.where(triangle, b - a, d - b)), axis=1)


def _joined(cells: np.ndarray, among: np.ndarray) -> np.ndarray:
    """(N,) number of the connected component of each node through `cells`, links between the nodes `among` (N,) bool only."""
    first, other = cells[:, [0, 0, 0, 1, 1, 2]].ravel(), cells[:, [1, 2, 3, 2, 3, 3]].ravel()
    link = (other >= 0) & among[first] & among[other]
    graph = coo_array((np.ones(np.count_nonzero(link)), (first[link], other[link])), shape=(len(among),) * 2)
    return connected_components(graph, directed=False)[1]


@dataclass(frozen=True)
class Fragments:
    """A body taken apart. `label` (N,): the fragment of each node, the largest first; -1 for dust.

    node_area (N,), area (K,) [m2] of the reference; nodes (K,) how many; held (K,) bool.
    """

    body: BodyFrame
    label: np.ndarray
    node_area: np.ndarray
    area: np.ndarray
    nodes: np.ndarray
    held: np.ndarray

    @cached_property
    def gone(self) -> np.ndarray:
        """(N,) bool: nodes that are no part of what is held."""
        return (self.label < 0) | ~self.held[self.label]

    @property
    def dust(self) -> np.ndarray:
        """(N,) bool"""
        return self.label < 0

    @property
    def free(self) -> np.ndarray:
        """Numbers of the fragments that are not held, the largest first."""
        return np.flatnonzero(~self.held)

    def of(self, values: np.ndarray, fragment: int) -> np.ndarray:
        """Mean over a fragment (-1: the dust) of nodal values, weighted by mass."""
        mine = self.label == fragment
        return np.average(values[mine], axis=0, weights=self.node_area[mine])

    def size(self, fragment: int) -> float:
        """Extent [m] of a fragment now along its longest axis, with half a spacing at either end."""
        points = self.body.points[self.label == fragment]
        _, _, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
        return float(np.ptp(points @ axes[0])) + node_spacing(self.body.reference, self.body.cells)


def live(body: BodyFrame) -> np.ndarray:
    """(M,) bool"""
    return ~np.asarray(body.cell_data["broken"]).astype(bool)


def ruptured(body: BodyFrame) -> np.ndarray:
    """(M,) bool: cells that broke during the run, not at its start by a cut."""
    return ~live(body) & (np.nan_to_num(np.asarray(body.cell_data["rupture_time"], dtype=float)) > 0)


def held_nodes(scene: Scene, body: BodyFrame) -> np.ndarray:
    """(N,) bool: nodes that a motion of the scene holds or drives."""
    caught = []
    for motion in scene.loads_of("motions", body.name):
        of = getattr(motion.where, "of", motion.where)
        if of.kind == "group":
            caught.append(nodes_in(motion.where, mesh_of(shell_of(scene, body.name), scene)))
        else:
            caught.append(inside(motion.where, body.reference))
    return np.any(caught, axis=0) if caught else np.zeros(len(body.reference), dtype=bool)


def fragments(body: BodyFrame, scene: Scene | None = None) -> Fragments:
    """The fragments of a shell at one instant."""
    cells, count = body.cells, len(body.points)
    share = np.repeat((cell_areas(body.reference, cells) / (cells >= 0).sum(axis=1))[:, None], 4, axis=1)
    corner = cells >= 0
    node_area = np.bincount(cells[corner], share[corner], minlength=count)
    whole = cells[live(body)]
    alive = np.zeros(count, dtype=bool)
    alive[whole[whole >= 0]] = True
    component = _joined(whole, alive)
    area = np.bincount(component[alive], node_area[alive], minlength=component.max(initial=-1) + 1)
    present = np.unique(component[alive])
    order = present[np.argsort(-area[present], kind="stable")]
    number = np.full(len(area), -1)
    number[order] = np.arange(len(order))
    label = np.where(alive, number[component], -1)
    held = np.zeros(len(order), dtype=bool)
    held[:1] = scene is None or 2 * area[order[:1]] > node_area.sum()
    ends = label[np.unique(border(cells)) if scene is None else held_nodes(scene, body)]
    held[ends[ends >= 0]] = True
    if "weight" in body.cell_data:  # of a shell in parts: the elements hold what overlaps them
        tied = label[cells[(np.asarray(body.cell_data["weight"]) < 1.0) & live(body)]]
        held[tied[tied >= 0]] = True
    return Fragments(body, label, node_area, area[order], np.bincount(label[alive], minlength=len(order)), held)


@dataclass(frozen=True)
class Hole:
    """A gap in what is held: its nodes, area [m2] and centre (3,) [m] in the reference, and when it began [s]."""

    nodes: np.ndarray
    area: float
    centre: np.ndarray
    time: float

    @property
    def diameter(self) -> float:
        """Of the disc of the same area [m]."""
        return float(np.sqrt(4 * self.area / np.pi))


def holes(f: Fragments) -> list[Hole]:
    """The holes, in the order in which they began.

    A crack leaves a line of dust that is no hole. What counts are cells of which every node is missing; where a gap has
    none (a hole few nodes wide), the whole gap counts if it is about as wide as it is long.
    """
    body = f.body
    spacing = node_spacing(body.reference, body.cells)
    missing = body.cells[(f.gone[body.cells] | (body.cells < 0)).all(axis=1)]
    wide = np.zeros(len(body.points), dtype=bool)
    wide[missing[missing >= 0]] = True
    gap = _joined(body.cells, f.gone)
    for number in np.setdiff1d(gap[f.gone], gap[wide]):
        nodes = np.flatnonzero(gap == number)
        extent = float(np.linalg.norm(np.ptp(body.reference[nodes], axis=0))) + spacing
        compact = 2 * np.sqrt(f.node_area[nodes].sum() / np.pi) >= COMPACT * extent
        wide[nodes] = len(nodes) >= LEAST and compact
    label = _joined(body.cells, wide)
    rupture = np.where(ruptured(body), np.asarray(body.cell_data["rupture_time"], dtype=float), np.inf)
    began = np.full(len(body.points), np.inf)
    corner = body.cells >= 0
    np.minimum.at(began, body.cells[corner], np.broadcast_to(rupture[:, None], corner.shape)[corner])
    found = []
    for number in np.unique(label[wide]):
        nodes = np.flatnonzero(wide & (label == number))
        weight = f.node_area[nodes]
        centre = np.average(body.reference[nodes], axis=0, weights=weight)
        found.append(Hole(nodes, float(weight.sum()), centre, float(began[nodes].min())))
    return sorted(found, key=lambda h: h.time)


def surface(body: BodyFrame) -> SurfaceMesh:
    """The reference of a shell as a mesh."""
    return SurfaceMesh(body.reference, body.cells, node_spacing(body.reference, body.cells))


def seen(f: Fragments) -> tuple[np.ndarray, np.ndarray]:
    """What one sees through: the region (M,) of each cell that is no live part of what is held (-1: it is one), and the area [m2] within
    the lips of each region, as observers/opening.py has it."""
    body = f.body
    corner = np.where(body.cells < 0, body.cells[:, :1], body.cells)
    whole = live(body) & ~f.gone[corner].any(axis=1)
    areas = cell_areas(body.reference, body.cells)
    region, area = openings(body.points, body.cells, surface(body).edges.sides, areas, ~live(body), f.dust, whole)
    return np.where(whole, -1, region), area


def lips(f: Fragments, hole: Hole) -> tuple[float, bool]:
    """Diameter [m] of the disc as large as the area within the lips around a hole as they are now, cracks that run from it included; and
    whether that opening is about as wide as it is long."""
    region, area = seen(f)
    missing = np.zeros(len(f.body.points), dtype=bool)
    missing[hole.nodes] = True
    corner = np.where(f.body.cells < 0, f.body.cells[:, :1], f.body.cells)
    mine = np.unique(region[(region >= 0) & missing[corner].any(axis=1)])
    across = float(np.sqrt(4 / np.pi * area[mine].sum()))
    rim = np.unique(corner[np.isin(region, mine)])
    rim = rim[~f.gone[rim]]
    extent = float(np.linalg.norm(np.ptp(f.body.points[rim], axis=0))) if len(rim) else np.inf
    return across, across >= COMPACT * extent


# --- where it was hit ---------------------------------------------------------------------------


def thrown_solids(run: RunFolder) -> list[str]:
    """Solids with a history, histories/solid_<name>.csv: those that start with a velocity."""
    return [name.removeprefix(SOLID) for name in run.histories() if name.startswith(SOLID)]


Flight = tuple[np.ndarray, np.ndarray, float]


def fliers(run: RunFolder) -> list[tuple[str, Flight]]:
    """The rigid bodies and solids that move at the start, by name, the fastest first."""
    found = []
    for file in run.of_kind("rigid") + [run.the("solid", name) for name in thrown_solids(run)]:
        start = file.body(0)
        velocity = start.point_data["velocity"].mean(axis=0)
        speed = float(np.linalg.norm(velocity))
        if speed > 0:
            found.append((file.name, (start.points.mean(axis=0), velocity / speed, speed)))
    return sorted(found, key=lambda flier: -flier[1][2])


def flights(run: RunFolder) -> list[Flight]:
    """Place (3,) [m], direction (3,) and speed [m/s] at the start of the rigid bodies and solids that move, the fastest first."""
    return [flight for _, flight in fliers(run)]


def flight(run: RunFolder) -> Flight | None:
    """That of the fastest of them at the start; None where none moves."""
    return next(iter(flights(run)), None)


def blow(run: RunFolder, body: BodyFrame) -> tuple[np.ndarray, np.ndarray] | None:
    """Place (3,) [m] in the reference and direction (3,) of the first striker whose path meets the body; None where no path does."""
    reference, spacing, found = body.reference, node_spacing(body.reference, body.cells), []
    for start, direction, speed in flights(run):
        along = (reference - start) @ direction
        aside = np.linalg.norm(reference - start - along[:, None] * direction, axis=1)
        near = np.flatnonzero((along > 0) & (aside <= 1.5 * spacing))
        if len(near):
            first = near[along[near] <= along[near].min() + spacing]
            way = along[first[np.argmin(aside[first])]]
            found.append((way / speed, start + way * direction, direction))
    return min(found, key=lambda hit: hit[0])[1:] if found else None


def struck_at(run: RunFolder, body: BodyFrame) -> np.ndarray:
    """(3,) [m] in the reference: where the path of a striker first meets the body; without one, where it broke first."""
    hit, reference = blow(run, body), body.reference
    if hit is not None:
        return hit[0]
    broke = ruptured(body)
    if not broke.any():
        return reference.mean(axis=0)
    time = np.where(broke, np.asarray(body.cell_data["rupture_time"], dtype=float), np.inf)
    return cell_centres(reference, body.cells)[np.argmin(time)]


def normal_at(body: BodyFrame, centre: np.ndarray, reach: float) -> np.ndarray:
    """(3,) unit normal of the plane through the reference nodes within `reach` [m] of a point."""
    near = body.reference[np.linalg.norm(body.reference - centre, axis=1) <= reach]
    return np.linalg.svd(near - near.mean(axis=0), full_matrices=False)[2][2]


# --- cracks on any surface ------------------------------------------------------------------------


@dataclass(frozen=True)
class Cracks:
    """Broken cells: centres (K, 3) [m] in the reference, `label` (K,) of the linked set, graph of the links [m]."""

    cells: np.ndarray
    centres: np.ndarray
    label: np.ndarray
    graph: coo_array
    spacing: float

    def longest(self, number: int | np.integer) -> float:
        """The longest shortest path through a linked set, plus one spacing [m]: two sweeps, exact for a tree."""
        mine = np.flatnonzero(self.label == number)
        graph = self.graph.tocsr()[mine][:, mine]
        far = int(np.argmax(dijkstra(graph, directed=False, indices=0)))
        return float(dijkstra(graph, directed=False, indices=far).max()) + self.spacing


def crack_sets(body: BodyFrame) -> Cracks:
    """The broken cells of a body and which of them follow each other within 2.1 spacings."""
    cells = np.flatnonzero(ruptured(body))
    centres = cell_centres(body.reference, body.cells)[cells]
    spacing = node_spacing(body.reference, body.cells)
    pairs = cKDTree(centres).query_pairs(LINK * spacing, output_type="ndarray") if len(cells) else np.empty((0, 2), int)
    length = np.linalg.norm(centres[pairs[:, 0]] - centres[pairs[:, 1]], axis=1)
    graph = coo_array((length, (pairs[:, 0], pairs[:, 1])), shape=(len(cells),) * 2)
    label = connected_components(graph, directed=False)[1] if len(cells) else np.empty(0, dtype=int)
    return Cracks(cells, centres, label, graph, spacing)


def crack_lengths(body: BodyFrame) -> np.ndarray:
    """Longest path [m] of each crack of 5 cells or more, the longest first."""
    c = crack_sets(body)
    size = np.bincount(c.label)
    return np.sort([c.longest(n) for n in np.flatnonzero(size >= SMALL)])[::-1]


def radial_cracks(body: BodyFrame, centre: np.ndarray) -> int:
    """Cracks that cross rings around `centre`: the largest number that three rings in a row show.

    Rings lie one spacing apart, from two spacings on, and count the angular groups of the cracks (5 linked cells or more) on
    this side of the body; a gap of more than 2.1 spacings along the ring parts two of them. A full ring is the rim of a plug
    and no radial crack.
    """
    c = crack_sets(body)
    if len(c.cells) == 0:
        return 0
    normal = normal_at(body, centre, 6 * c.spacing)
    away = c.centres - centre
    deep = float(np.ptp(body.reference @ normal))
    mine = (np.bincount(c.label) >= SMALL)[c.label]
    if deep > 0.2 * np.ptp(body.reference, axis=0).max():  # a tank has another side
        mine &= np.abs(away @ normal) < 0.5 * deep
    if not mine.any():
        return 0
    away = away[mine]
    axes = np.linalg.svd(normal[None])[2][1:]
    radius, angle = np.linalg.norm(away, axis=1), np.arctan2(*(away @ axes.T).T)
    counts = []
    for r in np.arange(2.0, radius.max() / c.spacing + 1) * c.spacing:
        here = np.sort(angle[np.abs(radius - r) <= 0.75 * c.spacing])
        gaps = np.diff(here, append=here[:1] + 2 * np.pi)
        counts.append(int(np.count_nonzero(gaps * r > LINK * c.spacing)))
    windows = [min(counts[i : i + STEADY]) for i in range(max(1, len(counts) - STEADY + 1)) if counts]
    return max(windows, default=0)


def widest(body: BodyFrame) -> float:
    """How far [m] the lips of a crack have moved apart: over pairs of nodes that face each other across broken cells."""
    f = fragments(body)
    broke = ruptured(body)
    if not broke.any():
        return 0.0
    spacing = node_spacing(body.reference, body.cells)
    touched = np.zeros(len(body.points), dtype=bool)
    corner = body.cells[broke]
    touched[corner[corner >= 0]] = True
    lips = np.flatnonzero(touched & ~f.gone)
    if len(lips) < 2:
        return 0.0
    pairs = lips[cKDTree(body.reference[lips]).query_pairs(ACROSS * spacing, output_type="ndarray")]
    middle = body.reference[pairs].mean(axis=1)
    centres = cell_centres(body.reference, body.cells)[broke]
    pairs = pairs[cKDTree(centres).query(middle)[0] <= 0.75 * spacing] if len(pairs) else pairs
    if len(pairs) == 0:
        return 0.0
    now = np.linalg.norm(np.diff(body.points[pairs], axis=1)[:, 0], axis=1)
    before = np.linalg.norm(np.diff(body.reference[pairs], axis=1)[:, 0], axis=1)
    return max(0.0, float((now - before).max()))


def light(body: BodyFrame, centre: np.ndarray, direction: np.ndarray, reach: float) -> float:
    """Area [m2] through which one sees along `direction`, past the held live cells within `reach` [m] of `centre`.

    Cells are projected now, bent as they are, on a raster of a third of a spacing; the area is the uncovered set nearest to
    the centre that does not touch the rim of the window. What faced the other way at the start is the far wall and does not count.
    """
    f = fragments(body)
    step = node_spacing(body.reference, body.cells) / 3
    away = np.linalg.norm(cell_centres(body.reference, body.cells) - centre, axis=1)
    facing = surface(body).area_vectors
    near = (away <= 1.5 * reach) & (facing @ facing[np.argmin(away)] > 0)
    corner = np.where(body.cells < 0, body.cells[:, :1], body.cells)
    chosen = corner[near & live(body) & ~f.gone[corner].any(axis=1)]
    axes = np.linalg.svd(direction[None])[2][1:]
    quads = ((body.points[chosen] - centre) @ axes.T) / step
    longest = np.abs(np.diff(quads, axis=1)).max(initial=0)
    fine = np.linspace(0, 1, min(int(2 * longest) + 3, 60))
    half = int(reach / step)
    covered = np.zeros((2 * half + 1,) * 2, dtype=bool)
    for s in fine:
        for t in fine:
            weights = np.array([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t])
            i, j = (np.rint(np.einsum("k,mkc->cm", weights, quads)).astype(int) + half).clip(-1, 2 * half + 1)
            inside = (i >= 0) & (j >= 0) & (i <= 2 * half) & (j <= 2 * half)
            covered[i[inside], j[inside]] = True
    label, count = ndimage.label(~covered)
    if count == 0:
        return 0.0
    rim = np.unique(np.concatenate([label[0], label[-1], label[:, 0], label[:, -1]]))
    place = np.argwhere((label > 0) & ~np.isin(label, rim))
    if len(place) == 0:
        return 0.0
    nearest = place[np.argmin(np.linalg.norm(place - half, axis=1))]
    return float(np.count_nonzero(label == label[tuple(nearest)])) * step**2


# --- the list ----------------------------------------------------------------------------------------


def shell_of(scene: Scene, name: str) -> Shell:
    return scene.body(name)


def mass_of(f: Fragments, shell: Shell, number: int) -> float:
    """Mass of a fragment, -1: of all the dust [kg]. Frames of a shell of several sections say what their cells weigh."""
    mine = f.label == number
    if "areal_mass" not in f.body.cell_data:
        return shell.thickness * shell.material.density * float(f.node_area[mine].sum())
    weights = np.asarray(f.body.cell_data["areal_mass"], float) * cell_areas(f.body.reference, f.body.cells)
    corner = f.body.cells >= 0
    share = np.repeat((weights / corner.sum(axis=1))[:, None], 4, axis=1)
    return float(np.bincount(f.body.cells[corner], share[corner], minlength=len(mine))[mine].sum())


def table(f: Fragments, shell: Shell) -> dict[str, np.ndarray]:
    """Columns of fragments.csv: a row for each fragment, the largest first, then one (-1) for all the dust."""
    body = f.body
    rows = []
    for number in [*range(len(f.area)), *([-1] if f.dust.any() else [])]:
        mine = f.label == number
        area = float(f.node_area[mine].sum())
        place, velocity = f.of(body.points, number), f.of(body.point_data["velocity"], number)
        size = f.size(number) if number >= 0 else 0.0
        held = int(number >= 0 and f.held[number])
        rows.append((number, int(mine.sum()), mass_of(f, shell, number), area, size, *place, *velocity, held))
    return {name: np.array(values) for name, values in zip(UNITS, zip(*rows, strict=True), strict=True)}


def write_fragments(run: RunFolder, scene: Scene) -> list[str]:
    """histories/fragments.csv (fragments_<body>.csv where there are several shells) of the last frame, where a shell broke."""
    names = []
    for file in run.of_kind("shell"):
        body = file.body(-1)
        if not ruptured(body).any():
            continue
        name = "fragments" if len(scene.shells) == 1 else f"fragments_{file.name}"
        path: Path = run.path / "histories" / f"{name}.csv"
        write_history(path, UNITS, table(fragments(body, scene), shell_of(scene, file.name)))
        names.append(name)
    return names


def free_masses(run: RunFolder, name: str) -> np.ndarray:
    """(N,) masses [kg] of all pieces that came off, the heaviest first, from histories/<name>.csv: the fragments that are not held, and of
    the dust each node as a piece of its own."""
    h = run.history(name)
    dust, nodes = h["fragment"] < 0, h["nodes"]
    own = h["mass"][~dust & (h["held"] == 0)]
    single = np.repeat(h["mass"][dust] / np.maximum(nodes[dust], 1), nodes[dust].astype(int))
    return np.sort(np.concatenate([own, single]))[::-1]


# --- the measures -------------------------------------------------------------------------------


def _last(run: RunFolder, body: str | None) -> BodyFrame:
    return run.the("shell", body).body(-1)


def _centre(run: RunFolder, body: BodyFrame, x: float | None, y: float | None, z: float | None) -> np.ndarray:
    given = [x, y, z]
    if all(v is None for v in given):
        return struck_at(run, body)
    return np.array([0.0 if v is None else v for v in given])


def fragments_count(run: RunFolder, scene: Scene, *, body: str | None = None, nodes: float = 2) -> float:
    """Pieces of at least `nodes` nodes that are not held; dust does not count."""
    f = fragments(_last(run, body), scene)
    return float(np.count_nonzero(f.nodes[f.free] >= nodes))


def largest_fragment_mass(run: RunFolder, scene: Scene, *, body: str | None = None) -> float:
    """Mass [kg] of the largest fragment that is not held; 0 without one."""
    last = _last(run, body)
    f = fragments(last, scene)
    return mass_of(f, shell_of(scene, last.name), int(f.free[0])) if len(f.free) else 0.0


def dust_mass(run: RunFolder, scene: Scene, *, body: str | None = None) -> float:
    """Mass [kg] of the nodes without a live cell."""
    last = _last(run, body)
    f = fragments(last)
    return mass_of(f, shell_of(scene, last.name), -1)


def plug_diameter(run: RunFolder, scene: Scene, *, body: str | None = None) -> float:
    """Diameter [m] of the disc as large as the largest fragment that is not held; 0 without one."""
    f = fragments(_last(run, body), scene)
    return float(np.sqrt(4 * f.area[f.free[0]] / np.pi)) if len(f.free) else 0.0


def hole_diameter(run: RunFolder, scene: Scene, *, body: str | None = None, hole: float = 1) -> float:
    """Diameter [m] of the disc as large as the material that is missing of the reference in the `hole`-th hole (the first one
    began first: the front of a tank, then its back); 0 without it. It is not the hole that one sees: petals are not missing, and material
    counts by whole nodes. See seen_diameter and opening_diameter."""
    found = holes(fragments(_last(run, body), scene))
    return found[int(hole) - 1].diameter if len(found) >= hole else 0.0


def seen_diameter(run: RunFolder, scene: Scene, *, body: str | None = None, hole: float = 1) -> float:
    """Diameter [m] of the disc as large as the area within the lips of the `hole`-th hole (in the order of hole_diameter) as they are at
    the end: the hole that one sees, with the cracks that run from it; 0 without it."""
    f = fragments(_last(run, body), scene)
    found = holes(f)
    return lips(f, found[int(hole) - 1])[0] if len(found) >= hole else 0.0


def opening_diameter(
    run: RunFolder,
    scene: Scene,
    *,
    body: str | None = None,
    x: float | None = None,
    y: float | None = None,
    z: float | None = None,
    reach: float | None = None,
) -> float:
    """Diameter [m] of the disc as large as the hole that one sees along the striker's flight (the normal, without a
    striker), between petals bent as they are; around where it was struck, or (x, y, z), within `reach` [m]
    (default: as far as what is open there, and a third more). The far wall of a tank does not count."""
    last = _last(run, body)
    centre = _centre(run, last, x, y, z)
    reach = reach or around(last, centre)
    hit = blow(run, last)
    direction = hit[1] if hit is not None else normal_at(last, centre, reach / 3)
    return float(np.sqrt(4 / np.pi * light(last, centre, direction, reach)))


def around(body: BodyFrame, centre: np.ndarray) -> float:
    """How far [m] from a point what is open beside it reaches, now or in the reference, and a third and six spacings more; a third of
    the body's size where nothing is open."""
    f = fragments(body)
    region, _ = seen(f)
    spacing, whole = node_spacing(body.reference, body.cells), float(np.ptp(body.reference, axis=0).max()) / 3
    open_ = np.flatnonzero(region >= 0)
    if not len(open_):
        return whole
    first = open_[np.argmin(np.linalg.norm(cell_centres(body.reference, body.cells)[open_] - centre, axis=1))]
    corner = np.unique(body.cells[region == region[first]])
    lip = corner[(corner >= 0) & ~f.gone[corner]]
    if not len(lip):
        return whole
    farthest = max(float(np.linalg.norm(points[lip] - centre, axis=1).max()) for points in (body.reference, body.points))
    return farthest * 4 / 3 + 6 * spacing


def crack_opening(run: RunFolder, scene: Scene, *, body: str | None = None) -> float:
    """How far [m] the lips of the widest crack have moved apart at the end."""
    return widest(_last(run, body))


def petals(
    run: RunFolder,
    scene: Scene,
    *,
    body: str | None = None,
    x: float | None = None,
    y: float | None = None,
    z: float | None = None,
) -> float:
    """Radial cracks that cross a ring around where it was struck, or around (x, y, z) [m] of the reference."""
    last = _last(run, body)
    return float(radial_cracks(last, _centre(run, last, x, y, z)))
