"""Fluids at work."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ... import runtime
from ...errors import RunStopped, SceneError
from ...frame import NO_CELLS, BodyFrame
from ...geometry.surfaces import mesh_of
from ...numerics.reduce import fastest
from ...pool import Pool
from ...scene.schema import Scene
from ..body import Entries, Now, Rest, Span
from .body import FluidBody
from .fill import Filling, fill_fluid
from .port import FluidSurface
from .said import Fluid

FASTEST = 3.0  # speed of a fluid over that of sound in it
LOOK = 10  # steps between two looks at the speed of a fluid


def groups(scene: Scene, others: Sequence[Any], own: Sequence[Fluid]) -> list[FluidGroup]:
    """The groups of the scene's fluids: those that may meet, one through the other, are one. The pools of the second are called "fluid_2"
    and so on. others: the groups so far, shells among them."""
    found: list[list[Fluid]] = []
    for fluid in own:
        touched = [group for group in found if any(scene.met(fluid.name, one.name).meet for one in group)]
        found = [group for group in found if group not in touched] + [[one for group in touched for one in group] + [fluid]]
    place = {fluid.name: k for k, fluid in enumerate(own)}
    found = sorted((sorted(group, key=lambda one: place[one.name]) for group in found), key=lambda group: place[group[0].name])
    return [FluidGroup(scene, others, group, f"fluid_{k}" if k > 1 else "fluid") for k, group in enumerate(found, start=1)]


def _one_pool(scene: Scene, fluids: Sequence[Fluid], fillings: Sequence[Filling]) -> None:
    """SceneError where fluids that can meet cannot stand in one pool."""
    first, parted = fluids[0], "part them by meetings of all of them, or make them equal"
    for fluid, filling in zip(fluids[1:], fillings[1:]):
        two = f"fluids '{first.name}' and '{fluid.name}' can meet"
        if fluid.contact != first.contact:
            raise SceneError(f"{two}, but not with one `contact` each; {parted}")
        if [w for w in scene.walls if w.holds(fluid.name)] != [w for w in scene.walls if w.holds(first.name)]:
            raise SceneError(f"{two}, but not between walls that hold one and not the other; {parted}")
        if abs(filling.spacing / fillings[0].spacing - 1.0) > 0.03:
            raise SceneError(
                f"{two}, but their particles differ by more than 3 % in size ({fillings[0].spacing:.4g} m, {filling.spacing:.4g} m); choose"
                " sizes that are whole numbers of spacings"
            )
    for k, one in enumerate(fluids):
        for other in fluids[:k]:
            if not scene.met(one.name, other.name).meet:
                raise SceneError(f"meetings: '{other.name}' and '{one.name}' cannot pass through each other while both meet another fluid")


class FluidGroup(Rest):
    """body: the fluids; renumbered: whether their particles stand in another order than at the step before."""

    kind = "fluid"

    def __init__(self, scene: Scene, others: Sequence[Any], fluids: Sequence[Fluid], name: str):
        """name: of the pools."""
        self.scene, self.name = scene, name
        shells = [shell for group in others if group.kind == "shell" for shell in group.shells]
        meshes = {shell.of: shell.mesh if shell.split is None else shell.split.whole for shell in shells}
        meshes |= {body.name: mesh_of(body, scene) for body in scene.rigids if body.surface is not None}
        fillings = [fill_fluid(fluid, scene, meshes) for fluid in fluids]
        _one_pool(scene, fluids, fillings)
        walls = [wall for wall in scene.walls if wall.holds(fluids[0].name)]
        self.body = FluidBody(list(zip(fluids, fillings)), scene.gravity or (0.0, 0.0, 0.0), walls, name=name)
        self.bodies = tuple(self.body.spans)
        self.contact = fluids[0].contact
        self.every = fluids[0].every or 1
        self.renumbered = False
        self.pushed = False  # contact may push the particles

    @property
    def presses(self) -> bool:
        """Whether the fluid acts on other bodies by its pressure."""
        return self.contact is None

    def of(self, name: str) -> Span:
        """The fluid of that name."""
        return next(span for span in self.bodies if span.name == name)

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
        self.renumbered = False  # all have been told
        if not now.due(self):
            return
        self.body.kick_and_drift(*self._steps(now), self.pushed)

    def longest_step(self) -> dict[str, float]:
        return {"sound in the fluid": self.scene.numerics.time_step_safety * self.body.stable_dt() / self.every}

    def hastens(self, now: Now) -> bool:
        """Whether the fluid has become too fast for the step; looked at now and then, and always where a shock may make it stiffer."""
        if not (self.body.stiffens and now.due(self)) and now.step % LOOK:
            return False
        return self.scene.numerics.time_step_safety * self.body.stable_dt() < self.every * now.dt

    def given(self) -> float:
        return self.body.compressed

    def entries(self) -> Entries:
        found = self.body.energies()
        internal = {"elastic": found["elastic"], "fluid viscous": found["viscous"]}
        return Entries(found["kinetic"], found["external"], internal, {"diffused": found["diffused"], "lag": found["lag"]})

    def negligible(self, dt: float) -> float:
        """1/2 rho_0 c^2 s^2 over all particles, twice."""
        rounding = 1e-6 if self.scene.numerics.precision == "f32" else 1e-12
        p = self.body.p
        return sum(
            rounding**2 * float(mass) * float((1.0 / p.parts[p.of == b] ** 3).sum()) * fluid.water.sound**2
            for b, (mass, fluid) in enumerate(zip(p.masses, self.body.fluids))
        )

    def look(self, now: Now) -> None:
        """Speeds: a shock that would throw water at FASTEST c is far beyond any law of state here, and weakly compressible it is not."""
        fluid = self.body
        speed = fluid.fastest()
        if speed <= FASTEST * min(one.water.sound for one in fluid.fluids):
            return
        i, moves = fastest(fluid.p.v, fluid.p.x, fluid.p.n)
        number = int(runtime.get(fluid.p.id, fluid.p.n)[i])
        of = int(fluid.p.of[number])
        sound = fluid.fluids[of].water.sound
        if speed <= FASTEST * sound:
            return
        what = (
            f"fluid '{self.bodies[of].name}': particle {number - self.bodies[of].first} {moves} at t = {now.time:.6g} s,"
            f" beyond {FASTEST:g} times the sound speed {sound:g} m/s"
        )
        thrown, start = self.scene.thrown()
        if start > FASTEST * sound:
            raise RunStopped(
                f"{what}: {thrown} starts at {start:.4g} m/s, too fast for this law of state; raise water.sound or lower the speed"
            )
        pull = float(np.linalg.norm(fluid.gravity))
        fall = np.sqrt(2.0 * pull * float(np.ptp(fluid.points, axis=0).max()))
        if fall > FASTEST * sound:
            raise RunStopped(
                f"{what}: a fall through its own size under gravity, {pull:.4g} m/s2, gives {fall:.4g} m/s; raise water.sound or lower it"
            )
        raise RunStopped(
            f"{what}; the impact is likely too violent for this law of state, or sound was slowed too far: raise water.sound or alpha, or"
            " lower numerics.time_step_safety"
        )

    def frames(self) -> list[BodyFrame]:
        found = []
        for span in self.bodies:
            data = self.body.frame(span)
            points = data.pop("points")
            data["reference"] = self.body.points[span.first : span.first + span.n]
            data["diameter"] = self.body.p.own[span.first : span.first + span.n]
            data["outside"] = np.zeros(span.n, np.uint8)  # a gauge of leaks knows better
            found.append(BodyFrame(span.name, points, NO_CELLS, data, {}, kind="fluid"))
        return found

    def pools(self) -> list[Pool]:
        return self.body.pools()

    def surface(self) -> FluidSurface:
        return FluidSurface(self)
