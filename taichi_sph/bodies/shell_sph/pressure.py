"""Pressure on the surface of a shell that bends (galerkin form).

    f_s = p (x_,1 x x_,2) A        follower: turns and grows with the cell
    f_s = p (a_1 x a_2) A          dead: that of the reference

acting on the cell's mean position, which is a sum of edge means (w_e); so each side takes its share w_e f_s and
the way back to the nodes is that of the internal forces. Broken cells carry none.
"""

from ...numerics.reduce import Reducer
from ...pool import Pool
from ...runtime import ti
from .galerkin import Galerkin
from .pool import Cells

LEAVE, BOOK, START = 0, 1, 2  # do not touch the work, add to it, or only begin anew from here


@ti.data_oriented
class SurfacePressure(Pool):
    """One pressure of the scene. `press` adds to the side forces of the internal term."""

    def __init__(self, number: int, internal: Galerkin, cells: Cells, value: float, rise: float, follower: bool):
        super().__init__(f"pressure{number}")
        self.internal, self.cells = internal, cells
        self.value, self.rise, self.follower = value, rise, follower
        self.force = self.field("force", cells.n, 3, unit="N", doc="of the step before", keeps=True)
        self.place = self.field("place", cells.n, 3, unit="m", doc="mean displacement of the step before", keeps=True)
        self.work = self.field("work", cells.n, unit="J", doc="done so far, trapezoidal", keeps=True)

    def now(self, time: float) -> float:
        """Pressure [Pa] at `time` (T 2.111)."""
        return self.value * (time / self.rise if time < self.rise else 1.0)

    def press(self, time: float, book: int = BOOK) -> None:
        """Add the side forces of the pressure at `time`; book its work since the last booked call."""
        _press(self, self.internal, self.cells, self.cells.n, self.now(time), int(self.follower), book, 1)

    def before_rupture(self, time: float) -> None:
        """Book the way to `time` while the cells still stand where their old rows saw them."""
        _press(self, self.internal, self.cells, self.cells.n, self.now(time), int(self.follower), BOOK, 0)

    def done(self, reducer: Reducer) -> float:
        """Work so far [J]."""
        return reducer.total(self.work, self.cells.n)


@ti.kernel
def _press(
    load: ti.template(),
    term: ti.template(),
    cells: ti.template(),
    n: ti.i32,
    p: float,
    follower: ti.i32,
    book: ti.i32,
    push: ti.i32,
):
    for s in range(n):
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
                load.work[s] += 0.5 * (force + load.force[s]).dot(place - load.place[s])
            if book != LEAVE:
                load.force[s] = force
                load.place[s] = place
