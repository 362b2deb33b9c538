"""Physical quantities at the edge of the program: a number is SI, a string carries its unit.

`Length`, `Time`, ... are annotated floats. After validation every value is a float in the SI unit of
its dimension; "4 mm", "32 GPa" or "15/16 inch" are converted once, here. Pint takes a second to start, so
its factors of the units that most scenes are written in stand here; it is imported for the first other unit.
"""

from __future__ import annotations

import math
import numbers
import re
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any

from pydantic import BeforeValidator

from ..errors import nearest

COMMON = (
    "m mm cm um km in inch ft s ms us ns Pa kPa MPa GPa bar N kN MN kg g tonne kg/m^3 g/cm^3 tonne/mm^3 m/s mm/ms km/s deg rad"
).split()


@dataclass(frozen=True)
class Unit:
    """Marks an annotated float with its SI unit; `example` is shown when a value is refused."""

    symbol: str
    dimension: str
    example: str

    @property
    def named(self) -> str:
        """'a length', 'an angular speed'."""
        return f"{'an' if self.dimension[0] in 'aeiou' else 'a'} {self.dimension}"

    @property
    def shown(self) -> str:
        return f"'{self.example}'" if self.symbol else self.example


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(on_redefinition="ignore")


# a number or a fraction, then a product of unit names with one-digit powers: nothing else reaches pint,
# which would read '4,0 mm' as 40 mm, 'mm' as 1 mm, and compute '9**9**9 m' for ever
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*(?:/\s*({_NUMBER}))?\s*([^\d\s].*)?", re.ASCII)
_UNIT = re.compile(r"(?:[a-zA-Zµμ%°]+(?:\^-?\d)?|[\s*/()·])*")


FACTORS: dict[str, dict[str, float]] = {  # of the SI unit of a dimension, as pint has them
    "m": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "km": 1e3, "in": 0.0254, "inch": 0.0254},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "m/s": {"m/s": 1.0, "mm/ms": 1.0, "mm/us": 1e3, "km/s": 1e3},
    "rad": {"rad": 1.0, "deg": 0.017453292519943295},
    "kg": {"kg": 1.0, "g": 1e-3, "tonne": 1e3},
    "Pa": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "bar": 1e5},
    "N": {"N": 1.0, "kN": 1e3, "MN": 1e6},
    "kg/m^3": {"kg/m^3": 1.0},
    "m/s^2": {"m/s^2": 1.0},
    "N/m": {"N/m": 1.0, "kN/m": 1e3},
}


@cache
def _factor(text: str, symbol: str) -> float:
    """How many `symbol` one `text` is; ValueError on an unknown unit or another dimension."""
    if text in FACTORS.get(symbol, {}):
        return FACTORS[symbol][text]
    import pint

    spelled = re.sub(r"(?<=[a-zA-Zµμ])(-?\d)", r"^\1", text.replace("**", "^")).replace("·", "*")
    if not _UNIT.fullmatch(spelled):
        raise ValueError(f"'{text}' is not a unit")
    registry = _registry()
    try:
        return float(registry.Quantity(1.0, spelled).to(symbol or "dimensionless").magnitude)
    except pint.UndefinedUnitError as error:
        names = error.unit_names
        unknown = names if isinstance(names, str) else next(iter(names))
        raise ValueError(f"unknown unit '{unknown}'{nearest(unknown, COMMON)}") from None
    except pint.DimensionalityError:
        raise ValueError(f"'{text}' does not convert to {symbol or 'a pure number'}") from None
    except Exception:  # pint raises a dozen kinds on malformed text; to a user they are one
        raise ValueError(f"'{text}' is not a unit") from None


def to_si(text: str, unit: Unit) -> float:
    """The number of `unit.symbol` in `text`, e.g. to_si("4 mm", metre) = 0.004. ValueError if none."""
    match = _QUANTITY.fullmatch(text)
    if not match:
        raise ValueError(f"is not {unit.named} such as {unit.shown}")
    top, bottom, unit_text = match.groups()
    if bottom and float(bottom) == 0.0:
        raise ValueError("divides by zero")
    if not unit_text and unit.symbol:
        raise ValueError(f"has no unit; write {unit.named} such as {unit.shown}, or a plain number of {unit.symbol}")
    try:
        factor = _factor(unit_text.strip(), unit.symbol) if unit_text else 1.0
    except ValueError as error:
        raise ValueError(f"is not {unit.named} such as {unit.shown}: {error}") from None
    return float(top) / float(bottom or 1.0) * factor


