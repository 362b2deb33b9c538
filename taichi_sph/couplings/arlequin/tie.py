"""The velocities of elements and particles made one, in every step:

    v* = v + dt f / m                 H l = C v*      v = v* - M^-1 C^T l
    d* = w* x n                       H l = C d*      d = d* - M^-1 C^T l,      w = n x d

C v = 0 before and after a step, so l^T C does no work, and C x keeps its value. The part of d along the director is dropped. What that
leaves of C d is of second order in the angle between neighbouring directors. It is nearly the same in every step, so what was dropped in
the last step is added to d* beforehand: that does what more sweeps within a step would (docs/method.md).

Where directors of neighbours lean against each other C d = 0 cannot hold. Directors have two ways to turn, and a row asks for three
numbers: with P that drops what is along the directors, C P M^-1 C^T has eigenvalues of the square of that angle, and more sweeps let l
grow and C d not vanish. So l does work on directors. It changes 1/2 I w_n-1/2 . w_n+1/2 by 1/2 I dw . (w_n-1/2 + w_n+1/2), dw the change
by the tie, whatever the steps on both sides are. That is booked node by node, as `overlap`.

Impulses become forces and couples on the nodes. C is stored by rows and by nodes, so that both products are gathered in a fixed order. The
two triangles of each overlap are solved by one thread. On a processor one thread does it all where C is short, to the same bits: it is done
before others would be awake.
"""

from typing import Any

import numpy as np
import scipy.sparse as sp

from ... import runtime
from ...errors import RunStopped
from ...pool import Pool
from ...runtime import ti
from .constraints import Constraints
from .factor import Factor

FEW = 100_000  # entries of C; one thread takes some 4 ns for each, and 0.4 ms pass until all threads have met four times
ROOM = 2  # widths of the band of L: a crack may change the order of the rows


