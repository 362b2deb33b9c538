"""Pressure on the surface of a shell that bends, galerkin form.

The force of a cell acts on the mean position of the cell, which is a sum of edge means with the weights b_e (bearing.py). So each side
takes its share b_e f_s, and the internal forces carry the shares on to the nodes.
"""

from collections.abc import Sequence

from ...runtime import ti
from ..shell.pool import Cells
from ..shell.pressure import BOOK, LEAVE, Pressed, SurfacePressures
from .galerkin import Galerkin


class SidePressures(SurfacePressures):
    """Pressures on cells, as forces on their sides: `press` adds to the side forces of the internal term."""

    def __init__(self, pressed: Sequence[Pressed], internal: Galerkin, cells: Cells, name: str = "pressure"):
        super().__init__(pressed, cells, name)
        self.internal = internal

    def act(self, n: int, row: int, pressure: float, book: int, push: int) -> None:
        _press(self, self.internal, n, row, pressure, book, push)


@ti.kernel
def _press(
    load: ti.template(),
    term: ti.template(),
    n: ti.i32,
    row: ti.i32,
    p: float,
    book: ti.i32,
    push: ti.i32,
):
    for m in range(n):
        q = row + m
        s = load.cell[q]
        if term.cells.broken[s] == 0:
            x1, x2 = term.cells.a1[s], term.cells.a2[s]
            place = x1 * 0.0
            for k in range(term.cells.n_corners[s]):
                u = term.edge_u[term.cells.edge[s][k]]
                place += term.bears[4 * s + k] * u
                if load.follows[q] == 1:
                    g = term.side[4 * s + k]
                    x1 += g[0] * u
                    x2 += g[1] * u
            force = p * term.cells.area[s] * x1.cross(x2)
            if push == 1:
                for k in range(term.cells.n_corners[s]):
                    term.side_force[4 * s + k] += term.bears[4 * s + k] * force
            if book == BOOK:
                load.work[q] += 0.5 * (force + load.force[q]).dot(place - load.place[q])
            if book != LEAVE:
                load.force[q] = force
                load.place[q] = place
