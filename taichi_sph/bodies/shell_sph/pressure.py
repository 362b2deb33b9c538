"""Pressure on the surface of a shell that bends (galerkin form).

    f_s = p (x_,1 x x_,2) A        follower: turns and grows with the cell
    f_s = p (a_1 x a_2) A          dead: that of the reference

The force acts on the mean position of the cell, which is a sum of edge means with the weights w_e. So each side takes its share
w_e f_s, and the internal forces carry the shares on to the nodes. Broken cells carry no pressure.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ... import runtime
from ...numerics.reduce import Reducer
from ...pool import Pool
from ...runtime import ti
from ...scene.histories import Points, factor
from .galerkin import Galerkin
from .pool import Cells

LEAVE, BOOK, START = 0, 1, 2  # do not touch the work, add to it, or only begin anew from here


@dataclass(frozen=True)
class Pressed:
    """One pressure of the scene: the numbers of its cells, its full value [Pa], the points of its history, whether it follows."""

    cells: np.ndarray
    value: float
    curve: Points
    follower: bool

    def now(self, time: float) -> float:
        """Pressure [Pa] at `time`."""
        return self.value * factor(self.curve, time)


class SurfacePressures(Pool):
    """The pressures on a group of shells, one row for each cell that each presses on. `press` adds to the side forces of the
    internal term."""

    def __init__(self, pressed: Sequence[Pressed], internal: Galerkin, cells: Cells, name: str = "pressure"):
        super().__init__(name)
        self.pressed, self.internal, self.cells = pressed, internal, cells
        self.n = n = sum(len(one.cells) for one in pressed)
        self.cell = self.field("cell", n, dtype="i32", doc="number of the cell of a row")
        runtime.put(self.cell, np.concatenate([one.cells for one in pressed]).astype(np.int32))
        self.force = self.field("force", n, 3, unit="N", doc="of the step before", keeps=True)
        self.place = self.field("place", n, 3, unit="m", doc="mean displacement of the step before", keeps=True)
        self.work = self.field("work", n, unit="J", doc="done so far, trapezoidal", keeps=True)

    def press(self, time: float, book: int = BOOK, push: int = 1) -> None:
        """Add the side forces of the pressures at `time`; book their work since the last booked call."""
        row = 0
        for one in self.pressed:
            n = len(one.cells)
            _press(self, self.internal, self.cells, n, row, one.now(time), int(one.follower), book, push)
            row += n

    def before_rupture(self, time: float) -> None:
        """Book the way to `time` while the cells still stand where their old rows saw them."""
        self.press(time, BOOK, 0)

    def done(self, reducer: Reducer) -> float:
        """Work so far [J]."""
        return reducer.total(self.work, self.n)


@ti.kernel
def _press(
    load: ti.template(),
    term: ti.template(),
    cells: ti.template(),
    n: ti.i32,
    row: ti.i32,
    p: float,
    follower: ti.i32,
    book: ti.i32,
    push: ti.i32,
):
    for m in range(n):
        q = row + m
        s = load.cell[q]
        if cells.broken[s] == 0:
            x1, x2 = cells.a1[s], cells.a2[s]
            place = x1 * 0.0
            for k in range(cells.n_corners[s]):
                u = term.edge_u[cells.edge[s][k]]
                place += term.share[4 * s + k] * u
                if follower == 1:
                    g = term.side[4 * s + k]
                    x1 += g[0] * u
                    x2 += g[1] * u
            force = p * cells.area[s] * x1.cross(x2)
            if push == 1:
                for k in range(cells.n_corners[s]):
                    term.side_force[4 * s + k] += term.share[4 * s + k] * force
            if book == BOOK:
                load.work[q] += 0.5 * (force + load.force[q]).dot(place - load.place[q])
            if book != LEAVE:
                load.force[q] = force
                load.place[q] = place
