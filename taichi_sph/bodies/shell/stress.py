"""From the gradients at a stress point to its resultants: strain, damage, rupture. All formulations.

Reference tangents a_1, a_2 (orthonormal), director N; now x_,a = a_a + u_,a and n = N + d. With the strains

    E_ab     = 1/2 (x_,a . x_,b - a_a . a_b)                         membrane
    kappa_ab = sym(x_,a . n_,b) - sym(a_a . N_,b)                    bending         (only where the shell bends)
    gamma_a  = x_,a . n - a_a . N                                    transverse shear

and the energy per unit area 1/2 (1 - D_r) (e E:H:E + e^3/12 kappa:H:kappa + G_s gamma.gamma), the resultants
are its derivatives (Simo's shell in vector form; T 2.13 to 2.23 without their slips):

    n^a = dpsi/dx_,a = N^ab x_,b + M^ab n_,b + Q^a n      force per unit reference length
    m^a = dpsi/dn_,a = M^ab x_,b                          force on the director, per unit length
    q   = dpsi/dn    = Q^a x_,a                           force on the director, per unit area

Everything is written with u and d, so that nothing cancels in f32. The strains (E11, E22, 2 E12, kappa11,
kappa22, 2 kappa12, gamma1, gamma2) are kept: the energy ledger is made from them.
"""

from typing import Any

import numpy as np

from ... import runtime
from ...laws import delay, elastic, mazars
from ...numerics.reduce import BLOCK
from ...runtime import ti
from . import metal
from .pool import MaterialPool, StressPoints, sheet_of


@ti.func
def generalised(material: ti.template(), b, shear, g: ti.template()):
    """Undamaged resultants (N11, N22, N12, M11, M22, M12, Q1, Q2) [N/m, N] of the strains g of body b; `shear` = G_s [N/m]."""
    e = material.thickness[b]
    young, nu = material.young[b], material.poisson[b]
    r = g * 0.0
    S = e * elastic.plane_stress(young, nu, g[0], g[1], 0.5 * g[2])
    for k in ti.static(range(3)):
        r[k] = S[k]
    if ti.static(material.bends):
        M = e * e * e / 12.0 * elastic.plane_stress(young, nu, g[3], g[4], 0.5 * g[5])
        for k in ti.static(range(3)):
            r[3 + k] = M[k]
        r[6] = shear * g[6]
        r[7] = shear * g[7]
    return r


@ti.func
def shear_of(cells: ti.template(), material: ti.template(), s):
    """G_s of cell s [N/m]; 0 where the shell stays in its plane."""
    shear = cells.area[s] * 0.0
    if ti.static(material.bends):
        shear = cells.shear[s]
    return shear


@ti.func
def energy_density(cells: ti.template(), material: ti.template(), s):
    """Stored energy per unit area [J/m2]."""
    result = cells.area[s] * 0.0
    if ti.static(material.yields):
        result = metal.stored(cells, material, s)
    else:
        g = cells.strain[s]
        result = 0.5 * (1.0 - cells.delayed[s]) * g.dot(generalised(material, sheet_of(cells, s), shear_of(cells, material, s), g))
    return result


@ti.func
def driving_strain(material: ti.template(), b, g: ti.template()):
    """Mazars' equivalent strain; of a bent shell, that of the skin where it is larger."""
    nu = material.poisson[b]
    eps = mazars.equivalent_strain(nu, g[0], g[1], 0.5 * g[2])
    if ti.static(material.bends):
        for side in ti.static((-0.5, 0.5)):
            z = side * material.thickness[b]
            skin = mazars.equivalent_strain(nu, g[0] + z * g[3], g[1] + z * g[4], 0.5 * (g[2] + z * g[5]))
            eps = ti.max(eps, skin)
    return eps


@ti.func
def _damage(cells: ti.template(), material: ti.template(), s, g: ti.template(), r: ti.template(), dt, tally):
    """D_r of cell s after dt at the strains g, whose undamaged resultants are r; Mazars' law."""
    b = sheet_of(cells, s)
    before = cells.delayed[s]
    after = before
    D = mazars.damage(driving_strain(material, b, g), material.threshold[b], material.A[b], material.B[b])
    if ti.static(cells.spares):
        if cells.sound[s] == 1:
            D *= 0.0
    D = ti.max(D, cells.damage[s])
    if dt > 0.0:  # without time nothing is damaged: a look at the forces leaves the state as it is
        if ti.static(material.delays):
            if D > before:
                after = delay.advance(before, D, material.a[b], material.tau_c[b], dt)
        else:
            after = D
        cells.damage[s] = D
    if after > before and tally == 1:
        # 1/2 dD g_n . r(g_n+1) is exactly what the trapezoidal work of the step does not store
        cells.lost[s] += 0.5 * (after - before) * cells.area[s] * r.dot(cells.strain[s])
    cells.delayed[s] = after
    return after


