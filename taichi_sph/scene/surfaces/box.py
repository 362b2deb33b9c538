"""Boxes of six walls or fewer."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import model_validator

from ..base import Point
from .base import Shaped, Size

Face = Literal["-x", "+x", "-y", "+y", "-z", "+z"]


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
