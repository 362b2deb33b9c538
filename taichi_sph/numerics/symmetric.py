"""Symmetric 3 x 3 matrices as six numbers, 11, 22, 33, 12, 23, 13 (VTK's order)."""

from ..runtime import ti


@ti.func
def eigenvalues(a: ti.template()):
    """The three, largest first, by Cardano's formula. Their sum is the trace to rounding; two that nearly coincide are apart by the root
    of rounding at most, one up and one down, so that symmetric functions of them stay exact."""
    mean = (a[0] + a[1] + a[2]) / 3.0
    x, y, z = a[0] - mean, a[1] - mean, a[2] - mean
    shear = a[3] * a[3] + a[4] * a[4] + a[5] * a[5]
    p = ti.sqrt((x * x + y * y + z * z + 2.0 * shear) / 6.0)
    det = x * (y * z - a[4] * a[4]) - a[3] * (a[3] * z - a[4] * a[5]) + a[5] * (a[3] * a[4] - y * a[5])
    cosine = 0.5 * (det / ti.max(p, 1e-30)) / ti.max(p * p, 1e-30)
    angle = ti.acos(ti.max(-1.0, ti.min(1.0, cosine))) / 3.0
    first = mean + 2.0 * p * ti.cos(angle)
    last = mean + 2.0 * p * ti.cos(angle + 2.0943951023931953)
    return ti.Vector([first, 3.0 * mean - first - last, last])


@ti.func
def inverse_root(c: ti.template()):
    """(c^-1/2, det c^1/2, least eigenvalue) of a positive c; bounded where c is not positive.

    With the invariants I, II, III of U = c^1/2: U = (I III + (I^2 - II) c - c^2) / (I II - III), U^-1 = (II - I U + c) / III
    (Hoger and Carlson 1984).
    """
    w = eigenvalues(c)
    least = w[2]
    u = ti.sqrt(ti.max(w, 1e-6))
    i1, i2, i3 = u[0] + u[1] + u[2], u[0] * u[1] + u[1] * u[2] + u[2] * u[0], u[0] * u[1] * u[2]
    c2 = square(c)
    below = 1.0 / (i1 * i2 - i3)
    stretch = below * ((i1 * i1 - i2) * c - c2)
    result = c - i1 * stretch
    for k in ti.static(range(3)):
        result[k] += i2 - i1 * below * i1 * i3
    return result / i3, i3, least


@ti.func
def square(a: ti.template()):
    """a a."""
    return ti.Vector(
        [
            a[0] * a[0] + a[3] * a[3] + a[5] * a[5],
            a[3] * a[3] + a[1] * a[1] + a[4] * a[4],
            a[5] * a[5] + a[4] * a[4] + a[2] * a[2],
            a[0] * a[3] + a[3] * a[1] + a[5] * a[4],
            a[3] * a[5] + a[1] * a[4] + a[4] * a[2],
            a[0] * a[5] + a[3] * a[4] + a[5] * a[2],
        ]
    )


@ti.func
def matrix(a: ti.template()):
    return ti.Matrix([[a[0], a[3], a[5]], [a[3], a[1], a[4]], [a[5], a[4], a[2]]])


@ti.func
def congruent(u: ti.template(), s: ti.template()):
    """u s u."""
    U, S = matrix(u), matrix(s)
    A = S @ U
    result = s
    for k in ti.static(range(6)):
        i, j = ti.static((0, 1, 2, 0, 1, 0)[k]), ti.static((0, 1, 2, 1, 2, 2)[k])
        result[k] = U[i, 0] * A[0, j] + U[i, 1] * A[1, j] + U[i, 2] * A[2, j]
    return result


@ti.func
def product(a: ti.template(), b: ti.template()):
    """a : b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + 2.0 * (a[3] * b[3] + a[4] * b[4] + a[5] * b[5])


@ti.func
def deviator(a: ti.template()):
    """(a - tr a / 3, tr a)."""
    trace = a[0] + a[1] + a[2]
    result = a
    for k in ti.static(range(3)):
        result[k] -= trace / 3.0
    return result, trace
