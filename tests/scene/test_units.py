"""Numbers are SI; texts carry units; anything else is refused in words."""

from __future__ import annotations

import subprocess
import sys

import pint
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from taichi_sph.scene.units import FACTORS, Density, Dimensionless, Force, Length, Pressure, Speed, Time, show

CASES = [
    (Length, "4 mm", 4e-3),
    (Length, "15/16 inch", 15 / 16 * 0.0254),
    (Length, "8in", 8 * 0.0254),
    (Length, "-2.5e-3 m", -2.5e-3),
    (Length, "4 µm", 4e-6),
    (Length, 3, 3.0),
    (Time, "15 us", 15e-6),
    (Time, "1.2 ms", 1.2e-3),
    (Speed, "730 m/s", 730.0),
    (Speed, "7.6 mm/us", 7600.0),
    (Pressure, "32 GPa", 32e9),
    (Pressure, "1 N/mm^2", 1e6),
    (Pressure, "1 bar", 1e5),
    (Force, "3 kN", 3e3),
    (Density, "7.8 g/cm^3", 7800.0),
    (Density, "7.8e-9 tonne/mm**3", 7800.0),
    (Density, "2450 kg/m3", 2450.0),
    (Density, "1 kg·m^-3", 1.0),
    (Dimensionless, "20 %", 0.2),
    (Dimensionless, "0.2", 0.2),
]


@pytest.mark.parametrize(
    ("kind", "value", "si"), CASES, ids=lambda v: str(v) if isinstance(v, (str, int, float)) else v.__metadata__[-1].dimension
)
def test_values(kind, value, si):
    assert TypeAdapter(kind).validate_python(value) == pytest.approx(si, rel=1e-14)


def test_factors_are_those_of_pint():
    registry = pint.UnitRegistry(on_redefinition="ignore")
    for symbol, factors in FACTORS.items():
        for unit, factor in factors.items():
            assert factor == float(registry.Quantity(1.0, unit).to(symbol).magnitude), unit


REFUSED = [
    "4", "", "mm", "4 kg", "4 mmm", "four mm", "4,0 mm", "4 mm 3", "4 mm; import os", "9**9**9 m", "5 m^99", "1/0 m",
    "nan m", "( m", "4 degC", True, None, [1], {"m": 1}, 1j,
]  # fmt: skip


@pytest.mark.parametrize("value", REFUSED, ids=repr)
def test_refused(value):
    with pytest.raises(ValidationError) as caught:
        TypeAdapter(Length).validate_python(value)
    said = str(caught.value.errors()[0]["ctx"]["error"])
    assert said.startswith(("is not a length", "has no unit", "divides"))


@given(st.text(max_size=30))
def test_any_text_is_a_number_or_a_sentence(text):
    try:
        assert isinstance(TypeAdapter(Length).validate_python(text), float)
    except ValidationError as error:
        assert error.errors()[0]["type"] == "value_error"


def test_numbers_do_not_load_pint():
    code = "import sys; from taichi_sph.scene import Plate; Plate(length=1, width=1); sys.exit('pint' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


@pytest.mark.parametrize(
    ("value", "symbol", "text"),
    [(4e-3, "m", "4 mm"), (0.99999e-3, "m", "1 mm"), (0, "m", "0 m"), (3.2e10, "Pa", "32 GPa"), (2e3, "m", "2000 m")],
)
def test_show(value, symbol, text):
    assert show(value, symbol) == text
