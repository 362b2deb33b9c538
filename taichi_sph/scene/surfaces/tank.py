"""Closed tanks: a cylindrical wall and two heads."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import model_validator

from ..base import Point
from .base import Axis, Shaped, Size

KLOEPPER = (2.0, 0.2)  # radii of crown and knuckle over that of the tank: DIN 28011
KORBBOGEN = (1.6, 0.308)  # DIN 28013
Cap = Literal["flat", "dome", "elliptical", "torispherical", "kloepper", "korbbogen", "conical"]


class CappedTank(Shaped):
    """Closed tank: a cylindrical wall of `length` along `axis` from `origin`, the middle of its first rim, with a head on each end: a
    "flat" disc, a spherical "dome", an "elliptical" head, a "torispherical" one (a sphere of radius `crown`, a torus of radius `knuckle`
    to the wall) or those of two standards, "kloepper" (crown 2 radii, knuckle 0.2) and "korbbogen" (1.6 and 0.308), or a "conical" one.

    `cap_height`: of a dome up to the radius, the hemisphere it is by itself; of an elliptical head by itself half the radius (2:1); of a
    cone. Radii are those of the mid-surface.
    """

    kind: Literal["capped_tank"] = "capped_tank"
    radius: Size
    length: Size
    axis: Axis = "z"
    cap: Cap = "dome"
    cap_height: Size | None = None
    crown: Size | None = None
    knuckle: Size | None = None
    origin: Point = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _has_its_head(self) -> CappedTank:
        if self.cap_height is not None:
            if self.cap == "flat":
                raise ValueError("cap_height is for cap = 'dome'; a flat cap has none")
            if self.cap in ("torispherical", "kloepper", "korbbogen"):
                raise ValueError(f"cap_height of cap = '{self.cap}' follows from its radii; leave it out")
            if self.cap == "dome" and self.cap_height > self.radius * (1 + 1e-9):
                raise ValueError(f"cap_height {self.cap_height:g} m is larger than the radius {self.radius:g} m: at most a hemisphere")
        elif self.cap == "conical":
            raise ValueError("cap_height is missing: how high is the cone?")
        if self.cap == "conical" and (self.cap_height or 0) > 2 * self.radius * (1 + 1e-9):
            raise ValueError("cap_height of a cone above twice the radius is not possible yet: the net cannot follow so sharp a tip")
        for key in ("crown", "knuckle"):
            if self.cap == "torispherical" and getattr(self, key) is None:
                raise ValueError(
                    f"{key} is missing: a torispherical head has a crown and a knuckle radius (or take 'kloepper', 'korbbogen')"
                )
            if self.cap != "torispherical" and getattr(self, key) is not None:
                raise ValueError(f"{key} is for cap = 'torispherical'; this cap is '{self.cap}'")
        if self.cap == "torispherical":
            crown, knuckle = self.radii
            if not knuckle < self.radius * (1 - 1e-9) or not crown > self.radius * (1 - 1e-9):
                raise ValueError(
                    f"knuckle {knuckle:g} m must be smaller, and crown {crown:g} m not smaller, than the radius {self.radius:g} m"
                )
        return self

    @property
    def half_angle(self) -> float:
        """Of spherical caps, seen from the centre of their sphere [rad]; 0 where they are flat."""
        if self.cap == "flat":
            return 0.0
        return 2 * math.atan((self.cap_height or self.radius) / self.radius)

    @property
    def radii(self) -> tuple[float, float]:
        """Of crown and knuckle of a torispherical head [m]."""
        crown, knuckle = KLOEPPER if self.cap == "kloepper" else KORBBOGEN
        if self.cap == "torispherical":
            return self.crown or 0.0, self.knuckle or 0.0
        return crown * self.radius, knuckle * self.radius

    @property
    def crown_angle(self) -> float:
        """Angle from the axis, seen from the centre of the crown, at which the knuckle of a torispherical head begins [rad]."""
        crown, knuckle = self.radii
        return math.asin((self.radius - knuckle) / (crown - knuckle))

    @property
    def height(self) -> float:
        """Of a head over its rim [m]."""
        if self.cap in ("dome", "flat"):
            return self.radius * math.tan(self.half_angle / 2)
        if self.cap == "elliptical":
            return self.cap_height or self.radius / 2
        if self.cap == "conical":
            return self.cap_height or 0.0
        crown, knuckle = self.radii
        return crown - (crown - knuckle) * math.cos(self.crown_angle)

    @property
    def head_area(self) -> float:
        """True area of one head [m2]."""
        a, b = self.radius, self.height
        if self.cap in ("dome", "flat"):
            return 2 * math.pi * self.radius**2 / (1 + math.cos(self.half_angle))
        if self.cap == "conical":
            return math.pi * a * math.hypot(a, b)
        if self.cap == "elliptical":
            if b < a:
                e = math.sqrt(1 - (b / a) ** 2)
                return math.pi * a**2 * (1 + (1 - e**2) / e * math.atanh(e)) if e > 1e-6 else 2 * math.pi * a**2
            e = math.sqrt(1 - (a / b) ** 2)
            return math.pi * a**2 * (1 + b / (a * e) * math.asin(e)) if e > 1e-6 else 2 * math.pi * a**2
        (crown, knuckle), phi = self.radii, self.crown_angle
        ring = (a - knuckle) * (math.pi / 2 - phi) + knuckle * math.cos(phi)
        return 2 * math.pi * (crown**2 * (1 - math.cos(phi)) + knuckle * ring)

    @property
    def head_volume(self) -> float:
        """Under one head [m3]."""
        a, b = self.radius, self.height
        if self.cap in ("dome", "flat"):
            return math.pi * b * (3 * a**2 + b**2) / 6
        if self.cap == "conical":
            return math.pi * a**2 * b / 3
        if self.cap == "elliptical":
            return 2 * math.pi * a**2 * b / 3
        (crown, knuckle), phi = self.radii, self.crown_angle
        c, cap = a - knuckle, crown * (1 - math.cos(phi))
        ring = c**2 * math.cos(phi) + c * knuckle * (math.pi / 2 - phi + math.sin(2 * phi) / 2)
        ring += knuckle**2 * (math.cos(phi) - math.cos(phi) ** 3 / 3)
        return math.pi * (knuckle * ring + cap**2 * (3 * crown - cap) / 3)

    @property
    def volume(self) -> float:
        return math.pi * self.radius**2 * self.length + 2 * self.head_volume

    def bent(self, at: Point) -> float:
        if self._on_wall(at, self.length):
            return 1 / self.radius**2
        if self.cap == "dome":
            return 2 * (math.sin(self.half_angle) / self.radius) ** 2
        off = math.dist(at, self.origin)  # on the crown of a torispherical head: not farther from the axis than where the knuckle begins
        off = math.sqrt(max(off**2 - (at["xyz".index(self.axis)] - self.origin["xyz".index(self.axis)]) ** 2, 0.0))
        crowned = self.cap in ("torispherical", "kloepper", "korbbogen") and off <= self.radii[0] * math.sin(self.crown_angle)
        return 2 / self.radii[0] ** 2 if crowned else 0.0

    @property
    def gross(self) -> float:
        return 2 * math.pi * self.radius * self.length + 2 * self.head_area

    @property
    def smallest(self) -> float:
        return min(self.length, self.radius)
