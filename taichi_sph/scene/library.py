"""Ready materials, each with its source: `material("AU4G 2024")`, `materials()` lists them.

Numbers are those of the tables of T. Where T does not give E, nu, rho of a steel, 210 GPa, 0.3 and 7800 kg/m3
stand for them. T table 2.11 gives A and B in Pa though its heading says MPa. The rows of T table 2.1 are damage
laws without a strength: `ductile("E24")`.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from ..errors import SceneError, nearest
from .laws import Delay, JohnsonCook, LemaitreChaboche, Material, Mazars, Perfect

STEEL: dict[str, Any] = {"young": 210e9, "poisson": 0.3, "density": 7800.0}

# T table 2.1, at 20 degrees C: eps_d, eps_r, D_c
_DUCTILE = {
    "copper 99.9": (0.35, 1.04, 0.85),
    "AU4G1": (0.03, 0.25, 0.23),
    "E24": (0.5, 0.88, 0.17),
    "1015": (0.259, 1.4, 0.065),
    "1045": (0.223, 0.95, 0.065),
    "1090": (0.129, 0.64, 0.065),
    "A3": (0.202, 1.0, 0.1),
    "XC38": (0.0, 0.56, 0.22),
    "30CD4": (0.02, 0.37, 0.24),
    "INCO 718": (0.02, 0.29, 0.24),
}


def ductile(name: str) -> LemaitreChaboche:
    """Coefficients of ductile damage of T table 2.1. SceneError when there is no such row."""
    if name not in _DUCTILE:
        raise SceneError(f"ductile damage '{name}' is not known{nearest(name, _DUCTILE)}; there are {', '.join(_DUCTILE)}")
    threshold, rupture, critical = _DUCTILE[name]
    return LemaitreChaboche(threshold=threshold, rupture=rupture, critical=critical)


@cache
def _library() -> dict[str, Material]:
    concrete: dict[str, Any] = {"damage": Mazars(kind="mazars", threshold=8.5e-5, A=1, B=7300), "poisson": 0.2, "critical_damage": 0.99}
    au4g: dict[str, Any] = {"young": 73.1e9, "density": 2780.0, "poisson": 0.33, "strength": Perfect(yield_stress=325e6)}
    tank = LemaitreChaboche(threshold=0.0, rupture=1.0, critical=0.25)
    found = [
        Material(name="concrete, beam", source="T table 2.2", young=31.37e9, density=2400, delay=Delay(a=1, tau_c=1.5e-5), **concrete),
        Material(name="concrete, plate", source="T table 2.6", young=32e9, density=2450, delay=Delay(a=10, tau_c=1e-6), **concrete),
        Material(
            name="steel, perforated plate",
            source="T table 2.8; E, nu, rho not given there",
            strength=JohnsonCook(A=57.27e6, B=79.64e6, n=0.316, C=0.37848, rate0=1e-3),
            damage=tank,
            delay=Delay(a=1, tau_c=1e-8),
            critical_damage=0.25,
            **STEEL,
        ),
        Material(
            name="AISI 1018",
            source="T table 2.11; E, nu, rho not given there",
            strength=JohnsonCook(A=560e6, B=300e6, n=0.32, C=0.12, rate0=100.0),
            damage=LemaitreChaboche(threshold=0.2, rupture=0.71, critical=0.07),
            delay=Delay(a=1, tau_c=2e-6),
            critical_damage=0.07,
            **STEEL,
        ),
        Material(
            name="steel, tank",
            source="T table 3.1, kappa of T 3.4; E, nu, rho not given there",
            strength=JohnsonCook(A=175e6, B=380e6, n=0.32, C=0.0, rate0=1e-3, kappa=1.0),
            damage=tank,
            delay=Delay(a=1, tau_c=1e-8),
            critical_damage=0.25,
            **STEEL,
        ),
        Material(name="AU4G 2024", source="T table 5.3", **au4g),
        Material(
            name="AU4G 2024, tearing",
            source="T tables 5.3 and 5.6",
            damage=LemaitreChaboche(threshold=0.03, rupture=0.25, critical=0.23),
            delay=Delay(a=2, tau_c=1e-7),
            critical_damage=0.23,
            **au4g,
        ),
        Material(name="APX", source="T table 5.4", young=211e9, density=7700, poisson=0.3, strength=Perfect(yield_stress=900e6)),
    ]
    return {m.name: m for m in found}


def materials() -> dict[str, str]:
    """Name -> source of every material here."""
    return {name: m.source for name, m in _library().items()}


def material(name: str, **changes) -> Material:
    """The material of that name, some of its keys changed. SceneError when there is none."""
    if name not in _library():
        raise SceneError(f"material '{name}' is not known{nearest(name, materials())}; there are {', '.join(materials())}")
    found = _library()[name]
    return Material(**{key: getattr(found, key) for key in type(found).model_fields} | changes) if changes else found
