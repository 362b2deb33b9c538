"""A stress point of a metal in space: von Mises, Johnson and Cook with heat, ductile damage (rated.py; laws/von_mises_solid.py).

The stress is effective, that is of the undamaged part; a unit of volume stores 1/2 (1 - D_r) t w t, w = inverse elasticity. Of the
trapezoidal work of a step, plastic strain takes 1/2 ((1 - D_n) t_n + (1 - D_n+1) t_n+1) : w (trial - t_n+1) and damage 1/2 dD t_n w t_n+1:
an identity. Damage grows less under pressure, from all of it in shear to nothing in uniaxial compression and beyond, where voids do not
open (no growth below a triaxiality of -1/3: Bao and Wierzbicki 2005).
"""

from ...laws import delay, ductile, johnson_cook, von_mises_solid
from ...numerics import symmetric
from ...runtime import ti
from ..nodal.nodes import body_of
from . import rated


@ti.func
def compliance(material: ti.template(), b, x: ti.template(), y: ti.template()):
    """x w y: twice the energy per volume where x = y."""
    one, sum_x = symmetric.deviator(x)
    two, sum_y = symmetric.deviator(y)
    return 0.5 * symmetric.product(one, two) / material.shear[b] + sum_x * sum_y / (9.0 * material.bulk[b])


@ti.func
def advance(cells: ti.template(), material: ti.template(), s, E: ti.template(), dt):
    """(S on the reference, energy per volume, softer, stiffer) of cell s at the strain E; dt = 0 leaves the history as it is."""
    b = body_of(cells, s)
    d, back, volume, least = rated.increment(cells, s, E)
    shear, bulk = material.shear[b], material.bulk[b]
    before = cells.stress[s]
    change, grown = symmetric.deviator(d)
    trial = before + 2.0 * shear * change
    for k in ti.static(range(3)):
        trial[k] += bulk * grown
    flow = cells.flow[s]
    factor = flow * 0.0 + 1.0
    if ti.static(material.rated):
        rate = cells.rate[s]
        if dt > 0.0:
            latest = ti.sqrt(2.0 / 3.0 * symmetric.product(change, change)) / dt
            cells.rate[s] = latest
            rate = 0.5 * (rate + latest)
        factor *= johnson_cook.factor(rate, material.C[b], material.rate0[b])
    if ti.static(material.heats):
        factor *= johnson_cook.softening(cells.temperature[s], material.room[b], material.melting[b], material.softening[b])
    stress = trial
    kept = flow * 0.0 + 1.0
    if ti.static(material.damages):
        kept -= cells.delayed[s]
    dp, p = flow * 0.0, cells.plastic[s]
    part, trace = symmetric.deviator(trial)
    q = von_mises_solid.equivalent(part)
    if q > factor * flow:
        lam = cells.hardening[s]
        now = flow
        melts = factor <= 1e-9
        if melts:
            part, dp = 0.0 * part, q / (3.0 * shear)
        else:
            part, dp, now = von_mises_solid.returned(material, b, part, q, shear, flow, lam, kept, factor)
        stress = part
        for k in ti.static(range(3)):
            stress[k] += trace / 3.0
        p += dp
        if dt > 0.0:
            cells.plastic[s], cells.hardening[s] = p, lam + kept * dp
            if not melts:
                cells.flow[s] = now / factor
    after = kept
    if dt > 0.0:
        if ti.static(material.damages):
            if dp > 0.0 or cells.damage[s] > 1.0 - kept:
                after = 1.0 - _damaged(cells, material, s, b, stress, 1.0 - kept, p, dp, dt)
                cells.lost[s] += ti.cast(0.5 * (kept - after) * cells.volume[s] * compliance(material, b, before, stress), ti.f64)
        if dp > 0.0:
            work = compliance(material, b, 0.5 * (kept * before + after * stress), trial - stress)
            cells.dissipated[s] += ti.cast(cells.volume[s] * work, ti.f64)
            if ti.static(material.heats):
                cells.temperature[s] += material.warms[b] * work
        cells.stress[s] = stress
        rated.keep(cells, s, E, back)
    softer = after * ti.max(cells.flow[s] / (cells.flow[s] + material.young[b] * p), material.least[b])
    S = after * symmetric.congruent(back, stress)
    return S, 0.5 * after * compliance(material, b, stress, stress), softer, 1.0 / ti.max(least, 1e-6)


@ti.func
def _damaged(cells: ti.template(), material: ti.template(), s, b, stress: ti.template(), delayed, p, dp, dt):
    """D_r after a step in which the plastic strain grew by dp to p."""
    D = cells.damage[s]
    if dp > 0.0:
        part, trace = symmetric.deviator(stress)
        ratio = trace / 3.0 / ti.max(von_mises_solid.equivalent(part), 1e-30)
        R = ductile.triaxiality(material.poisson[b], ratio * ratio)
        opens = ti.min(ti.max(1.0 + 3.0 * ratio, 0.0), 1.0)
        D = ti.min(D + opens * ductile.growth(p, dp, R, material.eps_d[b], material.eps_r[b], material.D_c[b]), 1.0)
    result = delayed
    if ti.static(material.delays):
        if D > delayed:
            result = delay.advance(delayed, D, material.a[b], material.tau_c[b], dt)
    else:
        result = D
    cells.damage[s], cells.delayed[s] = D, result
    return result
