"""What is kept of a run, and the numbers that it must produce."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, StrictInt, model_validator

from .base import Direction, Frozen, Name, Point
from .loads import Named
from .units import Length


class Probe(Frozen):
    """Displacement and velocity of the node nearest to a reference point, in histories/probe_<name>.csv."""

    name: Name
    body: Named = None
    point: Point


class StrainGauge(Frozen):
    """Nominal strain of a shell's surface along a direction, in histories/gauge_<name>.csv.

    It is read at the cells within half of `length` [m] of a reference point, a mean by area; None: at the nearest cell. `along` is
    projected into each cell. A place farther from the shell than about a spacing, and a direction along its normal, are refused.
    `side`: the surface to which directors point ("outer"), the other one ("inner") or the mid-surface.
    """

    name: Name
    body: Named = None
    point: Point
    along: Direction
    side: Literal["outer", "middle", "inner"] = "outer"
    length: Annotated[Length, Field(gt=0)] | None = None

    @model_validator(mode="after")
    def _has_direction(self) -> StrainGauge:
        if not any(self.along):
            raise ValueError("along is (0, 0, 0): give the direction in which the gauge lies")
        return self


class Output(Frozen):
    """What is kept: `frames` pictures over the run, `samples` points in each history, of `probes` and `gauges` too."""

    frames: Annotated[StrictInt, Field(ge=1, le=10_000)] = 40
    samples: Annotated[StrictInt, Field(ge=1, le=1_000_000)] = 400
    checkpoints: Annotated[StrictInt, Field(ge=0, le=1000)] = 4
    probes: Annotated[tuple[Probe, ...], Field(max_length=2000)] = ()
    gauges: Annotated[tuple[StrainGauge, ...], Field(max_length=2000)] = ()


class Quantity(Frozen):
    """A number the run must produce: `name` is a measure of `taichi_sph.output.measures`, `options`
    its arguments; `value` +- `tolerance` the target in `unit`, None where none is stated."""

    name: str
    unit: str = ""
    value: float | None = None
    tolerance: Annotated[float, Field(ge=0)] | None = None
    source: str = ""
    options: dict[str, float | str] = {}