@ti.func
def answer(cells: ti.template(), material: ti.template(), s, g: ti.template(), dt, intact, tally):
    """Resultants (N11, N22, N12, M11, M22, M12, Q1, Q2) [N/m, N] of stress point s at the strains g, by whatever law the material has.

    Advances damage and plastic flow over dt, as `resultants` says.
    """
    r = generalised(material, sheet_of(cells, s), shear_of(cells, material, s), g)
    if intact == 0:
        if ti.static(material.yields):
            r = metal.advance(cells, material, s, g, dt, 1 - tally)
        else:
            if ti.static(material.damages):
                r *= 1.0 - _damage(cells, material, s, g, r, dt, tally)
                if dt > 0.0 or tally == 0:  # what damage takes is counted from the strains of the step before
                    cells.strain[s] = g
            else:
                cells.strain[s] = g
        if ti.static(material.breaks):
            if cells.delayed[s] >= material.critical[sheet_of(cells, s)] and cells.broken[s] == 0 and dt > 0.0:
                cells.new[ti.atomic_add(cells.n_new[0], 1)] = s
    return r


@ti.func
def resultants(cells: ti.template(), material: ti.template(), s, slopes: ti.template(), dt, intact, tally):
    """n^1, n^2, m^1, m^2 [N/m, N], q [N/m] of cell s from its slopes (u_,1, u_,2, d_,1, d_,2, d).

    Advances damage over dt. intact = 1 leaves damage out (for the spectrum); a cell that reaches D_c is put on
    the list `new`. tally = 0 renews strain and damage without charging the ledger (after a rupture has changed
    the links). Where there is history a mere look, dt = 0, writes none of it. A shell that stays in its plane ignores those of d
    and returns zeros for m and q.
    """
    a1, a2 = cells.a1[s], cells.a2[s]
    u1, u2, d1, d2, d = ti.static(slopes)
    x1, x2 = a1 + u1, a2 + u2
    g = cells.strain[s] * 0.0
    g[0] = a1.dot(u1) + 0.5 * u1.dot(u1)
    g[1] = a2.dot(u2) + 0.5 * u2.dot(u2)
    g[2] = a1.dot(u2) + a2.dot(u1) + u1.dot(u2)
    n, n_1, n_2 = d, d1, d2
    if ti.static(material.bends):
        n, n_1, n_2 = cells.director[s] + d, cells.director_1[s] + d1, cells.director_2[s] + d2
        g[3] = a1.dot(d1) + u1.dot(n_1)
        g[4] = a2.dot(d2) + u2.dot(n_2)
        g[5] = a1.dot(d2) + u1.dot(n_2) + a2.dot(d1) + u2.dot(n_1)
        g[6] = a1.dot(d) + u1.dot(n)
        g[7] = a2.dot(d) + u2.dot(n)
    r = answer(cells, material, s, g, dt, intact, tally)
    n1 = r[0] * x1 + r[2] * x2
    n2 = r[2] * x1 + r[1] * x2
    m1, m2, q = n1 * 0.0, n1 * 0.0, n1 * 0.0
    if ti.static(material.bends):
        n1 += r[3] * n_1 + r[5] * n_2 + r[6] * n
        n2 += r[5] * n_1 + r[4] * n_2 + r[7] * n
        m1 = r[3] * x1 + r[5] * x2
        m2 = r[5] * x1 + r[4] * x2
        q = r[6] * x1 + r[7] * x2
    return n1, n2, m1, m2, q


@ti.kernel
def of_sound_cells(term: ti.template(), n: ti.i32, dt: float, intact: ti.i32):
    """What a formulation asks of each cell that is not broken (`term.answer`)."""
    for s in range(n):
        if term.cells.broken[s] == 0:
            term.answer(term, s, dt, intact, 1)


def stored_energy(partial: Any, cells: StressPoints, material: MaterialPool, blocks: int) -> float:
    """Elastic energy of the live cells [J]; partial: scratch for one number a block."""
    _elastic(partial, cells, material, cells.n, blocks)
    return float(np.sum(runtime.get(partial, blocks)))


@ti.kernel
def _elastic(partial: ti.template(), cells: ti.template(), material: ti.template(), n: ti.i32, blocks: ti.i32):
    for b in range(blocks):
        s = ti.cast(0.0, ti.f64)
        for c in range(b * BLOCK, ti.min(n, (b + 1) * BLOCK)):
            if cells.broken[c] == 0:
                s += ti.cast(energy_density(cells, material, c) * cells.area[c], ti.f64)
        partial[b] = s