LIGHT = 299_792_458.0  # m/s
FAR = 1e12  # m, beyond the planets: squares and cubes of lengths below are numbers
MOST = {
    "m/s": (LIGHT, f"is faster than light ({LIGHT:.4g} m/s)"),
    "m": (FAR, f"is beyond {FAR:.0e} m, where no scene reaches"),
    "rad": (1e4, "is more than a thousand turns"),
}


def _sensible(value: float, unit: Unit) -> float:
    most, said = MOST.get(unit.symbol, (math.inf, ""))
    if abs(value) >= most and math.isfinite(value):
        raise ValueError(said)
    return value


def _validator(unit: Unit) -> BeforeValidator:
    most, _ = MOST.get(unit.symbol, (math.inf, ""))

    def convert(value: Any) -> float:
        if type(value) is float and -most < value < most:  # nearly all, and a scene may have a million of them
            return value
        if isinstance(value, str):
            return _sensible(to_si(value, unit), unit)
        if isinstance(value, numbers.Real) and not isinstance(value, bool):
            try:
                return _sensible(float(value), unit)
            except OverflowError:
                raise ValueError(f"is larger than any {unit.dimension}") from None
        raise ValueError(f"is not {unit.named} such as {unit.shown}")

    return BeforeValidator(convert)


_METRE = Unit("m", "length", "4 mm")
_SECOND = Unit("s", "time", "15 us")
_SPEED = Unit("m/s", "speed", "730 m/s")
_SPIN = Unit("rad/s", "angular speed", "3 rad/s")
_RADIAN = Unit("rad", "angle", "40 deg")
_PASCAL = Unit("Pa", "pressure", "32 GPa")
_NEWTON = Unit("N", "force", "3 kN")
_DENSITY = Unit("kg/m^3", "density", "2450 kg/m^3")
_MOMENT = Unit("N*m", "moment", "2 N*m")
_ACCELERATION = Unit("m/s^2", "acceleration", "9.81 m/s^2")
_KILOGRAM = Unit("kg", "mass", "31 g")
_INERTIA = Unit("kg*m^2", "moment of inertia", "2e-6 kg*m^2")
_RATE = Unit("1/s", "rate", "100 s^-1")
_STIFFNESS = Unit("N/m", "stiffness", "3 kN/m")
_DAMPING = Unit("N*s/m", "damping", "20 N*s/m")
_KELVIN = Unit("K", "temperature", "293 K")
_CAPACITY = Unit("J/(kg*K)", "heat capacity", "383 J/(kg*K)")
_ONE = Unit("", "pure number", "0.2")

Length = Annotated[float, _validator(_METRE), _METRE]
Time = Annotated[float, _validator(_SECOND), _SECOND]
Speed = Annotated[float, _validator(_SPEED), _SPEED]
Spin = Annotated[float, _validator(_SPIN), _SPIN]
Angle = Annotated[float, _validator(_RADIAN), _RADIAN]
Mass = Annotated[float, _validator(_KILOGRAM), _KILOGRAM]
Inertia = Annotated[float, _validator(_INERTIA), _INERTIA]
Pressure = Annotated[float, _validator(_PASCAL), _PASCAL]
Force = Annotated[float, _validator(_NEWTON), _NEWTON]
Moment = Annotated[float, _validator(_MOMENT), _MOMENT]
Acceleration = Annotated[float, _validator(_ACCELERATION), _ACCELERATION]
Density = Annotated[float, _validator(_DENSITY), _DENSITY]
Rate = Annotated[float, _validator(_RATE), _RATE]
Stiffness = Annotated[float, _validator(_STIFFNESS), _STIFFNESS]
Damping = Annotated[float, _validator(_DAMPING), _DAMPING]
Temperature = Annotated[float, _validator(_KELVIN), _KELVIN]
Capacity = Annotated[float, _validator(_CAPACITY), _CAPACITY]
Dimensionless = Annotated[float, _validator(_ONE), _ONE]

_PREFIXES = {-12: "p", -9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}


def show(value: float, symbol: str = "") -> str:
    """A number with its SI unit for a sentence: show(0.004, 'm') = '4 mm', show(7.8e-9, 'kg/m^3') as is."""
    if symbol in ("m", "s", "Pa", "N", "J") and value and math.isfinite(value):
        if not 1e-18 <= abs(value) <= 1e18:
            return f"{value:.4g} {symbol}"
        value = float(f"{value:.4g}")  # 0.99999 mm is 1 mm, not 1000 um
        exponent = min(9, max(-12, 3 * math.floor(math.log10(abs(value)) / 3)))
        if symbol in ("m", "s"):
            exponent = min(0, exponent)
        return f"{value / 10.0**exponent:.4g} {_PREFIXES[exponent]}{symbol}"
    return f"{value:.6g} {symbol}".rstrip()
