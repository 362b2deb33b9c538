"""The stability limit of the time step: what the operator says, beside what the running scheme shows.

Small random velocities and spins on every node hold every mode. Below the limit, central differences keep the energy of each mode within
bounds. Above the limit the energy of the fastest mode grows exponentially, by exp(2 sqrt(2 x)) a step at (1 + x) times the limit. Bisection
finds the limit between the two.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from .... import runtime
from ....errors import RunStopped
from ....pool import Pool
from ....scene.laws import Material

if TYPE_CHECKING:
    from ...body import Clocked
    from ..group import ShellGroup

SMALL = 1e-9  # of the wave speed: the motion is linear
GROWN = 1e6  # times the kinetic energy of the first step: far more than what stays within bounds ever reaches


class LimitSearch(Pool):
    """predicted, measured, thesis [s]."""

    kept = ("measured",)
    unset = ("measured",)

    def __init__(self, world: Clocked, group: ShellGroup, steps: int, resolution: float):
        super().__init__("limit")
        self.world, self.group, self.steps, self.resolution, self.work = world, group, steps, resolution, 0.0
        self.predicted = 2.0 / group.stable.frequency
        self.measured = math.nan
        shell = group.shell
        self.thesis = thesis_step(group.spacing, shell.thickness, shell.material)
        rng = np.random.default_rng(0)
        material = shell.material
        speed = SMALL * math.sqrt(material.young / material.density)
        n = group.nodes.n
        self.velocity = speed * rng.standard_normal((n, group.nodes.dim))
        if group.nodes.bends:
            N = runtime.get(group.nodes.N, n).astype(np.float64)
            spin = speed / group.spacing * rng.standard_normal((n, 3))
            self.spin = spin - np.einsum("ni,ni->n", spin, N)[:, None] * N

    def settle(self, time: float) -> None:
        """Find the measured limit."""
        low = high = self.predicted
        factor = 1.02
        while self._grows(low):
            if low < self.predicted / 8:
                raise RunStopped(
                    f"shell '{self.group.shell.name}': the motion grows even at an eighth of the predicted step,"
                    f" {self.predicted:.3g} s; the formulation has growing modes of its own, so there is no limit to find"
                )
            high, low = low, low / factor
            factor = factor**2
        factor = 1.02
        while high == low or not self._grows(high):
            low, high = high, high * factor
            factor = factor**2
        while high - low > self.resolution * low:
            middle = 0.5 * (low + high)
            low, high = (low, middle) if self._grows(middle) else (middle, high)
        self.measured = low
        self._rest()
        self.group.internal.strain(0.0)  # nothing stays stored
        self.world.step += 1

    def _rest(self) -> None:
        nodes = self.group.nodes
        for field in [nodes.u, nodes.v] + ([nodes.d, nodes.omega] if nodes.bends else []):
            runtime.fill(field, 0.0)

    def _grows(self, dt: float) -> bool:
        group = self.group
        nodes, n = group.nodes, group.nodes.n
        self._rest()
        real = runtime.get(nodes.v, n).dtype
        runtime.put(nodes.v, self.velocity.astype(real))
        if nodes.bends:
            runtime.put(nodes.omega, self.spin.astype(real))
        before, first = 0.0, None
        for k in range(self.steps):
            self.world.take(before, dt)
            before = dt
            if k % 20 == 0 or k == self.steps - 1:
                kinetic = abs(self.group.kinetic())
                first = kinetic if first is None else first
                if not kinetic < GROWN * first:
                    return True
        return False

    def pools(self) -> list[Pool]:
        """All that has history."""
        return [self]

    def status(self) -> dict[str, float]:
        return {
            "predicted": self.predicted,
            "measured": self.measured,
            "thesis": self.thesis,
            "ratio": self.predicted / self.measured,
            "thesis_ratio": self.thesis / self.measured,
        }

    units = {"predicted": "s", "measured": "s", "thesis": "s"}
    rule = "the limit is looked for"


def thesis_step(spacing: float, thickness: float, material: Material) -> float:
    """T 2.51 (C.6) [s], with the grouping of T 2.50: alpha_1 = 0.4, alpha_2 = 2, no safety factor."""
    slow = 0.4 + 2.0 * (1.0 - material.poisson) * (spacing / thickness) ** 2
    return spacing * math.sqrt(material.density * (1.0 - material.poisson**2) / material.young / slow)
