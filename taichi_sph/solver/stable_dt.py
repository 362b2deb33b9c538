"""The stable step from the operator itself: dt = 2 / omega_max of M^-1 K, by Lanczos.

K u is read off the force kernels with a displacement so small that they are linear, damage left out (it only
softens). Lanczos approaches the largest eigenvalue from below; the margin that closes the gap is its own error
bound (the residual of the Ritz pair), so the step is not overestimated.
"""

from __future__ import annotations

import numpy as np

from .. import runtime

STRAIN = {"f64": 1e-7, "f32": 1e-4}  # of the probing displacement


def largest_frequency(sim, iterations: int = 40, start: np.ndarray | None = None) -> tuple[float, np.ndarray]:
    """(omega_max [rad/s] with its error bound added, Ritz vector in mass-weighted displacements)."""
    nodes = sim.nodes
    n = nodes.n
    u0 = runtime.get(nodes.u, n)
    root = np.sqrt(runtime.get(nodes.mass, n).astype(np.float64))[:, None]
    scale = STRAIN[sim.scene.numerics.precision] * sim.spacing
    real = u0.dtype

    def apply(y: np.ndarray) -> np.ndarray:
        """M^-1/2 K M^-1/2 y about the reference state."""
        w = y / root
        size = scale / max(np.abs(w).max(), 1e-300)
        runtime.put(nodes.u, (size * w).astype(real))
        sim.internal.strain(0.0, intact=1)
        sim.internal.force()
        return -runtime.get(nodes.force, n).astype(np.float64) / size / root

    q = np.random.default_rng(0).standard_normal(u0.shape) if start is None else start
    q = q / np.linalg.norm(q)
    basis, alpha, beta = [q], [], []
    for k in range(iterations):
        w = apply(basis[k])
        alpha.append(float(np.vdot(basis[k], w)))
        for b in basis:  # full reorthogonalisation: the basis is short
            w -= np.vdot(b, w) * b
        beta.append(float(np.linalg.norm(w)))
        if beta[-1] < 1e-12 * abs(alpha[0]):
            break
        basis.append(w / beta[-1])
    m = len(alpha)
    values, vectors = np.linalg.eigh(np.diag(alpha) + np.diag(beta[: m - 1], 1) + np.diag(beta[: m - 1], -1))
    bound = abs(beta[-1] * vectors[-1, -1])
    ritz = sum(c * b for c, b in zip(vectors[:, -1], basis))
    runtime.put(nodes.u, u0)
    return float(np.sqrt(values[-1] + bound)), ritz
