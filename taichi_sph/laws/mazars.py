"""Mazars damage, traction part (T 2.61, 2.64), integrated.

    eps* = sqrt(<eps_1>^2 + <eps_2>^2 + <eps_3>^2)                                      (T 2.61)
    D(eps*) = 1 - eps_D (1 - A) / eps* - A exp(-B (eps* - eps_D))      for eps* > eps_D

whose derivative is T 2.64 with the sign of its second term put right: as printed it would heal. D never
falls: the caller keeps the largest value met.
"""

from ..runtime import ti


@ti.func
def equivalent_strain(nu, e11, e22, e12):
    """eps* in plane stress, where eps_3 = -nu / (1 - nu) (eps_1 + eps_2)."""
    mean = 0.5 * (e11 + e22)
    radius = ti.sqrt(0.25 * (e11 - e22) ** 2 + e12 * e12)
    e1 = ti.max(mean + radius, 0.0)
    e2 = ti.max(mean - radius, 0.0)
    e3 = ti.max(-nu / (1.0 - nu) * 2.0 * mean, 0.0)
    return ti.sqrt(e1 * e1 + e2 * e2 + e3 * e3)


@ti.func
def damage(eps, threshold, A, B):
    """D of an equivalent strain `eps`, 0 below the threshold."""
    result = eps * 0.0
    if eps > threshold:
        result = 1.0 - threshold * (1.0 - A) / eps - A * ti.exp(-B * (eps - threshold))
    return result
