"""Frozen neighbourhoods with MLS coefficients: rows (where something is evaluated) x sources (what is summed).

A row is evaluated at one or two points of the reference surface. Two points are the Gauss points of an edge, and the row keeps their
mean. A row sums sources of its own body alone. Its coefficients are

    "value"     mean of Phi_j                        edge means of the galerkin form
    "residual"  delta_ij - Phi_j at node i           what stabilises the galerkin form
    "gradient"  (Phi_j,1, Phi_j,2)                   the collocation form; with `values` Phi_j as the third

The pattern never grows after t = 0. A rupture cuts links, bit by bit, one bit per evaluation point: those that cross a broken cell, and
those that lean on one across a void (voids.py). The MLS of the touched rows is made anew (T 2.3.6.4). The transposed list lets each source
gather what the rows send back, in a fixed order and without atomics.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import runtime
from ...numerics import mls
from ...numerics.cells import CUBES, CellGrid, beside, cube, group, running
from ...numerics.kernel import b3, b3_slope
from ...numerics.visibility import along, crosses
from ...pool import Pool
from ...runtime import ti


@dataclass(frozen=True)
class Sources:
    """What rows sum over, S of them."""

    X: Any  # field (S, 3) f64: reference positions
    n: int
    dead: Any  # field (S,) i32: 1 = takes part in nothing any more
    body: Any = None  # field (S,) i32: number of its body; None: there is one body
    weight: Any = None  # field (S,): factor on the kernel weight; None: 1


@dataclass(frozen=True)
class Rows:
    """Where something is evaluated, R places."""

    points: np.ndarray  # (R, 2, 3) evaluation points; the second repeats the first where there is one
    n_points: np.ndarray  # (R,) 1 or 2
    frames: np.ndarray  # (R, 3, 3) rows t1, t2, n
    h: np.ndarray  # (R,) smoothing length [m]
    order: Any  # (R,) 0, 1 or 2; one number: that of all
    body: np.ndarray | None = None  # (R,) number of the body
    residual_of: np.ndarray | None = None  # (R,) source whose residual this row is, or -1

    @staticmethod
    def at(places: np.ndarray, frames: np.ndarray, h: np.ndarray, order: int, body: np.ndarray) -> "Rows":
        """Rows of one point each."""
        return Rows(np.repeat(places[:, None], 2, axis=1), np.ones(len(places)), frames, h, order, body)


class Links(Pool):
    """CSR neighbourhoods. Public fields: start (R+1), source (P), coef (P) or (P, 2 or 3), alive (R)
    and, where `transposed`, t_start (S+1), t_row (P), t_coef (P)."""

    def __init__(
        self, name: str, sources: Sources, rows: Rows, *, gradient: bool = False, values: bool = False, transposed: bool = False
    ) -> None:
        super().__init__(name)
        points, h, n_sources = rows.points, rows.h, sources.n
        self.n = len(points)
        self.n_sources = n_sources
        self.sources = sources.X
        self.dead_source = sources.dead
        self.gradient, self.values = gradient, values
        self.weighs = sources.weight is not None
        self.weight = sources.weight
        self.transposed = transposed
        self.leans = False
        self.several = sources.body is not None
        self.source_body = sources.body
        if rows.body is not None and self.several:
            self.body = self._ints("body", rows.body, "number of the body of the row")
        n = self.n
        self.at = self.field("at", 2 * n, 3, "f64", unit="m", doc="evaluation points, two a row")
        runtime.put(self.at, np.ascontiguousarray(points.reshape(-1, 3)))
        self.t1 = self.field("t1", n, 3, "f64", doc="tangent frame of the row")
        self.t2 = self.field("t2", n, 3, "f64", doc="tangent frame of the row")
        runtime.put(self.t1, np.ascontiguousarray(rows.frames[:, 0]))
        runtime.put(self.t2, np.ascontiguousarray(rows.frames[:, 1]))
        self.h = self.field("h", n, dtype="f64", unit="m", doc="smoothing length")
        runtime.put(self.h, h.astype(np.float64))
        self.n_points = self._ints("n_points", rows.n_points, "evaluation points, 1 or 2")
        self.order = self._ints("order", np.broadcast_to(rows.order, n), "of the fit")
        self.residual_of = self._ints("residual_of", np.full(n, -1) if rows.residual_of is None else rows.residual_of, "source, or -1")
        self.own = self._ints("own", np.zeros(n), "1: the row's own place joins its moment matrix (T 2.2.3.2)", keeps=True)
        self.alive = self._ints("alive", np.ones(n), "0: the row sees nothing any more")
        self.touched = self.field("touched", n, dtype="i32", doc="rows that the last rupture touched")
        self.n_touched = self.field("n_touched", 1, dtype="i32", doc="how many they are")
        self.start = self.field("start", n + 1, dtype="i32", doc="where the pairs of a row begin")

        reach = 2.0 * float(h.max()) + 0.5 * float(np.linalg.norm(points[:, 1] - points[:, 0], axis=1).max(initial=0))
        grid = CellGrid(f"{name}.grid", sources.X, n_sources, reach * (1 + 1e-9))
        pairs = int(_count(self, grid, n, grid.table, 1.0 / grid.reach))
        self.pairs = pairs
        self.source = self.field("source", pairs, dtype="i32", doc="source of a pair")
        self.cut = self.field("cut", pairs, dtype="i8", doc="bit g: a crack hides the source from evaluation point g", keeps=True)
        self.coef = self.field("coef", pairs, (3 if values else 2) if gradient else 0, doc="coefficients of a pair")
        if transposed:
            self.t_start = self.field("t_start", n_sources + 1, dtype="i32", doc="where the rows of a source begin")
            self.t_row = self.field("t_row", pairs, dtype="i32", doc="row of a transposed pair")
            self.t_coef = self.field("t_coef", pairs, doc="coefficient of a transposed pair")
            self.slot = self.field("slot", pairs, dtype="i32", doc="place of a pair among the transposed ones")
        _fill(self, grid, n, grid.table, 1.0 / grid.reach)
        if transposed:
            _turn_round(self, n, n_sources)

    def _ints(self, name: str, values: np.ndarray, doc: str, keeps: bool = False) -> Any:
        field = self.field(name, len(values), dtype="i32", doc=doc, keeps=keeps)
        runtime.put(field, np.asarray(values, np.int32))
        return field

    def renew_all(self) -> None:
        """MLS of every row."""
        _renew(self, 0, self.n)

    def lean(self, on: np.ndarray) -> None:
        """Links over a void (voids.py): on (K, 4) row, pair, evaluation point, and a cell that hides the pair when it breaks. Told once,
        before anything breaks."""
        on = on[np.lexsort(on.T[::-1])]
        self.leans = True
        self.lean_start = self._ints(
            "lean_start", np.r_[0, np.cumsum(np.bincount(on[:, 0], minlength=self.n))], "where those of a row begin"
        )
        self.lean_pair = self._ints("lean_pair", on[:, 1], "pair whose chord leaves the body over a rim")
        self.lean_bit = self._ints("lean_bit", 1 << on[:, 2], "bit of its evaluation point")
        self.lean_cell = self._ints("lean_cell", on[:, 3], "cell at that rim")

    def cut_through(self, cells: Any, new_cells: Any, n_new: int) -> int:
        """Cut what newly broken cells hide, and what leads to dead sources; returns the rows touched."""
        runtime.fill(self.n_touched, 0)
        _cut(self, cells, self.n, new_cells, n_new)
        return int(runtime.get(self.n_touched, 1)[0])

    def renew_touched(self, n_touched: int) -> None:
        """MLS of the rows that `cut_through` touched."""
        _renew(self, 1, n_touched)

    def apply(self, of_source: np.ndarray, component: int | None = None) -> np.ndarray:
        """(S, c) values of the sources -> (R, c): the rows applied to them (on the host, for what is made once)."""
        import scipy.sparse

        coef = runtime.get(self.coef, self.pairs).astype(np.float64)
        coef = coef if component is None else np.ascontiguousarray(coef[:, component])
        start, source = runtime.get(self.start, self.n + 1), runtime.get(self.source, self.pairs)
        return scipy.sparse.csr_matrix((coef, source, start), (self.n, self.n_sources)) @ of_source

    def renew(self) -> None:
        """The coefficients follow from what is cut."""
        self.renew_all()


@ti.func
def _near(links: ti.template(), r, j):
    """1 when source j is of the body of row r and lies in the support of one of its evaluation points."""
    reach = 2.0 * links.h[r]
    result = 0
    for g in range(links.n_points[r]):
        if (links.sources[j] - links.at[2 * r + g]).norm() < reach:
            result = 1
    if ti.static(links.several):
        if links.source_body[j] != links.body[r]:
            result = 0
    return result


@ti.func
def _visit(links: ti.template(), grid: ti.template(), r, table, inverse_reach, write: ti.template()):
    """Neighbours of row r in a fixed order: counts them, and writes them from start[r] on where asked."""
    middle = 0.5 * (links.at[2 * r] + links.at[2 * r + 1])
    count = 0
    for k in range(CUBES):
        there, first, last = beside(grid, middle, k, inverse_reach, table)
        for m in range(first, last):
            j = grid.sorted[m]
            if all(cube(links.sources[j], inverse_reach) == there):
                if _near(links, r, j):
                    if ti.static(write):
                        links.source[links.start[r] + count] = j
                    count += 1
    return count


@ti.kernel
def _count_rows(links: ti.template(), grid: ti.template(), n: ti.i32, table: ti.i32, inverse_reach: ti.f64):
    for r in range(n):
        links.start[r + 1] = _visit(links, grid, r, table, inverse_reach, False)


def _count(links: Links, grid: CellGrid, n: int, table: int, inverse_reach: float) -> int:
    _count_rows(links, grid, n, table, inverse_reach)
    return running(links.start, n)


@ti.kernel
def _fill(links: ti.template(), grid: ti.template(), n: ti.i32, table: ti.i32, inverse_reach: ti.f64):
    for r in range(n):
        _visit(links, grid, r, table, inverse_reach, True)


def _turn_round(links: Links, n: int, n_sources: int) -> None:
    """The entries of each source, in the order of the rows."""
    if runtime.one_by_one():
        _transpose(links, n, n_sources)
        return
    start = runtime.get(links.start, n + 1)
    group(links.source, links.t_start, links.t_row, int(start[n]), n_sources)
    entry = runtime.get(links.t_row, int(start[n]))
    runtime.put(links.t_row, np.repeat(np.arange(n, dtype=np.int32), np.diff(start))[entry])
    runtime.put(links.slot, np.argsort(entry).astype(np.int32))


@ti.kernel
def _transpose(links: ti.template(), n: ti.i32, n_sources: ti.i32):
    ti.loop_config(serialize=True)
    for _ in range(1):
        for i in range(n_sources + 1):
            links.t_start[i] = 0
        for k in range(links.start[n]):
            links.t_start[links.source[k] + 1] += 1
        for i in range(n_sources):
            links.t_start[i + 1] += links.t_start[i]
        for s in range(n):
            r = n - 1 - s
            for k in range(links.start[r], links.start[r + 1]):
                place = links.source[k] + 1
                links.t_start[place] -= 1
                links.t_row[links.t_start[place]] = r
                links.slot[k] = links.t_start[place]
        for i in range(n_sources):
            links.t_start[i] = links.t_start[i + 1]
        links.t_start[n_sources] = links.start[n]


@ti.func
def _local(links: ti.template(), r, g, j):
    """Scaled plane coordinates of source j seen from evaluation point g of row r, and its B3 argument."""
    x = links.sources[j] - links.at[2 * r + g]
    h = links.h[r]
    return ti.Vector([links.t1[r].dot(x), links.t2[r].dot(x)]) / h, x.norm() / h


@ti.func
def _weight(links: ti.template(), j):
    """Factor on the kernel weight of source j."""
    factor = ti.cast(1.0, ti.f64)
    if ti.static(links.weighs):
        factor = ti.cast(links.weight[j], ti.f64)
    return factor


@ti.kernel
def _renew(links: ti.template(), listed: ti.i32, count: ti.i32):
    """Coefficients of the rows: order lowered until the fit is sound (T 2.3.6.4)."""
    for m in range(count):
        r = m
        if listed == 1:
            r = links.touched[m]
        for k in range(links.start[r], links.start[r + 1]):
            links.coef[k] *= 0.0
        h = links.h[r]
        sound = 0  # evaluation points that see anything
        lowest = 2
        for g in range(links.n_points[r]):
            bit = ti.cast(1 << g, ti.i8)
            order = links.order[r]
            while order >= 0:
                n = mls.terms(order)
                A = mls.mat6(0.0)
                B = mls.mat6(0.0)  # A,1 ; only the gradient needs it
                C = mls.mat6(0.0)  # A,2
                seen = 0
                for k in range(links.start[r], links.start[r + 1]):
                    if links.cut[k] & bit == 0:
                        d, q = _local(links, r, g, links.source[k])
                        w = b3(q) * _weight(links, links.source[k])
                        if w > 0.0:
                            seen += 1
                            p = mls.monomials(d)
                            _moments(A, p, p, w, n)
                            if ti.static(links.gradient):
                                slope = -b3_slope(q) / ti.max(q * h, 1e-300) * _weight(links, links.source[k])
                                for i in range(n):
                                    for j in range(n):
                                        p1 = -mls.monomial_slopes(d, 0) / h
                                        p2 = -mls.monomial_slopes(d, 1) / h
                                        B[i, j] += (p1[i] * p[j] + p[i] * p1[j]) * w + p[i] * p[j] * slope * d[0]
                                        C[i, j] += (p2[i] * p[j] + p[i] * p2[j]) * w + p[i] * p[j] * slope * d[1]
                if ti.static(links.gradient):
                    if links.own[r] == 1:
                        A[0, 0] += 1.0
                        if n > 1:
                            B[0, 1] -= 1.0 / h
                            B[1, 0] -= 1.0 / h
                            C[0, 2] -= 1.0 / h
                            C[2, 0] -= 1.0 / h
                good = 0
                if seen > 0:
                    good = mls.cholesky(A, n)
                c = mls.vec6(0.0)
                c[0] = 1.0
                b1 = mls.vec6(0.0)
                b2 = mls.vec6(0.0)
                if good:
                    mls.solve(A, c, n)
                    # what the fit makes of 1, of d, and how far it extrapolates
                    s0 = ti.cast(0.0, ti.f64)
                    s1 = ti.Vector([s0, s0])
                    size = ti.cast(0.0, ti.f64)
                    if links.own[r] == 1:
                        s0 += c[0]
                        size += ti.abs(c[0])
                    for k in range(links.start[r], links.start[r + 1]):
                        if links.cut[k] & bit == 0:
                            d, q = _local(links, r, g, links.source[k])
                            phi = b3(q) * _weight(links, links.source[k]) * mls.dot(c, mls.monomials(d), n)
                            s0 += phi
                            s1 += phi * d
                            size += ti.abs(phi)
                    if ti.abs(s0 - 1.0) > 1e-10 or (order > 0 and s1.norm() > 1e-10) or size > mls.LEBESGUE:
                        good = 0
                if good:
                    if ti.static(links.gradient):
                        for i in range(n):
                            for j in range(n):
                                b1[i] += B[i, j] * c[j]
                                b2[i] += C[i, j] * c[j]
                        mls.solve(A, b1, n)
                        mls.solve(A, b2, n)
                    for k in range(links.start[r], links.start[r + 1]):
                        if links.cut[k] & bit == 0:
                            d, q = _local(links, r, g, links.source[k])
                            p = mls.monomials(d)
                            factor = _weight(links, links.source[k])
                            w = b3(q) * factor
                            if ti.static(links.gradient):
                                slope = -b3_slope(q) / ti.max(q * h, 1e-300) * factor * mls.dot(c, p, n)
                                p1 = -mls.monomial_slopes(d, 0) / h
                                p2 = -mls.monomial_slopes(d, 1) / h
                                g1 = w * (mls.dot(c, p1, n) - mls.dot(b1, p, n)) + slope * d[0]
                                g2 = w * (mls.dot(c, p2, n) - mls.dot(b2, p, n)) + slope * d[1]
                                if ti.static(links.values):
                                    links.coef[k] += ti.Vector([g1, g2, w * mls.dot(c, p, n)])
                                else:
                                    links.coef[k] += ti.Vector([g1, g2])
                            else:
                                links.coef[k] += w * mls.dot(c, p, n)
                    sound += 1
                    lowest = ti.min(lowest, order)
                    break
                order -= 1
        links.alive[r] = ti.cast(sound > 0, ti.i32)
        i = links.residual_of[r]
        scale = 1.0 / ti.max(sound, 1)
        for k in range(links.start[r], links.start[r + 1]):
            value = links.coef[k] * scale
            if ti.static(not links.gradient):
                if i >= 0:
                    # a fit that does not see slopes would resist rotations: such a node goes without
                    value = -value
                    if links.source[k] == i:
                        value += 1.0
                    if lowest < 1 or sound == 0:
                        value = 0.0
            links.coef[k] = value
            if ti.static(links.transposed):
                links.t_coef[links.slot[k]] = value


@ti.func
def _moments(A: ti.template(), p, q, w, n):
    """A += w p q^T."""
    for i in range(n):
        for j in range(n):
            A[i, j] += w * p[i] * q[j]


@ti.kernel
def _cut(links: ti.template(), cells: ti.template(), n: ti.i32, new_cells: ti.template(), n_new: ti.i32):
    for r in range(n):
        changed = 0
        for m in range(n_new):
            s = new_cells[m]
            middle = 0.5 * (links.at[2 * r] + links.at[2 * r + 1])
            reach = 2.0 * links.h[r] + cells.radius[s] + 0.5 * (links.at[2 * r] - links.at[2 * r + 1]).norm()
            mine = 1
            if ti.static(links.several):
                if cells.body[s] != links.body[r]:
                    mine = 0
            if mine == 1 and (middle - cells.centre[s]).norm() < 1.001 * reach:
                for k in range(links.start[r], links.start[r + 1]):
                    before = links.cut[k]
                    if links.dead_source[links.source[k]] == 1:
                        links.cut[k] = ti.cast(3, ti.i8)
                    else:
                        for g in range(links.n_points[r]):
                            bit = ti.cast(1 << g, ti.i8)
                            if links.cut[k] & bit == 0:
                                if _hidden(cells, s, links.at[2 * r + g], links.sources[links.source[k]]):
                                    links.cut[k] = links.cut[k] | bit
                    if links.cut[k] != before:
                        changed = 1
        if ti.static(links.leans):
            for w in range(links.lean_start[r], links.lean_start[r + 1]):
                k = links.lean_pair[w]
                bit = ti.cast(links.lean_bit[w], ti.i8)
                if cells.broken[links.lean_cell[w]] == 1 and links.cut[k] & bit == 0:
                    links.cut[k] = links.cut[k] | bit
                    changed = 1
        if changed == 1:
            links.touched[ti.atomic_add(links.n_touched[0], 1)] = r


@ti.func
def _hidden(cells: ti.template(), s, a, b):
    """1 when broken cell s stands between the points a and b."""
    t1, t2, o = cells.t1[s], cells.t2[s], cells.centre[s]
    pa = ti.Vector([t1.dot(a - o), t2.dot(a - o)])
    pb = ti.Vector([t1.dot(b - o), t2.dot(b - o)])
    n = cells.n_corners[s]
    corners = ti.Matrix.zero(ti.f64, 4, 2)
    for c in range(n):
        x = cells.nodes_X[cells.corner[s][c]] - o
        corners[c, 0] = t1.dot(x)
        corners[c, 1] = t2.dot(x)
    tolerance = 1e-6 * cells.radius[s]
    result = crosses(pa, pb, corners, n, tolerance)
    if result == 0:
        for c in range(n):
            edge = cells.edge[s][c]
            if cells.nothing_across(edge, s):
                p = ti.Vector([corners[c, 0], corners[c, 1]])
                q = ti.Vector([corners[(c + 1) % n, 0], corners[(c + 1) % n, 1]])
                if along(pa, pb, p, q, tolerance):
                    result = 1
    return result
