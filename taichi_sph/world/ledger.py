"""The energy ledger: where every joule is, at the time of the last force evaluation [J].

    stored     elastic (cells, and residuals of the stabilisation)
    taken      damage, released (rupture), contact, viscous, filter
    given      external (forces and reactions), injected (initial velocities)

B(%) is the thesis's (T 2.110), 100 (E_kin + E_int - E_ext - E_inj) / |E_ext + E_inj|, with E_int the work of
the internal forces, those of contact between the bodies among them: stored + damage + released + contact. So B shows what
the method itself creates or loses. The closed residual also counts what viscosity and filters took; it should vanish.
"""

import numpy as np

from .. import runtime
from ..bodies.shell_sph.stress import energy_density
from ..numerics.reduce import BLOCK, Reducer
from ..runtime import ti


class Ledger:
    """Reads the pools; keeps what has to be remembered: the injected energy."""

    def __init__(self, sim):
        self.sim = sim
        shell = max(sim.nodes.n, sim.cells.n) if sim.shell is not None else 1
        self.reducer = Reducer(max(shell, sim.fluid.p.n if sim.fluid is not None else 1))
        self.injected = 0.0  # J, kinetic energy at t = 0

    def stored(self) -> float:
        """Elastic energy [J]: live cells and residuals."""
        sim = self.sim
        used = max(1, -(-sim.cells.n // BLOCK))
        _elastic(self.reducer.partial, sim.cells, sim.material, sim.cells.n, used)
        return float(np.sum(runtime.get(self.reducer.partial, used))) + sim.internal.stored(self.reducer)

    def kinetic(self) -> float:
        """1/2 m v_n-1/2 . v_n+1/2 [J]."""
        total = self.reducer.total(self.sim.nodes.kinetic, self.sim.nodes.n) if self.sim.shell is not None else 0.0
        if self.sim.rigids is not None:
            total += float(runtime.get(self.sim.rigids.kinetic, self.sim.rigids.n).sum())
        if self.sim.fluid is not None:
            total += self.reducer.total(self.sim.fluid.p.kinetic, self.sim.fluid.p.n)
        return total

    def entries(self) -> dict[str, float]:
        """All entries, B_percent and closed_residual_percent."""
        sim = self.sim
        still = sim.relaxation is not None
        kinetic = 0.0 if still else self.kinetic()
        internal = {"elastic": 0.0, "damage": 0.0, "released": 0.0}  # stored, or taken by what the bodies are made of
        numerical = {"viscous": 0.0, "filter": 0.0}  # taken by what keeps the computation calm
        external = 0.0
        if sim.shell is not None:
            external += self._shell(internal, numerical, still)
        if sim.fluid is not None:
            external += self._fluid(internal, numerical)
        if sim.rigids is not None:
            external += float(runtime.get(sim.rigids.work, sim.rigids.n).sum())
        if sim.contact is not None:
            internal["contact"] = sim.contact.taken()
        given = external + self.injected
        scale = abs(given) or max(kinetic + internal["elastic"], 1e-300)
        total_energy = kinetic + sum(internal.values()) - given
        closed = total_energy + sum(numerical.values())
        return {
            "kinetic": kinetic,
            **internal,
            **numerical,
            "external": external,
            "injected": self.injected,
            "B_percent": 100.0 * total_energy / scale,
            "closed_residual_percent": 100.0 * closed / scale,
        }

    def _fluid(self, internal: dict[str, float], numerical: dict[str, float]) -> float:
        """Adds what the fluid keeps and takes; returns what gravity and walls gave [J]."""
        found = self.sim.fluid.energies()
        internal["elastic"] += found["elastic"]
        internal["fluid viscous"] = found["viscous"]
        numerical["diffused"] = found["diffused"]
        numerical["lag"] = found["lag"]
        return found["external"]

    def _shell(self, internal: dict[str, float], numerical: dict[str, float], still: bool) -> float:
        """Adds what the shell keeps and takes; returns what loads and reactions gave [J]."""
        sim, total = self.sim, self.reducer.total
        internal["elastic"] += self.stored()
        internal["damage"] += total(sim.cells.lost, sim.cells.n) if sim.material.damages else 0.0
        internal["damage"] += sim.internal.lost(self.reducer)
        if sim.material.yields:
            internal["plastic"] = total(sim.cells.dissipated, sim.cells.n) + sim.internal.dissipated(self.reducer)
        internal["released"] += sim.rupture.released
        for term in sim.terms:
            numerical[term.entry] += term.taken(self.reducer)
        if still:
            external = sim.relaxation.work
        else:
            external = total(sim.loads.work, sim.nodes.n) if sim.loads.acts else 0.0
        return external + sum(pressure.done(self.reducer) for pressure in sim.pressures)


@ti.kernel
def _elastic(partial: ti.template(), cells: ti.template(), material: ti.template(), n: ti.i32, blocks: ti.i32):
    for b in range(blocks):
        s = ti.cast(0.0, ti.f64)
        for c in range(b * BLOCK, ti.min(n, (b + 1) * BLOCK)):
            if cells.broken[c] == 0:
                s += ti.cast(energy_density(cells, material, c) * cells.area[c], ti.f64)
        partial[b] = s
