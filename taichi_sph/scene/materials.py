"""Materials as the user says them: strength, damage, rupture chosen apart. No Taichi here."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from . import plausible
from .base import Frozen
from .units import Density, Dimensionless, Pressure, Time


class Mazars(Frozen):
    """Mazars damage, traction part (T 2.61, 2.64)."""

    threshold: Annotated[Dimensionless, Field(gt=0, lt=1)]  # epsilon_D
    A: Annotated[Dimensionless, Field(ge=0, le=1)]  # A_L, asymptote
    B: Annotated[Dimensionless, Field(gt=0)]  # B_L, fall after the peak


class Delay(Frozen):
    """Delayed damage (T 2.73): the rate of damage is bounded by 1/tau_c."""

    a: Annotated[Dimensionless, Field(gt=0)]
    tau_c: Annotated[Time, Field(gt=0)]


class Material(Frozen):
    """Isotropic linear elasticity in plane stress, with optional damage, delay and rupture."""

    name: str
    source: str = ""
    young: Annotated[Pressure, Field(gt=0)]
    poisson: Annotated[Dimensionless, Field(gt=-1, lt=0.5)]
    density: Annotated[Density, Field(gt=0)]
    damage: Mazars | None = None
    delay: Delay | None = None
    critical_damage: Annotated[Dimensionless, Field(gt=0, le=1)] | None = None  # D_c: rupture

    @model_validator(mode="after")
    def _believable(self) -> "Material":
        if self.damage is None and (self.delay is not None or self.critical_damage is not None):
            raise ValueError("delay and critical_damage need a damage law: set damage")
        plausible.material(self)
        return self
