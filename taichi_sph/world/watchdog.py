"""No silent nonsense: stop with one sentence that names body, node, place, time, field and likely cause."""

import numpy as np

from .. import runtime
from ..errors import RunStopped

FASTEST = 3.0  # speed of a fluid over that of sound in it


class Watchdog:
    """Looks at the velocities and at the energy balance on sampled steps."""

    def __init__(self, sim):
        self.sim = sim
        self.nothing = 1e-12  # J
        if sim.shell is None:
            return
        material = sim.shell.material
        # energy of a strain of the size of rounding: where nothing has been given yet, so much is nothing
        rounding = 1e-6 if sim.scene.numerics.precision == "f32" else 1e-12
        volume = sim.shell.thickness * float(sim.mesh.areas.sum())
        self.nothing = rounding**2 * material.young * volume
        self.sound = float(np.sqrt(material.young / material.density / (1 - material.poisson**2)))

    def look(self, entries: dict[str, float]) -> None:
        """Raise RunStopped when something cannot be true any more."""
        sim = self.sim
        if sim.rigids is not None:
            self._look_at_rigids()
        if sim.fluid is not None:
            self._look_at_fluid()
        if sim.shell is not None:
            self._look_at_shell(entries)
        # where hardly anything was given yet, a residual in percent says nothing
        enough = abs(entries["kinetic"]) + abs(entries["elastic"]) >= self.nothing
        residual = entries["closed_residual_percent"]
        if enough and (not np.isfinite(residual) or residual > 50.0):
            names = [b.name for b in (*sim.scene.shells, *sim.scene.rigids, *sim.scene.fluids)]
            raise RunStopped(
                f"'{', '.join(names)}': energy appears from nowhere ({residual:.3g} % of what was given) at t = {sim.time:.6g} s; "
                "likely an unstable step: lower numerics.time_step_safety"
            )

    def _look_at_shell(self, entries: dict[str, float]) -> None:
        sim, nodes = self.sim, self.sim.nodes
        if sim.ledger.reducer.largest(nodes.v, nodes.n) > self.sound:
            i, moves = _fastest(nodes.v, nodes.X, nodes.n)
            raise RunStopped(
                f"shell '{sim.shell.name}': node {i} {moves} at t = {sim.time:.6g} s,"
                f" beyond the sound speed {self.sound:.4g} m/s; the time step is likely too long or the load too"
                " violent for this spacing: lower numerics.time_step_safety or the load"
            )

    def _look_at_fluid(self) -> None:
        """Speeds: a shock that would throw water at FASTEST c is far beyond any law of state here, and weakly compressible it is not."""
        sim, fluid = self.sim, self.sim.fluid
        speed, limit = fluid.fastest(), FASTEST * fluid.water.sound
        if speed <= limit:
            return
        i, moves = _fastest(fluid.p.v, fluid.p.x, fluid.p.n)
        raise RunStopped(
            f"fluid '{fluid.name}': particle {runtime.get(fluid.p.id, fluid.p.n)[i]} {moves} at t = {sim.time:.6g} s,"
            f" beyond {FASTEST:g} times the sound speed {fluid.water.sound:g} m/s; the impact is likely too violent for this law of"
            " state, or sound was slowed too far: raise water.sound or alpha, or lower numerics.time_step_safety"
        )

    def _look_at_rigids(self) -> None:
        sim = self.sim
        x = runtime.get(sim.rigids.x, sim.rigids.n)
        for r in np.flatnonzero(~np.isfinite(x).all(axis=1)):
            raise RunStopped(
                f"rigid '{sim.rigids.names[r]}': its place is no number any more at t = {sim.time:.6g} s; likely the contact "
                "found no solution: look at the last frame"
            )


def _fastest(velocities, places, n: int) -> tuple[int, str]:
    """The number of the fastest of n points (of the first that is no number), and where and how fast it moves."""
    v = np.linalg.norm(runtime.get(velocities, n).astype(float), axis=1)
    i = int(np.argmax(np.where(np.isfinite(v), v, np.inf)))
    place = ", ".join(f"{1e3 * x:.4g}" for x in runtime.get(places, n)[i])
    return i, f"at ({place}) mm moves at {v[i]:.3g} m/s"
