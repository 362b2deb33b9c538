"""A stress point of concrete in space (rated.py; laws/concrete.py). The pressure follows ln J, the deviators of the whole and of the rubble
are kept, and that of the strain, which drives the damage.

A unit of volume stores (1 - D) s_i:s_i / 4G + D s_f:s_f / 4G + p^2 / 2K, the last times 1 - D in tension. What the trapezoidal work of a
step is more than this grows, is taken: by damage, by the caps, by what rubs.
"""

from ...laws import concrete, delay, mazars
from ...numerics import symmetric
from ...runtime import ti
from ..nodal.nodes import body_of
from . import rated


@ti.func
def nominal(bulk, whole: ti.template(), rubble: ti.template(), D, dilation):
    """(stress, pressure under which it stands) of the shares."""
    pressure = -bulk * dilation
    stress = (1.0 - D) * whole + D * rubble
    for k in ti.static(range(3)):
        stress[k] -= ti.max(pressure, 0.0) + (1.0 - D) * ti.min(pressure, 0.0)
    return stress, pressure


@ti.func
def energy(shear, bulk, whole: ti.template(), rubble: ti.template(), D, pressure):
    kept = (1.0 - D) * symmetric.product(whole, whole) + D * symmetric.product(rubble, rubble)
    volume = pressure * pressure
    if pressure < 0.0:
        volume *= 1.0 - D
    return 0.25 * kept / shear + 0.5 * volume / bulk


@ti.func
def advance(cells: ti.template(), material: ti.template(), s, E: ti.template(), dt):
    """(S on the reference, energy per volume, softer, stiffer) of cell s at the strain E; dt = 0 leaves the history as it is."""
    b = body_of(cells, s)
    d, back, volume, least = rated.increment(cells, s, E)
    shear, bulk, fc = material.shear[b], material.bulk[b], material.compression[b]
    change, _ = symmetric.deviator(d)
    was = ti.log(1.0 / (_determinant(cells.back[s])))
    now = ti.log(volume)
    whole_0, rubble_0, D_0 = cells.stress[s], cells.rubble[s], cells.delayed[s]
    stress_0, pressure_0 = nominal(bulk, whole_0, rubble_0, D_0, was)
    pressure = -bulk * now
    whole = concrete.capped(whole_0 + 2.0 * shear * change, concrete.cap(fc, pressure, concrete.COHESION))
    rubble = rubble_0 + 2.0 * shear * change
    D_1 = D_0
    if dt > 0.0:
        cells.shape[s] += change
        D_1 = _damaged(cells, material, s, b, now, dt)
        if D_1 > 0.0:
            rubble = (D_0 * rubble + (D_1 - D_0) * whole) / D_1
    if ti.static(material.rubs):
        rubble = concrete.capped(rubble, concrete.cap(fc, pressure, 0.0))
        if pressure <= 0.0:
            rubble *= 0.0
    else:
        rubble *= 0.0
    stress, _ = nominal(bulk, whole, rubble, D_1, now)
    held = energy(shear, bulk, whole, rubble, D_1, pressure)
    if dt > 0.0:
        mean = 0.5 * (stress_0 + stress)
        part, sum_ = symmetric.deviator(mean)
        work = symmetric.product(part, change) + sum_ / 3.0 * (now - was)
        taken = work - held + energy(shear, bulk, whole_0, rubble_0, D_0, pressure_0)
        cells.lost[s] += ti.cast(cells.volume[s] * taken, ti.f64)
        cells.stress[s], cells.rubble[s] = whole, rubble
        rated.keep(cells, s, E, back)
    softer = ti.max(1.0 - D_1, material.least[b])
    return symmetric.congruent(back, stress), held, softer, 1.0 / ti.max(least, 1e-6)


@ti.func
def _determinant(a: ti.template()):
    return symmetric.matrix(a).determinant()


@ti.func
def _damaged(cells: ti.template(), material: ti.template(), s, b, dilation, dt):
    """D_r after a step to these strains."""
    e = cells.shape[s]
    eps = dilation * 0.0
    if ti.static(material.principal):
        eps = concrete.principal(material.share[b], dilation, e)
    else:
        eps = concrete.de_vree(material.poisson[b], material.ratio[b], dilation, e)
    D = ti.max(cells.damage[s], mazars.damage(eps, material.threshold[b], material.A[b], material.B[b]))
    result = cells.delayed[s]
    if ti.static(material.delays):
        if D > result:
            result = delay.advance(result, D, material.a[b], material.tau_c[b], dt)
    else:
        result = D
    cells.damage[s], cells.delayed[s] = D, result
    return result
