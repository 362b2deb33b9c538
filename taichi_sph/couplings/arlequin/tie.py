"""The velocities of elements and particles made one, in every step:

    v* = v + dt f / m                 H l = C v*      v = v* - M^-1 C^T l
    d* = w* x n                       H l = C d*      d = d* - M^-1 C^T l,      w = n x d

C v = 0 before and after a step, so l^T C does no work, and C x keeps its value. The part of d along the director is dropped, so directors
are tied in SWEEPS sweeps: what one of them leaves is of second order in the angle between neighbouring directors. Impulses become forces
and couples on the nodes. C is stored by rows and by nodes, so that both products are gathered in a fixed order. The two triangles are
solved by one thread.
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

SWEEPS = 3
ROOM = 2  # widths of the band of L: a crack may change the order of the rows


class Tie(Pool):
    """Rows of C on a list of nodes: those of the elements, then particles from place `middle` on."""

    def __init__(self, factor: Factor, mass: tuple[np.ndarray, np.ndarray], bends: bool, turns: bool, name: str):
        """mass: of the nodes of the elements and of the particles [kg]; bends: whether there are directors; turns: they are tied too."""
        super().__init__(name)
        self.turns = bends and turns
        parts = factor.rows.elements, factor.rows.particles
        self.used = [np.unique(part.indices) for part in parts]
        self.middle = len(self.used[0])
        self.n, self.n_rows = sum(map(len, self.used)), parts[0].shape[0]
        n, rows, pairs = self.n, self.n_rows, sum(part.nnz for part in parts)
        field = self.field
        self.who = field("who", n, dtype="i32", doc="number of a node in its group")
        self.ease = field("ease", n, dtype="f64", unit="1/kg", doc="inverse mass")
        self.length = field("length", n, dtype="f64", doc="of the director")
        self.v = field("v", n, 3, "f64", unit="m/s", doc="v*")
        self.push = field("push", n, 3, "f64", unit="N s", doc="impulse on a node")
        self.start = field("start", rows + 1, dtype="i32", doc="where the pairs of a row begin")
        self.place = field("place", pairs, dtype="i32", doc="place of the node of a pair on the list")
        self.coef = field("coef", pairs, dtype="f64", doc="of C, sides swapped in sign for particles")
        self.t_start = field("t_start", n + 1, dtype="i32", doc="where the pairs of a node begin")
        self.t_row = field("t_row", pairs, dtype="i32", doc="row of a pair")
        self.t_coef = field("t_coef", pairs, dtype="f64", doc="of C")
        self.room = rows * (ROOM * factor.band + 1)
        self.lower = field("lower", self.room, dtype="f64", doc="L, row by row, its diagonal last")
        self.first = field("first", rows, dtype="i32", doc="first number of a row of L that is not 0")
        self.y = field("y", rows, 3, "f64", doc="C v*, then l")
        if self.turns:
            self.director = field("director", n, 3, "f64", doc="n")
            self.spin = field("spin", n, 3, "f64", unit="rad/s", doc="w*, then w")
            self.spin_before = field("spin_before", n, 3, "f64", unit="rad/s", doc="w*")
            self.rate = field("rate", n, 3, "f64", unit="1/s", doc="d")
            self.z = field("z", rows, 3, "f64", doc="C d*, then l")
        runtime.put(self.who, np.concatenate(self.used).astype(np.int32))
        runtime.put(self.ease, np.concatenate([1.0 / m[used] for m, used in zip(mass, self.used)]))
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
        runtime.put(self.start, C.indptr.astype(np.int32))
        runtime.put(self.place, C.indices.astype(np.int32))
        runtime.put(self.coef, C.data)
        runtime.put(self.t_start, T.indptr.astype(np.int32))
        runtime.put(self.t_row, T.indices.astype(np.int32))
        runtime.put(self.t_coef, T.data)
        runtime.put(self.lower, factor.lower.ravel())
        runtime.put(self.first, factor.first.astype(np.int32))

    def act(self, groups: tuple[Any, Any], kick: float) -> None:
        """On the elements and the particles, over a kick [s]."""
        ends = (0, self.middle), (self.middle, self.n)
        for group, (first, last) in zip(groups, ends):
            _foresee(self, group.nodes, group.loads, first, last, kick)
        _solve(self, self.n_rows, self.n, self.band)
        for group, (first, last) in zip(groups, ends):
            _push(self, group.nodes, first, last, 1.0 / kick)


@ti.kernel
def _foresee(tie: ti.template(), nodes: ti.template(), loads: ti.template(), first: ti.i32, last: ti.i32, kick: ti.f64):
    for m in range(first, last):
        i = tie.who[m]
        force = nodes.force[i]
        if ti.static(loads.pushes):
            force += loads.force.total[i]
        for c in ti.static(range(nodes.dim)):
            tie.v[m][c] = ti.cast(nodes.v[i][c], ti.f64) + kick / ti.cast(nodes.mass[i], ti.f64) * ti.cast(force[c], ti.f64)
        if ti.static(tie.turns):
            n = nodes.N[i] + nodes.d[i]
            torque = n.cross(nodes.couple[i])
            if ti.static(loads.twists):
                moment = loads.moment.total[i]
                torque += moment - moment.dot(n) * n
            spin = ti.cast(nodes.omega[i], ti.f64) + kick / ti.cast(nodes.inertia[i], ti.f64) * ti.cast(torque, ti.f64)
            director = ti.cast(n, ti.f64)
            tie.director[m], tie.spin_before[m], tie.spin[m] = director, spin, spin
            tie.rate[m] = spin.cross(director)


@ti.kernel
def _solve(tie: ti.template(), rows: ti.i32, n: ti.i32, band: ti.i32):
    for r in range(rows):
        y = ti.Vector([0.0, 0.0, 0.0], ti.f64)
        z = y
        for k in range(tie.start[r], tie.start[r + 1]):
            m = tie.place[k]
            y += tie.coef[k] * tie.v[m]
            if ti.static(tie.turns):
                z += tie.coef[k] * tie.length[m] * tie.rate[m]
        tie.y[r] = y
        if ti.static(tie.turns):
            tie.z[r] = z
    ti.loop_config(serialize=True)
    for _ in range(1):
        _forward_back(tie, rows, band, ti.static(True), ti.static(tie.turns))
    for m in range(n):
        push = ti.Vector([0.0, 0.0, 0.0], ti.f64)
        turn = push
        for k in range(tie.t_start[m], tie.t_start[m + 1]):
            push -= tie.t_coef[k] * tie.y[tie.t_row[k]]
            if ti.static(tie.turns):
                turn -= tie.t_coef[k] * tie.z[tie.t_row[k]]
        tie.push[m] = push
        if ti.static(tie.turns):
            _turned(tie, m, turn)
    if ti.static(tie.turns):
        for _s in ti.static(range(SWEEPS - 1)):
            for r in range(rows):
                z = ti.Vector([0.0, 0.0, 0.0], ti.f64)
                for k in range(tie.start[r], tie.start[r + 1]):
                    m = tie.place[k]
                    z += tie.coef[k] * tie.length[m] * tie.rate[m]
                tie.z[r] = z
            ti.loop_config(serialize=True)
            for _ in range(1):
                _forward_back(tie, rows, band, ti.static(False), ti.static(True))
            for m in range(n):
                turn = ti.Vector([0.0, 0.0, 0.0], ti.f64)
                for k in range(tie.t_start[m], tie.t_start[m + 1]):
                    turn -= tie.t_coef[k] * tie.z[tie.t_row[k]]
                _turned(tie, m, turn)


@ti.func
def _turned(tie: ti.template(), m, turn):
    """Spin and rate of the director at place m after an impulse on its rate, of which the part along the director is dropped."""
    rate = tie.rate[m] + tie.ease[m] * tie.length[m] * turn
    spin = tie.director[m].cross(rate)
    tie.spin[m] = spin
    tie.rate[m] = spin.cross(tie.director[m])


@ti.func
def _forward_back(tie: ti.template(), rows, band, moved: ti.template(), turned: ti.template()):
    """H^-1 of y, and of z."""
    width = band + 1
    for r in range(rows):
        y = ti.Vector([0.0, 0.0, 0.0], ti.f64)
        z = y
        if ti.static(moved):
            y = tie.y[r]
        if ti.static(turned):
            z = tie.z[r]
        row = r * width + band - r
        for k in range(tie.first[r], r):
            c = tie.lower[row + k]
            if ti.static(moved):
                y -= c * tie.y[k]
            if ti.static(turned):
                z -= c * tie.z[k]
        scale = 1.0 / tie.lower[row + r]
        if ti.static(moved):
            tie.y[r] = scale * y
        if ti.static(turned):
            tie.z[r] = scale * z
    for q in range(rows):
        r = rows - 1 - q
        row = r * width + band - r
        scale = 1.0 / tie.lower[row + r]
        if ti.static(moved):
            tie.y[r] *= scale
        if ti.static(turned):
            tie.z[r] *= scale
        for k in range(tie.first[r], r):
            c = tie.lower[row + k]
            if ti.static(moved):
                tie.y[k] -= c * tie.y[r]
            if ti.static(turned):
                tie.z[k] -= c * tie.z[r]


@ti.kernel
def _push(tie: ti.template(), nodes: ti.template(), first: ti.i32, last: ti.i32, per_kick: ti.f64):
    for m in range(first, last):
        i = tie.who[m]
        for c in ti.static(range(nodes.dim)):
            nodes.force[i][c] += ti.cast(per_kick * tie.push[m][c], float)
        if ti.static(tie.turns):
            change = (tie.spin[m] - tie.spin_before[m]).cross(tie.director[m])
            nodes.couple[i] += ti.cast(per_kick * ti.cast(nodes.inertia[i], ti.f64) * change, float)
