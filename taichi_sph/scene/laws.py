"""Materials as the user says them: strength, damage, rupture chosen apart. No Taichi here.

    strength    none (elastic), "perfect", "power", "table", "johnson_cook"
    damage      none, Mazars (brittle shells, without strength), Concrete (solids, without strength), LemaitreChaboche (ductile, needs a
                strength)
    delay       none, or the delay law of either damage
    rupture     critical_damage: a cell whose delayed damage reaches it breaks
    burns       none, or Jwl: an explosive, alone

Ready materials with their sources: `taichi_sph.scene.library`.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, StrictBool, StrictInt, model_validator

from . import plausible
from .base import Choice, Frozen
from .units import Capacity, Density, Dimensionless, Pressure, Rate, Speed, Temperature, Time, show

# --- strength ---------------------------------------------------------------------------------------


class _Strength(Frozen):
    """What every strength of a bent shell has: how its cross-section yields (T 2.43).

    Without `layers` the cross-section is one point (the thesis's global form): `alpha` is the share of the skin stress
    of bending, 2/3 = a plastic hinge forms when the whole thickness yields, 1 = when the skin does; `kappa` that of
    transverse shear, 0 = it stays elastic. With `layers` stress, plastic strain and damage are kept at that many Gauss
    points through the thickness: slower, and exact where the global form is not (docs/method.md).
    """

    alpha: Annotated[Dimensionless, Field(ge=0.5, le=1.5)] = 2.0 / 3.0
    kappa: Annotated[Dimensionless, Field(ge=0, le=1)] = 0.0
    layers: Annotated[StrictInt, Field(ge=2, le=15)] | None = None

    @model_validator(mode="after")
    def _one_form(self) -> _Strength:
        if self.layers is not None and self.kappa > 0:
            raise ValueError("kappa belongs to the global form; in layers transverse shear stays elastic: leave one of them out")
        return self


class Perfect(_Strength):
    """Perfect plasticity: no hardening."""

    kind: Literal["perfect"] = "perfect"
    yield_stress: Annotated[Pressure, Field(gt=0)]


class Power(_Strength):
    """Isotropic hardening sigma_y = A + B lambda^n."""

    kind: Literal["power"] = "power"
    A: Annotated[Pressure, Field(gt=0)]
    B: Annotated[Pressure, Field(ge=0)]
    n: Annotated[Dimensionless, Field(gt=0, le=1)]


class Table(_Strength):
    """Isotropic hardening by points (plastic strain, true stress), linear between them, constant after the last."""

    kind: Literal["table"] = "table"
    points: Annotated[tuple[tuple[Dimensionless, Pressure], ...], Field(min_length=1, max_length=200)]

    @model_validator(mode="after")
    def _rises(self) -> Table:
        strain, stress = zip(*self.points)
        if strain[0] != 0.0:
            raise ValueError(f"points: the first one must be the yield stress at plastic strain 0, not at {strain[0]:g}")
        if any(b <= a for a, b in zip(strain, strain[1:])):
            raise ValueError("points: the plastic strains must rise from point to point")
        if stress[0] <= 0 or any(b < a for a, b in zip(stress, stress[1:])):
            raise ValueError("points: the stresses must be positive and must not fall; softening is the work of damage")
        return self


class Heat(Frozen):
    """Johnson and Cook's softening by heat, 1 - T*^m with T* = (T - room) / (melting - room), of a solid that keeps the heat of its own
    plastic work: dT = share x work / (density x capacity) (Johnson and Cook 1983)."""

    m: Annotated[Dimensionless, Field(gt=0, le=5)]
    melting: Annotated[Temperature, Field(gt=0)]
    capacity: Annotated[Capacity, Field(gt=0)]
    room: Annotated[Temperature, Field(gt=0)] = 293.0
    share: Annotated[Dimensionless, Field(ge=0, le=1)] = 0.9

    @model_validator(mode="after")
    def _melts(self) -> Heat:
        if self.melting <= self.room:
            raise ValueError(f"melting {self.melting:g} K must be above room {self.room:g} K")
        return self


class JohnsonCook(_Strength):
    """sigma_y = (A + B lambda^n)(1 + C ln(rate / rate0)), the last factor 1 below rate0 (T 2.104). heat: times its softening, of solids."""

    kind: Literal["johnson_cook"] = "johnson_cook"
    A: Annotated[Pressure, Field(gt=0)]
    B: Annotated[Pressure, Field(ge=0)]
    n: Annotated[Dimensionless, Field(gt=0, le=1)]
    C: Annotated[Dimensionless, Field(ge=0, le=10)]
    rate0: Annotated[Rate, Field(gt=0)]
    heat: Heat | None = None


Strength = Annotated[Perfect | Power | Table | JohnsonCook, *Choice]


# --- damage -----------------------------------------------------------------------------------------


class Mazars(Frozen):
    """Mazars damage, traction part (T 2.61, 2.64)."""

    kind: Literal["mazars"] = Field("mazars", exclude=True)  # the one meant where no kind is given
    threshold: Annotated[Dimensionless, Field(gt=0, lt=1)]  # epsilon_D
    A: Annotated[Dimensionless, Field(ge=0, le=1)]  # A_L, asymptote
    B: Annotated[Dimensionless, Field(gt=0)]  # B_L, fall after the peak


class LemaitreChaboche(Frozen):
    """Ductile damage, linear in the plastic strain (T 2.62, 2.66): 0 up to `threshold`, `critical` at `rupture`, both
    true plastic strains of uniaxial tension. `necks`: `rupture` is the strain in a neck, and a cell wider than the sheet is
    thick breaks at the mean of the neck and the sheet beside it (laws/necking.py). `scatter`: of both strains from cell to cell, standard
    deviation over mean (laws/scatter.py); `numerics.seed` chooses among them. `spread`: in cells narrower than the sheet is thick, damage
    goes by the mean plastic strain over a neck as wide as that (bodies/shell_sph/spread.py)."""

    kind: Literal["lemaitre_chaboche"] = "lemaitre_chaboche"
    threshold: Annotated[Dimensionless, Field(ge=0)]  # eps_d, eps_p^s
    rupture: Annotated[Dimensionless, Field(gt=0)]  # eps_r, eps_p^c
    critical: Annotated[Dimensionless, Field(gt=0, le=1)]  # D_c
    necks: StrictBool | None = None
    scatter: Annotated[Dimensionless, Field(ge=0.001, le=0.5)] | None = None
    spread: StrictBool | None = None

    @model_validator(mode="after")
    def _grows(self) -> LemaitreChaboche:
        if self.rupture <= self.threshold:
            raise ValueError(f"rupture {self.rupture:g} must be greater than threshold {self.threshold:g}")
        return self


class Concrete(Frozen):
    """Concrete of a solid: elastic up to its strengths in tension and compression, then damaged as Mazars' law has it, D = 1 - eps_D (1 -
    A) / eps - A exp(-B (eps - eps_D)) with eps_D = tension / E (laws/concrete.py).

    `strain`: what drives the damage, "de_vree" (modified von Mises strain, exact for both strengths, nothing under pressure) or
    "principal" (P's form: the squares of positive principal strains and `share` times those of negative ones). `rubble`: what is broken
    still rubs under pressure.

    Where cells rupture (critical_damage), one breaks once its damage is complete and its mean stress tensile. `loosest`: only once its
    volume has grown to that many times the reference; until then it closes again. `flattest`: least principal stretch of a cell; one that
    is flatter, or turned inside out, breaks whatever it bears.
    """

    kind: Literal["concrete"] = "concrete"
    tension: Annotated[Pressure, Field(gt=0)]
    compression: Annotated[Pressure, Field(gt=0)]
    A: Annotated[Dimensionless, Field(ge=0, le=1)] = 1.0
    B: Annotated[Dimensionless, Field(gt=0)]
    strain: Literal["de_vree", "principal"] = "de_vree"
    share: Annotated[Dimensionless, Field(ge=0, le=1)] = 0.1
    rubble: StrictBool = True
    flattest: Annotated[Dimensionless, Field(gt=0, lt=1)] | None = None
    loosest: Annotated[Dimensionless, Field(gt=1, le=10)] | None = None

    @model_validator(mode="after")
    def _stronger_in_compression(self) -> Concrete:
        if self.compression < self.tension:
            raise ValueError(
                f"compression {show(self.compression, 'Pa')} is below tension {show(self.tension, 'Pa')}: concrete bears more in "
                "compression"
            )
        return self


def _mazars_meant(value: Any) -> Any:
    return {"kind": "mazars", **value} if isinstance(value, dict) and "kind" not in value else value


Damage = Annotated[Mazars | LemaitreChaboche | Concrete, Field(discriminator="kind"), BeforeValidator(_mazars_meant)]


class Delay(Frozen):
    """Delayed damage (T 2.73): the rate of damage is bounded by 1/tau_c."""

    a: Annotated[Dimensionless, Field(gt=0)]
    tau_c: Annotated[Time, Field(gt=0)]


# --- explosive --------------------------------------------------------------------------------------


FITS = 0.05  # between the speed of a detonation and that of its gas


class Jwl(Frozen):
    """What an explosive becomes behind the front of its detonation: a gas with the law of Jones, Wilkins and Lee (laws/jwl.py). `energy`:
    chemical energy per volume before it burns; `speed`: of the front, which runs from where the solid is lit (Detonation)."""

    kind: Literal["jwl"] = "jwl"
    A: Annotated[Pressure, Field(gt=0)]
    B: Annotated[Pressure, Field(ge=0)]
    R1: Annotated[Dimensionless, Field(ge=0.1, le=50)]
    R2: Annotated[Dimensionless, Field(ge=0.1, le=50)]
    omega: Annotated[Dimensionless, Field(gt=0, le=2)]
    energy: Annotated[Pressure, Field(gt=0)]
    speed: Annotated[Speed, Field(ge=1000, le=20_000)]


# --- material ---------------------------------------------------------------------------------------


def _detonates(m: Material, gas: Jwl) -> None:
    """The front is as fast as its gas makes it, and no wave outruns it."""
    from ..laws.detonation import chapman_jouguet

    found = chapman_jouguet(gas, m.density)
    if found is None:
        raise ValueError("burns: a gas with these constants does not detonate; R1 is 4 to 6 as a rule, R2 1 to 2")
    speed, _, _ = found
    if abs(gas.speed / speed - 1.0) > FITS:
        raise ValueError(f"burns.speed {gas.speed:g} m/s is not that of its gas: the other constants and density give {speed:.4g} m/s")
    if m.wave_speed >= gas.speed:
        raise ValueError(
            f"young {show(m.young, 'Pa')} gives waves of {m.wave_speed:.4g} m/s, faster than the front, {gas.speed:g} m/s; it is that of"
            " what has not burnt yet"
        )


class Material(Frozen):
    """Isotropic elasticity (of a shell in plane stress), with optional strength, damage, delay and rupture."""

    name: str
    source: str = ""
    young: Annotated[Pressure, Field(gt=0)]
    poisson: Annotated[Dimensionless, Field(gt=-1, lt=0.5)]
    density: Annotated[Density, Field(gt=0)]
    strength: Strength | None = None
    damage: Damage | None = None
    delay: Delay | None = None
    critical_damage: Annotated[Dimensionless, Field(gt=0, le=1)] | None = None  # D_c: rupture
    burns: Jwl | None = None  # an explosive; young and poisson are those of what has not burnt yet

    @property
    def wave_speed(self) -> float:
        """Of pressure waves in a solid at rest [m/s]."""
        pressed = (1 - self.poisson) / ((1 + self.poisson) * (1 - 2 * self.poisson))  # modulus of these waves over E
        return math.sqrt(pressed * self.young / self.density)

    @property
    def laws(self) -> tuple:
        """What is compiled for it: strength (none; by a table, with rates, layers), damage, its scatter and spread, delay, rupture.
        Numbers do not count."""
        strength = self.strength
        hardens = None if strength is None else (strength.kind == "table", strength.kind == "johnson_cook", strength.layers)
        damages = (self.damage is not None, getattr(self.damage, "scatter", None) is not None, bool(getattr(self.damage, "spread", None)))
        return hardens, damages, self.delay is not None, self.critical_damage is not None

    @model_validator(mode="after")
    def _believable(self) -> Material:
        if self.damage is None and (self.delay is not None or self.critical_damage is not None):
            raise ValueError("delay and critical_damage need a damage law: set damage")
        for key in ("flattest", "loosest"):
            if getattr(self.damage, key, None) is not None and self.critical_damage is None:
                raise ValueError(
                    f"damage.{key} says when a cell ruptures, which none does without critical_damage: set it, or leave {key} out"
                )
        if isinstance(self.damage, LemaitreChaboche) and self.strength is None:
            raise ValueError("damage: 'lemaitre_chaboche' grows with plastic strain and needs a strength: set strength")
        if isinstance(self.damage, Mazars | Concrete) and self.strength is not None:
            raise ValueError(f"damage: '{self.damage.kind}' is for brittle materials without strength; use 'lemaitre_chaboche'")
        if self.burns is not None and (self.strength is not None or self.damage is not None):
            raise ValueError("burns: an explosive is elastic until it is a gas; leave out strength and damage")
        plausible.material(self)
        if self.burns is not None:
            _detonates(self, self.burns)
        return self
