"""Filter on the velocities of crack-edge nodes (T 2.3.6.5, after Balsara, T 2.39), collocation form.

    f_i = -m_i omega (v_i - sum_j Phi_ij v_j)        Phi: order-0 MLS (Shepard) over the visible neighbours

The thesis takes a share eta = 1 % of the difference in every step of 0.15 D/c. As a rate, omega = eta c / (0.15 D), the filter takes the
same per unit of time whatever the step. Only the nodes of broken cells are filtered.
"""

from collections.abc import Sequence

from ...runtime import ti
from ..nodal.nodes import Nodes, body_of
from ..shell.pool import Cells
from .damper import Damper
from .links import Links

THESIS_STEP = 0.15  # D/c, the step to which eta belongs (T 2.4: cstab 0.15)


class EdgeFilter(Damper):
    """The term."""

    entry = "filter"

    def __init__(self, nodes: Nodes, cells: Cells, pairs: Links, rates: Sequence[float], name: str = "filter"):
        super().__init__(name, nodes)
        self.cells, self.pairs = cells, pairs
        self.rate = self.number("rate", rates, unit="1/s", doc="omega")

    def add(self, dt: float) -> None:
        """Add the forces; book what they take over dt."""
        _add(self, self.nodes.n, dt)


@ti.kernel
def _add(term: ti.template(), n: ti.i32, dt: float):
    for i in range(n):
        on_edge = 0
        for m in range(term.cells.start_of_node[i], term.cells.start_of_node[i + 1]):
            on_edge = ti.max(on_edge, term.cells.broken[term.cells.of_node[m]])
        if on_edge == 1 and term.nodes.fragment[i] == 0:
            v = term.nodes.v[i]
            rest = v
            for k in range(term.pairs.start[i], term.pairs.start[i + 1]):
                rest -= term.pairs.coef[k] * term.nodes.v[term.pairs.source[k]]
            force = -term.nodes.mass[i] * term.rate[body_of(term.nodes, i)] * rest
            term.nodes.force[i] += force
            term.work[i] -= dt * force.dot(v)
