"""Grid hash: which points lie near a place. Counting sort by hand, for fixed and for moving points.

Space is cut into cubes of side `reach`; a cube's number is hashed into a table of fixed size, so the
extent of the points does not matter. A query looks at 27 cubes; because two cubes may share a place in
the table, a point counts only when it truly lies in the cube asked for, which also excludes doubles.
"""

from typing import Any

import numpy as np

from .. import runtime
from ..runtime import ti

CUBES = 27  # the one that holds a point, and those around it


@ti.data_oriented
class CellGrid:
    """Points (field of 3-vectors), their number, and the largest distance that will be asked for [m]."""

    def __init__(self, name: str, points: Any, n: int, reach: float):
        self.points = points
        self.n = n
        self.reach = reach
        self.table = 1 << max(4, (2 * n - 1).bit_length())
        self.start = runtime.new(f"{name}.start", self.table + 1, dtype="i32")
        self.sorted = runtime.new(f"{name}.sorted", n, dtype="i32")
        self.around = runtime.new(f"{name}.around", self.table, dtype="i32")
        self.rebuild()

    def rebuild(self) -> None:
        """Sort the points anew (they may have moved)."""
        if runtime.one_by_one():
            _sort(self, self.n, self.table, 1.0 / self.reach)
        else:
            _buckets(self, self.n, self.table, 1.0 / self.reach)
            group(self.sorted, self.start, self.sorted, self.n, self.table)
        _mark(self, self.n, self.table, 1.0 / self.reach)


@ti.func
def cube(x, inverse_reach):
    """Cube that holds the point x."""
    return ti.cast(ti.floor(x * inverse_reach), ti.i32)


@ti.func
def bucket(c, table):
    """Place of a cube in the table (Teschner et al. 2003)."""
    return ((c[0] * 73856093) ^ (c[1] * 19349663) ^ (c[2] * 83492791)) & (table - 1)


@ti.func
def beside(grid: ti.template(), x, k, inverse_reach, table):
    """Cube k of the CUBES around the point x, and where its bucket begins and ends in `sorted`.

    A point j of the bucket counts when `all(cube(places[j], inverse_reach) == there)`: another cube may share the bucket.
    """
    there = cube(x, inverse_reach) + ti.Vector([k // 9 - 1, k // 3 % 3 - 1, k % 3 - 1])
    place = bucket(there, table)
    return there, grid.start[place], grid.start[place + 1]


@ti.func
def alone(grid: ti.template(), x, inverse_reach, table):
    """Whether none of the CUBES around the point x holds a point: most queries end here."""
    return grid.around[bucket(cube(x, inverse_reach), table)] == 0


@ti.kernel
def _mark(grid: ti.template(), n: ti.i32, table: ti.i32, inverse_reach: ti.f64):
    """around: 1 where a cube of the bucket is one of the CUBES around a point. Many points write the same 1."""
    for c in range(table):
        grid.around[c] = 0
    for m in range(n):
        middle = cube(grid.points[grid.sorted[m]], inverse_reach)
        fresh = 1  # most share their cube with the one before
        if m > 0:
            fresh = ti.select(all(cube(grid.points[grid.sorted[m - 1]], inverse_reach) == middle), 0, 1)
        if fresh == 1:
            for k in range(CUBES):
                grid.around[bucket(middle + ti.Vector([k // 9 - 1, k // 3 % 3 - 1, k % 3 - 1]), table)] = 1


@ti.kernel
def _sort(grid: ti.template(), n: ti.i32, table: ti.i32, inverse_reach: ti.f64):
    # one thread: the order inside a bucket must not depend on the number of threads
    ti.loop_config(serialize=True)
    for _ in range(1):
        for c in range(table + 1):
            grid.start[c] = 0
        for i in range(n):
            grid.start[bucket(cube(grid.points[i], inverse_reach), table) + 1] += 1
        for c in range(table):
            grid.start[c + 1] += grid.start[c]
        # fill from the back, which leaves start[c] at the first point of bucket c again
        for k in range(n):
            i = n - 1 - k
            b = bucket(cube(grid.points[i], inverse_reach), table) + 1
            grid.start[b] -= 1
            grid.sorted[grid.start[b]] = i
        # start[b + 1] now points at the beginning of bucket b: shift back by one
        for c in range(table):
            grid.start[c] = grid.start[c + 1]
        grid.start[table] = n


@ti.kernel
def _buckets(grid: ti.template(), n: ti.i32, table: ti.i32, inverse_reach: ti.f64):
    for i in range(n):
        grid.sorted[i] = bucket(cube(grid.points[i], inverse_reach), table)


def group(owner: Any, start: Any, entry: Any, n: int, owners: int) -> None:
    """Puts n entries in order of their owners, those of one owner in their own order, in NumPy.

    Fields of i32: owner (n) of each entry; start (owners + 1), where the entries of each owner begin; entry (n), their numbers in that
    order, which may be the field `owner` itself.
    """
    whose = runtime.get(owner, n)
    runtime.put(entry, np.argsort(whose, kind="stable").astype(np.int32))
    runtime.put(start, np.concatenate([[0], np.cumsum(np.bincount(whose, minlength=owners))]).astype(np.int32))


def running(start: Any, n: int) -> int:
    """Counts of n owners, from start[1] on, become where each one's entries begin; returns how many there are."""
    if runtime.one_by_one():
        return _running(start, n)
    counts = runtime.get(start, n + 1)
    counts[0] = 0
    runtime.put(start, np.cumsum(counts, dtype=np.int32))
    return int(counts.sum())


@ti.kernel
def _running(start: ti.template(), n: ti.i32) -> ti.i32:
    total = 0
    ti.loop_config(serialize=True)
    for _ in range(1):
        start[0] = 0
        for i in range(n):
            total += start[i + 1]
            start[i + 1] = total
    return total
