"""Neighbours of many moving points: points put in order of their cells, and for each a list with a skin.

Space is cut into cells of half the reach; a cell's number counts first along x, so the cells that a point has to
look at lie side by side in memory, row by row. Numbers wrap round (a torus of N_x N_y N_z cells): points may go
anywhere, memory stays, and two places that share a cell are told apart by the distance, which is asked anyway.

Points may differ in `size`: 1 of those with the whole support, 1/2, 1/4 of others. Two points then are neighbours within the mean of their
supports. Each size has cells of its own, of half its own reach, and stands together in memory: so no point is asked that cannot be near.

A list holds every point nearer than `reach` = support + skin when it was built; it stays complete until two points
can have moved by `skin` relative to each other. Testing candidates costs as much as the forces, so lists pay (docs/method.md).
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from .. import runtime
from ..pool import Pool
from ..runtime import ti
from .cells import group

WIDE = 5  # cells that a query sees along each axis: at least so many there must be, or one would be seen twice
BLOCK = 4096


class Sizes(NamedTuple):
    """size (N,): field of the points' supports over the whole one; all: the values that it takes; skin [m] of the lists, which is in the
    reach."""

    size: Any
    all: tuple[float, ...]
    skin: float


class Neighbours(Pool):
    """Cells and lists of n points. `x` (N, 3) f64 [m] is kept in cell order by the owner (see `order`).

    number (N,) i32 of neighbours, the point itself included; near: those of point i from `begin(i, width)` on.
    """

    def __init__(self, name: str, x: Any, n: int, reach: float, spacing: float, box: np.ndarray, sizes: Sizes | None = None):
        """spacing [m]: so far apart points usually are; box (2, 3) [m]: where they are at first. Both only set sizes of fields. sizes: of
        the points, where they differ; reach is that of two whole ones."""
        super().__init__(name)
        self.x, self.n = x, n
        self.near: Any = None
        self.reach, self.sizes, self.sized = reach, sizes, sizes is not None
        if sizes is None:
            self.inverse, sides = 2.0 / reach, self._sides(box, 2.0 / reach, WIDE)
            self.cells = int(sides.prod())
            self.sides = self.field("sides", 3, dtype="i32", doc="cells along each axis")
            runtime.put(self.sides, sides.astype(np.int32))
        else:
            self._level(sizes, box)
        self.start = self.field("start", self.cells + 2, dtype="i32", doc="first point of each cell")
        self.source = self.field("source", n, dtype="i32", doc="where each point stood before the sort")
        self.number = self.field("number", n, dtype="i32", doc="of neighbours, the point itself included")
        self.built = self.field("built", n, 3, "f64", unit="m", keeps=True, doc="x when the lists were built")
        self.blocks = -(-n // BLOCK)
        self.extreme = self.field("extreme", self.blocks, 6, "f64", unit="m", doc="of the displacements since then, by block")
        self._widen(4.19 * (reach / spacing) ** 3)

    def _sides(self, box: np.ndarray, inverse: float, wide: int) -> np.ndarray:
        """(3,) cells along each axis, of side 1 / inverse [m]; wide: so many are seen from a point."""
        sides = np.ceil((box[1] - box[0]) * inverse).astype(int) + wide + 1
        while sides.prod() > max(4 * self.n, 1000) and sides.max() > wide + 1:
            sides[sides.argmax()] = max(wide + 1, sides.max() // 2)
        return sides

    def _level(self, sizes: Sizes, box: np.ndarray) -> None:
        """Cells of each size, the sizes one after the other."""
        self.size, self.levels, support = sizes.size, len(sizes.all), self.reach - sizes.skin
        self.counts = [128] * self.levels  # places in the list of each point, by its size
        inverse = np.array([2.0 / (sizes.skin + support * size) for size in sizes.all])
        farthest = [math.ceil((sizes.skin + 0.5 * support * (1.0 + size)) * one) for size, one in zip(sizes.all, inverse)]
        sides = np.array([self._sides(box, float(one), 2 * far + 1) for one, far in zip(inverse, farthest)])
        first = np.cumsum([0, *sides.prod(axis=1)])
        self.cells = int(first[-1])
        self.all = self.field("all", self.levels, dtype="f64", doc="the sizes")
        self.per = self.field("per", self.levels, dtype="f64", unit="1/m", doc="cells of each size per length")
        self.side = self.field("side", self.levels, 3, "i32", doc="cells of each size along each axis")
        self.first = self.field("first", self.levels, dtype="i32", doc="cell of each size")
        self.at = self.field("at", self.n + 1, dtype="i32", doc="where the list of each point begins")
        self.low = self.field("low", self.levels, 3, "f64", unit="m", doc="of the box around the points of each size")
        self.high = self.field("high", self.levels, 3, "f64", unit="m", doc="of the box around the points of each size")
        for field, values in ((self.all, np.array(sizes.all)), (self.per, inverse), (self.side, sides), (self.first, first[:-1])):
            runtime.put(field, values.astype(np.int32) if field in (self.side, self.first) else values)

    def order(self) -> None:
        """`source`: the points' numbers sorted by cell, the order within a cell kept. The owner then moves them."""
        if self.sizes is not None:
            _cells_sized(self, self.n)
        elif runtime.one_by_one():
            _sort(self, self.n, self.cells, self.inverse)
            return
        else:
            _cells(self, self.n, self.inverse)
        group(self.number, self.start, self.source, self.n, self.cells)

    def list(self) -> None:
        """The lists of points that stand in the order of `order`."""
        if self.sizes is not None:
            self._list_sized(self.sizes.skin)
            return
        self._build()
        most = int(runtime.get(self.number, self.n).max())
        if most > self.width:
            self._widen(most)
            self._build()

    def _build(self) -> None:
        _build(self, self.near, self.n, self.inverse, self.reach, self.width)

    def _list_sized(self, skin: float) -> None:
        """The same of points of several sizes. Those at a jump have several times as many neighbours as others of their size."""
        begin = runtime.get(self.start, self.cells + 1)[runtime.get(self.first, self.levels)]
        self._bound(begin)
        while True:
            self._lay_out(self.counts, begin)
            _build_sized(self, self.near, self.n, self.reach - skin, skin)
            most = [int(part.max(initial=0)) for part in np.split(runtime.get(self.number, self.n), begin[1:])]
            if all(found <= room for found, room in zip(most, self.counts)):
                return
            self.counts = [max(room, math.ceil(1.25 * found / 8) * 8) for found, room in zip(most, self.counts)]

    def _bound(self, begin: np.ndarray) -> None:
        """The box around the points of each size, which stand together, from `begin` (levels,) on."""
        x = runtime.get(self.x, self.n)
        boxes = [(part.min(axis=0), part.max(axis=0)) for part in np.split(x, begin[1:])]
        for field, values in zip((self.low, self.high), zip(*boxes)):
            runtime.put(field, np.array(values))

    def renew(self) -> None:
        """The lists again, from the places that they were built from; the points stand in that order already."""
        now = runtime.get(self.x, self.n)
        runtime.put(self.x, runtime.get(self.built, self.n))
        self.order()
        self.list()
        runtime.put(self.x, now)

    def moved(self) -> float:
        """How far two points can have moved relative to each other since the lists were built [m]."""
        _extremes(self, self.n, self.blocks)
        e = runtime.get(self.extreme, self.blocks)
        low, high = e[:, :3].min(axis=0), e[:, 3:6].max(axis=0)
        return float(np.linalg.norm(high - low))

    def _lay_out(self, counts: Sequence[int], begin: np.ndarray) -> None:
        """Lists with room for so many neighbours of each point of a size."""
        at = np.concatenate([[0], np.cumsum(np.repeat(counts, np.diff(np.append(begin, self.n))))])
        if at[-1] > self.near.shape[0]:
            self.near = self.field("near", math.ceil(1.25 * at[-1]), dtype="i32", grows=True, doc="neighbours of point i from at[i] on")
        runtime.put(self.at, at.astype(np.int32))

    @ti.func
    def begin(self, i, width):
        """Where the list of point i begins."""
        result = i * width
        if ti.static(self.sized):
            result = self.at[i]
        return result

    def _widen(self, most: float) -> None:
        """Room for `most` neighbours and a quarter more."""
        self.width = math.ceil(1.25 * most / 8) * 8
        self.near = self.field("near", self.n * self.width, dtype="i32", grows=True, doc="neighbours of point i from i * width on")

    @ti.func
    def cell(self, x, inverse):
        """Cell of the place x, not yet wrapped."""
        return ti.cast(ti.floor(x * inverse), ti.i32)

    @ti.func
    def wrap(self, k, axis: ti.template()):
        """Cell number k along an axis, in 0 ... sides - 1."""
        side = self.sides[axis]
        return k - side * ti.cast(ti.floor(ti.cast(k, ti.f64) / side), ti.i32)

    @ti.func
    def row(self, y, z):
        """Number of the first cell of the row y, z (not yet wrapped)."""
        return (self.wrap(z, 2) * self.sides[1] + self.wrap(y, 1)) * self.sides[0]


