"""Isotropic hardening: the yield stress of a plastic strain lambda, at rates that do not count.

    power    sigma_y = A + B lambda^n, slope n B lambda^(n-1)                            (T 2.104, 2.109)
    table    linear between points (plastic strain, stress), constant after the last

For n < 1 the power's slope is infinite at lambda = 0; it only serves a guarded Newton iteration, and is taken at
1e-9 there. From one step to the next lambda grows by a little of itself, and six terms of the binomial series save
the power: (1 + x)^n to 1e-12 for x <= 0.03.
"""

from itertools import pairwise
from typing import Any

from ..runtime import ti


def at(strength: Any, strain: float) -> tuple[float, float]:
    """(sigma_y, slope) [Pa] of a strength of scene.laws, outside kernels."""
    if strength.kind == "perfect":
        return strength.yield_stress, 0.0
    if strength.kind == "table":
        for (a, low), (b, high) in pairwise(strength.points):
            if a <= strain < b:
                slope = (high - low) / (b - a)
                return low + slope * (strain - a), slope
        return strength.points[-1][1], 0.0
    base = max(strain, 1e-12)
    return strength.A + strength.B * base**strength.n, strength.n * strength.B * base ** (strength.n - 1)


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
def power_after(lam, more, stress, A, B, n):
    """(sigma_y, slope) [Pa] at lam + more, where it is `stress` at lam."""
    x = more / ti.max(lam, 1e-30)
    result, slope = stress, stress * 0.0
    if x <= 0.03:
        grown = 1.0 + x * (n - 5.0) / 6.0
        for k in ti.static((5, 4, 3, 2, 1)):
            grown = 1.0 + x * (n - (k - 1)) / k * grown
        hard = (stress - A) * grown
        result, slope = A + hard, n * hard / ti.max(lam + more, 1e-9)
    else:
        result, slope = power(lam + more, A, B, n)
    return result, slope


@ti.func
def table(lam, points: ti.template(), first, count):
    """(sigma_y, slope) [Pa] from `count` entries (lambda, sigma_y) of the field `points`, from `first` on."""
    low, high = first, first + count - 1  # points[low] <= lam < points[high], by halving
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
