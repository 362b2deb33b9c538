"""Pressure on the surface of a shell that bends: what all forms share.

    f_s = p (x_,1 x x_,2) A        follower: turns and grows with the cell
    f_s = p (a_1 x a_2) A          dead: that of the reference

A form says how the force of a cell reaches its nodes. Broken cells carry no pressure.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ... import runtime
from ...numerics.reduce import Reducer
from ...pool import Pool
from ...scene.histories import Points, factor
from .pool import Cells, Topology

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
    """The pressures on a group of shells, one row for each cell that each presses on. `press` adds to the forces of the internal term.

    each: forces of a row, which act at as many places."""

    def __init__(self, pressed: Sequence[Pressed], cells: Cells | Topology, name: str = "pressure", each: int = 1):
        super().__init__(name)
        self.pressed, self.cells = pressed, cells
        n = sum(len(one.cells) for one in pressed)
        self.cell = self.field("cell", n, dtype="i32", doc="number of the cell of a row")
        runtime.put(self.cell, np.concatenate([one.cells for one in pressed]).astype(np.int32))
        self.follows = self.field("follows", n, dtype="i32", doc="1: the pressure of a row turns and grows with its cell")
        runtime.put(self.follows, np.concatenate([np.full(len(one.cells), one.follower, np.int32) for one in pressed]))
        self.n = n
        self.force = self.field("force", each * n, 3, unit="N", doc="of the step before", keeps=True)
        self.place = self.field("place", each * n, 3, unit="m", doc="mean displacement of the step before", keeps=True)
        self.work = self.field("work", n, unit="J", doc="done so far, trapezoidal", keeps=True)

    def press(self, time: float, book: int = BOOK, push: int = 1) -> None:
        """Add the forces of the pressures at `time`; book their work since the last booked call."""
        self.press_with([one.now(time) for one in self.pressed], book, push)

    def press_with(self, values: Sequence[float] | np.ndarray, book: int = BOOK, push: int = 1) -> None:
        """The same with a value [Pa] for each of `pressed`."""
        row = 0
        for one, value in zip(self.pressed, values):
            n = len(one.cells)
            self.act(n, row, float(value), book, push)
            row += n

    def on_cells(self, values: Sequence[float] | np.ndarray, m: int, follower: bool) -> np.ndarray:
        """(m,) sum of the pressures on each cell that follow the surface, or of those that do not [Pa]."""
        total = np.zeros(m)
        for one, value in zip(self.pressed, values):
            if one.follower == follower:
                np.add.at(total, one.cells, value)
        return total

    def act(self, n: int, row: int, pressure: float, book: int, push: int) -> None:
        """Forces of `n` rows from `row` on, of one pressure [Pa]."""
        raise NotImplementedError

    def before_rupture(self, time: float) -> None:
        """Book the way to `time` while the cells still stand where their old rows saw them."""
        self.press(time, BOOK, 0)

    def done(self, reducer: Reducer) -> float:
        """Work so far [J]."""
        return reducer.total(self.work, self.n)
