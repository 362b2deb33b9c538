"""Round walls: cylinders, frustums, bullets, barrel vaults."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from ..base import Point
from ..units import Angle, Dimensionless
from .base import FULL, Arc, Axis, Shaped, Size, tapers


class Walled(Shaped):
    """Base of round walls along `axis` from `origin`, the middle of their first end: whole, or the arc of `angle` that begins at
    `start_angle` (from y for axis "x", from z for "y", from x for "z"). `ends` = "discs" closes them."""

    radius: Size
    length: Size
    axis: Axis = "z"
    angle: Arc = 2 * math.pi
    start_angle: Angle = 0.0
    ends: Literal["open", "discs"] = "open"
    origin: Point = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _closes(self) -> Self:
        if self.ends == "discs" and not self.whole:
            raise ValueError(f"ends = 'discs' needs the whole circle, and angle is {math.degrees(self.angle):g} deg")
        return self

    @property
    def whole(self) -> bool:
        return self.angle >= FULL


class Cylinder(Walled):
    """Circular cylinder along `axis` from `origin`, the middle of its first end; whole, or the arc of `angle` that
    begins at `start_angle` (from y for axis "x", from z for "y", from x for "z"). `ends` = "discs" closes it."""

    kind: Literal["cylinder"] = "cylinder"

    def bent(self, at: Point) -> float:
        return 1 / self.radius**2 if self._on_wall(at, self.length) else 0.0

    @property
    def volume(self) -> float | None:
        return math.pi * self.radius**2 * self.length if self.ends == "discs" else None

    @property
    def gross(self) -> float:
        discs = 2 * math.pi * self.radius**2 if self.ends == "discs" else 0.0
        return self.radius * min(self.angle, 2 * math.pi) * self.length + discs

    @property
    def smallest(self) -> float:
        return min(self.length, self.radius * min(self.angle, 1.0))


class Frustum(Walled):
    """Wall of a cone cut off across its axis: from `radius` at `origin`, the middle of its first end, to `end_radius` after `length` along
    `axis`; whole, or the arc of `angle` that begins at `start_angle`, as a Cylinder. `ends` = "discs" closes it."""

    kind: Literal["frustum"] = "frustum"
    end_radius: Size

    @model_validator(mode="after")
    def _fits(self) -> Frustum:
        if abs(self.radius - self.end_radius) < 1e-9 * self.radius:
            raise ValueError("radius and end_radius are equal: it is a Cylinder")
        tapers(min(self.radius, self.end_radius), max(self.radius, self.end_radius), "radius and end_radius")
        return self

    @property
    def thickest(self) -> float:
        return min(self.radius, self.end_radius)

    @property
    def slant(self) -> float:
        """Length of the wall from end to end [m]."""
        return math.hypot(self.length, self.end_radius - self.radius)

    @property
    def gross(self) -> float:
        discs = math.pi * (self.radius**2 + self.end_radius**2) if self.ends == "discs" else 0.0
        return min(self.angle, 2 * math.pi) * (self.radius + self.end_radius) / 2 * self.slant + discs

    @property
    def volume(self) -> float | None:
        a, b = self.radius, self.end_radius
        return math.pi * self.length * (a * a + a * b + b * b) / 3 if self.ends == "discs" else None

    def bent(self, at: Point) -> float:
        if not self._on_wall(at, self.length):
            return 0.0
        along = "xyz".index(self.axis)
        part = (at[along] - self.origin[along]) / self.length
        return (self.length / self.slant / (self.radius + part * (self.end_radius - self.radius))) ** 2

    @property
    def smallest(self) -> float:
        return min(self.slant, min(self.radius, self.end_radius) * min(self.angle, 1.0))


class Bullet(Shaped):
    """Closed skin of a bullet along `axis`: a flat end about `origin`, a shank of `radius` and `length`, and a tangent ogive that ends in a
    point. `crh`: radius of its arc over the calibre (calibre-radius-head); 0.5 is half a ball. The nose points along +axis, or along -axis
    where `turned`."""

    kind: Literal["bullet"] = "bullet"
    radius: Size
    length: Size
    crh: Annotated[Dimensionless, Field(ge=0.5, le=5)] = 2.5
    axis: Axis = "z"
    origin: Point = (0.0, 0.0, 0.0)
    turned: bool = False

    @property
    def arc(self) -> float:
        """Radius of the arc [m]."""
        return 2.0 * self.crh * self.radius

    @property
    def sharp(self) -> float:
        """Half the angle of the point [rad], which is how far the arc reaches round its centre."""
        return math.acos(1.0 - 0.5 / self.crh)

    @property
    def nose(self) -> float:
        """Length of the nose [m]."""
        return self.arc * math.sin(self.sharp)

    @property
    def gross(self) -> float:
        s, c, turn = self.arc, self.arc - self.radius, self.sharp
        return math.pi * (self.radius**2 + 2.0 * self.radius * self.length + 2.0 * s * (s * math.sin(turn) - c * turn))

    @property
    def volume(self) -> float:
        s, c, up = self.arc, self.arc - self.radius, self.nose
        root = 0.5 * (up * c + s * s * self.sharp)  # integral of sqrt(s^2 - z^2)
        return math.pi * (self.radius**2 * self.length + (s * s + c * c) * up - up**3 / 3.0 - 2.0 * c * root)

    def bent(self, at: Point) -> float:
        along = "xyz".index(self.axis)
        up = (at[along] - self.origin[along]) * (-1.0 if self.turned else 1.0)
        if not 0.0 < up < self.length + self.nose:
            return 0.0
        above = max(up - self.length, 0.0)
        if above == 0.0:
            return 1 / self.radius**2
        wide = math.sqrt(self.arc**2 - above**2)
        return 1 / self.arc**2 + (wide / self.arc / (wide - self.arc + self.radius)) ** 2

    @property
    def smallest(self) -> float:
        return min(self.radius, self.length)


class Roof(Shaped):
    """Barrel vault: x along its axis from `origin`, crown up (+z), from `start_angle` (beside the crown, towards +y;
    by itself -`half_angle`, 0 for the half of it) to `half_angle`."""

    kind: Literal["roof"] = "roof"
    radius: Size
    length: Size
    half_angle: Annotated[Angle, Field(gt=0, le=math.pi)]
    start_angle: Angle | None = None
    origin: Point = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _has_width(self) -> Roof:
        if self.start_angle is not None and not -self.half_angle <= self.start_angle < self.half_angle:
            half = math.degrees(self.half_angle)
            raise ValueError(
                f"start_angle {math.degrees(self.start_angle):g} deg is outside {-half:g} to {half:g} deg, the half_angle of the roof"
            )
        return self

    @property
    def start(self) -> float:
        return -self.half_angle if self.start_angle is None else self.start_angle

    def bent(self, at: Point) -> float:
        return 1 / self.radius**2

    @property
    def gross(self) -> float:
        return self.radius * (self.half_angle - self.start) * self.length

    @property
    def smallest(self) -> float:
        return min(self.length, self.radius * min(self.half_angle - self.start, 1.0))
