"""The largest eigenvalue of a symmetric operator by Lanczos' iteration, with a bound of its error. NumPy only."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


def largest(operator: Callable[[np.ndarray], np.ndarray], shape: tuple[int, ...], rounds: int = 40) -> float:
    """An upper bound that is near: the largest Ritz value, which lies below, and its residual.

    Three vectors are kept. Without reorthogonalisation eigenvalues that have converged come again, which does no harm to the largest.
    """
    q = np.random.default_rng(0).standard_normal(shape)
    q /= np.linalg.norm(q)
    before = np.zeros_like(q)
    alpha: list[float] = []
    beta: list[float] = []
    for _ in range(rounds):
        w = operator(q)
        alpha.append(float(np.vdot(q, w)))
        w -= alpha[-1] * q + (beta[-1] if beta else 0.0) * before
        beta.append(float(np.linalg.norm(w)))
        if beta[-1] <= 1e-12 * abs(alpha[0]):
            break
        before, q = q, w / beta[-1]
    values, vectors = np.linalg.eigh(np.diag(alpha) + np.diag(beta[:-1], 1) + np.diag(beta[:-1], -1))
    return float(values[-1] + beta[-1] * abs(vectors[-1, -1]))
