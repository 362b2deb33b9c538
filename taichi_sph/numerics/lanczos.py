"""The largest eigenvalue of a symmetric operator by Lanczos' iteration, with a bound of its error. NumPy only.

Krylov iterations amplify the last digit of their products: a step that follows from them moves by 1e-5. BLAS splits long sums among its
threads, so `inner` and `length` add in one order.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


def inner(a: np.ndarray, b: np.ndarray) -> float:
    """Sum of a b over all entries, in the same order whatever the number of threads."""
    return float(np.einsum("i,i->", a.ravel(), b.ravel()))  # never BLAS, and no array between


def length(a: np.ndarray) -> float:
    """Root of the sum of the squares of all entries."""
    return float(np.sqrt(inner(a, a)))


def largest(operator: Callable[[np.ndarray], np.ndarray], shape: tuple[int, ...], rounds: int = 40) -> float:
    """An upper bound that is near: the largest Ritz value, which lies below, and its residual.

    Three vectors are kept. Without reorthogonalisation eigenvalues that have converged come again, which does no harm to the largest.
    """
    q = np.random.default_rng(0).standard_normal(shape)
    q /= length(q)
    before = np.zeros_like(q)
    alpha: list[float] = []
    beta: list[float] = []
    for _ in range(rounds):
        w = operator(q)
        alpha.append(inner(q, w))
        w -= alpha[-1] * q + (beta[-1] if beta else 0.0) * before
        beta.append(length(w))
        if beta[-1] <= 1e-12 * abs(alpha[0]):
            break
        before, q = q, w / beta[-1]
    values, vectors = np.linalg.eigh(np.diag(alpha) + np.diag(beta[:-1], 1) + np.diag(beta[:-1], -1))
    return float(values[-1] + beta[-1] * abs(vectors[-1, -1]))
