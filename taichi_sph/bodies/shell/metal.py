"""A stress point of a metal: from the change of its strains over a step to the change of its stresses.

Strains are measured on the reference (stress.py). The stretch U of the middle of the step, U^2 = C = 1 + 2 E, brings their increments
to the present:

    d_eps = U^-1 dE U^-1,   d_beta = e / sqrt(12) U^-1 dkappa U^-1,   d_gamma = U^-1 dgamma,    e = e_0 / det U

These are the rate of deformation in the frame that the polar rotation carries along. Stretching adds up to the logarithmic strain and
rotations do not count (differences of Almansi's strain, T 2.7, would saturate). The thickness follows from incompressibility; the
elastic change of volume, some thousandths at most, is left out. The stresses m, b, s (laws/von_mises.py) are kept in the same frame,
per unit of reference volume (Kirchhoff). They are effective, that is of the undamaged part. With U at the end of the step they give
the resultants on the reference,

    N = (1 - D_r) e_0 U^-1 m U^-1,   M = (1 - D_r) e_0 e / sqrt(12) U^-1 b U^-1,   Q = (1 - D_r) e_0 U^-1 s

whose power N : dE + M : dkappa + Q . dgamma is e_0 (m : d_eps + b : d_beta + s . d_gamma), exactly.

**Energy**, w = H^-1: a unit of volume stores 1/2 (1 - D_r) s w s. Of the trapezoidal work of a step, the plastic strain
d_p = w (trial - s_n+1) takes 1/2 ((1 - D_n) s_n + (1 - D_n+1) s_n+1) . d_p and damage takes 1/2 dD s_n w s_n+1. The increment is that
of the middle of the step, so the rest is of second order in the step.

**Layers.** The global form has one m, b and p for the section. With layers each Gauss point zeta in (-1, 1) has its
own stress, p and D, strained by d_eps + sqrt(3) zeta d_beta, and m, b are their moments; the section breaks when the
mean of D_r over the thickness reaches D_c. Transverse shear stays elastic then.

**Spread.** Where damage is spread over the width of a neck (shell_sph/spread.py), it grows with the mean of p and dp over it.

**After a rupture** the cells around it see fewer nodes, and their strains jump although nothing has moved. The jump is no deformation:
stress and plastic state are kept, and the new strains only become the base of the next increment (`rebase`). A look at the forces
(dt = 0) changes nothing either.
"""

import numpy as np

from ...laws import delay, ductile, elastic, johnson_cook, von_mises
from ...runtime import ti
from .pool import sheet_of

ROOT_12 = 12.0**0.5
ROOT_3 = 3.0**0.5


def thicknesses(strain: np.ndarray, thickness: np.ndarray) -> np.ndarray:
    """(M,) e = e_0 / det U [m] of the strains (M, 3 or 8) of cells of thickness e_0 (M,) [m]."""
    C11, C22, C12 = 1.0 + 2.0 * strain[:, 0], 1.0 + 2.0 * strain[:, 1], strain[:, 2]
    return thickness / np.sqrt(np.maximum(C11 * C22 - C12**2, 1e-12))


@ti.func
def inverse_stretch(c11, c22, c12):
    """(11, 22, 12) of C^-1/2, and det C^1/2; bounded where a cell has collapsed."""
    det = ti.sqrt(ti.max(c11 * c22 - c12 * c12, 1e-12))
    scale = 1.0 / (det * ti.sqrt(c11 + c22 + 2.0 * det))
    return ti.Vector([(c22 + det) * scale, (c11 + det) * scale, -c12 * scale]), det


@ti.func
def congruent(u: ti.template(), s11, s22, s12):
    """(11, 22, 12) of U S U."""
    a11, a12 = u[0] * s11 + u[2] * s12, u[0] * s12 + u[2] * s22
    a21, a22 = u[2] * s11 + u[1] * s12, u[2] * s12 + u[1] * s22
    return ti.Vector([a11 * u[0] + a12 * u[2], a21 * u[2] + a22 * u[1], a11 * u[2] + a12 * u[1]])


@ti.func
def compliance(material: ti.template(), b, sheared, x: ti.template(), y: ti.template()):
    """x w y: twice the energy per volume where x = y. `sheared` = G_s / e_0; b: the body."""
    nu = material.poisson[b]
    result = x[0] * y[0] + x[1] * y[1] - nu * (x[0] * y[1] + x[1] * y[0]) + 2.0 * (1.0 + nu) * x[2] * y[2]
    if ti.static(x.n > 3):
        result += x[3] * y[3] + x[4] * y[4] - nu * (x[3] * y[4] + x[4] * y[3]) + 2.0 * (1.0 + nu) * x[5] * y[5]
    result /= material.young[b]
    if ti.static(x.n > 3):
        result += (x[6] * y[6] + x[7] * y[7]) / sheared
    return result


