"""What acts on bodies from outside, holds them, and sets them going. Each names its body; where one body alone can bear it, none."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AliasChoices, Field, model_validator

from .base import Frozen
from .histories import History, Step
from .regions import Box, Region
from .units import Force, Length, Moment, Pressure, Speed, Spin

Named = Annotated[str | None, Field(validation_alias=AliasChoices("body", "shell"))]  # the body; None: the only one


class NodalForce(Frozen):
    """Dead force `total`, shared by the nodes of `where` in proportion to their area."""

    body: Named = None
    where: Region
    total: tuple[Force, Force, Force]
    history: History = Step()


class NodalMoment(Frozen):
    """Dead moment `total` [N m] on the directors of the nodes of `where`, shared like a NodalForce. Only what acts
    across a director turns it: a shell has no drilling stiffness."""

    body: Named = None
    where: Region
    total: tuple[Moment, Moment, Moment]
    history: History = Step()


class SurfacePressure(Frozen):
    """Pressure on a shell that bends, positive along its normals. "follower" turns and grows with the surface,
    "dead" keeps the direction and area of the reference."""

    body: Named = None
    value: Pressure
    kind: Literal["follower", "dead"] = "follower"
    history: History = Step()


class PrescribedVelocity(Frozen):
    """Velocity, and the spin of the directors of a shell that bends, imposed on the nodes of `where`, component
    by component; None leaves one free."""

    body: Named = None
    where: Region
    velocity: tuple[Speed | None, Speed | None, Speed | None]
    spin: tuple[Spin | None, Spin | None, Spin | None] = (None, None, None)
    history: History = Step()

    @model_validator(mode="after")
    def _holds_something(self) -> PrescribedVelocity:
        if all(v is None for v in (*self.velocity, *self.spin)):
            raise ValueError("velocity leaves all three components free: give at least one, 0 to hold it")
        return self


class Pulse(Frozen):
    """exp(-((x - centre) / width)**2)."""

    centre: Length
    width: Annotated[Length, Field(gt=0)]


class InitialVelocity(Frozen):
    """Velocity at t = 0 of the nodes of `where`: a uniform `velocity`, or a Gaussian pulse along x
    (T 4.5.1) velocity * exp(-((x - centre) / width)**2) when `pulse` is given."""

    body: Named = None
    where: Region = Box()
    velocity: tuple[Speed, Speed, Speed]
    pulse: Pulse | None = None
