"""Linear elasticity in plane stress (T 2.10) between Green-Lagrange strain and second Piola-Kirchhoff stress."""

from ..runtime import ti


@ti.func
def plane_stress(young, nu, e11, e22, e12):
    """S11, S22, S12 [Pa] from the strain components; e12 is the tensor component, half of gamma."""
    c = young / (1.0 - nu * nu)
    return ti.Vector([c * (e11 + nu * e22), c * (e22 + nu * e11), c * (1.0 - nu) * e12])
