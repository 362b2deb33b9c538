"""Where: parts of the reference configuration, by boxes and balls, or by the groups of a mesh."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from .base import Choice, Frozen, Point
from .units import Length


class Box(Frozen):
    """Reference points with lo <= X <= hi; None leaves a side open."""

    kind: Literal["box"] = "box"
    lo: tuple[Length | None, Length | None, Length | None] = (None, None, None)
    hi: tuple[Length | None, Length | None, Length | None] = (None, None, None)

    @model_validator(mode="after")
    def _has_inside(self) -> Box:
        for axis, lo, hi in zip("xyz", self.lo, self.hi):
            if lo is not None and hi is not None and lo > hi:
                raise ValueError(f"lo is above hi along {axis} ({lo:g} m > {hi:g} m): the box holds nothing")
        return self


class Ball(Frozen):
    """Reference points within `radius` of `centre`."""

    kind: Literal["ball"] = "ball"
    centre: Point
    radius: Annotated[Length, Field(gt=0)]


class Group(Frozen):
    """The cells of the group of that name of a mesh: a physical group, set, part or property of a file, or one of `groups` of a Net; of
    nodes, those of its cells."""

    kind: Literal["group"] = "group"
    name: Annotated[str, Field(min_length=1, max_length=200)]


class Outside(Frozen):
    """Reference points that are not strictly inside `of`: the rim of a disc, the far side of a box."""

    kind: Literal["outside"] = "outside"
    of: Annotated[Box | Ball | Group, *Choice]


Region = Annotated[Box | Ball | Group | Outside, *Choice]
