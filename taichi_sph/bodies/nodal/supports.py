"""What supports and drives do to the nodes that they hold: forces and moments, summed for each prescribed motion.

The force on a node is what replaces its velocity, m (v - v_free) / kick: the reaction of a clamp, or the pull of a drive. In statics it
is what balances the node. A group that is due every K steps gets its reaction as one blow of K; then it is the mean over them.
"""

from typing import TYPE_CHECKING

import numpy as np

from ... import runtime
from ...pool import Pool
from ...runtime import ti
from .nodes import Nodes

if TYPE_CHECKING:
    from .loads import Loads

UNITS = dict.fromkeys(("fx", "fy", "fz"), "N") | dict.fromkeys(("mx", "my", "mz"), "N m")


class Supports(Pool):
    """The nodes that motions hold or drive, and what that takes."""

    def __init__(self, nodes: Nodes, fixed: np.ndarray, motions: int, name: str):
        """fixed (N,): number of the motion of a node + 1, 0: free; motions: how many there are."""
        super().__init__(name)
        self.held = np.flatnonzero(fixed)
        self.motion, self.motions = fixed[self.held] - 1, motions
        self.n = n = len(self.held)
        slot = np.full(nodes.n, -1, np.int32)
        slot[self.held] = np.arange(n, dtype=np.int32)
        self.node = self.field("node", max(n, 1), dtype="i32", doc="a node that is held or driven")
        self.slot = self.field("slot", nodes.n, dtype="i32", doc="row of a node among them, -1: it is free")
        self.u = self.field("u", max(n, 1), nodes.dim, unit="m", doc="its displacement when the force was taken", keeps=True)
        self.force = self.field("force", max(n, 1), nodes.dim, unit="N", doc="what the support does to it, in the last step", keeps=True)
        self.bends = nodes.bends
        if self.bends:
            self.torque = self.field("torque", max(n, 1), 3, unit="N m", doc="the same on its director", keeps=True)
        runtime.put(self.slot, slot)
        if n:
            runtime.put(self.node, self.held.astype(np.int32))
        X = runtime.get(nodes.X, nodes.n)[self.held]
        count = np.maximum(np.bincount(self.motion, minlength=motions), 1)[:, None]
        self.middle = np.stack([np.bincount(self.motion, c, minlength=motions) for c in X.T], axis=1) / count
        self.arm = X - self.middle[self.motion]

    def clear(self) -> None:
        """Nothing so far: what the steps to come add up to is one blow."""
        runtime.fill(self.force, 0.0)
        if self.bends:
            runtime.fill(self.torque, 0.0)

    def balance(self, nodes: Nodes, loads: "Loads") -> None:
        """In statics: what the held nodes lack to be in equilibrium."""
        if self.n:
            _balance(self, nodes, loads, self.n)

    def sums(self, share: float = 1.0) -> np.ndarray:
        """(motions, 6): force [N] on the body and moment [N m] about the middle, in the reference, of the nodes of each motion."""
        force, arm = np.zeros((self.n, 3)), self.arm.copy()
        dim = self.u.n
        force[:, :dim] = share * runtime.get(self.force, self.n)
        arm[:, :dim] += runtime.get(self.u, self.n)
        moment = np.cross(arm, force)
        if self.bends:
            moment += share * runtime.get(self.torque, self.n)
        both = np.hstack([force, moment])
        return np.stack([np.bincount(self.motion, c, minlength=self.motions) for c in both.T], axis=1)

    def rows(self, share: float = 1.0) -> list[dict[str, float]]:
        """`sums` by the names of UNITS."""
        return [dict(zip(UNITS, map(float, row))) for row in self.sums(share)]


@ti.kernel
def _balance(supports: ti.template(), nodes: ti.template(), loads: ti.template(), n: ti.i32):
    for s in range(n):
        i = supports.node[s]
        g = nodes.fixed[i] - 1
        force = nodes.force[i]
        if ti.static(loads.pushes):
            force += loads.force.total[i]
        for k in ti.static(range(nodes.dim)):
            if loads.mask[g][k] == 0:
                force[k] = 0.0
        supports.force[s] = -force
        supports.u[s] = nodes.u[i]
        if ti.static(nodes.bends):
            director = nodes.N[i] + nodes.d[i]
            couple = director.cross(nodes.couple[i])
            if ti.static(loads.twists):
                couple += loads.moment.total[i] - loads.moment.total[i].dot(director) * director
            for k in ti.static(range(3)):
                if loads.spin_mask[g][k] == 0:
                    couple[k] = 0.0
            supports.torque[s] = -couple
