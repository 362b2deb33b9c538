"""Mindlin's square plate by Ritz' method with Legendre polynomials: the references of the bending tests and scenes.

Side 1, bending stiffness 1, mass per area 1, shear factor 5/6.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre as L

SHEAR_FACTOR = 5 / 6


def _basis(n: int, clamped: bool):
    """Gram matrices on [-1, 1] (values, slopes, slope with value), integrals, values at 0."""
    x, w = L.leggauss(2 * n + 6)
    series = [np.eye(k + 1)[k] * np.sqrt(k + 0.5) for k in range(n)]
    if clamped:
        series = [L.legmul([2 / 3, 0, -2 / 3], c) for c in series]  # times 1 - x^2
    values = np.array([L.legval(x, c) for c in series])
    slopes = np.array([L.legval(x, L.legder(c)) if len(c) > 1 else 0 * x for c in series])
    return (values * w) @ values.T, (slopes * w) @ slopes.T, (slopes * w) @ values.T, values @ w, np.array([L.legval(0, c) for c in series])


def _stiffness(thickness: float, nu: float, n: int, clamped: bool):
    M, K, C, integral, middle = _basis(n, clamped)
    young = 12 * (1 - nu**2) / thickness**3
    shear = SHEAR_FACTOR * young * thickness / (2 * (1 + nu))
    kron = np.kron
    area, slope = 0.25, 2.0  # of [-1, 1]^2 onto the unit square
    xx, yy, one = area * slope**2 * kron(K, M), area * slope**2 * kron(M, K), area * kron(M, M)
    dx, dy = area * slope * kron(C, M), area * slope * kron(M, C)
    cross = area * slope**2 * kron(C, C.T)
    rows = [
        [shear * (xx + yy), shear * dx, shear * dy],
        [shear * dx.T, xx + (1 - nu) / 2 * yy + shear * one, nu * cross + (1 - nu) / 2 * cross.T],
        [shear * dy.T, (nu * cross + (1 - nu) / 2 * cross.T).T, yy + (1 - nu) / 2 * xx + shear * one],
    ]
    return np.block(rows), one, area * kron(integral, integral), kron(middle, middle)


def clamped_deflection(thickness: float, nu: float = 0.3, n: int = 16) -> float:
    """w D / (q L^4) at the middle of a clamped plate under uniform pressure."""
    K, _, integral, middle = _stiffness(thickness, nu, n, True)
    load = np.concatenate([integral, np.zeros(2 * len(integral))])
    return float(np.linalg.solve(K, load)[: len(middle)] @ middle)


def free_frequencies(thickness: float, nu: float = 0.3, n: int = 12, count: int = 6) -> np.ndarray:
    """omega L^2 sqrt(rho e / D) of the first flexible modes of a free plate."""
    import scipy.linalg

    K, one, _, _ = _stiffness(thickness, nu, n, False)
    inertia = thickness**2 / 12
    mass = scipy.linalg.block_diag(one, inertia * one, inertia * one)
    values = scipy.linalg.eigh(K, mass, eigvals_only=True, subset_by_index=[0, count + 2])
    return np.sqrt(values[3:])


def supported_frequencies(thickness: float, nu: float = 0.3, count: int = 6) -> np.ndarray:
    """The same of a plate whose edges neither deflect nor turn along themselves (Navier)."""
    young = 12 * (1 - nu**2) / thickness**3
    shear, inertia = SHEAR_FACTOR * young * thickness / (2 * (1 + nu)), thickness**2 / 12
    found = []
    for m in range(1, 5):
        for n in range(1, 5):
            a, b = m * np.pi, n * np.pi
            K = np.array(
                [
                    [shear * (a * a + b * b), shear * a, shear * b],
                    [shear * a, a * a + (1 - nu) / 2 * b * b + shear, (1 + nu) / 2 * a * b],
                    [shear * b, (1 + nu) / 2 * a * b, b * b + (1 - nu) / 2 * a * a + shear],
                ]
            )
            root = np.array([1.0, inertia**-0.5, inertia**-0.5])
            found.append(np.sqrt(np.linalg.eigvalsh(root[:, None] * K * root)[0]))
    return np.sort(found)[:count]


def pinched_cylinder(spread: float, shear: float = 1.0) -> float:
    """Deflection under each of two opposite forces of 1 on a cylinder on rigid diaphragms (R 300, L 600, e 3, E 3e6,
    nu 0.3), spread evenly over discs of radius `spread`: Navier's double series of the shell of docs/method.md,
    linear. `shear` multiplies the true shear stiffness; huge is a thin shell.
    """
    from scipy.special import j1

    R, length, e, young, nu = 300.0, 600.0, 3.0, 3e6, 0.3
    K = young * e / (1 - nu**2)
    kGe = shear * SHEAR_FACTOR * young * e / (2 * (1 + nu))
    n, m = np.meshgrid(np.arange(0, 1001, 2.0), np.arange(1, 801, 2.0), indexing="ij")
    a, b, o = m * np.pi / length, n / R, np.ones_like(n)
    z = 0 * o
    # amplitudes of the strains in those of u (cos cos), v (sin sin), w (cos sin) and the turns along and around
    rows = (
        ((-a, z, z, z, z), (z, b, o / R, z, z), (-b, a, z, z, z), K),  # membrane: axial, around, sheared
        ((z, z, z, -a, z), (z, b / R, o / R**2, z, b), (z, a / R, z, -b, a), K * e**2 / 12),  # bending
    )
    M = np.zeros((*n.shape, 5, 5))
    for x, y, xy, stiffness in rows:
        x, y, xy = (np.stack(p, -1) for p in (x, y, xy))
        for p, q, c in ((x, x, 1.0), (y, y, 1.0), (x, y, nu), (y, x, nu), (xy, xy, (1 - nu) / 2)):
            M += stiffness * c * p[..., :, None] * q[..., None, :]
    for p in (np.stack((z, z, a, o, z), -1), np.stack((z, -o / R, -b, z, o), -1)):
        M += kGe * p[..., :, None] * p[..., None, :]
    M[0, :, 1, 1] += K / R**2  # n = 0: nothing goes round
    M[0, :, 4, 4] += kGe
    k = np.hypot(a, b) * max(spread, 1e-9)
    centre = np.sin(m * np.pi / 2)
    load = np.zeros((*n.shape, 5))
    load[..., 2] = 2 * centre * (2 * j1(k) / k) / (np.pi * R * length / 2 * np.where(n == 0, 2, 1))
    return float((np.linalg.solve(M, load[..., None])[..., 2, 0] * centre).sum())
