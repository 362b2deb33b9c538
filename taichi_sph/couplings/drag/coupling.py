"""A law of drag as a coupling of the world: one rigid body and one fluid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...bodies.body import Entries, Group, Now
from ...pool import Pool
from ..coupling import Coupling
from .law import DragLaw
from .said import Drag


def couplings(scene: Any, groups: Sequence[Group], own: Sequence[Drag]) -> list[DragCoupling]:
    return [DragCoupling(scene, groups, said, f"drag_{k}" if k > 1 else "drag") for k, said in enumerate(own, start=1)]


class DragCoupling(Coupling):
    """law: the force, and what the fluid gets."""

    def __init__(self, scene: Any, groups: Sequence[Any], said: Drag, name: str) -> None:
        striker, fluid = said.between
        rigid = next(group for group in groups if striker in [span.name for span in group.bodies])
        water = next(group for group in groups if fluid in [span.name for span in group.bodies])
        number, of = ([span.name for span in group.bodies].index(one) for group, one in ((rigid, striker), (water, fluid)))
        body = scene.body(striker)
        radius = said.radius or max(ball.radius for ball in body.pinballs)
        self.fluid = water
        density = scene.body(fluid).water.density
        self.law = DragLaw(name, rigid.rigids, number, water.body.p, of, said.coefficient, radius, 0.5 / water.body.inverse, density)

    def pools(self) -> Sequence[Pool]:
        return [self.law]

    def add(self, now: Now) -> None:
        self.law.act(now.kick, self.fluid.every if now.due(self.fluid) else 0)

    def entries(self) -> Entries:
        return Entries(internal={"drag": self.law.lost})
