"""Where a body broke and when: the broken cells of the last frame, seen from the tip of a cut.

A crack is a set of broken cells that follow each other closely; single broken cells elsewhere do
not belong to it. Every length that decides so is a number of node spacings.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ...frame import BodyFrame
from ...scene import Cut

LINK = 2.1  # spacings between the centres of two broken cells that belong together (one sound cell between)
SEED = 3.0  # spacings from a cut within which a crack counts as starting from it
STRIP = 2.5  # half-width of the strip in which branches are counted, in spacings
ALONE = 0.8  # share of a crack's cells beside its longest way: with fewer it branches, and keeps to the direction of the cut
BEND = 8.0  # spacings at the end of a crack that tell where it runs
SMALL = 5  # a component of fewer broken cells is no crack


def cell_centres(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """(M, 3) mean of the corners of each cell."""
    corner = (cells >= 0)[:, :, None]
    return np.where(corner, points[cells], 0.0).sum(axis=1) / corner.sum(axis=1)


def node_spacing(points: np.ndarray, cells: np.ndarray) -> float:
    """Median length of the first edge of the cells."""
    return float(np.median(np.linalg.norm(points[cells[:, 1]] - points[cells[:, 0]], axis=1)))


def _labels(centres: np.ndarray, reach: float) -> np.ndarray:
    """Number of the connected component of each centre."""
    if len(centres) == 0:
        return np.empty(0, dtype=int)
    pairs = cKDTree(centres).query_pairs(reach, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(centres),) * 2)
    return connected_components(graph, directed=False)[1]


@dataclass(frozen=True)
class Pattern:
    """Broken cells of one body in the frame of a cut: `along` grows ahead of its tip, `across` to the left.

    along, across: (K,) [m] from the tip, in the reference configuration. time: (K,) rupture time [s].
    linked: (K,) time [s] from which the cell is linked to the cut by broken cells; inf when never.
    way: (K,) [m] through broken cells from the cut, inf where not linked. turned: the crack has no branches and ends more than 60 degrees
    off the cut.
    component: (K,) number of the set of linked cells. size: {component: cells}.
    far: `along` of the body's far edge; near, low, high: the other sides in the same frame.
    """

    along: np.ndarray
    across: np.ndarray
    time: np.ndarray
    linked: np.ndarray
    way: np.ndarray
    turned: bool
    component: np.ndarray
    size: np.ndarray
    spacing: float
    tip: np.ndarray
    direction: np.ndarray
    near: float
    far: float
    low: float
    high: float

    @property
    def ahead(self) -> np.ndarray:
        """(K,) [m] how far the crack has come at a cell: along the cut, or along itself where it has turned."""
        return self.way if self.turned else self.along

    @property
    def left(self) -> np.ndarray:
        """(K,) [m] from a cell to the far edge; where the crack has turned, to the nearest edge that does not lie behind it."""
        if not self.turned:
            return self.far - self.along
        sides = np.minimum(np.minimum(self.far - self.along, self.across - self.low), self.high - self.across)
        back = np.where(self.way > 2.0 * BEND * self.spacing, self.along - self.near, np.inf)
        return np.minimum(sides, back)

    @property
    def crack(self) -> np.ndarray:
        """(K,) bool: cells of the crack that starts from the cut."""
        return np.isfinite(self.linked)

    def place(self, along: float, across: float) -> np.ndarray:
        """(2,) x, y [m] of a point given in the frame of the cut."""
        return self.tip + along * self.direction + across * np.array([-self.direction[1], self.direction[0]])

    def crossings(self, station: float, cells: np.ndarray) -> list[np.ndarray]:
        """Groups of `cells` (bool mask) that cross the strip around `along` = station from side to side.

        Each is an array of indices; they come in the order of `across`.
        """
        half = STRIP * self.spacing
        index = np.flatnonzero(cells & (np.abs(self.along - station) <= half))
        label = _labels(np.column_stack([self.along[index], self.across[index]]), LINK * self.spacing)
        groups = []
        for number in range(label.max(initial=-1) + 1):
            group = index[label == number]
            if np.ptp(self.along[group]) >= 2 * half - 2.01 * self.spacing:
                groups.append(group)
        return sorted(groups, key=lambda g: self.across[g].mean())

    def stations(self, first: float, last: float) -> np.ndarray:
        """Places one spacing apart whose strips lie between two values of `along`."""
        half = STRIP * self.spacing
        return np.arange(first + half, last - half + 1e-9, self.spacing)


def _linked_times(centres: np.ndarray, time: np.ndarray, seeds: np.ndarray, reach: float) -> np.ndarray:
    """Earliest time at which a chain of broken cells joins each cell to a seed; inf where none does."""
    linked = np.full(len(centres), np.inf)
    neighbours = cKDTree(centres).query_ball_point(centres, reach) if len(centres) else []
    heap = [(time[i], i) for i in np.flatnonzero(seeds)]
    heapq.heapify(heap)
    while heap:
        arrival, cell = heapq.heappop(heap)
        if arrival >= linked[cell]:
            continue
        linked[cell] = arrival
        for other in neighbours[cell]:
            if linked[other] == np.inf:
                heapq.heappush(heap, (max(arrival, time[other]), other))
    return linked


def _ways(centres: np.ndarray, seeds: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Shortest way [m] through chains of broken cells from the seeds to each cell, inf where there is none; and the cell before it, -1 at
    the start."""
    way, before = np.full(len(centres), np.inf), np.full(len(centres), -1)
    neighbours = cKDTree(centres).query_ball_point(centres, reach) if len(centres) else []
    way[seeds] = 0.0
    heap = [(0.0, int(i)) for i in np.flatnonzero(seeds)]
    while heap:
        so_far, cell = heapq.heappop(heap)
        if so_far > way[cell]:
            continue
        for other in neighbours[cell]:
            longer = so_far + float(np.linalg.norm(centres[other] - centres[cell]))
            if longer < way[other] - 1e-12:
                way[other], before[other] = longer, cell
                heapq.heappush(heap, (longer, other))
    return way, before


