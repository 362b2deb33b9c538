"""Nodes whose own step is several steps of the clock: r-RESPA (Tuckerman et al. 1992).

A group that is due every K steps evaluates its forces F (internal, external, of its dampers) at those steps alone. They then act as one
blow of K steps, which is a kick by K F; at the steps between, only what others do to the nodes kicks them. Every step of the clock moves
the nodes. Where nothing else acts the velocity is constant between two blows, and this is the leap-frog at K dt.

**Energy.** The kinetic energy 1/2 m v_j-1/2 . v_j+1/2 of the clock changes from step to step by half of each impulse times the velocity
before it and half times the velocity after it. So the ledger has to count the work of a blow,

    1/2 K dt F_n . v_n-1/2 + 1/2 K dt F_n . v_n+1/2,

the second half from the step after it on. Loads are booked so. What the cells store instead is the trapezoidal work
1/2 (F_n + F_n+K) . (u_n+K - u_n), which is the same until something pushes the nodes in between. The difference is booked here, as
"lag". The second half of the last blow is open until the cells are due again, and is booked as "lag" too. With this the ledger closes
at every step of the clock.
"""

from ... import runtime
from ...pool import Pool
from ...runtime import ti
from .loads import Loads
from .nodes import Nodes


class SlowNodes(Pool):
    """The books of nodes that are due every `every` steps."""

    kept = ("between",)

    def __init__(self, nodes: Nodes, loads: Loads, every: int, name: str = "slow"):
        super().__init__(name)
        self.nodes, self.loads, self.every = nodes, loads, every
        n, dim = nodes.n, nodes.dim
        self.between = False  # the blow has been struck
        self.force = self.field("force", n, dim, unit="N", doc="F, of the last blow", keeps=True)
        self.way = self.field("way", n, dim, unit="m", doc="displacement since the last blow", keeps=True)
        self.ahead = self.field("ahead", n, unit="J", doc="open half of the last blow", keeps=True)
        self.lag = self.field("lag", n, dtype="f64", unit="J", doc="what the cells gave beyond what the blows did", keeps=True)
        if nodes.bends:
            self.couple = self.field("couple", n, 3, unit="N m", doc="torque of this blow")
            self.ahead_spin = self.field("ahead_spin", n, unit="J", doc="open half of the last blow, of the torques", keeps=True)

    def strike(self, time: float, dt_before: float) -> None:
        """Forces and loads at `time` become a blow. dt_before: the step of the clock that led here [s]."""
        self.loads.set(time)
        if self.loads.moves:
            self.loads.supports.clear()
        for load in self.loads.given():
            _scale(load, self.nodes.n, float(self.every))
        _strike(self, self.nodes, self.nodes.n, float(self.every), dt_before)

    def moved(self, dt: float, due: bool) -> None:
        """After the kick and the drift of a step of the clock: books, and nothing acts until somebody pushes."""
        _moved(self, self.nodes, self.nodes.n, float(self.every), dt, int(due), int(self.between))
        self.between = not due
        self._rest()

    def renew(self) -> None:
        """After a restore nothing acts until the next blow."""
        self._rest()

    def _rest(self) -> None:
        runtime.fill(self.nodes.force, 0.0)
        if self.nodes.bends:
            runtime.fill(self.nodes.couple, 0.0)
        for load in self.loads.given():
            runtime.fill(load.total, 0.0)


@ti.kernel
def _scale(load: ti.template(), n: ti.i32, times: float):
    for i in range(n):
        load.total[i] *= times


@ti.kernel
def _strike(slow: ti.template(), nodes: ti.template(), n: ti.i32, times: float, dt_before: float):
    for i in range(n):
        force = nodes.force[i]
        gain = 0.5 * (slow.force[i] + force).dot(slow.way[i]) - 0.5 * times * dt_before * force.dot(nodes.v[i])
        slow.force[i] = force
        slow.way[i] *= 0.0
        nodes.force[i] = times * force
        if ti.static(nodes.bends):
            gain += slow.ahead_spin[i]
            slow.couple[i] = (nodes.N[i] + nodes.d[i]).cross(nodes.couple[i])
            nodes.couple[i] *= times
        slow.lag[i] += ti.cast(gain, ti.f64)


@ti.kernel
def _moved(slow: ti.template(), nodes: ti.template(), n: ti.i32, times: float, dt: float, due: ti.i32, between: ti.i32):
    for i in range(n):
        after = nodes.v[i]
        if due == 1:
            slow.ahead[i] = 0.5 * times * dt * slow.force[i].dot(after)
            if ti.static(nodes.bends):
                slow.ahead_spin[i] = 0.5 * times * dt * slow.couple[i].dot(nodes.omega[i])
        elif between == 0:
            lag = slow.ahead[i]
            if ti.static(nodes.bends):
                lag += slow.ahead_spin[i]
            slow.lag[i] -= ti.cast(lag, ti.f64)
        slow.way[i] += dt * after
