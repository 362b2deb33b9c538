"""How a load, a pressure or a prescribed motion varies in time: a factor of its full value.

`points` of each: times [s] and factors between which the factor is linear. Before the first and after the last it is theirs; where two
stand at one time it jumps, and the later one holds from there on. Smooth histories are tables of PIECES straight pieces.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from .base import Choice, Frozen
from .units import Dimensionless, Time

PIECES = 256  # of a smooth history; a half sine's impulse is then 1e-5 too small
Points = tuple[tuple[float, float], ...]
Positive = Annotated[Time, Field(gt=0)]
NotNegative = Annotated[Time, Field(ge=0)]


class Step(Frozen):
    """Full value from t = 0 on."""

    kind: Literal["step"] = "step"

    @property
    def points(self) -> Points:
        return ((0.0, 1.0),)


class Ramp(Frozen):
    """Grows linearly from 0 to the full value at `rise`, then stays (T 2.111)."""

    kind: Literal["ramp"] = "ramp"
    rise: Positive

    @property
    def points(self) -> Points:
        return ((0.0, 0.0), (self.rise, 1.0))


class TimeTable(Frozen):
    """Factors at given times, `points` = ((t, f), ...), linear between them, constant before and after."""

    kind: Literal["table"] = "table"
    points: Annotated[tuple[tuple[Time, Dimensionless], ...], Field(min_length=1, max_length=100_000)]

    @model_validator(mode="after")
    def _goes_on(self) -> TimeTable:
        for n, ((before, _), (after, _)) in enumerate(zip(self.points, self.points[1:])):
            if after <= before:
                raise ValueError(f"points[{n + 1}]: its time {after:g} s is not after {before:g} s, that of the point before")
        return self


class TimePulse(Frozen):
    """From `start` on: grows to the full value over `rise`, stays for `hold`, falls to 0 over `fall`. A time of 0 is a jump."""

    kind: Literal["pulse"] = "pulse"
    rise: NotNegative = 0.0
    hold: NotNegative = 0.0
    fall: NotNegative = 0.0
    start: NotNegative = 0.0

    @model_validator(mode="after")
    def _lasts(self) -> TimePulse:
        if not self.rise + self.hold + self.fall > 0:
            raise ValueError("rise, hold and fall are all 0: the pulse lasts for no time")
        return self

    @property
    def points(self) -> Points:
        top, end = self.start + self.rise, self.start + self.rise + self.hold
        return _told_apart(((self.start, 0.0), (top, 1.0), (end, 1.0), (end + self.fall, 0.0)))


class Triangle(Frozen):
    """From `start` on: grows over `rise` to the full value, falls to 0 over `fall`."""

    kind: Literal["triangle"] = "triangle"
    rise: NotNegative = 0.0
    fall: Positive
    start: NotNegative = 0.0

    @property
    def points(self) -> Points:
        top = self.start + self.rise
        return _told_apart(((self.start, 0.0), (top, 1.0), (top + self.fall, 0.0)))


class HalfSine(Frozen):
    """sin(pi (t - start) / duration) for the `duration` from `start` on, 0 before and after."""

    kind: Literal["half_sine"] = "half_sine"
    duration: Positive
    start: NotNegative = 0.0

    @property
    def points(self) -> Points:
        inner = tuple((self.start + self.duration * k / PIECES, math.sin(math.pi * k / PIECES)) for k in range(1, PIECES))
        return ((self.start, 0.0), *inner, (self.start + self.duration, 0.0))


class Friedlander(Frozen):
    """Blast: from `arrival` on (1 - s) exp(-decay s) with s = (t - arrival) / positive. It sucks after the `positive` phase and fades; with
    `suction` = false it ends there."""

    kind: Literal["friedlander"] = "friedlander"
    positive: Positive
    decay: Annotated[Dimensionless, Field(gt=0, le=20)] = 1.0
    arrival: NotNegative = 0.0
    suction: bool = True

    @property
    def points(self) -> Points:
        last = 1 + 14 / self.decay if self.suction else 1.0  # a millionth of the peak is left
        parts = [k / PIECES for k in range(PIECES)] + ([1 + (last - 1) * k / PIECES for k in range(PIECES)] if self.suction else [])
        curve = tuple((self.arrival + self.positive * s, (1 - s) * math.exp(-self.decay * s)) for s in parts)
        return ((self.arrival, 0.0), *curve, (self.arrival + self.positive * last, 0.0))


History = Annotated[Step | Ramp | TimeTable | TimePulse | Triangle | HalfSine | Friedlander, *Choice]


def _told_apart(points: Points) -> Points:
    """Without points that are there twice."""
    return tuple(point for n, point in enumerate(points) if n == 0 or point != points[n - 1])


def factor(points: Points, time: float) -> float:
    """The factor at a time [s]; the same operations as in kernels (bodies/nodal/loads.history)."""
    (last, value), (first, begin) = points[-1], points[0]
    if time >= last:
        return value
    if time < first:
        return begin
    low, high = 0, len(points) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if time < points[middle][0]:
            high = middle
        else:
            low = middle
    (t0, f0), (t1, f1) = points[low], points[high]
    return f0 + (time - t0) / (t1 - t0) * (f1 - f0)


def impulse(points: Points) -> float:
    """Integral of the factor from the first point to the last [s]."""
    return sum(0.5 * (f0 + f1) * (t1 - t0) for (t0, f0), (t1, f1) in zip(points, points[1:]))
