"""What acts on bodies from outside, holds them, and sets them going. Each names its body; where one body alone can bear it, none."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import AliasChoices, Field, model_validator

from .base import Direction, Frozen, Point
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
    "dead" keeps the direction and area of the reference. `where`: on the cells whose middle is there; by itself on all."""

    body: Named = None
    value: Pressure
    where: Region | None = None
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


class Radial(Frozen):
    """Everything leaves `centre` at one `speed`, or where an `axis` is given the line along that direction through it."""

    centre: Point = (0.0, 0.0, 0.0)
    speed: Speed
    axis: Direction | None = None

    @model_validator(mode="after")
    def _has_an_axis(self) -> Radial:
        if self.axis is not None and not any(self.axis):
            raise ValueError("axis is (0, 0, 0), which is no direction")
        return self

    def at(self, points: np.ndarray) -> np.ndarray:
        """(N, 3) velocities [m/s] at points; 0 in the middle itself."""
        way = points - np.asarray(self.centre)
        if self.axis is not None:
            axis = np.asarray(self.axis) / np.linalg.norm(self.axis)
            way = way - np.outer(way @ axis, axis)
        far = np.linalg.norm(way, axis=1)[:, None]
        return self.speed * np.where(far > 0, way / np.where(far > 0, far, 1.0), 0.0)


class Rotation(Frozen):
    """Turning as a rigid body at `rate` about the line through `centre` along `axis`; directors turn with it."""

    axis: Direction
    rate: Spin
    centre: Point = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _has_an_axis(self) -> Rotation:
        if not any(self.axis):
            raise ValueError("axis is (0, 0, 0), which is no direction")
        return self

    @property
    def spin(self) -> np.ndarray:
        """(3,) [rad/s]"""
        return self.rate * np.asarray(self.axis) / np.linalg.norm(self.axis)

    def at(self, points: np.ndarray) -> np.ndarray:
        """(N, 3) velocities [m/s] at points."""
        return np.cross(self.spin, points - np.asarray(self.centre))


class InitialVelocity(Frozen):
    """Velocity at t = 0 of the nodes of `where`, the sum of what is given: a uniform `velocity`, a `radial` one, a `rotation`. With a
    `pulse` all of it times exp(-((x - centre) / width)**2), a Gaussian along x (T 4.5.1)."""

    body: Named = None
    where: Region = Box()
    velocity: tuple[Speed, Speed, Speed] | None = None
    radial: Radial | None = None
    rotation: Rotation | None = None
    pulse: Pulse | None = None

    @model_validator(mode="after")
    def _moves(self) -> InitialVelocity:
        if self.velocity is None and self.radial is None and self.rotation is None:
            raise ValueError("velocity is missing: give it, or radial or rotation")
        if self.pulse is not None and self.rotation is not None:
            raise ValueError("pulse shapes a velocity or a radial field; a rotation is that of a rigid body, leave one of them out")
        return self

    def at(self, points: np.ndarray) -> np.ndarray:
        """(N, 3) velocities [m/s] at points."""
        v = np.zeros((len(points), 3))
        if self.velocity is not None:
            v = np.broadcast_to(np.asarray(self.velocity), v.shape)
        for field in (self.radial, self.rotation):
            if field is not None:
                v = v + field.at(points)
        if self.pulse is not None:
            v = np.exp(-(((points[:, 0] - self.pulse.centre) / self.pulse.width) ** 2))[:, None] * v
        return v
