"""What is kept of a run, and the numbers that it must produce."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, StrictInt

from .base import Frozen, Name, Point
from .loads import Named


class Probe(Frozen):
    """Displacement and velocity of the node nearest to a reference point, in histories/probe_<name>.csv."""

    name: Name
    body: Named = None
    point: Point


class Output(Frozen):
    """What is kept: `frames` pictures over the run, `samples` points in each history."""

    frames: Annotated[StrictInt, Field(ge=1, le=10_000)] = 40
    samples: Annotated[StrictInt, Field(ge=1, le=1_000_000)] = 400
    checkpoints: Annotated[StrictInt, Field(ge=0, le=1000)] = 4
    probes: Annotated[tuple[Probe, ...], Field(max_length=2000)] = ()


class Quantity(Frozen):
    """A number the run must produce: `name` is a measure of `taichi_sph.output.measures`, `options`
    its arguments; `value` +- `tolerance` the target in `unit`, None where none is stated."""

    name: str
    unit: str = ""
    value: float | None = None
    tolerance: Annotated[float, Field(ge=0)] | None = None
    source: str = ""
    options: dict[str, float | str] = {}
