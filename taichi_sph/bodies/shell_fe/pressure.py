"""Pressure on finite elements: the work-conjugate forces of their corners.

    f_k = p int N_k (x_,r x x_,s) dr ds        follower; dead: of the reference X

Over a quadrangle x_,r x x_,s is linear in r and s, so the integral is a sum of three products; over a triangle it is constant.
On a closed surface the follower pressure does exactly p dV.
"""

from collections.abc import Sequence

from ...runtime import ti
from ..shell.pressure import BOOK, LEAVE, Pressed, SurfacePressures
from .elements import Elements
from .shapes import CORNER


class CornerPressures(SurfacePressures):
    """Pressures on elements: `press` adds to the forces of their corners. A row holds four of them."""

    def __init__(self, pressed: Sequence[Pressed], internal: Elements, name: str = "pressure"):
        super().__init__(pressed, internal.cells, name, each=4)
        self.internal = internal

    def act(self, n: int, row: int, pressure: float, book: int, push: int) -> None:
        _press(self, self.internal, n, row, pressure, book, push)


@ti.func
def _face(term: ti.template(), e, moved: ti.template()):
    """(4, 3) vector areas of the corners of element e [m2]; moved = 0: of the reference."""
    x = ti.Matrix.zero(float, 4, 3)
    for k in ti.static(range(4)):
        i = term.corner[e][k]
        for c in ti.static(range(3)):
            x[k, c] = ti.cast(term.nodes.X[i][c] - term.nodes.X[term.corner[e][0]][c], float) + moved * term.nodes.u[i][c]
    area = x * 0.0
    if term.cells.n_corners[e] == 3:
        one, two = ti.Vector([x[1, c] - x[0, c] for c in range(3)]), ti.Vector([x[2, c] - x[0, c] for c in range(3)])
        third = one.cross(two) / 6.0
        for k in ti.static(range(3)):
            for c in ti.static(range(3)):
                area[k, c] = third[c]
    else:
        r = ti.Vector([0.25 * (-x[0, c] + x[1, c] + x[2, c] - x[3, c]) for c in range(3)])
        s = ti.Vector([0.25 * (-x[0, c] - x[1, c] + x[2, c] + x[3, c]) for c in range(3)])
        h = ti.Vector([0.25 * (x[0, c] - x[1, c] + x[2, c] - x[3, c]) for c in range(3)])
        whole, along, up = r.cross(s), r.cross(h), h.cross(s)
        for k in ti.static(range(4)):
            for c in ti.static(range(3)):
                area[k, c] = whole[c] + (CORNER[k, 0] * along[c] + CORNER[k, 1] * up[c]) / 3.0
    return area


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
        e = load.cell[q]
        follows = load.follows[q]
        area = _face(term, e, follows)
        for k in range(term.cells.n_corners[e]):
            force = ti.Vector([0.0 * p, 0.0, 0.0])
            for j in ti.static(range(4)):
                if j == k:
                    force = p * ti.Vector([area[j, c] for c in range(3)])
            place = term.nodes.u[term.corner[e][k]]
            if push == 1:
                term.corner_force[4 * e + k] += force
            if book == BOOK:
                load.work[q] += 0.5 * (force + load.force[4 * q + k]).dot(place - load.place[4 * q + k])
            if book != LEAVE:
                load.force[4 * q + k] = force
                load.place[4 * q + k] = place
