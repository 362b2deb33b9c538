"""The port of bodies that water can press on: a surface made of points, each with a vector area.

A fluid's coupling (couplings/wetted) lays the points of all groups side by side in one pool and asks nothing of what they belong to.
Each kind of body writes its own points into a range of rows (`lay`) and takes the forces on them (`bear`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from .. import runtime
from ..pool import Pool
from ..runtime import ti
from .body import Group

LEAST = 1e-30  # m2, less than any area


class SurfacePoints(Pool):
    """All points that one group of fluids can press on.

    A point is thin where water may stand on both sides of it, `half` [m] off its middle surface; otherwise its vector area points to
    the only side that there is.
    """

    def __init__(self, name: str, n: int, origin: np.ndarray):
        """origin [m]: records are relative to it, which single precision needs."""
        super().__init__(name)
        self.n = n
        self.origin = self.field("origin", 1, 3, "f64", unit="m", doc="records are relative to it")
        self.x = self.field("x", n, 3, "f64", unit="m", doc="where the point is now")
        self.was = self.field("was", n, 3, "f64", unit="m", keeps=True, doc="x at the fluid's step before")
        self.record = self.field("record", n, 12, doc="x - origin | vector area | velocity | half, -1 where not thin | area | 1 / area")
        self.push = self.field("push", n, 3, unit="N", doc="of the water on the point")
        runtime.put(self.origin, np.asarray(origin, float).reshape(1, 3))

    @ti.func
    def note(self, k, x, a, v, half, thin, since):
        """The record of point k: place x [m], vector area a [m2], velocity v [m/s]; since > 0 [s]: the mean velocity over that time
        instead."""
        if since > 0.0:
            v = (x - self.was[k]) / since
        self.x[k], self.was[k] = x, x
        for c in ti.static(range(3)):
            self.record[k][c] = ti.cast(x[c] - self.origin[0][c], float)
            self.record[k][3 + c] = ti.cast(a[c], float)
            self.record[k][6 + c] = ti.cast(v[c], float)
        self.record[k][9] = ti.cast(ti.select(thin == 1, half, -1.0), float)
        size = ti.cast(a, float).norm()
        self.record[k][10], self.record[k][11] = size, 1.0 / ti.max(size, LEAST)

    @ti.func
    def place(self, k):
        return ti.Vector([self.record[k][0], self.record[k][1], self.record[k][2]])

    @ti.func
    def area(self, k):
        return ti.Vector([self.record[k][3], self.record[k][4], self.record[k][5]])

    @ti.func
    def velocity(self, k):
        return ti.Vector([self.record[k][6], self.record[k][7], self.record[k][8]])

    @ti.func
    def size(self, k):
        """Area of point k [m2]."""
        return self.record[k][10]

    @ti.func
    def normal(self, k):
        """Unit vector along the area of point k; 0 where there is none."""
        return self.area(k) * self.record[k][11]

    @ti.func
    def half(self, k):
        """Half the thickness at a thin point k [m]."""
        return self.record[k][9]

    @ti.func
    def thin(self, k):
        """Whether water may stand on both sides of point k."""
        return self.record[k][9] >= 0.0

    @ti.func
    def lost(self, k):
        """Whether point k has no cell any more, and no area from now on."""
        return self.record[k][11] >= 0.5 / LEAST

    @ti.func
    def hide(self, k):
        """Point k has no area now."""
        for c in ti.static(range(3)):
            self.record[k][3 + c] = 0.0
        self.record[k][10] = 0.0


class Wettable(Protocol):
    """Points of one group. `lightest` [kg/m2]: mass per area of the lightest body that is free to move, infinite where none is;
    `halves` [m]: the half thicknesses that thin points have."""

    n: int
    thin: bool
    halves: Sequence[float]
    lightest: float

    def pools(self) -> Sequence[Pool]: ...

    def lay(self, points: SurfacePoints, first: int, since: float) -> None:
        """Writes the points as they are now into the rows from `first` on."""
        ...

    def bear(self, points: SurfacePoints, first: int, times: int) -> None:
        """Takes the forces of those rows as a blow of so many steps of the clock; times 0: the fluid takes no step now."""
        ...


def wettables(groups: Sequence[Group], name: str, spacing: float, meets: Callable[[str], bool]) -> list[Wettable]:
    """The points of all groups that have some."""
    return [one for k, group in enumerate(groups, start=1) for one in group.wettables(f"{name}.surface_{k}", spacing, meets)]
