"""Von Mises plasticity in space with isotropic hardening: the radial return (Wilkins 1964; Simo and Hughes 1998, box 3.1).

The trial deviator s shrinks along itself, s = s_trial (1 - 3 G dp / q_trial) with q = sqrt(3/2 s : s), so that one scalar equation is left,

    q_trial - 3 G dp = f sigma_y(lambda + (1 - D_r) dp)

with f the factor of rate and heat. Its left side falls and its right side does not, so the root is bracketed by 0 and (q_trial - f sigma_y)
/ 3 G, and von_mises.multiplier, which solves it as one mode of its own equation, cannot fail.
"""

from ..numerics import symmetric
from ..runtime import ti
from . import von_mises


@ti.func
def equivalent(s: ti.template()):
    """q [Pa] of a deviator."""
    return ti.sqrt(1.5 * symmetric.product(s, s))


@ti.func
def returned(material: ti.template(), body, s: ti.template(), q, shear, flow, lam, kept, factor):
    """(s, dp, sigma_y with its factor) of a trial deviator s beyond the surface, q = equivalent(s) > factor * flow."""
    dp, now = von_mises.multiplier(material, body, ti.Vector([q * q]), ti.Vector([3.0 * shear]), flow, lam, kept, factor)
    return s * (now / q), dp, now
