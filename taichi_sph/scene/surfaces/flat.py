"""Plates and discs, level or across a normal."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from pydantic import StrictBool, model_validator

from ..base import Direction, Point
from .base import HoleIn, Shaped, Size


def _directions(normal: Direction | None, along: Direction | None) -> None:
    """ValueError where two directions do not make a frame."""
    for key, direction in (("normal", normal), ("along", along)):
        if direction is not None and not any(direction):
            raise ValueError(f"{key} is (0, 0, 0), which is no direction")
    if along is not None and np.linalg.norm(np.cross(normal or (0, 0, 1), along)) < 1e-6 * np.linalg.norm(along) * np.linalg.norm(
        normal or 1
    ):
        raise ValueError("along is parallel to normal; it must point along the plate, in whose plane it is laid")


def frame_of(normal: Direction | None, along: Direction | None = None) -> np.ndarray:
    """(3, 3) rows: direction in the plane, the one across it, normal."""
    n = np.asarray(normal or (0.0, 0.0, 1.0), dtype=float)
    n = n / np.linalg.norm(n)
    a = np.asarray(along if along is not None else (1.0, 0.0, 0.0) if abs(n[0]) <= 0.9 else (0.0, 1.0, 0.0), dtype=float)
    a = a - n * (a @ n)
    a = a / np.linalg.norm(a)
    return np.stack([a, np.cross(n, a), n])


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


class Disc(Shaped):
    """Flat disc about `origin`, parallel to the plane z = 0, or across `normal`. `quarter`: the part of it where x and y are above those of
    the origin, between two planes of symmetry; level, with holes that lie in it or about its origin."""

    kind: Literal["disc"] = "disc"
    radius: Size
    origin: Point = (0.0, 0.0, 0.0)
    normal: Direction | None = None
    quarter: StrictBool | None = None

    @model_validator(mode="after")
    def _has_a_frame(self) -> Disc:
        _directions(self.normal, None)
        if self.quarter and self.normal is not None:
            raise ValueError("quarter: a quarter of a disc is parallel to the plane z = 0; leave out normal, or quarter")
        for hole in self.holes if self.quarter else ():
            x, y = (hole.centre[c] - self.origin[c] for c in range(2))
            if not self.about(hole) and min(x, y) <= hole.radius:
                raise ValueError(f"holes: the one about {hole.centre} crosses a plane of symmetry; only one about the origin may")
        return self

    @property
    def level(self) -> bool:
        """Whether it is parallel to z = 0."""
        return self.normal is None or not any(self.normal[:2])

    @property
    def gross(self) -> float:
        return math.pi * self.radius**2 / (4 if self.quarter else 1)

    @property
    def area(self) -> float:
        about = sum(math.pi * hole.radius**2 for hole in self.holes if self.quarter and self.about(hole))
        return super().area + 0.75 * about

    def about(self, hole: HoleIn) -> bool:
        """Whether a hole lies about the origin."""
        return math.dist(hole.centre, self.origin) < 1e-9 * self.radius

    @property
    def smallest(self) -> float:
        return self.radius
