"""Ductile damage of Lemaitre and Chaboche, linear in the plastic strain p (T 2.62, 2.66).

    dD = D_c / (eps_r - eps_d) R_nu dp    while R_nu p >= eps_d,
    R_nu = 2/3 (1 + nu) + 3 (1 - 2 nu) (sigma_H / sigma_eq)^2

R_nu, not its square root (T 2.89 and annex D take the root; Lemaitre 1985, whom T cites, and T 2.62, 2.66, 2.81 do
not); both are 1 in uniaxial tension. A step that crosses the threshold counts from there on.
"""

from ..runtime import ti


@ti.func
def triaxiality(nu, ratio2):
    """R_nu of (sigma_H / sigma_eq)^2."""
    return 2.0 / 3.0 * (1.0 + nu) + 3.0 * (1.0 - 2.0 * nu) * ratio2


@ti.func
def growth(p, dp, R, threshold, rupture, critical):
    """Increase of D while the plastic strain grows by dp to p."""
    return critical / (rupture - threshold) * R * ti.max(ti.min(dp, p - threshold / R), 0.0)
