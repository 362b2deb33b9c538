"""Which particles of a fluid have left a tank. The gauge looks at the samples of the histories.

The directors of a closed shell point outwards. A particle is outside when it passes two tests. It lies beyond the nearest node of the tank
as it is now: on the side of the node's director, by more than half the thickness. And it lies beyond the nearest node of the tank as it
was at t = 0, in the same sense. The first test alone would be deceived by a lip bent inwards, the second alone by a bulge of the wall.
A particle that is outside once counts as escaped for good.

The tank is the largest piece that live cells hold together: the plug that a striker pushes through the water is no wall. A look asks only
those particles that may have come to a wall since they were last asked.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .. import runtime
from ..pool import Pool

if TYPE_CHECKING:
    from ..bodies.fluid.group import FluidGroup
    from ..bodies.shell_sph.group import ShellGroup


UNITS = {
    "escaped_mass": "kg", "escaped_count": "-", "rate": "kg/s", "jet_speed": "m/s", "jet_x": "-", "jet_y": "-", "jet_z": "-",
    "opening_area": "m2",
}  # fmt: skip


class LeakGauge(Pool):
    """Watches one fluid in one closed shell."""

    kept = ("outside", "room", "looked", "before", "rate", "jet")

    def __init__(self, tank: ShellGroup, fluid: FluidGroup):
        """tank: the group of the shell; fluid: that of the fluid."""
        super().__init__("leak")
        self.tank, self.fluid = tank, fluid
        n = fluid.body.p.n
        self.outside = np.zeros(n, bool)  # by number at the start
        self.room = np.zeros(n)  # m, how far a particle was from the shell when it was last looked at
        self.looked = np.zeros(n)  # s, when
        self.before = np.zeros(2)  # time [s] and escaped mass [kg] of the sample before
        self.rate, self.jet = 0.0, np.zeros(3)  # kg/s, m/s: of the last sample
        self.row = self._row(0.0)  # of the last sample; asking for it again changes nothing

    def look(self, time: float) -> dict[str, float]:
        """Looks, and returns the row of histories/leak.csv now."""
        from scipy.spatial import cKDTree

        tank, p = self.tank, self.fluid.body.p
        order = np.argsort(runtime.get(p.id, p.n))
        x = runtime.get(p.x, p.n)[order]
        v = runtime.get(p.v, p.n)[order].astype(np.float64)
        fastest = max(self.fluid.body.fastest(), np.linalg.norm(runtime.get(tank.nodes.v, tank.nodes.n), axis=1).max())
        asked = np.flatnonzero(~self.outside & (self.room <= 2.0 * fastest * (time - self.looked) + tank.spacing))
        if len(asked):
            nodes = tank.mesh.points + runtime.get(tank.nodes.u, tank.nodes.n)
            director = runtime.get(tank.nodes.N, tank.nodes.n) + runtime.get(tank.nodes.d, tank.nodes.n)
            whole = self._tank()
            distance, nearest = cKDTree(nodes[whole]).query(x[asked])
            beyond = np.einsum("ni,ni->n", x[asked] - nodes[whole][nearest], director[whole][nearest])
            passed = np.flatnonzero(beyond > 0.5 * tank.shell.thickness)
            if len(passed):
                X, N = tank.mesh.points, runtime.get(tank.nodes.N, tank.nodes.n)
                _, first = cKDTree(X).query(x[asked[passed]])
                before = np.einsum("ni,ni->n", x[asked[passed]] - X[first], N[first])
                passed = passed[before > 0.5 * tank.shell.thickness]
            left = asked[passed]
            self.outside[left] = True
            self.room[asked], self.looked[asked] = distance, time
        else:
            left = asked
        mass = p.one * int(self.outside.sum())
        since = time - self.before[0]
        if since > 0:
            self.rate = (mass - self.before[1]) / since
            self.before = np.array([time, mass])
        if len(left):
            self.jet = v[left].mean(axis=0)
        self.row = self._row(mass)
        return self.row

    def _row(self, mass: float) -> dict[str, float]:
        speed = float(np.linalg.norm(self.jet))
        direction = self.jet / speed if speed else self.jet
        return {
            "escaped_mass": mass,
            "escaped_count": int(self.outside.sum()),
            "rate": self.rate,
            "jet_speed": speed,
            **{f"jet_{axis}": float(direction[c]) for c, axis in enumerate("xyz")},
            "opening_area": self.opening(),
        }

    def _tank(self) -> np.ndarray:
        """Numbers of the nodes of the largest piece."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        cells = self.tank.mesh.cells[runtime.get(self.tank.cells.broken, self.tank.cells.n) == 0]
        first, other = cells[:, [0, 1, 2]].ravel(), cells[:, [1, 2, 3]].ravel()
        n = self.tank.nodes.n
        linked = other >= 0
        links = coo_array((np.ones(linked.sum()), (first[linked], other[linked])), shape=(n, n))
        _, piece = connected_components(links, directed=False)
        return np.flatnonzero(piece == np.bincount(piece).argmax())

    def opening(self) -> float:
        """Area [m2] of the broken cells as they lie now, less what they had: cracks count by their width. A cell that has lost
        a node to a fragment counts as it was."""
        tank = self.tank
        broken = np.flatnonzero(runtime.get(tank.cells.broken, tank.cells.n) == 1)
        if not len(broken):
            return 0.0
        cells = tank.mesh.cells[broken]
        corners = np.where(cells < 0, cells[:, :1], cells)
        x = tank.mesh.points + runtime.get(tank.nodes.u, tank.nodes.n)
        a, b, c, d = (x[corners[:, k]] for k in range(4))
        now = 0.5 * np.linalg.norm(np.cross(c - a, d - b), axis=1)
        was = tank.mesh.areas[broken]
        lost = (runtime.get(tank.nodes.fragment, tank.nodes.n)[corners] == 1).any(axis=1)
        return float(np.where(lost, was, np.clip(now - was, 0.0, 4.0 * was)).sum())
