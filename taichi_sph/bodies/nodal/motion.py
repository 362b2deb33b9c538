"""Kick and drift of nodes (T 2.31 to 2.34): v_n+1/2 = v_n-1/2 + dt_n f_n / m, u_n+1 = u_n + dt v_n+1/2; directors turn alike.

Prescribed velocities replace those of their nodes. The work that this takes is the work of the reaction.
"""

from ...runtime import ti
from .loads import history, undrilled


@ti.kernel
def kick_and_drift(nodes: ti.template(), loads: ti.template(), n: ti.i32, dt_before: float, dt: float, half_time: float):
    kick = 0.5 * (dt_before + dt)
    for i in range(n):
        before = nodes.v[i]
        force = nodes.force[i]
        push = force * 0.0  # all that acts from outside, reactions included
        if ti.static(loads.pushes):
            push = loads.force.total[i]
            force += push
        after = before + kick / nodes.mass[i] * force
        if ti.static(loads.moves):
            if nodes.fixed[i] > 0:
                g = nodes.fixed[i] - 1
                free = after
                after = _led(loads, loads.mask, loads.velocity, nodes.dim, g, after, half_time)
                reaction = nodes.mass[i] / kick * (after - free)
                push += reaction
                at = loads.supports.slot[i]
                loads.supports.u[at] = nodes.u[i]
                if ti.static(loads.blows):
                    loads.supports.force[at] += reaction
                else:
                    loads.supports.force[at] = reaction
        if ti.static(loads.acts):
            booked = any(push != 0.0)
            if ti.static(loads.blows):
                booked = booked or loads.ahead[i] != 0.0
            if booked:
                loads.work[i] += loads.ahead[i] + 0.5 * dt_before * push.dot(before)
                loads.ahead[i] = 0.5 * dt * push.dot(after)
        nodes.v[i] = after
        nodes.u[i] += dt * after
        if dt_before == 0.0:
            before = 2.0 * before - after  # v_0 was given at t = 0: this is the half step before it
        kinetic = 0.5 * nodes.mass[i] * before.dot(after)
        if ti.static(nodes.bends):
            kinetic += _turn(nodes, loads, i, kick, dt_before, dt, half_time)
        nodes.kinetic[i] = kinetic


@ti.func
def _led(loads: ti.template(), mask: ti.template(), value: ti.template(), n: ti.template(), g, rate, half_time):
    """A velocity, or a spin, of n components with those that motion g prescribes."""
    led = rate
    for c in ti.static(range(n)):
        if mask[g][c] == 1:
            led[c] = value[g][c] * history(half_time, loads.curves, loads.curve[g])
    return led


@ti.func
def _turn(nodes: ti.template(), loads: ti.template(), i, kick, dt_before, dt, half_time):
    """Kick and drift of a director: omega from the torque n x couple, n by the exponential map (T 2.33, 2.34).

    omega stays across n, so there is no drilling; returns the kinetic energy of the turning [J].
    """
    n = nodes.N[i] + nodes.d[i]
    before = nodes.omega[i]
    torque = n.cross(nodes.couple[i])
    twist = torque * 0.0  # all that turns from outside, reactions included
    if ti.static(loads.twists):
        moment = loads.moment.total[i]
        twist = moment - moment.dot(n) * n
        torque += twist
    after = before + kick / nodes.inertia[i] * torque
    if ti.static(loads.moves):
        if nodes.fixed[i] > 0:
            g = nodes.fixed[i] - 1
            free = after
            after = _led(loads, loads.spin_mask, loads.spin, 3, g, after, half_time)
            after = undrilled(loads, g, n, after)
            reaction = nodes.inertia[i] / kick * (after - free)
            twist += reaction
            if ti.static(loads.blows):
                loads.supports.torque[loads.supports.slot[i]] += reaction
            else:
                loads.supports.torque[loads.supports.slot[i]] = reaction
    if ti.static(loads.twists or loads.moves):
        booked = any(twist != 0.0)
        if ti.static(loads.blows):
            booked = booked or loads.ahead_spin[i] != 0.0
        if booked:
            loads.work[i] += loads.ahead_spin[i] + 0.5 * dt_before * twist.dot(before)
            loads.ahead_spin[i] = 0.5 * dt * twist.dot(after)
    theta = dt * after
    angle = theta.norm()
    sinc, versine = 1.0 - angle * angle / 6.0, 0.5 - angle * angle / 24.0
    if angle > 1e-2:
        sinc, versine = ti.sin(angle) / angle, (1.0 - ti.cos(angle)) / (angle * angle)
    turned = theta.cross(n)
    d = nodes.d[i] + sinc * turned + versine * theta.cross(turned)
    n = nodes.N[i] + d
    nodes.d[i] = d + 0.5 * (1.0 - n.dot(n)) * n  # renormalised, without losing the small d in n
    nodes.omega[i] = after
    if dt_before == 0.0:
        before = 2.0 * before - after
    return 0.5 * nodes.inertia[i] * before.dot(after)
