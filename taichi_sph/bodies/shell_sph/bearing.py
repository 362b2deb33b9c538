"""How a cell shares its pressure and its mass among its sides. NumPy only.

Pressure and mass go to the nodes as forces do, by the edge means: a node gets sum_e Phi_ei sum_s b_se A_s, where b are the shares of the
sides. Masses and pressures have the same shares. So an even pressure accelerates a free plate evenly, whatever the shares are. On a curved
shell the pull of the membrane has to reach the nodes with the same weights as well. An even hoop force of a cylinder acts on the sides that
cross the rim, and on no others, for across a rim no membrane force acts. So near a rim the crossing sides bear all:

    b = w                              far from the rim: area of the triangle of the side with the centroid
    b = w - l (1, -1, 1, -1)           in the two rows of cells along a rim, l such that the sides along it bear nothing together

The middles of the sides of a quadrangle form a parallelogram, so with the second formula too the force acts at the centroid. Farther than
two rows from a rim both formulas give the same nodal weights on a lattice. A triangle has no such freedom, and the cell at a corner is
left alone.

The lips of a cut are rims as well, for what a NodalForce gives the nodes on them. Masses and pressures keep the shares of the whole mesh:
with those of the lips the cut cylinder (`scenes/pressurised_cylinder.py`) moves by 0.15 % of its kinetic energy.
"""

from __future__ import annotations

import numpy as np

from ...geometry.mesh import SurfaceMesh
from .galerkin_reference import shares

ROWS = 2  # of cells that see a rim: as far as the support of their sides
LEAST = 0.2  # of the quarter areas that a node keeps at least
ALONG = np.array([[1.0, -1.0, 1.0, -1.0], [-1.0, 1.0, -1.0, 1.0]])


def bearing(mesh: SurfaceMesh, dead: np.ndarray | None = None) -> np.ndarray:
    """(M, 4) shares b of the sides; dead (M,) bool: cells that are cut, whose sides are rims of the others."""
    found = shares(mesh)
    sides = mesh.edges.sides
    dead = np.zeros(len(mesh.cells), bool) if dead is None else dead
    gone = (sides < 0) | dead[np.maximum(sides, 0) // 4]
    along = np.zeros((len(mesh.cells), 2), bool)  # sides 0 and 2, sides 1 and 3 run along a rim
    rim = gone.sum(axis=1) == 1
    side = np.where(gone[:, 0], sides[:, 1], sides[:, 0])[rim]
    for _ in range(ROWS):
        side = side[mesh.corners[side // 4] == 4]
        cell, k = side // 4, side % 4
        along[cell, k % 2] = True
        pair = sides[mesh.edges.cell_edges[cell, (k + 2) % 4]]
        side = np.where(pair[:, 0] // 4 == cell, pair[:, 1], pair[:, 0])
        side = side[side >= 0]
        side = side[~dead[side // 4]]
    for k in range(2):
        cell = np.flatnonzero(along[:, k] & ~along[:, 1 - k])
        found[cell] -= 0.5 * (found[cell, k] + found[cell, k + 2])[:, None] * ALONG[k]
    return found


def kept_positive(areas: np.ndarray, quarters: np.ndarray) -> np.ndarray:
    """(n,) areas of the nodes of a body, with the total of the quarter areas (n,), nearer to these where a node would keep too little."""
    areas = areas * (quarters.sum() / areas.sum())
    ratio = float((areas / quarters).min())
    return areas if ratio >= LEAST else quarters + (1.0 - LEAST) / (1.0 - ratio) * (areas - quarters)
