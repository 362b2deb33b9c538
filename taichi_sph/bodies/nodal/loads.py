"""What acts from outside on nodes: dead forces and moments, prescribed velocities and spins, each with its history."""

from collections.abc import Sequence

import numpy as np

from ... import runtime
from ...pool import Pool
from ...runtime import ti
from .nodes import Nodes


@ti.data_oriented
class Loads(Pool):
    """Nodal forces and moments by entries (node, load, rise); motions by number, found through nodes.fixed."""

    def __init__(self, nodes: Nodes, forces: Sequence, motions: Sequence, moments: Sequence = (), name: str = "loads", blows: bool = False):
        """forces: list of (node numbers, (n, dim) forces [N], rise [s]); moments: the same, (n, 3) [N m];
        motions: list of (node numbers, (dim,) mask, (dim,) velocity [m/s], (3,) mask, (3,) spin [rad/s], rise [s]);
        the second pair counts for a shell that bends. rise 0 = step. blows: they act now and then, as blows (slow.SlowNodes)."""
        super().__init__(name)
        self.nodes = nodes
        self.pushes, self.twists, self.moves = bool(forces), bool(moments), bool(motions)
        self.blows = blows
        self.acts = self.pushes or self.twists or self.moves
        self.constant = all(rise == 0 for _, _, rise in [*forces, *moments])
        if self.acts:
            self.work = self.field("work", nodes.n, unit="J", doc="done on the node up to time n", keeps=True)
            self.ahead = self.field("ahead", nodes.n, unit="J", doc="what f_n does on the way to n + 1", keeps=True)
        if nodes.bends and (self.twists or self.moves):
            self.ahead_spin = self.field("ahead_spin", nodes.n, unit="J", doc="the same of moments and spins", keeps=True)
        if self.pushes:
            self.force = NodalLoad(f"{name}.force", nodes, forces, nodes.dim, "N")
        if self.twists:
            self.moment = NodalLoad(f"{name}.moment", nodes, moments, 3, "N m")
        self.set(0.0)
        if motions:
            self._motions(motions)

    def _motions(self, motions: Sequence) -> None:
        nodes, dim = self.nodes, self.nodes.dim
        fixed = np.zeros(nodes.n, np.int32)
        self.mask = self.field("mask", len(motions), dim, "i32", doc="1: this component is prescribed")
        self.velocity = self.field("velocity", len(motions), dim, unit="m/s", doc="prescribed, once it has risen")
        self.rise = self.field("rise", len(motions), unit="s", doc="time over which it grows, 0: a step")
        if nodes.bends:
            self.spin_mask = self.field("spin_mask", len(motions), 3, "i32", doc="1: this component of the spin is prescribed")
            self.spin = self.field("spin", len(motions), 3, unit="rad/s", doc="prescribed, once it has risen")
        for m, (i, mask, velocity, spin_mask, spin, rise) in enumerate(motions):
            fixed[i] = m + 1
            if nodes.bends:
                for c in range(3):
                    self.spin_mask[m][c] = int(spin_mask[c])
                    self.spin[m][c] = float(spin[c])
            for c in range(dim):
                self.mask[m][c] = int(mask[c])
                self.velocity[m][c] = float(velocity[c])
            self.rise[m] = rise
        runtime.put(nodes.fixed, fixed)

    def given(self) -> list["NodalLoad"]:
        """Forces and moments, where there are any."""
        return [*([self.force] if self.pushes else []), *([self.moment] if self.twists else [])]

    def pools(self) -> list[Pool]:
        """All that has fields."""
        return [self, *self.given()]

    def set(self, time: float) -> None:
        """Loads at `time`."""
        if self.pushes:
            self.force.set(time)
        if self.twists:
            self.moment.set(time)

    def update(self, time: float) -> None:
        """Loads at `time`, where they vary."""
        if not self.constant:
            self.set(time)


@ti.data_oriented
class NodalLoad(Pool):
    """One kind of nodal load: `total` (N, c) on the nodes now, from entries (node, value, rise)."""

    def __init__(self, name: str, nodes: Nodes, entries: Sequence, components: int, unit: str):
        super().__init__(name)
        self.n = sum(len(i) for i, _, _ in entries)
        self.total = self.field("total", nodes.n, components, unit=unit, doc="on the node now")
        self.node = self.field("node", self.n, dtype="i32", doc="of an entry")
        self.value = self.field("value", self.n, components, unit=unit, doc="of an entry, once it has risen")
        self.rise = self.field("rise", self.n, unit="s", doc="time over which an entry grows, 0: a step")
        runtime.put(self.node, np.concatenate([i for i, _, _ in entries]).astype(np.int32))
        runtime.put(self.value, np.concatenate([f for _, f, _ in entries]))
        runtime.put(self.rise, np.concatenate([np.full(len(i), float(rise)) for i, _, rise in entries]))

    def set(self, time: float) -> None:
        """Sum the entries at `time`."""
        _clear(self, self.n)
        _gather(self, self.n, time)


@ti.func
def history(time, rise):
    """T 2.111: grows linearly to 1 at `rise`, then stays; rise = 0 is a step."""
    value = time * 0.0 + 1.0
    if time < rise:
        value = time / rise
    return value


@ti.func
def undrilled(loads: ti.template(), g, n, w):
    """The spin (or torque) w of a director n in the motion g, freed of its part along n by the free components alone.

    Where one component is held and n leans towards its axis, the two others hold a turn about n, which nothing
    resists: it must not take part.
    """
    p = n
    free = 0
    for c in ti.static(range(3)):
        if loads.spin_mask[g][c] == 1:
            p[c] = 0.0
        else:
            free += 1
    if free == 2 and p.dot(n) > 1e-6:
        w -= w.dot(n) / p.dot(n) * p
    return w


@ti.kernel
def _clear(load: ti.template(), n: ti.i32):
    for k in range(n):
        load.total[load.node[k]] *= 0.0


@ti.kernel
def _gather(load: ti.template(), n: ti.i32, time: float):
    ti.loop_config(serialize=True)  # a node may stand in several entries
    for k in range(n):
        load.total[load.node[k]] += load.value[k] * history(time, load.rise[k])