class Tie(Pool):
    """Rows of C on a list of nodes: those of the elements, then particles from place `middle` on. A node has `width` numbers: v, and d."""

    def __init__(self, factor: Factor, mass: tuple[np.ndarray, np.ndarray], bends: bool, turns: bool, name: str):
        """mass: of the nodes of the elements and of the particles [kg]; bends: whether there are directors; turns: they are tied too."""
        super().__init__(name)
        self.turns = bends and turns
        self.width = 6 if self.turns else 3
        parts = factor.rows.elements, factor.rows.particles
        self.used = [np.unique(part.indices) for part in parts]
        self.middle = len(self.used[0])
        self.n, self.n_rows = sum(map(len, self.used)), parts[0].shape[0]
        n, rows, pairs = self.n, self.n_rows, sum(part.nnz for part in parts)
        self.pairs = pairs
        field = self.field
        self.who = field("who", n, dtype="i32", doc="number of a node in its group")
        self.ease = field("ease", n, dtype="f64", unit="1/kg", doc="inverse mass")
        self.w = field("w", n, self.width, "f64", doc="v* [m/s], and d* [1/s] times the length of the director")
        self.start = field("start", rows + 1, dtype="i32", doc="where the pairs of a row begin")
        self.place = field("place", pairs, dtype="i32", doc="place of the node of a pair on the list")
        self.coef = field("coef", pairs, dtype="f64", doc="of C, sides swapped in sign for particles")
        self.t_start = field("t_start", n + 1, dtype="i32", doc="where the pairs of a node begin")
        self.t_row = field("t_row", pairs, dtype="i32", doc="row of a pair")
        self.t_coef = field("t_coef", pairs, dtype="f64", doc="of C")
        self.room = rows * (ROOM * factor.band + 1)
        self.lower = field("lower", self.room, dtype="f64", doc="L, row by row, 1 / its diagonal last")
        self.first = field("first", rows, dtype="i32", doc="first number of a row of L that is not 0")
        self.block = field("block", rows + 1, dtype="i32", doc="first rows of the blocks of L, which do not see each other")
        self.y = field("y", rows, self.width, "f64", doc="C v* and C d*, then l")
        runtime.put(self.who, np.concatenate(self.used).astype(np.int32))
        runtime.put(self.ease, np.concatenate([1.0 / m[used] for m, used in zip(mass, self.used)]))
        if self.turns:
            self.length = field("length", n, dtype="f64", doc="of the director")
            self.director = field("director", n, 3, "f64", doc="n")
            self.spin = field("spin", n, 3, "f64", unit="rad/s", doc="w*")
            self.dropped = self.field("dropped", n, 3, "f64", doc="of d in the last step, along n, times the length", keeps=True)
            self.taken = self.field("taken", n, dtype="f64", unit="J", doc="by the tie of directors", keeps=True)
            runtime.put(self.length, np.r_[np.ones(self.middle), factor.rows.length[self.used[1]]])
        self.put(factor)

    def put(self, factor: Factor) -> None:
        """Of the same constraints, whose coefficients may have changed."""
        rows: Constraints = factor.rows
        self.band = factor.band
        if factor.lower.size > self.room:
            room = self.room // self.n_rows - 1
            raise RunStopped(
                f"the band of an overlap's constraints has become {factor.band} wide, with room for {room}: a crack runs along the "
                "overlap; widen the patch"
            )
        C = sp.csr_array(sp.hstack([rows.elements[:, self.used[0]], -1.0 * rows.particles[:, self.used[1]]], format="csr"))
        T = sp.csr_array(C.T)
        blocks = factor.blocks
        self.n_blocks = len(blocks) - 1
        runtime.put(self.start, C.indptr.astype(np.int32))
        runtime.put(self.place, C.indices.astype(np.int32))
        runtime.put(self.coef, C.data)
        runtime.put(self.t_start, T.indptr.astype(np.int32))
        runtime.put(self.t_row, T.indices.astype(np.int32))
        runtime.put(self.t_coef, T.data)
        lower = factor.lower.copy()
        lower[:, -1] = 1.0 / lower[:, -1]
        runtime.put(self.lower, lower.ravel())
        runtime.put(self.first, factor.first.astype(np.int32))
        runtime.put(self.block, blocks.astype(np.int32))

    def multipliers(self) -> np.ndarray:
        """(R, width) l of the last step, of velocities and of directors."""
        return runtime.get(self.y, self.n_rows)

    def act(self, groups: tuple[Any, Any], kick: float, books: bool = True) -> None:
        """On the elements and the particles, over a kick [s]. books: the work on directors counts; at t = 0 it is part of what is given."""
        one, two = groups
        act = _act_here if runtime.one_by_one() and self.pairs < FEW else _act
        sizes = self.middle, self.n, self.n_rows, self.n_blocks, self.band
        act(self, one.nodes, one.loads, two.nodes, two.loads, *sizes, kick, 0.5 * books)

    def work(self) -> float:
        """Energy that the tie of directors took [J]."""
        return float(runtime.get(self.taken, self.n).sum()) if self.turns else 0.0


@ti.kernel
def _act(
    tie: ti.template(), a: ti.template(), a_loads: ti.template(), b: ti.template(), b_loads: ti.template(), middle: ti.i32, n: ti.i32,
    rows: ti.i32, blocks: ti.i32, band: ti.i32, kick: ti.f64, half: ti.f64,
):  # fmt: skip
    for m in range(n):
        if m < middle:
            _foresee(tie, a, a_loads, m, kick)
        else:
            _foresee(tie, b, b_loads, m, kick)
    for r in range(rows):
        _row(tie, r)
    for c in range(blocks):
        _forward_back(tie, tie.block[c], tie.block[c + 1], band)
    for m in range(n):
        impulse = _impulse(tie, m)
        if m < middle:
            _strike(tie, a, m, impulse, 1.0 / kick, half)
        else:
            _strike(tie, b, m, impulse, 1.0 / kick, half)


@ti.kernel
def _act_here(
    tie: ti.template(), a: ti.template(), a_loads: ti.template(), b: ti.template(), b_loads: ti.template(), middle: ti.i32, n: ti.i32,
    rows: ti.i32, blocks: ti.i32, band: ti.i32, kick: ti.f64, half: ti.f64,
):  # fmt: skip
    """`_act` by one thread."""
    ti.loop_config(serialize=True)
    for m in range(n):
        if m < middle:
            _foresee(tie, a, a_loads, m, kick)
        else:
            _foresee(tie, b, b_loads, m, kick)
    ti.loop_config(serialize=True)
    for r in range(rows):
        _row(tie, r)
    ti.loop_config(serialize=True)
    for c in range(blocks):
        _forward_back(tie, tie.block[c], tie.block[c + 1], band)
    ti.loop_config(serialize=True)
    for m in range(n):
        impulse = _impulse(tie, m)
        if m < middle:
            _strike(tie, a, m, impulse, 1.0 / kick, half)
        else:
            _strike(tie, b, m, impulse, 1.0 / kick, half)


