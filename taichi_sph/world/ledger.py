"""The energy ledger: where every joule is, at the time of the last force evaluation [J].

    stored     elastic (cells, and residuals of the stabilisation; compression of fluids)
    taken      damage, plastic, released (rupture), contact, viscous, filter
    given      external (forces and reactions), injected (initial velocities)

B(%) is the thesis's (T 2.110), 100 (E_kin + E_int - E_ext - E_inj) / |E_ext + E_inj|, with E_int the work of
the internal forces, those of contact between the bodies among them: stored + damage + released + contact. So B shows what
the method itself creates or loses. The closed residual also counts what viscosity and filters took; it should vanish.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..bodies.body import Entries, Group
from ..couplings.coupling import Coupling


def summed(groups: Sequence[Group], couplings: Sequence[Coupling]) -> Entries:
    """The entries of all groups and couplings together."""
    total = Entries(0.0, 0.0, {"elastic": 0.0, "damage": 0.0, "released": 0.0}, {"viscous": 0.0, "filter": 0.0})
    for entries in [*(group.entries() for group in groups), *(coupling.entries() for coupling in couplings)]:
        total.add(entries)
    return total


def balance(found: Entries, injected: float) -> dict[str, float]:
    """All entries, B_percent and closed_residual_percent. injected: energy at t = 0 [J]."""
    given = found.external + injected
    scale = abs(given) or max(found.kinetic + found.internal["elastic"], 1e-300)
    total_energy = found.kinetic + sum(found.internal.values()) - given
    closed = total_energy + sum(found.numerical.values())
    return {
        "kinetic": found.kinetic,
        **found.internal,
        **found.numerical,
        "external": found.external,
        "injected": injected,
        "B_percent": 100.0 * total_energy / scale,
        "closed_residual_percent": 100.0 * closed / scale,
    }
