"""What acts from outside: dead nodal forces and prescribed velocities, each with its history in time."""

import numpy as np

from .. import runtime
from ..model.pools import Nodes
from ..runtime import ti


@ti.data_oriented
class Loads:
    """Nodal forces by entries (node, force, rise); motions by number, found through nodes.fixed."""

    def __init__(self, nodes: Nodes, forces, motions):
        """forces: list of (node numbers, (n, dim) forces [N], rise [s]);
        motions: list of (node numbers, (dim,) mask, (dim,) velocity [m/s], (3,) mask, (3,) spin [rad/s], rise [s]);
        the second pair counts for a shell that bends. rise 0 = step."""
        self.nodes = nodes
        dim = nodes.dim
        self.n_entries = sum(len(i) for i, _, _ in forces)
        self.constant = all(rise == 0 for _, _, rise in forces)
        self.acts = bool(forces or motions)
        if self.acts:
            self.work = runtime.new("loads.work", nodes.n)  # J, done on the node up to time n
            self.ahead = runtime.new("loads.ahead", nodes.n)  # J, what f_n does on the way to n + 1
        if forces:
            self.external = runtime.new("loads.external", nodes.n, dim)  # N
            self.entry_node = runtime.new("loads.node", self.n_entries, dtype="i32")
            self.entry_force = runtime.new("loads.force", self.n_entries, dim)
            self.entry_rise = runtime.new("loads.rise", self.n_entries)
            runtime.put(self.entry_node, np.concatenate([i for i, _, _ in forces]).astype(np.int32))
            runtime.put(self.entry_force, np.concatenate([f for _, f, _ in forces]))
            runtime.put(self.entry_rise, np.concatenate([np.full(len(i), rise) for i, _, rise in forces]))
            self.set(0.0)
        if motions:
            fixed = np.zeros(nodes.n, np.int32)
            self.mask = runtime.new("motion.mask", len(motions), dim, "i32")
            self.velocity = runtime.new("motion.velocity", len(motions), dim)
            self.rise = runtime.new("motion.rise", len(motions))
            if nodes.bends:
                self.spin_mask = runtime.new("motion.spin_mask", len(motions), 3, "i32")
                self.spin = runtime.new("motion.spin", len(motions), 3)
                self.ahead_spin = runtime.new("loads.ahead_spin", nodes.n)
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
        self.pushes = bool(forces)
        self.moves = bool(motions)

    def set(self, time: float) -> None:
        """Nodal forces at `time`."""
        _clear(self, self.n_entries)
        _gather(self, self.n_entries, time)

    def update(self, time: float) -> None:
        """Nodal forces at `time`, where they vary."""
        if self.pushes and not self.constant:
            self.set(time)


@ti.func
def history(time, rise):
    """T 2.111: grows linearly to 1 at `rise`, then stays; rise = 0 is a step."""
    value = time * 0.0 + 1.0
    if time < rise:
        value = time / rise
    return value


@ti.kernel
def _clear(loads: ti.template(), n: ti.i32):
    for k in range(n):
        loads.external[loads.entry_node[k]] *= 0.0


@ti.kernel
def _gather(loads: ti.template(), n: ti.i32, time: float):
    ti.loop_config(serialize=True)  # a node may stand in several entries
    for k in range(n):
        loads.external[loads.entry_node[k]] += loads.entry_force[k] * history(time, loads.entry_rise[k])
