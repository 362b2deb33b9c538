"""A stress point of an explosive: an elastic solid until the front of the detonation comes, then a gas (laws/jwl.py).

The front is said, not found (Wilkins 1964): it runs at its own speed from where the explosive is lit, and reaches the middle of a cell
at the time `lit`. A share of the cell is burnt,

    f = clip((t - lit) D / (WIDTH h), 0, 1)        P = (1 - f) F S_elastic - f (p + q) cof F

with q the bulk viscosity, which acts in compression: q = rho h (LINEAR c |d| + SQUARE h d^2). The energy of the gas, at the start the
chemical one, takes all the work of the cell that is not stored elastically:

    e_1 + (1 - f_1) W_1 = e_0 + (1 - f_0) W_0 + 1/2 (P_0 + P_1) : (F_1 - F_0)

p is linear in e_1, so this is solved at once. It is the work that the forces of the cell do in a step (world/step.py), so the books close
however fast the front is: to rounding in one dimension, to some 1e-4 % in space. A gas bears no tension.
"""

from ...laws import elastic_solid, jwl
from ...numerics import symmetric
from ...numerics.tensors import cofactor, nine, square
from ...runtime import ti
from ..nodal.nodes import body_of

WIDTH = 1.5  # cells over which a front burns: narrower ones ring
LINEAR, SQUARE = 0.06, 0.75  # Landshoff's and von Neumann's
FLAT = 1e-3  # least J: a cell that is flatter has no sense


@ti.func
def advance(cells: ti.template(), material: ti.template(), s, E: ti.template(), F: ti.template(), dt, time):
    """(P, energy per volume, softer, stiffer) of cell s at the strain E and the gradient F; dt = 0 leaves the history as it is."""
    b = body_of(cells, s)
    density, h = material.density[b], cells.size[s]
    J, areas = ti.max(F.determinant(), FLAT), cofactor(F)
    S = elastic_solid.stress(material.lame[b], material.shear[b], E)
    solid, held = F @ symmetric.matrix(S), 0.5 * symmetric.product(S, E)
    before, burnt = cells.burnt[s], cells.burnt[s]
    p, q, energy = cells.pressure[s], cells.viscosity[s], cells.energy[s]
    damping = J * 0.0
    least = ti.max(2.0 * symmetric.eigenvalues(E)[2] + 1.0, 1e-6)  # square of the least stretch
    if dt > 0.0:
        burnt = ti.cast(ti.max(0.0, ti.min(1.0, (time - cells.lit[s]) * ti.cast(material.front[b] / (WIDTH * h), ti.f64))), float)
        change = F - square(cells.gradient[s])
        grown = (areas * change).sum()
        if burnt > 0.0:
            width, rate = h * ti.sqrt(least), ti.max(-grown, 0.0) / (J * dt)
            c = ti.sqrt(ti.max(jwl.modulus(material, b, J, energy, p) / density, 1.0))
            q = density / J * width * rate * (LINEAR * c + SQUARE * width * rate)
            damping = LINEAR + 2.0 * SQUARE * width * rate / c
        known = energy + (1.0 - before) * cells.held[s] - (1.0 - burnt) * held
        known += 0.5 * ((square(cells.stress[s]) + (1.0 - burnt) * solid) * change).sum()
        warmth, cold = material.omega[b] / J, jwl.cold(material, b, J)
        energy = (known - 0.5 * burnt * (cold + q) * grown) / (1.0 + 0.5 * burnt * warmth * grown)
        p = cold + warmth * energy
        if p < 0.0:
            p, energy = J * 0.0, known - 0.5 * burnt * q * grown
        if burnt == 0.0:
            p *= 0.0
    P = (1.0 - burnt) * solid - burnt * (p + q) * areas
    modulus = jwl.modulus(material, b, J, energy, p)
    faster = damping + ti.sqrt(1.0 + damping * damping)
    stiff = burnt * modulus / (material.lame[b] + 2.0 * material.shear[b]) / least * faster * faster
    softer = cells.softer[s]
    if dt > 0.0:
        cells.burnt[s], cells.pressure[s], cells.viscosity[s], cells.energy[s] = burnt, p, q, energy
        cells.stress[s], cells.gradient[s], cells.held[s] = nine(P), nine(F), held
        if burnt == 1.0:
            softer = ti.min(softer, modulus / material.young[b])
    return P, (1.0 - burnt) * held + energy, softer, ti.max(stiff, 1.0)
