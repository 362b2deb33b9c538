"""One time step, central differences (T 2.29 to 2.32), on one page.

    strain    u_n -> edge means, strains, damage, stresses
    rupture   cells that reached D_c break; the links they cut are renewed; only then
    force     f_n = internal + terms + external
    kick      v_n+1/2 = v_n-1/2 + dt_n f_n / m          (prescribed velocities replace theirs)
    drift     u_n+1   = u_n + dt v_n+1/2

Energies belong to time n: kinetic = 1/2 m v_n-1/2 . v_n+1/2, and the work of a force is trapezoidal,
1/2 (f_n + f_n+1) . (u_n+1 - u_n). With these the discrete balance closes to rounding for a linear body, so
what is left over is a measure of the rest.
"""

from ..forces.loads import history
from ..runtime import ti


def step(sim, dt_before: float, dt: float) -> None:
    """Advance `sim` by dt; dt_before is the step that led to the present time."""
    sim.internal.strain(dt)
    sim.rupture.happen()
    sim.internal.force()
    for term in sim.terms:
        term.add(dt)
    sim.loads.update(sim.time)
    _kick_and_drift(sim.nodes, sim.loads, sim.nodes.n, dt_before, dt, sim.time + 0.5 * dt)


@ti.kernel
def _kick_and_drift(
    nodes: ti.template(), loads: ti.template(), n: ti.i32, dt_before: float, dt: float, half_time: float
):
    kick = 0.5 * (dt_before + dt)
    for i in range(n):
        before = nodes.v[i]
        force = nodes.force[i]
        push = force * 0.0  # all that acts from outside, reactions included
        if ti.static(loads.pushes):
            push = loads.external[i]
            force += push
        after = before + kick / nodes.mass[i] * force
        if ti.static(loads.moves):
            if nodes.fixed[i] > 0:
                g = nodes.fixed[i] - 1
                free = after
                for c in ti.static(range(nodes.dim)):
                    if loads.mask[g][c] == 1:
                        after[c] = loads.velocity[g][c] * history(half_time, loads.rise[g])
                push += nodes.mass[i] / kick * (after - free)
        if ti.static(loads.acts):
            if any(push != 0.0):
                loads.work[i] += loads.ahead[i] + 0.5 * dt_before * push.dot(before)
                loads.ahead[i] = 0.5 * dt * push.dot(after)
        if dt_before == 0.0:
            before = 2.0 * before - after  # v_0 was given at t = 0: this is the half step before it
        nodes.kinetic[i] = 0.5 * nodes.mass[i] * before.dot(after)
        nodes.v[i] = after
        nodes.u[i] += dt * after
