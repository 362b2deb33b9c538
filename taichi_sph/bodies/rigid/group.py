"""Rigid bodies at work."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ... import runtime
from ...errors import RunStopped
from ...frame import NO_CELLS, BodyFrame
from ...pool import Pool
from ...scene.schema import Scene
from ..body import Entries, Group, Now, Rest, Span, Tips
from .pool import RigidBodies, move, rest, spins
from .port import RigidSurface
from .said import Rigid
from .solid import solid_of
from .surface import RigidPoints


def groups(scene: Scene, others: Sequence[Group], own: Sequence[Rigid]) -> list[RigidGroup]:
    """All rigid bodies of the scene are one group."""
    return [RigidGroup(scene)] if own else []


class RigidGroup(Rest):
    """rigids: the pool."""

    kind = "rigid"

    def __init__(self, scene: Scene):
        self.scene = scene
        self.solids = [solid_of(body, scene) for body in scene.rigids]
        self.rigids = RigidBodies(self.solids)
        self.bodies = tuple(Span(name, r, 1) for r, name in enumerate(self.rigids.names))
        if scene.gravity is not None:
            mass = np.array([body.mass for body in self.solids])
            runtime.put(self.rigids.weight, mass[:, None] * np.asarray(scene.gravity))

    @property
    def n_nodes(self) -> int:
        return 0

    def force(self, now: Now) -> None:
        rest(self.rigids, self.rigids.n)
        self.rigids.lead(now.time + 0.5 * now.dt)

    def move(self, now: Now) -> None:
        move(self.rigids, self.rigids.n, now.dt_before, now.dt)

    def alone(self) -> dict[str, float]:
        """No point moves by more than a twentieth of the smallest pinball."""
        radius = min(body.radii.min() for body in self.solids)
        gravity = float(np.linalg.norm(self.scene.gravity or (0.0, 0.0, 0.0)))
        speed = 0.0
        for solid in self.solids:
            body, reach = solid.said, solid.reach
            going = 1.0 if body.driven is None else body.driven.fastest
            way = body if body.driven is None else body.driven
            speed = max(speed, going * float(np.linalg.norm(way.velocity) + reach * np.linalg.norm(way.spin)))
        longest = min(0.05 * radius / (speed + gravity * self.scene.duration + 1e-300), self.scene.duration / 100)
        return {"the smallest pinball": longest}

    def entries(self) -> Entries:
        kinetic, work = (float(runtime.get(field, self.rigids.n).sum()) for field in (self.rigids.kinetic, self.rigids.work))
        return Entries(kinetic, work)

    def negligible(self, dt: float) -> float:
        """1/2 m v^2, with v a millionth of a millionth of the way from the origin in a step: places are no finer."""
        far = [float((np.abs(body.places).max(axis=1) + body.radii).max()) for body in self.solids]
        return sum(0.5 * body.mass * (1e-12 * way / dt) ** 2 for body, way in zip(self.solids, far))

    def look(self, now: Now) -> None:
        x = runtime.get(self.rigids.x, self.rigids.n)
        for r in np.flatnonzero(~np.isfinite(x).all(axis=1)):
            raise RunStopped(
                f"rigid '{self.rigids.names[r]}': its place is no number any more at t = {now.time:.6g} s; likely the contact "
                "found no solution: look at the last frame"
            )

    def frames(self) -> list[BodyFrame]:
        rigids = self.rigids
        x, radius = rigids.ball_places(), rigids.ball_radius
        centre, v, omega = runtime.get(rigids.x, rigids.n), runtime.get(rigids.v, rigids.n), spins(rigids)
        frames = []
        for r, (name, mesh) in enumerate(zip(rigids.names, (solid.mesh for solid in self.solids))):
            if mesh is not None:
                now = rigids.places(np.full(len(mesh.points), r), mesh.points - self.solids[r].centre)
                data = {"reference": mesh.points, "velocity": v[r] + np.cross(omega[r], now - centre[r])}
                frames.append(BodyFrame(name, now, mesh.cells, data, {}, kind="rigid"))
                continue
            own = np.flatnonzero(rigids.ball_body == r)
            data = {
                "reference": rigids.ball_reference[own],
                "velocity": v[r] + np.cross(omega[r], x[own] - centre[r]),
                "radius": radius[own],
            }
            frames.append(BodyFrame(name, x[own], NO_CELLS, data, {}, kind="rigid"))
        return frames

    track_units = dict.fromkeys("xyz", "m") | dict.fromkeys(("vx", "vy", "vz"), "m/s") | dict.fromkeys(("fx", "fy", "fz", "f_max"), "N")

    def tracks(self, look: bool = True) -> dict[str, dict[str, float]]:
        """By the name of its history: place [m], velocity [m/s] and force [N] (water, contact) of each body, now and the largest since
        the last look."""
        fields = {"": self.rigids.x, "v": self.rigids.v, "f": self.rigids.felt}
        values = {k: runtime.get(field, self.rigids.n) for k, field in fields.items()}
        hardest = self.rigids.hardest() if look else np.zeros(self.rigids.n)
        found = {}
        for r, name in enumerate(self.rigids.names):
            row = {f"{k}{axis}": float(values[k][r][c]) for k in fields for c, axis in enumerate("xyz")}
            found[f"rigid_{name}"] = row | {"f_max": float(hardest[r])}
        return found

    def wettables(self, name: str, spacing: float, meets: Callable[[str], bool]) -> list[RigidPoints]:
        """The points that water presses on."""
        points = RigidPoints(name, self, self.solids, spacing, meets)
        return [points] if points.n else []

    def tips(self, meets: Callable[[str], bool]) -> Tips:
        """The pinballs. One that turns is as fast as the farthest point of it."""
        rigids = self.rigids
        own = np.array([meets(name) for name in rigids.names])[rigids.ball_body]
        of = rigids.ball_body[own]
        turning = np.linalg.norm(spins(rigids), axis=1) * [solid.reach for solid in self.solids]
        return Tips(rigids.ball_places()[own], rigids.ball_radius[own], runtime.get(rigids.v, rigids.n).astype(np.float64)[of], turning[of])

    def surface(self) -> RigidSurface:
        return RigidSurface(self)

    def pools(self) -> list[Pool]:
        return [self.rigids]