@ti.func
def increments(material: ti.template(), b, before: ti.template(), now: ti.template()):
    """(eps11, eps22, eps12) or (eps, beta, gamma) of a step between two states of the strains of stress.py."""
    u, det = inverse_stretch(1.0 + before[0] + now[0], 1.0 + before[1] + now[1], 0.5 * (before[2] + now[2]))
    change = now - before
    d = change * 0.0
    eps = congruent(u, change[0], change[1], 0.5 * change[2])
    for k in ti.static(range(3)):
        d[k] = eps[k]
    if ti.static(material.bends):
        beta = material.thickness[b] / (ROOT_12 * det) * congruent(u, change[3], change[4], 0.5 * change[5])
        for k in ti.static(range(3)):
            d[3 + k] = beta[k]
        d[6] = u[0] * change[6] + u[2] * change[7]
        d[7] = u[2] * change[6] + u[1] * change[7]
    return d


@ti.func
def on_reference(material: ti.template(), b, now: ti.template(), stress: ti.template()):
    """Resultants (N11, N22, N12, M11, M22, M12, Q1, Q2) [N/m, N] of the stresses (m, b, s) at the strains `now`."""
    e = material.thickness[b]
    u, det = inverse_stretch(1.0 + 2.0 * now[0], 1.0 + 2.0 * now[1], now[2])
    r = stress * 0.0
    N = e * congruent(u, stress[0], stress[1], stress[2])
    for k in ti.static(range(3)):
        r[k] = N[k]
    if ti.static(material.bends):
        M = e * e / (ROOT_12 * det) * congruent(u, stress[3], stress[4], stress[5])
        for k in ti.static(range(3)):
            r[3 + k] = M[k]
        r[6] = e * (u[0] * stress[6] + u[2] * stress[7])
        r[7] = e * (u[2] * stress[6] + u[1] * stress[7])
    return r


@ti.func
def _trial(material: ti.template(), b, sheared, stress: ti.template(), d: ti.template()):
    """Stresses after an elastic step."""
    young, nu = material.young[b], material.poisson[b]
    trial = stress
    S = elastic.plane_stress(young, nu, d[0], d[1], d[2])
    for k in ti.static(range(3)):
        trial[k] += S[k]
    if ti.static(stress.n > 3):
        B = elastic.plane_stress(young, nu, d[3], d[4], d[5])
        for k in ti.static(range(3)):
            trial[3 + k] += B[k]
        trial[6] += sheared * d[6]
        trial[7] += sheared * d[7]
    return trial


@ti.func
def _rate2(d: ti.template()):
    """Square of the equivalent strain of an increment (johnson_cook)."""
    result = johnson_cook.square(d[0], d[1], d[2])
    if ti.static(d.n > 3):
        result += johnson_cook.square(d[3], d[4], d[5]) + (d[6] * d[6] + d[7] * d[7]) / 3.0
    return result


@ti.func
def _damaged(cells: ti.template(), material: ti.template(), s, b, D, delayed, p, dp, ratio2, dt):
    """(D, D_r) of cell s after a step in which the plastic strain grew by dp to p."""
    after, begins, ends = delayed, material.eps_d[b], material.eps_r[b]
    if ti.static(material.scatters):
        begins, ends = begins * cells.tough[s], ends * cells.tough[s]
    if dp > 0.0:
        R = ductile.triaxiality(material.poisson[b], ratio2)
        D = ti.min(D + ductile.growth(p, dp, R, begins, ends, material.D_c[b]), 1.0)
    if ti.static(material.delays):
        if D > delayed:
            after = delay.advance(delayed, D, material.a[b], material.tau_c[b], dt)
    else:
        after = D
    return D, after


@ti.func
def advance(cells: ti.template(), material: ti.template(), s, g: ti.template(), dt, rebase):
    """Resultants of cell s at the strains g, and its history after a step of dt; dt = 0 leaves the history as it is."""
    b = sheet_of(cells, s)
    stress = cells.stress[s]
    kept = stress[0] * 0.0 + 1.0
    if ti.static(material.layers > 0):
        if rebase == 0:
            stress = _layered(cells, material, s, increments(material, b, cells.strain[s], g), dt)
    else:
        if rebase == 0:
            stress = _section(cells, material, s, increments(material, b, cells.strain[s], g), dt)
        if ti.static(material.damages):
            kept -= cells.delayed[s]
    if dt > 0.0 or rebase == 1:
        cells.strain[s] = g
    return kept * on_reference(material, b, g, stress)


