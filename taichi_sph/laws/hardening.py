"""Isotropic hardening: the yield stress of a plastic strain lambda, at rates that do not count.

    power    sigma_y = A + B lambda^n, slope n B lambda^(n-1)                            (T 2.104, 2.109)
    table    linear between points (plastic strain, stress), constant after the last

For n < 1 the power's slope is infinite at lambda = 0; it only serves a guarded Newton iteration, and is taken at
1e-9 there.
"""

from ..runtime import ti


@ti.func
def power(lam, A, B, n):
    """(sigma_y, slope) [Pa]."""
    stress, slope = A, B * 0.0
    if B > 0.0:
        base = ti.max(lam, 1e-9)
        slope = n * B * ti.pow(base, n - 1.0)
        if lam > 0.0:
            stress += slope * base / n * ti.min(lam / base, 1.0)
    return stress, slope


@ti.func
def table(lam, points: ti.template(), count):
    """(sigma_y, slope) [Pa] from `count` entries (lambda, sigma_y) of the field `points`."""
    low, high = 0, count - 1  # points[low] <= lam < points[high], by halving
    stress, slope = points[high][1], points[high][1] * 0.0
    if lam < points[high][0]:
        while high - low > 1:
            middle = (low + high) // 2
            if points[middle][0] <= lam:
                low = middle
            else:
                high = middle
        slope = (points[high][1] - points[low][1]) / (points[high][0] - points[low][0])
        stress = points[low][1] + slope * (lam - points[low][0])
    return stress, slope
