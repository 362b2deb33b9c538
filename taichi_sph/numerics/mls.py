"""Moving least squares at one point (T annex A), orders 0, 1, 2, shifted to the point and scaled by h.

With p(d) the monomials of d = (X_j - x) / h and w_j = B3(|X_j - x| / h):

    A = sum_j w_j p_j p_j^T,    c = A^-1 e1,    Phi_j = w_j c . p_j                          (T A.6 to A.10)
    Phi_j,a = -w_j g_a . p_j + c . (w_j p_j,a + w_j,a p_j),   g_a = A^-1 A,a c               (T A.12, in full)

Everything here is f64 whatever the precision of the state: a moment matrix in f32 would cost the patch
test four digits, and it is made once.
"""

from ..runtime import ti

mat6 = ti.types.matrix(6, 6, ti.f64)
vec6 = ti.types.vector(6, ti.f64)

PIVOT = 1e-8  # smallest pivot of A, relative to its diagonal, that still counts as invertible
# largest sum of |Phi_j|: beyond it the fit extrapolates. Sound plates stay below 1.5 (2 at irregularity 0.4); at 6, what
# is left around a fragment may be 2.5 times stiffer than the step allows
LEBESGUE = 2.5


@ti.func
def terms(order):
    """Number of monomials up to `order` in two variables."""
    return (order + 1) * (order + 2) // 2


@ti.func
def monomials(d):
    """p(d), as if of order 2; lower orders use its first `terms(order)` entries."""
    one = d[0] * 0.0 + 1.0
    return vec6(one, d[0], d[1], d[0] * d[0], d[0] * d[1], d[1] * d[1])


@ti.func
def monomial_slopes(d, axis):
    """dp/dd_axis."""
    zero = d[0] * 0.0
    result = vec6(zero, zero + 1.0, zero, 2.0 * d[0], d[1], zero)
    if axis == 1:
        result = vec6(zero, zero, zero + 1.0, zero, d[0], 2.0 * d[1])
    return result


@ti.func
def cholesky(A: ti.template(), n):
    """Factorise A = L L^T in its lower triangle; returns 1, or 0 where a pivot is too small (T 2.3.6.4)."""
    good = 1
    for i in range(n):
        diagonal = A[i, i]
        for j in range(i + 1):
            s = A[i, j]
            for k in range(j):
                s -= A[i, k] * A[j, k]
            if i == j:
                if s <= PIVOT * diagonal or s <= 0.0:
                    good = 0
                    s = diagonal + 1e-300
                A[i, i] = ti.sqrt(s)
            else:
                A[i, j] = s / A[j, j]
    return good


@ti.func
def solve(L: ti.template(), b: ti.template(), n):
    """b <- (L L^T)^-1 b."""
    for i in range(n):
        s = b[i]
        for k in range(i):
            s -= L[i, k] * b[k]
        b[i] = s / L[i, i]
    for m in range(n):
        i = n - 1 - m
        s = b[i]
        for k in range(i + 1, n):
            s -= L[k, i] * b[k]
        b[i] = s / L[i, i]


@ti.func
def dot(a, b, n):
    """Scalar product of the first n entries."""
    s = ti.cast(0.0, ti.f64)
    for i in range(n):
        s += a[i] * b[i]
    return s
