"""The stable step from the operator itself: dt = 2 / omega_max of M^-1 K, by Arnoldi's iteration.

K u is read off the force kernels with a displacement so small that they are linear, damage left out (it only
softens). For the galerkin form K is symmetric and this is Lanczos, which approaches the largest eigenvalue from
below; its own error bound (the residual of the Ritz pair) is added, so the step is not overestimated. The
collocation form is not symmetric: the largest |lambda| counts.
"""

from __future__ import annotations

import numpy as np

from .. import runtime

EVERY = 100  # steps between two looks while things break
AGAIN = 6  # iterations of such a look, from the mode found before

STRAIN = {"f64": 1e-7, "f32": 1e-4}  # of the probing displacement


class StableStep:
    """Keeps dt below the limit: measured at the start, and again (every `EVERY` steps) after ruptures, which
    renew the operator near the crack. dt never grows again."""

    def __init__(self, sim):
        self.sim = sim
        self.safety = sim.scene.numerics.time_step_safety
        self.frequency, self.mode = largest_frequency(sim)
        self.events, self.looked = sim.rupture.events, 0

    @property
    def dt(self) -> float:
        """safety * 2 / omega_max [s]."""
        return self.safety * 2.0 / self.frequency

    def watch(self) -> bool:
        """Look again when something broke; True when the step has to be shortened."""
        sim = self.sim
        if sim.rupture.events == self.events or sim.step - self.looked < EVERY:
            return False
        self.events, self.looked = sim.rupture.events, sim.step
        frequency, self.mode = largest_frequency(sim, AGAIN, self.mode)
        if frequency <= 1.001 * self.frequency:
            return False
        self.frequency = frequency
        return True

    def state(self) -> dict[str, np.ndarray]:
        return {
            "stable.mode": self.mode,
            "stable.frequency": np.array(self.frequency),
            "stable.seen": np.array([self.events, self.looked]),
        }

    def restore(self, state: dict[str, np.ndarray]) -> None:
        self.mode, self.frequency = np.asarray(state["stable.mode"]), float(state["stable.frequency"])
        self.events, self.looked = (int(k) for k in state["stable.seen"])


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
    basis = [q / np.linalg.norm(q)]
    H = np.zeros((iterations + 1, iterations))
    for k in range(iterations):
        w = apply(basis[k])
        for i, b in enumerate(basis):
            H[i, k] = np.vdot(b, w)
            w -= H[i, k] * b
        H[k + 1, k] = np.linalg.norm(w)
        if H[k + 1, k] < 1e-12 * abs(H[0, 0]):
            break
        basis.append(w / H[k + 1, k])
    values, vectors = np.linalg.eig(H[: k + 1, : k + 1])
    top = int(np.argmax(np.abs(values)))
    bound = abs(H[k + 1, k] * vectors[-1, top])
    ritz = sum(c * b for c, b in zip(vectors[:, top].real, basis))
    runtime.put(nodes.u, u0)
    return float(np.sqrt(abs(values[top]) + bound)), ritz
