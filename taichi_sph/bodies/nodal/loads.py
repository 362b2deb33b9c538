"""What acts from outside on nodes: dead forces and moments, prescribed velocities and spins, each with its history."""

import numpy as np

from ... import runtime
from ...runtime import ti
from ..shell_sph.pool import Nodes


@ti.data_oriented
class Loads:
    """Nodal forces and moments by entries (node, load, rise); motions by number, found through nodes.fixed."""

    def __init__(self, nodes: Nodes, forces, motions, moments=()):
        """forces: list of (node numbers, (n, dim) forces [N], rise [s]); moments: the same, (n, 3) [N m];
        motions: list of (node numbers, (dim,) mask, (dim,) velocity [m/s], (3,) mask, (3,) spin [rad/s], rise [s]);
        the second pair counts for a shell that bends. rise 0 = step."""
        self.nodes = nodes
        self.pushes, self.twists, self.moves = bool(forces), bool(moments), bool(motions)
        self.acts = self.pushes or self.twists or self.moves
        self.constant = all(rise == 0 for _, _, rise in [*forces, *moments])
        if self.acts:
            self.work = runtime.new("loads.work", nodes.n)  # J, done on the node up to time n
            self.ahead = runtime.new("loads.ahead", nodes.n)  # J, what f_n does on the way to n + 1
        if nodes.bends and (self.twists or self.moves):
            self.ahead_spin = runtime.new("loads.ahead_spin", nodes.n)  # J, the same of moments and spins
        if self.pushes:
            self.force = Entries("force", nodes, forces, nodes.dim)
        if self.twists:
            self.moment = Entries("moment", nodes, moments, 3)
        self.set(0.0)
        if motions:
            dim = nodes.dim
            fixed = np.zeros(nodes.n, np.int32)
            self.mask = runtime.new("motion.mask", len(motions), dim, "i32")
            self.velocity = runtime.new("motion.velocity", len(motions), dim)
            self.rise = runtime.new("motion.rise", len(motions))
            if nodes.bends:
                self.spin_mask = runtime.new("motion.spin_mask", len(motions), 3, "i32")
                self.spin = runtime.new("motion.spin", len(motions), 3)
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
class Entries:
    """One kind of nodal load: `total` (N, c) on the nodes now, from entries (node, value, rise)."""

    def __init__(self, name: str, nodes: Nodes, entries, components: int):
        self.n = sum(len(i) for i, _, _ in entries)
        self.total = runtime.new(f"loads.{name}", nodes.n, components)
        self.node = runtime.new(f"loads.{name}_node", self.n, dtype="i32")
        self.value = runtime.new(f"loads.{name}_value", self.n, components)
        self.rise = runtime.new(f"loads.{name}_rise", self.n)
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
def _clear(entries: ti.template(), n: ti.i32):
    for k in range(n):
        entries.total[entries.node[k]] *= 0.0


@ti.kernel
def _gather(entries: ti.template(), n: ti.i32, time: float):
    ti.loop_config(serialize=True)  # a node may stand in several entries
    for k in range(n):
        entries.total[entries.node[k]] += entries.value[k] * history(time, entries.rise[k])
