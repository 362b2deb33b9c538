"""Internal forces of solids: one point of stress a cell, by the mean gradient over the cell. Total Lagrangian.

    H = sum_i u_i B_i,  F = 1 + H          mean gradient, B of table.py
    r_k = u_k - u_mean - H (X_k - X_mean)  residual of the cell's corners against its linear field
    f_i = -(V P - k M) B_i - k r_i         M = sum_k r_k (X_k - X_mean); the last term on corners alone

These are the exact derivatives of V W(F) + 1/2 k sum r^2: linear and angular momentum and energy are kept, linear fields strain evenly. k
= gamma E V / h^2 pulls the twelve patterns of corners that a mean gradient does not see (hourglasses); on parallelepipeds M = 0, and this
is the element of Flanagan and Belytschko (1981). gamma = 1/6 is exact for the bending of one cube. Damage takes k as it takes the
stiffness, and yielding lowers it to the secant modulus of the plastic strain so far: k never grows again, and what it releases is booked.
Cells write the force on the node of each of their entries; nodes then gather theirs, in the order of the cells.
"""

from ...laws import elastic_solid
from ...numerics import symmetric
from ...numerics.tensors import cofactor
from ...runtime import ti
from ..nodal.nodes import body_of
from . import concrete, explosive, metal

LINEAR, SQUARE = 0.06, 1.2  # bulk viscosity, in compression: q = rho h (LINEAR c |d| + SQUARE h d^2) (von Neumann, Landshoff)


@ti.func
def _elastic(cells: ti.template(), material: ti.template(), s, E: ti.template()):
    """(S, energy per volume, softer, stiffer): Saint Venant and Kirchhoff's law. Along a stretch l its tangent is 1 + 3 E that at rest."""
    b = body_of(cells, s)
    S = elastic_solid.stress(material.lame[b], material.shear[b], E)
    part, trace = symmetric.deviator(E)
    most = trace / 3.0 + ti.sqrt(2.0 / 3.0 * symmetric.product(part, part))
    return S, 0.5 * symmetric.product(S, E), trace * 0.0 + 1.0, 1.0 + 3.0 * ti.max(most, 0.0)


@ti.kernel
def strain(cells: ti.template(), nodes: ti.template(), material: ti.template(), m: ti.i32, dt: float, time: ti.f64):
    """Stresses, history and forces of the cells. dt = 0: forces alone, of the history as it is."""
    for s in range(m):
        if cells.broken[s] == 0:
            b = body_of(cells, s)
            first, last = cells.first[s], cells.first[s + 1]
            end = first + cells.corners[s]
            share = 1.0 / ti.cast(cells.corners[s], float)
            u_mean, X_mean = ti.Vector([0.0, 0.0, 0.0]), ti.Vector([0.0, 0.0, 0.0], ti.f64)
            H = ti.Matrix.zero(float, 3, 3)
            for e in range(first, last):
                i = cells.node[e]
                u = nodes.u[i]
                H += u.outer_product(cells.B[e])
                if e < end:
                    u_mean += u
                    X_mean += nodes.X[i]
            u_mean *= share
            X_mean *= ti.cast(share, ti.f64)
            pull = cells.pull[s]
            M = ti.Matrix.zero(float, 3, 3)
            uneven = pull * 0.0
            for e in range(first, end):
                i = cells.node[e]
                arm = ti.cast(nodes.X[i] - X_mean, float)
                r = nodes.u[i] - u_mean - H @ arm
                M += r.outer_product(arm)
                uneven += r.norm_sqr()
            E = _strain(H)
            F = H + ti.Matrix.identity(float, 3)
            S, P, energy, softer, stiffer = E, F, pull * 0.0, pull * 0.0, pull * 0.0
            if ti.static(material.yields):
                S, energy, softer, stiffer = metal.advance(cells, material, s, E, dt)
            elif ti.static(material.brittle):
                S, energy, softer, stiffer = concrete.advance(cells, material, s, E, dt)
            elif ti.static(material.burns):
                P, energy, softer, stiffer = explosive.advance(cells, material, s, E, F, dt, time)
            else:
                S, energy, softer, stiffer = _elastic(cells, material, s, E)
            volume = cells.volume[s]
            if ti.static(not material.burns):
                P = F @ symmetric.matrix(S)
            flat = stiffer
            if ti.static(material.damps):
                q, zeta = _viscosity(cells, material, s, b, F, dt)
                P -= q * cofactor(F)
                stiffer *= (zeta + ti.sqrt(1.0 + zeta * zeta)) ** 2
            held = volume * energy + 0.5 * pull * softer * uneven
            cells.stored[s] = ti.cast(held, ti.f64)
            cells.stiffer[s] = stiffer
            if ti.static(material.remembers):
                if dt > 0.0:
                    cells.lost[s] += ti.cast(0.25 * pull * (cells.softer[s] - softer) * (cells.uneven[s] + uneven), ti.f64)
                    cells.uneven[s], cells.softer[s] = uneven, softer
            pull *= softer
            Q = volume * P - pull * M
            kept = pull * 0.0 + 1.0
            if ti.static(material.breaks):
                if dt > 0.0 and _breaks(cells, material, s, b, F, flat):
                    kept *= 0.0
            way = pull * 0.0
            for e in range(first, last):
                i = cells.node[e]
                f = -(Q @ cells.B[e])
                if e < end:
                    arm = ti.cast(nodes.X[i] - X_mean, float)
                    f -= pull * (nodes.u[i] - u_mean - H @ arm)
                if ti.static(material.breaks):
                    way += f.dot(nodes.v[i])
                    f *= kept
                cells.push[e] = f
            if ti.static(material.breaks):
                if kept == 0.0:  # the force that is gone has not done its half of the work of the step
                    ti.atomic_add(cells.n_new[0], 1)
                    cells.broken[s] = 1
                    cells.rupture_time[s] = time
                    cells.released[s], cells.stored[s] = ti.cast(held + 0.5 * dt * way, ti.f64), 0.0


