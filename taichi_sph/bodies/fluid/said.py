"""Fluids as the user says them: water, where it stands at the start, and rigid walls. No Taichi here."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, StrictInt, model_validator

from ...scene.base import Choice, Frozen, Point
from ...scene.units import Density, Dimensionless, Length, Pressure, Speed


class Acoustic(Frozen):
    """p = c^2 (rho - rho_0) (T 1.19)."""

    kind: Literal["acoustic"] = "acoustic"


class Tait(Frozen):
    """p = rho_0 c^2 / gamma ((rho / rho_0)^gamma - 1)."""

    kind: Literal["tait"] = "tait"
    gamma: Annotated[Dimensionless, Field(gt=1, le=20)] = 7.15


class Water(Frozen):
    """A weakly compressible fluid (T 1.3). `tension` is the most that it bears before it cavitates,
    above the pressure of its surroundings; None: any."""

    density: Annotated[Density, Field(gt=0)] = 1000.0
    sound: Annotated[Speed, Field(gt=0)] = 1450.0
    law: Annotated[Acoustic | Tait, *Choice] = Acoustic()
    tension: Annotated[Pressure, Field(ge=0)] | None = 0.0


class FluidBox(Frozen):
    """The box lo <= x <= hi, filled."""

    kind: Literal["box"] = "box"
    lo: Point
    hi: Point

    @model_validator(mode="after")
    def _has_inside(self) -> FluidBox:
        for axis, lo, hi in zip("xyz", self.lo, self.hi):
            if lo >= hi:
                raise ValueError(f"lo is not below hi along {axis} ({lo:g} m, {hi:g} m): the box holds nothing")
        return self

    @property
    def volume(self) -> float:
        return math.prod(hi - lo for lo, hi in zip(self.lo, self.hi))


class ShellFill(Frozen):
    """The inside of the closed shell of that name, up to `level` along `axis`; None: to the top."""

    kind: Literal["shell"] = "shell"
    shell: str
    axis: Literal["x", "y", "z"] = "z"
    level: Length | None = None


class Fluid(Frozen):
    """A body of fluid particles. `spacing` None: that of the numerics. `support` h / D (T 1.27), `alpha` and `beta` the
    artificial viscosity (T 1.24), `delta` the diffusion of density (docs/method.md). `hydrostatic`: at rest under the
    gravity of the scene from the start, the highest particle without pressure. `contact` with shells and rigid bodies:
    None by its pressure, with pinballs behind it (couplings/wetted/wetted.py), or by pinballs alone (T 3.3), whose plastic blows take
    energy. `every`: steps of the shell between two of the fluid, whose pressure it then feels as one blow of so many (docs/method.md);
    None: 1."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=64)]
    fill: Annotated[FluidBox | ShellFill, Field(discriminator="kind")]
    water: Water = Water()
    velocity: tuple[Speed, Speed, Speed] = (0.0, 0.0, 0.0)
    hydrostatic: bool = True
    contact: Literal["pinballs"] | None = None
    every: Annotated[StrictInt, Field(ge=1, le=20)] | None = None
    spacing: Annotated[Length, Field(gt=0)] | None = None
    support: Annotated[Dimensionless, Field(ge=1.0, le=2.0)] = 1.165
    alpha: Annotated[Dimensionless, Field(ge=0, le=3)] = 0.1
    beta: Annotated[Dimensionless, Field(ge=0, le=10)] = 0.0
    delta: Annotated[Dimensionless, Field(ge=0, le=0.5)] = 0.1


class Hole(Frozen):
    """A round opening in a wall."""

    centre: Point
    radius: Annotated[Length, Field(gt=0)]


class Wall(Frozen):
    """A rigid plane that fluid does not cross: through `point`, `normal` (any length) towards the fluid."""

    point: Point
    normal: tuple[float, float, float]
    hole: Hole | None = None

    @model_validator(mode="after")
    def _has_direction(self) -> Wall:
        if not any(self.normal):
            raise ValueError("normal is (0, 0, 0): give the direction from the wall to the fluid")
        return self
