"""Moving least squares as T annex A defines it, in NumPy, one point at a time: the oracle of the link tests."""

from __future__ import annotations

import numpy as np


def b3(q: np.ndarray) -> np.ndarray:
    """Shape of T 1.7."""
    return np.where(q < 1, 1 - 1.5 * q**2 + 0.75 * q**3, np.where(q < 2, 0.25 * (2 - q) ** 3, 0.0))


def basis(d: np.ndarray, order: int) -> np.ndarray:
    """(K, terms) monomials up to `order` of plane vectors (K, 2)."""
    return np.stack([d[:, 0] ** (k - j) * d[:, 1] ** j for k in range(order + 1) for j in range(k + 1)], axis=1)


def value(x: np.ndarray, near: np.ndarray, h: float, order: int, own: np.ndarray | None = None) -> np.ndarray:
    """(K,) Phi_j(x) of the points near (K, 2); `own`: a fixed place that joins the fit with the value 0 (T 2.2.3.2).

    Weighted least squares by QR, not by the moment matrix: an independent road to the same numbers.
    """
    places = near if own is None else np.vstack([near, own])
    d = (places - x) / h
    w = np.sqrt(b3(np.linalg.norm(d, axis=1)))
    rows = w[:, None] * basis(d, order)
    fit = np.linalg.lstsq(rows, np.diag(w), rcond=None)[0][0]
    return fit[: len(near)]


def gradient(x: np.ndarray, near: np.ndarray, h: float, order: int, own: np.ndarray | None = None, step: float = 1e-4) -> np.ndarray:
    """(K, 2) dPhi_j/dx by central differences of fourth order."""
    result = np.empty((len(near), 2))
    for axis in range(2):
        e = np.zeros(2)
        e[axis] = step * h
        f = [value(x + k * e, near, h, order, own) for k in (-2, -1, 1, 2)]
        result[:, axis] = (f[0] - 8 * f[1] + 8 * f[2] - f[3]) / (12 * step * h)
    return result
