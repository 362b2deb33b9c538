"""A law of drag as the user says it. No Taichi here."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from ...errors import nearest
from ...scene.base import Frozen
from ...scene.kinds import Kind
from ...scene.units import Dimensionless, Length


class Drag(Frozen):
    """A rigid body flies through a fluid by a measured law in place of the fluid's pressure: 1/2 rho `coefficient` pi `radius`^2 v^2.

    For strikers that the fluid is too coarse for: below five particles over its diameter a sphere has up to twice its drag
    (docs/method.md, 11). `between`: the body, then the fluid. `radius` of the frontal area, None: that of its largest pinball.
    `coefficient` of the body in the open cavity that it leaves behind: 0.35 of a sphere, 0.82 of a flat nose. All that the body loses the
    fluid gets, as momentum along the way and as energy that drives it aside.
    """

    kind: Literal["drag"] = "drag"
    between: tuple[str, str]
    coefficient: Annotated[Dimensionless, Field(gt=0, le=3)]
    radius: Annotated[Length, Field(ge=1e-6, le=100)] | None = None

    parts: ClassVar[bool] = True  # the two do not meet otherwise

    @property
    def note(self) -> str:
        """What a plan says of it."""
        striker, fluid = self.between
        return f"{striker}: flies through {fluid} by its drag, coefficient {self.coefficient:g}, and not by the pressure of {fluid}"

    def check(self, scene: Any) -> None:
        """Against the rest of the scene."""
        where = scene.key_of(self)
        names = [body.name for body in scene.bodies]
        for name, own, what in zip(self.between, (scene.rigids, scene.fluids), ("a rigid body", "a fluid")):
            if name not in names:
                raise ValueError(f"{where}.between: there is no body '{name}'{nearest(name, [body.name for body in own])}")
            if name not in [body.name for body in own]:
                raise ValueError(f"{where}.between: '{name}' is a {scene.body(name).what}; give {what} there")
        striker, fluid = (scene.body(name) for name in self.between)
        if not striker.free:
            raise ValueError(f"{where}.between: rigid '{striker.name}' is held or driven, and drag does not act on it")
        if self.radius is None and not striker.pinballs:
            raise ValueError(f"{where}.radius is missing: rigid '{striker.name}' has no pinballs to take it from")
        pairs = [(*one.between,) for one in (*scene.before(self), *scene.meetings) if hasattr(one, "between")]
        if {*self.between} in [{*pair} for pair in pairs]:
            raise ValueError(f"{where}.between: '{striker.name}' and '{fluid.name}' have a meeting or a drag already; a pair has one")


KIND = Kind("drag", "interactions", Drag, "taichi_sph.couplings.drag.coupling:couplings", rank=1)  # forces, before contact sees them
