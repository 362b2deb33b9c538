"""Shells at work: pools, internal forces, loads and stable step of a group, in the order of a step.

A kind of shell says what its internal forces are.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import runtime
from ...errors import RunStopped
from ...frame import BodyFrame
from ...numerics.reduce import BLOCK, Reducer, fastest
from ...pool import Pool
from ...scene.kept import StrainGauge
from ...scene.schema import Scene
from ..body import Clocked, Entries, InPlace, Now, Rest, Span
from ..nodal.loads import Loads
from ..nodal.motion import kick_and_drift
from ..nodal.slow import SlowNodes
from ..nodal.supports import UNITS
from ..within import COARSE, each_of
from .build import (
    Model,
    ShellBody,
    build,
    curve,
    initial_spin,
    initial_velocity,
    laws,
    masses,
    node_forces,
    node_moments,
    node_motions,
    pressed_cells,
    quarters,
)
from .finer_surface import CellPoints
from .gauge import Gauge
from .metal import thicknesses
from .parts import Part
from .parts_shown import at_most, none_of
from .port import ShellSurface
from .pressure import BOOK, Pressed, SurfacePressures
from .said import PARTICLES, Shell
from .stable_dt import StableStep
from .stress import stored_energy
from .surface import ShellPoints

if TYPE_CHECKING:
    from .instead.freedom import Stiffness


FASTEST = 0.3  # speed of a body at the start over that of sound in a shell: beyond, what it does to an elastic shell is its doing


class ShellGroup(Rest):
    """Shells of the same laws. shells: the bodies; mesh: theirs as one; nodes, cells, points, material: the pools (points: the stress
    points, which are the cells where each has one); internal, pressures, loads: what acts; sound (B,): the speed of sound in each body
    [m/s]."""

    kind = "shell"

    def __init__(self, scene: Scene, some: list[Part], suffix: str = ""):
        self.scene, self.suffix = scene, suffix
        self.now = Now()
        model = self.model = build(scene, some, suffix, self.per_cell(scene.numerics_of(some[0].said).formulation))
        self.shells, self.mesh = model.bodies, model.mesh
        self.nodes, self.cells, self.points, self.material = model.nodes, model.cells, model.points, model.material
        self.bodies: tuple[Span, ...] = tuple(body.nodes for body in self.shells)
        self.every = laws(scene, some[0].said)[-1]
        self.reducer = Reducer(max(self.nodes.n, self.points.n), f"reduce{suffix}")
        self.internal = self.form(model)
        areas = self.areas_of_nodes()
        mass, inertia = masses(self.shells, lambda of_cells: areas if of_cells is None else self.areas_of_nodes(of_cells))
        runtime.put(self.nodes.mass, mass)
        if inertia is not None:
            runtime.put(self.nodes.inertia, inertia)
        dim = self.nodes.dim
        self.loads = Loads(
            self.nodes,
            list(node_forces(scene, self.shells, areas, mass, dim)),
            list(node_motions(scene, self.shells, dim)),
            list(node_moments(scene, self.shells, areas)),
            f"loads{suffix}",
            self.every > 1,
        )
        self.slow = SlowNodes(self.nodes, self.loads, self.every, f"slow{suffix}") if self.every > 1 else None
        self.pressures = self._pressures()
        materials = [[sheet.material for sheet in body.made.sheets] for body in self.shells]
        self.sound = np.array([max(float(np.sqrt(m.young / m.density / (1 - m.poisson**2))) for m in of) for of in materials])
        self.stable: StableStep

    def share_loads(self, areas: np.ndarray) -> None:
        """Forces and moments, shared by other areas (N,) of the nodes [m2]."""
        mass = runtime.get(self.nodes.mass, self.nodes.n).astype(np.float64)
        forces = list(node_forces(self.scene, self.shells, areas, mass, self.nodes.dim))
        self.loads.share(forces, list(node_moments(self.scene, self.shells, areas)))

    def start(self) -> None:
        """Velocities and the stable step, once all bodies are there."""
        runtime.put(self.nodes.v, initial_velocity(self.scene, self.shells, self.nodes.dim))
        if self.nodes.bends and any(start.rotation is not None for start in self.scene.initial):
            runtime.put(self.nodes.omega, initial_spin(self.scene, self.shells))
        self.stable = StableStep(self, f"stable{self.suffix}")

    # --- what a kind of shell says for itself ---

    def per_cell(self, form: Any) -> int:
        """Stress points of a cell in that form."""
        return 1

    def form(self, model: Model) -> Any:
        """The internal forces: a pool with `strain`, `force`, `stored`, `lost`, `dissipated`, `pools` and `reach` [m], how far from a node
        its displacement makes forces."""
        raise NotImplementedError

    def pressed_by(self, pressed: Sequence[Pressed]) -> SurfacePressures:
        """The pressures on the group."""
        raise NotImplementedError

    def areas_of_nodes(self, of_cells: np.ndarray | None = None) -> np.ndarray:
        """(N,) area that each node owns [m2]: its mass, and its share in a NodalForce. of_cells (M,): what a cell has per area instead
        of 1."""
        return quarters(self.shells, of_cells)

    def stiffness(self) -> Stiffness | None:
        """The tangent of the form about any place; None where there is none."""
        return None

    @property
    def ruptures(self) -> int:
        """How often cells broke so far."""
        return 0

    def events_of(self) -> Sequence[Pool]:
        """What holds the history of ruptures."""
        return ()

    def calm(self, now: Now) -> None:
        """Adds the forces of what keeps the computation calm."""

    def calming(self) -> Sequence[Pool]:
        """The pools of those."""
        return ()

    # --- what all have ---

    def of(self, name: str) -> ShellBody:
        """The body of that name."""
        return next(body for body in self.shells if body.name == name)

    @property
    def stress_points(self) -> int:
        """How many there are."""
        return int((runtime.get(self.points.area, self.points.n) > 0).sum())

    @property
    def shell(self) -> Shell:
        """What was said of the only body."""
        (body,) = self.shells
        return body.said

    @property
    def spacing(self) -> float:
        """The smallest spacing of the bodies [m]."""
        return self.mesh.spacing

    def _pressures(self) -> SurfacePressures | None:
        pressed = [
            Pressed(pressed_cells(body, p.where), p.value, curve(self.scene, p.history), p.kind == "follower")
            for body in self.shells
            for p in self.scene.loads_of("pressures", body.of)
        ]
        pressed = [one for one in pressed if len(one.cells)]  # a part of a shell may have none of them
        return self.pressed_by(pressed) if pressed else None

    def strain(self, now: Now) -> None:
        self.now = now
        self.internal.strain(self.every * now.dt)

    def events(self, now: Now) -> None:
        """The work of pressures."""
        if self.pressures is not None:
            self.pressures.press(now.time, BOOK)

    def force(self, now: Now) -> None:
        self.internal.force()
        self.calm(now)
        if self.slow is None:
            self.loads.update(now.time)
        else:
            self.slow.strike(now.time, now.dt_before)

    def move(self, now: Now) -> None:
        """Every step of the clock moves the nodes; those that are not due feel only what others do to them."""
        kick_and_drift(self.nodes, self.loads, self.nodes.n, now.dt_before, now.dt, now.half_time)
        if self.slow is not None:
            self.slow.moved(now.dt, now.due(self))

    def longest_step(self) -> dict[str, float]:
        return {f"{self.stable.safety:g} of 2/omega_max": self.stable.dt / self.every}

    def hastens(self, now: Now) -> bool:
        return self.stable.watch(now)

    def held(self) -> np.ndarray:
        """(N,) bool: nodes whose whole velocity is prescribed."""
        if not self.loads.moves:
            return np.zeros(self.nodes.n, bool)
        group = runtime.get(self.nodes.fixed, self.nodes.n)
        whole = np.all(runtime.get(self.loads.mask, int(group.max())), axis=1)
        return (group > 0) & whole[np.maximum(group, 1) - 1]

    def wettables(self, name: str, spacing: float, meets: Callable[[str], bool]) -> list[ShellPoints]:
        """The points that water presses on: the nodes of the shells that are met, wherever they are, or points within the cells where those
        are coarser than the water. spacing [m]: that of the points of rigid surfaces."""
        if not self.nodes.bends:
            return []
        runs = [list(run) for met, run in groupby(self.shells, key=lambda body: meets(body.name)) if met]
        return [self._points(f"{name}_{k}" if k > 1 else name, run, spacing) for k, run in enumerate(runs, start=1)]

    def _points(self, name: str, run: list[Any], spacing: float) -> ShellPoints:
        widest = max(body.mesh.spacing for body in run)
        return CellPoints(name, self, run, each_of(widest, spacing)) if 0 < COARSE * spacing < widest else ShellPoints(name, self, run)

    def stored(self) -> float:
        """Elastic energy [J]: live cells and residuals."""
        used = max(1, -(-self.points.n // BLOCK))
        return stored_energy(self.reducer.partial, self.points, self.material, used) + self.internal.stored(self.reducer)

    def entries(self) -> Entries:
        total = self.reducer.total
        internal = {"elastic": self.stored()}
        internal["damage"] = total(self.points.lost, self.points.n) if self.material.damages else 0.0
        internal["damage"] += self.internal.lost(self.reducer)
        if self.material.yields:
            internal["plastic"] = total(self.points.dissipated, self.points.n) + self.internal.dissipated(self.reducer)
        numerical: dict[str, float] = {}
        if self.slow is not None:
            numerical["lag"] = total(self.slow.lag, self.nodes.n)
        external = total(self.loads.work, self.nodes.n) if self.loads.acts else 0.0
        return Entries(self.kinetic(), external + self.pressed(), internal, numerical)

    def kinetic(self) -> float:
        """1/2 m v_n-1/2 . v_n+1/2 [J]."""
        return self.reducer.total(self.nodes.kinetic, self.nodes.n)

    def pressed(self) -> float:
        """Work of the pressures [J]."""
        return 0.0 if self.pressures is None else self.pressures.done(self.reducer)

    def look(self, now: Now) -> None:
        """RunStopped where a node is faster than sound in its body."""
        if self.reducer.largest(self.nodes.v, self.nodes.n) <= self.sound.min():
            return
        speeds = np.linalg.norm(runtime.get(self.nodes.v, self.nodes.n).astype(np.float64), axis=1)
        for body, sound in zip(self.shells, self.sound):
            if not (speeds[body.nodes.rows] <= sound).all():
                i, moves = fastest(self.nodes.v, self.nodes.X, body.nodes.n, body.nodes.first)
                known = speeds[body.nodes.rows][np.isfinite(speeds[body.nodes.rows])]
                if len(known) < body.nodes.n and (known <= sound).any() and (known <= sound).all():  # nothing had grown before
                    raise RunStopped(
                        f"shell '{body.name}': node {i} {moves} at t = {now.time:.6g} s, while no other node is fast: a force, a load or a"
                        " place became no number there; look at the last frame before it"
                    )
                thrown, start = self.scene.thrown()
                if start > FASTEST * sound:
                    raise RunStopped(
                        f"shell '{body.name}': node {i} {moves} at t = {now.time:.6g} s: {thrown} starts at {start:.4g} m/s,"
                        f" {start / sound:.2g} of the speed of sound in the shell ({sound:.4g} m/s); a blow of that speed makes strains as"
                        " large, for which no law here is meant: lower the speed"
                    )
                raise RunStopped(
                    f"shell '{body.name}': node {i} {moves} at t = {now.time:.6g} s,"
                    f" beyond the sound speed {sound:.4g} m/s; the time step is likely too long or the load too"
                    " violent for this spacing: lower numerics.time_step_safety or the load"
                )

    def negligible(self, dt: float) -> float:
        """1/2 E strain^2 over all shells, twice."""
        rounding = 1e-6 if self.scene.numerics.precision == "f32" else 1e-12
        stiff = (max(sheet.material.young * sheet.thickness for sheet in body.made.sheets) for body in self.shells)
        return sum(rounding**2 * each * float(body.mesh.areas.sum()) for each, body in zip(stiff, self.shells))

    def frames(self) -> list[BodyFrame]:
        """The shells now: see BodyFrame for names and units."""
        nodes, cells = self.nodes.shows(), self.of_cells()
        nodes["velocity"] = self._in_space(nodes["velocity"])
        nodes["fragment"], cells["broken"] = nodes["fragment"].astype(np.uint8), cells["broken"].astype(np.uint8)
        n = self.nodes.n
        points = self.mesh.points + self._in_space(runtime.get(self.nodes.u, n))
        if self.nodes.bends:
            nodes["director"] = runtime.get(self.nodes.N, n) + runtime.get(self.nodes.d, n)
        found = []
        for body in self.shells:
            own = {name: values[body.cells.rows] for name, values in cells.items()}
            if (weights := body.weights) is not None:
                own["weight"] = weights.reshape(body.cells.n, -1).mean(axis=1)
            if body.split is not None and body.name == body.of:
                own["hidden"] = (own["weight"] < 1.0).astype(np.uint8)
            if self.material.yields:
                own["thickness"] = thicknesses(own["strain"], body.made.thickness)
            if not body.made.even:
                own["areal_mass"] = body.made.areal
            of_nodes = {"reference": body.mesh.points} | {name: values[body.nodes.rows] for name, values in nodes.items()}
            frame = BodyFrame(body.name, points[body.nodes.rows], body.mesh.cells, of_nodes, own)
            if body.split is not None and body.split.patch.grows:
                if not body.split.patch.there:
                    found.append(at_most(none_of(frame, body.of + PARTICLES), body.split, False))
                frame = at_most(frame, body.split, body.name == body.of)
            found.append(frame)
        return found

    def of_cells(self) -> dict[str, np.ndarray]:
        """(M, ...) what frames show of the cells, by the name there."""
        return self.cells.shows()

    def _in_space(self, vectors: np.ndarray) -> np.ndarray:
        """(N, 3) f64 of (N, dim)."""
        return np.pad(vectors.astype(np.float64), ((0, 0), (0, 3 - self.nodes.dim)))

    def probed(self, point: tuple[float, float, float], name: str | None = None) -> int:
        """Number in the group of the node nearest to a reference point [m], of the body of that name; None: of the first."""
        body = self.shells[0] if name is None else self.of(name)
        return body.nodes.first + int(np.argmin(np.linalg.norm(body.mesh.points - np.asarray(point), axis=1)))

    def probe(self, i: int) -> dict[str, float]:
        """Displacement [m] and velocity [m/s] of node i."""
        return {
            f"{letter}_{axis}": float(field[i][c]) if c < self.nodes.dim else 0.0
            for letter, field in (("u", self.nodes.u), ("v", self.nodes.v))
            for c, axis in enumerate("xyz")
        }

    def gauge(self, said: StrainGauge, name: str) -> Gauge:
        """A strain gauge on the body of that name."""
        return Gauge(self.points, self.of(name), said)

    track_units = UNITS

    def tracks(self, look: bool = True) -> dict[str, dict[str, float]]:
        """By the name of its history: force [N] and moment [N m] of each prescribed motion on its nodes, about the middle of them;
        "support_1" is the first motion of the scene."""
        if not self.loads.moves or self.scene.modes is not None or self.scene.limit is not None:
            return {}
        numbers = [k for body in self.shells for k, motion in enumerate(self.scene.motions, start=1) if motion.body == body.of]
        return dict(zip((f"support_{k}" for k in numbers), self.loads.supports.rows(1.0 / self.every)))

    def surface(self) -> ShellSurface | None:
        return ShellSurface(self) if self.nodes.bends else None

    def instead(self, world: Clocked, alike: Sequence[Any]) -> InPlace | None:
        from .instead import in_place

        return in_place(world, alike)

    def pools(self) -> list[Pool]:
        """All that has fields or history; what the internal forces renew follows from nodes and cells."""
        cells = [self.cells] if self.cells is self.points else [self.cells, self.points]
        parts = [self.nodes, *cells, self.material, *self.loads.pools(), *self.events_of(), self.stable]
        others = [part for part in (self.pressures, self.slow) if part is not None]
        return [*parts, *self.internal.pools(), *self.calming(), *others]
