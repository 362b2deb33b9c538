"""Spheres and parts of them."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from ..base import Point
from ..units import Angle
from .base import FULL, Arc, Shaped, Size, tapers


class SpherePatch(Shaped):
    """Spherical cap about +z, `half_angle` seen from its centre `origin`; 90 deg is the hemisphere."""

    kind: Literal["sphere_patch"] = "sphere_patch"
    radius: Size
    half_angle: Annotated[Angle, Field(gt=0, le=math.pi / 2 + 1e-6)]
    origin: Point = (0.0, 0.0, 0.0)

    def bent(self, at: Point) -> float:
        return 2 / self.radius**2

    @property
    def gross(self) -> float:
        return 2 * math.pi * self.radius**2 * (1 - math.cos(self.half_angle))

    @property
    def smallest(self) -> float:
        return self.radius * math.sin(min(self.half_angle, math.pi / 2))


class Sphere(Shaped):
    """Sphere about `origin`, or the part of it between two angles from +z, `top` and `bottom`, and over the arc of `angle` round z that
    begins at `start_angle` (from x): all of it by itself; top = 18 deg, bottom = 90 deg is the hemisphere with a hole."""

    kind: Literal["sphere"] = "sphere"
    radius: Size
    top: Annotated[Angle, Field(ge=0, lt=math.pi)] = 0.0
    bottom: Annotated[Angle, Field(gt=0, le=math.pi + 1e-6)] = math.pi
    angle: Arc = 2 * math.pi
    start_angle: Angle = 0.0
    origin: Point = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _can_be_drawn(self) -> Sphere:
        top, bottom = math.degrees(self.top), math.degrees(self.bottom)
        if not self.top < self.bottom - 1e-6:
            raise ValueError(f"top {top:g} deg must be smaller than bottom {bottom:g} deg: both are angles from +z")
        if self.top > 0 and self.to_pole:
            raise ValueError(
                f"top {top:g} deg and bottom 180 deg are not possible yet; take the mirror image, top 0 and bottom {180 - top:g} deg"
            )
        if self.top == 0 and not self.whole and (self.angle > 2 * math.pi / 3 + 1e-6 or self.bottom > math.pi / 2 + 1e-6):
            raise ValueError(
                f"angle {math.degrees(self.angle):g} deg with top 0 and bottom {bottom:g} deg: a sector that holds the pole is not "
                "possible yet beyond angle 120 deg or bottom 90 deg"
            )
        if self.top > 0 or (not self.to_pole and self.bottom > math.pi / 2):
            ends = [math.sin(max(self.top, 0.0) or math.pi / 2), math.sin(self.bottom)]
            widest = 1.0 if self.top <= math.pi / 2 <= self.bottom else max(ends)
            tapers(min(ends), widest, "the circles at top and bottom and the widest between them")
        return self

    @property
    def whole(self) -> bool:
        return self.angle >= FULL

    @property
    def to_pole(self) -> bool:
        """Whether it holds the point farthest along -z."""
        return self.bottom > math.pi - 1e-4

    @property
    def closed(self) -> bool:
        return self.whole and self.top == 0 and self.to_pole

    def bent(self, at: Point) -> float:
        return 2 / self.radius**2

    @property
    def gross(self) -> float:
        return min(self.angle, 2 * math.pi) * self.radius**2 * (math.cos(self.top) - math.cos(min(self.bottom, math.pi)))

    @property
    def volume(self) -> float | None:
        return 4 * math.pi * self.radius**3 / 3 if self.closed else None

    @property
    def smallest(self) -> float:
        return self.radius * min(self.bottom - self.top, self.angle, 1.0)
