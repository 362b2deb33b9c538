"""Tait's equation of state (Cole 1948; Monaghan 1994), with the compression s = rho / rho_0 - 1.

    p = rho_0 c^2 / gamma ((1 + s)^gamma - 1)
    e = int p / rho^2 d rho = c^2 / gamma (((1 + s)^(gamma - 1) - 1) / (gamma - 1) + 1 / (1 + s) - 1)     [J/kg]

It stiffens as it is compressed: at 1 GPa and gamma 7.15, c of water has doubled, where the acoustic law keeps it.
"""

import numpy as np

from ..numerics import doubles
from ..runtime import ti


def pressures(stiffness: float, gamma: float, s: np.ndarray) -> np.ndarray:
    """`pressure` outside kernels."""
    return stiffness / gamma * np.expm1(gamma * np.log1p(s))


def compressions(stiffness: float, gamma: float, p: np.ndarray) -> np.ndarray:
    """`compression` outside kernels."""
    return np.expm1(np.log1p(gamma * p / stiffness) / gamma)


@ti.func
def pressure(stiffness, gamma, s):
    """p [Pa]; stiffness = rho_0 c^2. By expm1 and log1p in f64, or the difference from 1 would lose small s."""
    x = gamma * _log1p(ti.cast(s, ti.f64))
    return ti.cast(stiffness / gamma * _expm1(x), float)


@ti.func
def compression(stiffness, gamma, p):
    """s of a pressure, in f64."""
    return _expm1(_log1p(ti.cast(p, ti.f64) * gamma / stiffness) / gamma)


@ti.func
def energy(gamma, s):
    """e / c^2, in f64."""
    s = ti.cast(s, ti.f64)
    x = _log1p(s)
    result = s * s * (0.5 + s * (gamma - 5.0) / 6.0)
    if ti.abs(s) > 1e-4:
        result = (_expm1((gamma - 1.0) * x) / (gamma - 1.0) + _expm1(-x)) / gamma
    return result


@ti.func
def _log1p(x):
    u = 1.0 + x
    result = x
    if u != 1.0:
        result = doubles.log(u) * x / (u - 1.0)
    return result


@ti.func
def _expm1(x):
    u = doubles.exp(x)
    result = x
    if ti.abs(x) > 1e-5:
        result = u - 1.0
        if ti.abs(x) < 0.5 and u != 1.0:
            result = (u - 1.0) * x / doubles.log(u)
    elif x != 0.0:
        result = x * (1.0 + 0.5 * x)
    return result
