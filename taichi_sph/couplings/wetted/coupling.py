"""Wetting as a coupling of the world: between one group of fluids and the surfaces of all other groups."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ... import runtime
from ...bodies.body import Group, Now
from ...bodies.fluid.group import FluidGroup
from ...bodies.wettable import wettables
from ...pool import Pool
from ..carried import carried
from ..coupling import Coupling
from .wetted import FINE, Wetted


def couplings(scene: Any, groups: Sequence[Group], own: Sequence[Any]) -> list[WettedCoupling]:
    """One for each group of fluids that its pressure carries, where there is something to wet."""
    found = []
    for fluid in groups:
        if isinstance(fluid, FluidGroup) and fluid.presses:
            names = [body.name for body in fluid.bodies]

            def meets(name: str, names: list[str] = names) -> bool:
                return any(scene.met(one, name).meet for one in names)

            name = fluid.name.replace("fluid", "wet")
            surfaces = wettables([group for group in groups if group is not fluid], name, FINE * fluid.body.p.finest, meets)
            if surfaces:
                hidden = carried(scene, groups, f"{name}.carried", names)
                found.append(WettedCoupling(fluid, Wetted(name, surfaces, fluid.body, hidden)))
    return found


class WettedCoupling(Coupling):
    """wetted: points, lists and weights."""

    def __init__(self, fluid: FluidGroup, wetted: Wetted):
        self.fluid, self.wetted = fluid, wetted

    def pools(self) -> Sequence[Pool]:
        return self.wetted.pools()

    def meet(self, now: Now) -> None:
        """What the particles see of surfaces, when the fluid takes a step."""
        if now.due(self.fluid):
            self.wetted.see(self.fluid.renumbered, self.fluid.body.dt if self.fluid.every > 1 else 0.0)

    def add(self, now: Now) -> None:
        """The forces of the particles on surfaces, as one blow for all steps of the clock until the fluid's next."""
        self.wetted.bear(self.fluid.every if now.due(self.fluid) else 0)

    def pushed(self, group: Any, step: int) -> np.ndarray:
        """(N, 3) force [N] of the fluid on the nodes of a group in the step of that number, which was the last."""
        nodes, n = group.nodes, group.nodes.n
        force, points = runtime.get(nodes.force, n), self.wetted
        runtime.put(nodes.force, np.zeros_like(force))
        for first, surface in zip(points.first, points.surfaces):
            if getattr(surface, "nodes", None) is nodes:
                surface.bear(points.points, first, self.fluid.every if step % self.fluid.every == 0 else 0)
        found = runtime.get(nodes.force, n).astype(np.float64)
        runtime.put(nodes.force, force)
        return found

    def begin_anew(self) -> None:
        """Points that are new, on bodies and beside particles that have a history."""
        self.wetted.begin_anew(self.fluid.body.dt if self.fluid.every > 1 else 0.0)