@ti.func
def _section(cells: ti.template(), material: ti.template(), s, d: ti.template(), dt):
    """Effective stresses (m, b, s) after the increment d, the section as one point."""
    b = sheet_of(cells, s)
    young, nu = material.young[b], material.poisson[b]
    sheared = young
    if ti.static(material.bends):
        sheared = cells.shear[s] / material.thickness[b]
    before = cells.stress[s]
    trial = _trial(material, b, sheared, before, d)
    stress = trial
    flow = cells.flow[s]
    rate = flow * 0.0
    if ti.static(material.rated):
        rate = cells.rate[s]
        if dt > 0.0:
            latest = ti.sqrt(_rate2(d)) / dt
            cells.rate[s] = latest
            rate = 0.5 * (rate + latest)
    D_0 = flow * 0.0
    if ti.static(material.damages):
        D_0 = cells.delayed[s]
    dp = flow * 0.0
    p = dp
    alpha, kappa = material.alpha[b], material.kappa[b]
    trial2 = von_mises.equivalent2(trial, alpha, kappa)
    if trial2 > flow * flow:
        factor = flow * 0.0 + 1.0
        if ti.static(material.rated):
            factor = johnson_cook.factor(rate, material.C[b], material.rate0[b])
        if trial2 > (factor * flow) ** 2:
            bulk, shear = 0.5 * young / (1.0 - nu), 1.5 * young / (1.0 + nu)
            p = cells.plastic[s]
            lam = p
            if ti.static(material.damages):
                lam = cells.hardening[s]
            now = flow
            if ti.static(material.bends):
                stress, dp, now = von_mises.return_section(material, b, trial, trial2, bulk, shear, sheared, flow, lam, 1.0 - D_0, factor)
            else:
                stress, dp, now = von_mises.return_plane(material, b, trial, bulk, shear, flow, lam, 1.0 - D_0, factor)
            p += dp
            if dt > 0.0:
                cells.plastic[s] = p
                if ti.static(material.damages):
                    cells.hardening[s] = lam + (1.0 - D_0) * dp
                cells.flow[s] = now / factor
                if ti.static(material.rated):
                    cells.limit[s] = now
    if dt > 0.0:
        volume = material.thickness[b] * cells.area[s]
        D_1 = D_0
        if ti.static(material.damages):
            drives, dq = p, dp
            if ti.static(material.spreads):
                drives, dq = cells.neck[s], cells.neck_step[s]
            if dq > 0.0 or cells.damage[s] > D_0:
                if not _spared(cells, s):
                    ratio2 = von_mises.pressure2(stress, alpha) / ti.max(von_mises.equivalent2(stress, alpha, kappa), 1e-30)
                    D, D_r = _damaged(cells, material, s, b, cells.damage[s], D_0, drives, dq, ratio2, dt)
                    D_1 = D_r
                    cells.damage[s], cells.delayed[s] = D, D_1
                    if D_1 > D_0:
                        cells.lost[s] += 0.5 * (D_1 - D_0) * volume * compliance(material, b, sheared, before, stress)
        if dp > 0.0:
            mean = 0.5 * ((1.0 - D_0) * before + (1.0 - D_1) * stress)
            cells.dissipated[s] += volume * compliance(material, b, sheared, mean, trial - stress)
        cells.stress[s] = stress
    return stress


@ti.func
def _spared(cells: ti.template(), s):
    result = False
    if ti.static(cells.spares):
        result = cells.sound[s] == 1
    return result


