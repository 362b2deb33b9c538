"""The static answer of a patched shell to what its rim is held at, from the matrices of the running kernels and the running constraints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from taichi_sph import runtime
from taichi_sph.bodies.shell.instead.modes import stiffness

SMALL = 1e-6


@dataclass
class Half:
    """A part: its group, K of its mass-weighted unknowns y, P with (u, d) = P y, and C P."""

    group: object
    K: sp.csc_array
    P: sp.csr_array
    C: sp.csr_array

    @staticmethod
    def of(group, C: sp.csr_array, lengths: np.ndarray, directors: bool) -> Half:
        A, free, number, root = stiffness(group)
        n, c, f = free.shape
        i, k, g = np.nonzero((np.abs(free) > 1e-14) & (number >= 0)[:, None, :])
        values = free[i, k, g] / root[i, k]
        P = sp.csr_array(sp.coo_array((values, (c * i + k, number[i, g])), shape=(n * c, A.shape[0])))
        dim = group.nodes.dim
        tied = [C] * dim
        if group.nodes.bends:
            tied += [C @ sp.diags_array(lengths)] * 3 if directors else [0.0 * C] * 3
        blocks = [sp.kron(sp.csr_array(part), sp.csr_array(np.eye(c)[[k]])) for k, part in enumerate(tied)]
        return Half(group, sp.csc_array(0.5 * (A + A.T)), P, sp.csr_array(sp.vstack(blocks, format="csr") @ P))

    def unknowns(self, u: np.ndarray) -> np.ndarray:
        """y of (N, c) displacements and director changes, which are across the directors."""
        gram = (self.P.T @ self.P).tocsc()
        return splu(gram).solve(self.P.T @ u.ravel())

    def rows_of(self, nodes: np.ndarray) -> np.ndarray:
        """Unknowns of some nodes."""
        c = self.P.shape[0] // self.group.nodes.n
        rows = (c * nodes[:, None] + np.arange(c)).ravel()
        return np.unique(self.P[rows].indices)

    def strains(self, u: np.ndarray) -> np.ndarray:
        """(points, 3 or 8) of the linear answer at (N, c)."""
        ends = []
        for sign in (1, -1):
            nodes = self.group.nodes
            runtime.put(nodes.u, np.ascontiguousarray(sign * SMALL * u[:, : nodes.dim]))
            if nodes.bends:
                runtime.put(nodes.d, np.ascontiguousarray(sign * SMALL * u[:, nodes.dim :]))
            self.group.internal.strain(0.0)
            points = self.group.points
            used = runtime.get(points.area, points.n) > 0
            ends.append(runtime.get(points.strain, points.n)[used])
        return (ends[0] - ends[1]) / (2 * SMALL)


def halves(sim) -> tuple[Half, Half]:
    coupling = sim.couplings[-1]
    rows = coupling.factor.rows
    lengths = np.ones(coupling.elements.nodes.n), rows.length
    return tuple(
        Half.of(group, C, length, sim.couplings[-1].tie.turns)
        for group, C, length in zip(coupling.groups, (rows.elements, -1.0 * rows.particles), lengths)
    )


def answer(parts: tuple[Half, Half], held: tuple[np.ndarray, np.ndarray], wanted: tuple[np.ndarray, np.ndarray]) -> list[np.ndarray]:
    """[(N, c) of the elements, of the particles] in equilibrium, with the nodes `held` of each part at what is wanted of it."""
    y = np.concatenate([part.unknowns(u) for part, u in zip(parts, wanted)])
    first = parts[0].K.shape[0]
    fixed = np.concatenate([parts[0].rows_of(held[0]), first + parts[1].rows_of(held[1])])
    free = np.setdiff1d(np.arange(len(y)), fixed)
    K = sp.csr_array(sp.block_diag([part.K for part in parts], format="csr"))
    C = sp.csr_array(sp.hstack([part.C for part in parts], format="csr"))
    kept = np.asarray(abs(C[:, free]).sum(axis=1)).ravel() > 0
    C = C[kept]
    K, C, right = K / abs(K.diagonal()).max(), C / abs(C.data).max(), y
    known = np.where(np.isin(np.arange(len(y)), fixed), right, 0.0)
    system = sp.block_array([[K[free][:, free], C[:, free].T], [C[:, free], None]], format="csc")
    found = splu(system).solve(np.concatenate([-(K @ known)[free], -(C @ known)]))
    y = known.copy()
    y[free] = found[: len(free)]
    ends = []
    for part, own in zip(parts, (y[:first], y[first:])):
        ends.append((part.P @ own).reshape(part.group.nodes.n, -1))
    return ends
