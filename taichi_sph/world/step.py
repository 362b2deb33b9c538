"""One time step, central differences (T 2.29 to 2.32), on one page.

    strain    places at n -> strains, damage, stresses of the groups that are due
    events    cells that reached D_c break; the links they cut are renewed; only then
    meet      what the bodies see of each other: who is near, what water sees of walls
    force     f_n = internal + external, of each group for itself
    add       what bodies do to each other: pressure on walls, springs
    correct   f_n += c^T lambda, so that v_n+1/2 closes no gap that is closed (T 3.8)
    book      the work of an impulse that others came after
    move      v_n+1/2 = v_n-1/2 + dt_n f_n / m          (prescribed velocities replace theirs)
              x_n+1   = x_n + dt v_n+1/2

Energies belong to time n: kinetic = 1/2 m v_n-1/2 . v_n+1/2, and the work of a force is trapezoidal, 1/2 (f_n + f_n+1) . (u_n+1 - u_n).
With these the discrete balance closes to rounding for a linear body, so what is left over is a measure of the rest.

A group may take a step only `every` steps of the clock, so many times as long. What it presses on others then comes as one blow of all of
them (r-RESPA, Tuckerman et al. 1992): both bodies get the same impulse. Every group is told to move at every step; whether it does so
when it is not due is its own affair: nodes drift, and feel what others push them with (bodies/nodal/slow.py).
"""

from __future__ import annotations

from collections.abc import Sequence

from ..bodies.body import Group, Now
from ..couplings.coupling import Coupling


def step(groups: Sequence[Group], couplings: Sequence[Coupling], now: Now) -> None:
    """Advance all bodies by now.dt."""
    due = [group for group in groups if now.due(group)]
    for group in due:
        group.strain(now)
        group.events(now)
    for coupling in couplings:
        coupling.meet(now)
    for group in due:
        group.force(now)
    for coupling in couplings:
        coupling.add(now)
    for coupling in couplings:
        coupling.correct(now)
    for coupling in couplings:
        coupling.book(now)
    for group in groups:
        group.move(now)
