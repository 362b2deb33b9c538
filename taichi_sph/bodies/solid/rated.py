"""What laws in rate form share: strain increments in the frame that the polar rotation carries along, and stresses on the reference.

E is Green-Lagrange's strain, U the stretch, U^2 = 1 + 2 E. The rate of deformation of a step, turned back by the rotation, is

    d = W dE W,    W = 1/2 (U_n^-1 + U_n+1^-1)

(second order in the step), so that stretching adds up to the logarithmic strain and turning does not count. Stresses t are Kirchhoff's,
turned back: S = U^-1 t U^-1 on the reference, whose power S : dE is t : d.
"""

from ...numerics import symmetric
from ...runtime import ti


@ti.func
def increment(cells: ti.template(), s, E: ti.template()):
    """(d, U^-1 now, det U now, least eigenvalue of U^2 now) of the step to the strain E."""
    C = 2.0 * E
    for k in ti.static(range(3)):
        C[k] += 1.0
    back, volume, least = symmetric.inverse_root(C)
    d = symmetric.congruent(0.5 * (cells.back[s] + back), E - cells.strain[s])
    return d, back, volume, least


@ti.func
def keep(cells: ti.template(), s, E: ti.template(), back: ti.template()):
    cells.strain[s], cells.back[s] = E, back
