"""How a scene is computed: what all bodies share, and what a body takes from here unless it says its own."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, StrictBool, StrictInt

from ..bodies.shell.said import Formulation, Galerkin
from ..couplings.contact.said import PinballContact
from .base import Frozen
from .units import Dimensionless, Length


class Numerics(Frozen):
    """How it is computed. `spacing` D is the node spacing of generated surfaces."""

    spacing: Annotated[Length, Field(gt=0)]
    cells: Literal["quad", "triangle"] = "quad"
    irregularity: Annotated[Dimensionless, Field(ge=0, le=0.4)] = 0.0  # random moves, in spacings
    seed: Annotated[StrictInt, Field(ge=0, lt=2**32)] = 0
    formulation: Formulation = Galerkin()
    precision: Literal["f32", "f64"] = "f64"
    time_step_safety: Annotated[Dimensionless, Field(gt=0, le=1)] = 0.9
    raised_inertia: StrictBool = True  # rotary inertia raised so that turning does not rule the step (T 2.52)
    contact: PinballContact | None = None  # of scenes with several bodies; None: its defaults