@ti.kernel
def _sort(nb: ti.template(), n: ti.i32, cells: ti.i32, inverse: ti.f64):
    # one thread: 1 % of the time between two sorts, and the order cannot depend on the number of threads
    ti.loop_config(serialize=True)
    for _ in range(1):
        for c in range(cells + 2):
            nb.start[c] = 0
        for i in range(n):
            c = nb.cell(nb.x[i], inverse)
            nb.number[i] = nb.row(c[1], c[2]) + nb.wrap(c[0], 0)
            nb.start[nb.number[i] + 2] += 1
        for c in range(cells):
            nb.start[c + 2] += nb.start[c + 1]
        for i in range(n):
            c = nb.number[i] + 1
            nb.source[nb.start[c]] = i
            nb.start[c] += 1


@ti.kernel
def _cells(nb: ti.template(), n: ti.i32, inverse: ti.f64):
    for i in range(n):
        c = nb.cell(nb.x[i], inverse)
        nb.number[i] = nb.row(c[1], c[2]) + nb.wrap(c[0], 0)


@ti.func
def _turned(k, side):
    """Cell number k, less than one turn away from 0 ... side - 1, wrapped."""
    return k + ti.select(k < 0, side, 0) - ti.select(k >= side, side, 0)


@ti.kernel
def _build(nb: ti.template(), near: ti.template(), n: ti.i32, inverse: ti.f64, reach: ti.f64, width: ti.i32):
    for i in range(n):
        x = nb.x[i]
        nb.built[i] = x
        home = nb.cell(x, inverse)
        a, b, c = nb.wrap(home[0], 0), nb.wrap(home[1], 1), nb.wrap(home[2], 2)
        first, last = _turned(a - 2, nb.sides[0]), _turned(a + 2, nb.sides[0])
        k = 0
        # all of each row: to ask which of its cells the sphere reaches costs more than the candidates that it saves
        for dc in range(-2, 3):
            layer = _turned(c + dc, nb.sides[2]) * nb.sides[1]
            for db in range(-2, 3):
                row = (layer + _turned(b + db, nb.sides[1])) * nb.sides[0]
                start, stop = nb.start[row + first], nb.start[row + last + 1]
                # each candidate is written and only a hit is kept: no branch to mispredict
                if first > last:  # the row wraps round: its other piece
                    for j in range(nb.start[row], stop):
                        near[i * width + ti.min(k, width - 1)] = j
                        k += ti.select((nb.x[j] - x).norm_sqr() < reach * reach, 1, 0)
                    stop = nb.start[row + nb.sides[0]]
                for j in range(start, stop):
                    near[i * width + ti.min(k, width - 1)] = j
                    k += ti.select((nb.x[j] - x).norm_sqr() < reach * reach, 1, 0)
        nb.number[i] = k


