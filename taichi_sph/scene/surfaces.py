"""The mid-surfaces that can be asked for by their dimensions, and meshes from files and arrays.

`area` [m2] is the true one, `volume` [m3] of what a closed one encloses, `smallest` [m] the largest node spacing that still draws the
shape. Normals point out of the closed side: away from the axis, the centre, or up (+z, or `normal`) from what is flat.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, StrictInt, model_validator

from .base import Choice, Direction, Frozen, Point
from .units import Angle, Dimensionless, Length, Time

FULL = 2 * math.pi - 1e-4  # an arc from here on is the whole circle
TAPER = 3.5  # largest over smallest radius of a wall whose rows all have one number of nodes
Axis = Literal["x", "y", "z"]
Size = Annotated[Length, Field(gt=0)]
Arc = Annotated[Angle, Field(gt=0, le=2 * math.pi + 1e-6)]
Face = Literal["-x", "+x", "-y", "+y", "-z", "+z"]
FLAT = (0.0, 0.0, 0.0)
IN_AXES = {"x": (1, 2, 0), "y": (2, 0, 1), "z": (0, 1, 2)}  # the scene's coordinates as those with z along the axis


class HoleIn(Frozen):
    """A round opening in a generated surface: what is nearer than `radius` to the line through `centre`, a point of the surface, along
    the normal there."""

    centre: Point
    radius: Size


class Shaped(Frozen):
    """Base of the surfaces that are generated. `gross` [m2] is their area without holes."""

    holes: tuple[HoleIn, ...] = ()

    @property
    def gross(self) -> float:
        raise NotImplementedError

    @property
    def area(self) -> float:
        """True area [m2], without what the holes take: to the fourth order in radius over curvature."""
        gone = sum(math.pi * h.radius**2 * (1 + h.radius**2 * self.bent(h.centre) / 8) for h in self.holes)
        return self.gross - gone

    @property
    def holds(self) -> bool:
        """Whether it has an inside that a fluid may fill, though it has holes: plane lids over them close it."""
        return getattr(self, "volume", None) is not None

    @property
    def thickest(self) -> float:
        """Thickness [m] that no shell of this shape has."""
        return getattr(self, "radius", math.inf)

    def bent(self, at: Point) -> float:
        """Sum of the squares of both curvatures [1/m2] at a point of the surface; 0 where it is flat or counts as flat."""
        return 0.0

    def _on_wall(self, at: Point, length: float) -> bool:
        """Whether a point lies between the ends of a wall along `axis` from `origin`."""
        axis, origin = getattr(self, "axis", "x"), getattr(self, "origin", FLAT)
        along = "xyz".index(axis)
        return 0 < at[along] - origin[along] < length


def _directions(normal: Direction | None, along: Direction | None) -> None:
    """ValueError where two directions do not make a frame."""
    for key, direction in (("normal", normal), ("along", along)):
        if direction is not None and not any(direction):
            raise ValueError(f"{key} is (0, 0, 0), which is no direction")
    if along is not None and np.linalg.norm(np.cross(normal or (0, 0, 1), along)) < 1e-6 * np.linalg.norm(along) * np.linalg.norm(
        normal or 1
    ):
        raise ValueError("along is parallel to normal; it must point along the plate, in whose plane it is laid")


class Plate(Shaped):
    """Flat rectangle parallel to the plane z = 0, corner at `origin`, along x (`length`) and y (`width`). With a `normal` it lies across
    that, `length` along the part of `along` across it (by itself of x; of y where the normal is nearly x)."""

    kind: Literal["plate"] = "plate"
    length: Size
    width: Size
    origin: Point = (0.0, 0.0, 0.0)
    normal: Direction | None = None
    along: Direction | None = None

    @model_validator(mode="after")
    def _has_a_frame(self) -> Plate:
        _directions(self.normal, self.along)
        return self

    @property
    def level(self) -> bool:
        """Whether it is parallel to z = 0."""
        return self.normal is None or not any(self.normal[:2])

    @property
    def turned(self) -> bool:
        """Whether `normal` or `along` say where it points."""
        return self.normal is not None or self.along is not None

    @property
    def frame(self) -> np.ndarray:
        """(3, 3) rows: along its length, along its width, its normal."""
        return frame_of(self.normal, self.along)

    def within(self, point: Point) -> tuple[float, float, float]:
        """A point by its way along the length, along the width, and off the plane, from the corner [m]."""
        along, across, off = self.frame @ np.subtract(point, self.origin)
        return float(along), float(across), float(off)

    @property
    def gross(self) -> float:
        return self.length * self.width

    @property
    def smallest(self) -> float:
        return min(self.length, self.width)


def frame_of(normal: Direction | None, along: Direction | None = None) -> np.ndarray:
    """(3, 3) rows: direction in the plane, the one across it, normal."""
    n = np.asarray(normal or (0.0, 0.0, 1.0), dtype=float)
    n = n / np.linalg.norm(n)
    a = np.asarray(along if along is not None else (1.0, 0.0, 0.0) if abs(n[0]) <= 0.9 else (0.0, 1.0, 0.0), dtype=float)
    a = a - n * (a @ n)
    a = a / np.linalg.norm(a)
    return np.stack([a, np.cross(n, a), n])


class Disc(Shaped):
    """Flat disc about `origin`, parallel to the plane z = 0, or across `normal`."""

    kind: Literal["disc"] = "disc"
    radius: Size
    origin: Point = (0.0, 0.0, 0.0)
    normal: Direction | None = None

    @model_validator(mode="after")
    def _has_a_frame(self) -> Disc:
        _directions(self.normal, None)
        return self

    @property
    def level(self) -> bool:
        """Whether it is parallel to z = 0."""
        return self.normal is None or not any(self.normal[:2])

    @property
    def gross(self) -> float:
        return math.pi * self.radius**2

    @property
    def smallest(self) -> float:
        return self.radius


class Cylinder(Shaped):
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


def _tapers(narrow: float, wide: float, what: str) -> None:
    """ValueError where the rows of a wall differ so much that one number of nodes does not suit all."""
    if wide > TAPER * narrow * (1 + 1e-9):
        raise ValueError(
            f"{what} differ {wide / narrow:.3g} times, and more than {TAPER:g} are not possible yet (each row has as many nodes); "
            "give it as a mesh, or in two shells"
        )


class Frustum(Shaped):
    """Wall of a cone cut off across its axis: from `radius` at `origin`, the middle of its first end, to `end_radius` after `length` along
    `axis`; whole, or the arc of `angle` that begins at `start_angle`, as a Cylinder. `ends` = "discs" closes it."""

    kind: Literal["frustum"] = "frustum"
    radius: Size
    end_radius: Size
    length: Size
    axis: Axis = "z"
    angle: Arc = 2 * math.pi
    start_angle: Angle = 0.0
    ends: Literal["open", "discs"] = "open"
    origin: Point = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _fits(self) -> Frustum:
        if self.ends == "discs" and not self.whole:
            raise ValueError(f"ends = 'discs' needs the whole circle, and angle is {math.degrees(self.angle):g} deg")
        if abs(self.radius - self.end_radius) < 1e-9 * self.radius:
            raise ValueError("radius and end_radius are equal: it is a Cylinder")
        _tapers(min(self.radius, self.end_radius), max(self.radius, self.end_radius), "radius and end_radius")
        return self

    @property
    def whole(self) -> bool:
        return self.angle >= FULL

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


class BoxTank(Shaped):
    """Six walls about the box that reaches from `origin` by `size` along x, y, z, but for the walls `without`: ("+z",) has no lid."""

    kind: Literal["box"] = "box"
    size: tuple[Size, Size, Size]
    origin: Point = (0.0, 0.0, 0.0)
    without: tuple[Face, ...] = ()

    @model_validator(mode="after")
    def _has_walls(self) -> BoxTank:
        for n, face in enumerate(self.without):
            if face in self.without[:n]:
                raise ValueError(f"without names '{face}' twice")
        if len(self.without) > 5:
            raise ValueError("without names all six walls: nothing is left")
        if {f[1] for f in self.faces} == {self.faces[0][1]} and len(self.faces) == 2:
            raise ValueError("without leaves two walls that do not touch; make them two shells")
        return self

    @property
    def faces(self) -> tuple[Face, ...]:
        """The walls that are there."""
        every: tuple[Face, ...] = ("-x", "+x", "-y", "+y", "-z", "+z")
        return tuple(face for face in every if face not in self.without)

    @property
    def holds(self) -> bool:
        return len(self.without) < 2

    @property
    def thickest(self) -> float:
        return min(self.size) / 2

    @property
    def gross(self) -> float:
        x, y, z = self.size
        return sum({"x": y * z, "y": x * z, "z": x * y}[face[1]] for face in self.faces)

    @property
    def volume(self) -> float | None:
        return math.prod(self.size) if not self.without else None

    @property
    def smallest(self) -> float:
        return min(self.size)


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
            _tapers(min(ends), widest, "the circles at top and bottom and the widest between them")
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


def _plain(value: Any) -> Any:
    """An array as nested lists."""
    return value.tolist() if isinstance(value, np.ndarray) else value


Corners = Annotated[tuple[StrictInt, ...], Field(min_length=3, max_length=4)]


class Net(Frozen):
    """A surface from arrays: `points` (N, 3), or (N, 2) in the plane z = 0, and `cells`, three or four numbers of points each, from 0 on (a
    fourth of -1 makes a triangle). Checked as a mesh from a file is; `merge` as there."""

    kind: Literal["net"] = "net"
    points: Annotated[tuple[tuple[Length, Length, Length], ...], BeforeValidator(lambda value: _in_space(_plain(value)))]
    cells: Annotated[tuple[Corners, ...], BeforeValidator(_plain)]
    merge: bool = True

    @property
    def area(self) -> float:
        """Of its cells as they are [m2]."""
        p = np.asarray(self.points)
        c = np.array([cell if len(cell) == 4 and cell[3] >= 0 else (*cell[:3], cell[2]) for cell in self.cells])
        return 0.5 * float(np.linalg.norm(np.cross(p[c[:, 2]] - p[c[:, 0]], p[c[:, 3]] - p[c[:, 1]]), axis=1).sum())

    @model_validator(mode="after")
    def _has_cells(self) -> Net:
        if not self.cells or not self.points:
            raise ValueError("points and cells are empty: a net needs at least one cell")
        for n, cell in enumerate(self.cells):
            if min(cell[:3]) < 0 or max(cell) >= len(self.points) or (len(cell) == 4 and cell[3] < -1):
                raise ValueError(f"cells[{n}] = {cell} names a point that is not there; the {len(self.points)} points count from 0")
        return self


def _in_space(points: Any) -> Any:
    """Points in the plane as points in space."""
    if isinstance(points, list | tuple):
        return [[*p, 0.0] if isinstance(p, list | tuple) and len(p) == 2 else p for p in points]
    return points


Generated = Plate | Disc | Cylinder | CappedTank | Frustum | BoxTank | SpherePatch | Sphere | Roof
Given = MeshFile | Net  # their cells are what they are: spacing, cells and irregularity of the numerics do not count
Surface = Annotated[Generated | Given, *Choice]
