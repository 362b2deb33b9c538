"""H = C M^-1 C^T, factorised once: it is constant, the same for all components, and for directors, whose inertia is proportional to mass.

Rows are scaled to H_ii = 1 and numbered so that H has a narrow band (reverse Cuthill-McKee: along each ring of an overlap). Rows that
others imply are left out. NumPy, SciPy.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.linalg import cholesky_banded
from scipy.linalg.lapack import dpstrf
from scipy.sparse.csgraph import connected_components, reverse_cuthill_mckee

from .constraints import Constraints

LEAST = 1e-10  # of a pivot of the scaled H: below, a constraint is said by others


@dataclass
class Factor:
    """rows: C, scaled and renumbered; lower (R, band + 1): L of H = L L^T, row by row, its diagonal last; first (R,): where a row of L
    begins; smallest: pivot of H; implied: number of constraints that were left out, for the others imply them."""

    rows: Constraints
    lower: np.ndarray
    first: np.ndarray
    implied: int = 0

    @property
    def band(self) -> int:
        return self.lower.shape[1] - 1

    @property
    def blocks(self) -> np.ndarray:
        """First rows of the blocks of L that do not see each other, and R: one block for each overlap, if not more."""
        reaches = np.minimum.accumulate(self.first[::-1])[::-1]  # the first row that any row from here on sees
        return np.r_[np.flatnonzero(reaches == np.arange(self.first.size)), self.first.size]

    @property
    def dense(self) -> np.ndarray:
        """(R, R) L."""
        n, band = self.first.size, self.band
        found = np.zeros((n, n))
        for k in range(band + 1):
            i = np.arange(k, n)
            found[i, i - k] = self.lower[i, band - k]
        return found

    @property
    def smallest(self) -> float:
        return float(self.lower[:, -1].min() ** 2)


def factorised(found: Constraints, mass_of_elements: np.ndarray, mass_of_particles: np.ndarray) -> Factor:
    """Of constraints on nodes of these masses [kg]."""
    H = _gram(found.elements, mass_of_elements) + _gram(found.particles, mass_of_particles)
    scale = 1.0 / np.sqrt(H.diagonal())
    H = sp.csr_array(sp.diags_array(scale) @ H @ sp.diags_array(scale))
    try:
        factor = _banded(found, H, scale)
    except np.linalg.LinAlgError:
        factor = None
    if factor is None or factor.smallest < LEAST:
        rows = _independent(H)
        implied = H.shape[0] - len(rows)
        found = Constraints(found.elements[rows], found.particles[rows], found.length)
        factor = replace(_banded(found, sp.csr_array(H[rows][:, rows]), scale[rows]), implied=implied)
    return factor


def _banded(found: Constraints, H: sp.csr_array, scale: np.ndarray) -> Factor:
    """scale: of the rows, by which H is of ones along its diagonal."""
    pattern = sp.csr_array((np.ones(len(H.indices)), H.indices, H.indptr), shape=H.shape)
    order = reverse_cuthill_mckee(sp.csr_matrix(pattern), symmetric_mode=True)
    elements, particles = (sp.csr_array(sp.diags_array(scale) @ C)[order] for C in (found.elements, found.particles))
    rows = Constraints(elements, particles, found.length)
    H = sp.coo_array(H[order][:, order])
    n = H.shape[0]
    i, j = H.coords
    band = int(np.abs(i - j).max(initial=0))
    banded = np.zeros((band + 1, n))
    low = i >= j
    banded[(i - j)[low], j[low]] = H.data[low]
    L = cholesky_banded(banded, lower=True)
    lower = np.zeros((n, band + 1))
    for k in range(band + 1):
        lower[k:, band - k] = L[k, : n - k]
    first = np.full(n, n)
    np.minimum.at(first, i, j)
    return Factor(rows, lower, np.minimum(first, np.arange(n)))


def _independent(H: sp.csr_array) -> np.ndarray:
    """Numbers of rows of which none is implied by the others, as many as there are: by pivots, the largest first."""
    count, part = connected_components(sp.csr_matrix(H), directed=False)
    kept = []
    for k in range(count):
        rows = np.flatnonzero(part == k)
        _, order, rank, _ = dpstrf(H[rows][:, rows].toarray(), tol=LEAST, lower=1)
        kept.append(rows[order[:rank] - 1])
    return np.sort(np.concatenate(kept))


def _gram(C: sp.csr_array, mass: np.ndarray) -> sp.csr_array:
    return sp.csr_array(C @ sp.diags_array(1.0 / mass) @ C.T)
