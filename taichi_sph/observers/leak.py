"""Which particles of a fluid have left a tank. The gauge looks at the samples of the histories.

The directors of a closed shell point outwards. A particle is outside when it passes two tests. It lies beyond the nearest node of the tank
as it is now: on the side of the node's director, by more than half the thickness. And it lies beyond the nearest node of the tank as it
was at t = 0, in the same sense. The first test alone would be deceived by a lip bent inwards, the second alone by a bulge of the wall.
A particle that is outside once counts as escaped for good.

The tank is the largest piece that live cells hold together: the plug that a striker pushes through the water is no wall. A look asks only
those particles that may have come to a wall since they were last asked.

A tank of elements with particles in it is two bodies. The nodes of both are its nodes. The two hold together where a particle stands on a
node of an element at t = 0, which is in the overlap alone.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from .. import runtime
from ..bodies.body import Span, holding
from ..bodies.shell.said import PARTICLES
from ..pool import Pool
from .opening import opening

if TYPE_CHECKING:
    from ..scene.schema import Scene


SAME = 1e-3  # of the spacing: nodes of two parts that are so near stand in one place

QUICKLY = {"balanced_tree": False, "compact_nodes": False}  # a tree that is asked once: building it costs more than the asking

UNITS = {
    "escaped_mass": "kg", "escaped_count": "-", "rate": "kg/s", "jet_speed": "m/s", "jet_x": "-", "jet_y": "-", "jet_z": "-",
    "opening_area": "m2",
}  # fmt: skip


class Walls(Protocol):
    """What the gauge reads of a group that holds a fluid: `nodes` with u, v, N, d and fragment, `cells` with broken; of a body, what was
    said of it, its mesh, and its spans of nodes and cells."""

    nodes: Any
    cells: Any

    def of(self, name: str) -> Any: ...


class Filled(Protocol):
    """What the gauge reads of a group that is held: `body` with the pool p of particles, numbered() and fastest()."""

    body: Any

    def of(self, name: str) -> Span: ...


class LeakGauge(Pool):
    """Watches one fluid in one closed shell. name: of its history; parts: the group and the body of each part of the shell."""

    kept = ("outside", "room", "looked", "before", "rate", "jet")

    def __init__(self, name: str, tank: Sequence[tuple[Walls, str]], fluid: Filled, filled: str):
        """tank: the groups that hold the parts of the shell, with the names of those; fluid: a group; filled: the name of its body."""
        super().__init__(name)
        self.parts = [(group, group.of(part)) for group, part in tank]
        meshes = [body.mesh for _, body in self.parts]
        self.points = np.concatenate([mesh.points for mesh in meshes])  # m, of all parts, at t = 0
        self.half = np.concatenate([0.5 * body.thickness for _, body in self.parts])
        self.spacing = max(mesh.spacing for mesh in meshes)
        self.joints = self._joints()
        self.fluid, self.span = fluid, fluid.of(filled)
        n = self.span.n
        self.outside = np.zeros(n, bool)  # by number at the start
        self.room = np.zeros(n)  # m, how far a particle was from the shell when it was last looked at
        self.looked = np.zeros(n)  # s, when
        self.before = np.zeros(2)  # time [s] and escaped mass [kg] of the sample before
        self.rate, self.jet = 0.0, np.zeros(3)  # kg/s, m/s: of the last sample
        self.row = self._row()  # of the last sample; asking for it again changes nothing

    def renew(self) -> None:
        self.row = self._row()

    def shows(self) -> dict[str, np.ndarray]:
        """What frames show of the fluid."""
        return {"outside": self.outside.astype(np.uint8)}

    def _of(self, name: str) -> np.ndarray:
        """The values of a field of nodes at those of the tank."""
        return np.concatenate([_at_nodes(group, body, name) for group, body in self.parts])

    def _joints(self) -> np.ndarray:
        """(J, 2) numbers of nodes of two parts that stand in one place at t = 0."""
        if len(self.parts) == 1:
            return np.zeros((0, 2), int)
        from scipy.spatial import cKDTree

        (_, one), (_, other) = self.parts
        least = min(one.mesh.spacing, other.mesh.spacing)
        away, second = cKDTree(other.mesh.points).query(one.mesh.points)
        first = np.flatnonzero(away < SAME * least)
        return np.column_stack([first, len(one.mesh.points) + second[first]])

    @property
    def escaped(self) -> float:
        """Mass that has left [kg]."""
        body = self.fluid.body
        own = slice(self.span.first, self.span.first + self.span.n)
        return float((self.outside / body.p.parts[own] ** 3).sum() * body.p.masses[body.p.of[self.span.first]])

    def look(self, time: float) -> dict[str, float]:
        """Looks, and returns the row of the history now."""
        from scipy.spatial import cKDTree

        p = self.fluid.body.p
        order = self.fluid.body.numbered()[self.span.first : self.span.first + self.span.n]
        x = runtime.get(p.x, p.n)[order]
        v = runtime.get(p.v, p.n)[order].astype(np.float64)
        half = self.half
        fastest = max(self.fluid.body.fastest(), np.linalg.norm(self._of("v"), axis=1).max())
        whole = self._whole()
        asked = np.flatnonzero(~self.outside & (self.room <= 2.0 * fastest * (time - self.looked) + self.spacing))
        if len(asked):
            places = self.points + self._of("u")
            director = self._of("N") + self._of("d")
            distance, nearest = cKDTree(places[whole], **QUICKLY).query(x[asked])
            beyond = np.einsum("ni,ni->n", x[asked] - places[whole][nearest], director[whole][nearest])
            passed = np.flatnonzero(beyond > half[whole[nearest]])
            if len(passed):
                _, first = self.at_first.query(x[asked[passed]])
                before = np.einsum("ni,ni->n", x[asked[passed]] - self.points[first], self._of("N")[first])
                passed = passed[before > half[first]]
            left = asked[passed]
            self.outside[left] = True
            self.room[asked], self.looked[asked] = distance, time
        else:
            left = asked
        since = time - self.before[0]
        if since > 0:
            self.rate = (self.escaped - self.before[1]) / since
            self.before = np.array([time, self.escaped])
        if len(left):
            self.jet = np.average(v[left], axis=0, weights=1.0 / p.parts[self.span.first + left] ** 3)
        self.row = self._row(whole)
        return self.row

    @functools.cached_property
    def at_first(self) -> Any:
        """The nodes at t = 0, to be asked which is the nearest."""
        from scipy.spatial import cKDTree

        return cKDTree(self.points)

    def _row(self, whole: np.ndarray | None = None) -> dict[str, float]:
        speed = float(np.linalg.norm(self.jet))
        direction = self.jet / speed if speed else self.jet
        return {
            "escaped_mass": self.escaped,
            "escaped_count": int(self.outside.sum()),
            "rate": self.rate,
            "jet_speed": speed,
            **{f"jet_{axis}": float(direction[c]) for c, axis in enumerate("xyz")},
            "opening_area": self.opening(whole),
        }

    def _whole(self) -> np.ndarray:
        """Numbers of the nodes of the largest piece."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        ends, n = [self.joints], 0
        for group, body in self.parts:
            cells = body.mesh.cells[_broken(group, body) == 0]
            pairs = np.column_stack([cells[:, [0, 1, 2]].ravel(), cells[:, [1, 2, 3]].ravel()])
            ends.append(n + pairs[pairs[:, 1] >= 0])
            n += body.nodes.n
        first, other = np.concatenate(ends).T
        links = coo_array((np.ones(len(first)), (first, other)), shape=(n, n))
        _, piece = connected_components(links, directed=False)
        return np.flatnonzero(piece == np.bincount(piece).argmax())

    def opening(self, whole: np.ndarray | None = None) -> float:
        """Area [m2] that is open (opening.py). whole: of the nodes of the largest piece, where they are known."""
        broken = [_broken(group, body) == 1 for group, body in self.parts]
        if not any(cells.any() for cells in broken):
            return 0.0
        held = np.zeros(len(self.points), bool)
        held[self._whole() if whole is None else whole] = True
        total, n = 0.0, 0
        for (group, body), torn in zip(self.parts, broken):
            mesh, own = body.mesh, slice(n, n + body.nodes.n)
            corners = np.where(mesh.cells < 0, mesh.cells[:, :1], mesh.cells)
            sound = ~torn & held[own][corners].all(axis=1)
            loose = _at_nodes(group, body, "fragment") == 1
            total += opening(mesh.points + _at_nodes(group, body, "u"), mesh.cells, mesh.edges.sides, mesh.areas, torn, loose, sound)
            n += body.nodes.n
        return total


