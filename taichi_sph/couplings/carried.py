"""What a striker touches while it flies through a fluid by a law of drag (couplings/drag): pieces of thin surfaces within its reach.

The law holds for the striker with what it tears out and pushes before it. So the fluid does not meet those pieces: a node of a coarse
shell that rides on the nose would have a drag of its own, as large as the spacing makes it.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import runtime
from ..pool import Pool
from ..runtime import ti


def carried(scene: Any, groups: Sequence[Any], name: str, fluids: Sequence[str]) -> "Carried | None":
    """Of all laws of drag whose fluid is among those names; None where there is none."""
    said = [one.between for one in scene.interactions if getattr(one, "parts", False)]
    laws = [(striker, fluids.index(fluid)) for striker, fluid in said if fluid in fluids]
    if not laws:
        return None
    rigid = next(group for group in groups if group.kind == "rigid")
    names = [span.name for span in rigid.bodies]
    return Carried(name, rigid, [names.index(striker) for striker, _ in laws], [of for _, of in laws])


class Carried(Pool):
    """Strikers of one group of rigid bodies, each with the number of the fluid that does not see what it touches."""

    def __init__(self, name: str, group: Any, strikers: Sequence[int], fluids: Sequence[int]):
        super().__init__(name)
        self.rigids, self.n = group.rigids, len(strikers)
        self.striker = self.field("striker", self.n, dtype="i32", doc="number of the rigid body")
        self.fluid = self.field("fluid", self.n, dtype="i32", doc="number of the fluid")
        self.reach = self.field("reach", self.n, dtype="f64", unit="m", doc="of the farthest point of the body from its centre")
        runtime.put(self.striker, np.array(strikers, np.int32))
        runtime.put(self.fluid, np.array(fluids, np.int32))
        runtime.put(self.reach, np.array([group.solids[r].reach for r in strikers]))

    @ti.func
    def touches(self, k, x, half):
        """Whether striker k can touch a piece of a surface at x that reaches `half` [m] to its sides."""
        return (x - self.rigids.x[self.striker[k]]).norm() < self.reach[k] + half
