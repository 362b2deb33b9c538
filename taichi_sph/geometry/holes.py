"""Round holes cut into a patch of a surface: nodes near the rim are moved onto it, cells within are taken away. NumPy only.

A hole is what is nearer than its radius to a line: the normal of the surface through the hole's centre. Of each side of a cell that crosses
the rim, the nearer end is moved onto the rim, the nearest nodes first. No side crosses the rim then: a cell is outside, inside, or a
quadrangle with the rim along its diagonal, of which the outer triangle stays. The rim's polygon is made as large as the circle, so its
nodes stand a little outside; rim and nodes around are evened out, in the chart.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..errors import SceneError
from ..scene.surfaces import HoleIn
from .mesh import SurfaceMesh

LEAST = 2.0  # spacings across the smallest hole
FEWEST = 6  # nodes of a rim
MARGIN = 1.0  # spacings between a rim and the border of a patch, or another rim
TURNS = 0.5  # cosine of the angle between the normals in the middle and at the rim from which on a hole is no disc
ROUNDS = 12  # of evening out
REACH = 2.5  # spacings from the rim in which nodes are moved
BLUNT = -0.9  # cosine of the angle at a rim node from which on its quadrangle is halved

Bend = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Cut:
    """A patch without its holes: chart (N, 2), cells (M, 4) with -1 behind triangles, inner (N,) bool."""

    chart: np.ndarray
    cells: np.ndarray
    inner: np.ndarray


@dataclass
class _Patch:
    """A patch while holes are cut: chart (N, 2), cells (M, 4), inner (N,); points (N, 3) [m], infinite where no cell has the node any
    more; order (M,): where a cell stands among the cells."""

    chart: np.ndarray
    cells: np.ndarray
    inner: np.ndarray
    points: np.ndarray
    order: np.ndarray

    def near(self, nodes: np.ndarray) -> np.ndarray:
        """(M,) bool: the cells with one of the nodes (N,) bool."""
        return np.any((self.cells >= 0) & nodes[self.cells], axis=1)

    def whole(self) -> Cut:
        used = np.isfinite(self.points[:, 0])
        number = np.cumsum(used) - 1
        cells = self.cells[np.argsort(self.order)]
        return Cut(self.chart[used], np.where(cells < 0, -1, number[cells]), self.inner[used])


@dataclass
class Cutter:
    """The holes of a surface, cut into whichever patch they lie in; `check` sees that all were."""

    holes: Sequence[HoleIn]
    spacing: float
    done: set[int] = field(default_factory=set)
    nearest: dict[int, tuple[float, np.ndarray]] = field(default_factory=dict)  # of holes that no patch has had: distance, point

    def __post_init__(self) -> None:
        centres, radii = np.reshape([hole.centre for hole in self.holes], (-1, 3)), np.array([hole.radius for hole in self.holes])
        for k, hole in enumerate(self.holes):
            if 2 * hole.radius < LEAST * self.spacing * (1 - 1e-9):
                raise SceneError(
                    f"holes[{k}] is {_mm(2 * hole.radius)} wide, less than {LEAST:g} spacings of {_mm(self.spacing)}; "
                    "lower the spacing or leave it out"
                )
            apart = np.linalg.norm(np.subtract(hole.centre, centres[:k]), axis=1) - hole.radius - radii[:k]
            if (apart < 2 * MARGIN * self.spacing * (1 - 1e-9)).any():
                j = int(np.argmax(apart < 2 * MARGIN * self.spacing * (1 - 1e-9)))
                raise SceneError(
                    f"holes[{j}] and holes[{k}] are {_mm(apart[j])} apart; at least two spacings, {_mm(2 * self.spacing)}, are needed"
                )

    def check(self) -> None:
        """SceneError where a hole lies in no patch."""
        for k, hole in enumerate(self.holes):
            if k not in self.done:
                far, point = self.nearest[k]
                raise SceneError(
                    f"holes[{k}].centre {_place(hole.centre)} is not on the surface: its nearest node, {_place(point)}, is {_mm(far)} away"
                )

    def cut(self, chart: np.ndarray, cells: np.ndarray, inner: np.ndarray, bend: Bend, period: float | None) -> Cut | None:
        """A patch without its holes, None where it has none; bend: chart -> points and normals in the scene. Nodes keep their order."""
        patch = _Patch(chart.copy(), cells, inner.copy(), bend(chart)[0], 2 * np.arange(len(cells)))
        cut = False
        for k, hole in enumerate(self.holes):
            far = np.linalg.norm(patch.points - np.asarray(hole.centre), axis=1)
            found = self._centre(k, hole, far, patch, bend, period)
            if found is not None:
                self.done.add(k)
                self._cut(k, hole, far, patch, bend, period, found)
                cut = True
        return patch.whole() if cut else None

    def _cut(self, k: int, hole: HoleIn, far: np.ndarray, patch: _Patch, bend: Bend, period: float | None, centre: np.ndarray) -> None:
        """One hole, among the cells near it: what is far from a hole costs nothing."""
        rows = patch.near(far < max(2 * hole.radius, 1.5 * hole.radius + 4 * self.spacing) + self.spacing)
        nodes = np.unique(patch.cells[rows])
        nodes = nodes[nodes >= 0]
        cells = np.where(patch.cells[rows] < 0, -1, np.searchsorted(nodes, patch.cells[rows]))
        made = _Cut(k, hole, self.spacing, Cut(patch.chart[nodes], cells, patch.inner[nodes]), bend, period, centre)
        made.made(patch.order[rows])
        patch.chart[nodes], patch.inner[nodes] = made.chart, made.inner
        patch.points[nodes] = np.where(made.used[:, None], bend(made.chart)[0], np.inf)
        patch.cells = np.concatenate([patch.cells[~rows], np.where(made.cells < 0, -1, nodes[made.cells])])
        patch.order = np.concatenate([patch.order[~rows], made.order])

    def _centre(self, k: int, hole: HoleIn, far: np.ndarray, patch: _Patch, bend: Bend, period: float | None) -> np.ndarray | None:
        """Where in the chart the centre of a hole is; None where the patch does not hold it. far (N,): of each node from it [m]."""
        target = np.asarray(hole.centre)
        node = int(np.argmin(far))
        if k not in self.nearest or far[node] < self.nearest[k][0]:
            self.nearest[k] = float(far[node]), patch.points[node].copy()
        if far[node] > 3 * self.spacing:
            return None
        at = patch.chart[node].copy()
        step = 1e-4 * self.spacing
        for _ in range(20):  # the foot of the centre on the surface
            here = bend(np.stack([at, at + [step, 0], at + [0, step]]))[0]
            along = (here[1:] - here[0]) / step
            move = np.linalg.lstsq(along.T, target - here[0], rcond=None)[0]
            at = at + move
            if np.linalg.norm(move) < 1e-12 * self.spacing:
                break
        off = float(np.linalg.norm(bend(at[None])[0][0] - target))
        if off > 0.1 * self.spacing or not _holds(patch.chart, patch.cells[patch.near(far < 5 * self.spacing)], at, period):
            return None
        return at


@dataclass
class _Cut:
    """One hole at work. arm (N, 2): from its centre to each node in the chart; moved (N,): nodes that do not stand where they stood; used
    (N,): nodes that have a cell still."""

    number: int
    hole: HoleIn
    spacing: float
    before: Cut
    bend: Bend
    period: float | None
    centre: np.ndarray

    def made(self, order: np.ndarray) -> None:
        """Cuts the hole: chart and inner of all nodes, cells that stay, and their order from that (M,) of the cells before."""
        self.chart, self.cells, self.inner = self.before.chart, self.before.cells, self.before.inner
        radius = self.hole.radius
        middle, axis = self.bend(self.centre[None])
        self.middle, self.axis = middle[0], axis[0]
        self.arm = self._arms(self.chart)
        points, normals = self.bend(self.centre + self.arm)
        chord = np.linalg.norm(points - self.middle, axis=1)
        upright = normals @ self.axis
        off = self._off_axis(self.arm)
        if ((upright < TURNS) & (upright > 0) & (off < radius) & (chord < 2 * radius)).any():
            raise SceneError(
                f"holes[{self.number}] is {_mm(2 * radius)} wide, and the surface turns away by more than 60 deg within; it must be smaller"
            )
        self.near = (chord < 1.5 * radius + 4 * self.spacing) & (upright > 0.3)
        out = np.where(self.near, off - radius, np.inf)
        outline = ~self.inner & (out < MARGIN * self.spacing)
        if outline.any():
            left = _mm(max(0.0, float(out[outline].min())))
            raise SceneError(
                f"holes[{self.number}] at {_place(self.hole.centre)} comes within {left} of an edge of its "
                f"part of the surface; at least one spacing, {_mm(self.spacing)}, is needed"
            )
        on_rim = self._snapped(out)
        cells, order = self._outside(out, order)
        rim = _loop(cells, on_rim)
        stray = np.setdiff1d(np.flatnonzero(on_rim), rim)  # moved for the sake of nodes that were moved later themselves
        on_rim[stray] = False
        self.arm[stray] = self._arms(self.chart[stray])
        out[stray] = self.spacing  # let the evening out find their place
        if len(rim) < FEWEST:
            raise SceneError(
                f"holes[{self.number}] is {_mm(2 * radius)} wide, and its rim would have {len(rim)} nodes; at least {FEWEST} are needed: "
                "lower the spacing"
            )
        self._evened(cells, rim, out)
        self.cells, self.order = self._halved(cells, order, on_rim)
        self.used = np.zeros(len(self.chart), bool)
        self.used[self.cells[self.cells >= 0]] = True
        self.inner = self.inner & ~on_rim  # a rim is a border, which another hole must not touch
        self._look(self.cells)
        # where the chart closes on itself, the nodes stay in the turn in which they were
        self.chart = np.where(self.moved[:, None], self.chart + self.arm - self._arms(self.chart), self.chart)

    def _arms(self, chart: np.ndarray) -> np.ndarray:
        """From the centre to nodes, in the chart, the short way round."""
        arm = chart - self.centre
        if self.period is not None:
            arm[:, 0] -= self.period * np.round(arm[:, 0] / self.period)
        return arm

    def _off_axis(self, arm: np.ndarray) -> np.ndarray:
        """Distance of points of the chart from the hole's axis [m]."""
        way = self.bend(self.centre + arm)[0] - self.middle
        return np.linalg.norm(way - np.outer(way @ self.axis, self.axis), axis=1)

    def _put_at(self, nodes: np.ndarray, radius: float) -> None:
        """Move nodes, each along its own direction in the chart, to that distance from the axis."""
        arm = self.arm[nodes]
        for _ in range(8):
            arm = arm * (radius / self._off_axis(arm))[:, None]
        self.arm[nodes] = arm
        self.moved[nodes] = True

    def _snapped(self, out: np.ndarray) -> np.ndarray:
        """(N,) bool: nodes that were moved onto the rim; `out` becomes 0 there."""
        on_rim = np.abs(out) < 1e-6 * self.spacing
        out[on_rim] = 0.0
        sides = _sides(self.cells[(np.isfinite(out)[self.cells] & (self.cells >= 0)).any(axis=1)])
        crossing = np.flatnonzero(out[sides[:, 0]] * out[sides[:, 1]] < 0)
        neighbours: dict[int, list[int]] = {}
        for a, b in sides[crossing]:
            neighbours.setdefault(int(a), []).append(int(b))
            neighbours.setdefault(int(b), []).append(int(a))
        for node in sorted(neighbours, key=lambda i: (abs(out[i]), i)):
            if any(out[node] * out[other] < 0 for other in neighbours[node]):
                out[node] = 0.0
                on_rim[node] = True
        self.moved = np.zeros(len(out), bool)
        self._put_at(np.flatnonzero(on_rim), self.hole.radius)
        return on_rim

    def _outside(self, out: np.ndarray, order: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The cells outside with their order; of a quadrangle that the rim crosses along its diagonal, the outer triangle."""
        there = self.cells >= 0
        side = np.where(there, np.sign(out[self.cells]), 0.0)
        keep = ~np.any(side < 0, axis=1) & np.any(side > 0, axis=1)
        cells = np.where(keep[:, None], self.cells, -2)
        for row in np.flatnonzero((side < 0).any(axis=1) & (side > 0).any(axis=1)):
            k = int(np.argmax(side[row] > 0))
            cells[row] = [self.cells[row, (k - 1) % 4], self.cells[row, k], self.cells[row, (k + 1) % 4], -1]
        kept = cells[:, 0] != -2
        return cells[kept], order[kept]

    def _evened(self, cells: np.ndarray, rim: np.ndarray, out: np.ndarray) -> None:
        """Even out the rim and the nodes around it, and make the rim's polygon as large as the circle."""
        n = len(self.chart)
        free = self.inner & (out > 0) & (out < REACH * self.spacing)
        sides = _sides(cells[(free[cells] & (cells >= 0)).any(axis=1)])
        i, j = np.concatenate([sides[:, 0], sides[:, 1]]), np.concatenate([sides[:, 1], sides[:, 0]])
        count = np.maximum(np.bincount(i, minlength=n), 1)
        mine = free[i]
        i, j = i[mine], j[mine]
        size = self.hole.radius
        for _ in range(ROUNDS):
            mean = np.column_stack([np.bincount(i, self._between(i, j)[:, c], minlength=n) for c in range(2)]) / count[:, None]
            self.arm[free] += 0.5 * mean[free]
            ahead, back = np.roll(rim, -1), np.roll(rim, 1)
            self.arm[rim] = 0.5 * self.arm[rim] + 0.25 * (self.arm[ahead] + self.arm[back])
            self._put_at(rim, size)
            size *= np.sqrt(np.pi * self.hole.radius**2 / self._open(rim))
        self._put_at(rim, size)
        self.moved |= free

    def _between(self, i: np.ndarray, j: np.ndarray) -> np.ndarray:
        way = self.arm[j] - self.arm[i]
        if self.period is not None:
            way[:, 0] -= self.period * np.round(way[:, 0] / self.period)
        return way

    def _open(self, rim: np.ndarray) -> float:
        """Area of the rim's polygon, seen along the axis [m2]."""
        p = self.bend(self.centre + self.arm[rim])[0] - self.middle
        return abs(float(0.5 * np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0) @ self.axis))

    def _halved(self, cells: np.ndarray, order: np.ndarray, on_rim: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Quadrangles with an almost straight angle at a rim node, as two triangles that meet there; the second stands behind the first."""
        cells, more, places = cells.copy(), [], []
        for row in map(int, np.flatnonzero((cells[:, 3] >= 0) & (on_rim[cells].sum(axis=1) == 3))):
            cell = cells[row]
            k = (int(np.argmin(on_rim[cell])) + 2) % 4  # opposite the node off the rim
            before, after = self.arm[cell[(k - 1) % 4]] - self.arm[cell[k]], self.arm[cell[(k + 1) % 4]] - self.arm[cell[k]]
            bent = before[0] * after[1] - before[1] * after[0]  # negative where the corner is convex
            if bent > 0 or before @ after < BLUNT * np.linalg.norm(before) * np.linalg.norm(after):
                c = np.roll(cell, -k)
                cells[row] = [c[0], c[1], c[2], -1]
                more.append([c[0], c[2], c[3], -1])
                places.append(order[row] + 1)
        return np.concatenate([cells, np.reshape(more, (-1, 4)).astype(cells.dtype)]), np.concatenate([order, places]).astype(int)

    def _look(self, cells: np.ndarray) -> None:
        """SceneError where a cell at the hole is folded."""
        touched = (np.where(cells < 0, False, self.moved[cells])).any(axis=1)
        cells = cells[touched]
        p = self.arm[np.where(cells < 0, cells[:, :1], cells)]
        after, before = np.roll(p, -1, axis=1) - p, np.roll(p, 1, axis=1) - p
        turn = after[..., 0] * before[..., 1] - after[..., 1] * before[..., 0]
        three = cells[:, 3] < 0
        turn[three] = turn[three, 1:2]
        if (turn <= 0).any():
            raise SceneError(
                f"holes[{self.number}] at {_place(self.hole.centre)} cannot be cut into these cells; lower spacing or irregularity"
            )


def rims(mesh: SurfaceMesh) -> list[tuple[np.ndarray, np.ndarray]]:
    """Of each opening of a mesh the points of its rim (K, 3) [m] and the unit normal of the plane nearest to them."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    open_ = mesh.edges.nodes[mesh.edges.sides[:, 1] < 0]
    n = len(mesh.points)
    loop = connected_components(coo_array((np.ones(len(open_)), (open_[:, 0], open_[:, 1])), shape=(n, n)), directed=False)[1]
    found = []
    for number in np.unique(loop[open_]):
        rim = mesh.points[np.unique(open_[loop[open_[:, 0]] == number])]
        found.append((rim, np.linalg.svd(rim - rim.mean(axis=0), full_matrices=False)[2][-1]))
    return found


def lids(mesh: SurfaceMesh) -> np.ndarray:
    """(T, 3, 3) triangles that close the openings of a mesh: from the sides of each to its middle."""
    open_ = mesh.edges.nodes[mesh.edges.sides[:, 1] < 0]
    if not len(open_):
        return np.empty((0, 3, 3))
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    n = len(mesh.points)
    loop = connected_components(coo_array((np.ones(len(open_)), (open_[:, 0], open_[:, 1])), shape=(n, n)), directed=False)[1]
    middle = np.zeros((n, 3))
    for number in np.unique(loop[open_]):
        middle[number] = mesh.points[np.unique(open_[loop[open_[:, 0]] == number])].mean(axis=0)
    return np.stack([mesh.points[open_[:, 0]], mesh.points[open_[:, 1]], middle[loop[open_[:, 0]]]], axis=1)


def _sides(cells: np.ndarray) -> np.ndarray:
    """(K, 2) sides of the cells, each once."""
    after = np.roll(cells, -1, axis=1)
    three = cells[:, 3] < 0
    after[three, 2] = cells[three, 0]
    sides = np.sort(np.stack([cells.ravel(), after.ravel()], axis=1), axis=1)
    return np.unique(sides[sides[:, 0] >= 0], axis=0)


def _loop(cells: np.ndarray, on_rim: np.ndarray) -> np.ndarray:
    """The rim's nodes in a row: those sides of one cell only whose ends are both on it."""
    after = np.roll(cells, -1, axis=1)
    three = cells[:, 3] < 0
    after[three, 2] = cells[three, 0]
    sides = np.stack([cells.ravel(), after.ravel()], axis=1)
    sides = sides[(sides >= 0).all(axis=1)]
    sides = sides[on_rim[sides].all(axis=1)]
    followed = {(int(a), int(b)) for a, b in sides}
    following = {a: b for a, b in followed if (b, a) not in followed}
    start = min(following)
    loop = [start]
    while following[loop[-1]] != start:
        loop.append(following[loop[-1]])
    return np.asarray(loop)


def _holds(chart: np.ndarray, cells: np.ndarray, at: np.ndarray, period: float | None) -> bool:
    """Whether a point of the chart lies in a cell."""
    p = chart[np.where(cells < 0, cells[:, :1], cells)] - at
    if period is not None:
        p[..., 0] -= period * np.round(p[:, :1, 0] / period)
        p[..., 0] -= period * np.round((p[..., 0] - p[:, :1, 0]) / period)
    q = np.roll(p, -1, axis=1)
    turn = p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]
    return bool((turn >= -1e-12 * np.abs(turn).max()).all(axis=1).any())


def _mm(length: float) -> str:
    return f"{length * 1000:.4g} mm"


def _place(point: Sequence[float] | np.ndarray) -> str:
    return "(" + ", ".join(f"{x:.4g}" for x in point) + ") m"