@ti.func
def _strain(H: ti.template()):
    """E = 1/2 (H + H^T + H^T H)."""
    E = ti.Vector([H[0, 0], H[1, 1], H[2, 2], 0.5 * (H[0, 1] + H[1, 0]), 0.5 * (H[1, 2] + H[2, 1]), 0.5 * (H[0, 2] + H[2, 0])])
    for k in ti.static(range(6)):
        i, j = ti.static((0, 1, 2, 0, 1, 0)[k]), ti.static((0, 1, 2, 1, 2, 2)[k])
        E[k] += 0.5 * (H[0, i] * H[0, j] + H[1, i] * H[1, j] + H[2, i] * H[2, j])
    return E


@ti.func
def _viscosity(cells: ti.template(), material: ti.template(), s, b, F: ti.template(), dt):
    """(pressure of bulk viscosity now [Pa], its ratio to critical damping), and the books of what it takes."""
    q, zeta = cells.bulk[s], cells.bulk[s] * 0.0
    if dt > 0.0:
        before, now = cells.dilation[s], F.determinant() - 1.0
        rate = ti.max(before - now, 0.0) / (dt * (1.0 + 0.5 * (before + now)))
        h = cells.size[s]
        after = material.viscous[b] * material.density[b] * h * rate * (LINEAR * material.sound[b] + SQUARE * h * rate)
        cells.damped[s] += ti.cast(0.5 * (q + after) * (before - now) * cells.volume[s], ti.f64)
        cells.bulk[s], cells.dilation[s] = after, now
        q, zeta = after, material.viscous[b] * (LINEAR + 2.0 * SQUARE * h * rate / material.sound[b])
    return q, zeta


@ti.func
def _breaks(cells: ti.template(), material: ti.template(), s, b, F: ti.template(), flat):
    """Whether the damage of a cell has reached that of rupture: concrete only where its mean stress is tensile, else it stays as rubble,
    unless it is flatter than a cell may be. `flat`: `stiffer` of the law alone, without the viscosity."""
    result = cells.delayed[s] >= material.critical[b]
    if ti.static(material.brittle):
        result = result and F.determinant() > material.loosest[b]
        if ti.static(material.flattens):
            result = result or flat * material.flattest[b] * material.flattest[b] > 1.0 or F.determinant() <= 0.0
    return result


@ti.kernel
def gather(cells: ti.template(), nodes: ti.template(), n: ti.i32):
    """Internal forces of the nodes."""
    for i in range(n):
        f = ti.Vector([0.0, 0.0, 0.0])
        for k in range(cells.of_node[i], cells.of_node[i + 1]):
            f += cells.push[cells.entry[k]]
        nodes.force[i] = f


@ti.kernel
def stiffest(partial: ti.template(), cells: ti.template(), m: ti.i32, block: ti.i32, blocks: ti.i32):
    """Largest `stiffer` of the live cells, block by block."""
    for b in range(blocks):
        most = ti.cast(0.0, ti.f64)
        for s in range(b * block, ti.min(m, (b + 1) * block)):
            if cells.broken[s] == 0:
                most = ti.max(most, ti.cast(cells.stiffer[s], ti.f64))
        partial[b] = most
