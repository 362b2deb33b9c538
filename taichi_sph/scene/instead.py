"""What a scene may ask for instead of motion: equilibrium, modes, a limit."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, StrictInt

from .base import Frozen
from .units import Dimensionless


class Static(Frozen):
    """Equilibrium instead of motion: the loads grow with the pseudo-time in `increments` equal steps, and each is
    relaxed until the unbalanced force is below `residual` of the load."""

    increments: Annotated[StrictInt, Field(ge=1, le=100_000)] = 1
    residual: Annotated[Dimensionless, Field(gt=0, lt=1)] = 1e-6
    max_steps: Annotated[StrictInt, Field(ge=1)] = 1_000_000  # of relaxation, per increment


class Modes(Frozen):
    """The lowest natural modes about the reference instead of motion, loads left out: one pseudo-time step each,
    `count` of them after the rigid ones. Held components of motions are held at 0."""

    count: Annotated[StrictInt, Field(ge=1, le=200)] = 6


class StepLimit(Frozen):
    """The stability limit of the time step instead of motion: that of the operator beside the one at which random
    motion begins to grow within `steps` steps, found by bisection to `resolution` of it."""

    steps: Annotated[StrictInt, Field(ge=50, le=100_000)] = 600
    resolution: Annotated[Dimensionless, Field(gt=0, lt=0.1)] = 1e-3