def _turned(way: np.ndarray, before: np.ndarray, centres: np.ndarray, along: np.ndarray, spacing: float) -> bool:
    """Whether the crack is one, without branches, whose last spacings (BEND) lead more than 60 degrees off the cut."""
    linked = np.flatnonzero(np.isfinite(way))
    length = BEND * spacing
    if not len(linked) or way[linked].max() < 2.0 * length:
        return False
    path = [int(linked[np.argmax(way[linked])])]
    while before[path[-1]] >= 0:
        path.append(int(before[path[-1]]))
    last = path[0]
    at = next(cell for cell in path if way[last] - way[cell] >= length)
    if along[last] - along[at] >= 0.5 * (way[last] - way[at]):
        return False
    distance, _ = cKDTree(centres[path]).query(centres[linked])
    return bool(np.mean(distance <= LINK * spacing) >= ALONE)


def _distance_to_segment(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    axis = end - start
    share = np.clip((points - start) @ axis / (axis @ axis), 0, 1)
    return np.linalg.norm(points - start - share[:, None] * axis, axis=1)


def chart(reference: np.ndarray, cuts: tuple[Cut, ...], cut: int = 0) -> Callable[[np.ndarray], np.ndarray]:
    """Maps points (K, 3) of a body to the plane (K, 2): x and y where it is flat.

    A curved one is unrolled about the axis through its middle that is parallel to the cut (to z without one), with
    its mean radius: exact for a cylinder cut along its axis.
    """
    size = np.ptp(reference, axis=0)
    if size[2] <= 1e-6 * size.max():
        return lambda points: points[:, :2]
    axis, side = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    middle = 0.5 * (reference.min(axis=0) + reference.max(axis=0))
    if cuts:
        start, end = np.array(cuts[cut].start), np.array(cuts[cut].end)
        axis = (end - start) / np.linalg.norm(end - start)
        side = 0.5 * (start + end) - middle
        side -= side @ axis * axis
    side /= max(np.linalg.norm(side), 1e-300)
    third = np.cross(axis, side)
    radius = float(np.mean(np.linalg.norm((reference - middle) - np.outer((reference - middle) @ axis, axis), axis=1)))

    def unrolled(points: np.ndarray) -> np.ndarray:
        x = points - middle
        return np.column_stack([x @ axis, radius * np.arctan2(x @ third, x @ side)])

    return unrolled


def pattern(body: BodyFrame, cuts: tuple[Cut, ...], cut: int = 0, chosen: np.ndarray | None = None) -> Pattern:
    """The broken cells of `body` seen from the tip of `cuts[cut]`; or the cells `chosen`, a mask (M,).

    Cells that a cut left broken from the start (rupture time 0 or nan) are no part of a crack.

    The tip is the end of the cut that lies deeper inside the body. Without cuts the frame stands at
    the middle of the lower long side and looks across the body, and every crack counts as its own start.
    """
    flat = chart(body.reference, cuts, cut)
    points = flat(body.reference)
    spacing = node_spacing(body.reference, body.cells)
    lo, hi = points.min(axis=0), points.max(axis=0)
    if cuts:
        ends = flat(np.array([cuts[cut].start, cuts[cut].end]))
        depth = np.minimum(ends - lo, hi - ends).min(axis=1)
        tip, tail = (ends[1], ends[0]) if depth[1] >= depth[0] else (ends[0], ends[1])
        direction = (tip - tail) / np.linalg.norm(tip - tail)
    else:
        short = int(np.argmin(hi - lo))
        direction = np.eye(2)[short]
        tip = (lo + hi) / 2 - direction * (hi - lo)[short] / 2
    normal = np.array([-direction[1], direction[0]])

    rupture = np.asarray(body.cell_data["rupture_time"], dtype=float)
    if chosen is None:
        chosen = np.asarray(body.cell_data["broken"]).astype(bool) & (rupture > 0)
    centres = cell_centres(body.reference, body.cells)[chosen]
    centres = flat(centres)
    time = np.nan_to_num(rupture[chosen], nan=0.0)
    if cuts:
        seeds = _distance_to_segment(centres, *ends) <= SEED * spacing
    else:
        seeds = np.ones(len(centres), dtype=bool)
    label = _labels(centres, LINK * spacing)
    way, before = _ways(centres, seeds, LINK * spacing)
    along = (centres - tip) @ direction
    along_nodes, across_nodes = (points - tip) @ direction, (points - tip) @ normal
    return Pattern(
        along=along,
        across=(centres - tip) @ normal,
        time=time,
        linked=_linked_times(centres, time, seeds, LINK * spacing),
        way=way,
        turned=bool(cuts) and _turned(way, before, centres, along, spacing),
        component=label,
        size=np.bincount(label),
        spacing=spacing,
        tip=tip,
        direction=direction,
        near=float(along_nodes.min()),
        far=float(along_nodes.max()),
        low=float(across_nodes.min()),
        high=float(across_nodes.max()),
    )
