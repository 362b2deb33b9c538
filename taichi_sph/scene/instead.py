"""What a scene may ask for instead of motion: equilibrium, modes, a limit."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, StrictInt

from .base import Frozen
from .units import Dimensionless

LARGEST = 12_000  # nodes of a group that Newton's method takes on by itself: its factors need memory
COARSE = 0.5  # rad between the directors of neighbours: more is no longer a bent shell but a fold of its cells


class Static(Frozen):
    """Equilibrium instead of motion: the loads grow with the pseudo-time in `increments` equal steps, and each is
    brought to rest until the unbalanced force is below `residual` of the load.

    `method`: "newton", with the stiffness of the form, in steps of load, and along the length of the path where no step of load is short
    enough or would pass an instability; "relaxation", damped motion to where the shell settles. By itself Newton's method where there is a
    stiffness (not in collocation, not in f32), then the path, and relaxation where neither finds anything; it passes no instability where
    neighbours have turned apart by more than 0.5 rad, for which the cells are too coarse. "arc" follows the path of the whole load in
    proportion: `increments` points along it, the first near 1/`increments` of the load and the others at most eight times as far apart,
    until the whole load is borne; `load` in histories/progress.csv is the part that is borne at a point."""

    method: Literal["newton", "arc", "relaxation"] | None = None
    increments: Annotated[StrictInt, Field(ge=1, le=100_000)] = 1
    residual: Annotated[Dimensionless, Field(gt=0, lt=1)] = 1e-6
    max_steps: Annotated[StrictInt, Field(ge=1)] = 1_000_000  # of relaxation, an increment


class Modes(Frozen):
    """The lowest natural modes about the reference instead of motion, loads left out: one pseudo-time step each,
    `count` of them after the rigid ones. Held components of motions are held at 0."""

    count: Annotated[StrictInt, Field(ge=1, le=200)] = 6


class StepLimit(Frozen):
    """The stability limit of the time step instead of motion: that of the operator beside the one at which random
    motion begins to grow within `steps` steps, found by bisection to `resolution` of it."""

    steps: Annotated[StrictInt, Field(ge=50, le=100_000)] = 600
    resolution: Annotated[Dimensionless, Field(gt=0, lt=0.1)] = 1e-3
