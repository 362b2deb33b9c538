"""What generated surfaces share: holes, area, how bent they are; the largest taper of a wall."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field

from ..base import Frozen, Point
from ..units import Angle, Length

FULL = 2 * math.pi - 1e-4  # an arc from here on is the whole circle
TAPER = 3.5  # largest over smallest radius of a wall whose rows all have one number of nodes
Axis = Literal["x", "y", "z"]
Size = Annotated[Length, Field(gt=0)]
Arc = Annotated[Angle, Field(gt=0, le=2 * math.pi + 1e-6)]


class HoleIn(Frozen):
    """A round opening in a generated surface: what is nearer than `radius` to the line through `centre`, a point of the surface, along
    the normal there."""

    centre: Point
    radius: Size


class Shaped(Frozen):
    """Base of the surfaces that are generated. `gross` [m2] is their area without holes."""

    holes: Annotated[tuple[HoleIn, ...], Field(max_length=2000)] = ()

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
        axis, origin = getattr(self, "axis", "x"), getattr(self, "origin", (0.0, 0.0, 0.0))
        along = "xyz".index(axis)
        return 0 < at[along] - origin[along] < length


def tapers(narrow: float, wide: float, what: str) -> None:
    """ValueError where the rows of a wall differ so much that one number of nodes does not suit all."""
    if wide > TAPER * narrow * (1 + 1e-9):
        raise ValueError(
            f"{what} differ {wide / narrow:.3g} times, and more than {TAPER:g} are not possible yet (each row has as many nodes); "
            "give it as a mesh, or in two shells"
        )