@ti.func
def _row(tie: ti.template(), r):
    """C w* of a row."""
    y = tie.y[r] * 0.0
    for k in range(tie.start[r], tie.start[r + 1]):
        y += tie.coef[k] * tie.w[tie.place[k]]
    tie.y[r] = y


@ti.func
def _impulse(tie: ti.template(), m):
    """-C^T l of the node at place m."""
    impulse = tie.w[m] * 0.0
    for k in range(tie.t_start[m], tie.t_start[m + 1]):
        impulse -= tie.t_coef[k] * tie.y[tie.t_row[k]]
    return impulse


@ti.func
def _foresee(tie: ti.template(), nodes: ti.template(), loads: ti.template(), m, kick):
    """What the node at place m would do if nothing were tied."""
    i = tie.who[m]
    force = nodes.force[i]
    if ti.static(loads.pushes):
        force += loads.force.total[i]
    w = tie.w[m] * 0.0
    for c in ti.static(range(nodes.dim)):
        w[c] = ti.cast(nodes.v[i][c], ti.f64) + kick / ti.cast(nodes.mass[i], ti.f64) * ti.cast(force[c], ti.f64)
    if ti.static(tie.turns):
        n = nodes.N[i] + nodes.d[i]
        torque = n.cross(nodes.couple[i])
        if ti.static(loads.twists):
            moment = loads.moment.total[i]
            torque += moment - moment.dot(n) * n
        spin = ti.cast(nodes.omega[i], ti.f64) + kick / ti.cast(nodes.inertia[i], ti.f64) * ti.cast(torque, ti.f64)
        director = ti.cast(n, ti.f64)
        tie.director[m], tie.spin[m] = director, spin
        rate = tie.length[m] * spin.cross(director) + tie.dropped[m]
        for c in ti.static(range(3)):
            w[3 + c] = rate[c]
    tie.w[m] = w


@ti.func
def _strike(tie: ti.template(), nodes: ti.template(), m, impulse: ti.template(), per_kick, half):
    """Impulses on v* and d* of the node at place m, as a force and a couple; of that on its director the part along it is dropped."""
    i = tie.who[m]
    for c in ti.static(range(nodes.dim)):
        nodes.force[i][c] += ti.cast(per_kick * impulse[c], float)
    if ti.static(tie.turns):
        ease = tie.ease[m] * tie.length[m]
        n = tie.director[m]
        rate = tie.spin[m].cross(n) + ease * ti.Vector([impulse[3 + c] for c in ti.static(range(3))])
        change = (n.cross(rate) - tie.spin[m]).cross(n)
        nodes.couple[i] += ti.cast(per_kick * ti.cast(nodes.inertia[i], ti.f64) * change, float)
        dw, inertia = n.cross(change), ti.cast(nodes.inertia[i], ti.f64)
        tie.taken[m] -= half * inertia * dw.dot(ti.cast(nodes.omega[i], ti.f64) + tie.spin[m] + dw)
        tie.dropped[m] = -tie.length[m] * rate.dot(n) * n


@ti.func
def _forward_back(tie: ti.template(), first, last, band):
    """H^-1 of y in the rows of a block, by one thread."""
    for r in range(first, last):
        y = tie.y[r]
        row = r * band + band  # entry row + r: 1 / the diagonal of L
        for k in range(tie.first[r], r):
            y -= tie.lower[row + k] * tie.y[k]
        tie.y[r] = y * tie.lower[row + r]
    for q in range(last - first):
        r = last - 1 - q
        row = r * band + band
        y = tie.y[r] * tie.lower[row + r]
        tie.y[r] = y
        for k in range(tie.first[r], r):
            tie.y[k] -= tie.lower[row + k] * y
