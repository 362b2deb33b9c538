"""Gas of a detonated explosive: the equation of state of Jones, Wilkins and Lee (Lee, Hornig and Kury 1968; T 2.4.6).

    p = A (1 - w / (R1 V)) exp(-R1 V) + B (1 - w / (R2 V)) exp(-R2 V) + w E / V

V = rho_0 / rho, and E is the energy per volume of the explosive before it burns [Pa]. T prints 1 - w R V for 1 - w / (R V), which makes p
negative at the front; with the form above the constants of T table 2.12 give the speed of detonation of that table.

Along an isentrope dE = -p dV, so rho_0 c^2 = -V^2 dp/dV = -V^2 f'(V) + w (E + p V) with f the first two terms.
"""

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
