"""Acoustic equation of state (T 1.19): dp = c^2 d rho, written with the compression s = rho / rho_0 - 1.

    p = rho_0 c^2 s,     e = int p / rho^2 d rho = c^2 (ln(1 + s) - s / (1 + s))     [J/kg]

s and not rho is the state: of 1000 kg/m3 single precision keeps 6e-5, that is 130 Pa of water.
"""

import numpy as np

from ..numerics import doubles
from ..runtime import ti


def pressures(stiffness: float, gamma: float, s: np.ndarray) -> np.ndarray:
    """`pressure` outside kernels."""
    return stiffness * s


def compressions(stiffness: float, gamma: float, p: np.ndarray) -> np.ndarray:
    """`compression` outside kernels."""
    return p / stiffness


@ti.func
def pressure(stiffness, gamma, s):
    """p [Pa]; stiffness = rho_0 c^2; gamma is Tait's, not used."""
    return stiffness * s


@ti.func
def compression(stiffness, gamma, p):
    """s of a pressure."""
    return p / stiffness


@ti.func
def energy(gamma, s):
    """e / c^2 (in f64: it is small, of order s^2 / 2)."""
    s = ti.cast(s, ti.f64)
    result = s * s * (0.5 - s * (2.0 / 3.0 - s * (0.75 - 0.8 * s)))
    if ti.abs(s) > 1e-3:
        result = doubles.log(1.0 + s) - s / (1.0 + s)
    return result
