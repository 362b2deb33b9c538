"""Springs as the user says them: a link between points of two bodies, or of a body and the ground. No Taichi here."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from ...errors import nearest
from ...scene.base import Frozen, Name, Point
from ...scene.kinds import Kind
from ...scene.units import Damping, Force, Length, Stiffness


class Spring(Frozen):
    """A spring and a damper between two `points` (reference positions), each on its body of `between`; None is the ground.

    Force along the line of the points, positive in tension: preload + stiffness (l - length) + damping dl/dt, with l their distance;
    `length` None: that at t = 0. `only` = "pull" bears no compression, "push" no tension. Of a shell the spring holds the node nearest to
    its point, or with a `radius` all nodes within that of the point, alike; of a rigid body the point itself, which may lie anywhere.
    """

    name: Name
    between: tuple[str | None, str | None]
    points: tuple[Point, Point]
    stiffness: Annotated[Stiffness, Field(ge=0)]
    length: Annotated[Length, Field(ge=0)] | None = None
    preload: Force = 0.0
    damping: Annotated[Damping, Field(ge=0)] = 0.0
    only: Literal["pull", "push"] | None = None
    radius: Annotated[Length, Field(gt=0)] | None = None

    @model_validator(mode="after")
    def _believable(self) -> Spring:
        if self.between == (None, None):
            raise ValueError("between names no body: a spring from the ground to the ground moves nothing")
        if self.between[0] == self.between[1] and self.points[0] == self.points[1]:
            raise ValueError(f"points: both ends of spring '{self.name}' are one point of '{self.between[0]}'")
        if self.points[0] == self.points[1]:
            raise ValueError(f"points: both ends of spring '{self.name}' are at one place, and it has no direction; move them apart")
        if not (self.stiffness or self.preload or self.damping):
            raise ValueError(f"stiffness, preload and damping of spring '{self.name}' are 0: it does nothing")
        return self

    def check(self, scene: Any) -> None:
        """Against the rest of the scene."""
        where = scene.key_of(self)
        names = [body.name for body in scene.bodies]
        for name in self.between:
            if name is None:
                continue
            if name not in names:
                raise ValueError(f"{where}.between: there is no body '{name}'{nearest(name, names)}")
            body = scene.body(name)
            if not body.holds_springs:
                raise ValueError(f"{where}.between: '{name}' is a {body.what}, which holds no spring")
            if not body.meets:
                raise ValueError(f"{where}.between: {body.what} '{name}' moves in its plane, and a spring turns; give it motion = 'free'")
        if self.name in [spring.name for spring in scene.before(self)]:
            raise ValueError(f"{where}.name: '{self.name}' is taken; names of springs name their histories")
        if self.radius is not None and not any(name is not None and scene.body(name).has_nodes for name in self.between):
            raise ValueError(f"{where}.radius: of the nodes of a shell, and spring '{self.name}' holds none; leave it out")
        scene.in_time("a spring acts", "springs")


def longest_of(frequency: float, rate: float) -> float:
    """Longest step [s] of an oscillator with that frequency omega [rad/s] and rate of damping c/m [1/s], by central differences with the
    velocity of the half step before: 2 (sqrt(1 + zeta^2) - zeta) / omega with zeta = c / 2 m omega."""
    return 4.0 / (math.hypot(2.0 * frequency, rate) + rate)


KIND = Kind("spring", "springs", Spring, "taichi_sph.couplings.springs.coupling:couplings", rank=1)
