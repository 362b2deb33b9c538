"""Concrete in space: what drives its damage, and what it still bears where it is broken.

**Strain of damage.** "de_vree", the modified von Mises strain (de Vree, Brekelmans and van Gils 1995), with k = compression / tension,

    eps = (k - 1) / (2 k (1 - 2 nu)) I_1 + 1 / (2 k) sqrt( ((k - 1) / (1 - 2 nu))^2 I_1^2 + 12 k / (1 + nu)^2 J_2 )

is the strain in uniaxial tension and 1/k of it in uniaxial compression, so damage starts at both strengths; under pressure alone it is
0. "principal", P's form, eps^2 = sum <eps_i>^2 + share sum <-eps_i>^2, has no `share` that meets both strengths of the paper's concrete.

**Shares.** Of a cell the share 1 - D is whole and D is rubble. The whole bears s_i up to the cap Y(p), the rubble s_f up to what rubs,
F(p):

    Y = fc min(0.79 + 1.6 (p/fc)^0.61, 7),    F = fc min(1.6 (p/fc)^0.61, 7) under pressure, 0 in tension
    s = (1 - D) s_i + D s_f,    pressure p in compression, (1 - D) p in tension

so that together q <= fc (0.79 (1 - D) + 1.6 (p/fc)^0.61), the strength of Holmquist, Johnson and Cook (1993) for concrete. Damage never
takes the stiffness under pressure: a law that drops to zero there gives way at a fraction of what a bullet meets. What breaks becomes
rubble with the stress that it has, as far as it can rub. Rubble does not compact: at strengths above 100 MPa that is of second order.
"""

from ..numerics import symmetric
from ..runtime import ti
from . import von_mises_solid

COHESION, SLOPE, POWER, MOST = 0.79, 1.6, 0.61, 7.0  # Holmquist, Johnson and Cook (1993)


@ti.func
def de_vree(nu, ratio, volume, e: ti.template()):
    """Strain of a volume strain and a deviator e."""
    part = (ratio - 1.0) / (1.0 - 2.0 * nu) * volume
    j2 = 0.5 * symmetric.product(e, e)
    return 0.5 / ratio * (part + ti.sqrt(part * part + 12.0 * ratio / ((1.0 + nu) * (1.0 + nu)) * j2))


@ti.func
def principal(share, volume, e: ti.template()):
    """P's strain of a volume strain and a deviator e."""
    w = symmetric.eigenvalues(e) + volume / 3.0
    up, down = ti.max(w, 0.0), ti.min(w, 0.0)
    return ti.sqrt(up.norm_sqr() + share * down.norm_sqr())


@ti.func
def cap(strength, pressure, cohesion):
    """q [Pa] that is borne under a pressure; cohesion: COHESION of the whole, 0 of rubble."""
    over = ti.max(pressure, 0.0) / strength
    rubs = over * 0.0
    if over > 0.0:
        rubs = SLOPE * ti.pow(over, POWER)
    return strength * ti.min(cohesion + rubs, MOST)


@ti.func
def capped(s: ti.template(), most):
    """The deviator s, shortened to q = most where it is beyond."""
    q = von_mises_solid.equivalent(s)
    result = s
    if q > most:
        result *= most / q
    return result
