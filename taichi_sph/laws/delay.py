"""Delayed damage (T 2.73): dD_r/dt = (1 - exp(-a <D - D_r>)) / tau_c, so never faster than 1 / tau_c.

With D held over the step, y = D - D_r obeys dy/dt = -(1 - exp(-a y)) / tau_c, whose solution is exact:

    exp(a y(t)) - 1 = (exp(a y(0)) - 1) exp(-a t / tau_c)

The law goes on while D_r < D, also above D_c: a brittle D jumps past D_c at once, and the switch
"D <= D_c" of T 2.73 would freeze it.
"""

from ..runtime import ti


@ti.func
def advance(delayed, damage, a, tau_c, dt):
    """D_r after dt, while D stays at `damage`."""
    # log(1 + (exp(z) - 1) exp(-q)) with its largest exponent taken out: exp(z) overflows for a brittle a
    z, q = a * ti.max(damage - delayed, 0.0), a * dt / tau_c
    most = ti.max(z - q, 0.0)
    y = (most + ti.log(ti.exp(-most) + ti.exp(z - q - most) - ti.exp(-q - most))) / a
    return ti.max(delayed, damage - y)