@ti.func
def _wrapped(k, side):
    """Cell number k in 0 ... side - 1."""
    return k - side * ti.cast(ti.floor(ti.cast(k, ti.f64) / side), ti.i32)


@ti.kernel
def _cells_sized(nb: ti.template(), n: ti.i32):
    for i in range(n):
        level = 0
        for l in range(nb.levels):
            if ti.cast(nb.size[i], ti.f64) < nb.all[l] + 1e-3:
                level = l
        c = ti.cast(ti.floor(nb.x[i] * nb.per[level]), ti.i32)
        side = nb.side[level]
        nb.number[i] = nb.first[level] + (_wrapped(c[2], side[2]) * side[1] + _wrapped(c[1], side[1])) * side[0] + _wrapped(c[0], side[0])


@ti.kernel
def _build_sized(nb: ti.template(), near: ti.template(), n: ti.i32, support: ti.f64, skin: ti.f64):
    """As `_build`, for each size in its own cells."""
    for i in range(n):
        x, size = nb.x[i], ti.cast(nb.size[i], ti.f64)
        nb.built[i] = x
        at, last, k = nb.at[i], nb.at[i + 1] - nb.at[i] - 1, 0
        for level in range(nb.levels):
            side, base = nb.side[level], nb.first[level]
            home = ti.cast(ti.floor(x * nb.per[level]), ti.i32)
            reach = skin + 0.5 * support * (size + nb.all[level])
            far, square = ti.cast(ti.ceil(reach * nb.per[level]), ti.i32), reach * reach
            if any(x + reach < nb.low[level]) or any(x - reach > nb.high[level]):
                continue
            a, b, c = _wrapped(home[0], side[0]), _wrapped(home[1], side[1]), _wrapped(home[2], side[2])
            begin, end = _turned(a - far, side[0]), _turned(a + far, side[0])
            for dc in range(-far, far + 1):
                layer = _turned(c + dc, side[2]) * side[1]
                for db in range(-far, far + 1):
                    row = base + (layer + _turned(b + db, side[1])) * side[0]
                    start, stop = nb.start[row + begin], nb.start[row + end + 1]
                    if begin > end:  # the row wraps round: its other piece
                        for j in range(nb.start[row], stop):
                            near[at + ti.min(k, last)] = j
                            k += ti.select((nb.x[j] - x).norm_sqr() < square, 1, 0)
                        stop = nb.start[row + side[0]]
                    for j in range(start, stop):
                        near[at + ti.min(k, last)] = j
                        k += ti.select((nb.x[j] - x).norm_sqr() < square, 1, 0)
        nb.number[i] = k


@ti.kernel
def _extremes(nb: ti.template(), n: ti.i32, blocks: ti.i32):
    for b in range(blocks):
        low = ti.Vector([ti.math.inf, ti.math.inf, ti.math.inf], ti.f64)
        high = -low
        for i in range(b * BLOCK, ti.min(n, (b + 1) * BLOCK)):
            d = nb.x[i] - nb.built[i]
            low = ti.min(low, d)
            high = ti.max(high, d)
        for c in ti.static(range(3)):
            nb.extreme[b][c] = low[c]
            nb.extreme[b][3 + c] = high[c]
