"""The cubic spline B3 (T 1.7) in one, two and three dimensions; support radius 2h."""

import math

from ..runtime import ti

# T 1.7 prints the constant of two dimensions; the other two follow from the partition of unity (T 1.3)
CONSTANT = {1: 2.0 / 3.0, 2: 10.0 / (7.0 * math.pi), 3: 1.0 / math.pi}


@ti.func
def b3(q):
    """Shape of T 1.7 at q = r / h, without the constant C / h^dim: 1 at the centre, 0 from q = 2 on."""
    value = q * 0.0
    if q <= 1.0:
        value = 1.0 - 1.5 * q * q + 0.75 * q * q * q
    elif q < 2.0:
        value = 0.25 * (2.0 - q) ** 3
    return value


@ti.func
def b3_slope(q):
    """Derivative of `b3` with respect to q."""
    value = q * 0.0
    if q <= 1.0:
        value = -3.0 * q + 2.25 * q * q
    elif q < 2.0:
        value = -0.75 * (2.0 - q) ** 2
    return value


# --- Wendland's C2 kernel, for fluids: no pairing of neighbours, and no division in its slope over r ------------

W2 = 210.0 / math.pi  # of w2_slope, in three dimensions
W2_VALUE = 21.0 / (2.0 * math.pi)  # of w2


@ti.func
def w2_slope(r, inverse):
    """W'(r) / r [1/m^5] in three dimensions; inverse = 1 / (2h), the support. Negative, 0 from r = 2h on; no branch.

    W = 21 / (16 pi h^3) (1 - q/2)^4 (1 + 2q), q = r / h (Wendland 1995).
    """
    u = ti.max(1.0 - r * inverse, 0.0)
    square = inverse * inverse
    return -W2 * (u * square) * (u * square) * (u * inverse)


@ti.func
def w2(r, inverse):
    """W(r) [1/m^3] of that kernel."""
    u = ti.max(1.0 - r * inverse, 0.0)
    square = u * u
    return W2_VALUE * (inverse * inverse * inverse) * (square * square) * (1.0 + 4.0 * r * inverse)
