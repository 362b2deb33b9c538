"""exp, log, sin and cos in f64 on every device. Shaders (Vulkan, Metal) have them in f32 only; there they are made of sums and products."""

from fractions import Fraction

import numpy as np

from .. import runtime
from ..runtime import ti


def _parts(value: Fraction) -> tuple[float, float, float]:
    """Three numbers of 24 bits that make up a constant: a literal has no more bits where the state is in f32."""
    found = []
    for _ in range(3):
        found.append(float(np.float32(float(value))))
        value -= Fraction(found[-1])
    return found[0], found[1], found[2]


LN2 = _parts(Fraction(6931471805599453094172321, 10**25))
QUARTER = _parts(Fraction(15707963267948966192313217, 10**25))  # of a turn


@ti.func
def exp(x):
    result = x
    if ti.static(runtime.functions_of_64_bits()):
        result = ti.exp(x)
    else:
        result = _exp(x)
    return result


@ti.func
def log(x):
    result = x
    if ti.static(runtime.functions_of_64_bits()):
        result = ti.log(x)
    else:
        result = _log(x)
    return result


@ti.func
def sin(x):
    result = x
    if ti.static(runtime.functions_of_64_bits()):
        result = ti.sin(x)
    else:
        result = _wave(x, 0)
    return result


@ti.func
def cos(x):
    result = x
    if ti.static(runtime.functions_of_64_bits()):
        result = ti.cos(x)
    else:
        result = _wave(x, 1)
    return result


@ti.func
def less(x, k, parts: ti.template()):
    """x - k c, c in parts."""
    for m in ti.static(range(3)):
        x -= ti.cast(k, ti.f64) * ti.cast(parts[m], ti.f64)
    return x


@ti.func
def _exp(x):
    """2^k exp(r), |r| <= ln 2 / 2, by its series."""
    x = ti.min(ti.max(x, -700.0), 700.0)
    k = ti.cast(ti.floor(x / LN2[0] + 0.5), ti.i32)
    r = less(x, k, LN2)
    result = x * 0.0 + 1.0
    for m in ti.static(range(14, 0, -1)):
        result = 1.0 + result * r / float(m)
    step = ti.cast(2.0, ti.f64)
    if k < 0:
        step = ti.cast(0.5, ti.f64)
    for _ in range(ti.abs(k)):
        result *= step
    return result


@ti.func
def _log(x):
    """Two steps of Halley's method from the one of 32 bits, each of which triples the digits."""
    y = ti.cast(ti.log(ti.cast(x, ti.f32)), ti.f64)
    for _ in ti.static(range(2)):
        e = _exp(y)
        y += 2.0 * (x - e) / (x + e)
    return y


@ti.func
def _wave(x, turned: ti.template()):
    """sin(x + turned pi/2): x less k quarter turns, by the series of sine or cosine."""
    k = ti.cast(ti.floor(x / QUARTER[0] + 0.5), ti.i32)
    r = less(x, k, QUARTER)
    k += turned
    square = r * r
    s, c = x * 0.0 + 1.0, x * 0.0 + 1.0
    for m in ti.static(range(9, 0, -1)):
        s = 1.0 - s * square / float((2 * m) * (2 * m + 1))
        c = 1.0 - c * square / float((2 * m - 1) * (2 * m))
    result = r * s
    if k % 2 != 0:
        result = c
    if (k % 4 + 4) % 4 >= 2:
        result = -result
    return result
