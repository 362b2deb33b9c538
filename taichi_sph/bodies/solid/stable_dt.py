"""The stable step of a group of solids: 2 / omega_max of M^-1 K at rest, by Lanczos' iteration with the force kernels themselves.

What is stretched is stiffer or softer on the reference: a metal that is compressed to l of its length by 1/l^2, an elastic body that is
stretched by 1 + 3 E. Bulk viscosity of ratio z to the critical one takes a factor sqrt(1 + z^2) - z of the step (Belytschko, Liu, Moran
2000, 6.2). So cells say how much stiffer they are (forces.py), and the step follows the stiffest, with some room. It never grows
again.
"""

from typing import TYPE_CHECKING

import numpy as np

from ... import runtime
from ...numerics.lanczos import largest
from ...numerics.reduce import BLOCK
from ...pool import Pool
from ..body import Now
from .build import hastened
from .forces import gather, stiffest, strain

if TYPE_CHECKING:
    from .group import SolidGroup

ROOM = 1.05  # of the frequency beyond what the stiffest cell needs
LOOK_EVERY = 10  # steps
PROBE = {"f64": 1e-7, "f32": 1e-4}  # strain of a displacement that asks for K


class StableStep(Pool):
    """frequency: omega_max at rest [rad/s]; stiffer: the frequency allowed for over it."""

    kept = ("frequency", "stiffer")

    def __init__(self, group: "SolidGroup", name: str):
        super().__init__(name)
        self.group = group
        self.safety = group.scene.numerics.time_step_safety
        self.stiffer = 1.0
        if group.material.burns:  # burnt, a cell is far stiffer than before, sooner than the next look
            self.stiffer = max(hastened(body.said.material) for body in group.solids)
        self.blocks = -(-group.cells.n // BLOCK)
        self.partial = self.field("partial", self.blocks, dtype="f64", doc="scratch")
        self.frequency = self._measure()

    def _measure(self) -> float:
        group, nodes = self.group, self.group.nodes
        root = np.sqrt(runtime.get(nodes.mass, nodes.n).astype(np.float64))[:, None]
        u0 = runtime.get(nodes.u, nodes.n)
        size = PROBE[group.scene.numerics.precision] * group.mesh.spacing

        def stiffness(y: np.ndarray) -> np.ndarray:
            w = y / root
            scale = size / max(float(np.abs(w).max()), 1e-300)
            runtime.put(nodes.u, (scale * w).astype(u0.dtype))
            strain(group.cells, nodes, group.material, group.cells.n, 0.0, 0.0)
            gather(group.cells, nodes, nodes.n)
            return -runtime.get(nodes.force, nodes.n).astype(np.float64) / scale / root

        found = largest(stiffness, (nodes.n, 3))
        runtime.put(nodes.u, u0)
        return float(np.sqrt(found))

    @property
    def dt(self) -> float:
        """safety x 2 / omega_max [s]."""
        return self.safety * 2.0 / (self.frequency * self.stiffer)

    def watch(self, now: Now) -> bool:
        """Whether the step has to be shortened: a cell is stiffer than the step allows for."""
        if now.step % LOOK_EVERY:
            return False
        stiffest(self.partial, self.group.cells, self.group.cells.n, BLOCK, self.blocks)
        needed = float(np.sqrt(runtime.get(self.partial, self.blocks).max()))
        if not 1.02 * self.stiffer < needed < np.inf:
            return False
        self.stiffer = ROOM * needed
        return True
