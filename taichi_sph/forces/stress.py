"""From the displacement gradient at a stress point to its stress: strain, damage, rupture. Both formulations.

In the plane, with X_,alpha the tangent frame of the cell and u_,alpha the displacement gradient:

    E_ab = 1/2 (x_,a . x_,b - X_,a . X_,b) = 1/2 (X_,a . u_,b + X_,b . u_,a + u_,a . u_,b)
    S = (1 - D_r) H E                                          (T 2.63 in total Lagrangian form)
    n^a = e S^ab x_,b            force per unit reference length, a = 1, 2

written with u, so that nothing cancels in f32. E is kept: the energy ledger is made from it.
"""

from ..laws import delay, elastic, mazars
from ..runtime import ti


@ti.func
def energy_density(cells: ti.template(), material: ti.template(), s):
    """(1 - D_r) 1/2 E : H : E [J/m3]."""
    E = cells.strain[s]
    S = elastic.plane_stress(material.young[0], material.poisson[0], E[0], E[1], E[2])
    return 0.5 * (1.0 - cells.delayed[s]) * (S[0] * E[0] + S[1] * E[1] + 2.0 * S[2] * E[2])


@ti.func
def resultants(cells: ti.template(), material: ti.template(), s, u1, u2, dt, intact, tally):
    """n^1, n^2 [N/m] of cell s from its displacement gradient; advances damage over dt.

    intact = 1 leaves damage out (for the spectrum); a cell that reaches D_c is put on the list `new`.
    tally = 0 renews strain and damage without charging the ledger (after a rupture has changed the links).
    """
    x1 = u1
    x2 = u2
    x1[0] += 1.0
    x2[1] += 1.0
    e11 = u1[0] + 0.5 * u1.dot(u1)
    e22 = u2[1] + 0.5 * u2.dot(u2)
    e12 = 0.5 * (u1[1] + u2[0] + u1.dot(u2))
    nu = material.poisson[0]
    S = elastic.plane_stress(material.young[0], nu, e11, e22, e12)
    kept = 1.0
    if ti.static(material.damages):
        if intact == 0:
            before = cells.delayed[s]
            after = before
            D = ti.max(
                cells.damage[s],
                mazars.damage(
                    mazars.equivalent_strain(nu, e11, e22, e12),
                    material.threshold[0],
                    material.A[0],
                    material.B[0],
                ),
            )
            if ti.static(material.delays):
                if D > before:
                    after = delay.advance(before, D, material.a[0], material.tau_c[0], dt)
            else:
                if dt > 0.0:
                    after = D
            if after > before and tally == 1:
                # 1/2 dD E_n : H : E_n+1 is exactly what the trapezoidal work of the step does not store
                E = cells.strain[s]
                cells.lost[s] += 0.5 * (after - before) * cells.volume[s] * (S[0] * E[0] + S[1] * E[1] + 2.0 * S[2] * E[2])
            cells.damage[s] = D
            cells.delayed[s] = after
            kept = 1.0 - after
            if ti.static(material.breaks):
                if after >= material.critical[0] and cells.broken[s] == 0 and dt > 0.0:
                    cells.new[ti.atomic_add(cells.n_new[0], 1)] = s
    if intact == 0:
        cells.strain[s] = ti.Vector([e11, e22, e12])
    e = material.thickness[0] * kept
    n1 = e * (S[0] * x1 + S[2] * x2)
    n2 = e * (S[2] * x1 + S[1] * x2)
    return n1, n2
