"""Linear elasticity in space between Green-Lagrange strain and second Piola-Kirchhoff stress (six numbers, numerics/symmetric.py)."""

from ..runtime import ti


@ti.func
def stress(lame, shear, E: ti.template()):
    """S = lame tr E + 2 shear E [Pa]."""
    S = 2.0 * shear * E
    trace = E[0] + E[1] + E[2]
    for k in ti.static(range(3)):
        S[k] += lame * trace
    return S