@ti.func
def _layered(cells: ti.template(), material: ti.template(), s, d: ti.template(), dt):
    """Stresses (m, b, s) that the section carries after the increment d, damage taken off, layer by layer."""
    b = sheet_of(cells, s)
    young, nu, L = material.young[b], material.poisson[b], material.layers
    bulk, shear = 0.5 * young / (1.0 - nu), 1.5 * young / (1.0 + nu)
    sheared = cells.shear[s] / material.thickness[b]
    volume = material.thickness[b] * cells.area[s]
    result = cells.stress[s] * 0.0
    zero = young * 0.0
    p_mean, flow_mean, limit, D_mean, mean_0, mean_1, lost, dissipated = zero, zero, zero, zero, zero, zero, zero, zero
    for l in range(L):
        q = s * L + l
        zeta, w = material.zeta[l], material.weight[l]
        state = cells.layer[q]  # p, lambda, flow, rate, D, D_r, limit
        before = cells.layer_stress[q]
        step = ti.Vector([d[k] + ROOT_3 * zeta * d[3 + k] for k in ti.static(range(3))])
        trial = _trial(material, b, sheared, before, step)
        stress = trial
        rate, D_0 = state[3], state[5]
        if ti.static(material.rated):
            if dt > 0.0:
                latest = ti.sqrt(johnson_cook.square(step[0], step[1], step[2])) / dt
                state[3] = latest
                rate = 0.5 * (rate + latest)
        dp = zero
        trial2 = von_mises.equivalent2(trial, zero, zero)
        if trial2 > state[2] * state[2]:
            factor = zero + 1.0
            if ti.static(material.rated):
                factor = johnson_cook.factor(rate, material.C[b], material.rate0[b])
            if trial2 > (factor * state[2]) ** 2:
                now = zero
                stress, dp, now = von_mises.return_plane(material, b, trial, bulk, shear, state[2], state[1], 1.0 - D_0, factor)
                state[0] += dp
                state[1] += (1.0 - D_0) * dp
                state[2] = now / factor
                state[6] = now
        D_1 = D_0
        if ti.static(material.damages):
            if dt > 0.0 and not _spared(cells, s):
                ratio2 = von_mises.pressure2(stress, zero) / ti.max(von_mises.equivalent2(stress, zero, zero), 1e-30)
                D, D_r = _damaged(cells, material, s, b, state[4], D_0, state[0], dp, ratio2, dt)
                D_1 = D_r
                state[4], state[5] = D, D_1
                lost += w * 0.5 * (D_1 - D_0) * compliance(material, b, sheared, before, stress)
        if dp > 0.0:
            mean = 0.5 * ((1.0 - D_0) * before + (1.0 - D_1) * stress)
            dissipated += w * compliance(material, b, sheared, mean, trial - stress)
        if dt > 0.0:
            cells.layer[q] = state
            cells.layer_stress[q] = stress
        for k in ti.static(range(3)):
            result[k] += w * (1.0 - D_1) * stress[k]
            result[3 + k] += ROOT_3 * zeta * w * (1.0 - D_1) * stress[k]
        p_mean += w * state[0]
        flow_mean += w * state[2]
        limit += w * state[6]
        D_mean += w * state[4]
        mean_0 += w * D_0
        mean_1 += w * D_1
    across_0 = ti.Vector([cells.shear_stress[s][0], cells.shear_stress[s][1]])
    across = across_0 + sheared * ti.Vector([d[6], d[7]])
    result[6] = (1.0 - mean_1) * across[0]
    result[7] = (1.0 - mean_1) * across[1]
    if dt > 0.0:
        cells.shear_stress[s] = across
        cells.stress[s] = result
        cells.plastic[s] = p_mean
        cells.flow[s] = flow_mean
        if ti.static(material.rated):
            cells.limit[s] = limit
        cells.dissipated[s] += volume * dissipated
        if ti.static(material.damages):
            cells.damage[s] = D_mean
            cells.delayed[s] = mean_1
            cells.lost[s] += volume * (lost + 0.5 * (mean_1 - mean_0) * across_0.dot(across) / sheared)
    return result


@ti.func
def stored(cells: ti.template(), material: ti.template(), s):
    """Elastic energy per unit of reference area [J/m2]."""
    b = sheet_of(cells, s)
    sheared = material.young[b]
    if ti.static(material.bends):
        sheared = cells.shear[s] / material.thickness[b]
    kept = material.young[b] * 0.0 + 1.0
    if ti.static(material.damages):
        kept -= cells.delayed[s]
    twice = kept * 0.0
    if ti.static(material.layers > 0):
        across = cells.shear_stress[s]
        twice += kept * across.dot(across) / sheared
        for l in range(material.layers):
            q = s * material.layers + l
            stress = cells.layer_stress[q]
            twice += material.weight[l] * (1.0 - cells.layer[q][5]) * compliance(material, b, sheared, stress, stress)
    else:
        stress = cells.stress[s]
        twice += kept * compliance(material, b, sheared, stress, stress)
    return 0.5 * material.thickness[b] * twice
