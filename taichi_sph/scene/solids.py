"""Solid shapes: those that can be asked for by their dimensions, meshes from files and from arrays.

`volume` [m3] is the true one, `smallest` [m] the largest node spacing that still draws the shape.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, StrictInt, model_validator

from .base import Choice, Frozen, Point
from .surfaces import MeshFile
from .surfaces.base import Axis, Size
from .units import Dimensionless, Length

Corners = Annotated[tuple[StrictInt, ...], Field(min_length=4, max_length=8)]


def _plain(value: Any) -> Any:
    """An array as nested lists."""
    return value.tolist() if hasattr(value, "tolist") else value


class Grading(Frozen):
    """Cells of a brick that grow: as the spacing has it from `lo` to `hi` [m], in the scene's coordinates (None: to the end), and beyond by
    the factor `growth` from one to the next at most, up to `largest`, which is at least the spacing. Less room than half a cell is left to
    the fine ones."""

    lo: tuple[Length | None, Length | None, Length | None] = (None, None, None)
    hi: tuple[Length | None, Length | None, Length | None] = (None, None, None)
    growth: Annotated[Dimensionless, Field(gt=1.0, le=2.0)] = 1.2
    largest: Size | None = None


class Pilot(Frozen):
    """A narrow square hole along z, on the edge of a brick where x and y are least: the line of flight in a quarter between planes of
    symmetry. `radius`: half the width of the square [m]; the quarter has a square of that side. The cells on the edge, squares across z,
    are left out, and those within `reach` [m] of it drawn towards the hole. A sharp striker then parts the cells before it; without, it
    presses them flat."""

    radius: Size
    reach: Size


class Brick(Frozen):
    """A box with its edges along x, y, z, of hexahedra: `size` from the corner `origin`. `layers`: cells along each axis; None: as the
    spacing has it. `graded`: fine where something happens, coarse elsewhere. `pilot`: a hole for a sharp striker."""

    kind: Literal["brick"] = "brick"
    size: tuple[Size, Size, Size]
    origin: Point = (0.0, 0.0, 0.0)
    layers: tuple[Annotated[StrictInt, Field(ge=1)], Annotated[StrictInt, Field(ge=1)], Annotated[StrictInt, Field(ge=1)]] | None = None
    graded: Grading | None = None
    pilot: Pilot | None = None

    @model_validator(mode="after")
    def _has_room(self) -> Brick:
        if self.pilot is not None and not self.pilot.radius < self.pilot.reach <= min(self.size[:2]):
            raise ValueError(
                f"pilot.reach {self.pilot.reach:g} m must be above its radius, {self.pilot.radius:g} m, and at most the width of the "
                f"brick, {min(self.size[:2]):g} m"
            )
        return self

    @model_validator(mode="after")
    def _fine_somewhere(self) -> Brick:
        if self.graded is None:
            return self
        if self.layers is not None:
            raise ValueError("layers and graded are both given: leave one out")
        for k, axis in enumerate("xyz"):
            low, high = self.origin[k], self.origin[k] + self.size[k]
            lo, hi = self.graded.lo[k], self.graded.hi[k]
            a, b = low if lo is None else lo, high if hi is None else hi
            if not low * (1 - 1e-12) - 1e-12 <= a < b <= high * (1 + 1e-12) + 1e-12:
                raise ValueError(f"graded: lo {a:g} m and hi {b:g} m along {axis} are no stretch of the brick, from {low:g} to {high:g} m")
        return self

    @property
    def volume(self) -> float:
        return math.prod(self.size) - (0.0 if self.pilot is None else self.pilot.radius**2 * self.size[2])

    @property
    def smallest(self) -> float:
        return math.inf if self.layers is not None else min(self.size)


class Rod(Frozen):
    """A round bar of `radius` and `length` along `axis` from `origin`, the middle of its first end: hexahedra, a square core inside rings.

    `core`: side of the core over the diameter, which its rounded sides bulge out of.
    """

    kind: Literal["rod"] = "rod"
    radius: Size
    length: Size
    axis: Axis = "z"
    origin: Point = (0.0, 0.0, 0.0)
    core: Annotated[Dimensionless, Field(ge=0.2, le=0.65)] = 0.45

    @property
    def volume(self) -> float:
        return math.pi * self.radius**2 * self.length

    @property
    def smallest(self) -> float:
        return min(self.radius, self.length)


class Ogive(Frozen):
    """A bullet along `axis`: a shank of `radius` and `length` from `origin`, the middle of its flat end, then a tangent ogive nose.

    `crh`: radius of the nose's arc over the calibre (calibre-radius-head), at least 0.5, which is half a ball. `blunt`: radius of the small
    flat at the tip over `radius`. The nose points along +axis, or along -axis where `turned`.
    """

    kind: Literal["ogive"] = "ogive"
    radius: Size
    length: Annotated[Length, Field(ge=0)]
    crh: Annotated[Dimensionless, Field(ge=0.5, le=20)] = 2.5
    blunt: Annotated[Dimensionless, Field(ge=0.05, le=0.5)] = 0.15
    axis: Axis = "z"
    origin: Point = (0.0, 0.0, 0.0)
    turned: bool = False

    @property
    def arc(self) -> float:
        """Radius of the arc [m]."""
        return 2.0 * self.crh * self.radius

    @property
    def nose(self) -> float:
        """Length of the nose up to its flat [m]."""
        return math.sqrt(self.arc**2 - (self.arc - self.radius + self.blunt * self.radius) ** 2)

    def wide(self, along: float) -> float:
        """Radius [m] at a height over the flat end [m]."""
        up = max(along - self.length, 0.0)
        return math.sqrt(max(self.arc**2 - up**2, 0.0)) - self.arc + self.radius

    @property
    def volume(self) -> float:
        up, s, c = self.nose, self.arc, self.arc - self.radius
        # of (sqrt(s^2 - z^2) - c)^2
        root = 0.5 * (up * math.sqrt(s * s - up * up) + s * s * math.asin(up / s))
        return math.pi * (self.radius**2 * self.length + (s * s + c * c) * up - up**3 / 3.0 - 2.0 * c * root)

    @property
    def smallest(self) -> float:
        return self.radius


class Cells(Frozen):
    """A solid from arrays: `points` (N, 3) and `cells`, eight numbers of points each for a hexahedron (VTK's order: one face, then the
    one across from it) or four for a tetrahedron, from 0 on."""

    kind: Literal["cells"] = "cells"
    points: Annotated[tuple[tuple[Length, Length, Length], ...], BeforeValidator(_plain)]
    cells: Annotated[tuple[Corners, ...], BeforeValidator(_plain)]

    @model_validator(mode="after")
    def _has_cells(self) -> Cells:
        if not self.cells or not self.points:
            raise ValueError("points and cells are empty: a solid needs at least one cell")
        for n, cell in enumerate(self.cells):
            if len(cell) not in (4, 8):
                raise ValueError(f"cells[{n}] has {len(cell)} corners; a tetrahedron has 4, a hexahedron 8")
            if min(cell) < 0 or max(cell) >= len(self.points):
                raise ValueError(f"cells[{n}] = {cell} names a point that is not there; the {len(self.points)} points count from 0")
        return self


Made = Brick | Rod | Ogive
Shape = Annotated[Made | MeshFile | Cells, *Choice]
