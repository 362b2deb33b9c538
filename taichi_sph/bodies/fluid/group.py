"""Fluids at work."""

from __future__ import annotations

import numpy as np

from ... import runtime
from ...errors import RunStopped
from ...frame import NO_CELLS, BodyFrame
from ...numerics.reduce import fastest
from ...pool import Pool
from ...scene.schema import Scene
from ..body import Entries, Now, Rest, Span
from .body import FluidBody
from .fill import fill_fluid
from .port import FluidSurface

FASTEST = 3.0  # speed of a fluid over that of sound in it
LOOK = 10  # steps between two looks at the speed of a fluid


def groups(scene: Scene, others) -> list[FluidGroup]:
    """The groups of the scene's fluids. others: those that a fluid can wet."""
    return [FluidGroup(scene, others)] if scene.fluids else []


class FluidGroup(Rest):
    """body: the fluid; renumbered: whether its particles stand in another order than at the step before."""

    kind = "fluid"
    name = "fluid"  # of its pools

    def __init__(self, scene: Scene, others):
        self.scene, fluid = scene, scene.fluids[0]
        shell = next((g for g in others if g.kind == "shell"), None)
        filling = fill_fluid(fluid, scene, shell.mesh if shell is not None else None)
        gravity = scene.gravity or (0.0, 0.0, 0.0)
        self.body = FluidBody(fluid, filling.points, filling.spacing, filling.mass, gravity, scene.walls)
        self.bodies = (Span(fluid.name, 0, self.body.p.n),)
        self.every = fluid.every or 1 if scene.shells else 1
        self.renumbered = False
        self.pushed = False  # contact may push the particles
        self.outside = np.zeros(self.body.p.n, bool)  # of its tank, by number at the start: a gauge writes it

    @property
    def presses(self) -> bool:
        """Whether the fluid acts on other bodies by its pressure."""
        return self.body.fluid.contact is None

    def start(self) -> None:
        self.body.start()

    def _steps(self, now: Now) -> tuple[float, float]:
        """The fluid's own steps, before and to come [s]."""
        return self.body.dt, self.every * now.dt

    def events(self, now: Now) -> None:
        self.renumbered = self.body.follow(self.body.dt)

    def force(self, now: Now) -> None:
        self.body.rates(*self._steps(now))

    def move(self, now: Now) -> None:
        if not now.due(self):
            return
        self.body.kick_and_drift(*self._steps(now), self.pushed)

    def longest_step(self) -> dict[str, float]:
        return {"sound in the fluid": self.scene.numerics.time_step_safety * self.body.stable_dt() / self.every}

    def hastens(self, now: Now) -> bool:
        """Whether the fluid has become too fast for the step; looked at now and then."""
        if now.step % LOOK:
            return False
        return self.scene.numerics.time_step_safety * self.body.stable_dt() < self.every * now.dt

    def given(self) -> float:
        return self.body.compressed

    def entries(self) -> Entries:
        found = self.body.energies()
        internal = {"elastic": found["elastic"], "fluid viscous": found["viscous"]}
        return Entries(found["kinetic"], found["external"], internal, {"diffused": found["diffused"], "lag": found["lag"]})

    def look(self, now: Now) -> None:
        """Speeds: a shock that would throw water at FASTEST c is far beyond any law of state here, and weakly compressible it is not."""
        fluid = self.body
        speed, limit = fluid.fastest(), FASTEST * fluid.water.sound
        if speed <= limit:
            return
        i, moves = fastest(fluid.p.v, fluid.p.x, fluid.p.n)
        raise RunStopped(
            f"fluid '{self.bodies[0].name}': particle {runtime.get(fluid.p.id, fluid.p.n)[i]} {moves} at t = {now.time:.6g} s,"
            f" beyond {FASTEST:g} times the sound speed {fluid.water.sound:g} m/s; the impact is likely too violent for this law of"
            " state, or sound was slowed too far: raise water.sound or alpha, or lower numerics.time_step_safety"
        )

    def frames(self) -> list[BodyFrame]:
        data = self.body.frame()
        points = data.pop("points")
        n = len(points)
        data |= {"reference": self.body.points, "diameter": np.full(n, self.body.p.spacing), "outside": self.outside.astype(np.uint8)}
        return [BodyFrame(self.bodies[0].name, points, NO_CELLS, data, {}, kind="fluid")]

    def pools(self) -> list[Pool]:
        return self.body.pools()

    def surface(self) -> FluidSurface:
        return FluidSurface(self)
