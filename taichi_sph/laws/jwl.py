"""Gas of a detonated explosive: the equation of state of Jones, Wilkins and Lee (Lee, Hornig and Kury 1968; T 2.4.6).

    p = A (1 - w / (R1 V)) exp(-R1 V) + B (1 - w / (R2 V)) exp(-R2 V) + w E / V

V = rho_0 / rho, and E is the energy per volume of the explosive before it burns [Pa]. T prints 1 - w R V for 1 - w / (R V), which makes p
negative at the front; with the form above the constants of T table 2.12 give the speed of detonation of that table.

Along an isentrope dE = -p dV, so rho_0 c^2 = -V^2 dp/dV = -V^2 f'(V) + w (E + p V) with f the first two terms.
"""

from typing import Any

import numpy as np

from ..runtime import ti


@ti.func
def cold(material: ti.template(), b, V):
    """The first two terms: p without energy [Pa]; b is the number of the body."""
    w = material.omega[b]
    one, two = material.R1[b] * V, material.R2[b] * V
    return material.gas_A[b] * (1.0 - w / one) * ti.exp(-one) + material.gas_B[b] * (1.0 - w / two) * ti.exp(-two)


@ti.func
def modulus(material: ti.template(), b, V, E, p):
    """rho_0 c^2 [Pa]."""
    w = material.omega[b]
    one, two = material.R1[b], material.R2[b]
    slope = material.gas_A[b] * ti.exp(-one * V) * (w / (one * V * V) + w / V - one)
    slope += material.gas_B[b] * ti.exp(-two * V) * (w / (two * V * V) + w / V - two)
    return ti.max(-V * V * slope + w * (E + p * V), 0.0)


def pressure(gas: Any, V: Any, E: Any) -> Any:
    """p [Pa] outside kernels, of numbers or arrays; gas: A, B [Pa], R1, R2, omega."""
    first = gas.A * (1.0 - gas.omega / (gas.R1 * V)) * np.exp(-gas.R1 * V)
    return first + gas.B * (1.0 - gas.omega / (gas.R2 * V)) * np.exp(-gas.R2 * V) + gas.omega * E / V


def detonation(gas: Any, density: float) -> tuple[float, float, float]:
    """(speed [m/s], pressure [Pa], V) of the state of Chapman and Jouguet: of all states that conserve mass, momentum and energy across a
    front, E = E_0 + p (1 - V) / 2, the one that the slowest front leads to, where it runs with sound behind it. gas.energy: E_0 [Pa]."""
    from scipy.optimize import minimize_scalar

    def slope(V: float) -> float:  # of the line from the state before the front, rho_0 D^2
        dead = pressure(gas, V, gas.energy)
        return dead / (1.0 - gas.omega * (1.0 - V) / (2.0 * V)) / (1.0 - V)

    found = minimize_scalar(slope, bounds=(0.5, 0.95), method="bounded", options={"xatol": 1e-12})
    return float(np.sqrt(found.fun / density)), float(found.fun * (1.0 - found.x)), float(found.x)
