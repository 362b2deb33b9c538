"""Shells at work: pools, internal forces, loads, rupture and stable step of a group, in the order of a step."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from ... import runtime
from ...errors import RunStopped
from ...frame import BodyFrame
from ...geometry.cuts import cells_cut
from ...numerics.reduce import BLOCK, Reducer, fastest
from ...pool import Pool
from ...scene.schema import Scene
from ..body import Entries, Group, Now, Rest, Span
from ..nodal.loads import Loads
from ..nodal.motion import kick_and_drift
from .build import build, initial_velocity, node_forces, node_moments, node_motions, rise
from .collocation import Collocation
from .edge_filter import THESIS_STEP, EdgeFilter
from .galerkin import Galerkin
from .metal import thicknesses
from .pressure import BOOK, START, SurfacePressure
from .rupture import Rupture
from .spin_filter import SpinFilter
from .stable_dt import StableStep
from .stress import stored_energy
from .surface import ShellPoints
from .viscosity import PairViscosity


def groups(scene: Scene, others: Sequence[Group] = ()) -> list[ShellGroup]:
    """The groups of the scene's shells."""
    return [ShellGroup(scene)] if scene.shells else []


class ShellGroup(Rest):
    """nodes, cells, material: the pools; mesh: where they came from; internal, terms, pressures, loads: what acts."""

    kind = "shell"

    def __init__(self, scene: Scene):
        self.scene, self.shell = scene, scene.shells[0]
        self.now = Now()
        model = build(scene)
        self.mesh, self.nodes, self.cells, self.material = model.mesh, model.nodes, model.cells, model.material
        self.bodies = (Span(self.shell.name, 0, self.nodes.n),)
        self.spacing = self.mesh.spacing
        self.reducer = Reducer(max(self.nodes.n, self.cells.n))
        self.internal, self.terms = self._formulation()
        self.loads = Loads(
            self.nodes,
            list(node_forces(scene, self.mesh, self.nodes.dim)),
            list(node_motions(scene, self.mesh, self.nodes.dim)),
            list(node_moments(scene, self.mesh)),
        )
        self.pressures = [
            SurfacePressure(k, self.internal, self.cells, p.value, rise(scene, p.history), p.kind == "follower")
            for k, p in enumerate(scene.pressures)
        ]
        self.rupture = Rupture(self)
        none = np.zeros(0, np.int32)
        self.cut_cells = np.unique(np.concatenate([cells_cut(self.mesh, c.start, c.end) for c in self.shell.cuts] or [none]))
        material = self.shell.material
        self.sound = float(np.sqrt(material.young / material.density / (1 - material.poisson**2)))  # m/s
        self.stable = None

    def start(self) -> None:
        """Cuts, velocities and the stable step, once all bodies are there."""
        self.rupture.cut(self.cut_cells)
        runtime.put(self.nodes.v, initial_velocity(self.scene, self.mesh, self.nodes.dim))
        self.stable = StableStep(self)

    def _formulation(self):
        """The internal forces, and the further terms that their form needs."""
        settings = self.scene.numerics.formulation
        if settings.kind == "galerkin":
            return Galerkin(self.mesh, self.nodes, self.cells, self.material, settings), []
        internal = Collocation(self.mesh, self.nodes, self.cells, self.material, settings)
        material = self.shell.material
        sound = math.sqrt(material.young / material.density)
        terms = []
        rate = sound / (THESIS_STEP * self.spacing)
        viscous = settings.viscosity
        if viscous.alpha or viscous.beta or (viscous.gamma and self.nodes.bends):
            terms.append(
                PairViscosity(self.nodes, self.material, internal.pairs, internal.area, material.density, sound, settings.viscosity)
            )
        if settings.edge_filter and self.material.breaks:
            terms.append(EdgeFilter(self.nodes, self.cells, internal.pairs, settings.edge_filter * rate))
        if settings.spin_filter and self.nodes.bends:
            terms.append(SpinFilter(self.nodes, internal.pairs, settings.spin_filter * rate))
        return internal, terms

    def strain(self, now: Now) -> None:
        self.now = now
        self.internal.strain(now.dt)

    def events(self, now: Now) -> None:
        """Rupture; the work of pressures is booked around it."""
        ruptured = self.rupture.happen()
        for pressure in self.pressures:
            pressure.press(now.time, START if ruptured else BOOK)

    def force(self, now: Now) -> None:
        self.internal.force()
        for term in self.terms:
            term.add(now.dt)
        self.loads.update(now.time)

    def move(self, now: Now) -> None:
        kick_and_drift(self.nodes, self.loads, self.nodes.n, now.dt_before, now.dt, now.half_time)

    def longest_step(self) -> dict[str, float]:
        return {f"{self.stable.safety:g} of 2/omega_max": self.stable.dt}

    def hastens(self, now: Now) -> bool:
        return self.stable.watch(now)

    def held(self) -> np.ndarray:
        """(N,) bool: nodes whose whole velocity is prescribed."""
        if not self.loads.moves:
            return np.zeros(self.nodes.n, bool)
        group = runtime.get(self.nodes.fixed, self.nodes.n)
        whole = runtime.get(self.loads.mask, int(group.max())).all(axis=1)
        return (group > 0) & whole[np.maximum(group, 1) - 1]

    def wettable(self, name: str, spacing: float, meets: Callable[[str], bool]) -> ShellPoints | None:
        """The points that water presses on: the nodes, wherever they are."""
        return ShellPoints(name, self, meets) if self.nodes.bends else None

    def stored(self) -> float:
        """Elastic energy [J]: live cells and residuals."""
        used = max(1, -(-self.cells.n // BLOCK))
        return stored_energy(self.reducer.partial, self.cells, self.material, used) + self.internal.stored(self.reducer)

    def entries(self) -> Entries:
        total = self.reducer.total
        internal = {"elastic": self.stored()}
        internal["damage"] = total(self.cells.lost, self.cells.n) if self.material.damages else 0.0
        internal["damage"] += self.internal.lost(self.reducer)
        if self.material.yields:
            internal["plastic"] = total(self.cells.dissipated, self.cells.n) + self.internal.dissipated(self.reducer)
        internal["released"] = self.rupture.released
        numerical: dict[str, float] = {}
        for term in self.terms:
            numerical[term.entry] = numerical.get(term.entry, 0.0) + term.taken(self.reducer)
        external = total(self.loads.work, self.nodes.n) if self.loads.acts else 0.0
        return Entries(self.kinetic(), external + self.pressed(), internal, numerical)

    def kinetic(self) -> float:
        """1/2 m v_n-1/2 . v_n+1/2 [J]."""
        return self.reducer.total(self.nodes.kinetic, self.nodes.n)

    def pressed(self) -> float:
        """Work of the pressures [J]."""
        return sum(pressure.done(self.reducer) for pressure in self.pressures)

    def look(self, now: Now) -> None:
        if self.reducer.largest(self.nodes.v, self.nodes.n) > self.sound:
            i, moves = fastest(self.nodes.v, self.nodes.X, self.nodes.n)
            raise RunStopped(
                f"shell '{self.shell.name}': node {i} {moves} at t = {now.time:.6g} s,"
                f" beyond the sound speed {self.sound:.4g} m/s; the time step is likely too long or the load too"
                " violent for this spacing: lower numerics.time_step_safety or the load"
            )

    def negligible(self) -> float:
        rounding = 1e-6 if self.scene.numerics.precision == "f32" else 1e-12
        return rounding**2 * self.shell.material.young * self.shell.thickness * float(self.mesh.areas.sum())

    def status(self) -> dict[str, int]:
        return {"broken": self.rupture.broken - len(self.cut_cells), "fragments": self.rupture.fragments}

    def frames(self) -> list[BodyFrame]:
        """The shell now: see BodyFrame for names and units."""
        shown, cell_data = self.nodes.shows(), self.cells.shows()
        cell_data["broken"] = cell_data["broken"].astype(np.uint8)
        if self.material.yields:
            cell_data["thickness"] = thicknesses(cell_data["strain"], self.shell.thickness)
        point_data = {
            "reference": self.mesh.points,
            "velocity": self._in_space(shown["velocity"]),
            "fragment": shown["fragment"].astype(np.uint8),
        }
        n = self.nodes.n
        if self.nodes.bends:
            point_data["director"] = runtime.get(self.nodes.N, n) + runtime.get(self.nodes.d, n)
        points = self.mesh.points + self._in_space(runtime.get(self.nodes.u, n))
        return [BodyFrame(self.shell.name, points, self.mesh.cells, point_data, cell_data)]

    def _in_space(self, vectors: np.ndarray) -> np.ndarray:
        """(N, 3) f64 of (N, dim)."""
        return np.pad(vectors.astype(np.float64), ((0, 0), (0, 3 - self.nodes.dim)))

    def probed(self, point) -> int:
        """Number of the node nearest to a reference point [m]."""
        return int(np.argmin(np.linalg.norm(self.mesh.points - np.asarray(point), axis=1)))

    def probe(self, i: int) -> dict[str, float]:
        """Displacement [m] and velocity [m/s] of node i."""
        return {
            f"{letter}_{axis}": float(field[i][c]) if c < self.nodes.dim else 0.0
            for letter, field in (("u", self.nodes.u), ("v", self.nodes.v))
            for c, axis in enumerate("xyz")
        }

    def pools(self) -> list[Pool]:
        """All that has fields or history; what the links and the internal forces renew follows from nodes and cells."""
        parts = [self.nodes, self.cells, self.material, *self.loads.pools(), self.rupture, self.stable]
        return [*parts, *self.internal.pools(), *self.terms, *self.pressures]
