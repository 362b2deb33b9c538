"""3 x 3 matrices: how areas change under a deformation gradient, and matrices as nine numbers, row by row, as pools hold them."""

from ..runtime import ti


@ti.func
def cofactor(F: ti.template()):
    """det F F^-T of a 3 x 3 matrix, which is also the derivative of det F."""
    rows = ti.Matrix.zero(float, 3, 3)
    for i in ti.static(range(3)):
        for j in ti.static(range(3)):
            a, b, c, d = ti.static((i + 1) % 3), ti.static((i + 2) % 3), ti.static((j + 1) % 3), ti.static((j + 2) % 3)
            rows[i, j] = F[a, c] * F[b, d] - F[a, d] * F[b, c]
    return rows


@ti.func
def nine(F: ti.template()):
    return ti.Vector([F[0, 0], F[0, 1], F[0, 2], F[1, 0], F[1, 1], F[1, 2], F[2, 0], F[2, 1], F[2, 2]])


@ti.func
def square(a: ti.template()):
    return ti.Matrix([[a[0], a[1], a[2]], [a[3], a[4], a[5]], [a[6], a[7], a[8]]])
