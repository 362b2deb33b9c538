"""Rupture as a strong discontinuity (T 2.3.5, 2.3.6), event by event. A step without a rupture reads one counter.

A cell whose D_r reaches D_c breaks. Then, until nothing new breaks:

1. the cell carries no stress any more; a node without a live cell becomes a fragment (T 2.3.6.3): it keeps its mass and velocity and
   leaves every neighbourhood;
2. links that cross a broken cell are cut (T 2.3.6.2) and the MLS of the touched rows is renewed (T 2.3.6.4);
3. a row that sees nothing any more breaks the cells that need it.

The elastic energy that an event takes is booked as "released": the rest of the broken cell, and the change of the strains of its
neighbours, whose nodes see one lip only from then on. Cells of one body never touch the links of another.
"""

from typing import TYPE_CHECKING

import numpy as np

from ... import runtime
from ...pool import Pool
from ...runtime import ti

if TYPE_CHECKING:
    from .group import ParticleShells


class Rupture(Pool):
    """Owns the events of a group of shells."""

    kept = ("released", "broken", "events", "loose")

    def __init__(self, group: "ParticleShells", name: str = "rupture"):
        super().__init__(name)
        self.group = group
        self.released = 0.0  # J
        self.broken = 0  # cells
        self.events = 0
        self.loose = 0  # nodes without a live cell

    def happen(self) -> bool:
        """Let the cells break that reached D_c in this step; True when any did."""
        group = self.group
        if not group.material.breaks:
            return False
        n_new = int(runtime.get(group.cells.n_new, 1)[0])
        if n_new == 0:
            return False
        if group.pressures is not None:
            group.pressures.before_rupture(group.now.time)
        before = group.stored()
        self.open(n_new, group.now.time)
        self.released += before - group.stored()
        self.events += 1
        return True

    def open(self, n_new: int, time: float) -> None:
        """Break the cells on the list `new`, and whatever follows from it."""
        group = self.group
        cells, nodes = group.cells, group.nodes
        while n_new:
            self.broken += n_new
            self.loose += _break(cells, nodes, n_new, time)
            group.internal.drop(n_new)
            touched = [(links, links.cut_through(cells, cells.new, n_new)) for links in group.internal.links]
            runtime.fill(cells.n_new, 0)
            for links, n_touched in touched:
                links.renew_touched(n_touched)
                group.internal.restrain(links, n_touched)
            n_new = int(runtime.get(cells.n_new, 1)[0])
        runtime.fill(cells.n_new, 0)

    def cut(self, numbers: np.ndarray) -> None:
        """Pre-cracks and notches: break these cells before anything moves."""
        if len(numbers) == 0:
            return
        runtime.put(self.group.cells.new, numbers.astype(np.int32))
        self.open(len(numbers), float("nan"))


@ti.kernel
def _break(cells: ti.template(), nodes: ti.template(), n_new: ti.i32, time: ti.f64) -> ti.i32:
    for m in range(n_new):
        cells.broken[cells.new[m]] = 1
        cells.rupture_time[cells.new[m]] = time
    loose = 0
    for m in range(n_new):
        s = cells.new[m]
        for k in ti.static(range(4)):  # no atomic within a loop of the device (CONTRIBUTING.md, Vulkan)
            if k < cells.n_corners[s]:
                i = cells.corner[s][k]
                alive = 0
                for q in range(cells.start_of_node[i], cells.start_of_node[i + 1]):
                    alive += 1 - cells.broken[cells.of_node[q]]
                if alive == 0:
                    if ti.atomic_max(nodes.fragment[i], 1) == 0:  # the first of the cells that the node loses counts it
                        loose += 1
    return loose
