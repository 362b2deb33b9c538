"""The constraints of a solid in parts, with faces for sides (P, docs/method.md 15).

Its weight jumps at faces of cells of particles: on the border of the particles, and on that of the elements. At the four points g of such a
face, of area vector a from left to right,

    b_g        = (alpha_right - alpha_left) a_g           faces on the surface of the body left out; outside of the particles alpha is 0
    C_E[la, k] = sum_g N_l(x_g) (b_g . t_la) N_k(x_g)
    C_P[la, j] = sum_g N_l(x_g) (b_g . t_la) Phi_j(x_g)   Phi: what the mean gradients of the cells are made of

Sums over these points are exact for the elements, whose faces those of the particles divide, and they are the ones of the particles
themselves. So an even stress passes to rounding, also where cells are skew. The points have the same place in both parts: C X = 0, and no
rigid motion is held back.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from ...errors import SceneError
from ...geometry.solids import Split
from ...geometry.solids.mesh import shapes
from .constraints import Constraints, rows_along
from .factor import Factor
from .tied import Tied


class TiedSolid(Tied):
    """The parts of a solid."""

    @property
    def split(self) -> Split:
        """The parts."""
        return self.particles.solids[0].split

    def rows(self) -> Constraints:
        split, mesh = self.split, self.split.fine.mesh
        faces = np.flatnonzero(split.jumps)
        on = self.particles.functions_on(faces)
        cell = mesh.faces.cells[faces]
        within = np.where(split.of_particles[cell[:, 0]] < 1.0, cell[:, 0], cell[:, 1])  # its cell of the overlap
        place = np.einsum("gk,gki->gi", on.shares, split.coordinates(faces, within)[on.face])
        node = split.number[split.whole.cells[split.fine.parent[within]]][on.face]
        row = np.repeat(np.arange(len(node)), 8)
        N = sp.csr_array(sp.coo_array((shapes(place).ravel(), (row, node.ravel())), shape=(len(node), len(split.nodes))))
        weight = rows_along(N, split.jumps[faces][on.face][:, None] * on.area)
        elements, particles = (sp.csr_array(weight @ part) for part in (N, sp.csr_array(on.functions)))
        return Constraints(elements, particles, np.ones(len(mesh.points)))

    def factorised(self) -> Factor:
        """SceneError where one particle an element would be held by more constraints than it has motions: the overlap would lock."""
        found = super().factorised()
        if self.split.n == 1 and found.implied:
            raise SceneError(
                f"the patch of solid '{self.name}' has one particle along the edge of an element, which is possible where both borders of "
                "the overlap are planes; give the patch half the spacing"
            )
        return found

    def report(self) -> dict[str, float]:
        """As of shells (coupling.py). Nothing of a solid in parts ruptures, and it has no directors."""
        return {"damage": 0.0, "velocities": self.left()[0], "directors": 0.0, "constraints": self.tie.n_rows}