def _at_nodes(group: Any, body: Any, name: str) -> np.ndarray:
    """The values of a field of nodes at those of a body."""
    first = body.nodes.first
    return runtime.get(getattr(group.nodes, name), group.nodes.n)[first : first + body.nodes.n]


def _broken(group: Any, body: Any) -> np.ndarray:
    """Of the cells of a body: 1 where broken."""
    own = body.cells
    return runtime.get(group.cells.broken, group.cells.n)[own.first : own.first + own.n]


def gauges(scene: Scene, groups: Sequence[Any]) -> list[LeakGauge]:
    """One for each fluid that fills a shell; where there are several their histories are called by the fluids."""
    shells = {shell.name for shell in scene.shells}  # a rigid tank does not leak
    filled = [(fluid, tank) for fluid in scene.fluids if (tank := getattr(fluid.fill, "shell", None)) in shells]
    called = {fluid.name: "leak" if len(filled) == 1 else f"leak_{fluid.name}" for fluid, _ in filled}
    return [LeakGauge(called[f.name], _parts(groups, tank), holding(groups, f.name)[0], f.name) for f, tank in filled]


def _parts(groups: Sequence[Any], shell: str) -> list[tuple[Any, str]]:
    """The groups that hold a shell, or its elements and its particles, and what those are called there."""
    names = (shell, shell + PARTICLES)
    return [(group, name) for name in names for group in groups for span in group.bodies if span.name == name]
