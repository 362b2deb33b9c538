"""The mid-surfaces that can be asked for by their dimensions, and meshes from files.

`area` [m2] is the true one, `smallest` [m] the largest node spacing that still draws the shape. Normals point
out of the closed side: away from the axis, the centre, or up (+z) from what is flat.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from .base import Choice, Frozen, Point
from .units import Angle, Dimensionless, Length, Time

FULL = 2 * math.pi - 1e-4  # an arc from here on is the whole circle
Axis = Literal["x", "y", "z"]
Size = Annotated[Length, Field(gt=0)]
Arc = Annotated[Angle, Field(gt=0, le=2 * math.pi + 1e-6)]


class Plate(Frozen):
    """Flat rectangle parallel to the plane z = 0, corner at `origin`, along x (`length`) and y (`width`)."""

    kind: Literal["plate"] = "plate"
    length: Size
    width: Size
    origin: Point = (0.0, 0.0, 0.0)

    @property
    def area(self) -> float:
        return self.length * self.width

    @property
    def smallest(self) -> float:
        return min(self.length, self.width)


class Disc(Frozen):
    """Flat disc parallel to the plane z = 0 about `origin`."""

    kind: Literal["disc"] = "disc"
    radius: Size
    origin: Point = (0.0, 0.0, 0.0)

    @property
    def area(self) -> float:
        return math.pi * self.radius**2

    @property
    def smallest(self) -> float:
        return self.radius


class Cylinder(Frozen):
    """Circular cylinder along `axis` from `origin`, the middle of its first end; whole, or the arc of `angle` that
    begins at `start_angle` (from y for axis "x", from z for "y", from x for "z"). `ends` = "discs" closes it."""

    kind: Literal["cylinder"] = "cylinder"
    radius: Size
    length: Size
    axis: Axis = "z"
    angle: Arc = 2 * math.pi
    start_angle: Angle = 0.0
    ends: Literal["open", "discs"] = "open"
    origin: Point = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _closes(self) -> Cylinder:
        if self.ends == "discs" and not self.whole:
            raise ValueError(f"ends = 'discs' needs the whole circle, and angle is {math.degrees(self.angle):g} deg")
        return self

    @property
    def whole(self) -> bool:
        return self.angle >= FULL

    @property
    def area(self) -> float:
        discs = 2 * math.pi * self.radius**2 if self.ends == "discs" else 0.0
        return self.radius * min(self.angle, 2 * math.pi) * self.length + discs

    @property
    def smallest(self) -> float:
        return min(self.length, self.radius * min(self.angle, 1.0))


class CappedTank(Frozen):
    """Closed tank: a cylindrical wall of `length` along `axis` from `origin`, the middle of its first rim, with a
    "flat" disc or a spherical "dome" on each end. `cap_height` of a dome: up to the radius, the hemisphere it is
    by itself."""

    kind: Literal["capped_tank"] = "capped_tank"
    radius: Size
    length: Size
    axis: Axis = "z"
    cap: Literal["flat", "dome"] = "dome"
    cap_height: Size | None = None
    origin: Point = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _has_its_height(self) -> CappedTank:
        if self.cap_height is not None:
            if self.cap == "flat":
                raise ValueError("cap_height is for cap = 'dome'; a flat cap has none")
            if self.cap_height > self.radius * (1 + 1e-9):
                raise ValueError(f"cap_height {self.cap_height:g} m is larger than the radius {self.radius:g} m: at most a hemisphere")
        return self

    @property
    def half_angle(self) -> float:
        """Of the caps, seen from the centre of their sphere [rad]; 0 where they are flat."""
        if self.cap == "flat":
            return 0.0
        return 2 * math.atan((self.cap_height or self.radius) / self.radius)

    @property
    def area(self) -> float:
        cap = 2 * math.pi * self.radius**2 / (1 + math.cos(self.half_angle))
        return 2 * math.pi * self.radius * self.length + 2 * cap

    @property
    def smallest(self) -> float:
        return min(self.length, self.radius)


class SpherePatch(Frozen):
    """Spherical cap about +z, `half_angle` seen from its centre `origin`; 90 deg is the hemisphere."""

    kind: Literal["sphere_patch"] = "sphere_patch"
    radius: Size
    half_angle: Annotated[Angle, Field(gt=0, le=math.pi / 2 + 1e-6)]
    origin: Point = (0.0, 0.0, 0.0)

    @property
    def area(self) -> float:
        return 2 * math.pi * self.radius**2 * (1 - math.cos(self.half_angle))

    @property
    def smallest(self) -> float:
        return self.radius * math.sin(min(self.half_angle, math.pi / 2))


class Roof(Frozen):
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

    @property
    def area(self) -> float:
        return self.radius * (self.half_angle - self.start) * self.length

    @property
    def smallest(self) -> float:
        return min(self.length, self.radius * min(self.half_angle - self.start, 1.0))


class MeshFile(Frozen):
    """A surface mesh of triangles and quadrangles from a file; `scale` turns its unit into metres. `part`: the one group,
    set, part or property of the file that is read. `merge` = false keeps nodes in one place apart, so that a slit of zero
    width stays open. `time_limit`: for the formats that a process of its own reads (.vtu, .vtk, .med, .xdmf, .mesh)."""

    kind: Literal["mesh"] = "mesh"
    path: Path
    scale: Annotated[Dimensionless, Field(gt=0)] = 1.0
    part: str | None = None
    merge: bool = True
    time_limit: Annotated[Time, Field(gt=0)] = 60.0


Generated = Plate | Disc | Cylinder | CappedTank | SpherePatch | Roof
Surface = Annotated[Generated | MeshFile, *Choice]
