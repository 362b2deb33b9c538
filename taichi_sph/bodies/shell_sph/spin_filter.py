"""Filter on the spins of the directors (T 2.39, after Balsara), collocation form.

    T_i = -I_i omega_f (omega_i - sum_j Phi_ij omega_j)      Phi: order-0 MLS (Shepard) over the visible neighbours

The filter acts on rates: as printed, on the directors themselves, T 2.39 would erase bending within some tens of steps. The thesis's
eta = 0.1 belongs to a step of 0.15 D/c; as a rate, omega_f = eta c / (0.15 D), the filter does not depend on the step.
"""

from collections.abc import Sequence

from ...runtime import ti
from ..nodal.nodes import Nodes, body_of
from .damper import Damper
from .links import Links


class SpinFilter(Damper):
    """The term."""

    entry = "filter"

    def __init__(self, nodes: Nodes, pairs: Links, rates: Sequence[float], name: str = "spin_filter"):
        super().__init__(name, nodes)
        self.pairs = pairs
        self.rate = self.number("rate", rates, unit="1/s", doc="omega_f")

    def add(self, dt: float) -> None:
        """Add the couples; book what they take over dt."""
        _add(self, self.nodes.n, dt)


@ti.kernel
def _add(term: ti.template(), n: ti.i32, dt: float):
    for i in range(n):
        if term.nodes.fragment[i] == 0:
            omega = term.nodes.omega[i]
            rest = omega
            for k in range(term.pairs.start[i], term.pairs.start[i + 1]):
                rest -= term.pairs.coef[k] * term.nodes.omega[term.pairs.source[k]]
            torque = -term.nodes.inertia[i] * term.rate[body_of(term.nodes, i)] * rest
            director = term.nodes.N[i] + term.nodes.d[i]
            term.nodes.couple[i] += torque.cross(director)  # whose torque about the node is the wanted one
            term.work[i] -= dt * torque.dot(omega)
