"""Closed forms of the gas of laws/jwl.py, outside kernels, and the detonation that it can have. NumPy only."""

from __future__ import annotations

from typing import Any

import numpy as np


def pressure(gas: Any, V: Any, E: Any) -> Any:
    """p [Pa] of numbers or arrays; gas: A, B [Pa], R1, R2, omega."""
    first = gas.A * (1.0 - gas.omega / (gas.R1 * V)) * np.exp(-gas.R1 * V)
    return first + gas.B * (1.0 - gas.omega / (gas.R2 * V)) * np.exp(-gas.R2 * V) + gas.omega * E / V


def chapman_jouguet(gas: Any, density: float) -> tuple[float, float, float] | None:
    """(speed [m/s], pressure [Pa], V) of the state of Chapman and Jouguet: of all states that conserve mass, momentum and energy across a
    front, E = E_0 + p (1 - V) / 2, the one that the slowest front leads to, where it runs with sound behind it. None where a gas has none.
    gas.energy: E_0 [Pa]."""
    from scipy.optimize import minimize_scalar

    def slope(V: float) -> float:  # of the line from the state before the front, rho_0 D^2
        dead = pressure(gas, V, gas.energy)
        return dead / (1.0 - gas.omega * (1.0 - V) / (2.0 * V)) / (1.0 - V)

    low, high = 0.5, 0.95
    found = minimize_scalar(slope, bounds=(low, high), method="bounded", options={"xatol": 1e-12})
    if not (0.0 < found.fun < np.inf and low + 1e-3 < found.x < high - 1e-3):  # at an end of the range is no minimum
        return None
    return float(np.sqrt(found.fun / density)), float(found.fun * (1.0 - found.x)), float(found.x)
