"""A running scene: the pools, the terms that the scene needs, and time."""

from __future__ import annotations

import math
import time as clock

import numpy as np

from .. import runtime
from ..errors import SceneError
from ..forces.collocation import Collocation
from ..forces.edge_filter import THESIS_STEP, EdgeFilter
from ..forces.galerkin import Galerkin
from ..forces.loads import Loads
from ..forces.pressure import SurfacePressure
from ..forces.spin_filter import SpinFilter
from ..forces.viscosity import PairViscosity
from ..model.build import build, initial_velocity, node_forces, node_moments, node_motions, rise
from ..model.cuts import cells_cut
from ..output.frame import BodyFrame, Frame
from ..scene.schema import Scene
from .ledger import Ledger
from .limit import LimitSearch
from .modes import ModeSearch
from .relax import Relaxation
from .rupture import Rupture
from .stable_dt import StableStep
from .step import step
from .watchdog import Watchdog


class Simulation:
    """Starts Taichi, builds the scene, and advances it.

    time [s], step, dt [s] and `dt_rule` (what sets it), nodes and stress_points counts, bytes of fields,
    compile_seconds until the first step could run.
    """

    def __init__(self, scene: Scene, arch: str = "cpu", threads: int | None = None):
        began = clock.perf_counter()
        runtime.start(arch, scene.numerics.precision, threads)
        self.scene = scene
        self.shell = scene.shells[0]
        model = build(scene)
        self.mesh, self.nodes, self.cells, self.material = model.mesh, model.nodes, model.cells, model.material
        self.spacing = self.mesh.spacing
        self._probed = [
            (p, int(np.argmin(np.linalg.norm(self.mesh.points - np.asarray(p.point), axis=1)))) for p in scene.output.probes
        ]
        self.time, self.step, self.dt, self._dt_before = 0.0, 0, 0.0, 0.0
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
        self.ledger = Ledger(self)
        self.rupture = Rupture(self)
        self.watchdog = Watchdog(self)
        self.cut_cells = np.unique(
            np.concatenate([cells_cut(self.mesh, c.start, c.end) for c in self.shell.cuts] or [np.zeros(0, np.int32)])
        )
        self.rupture.cut(self.cut_cells)
        runtime.put(self.nodes.v, initial_velocity(scene, self.mesh, self.nodes.dim))
        self.stable = StableStep(self)
        self._fit_dt()
        self._dt_before = 0.0  # v_0 is given at t = 0: the first kick is half a step
        self.relaxation = None
        if scene.static is not None:
            self.relaxation = Relaxation(self, scene.static.residual, scene.static.max_steps)
        elif scene.modes is not None:
            self.relaxation = ModeSearch(self, scene.modes.count)
        elif scene.limit is not None:
            self.relaxation = LimitSearch(self, scene.limit.steps, scene.limit.resolution)
        if self.relaxation is not None:
            self.dt = scene.duration / scene.increments
        self.internal.strain(0.0)  # so that the first step finds its kernels ready
        runtime.ti.sync()
        self.compile_seconds = clock.perf_counter() - began

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
                PairViscosity(
                    self.nodes, self.material, internal.pairs, internal.area, material.density, sound, settings.viscosity
                )
            )
        if settings.edge_filter and self.material.breaks:
            terms.append(EdgeFilter(self.nodes, self.cells, internal.pairs, settings.edge_filter * rate))
        if settings.spin_filter and self.nodes.bends:
            terms.append(SpinFilter(self.nodes, internal.pairs, settings.spin_filter * rate))
        return internal, terms

    def _fit_dt(self) -> None:
        """The stable step, shortened so that a whole number of steps ends the run."""
        left = self.scene.duration - self.time
        self.dt = left / max(1, math.ceil(left / self.stable.dt * (1 - 1e-12))) if left > 0 else self.stable.dt

    @property
    def dt_rule(self) -> str:
        """What rules dt, in words."""
        if self.relaxation is not None:
            return self.relaxation.rule
        return f"{self.stable.safety:g} of 2/omega_max"

    @property
    def n_nodes(self) -> int:
        return self.nodes.n

    @property
    def stress_points(self) -> int:
        return self.cells.n

    @property
    def bytes(self) -> int:
        return runtime.current().bytes

    @property
    def steps_left(self) -> int:
        return max(0, round((self.scene.duration - self.time) / self.dt))

    def advance(self, steps: int) -> None:
        """That many steps; RunStopped when the watchdog sees nonsense at the end of them.

        Of a static scene: that many load increments, each brought to equilibrium.
        """
        if self.relaxation is not None:
            for _ in range(steps):
                self.time += self.dt
                self.relaxation.settle(self.time)
            return
        for _ in range(steps):
            step(self, self._dt_before, self.dt)
            if self.step == 0:
                # the kinetic energy that the scheme conserves, 1/2 m v_-1/2 . v_+1/2: for a step load it starts
                # below 1/2 m v_0^2 by 1/8 m (dt a_0)^2 and stays there
                self.ledger.injected = self.ledger.kinetic()
            self._dt_before = self.dt
            self.time += self.dt
            self.step += 1
            if self.stable.watch():
                self._fit_dt()
        self.watchdog.look(self.energies())

    def advance_to(self, time: float) -> None:
        """Whole steps until `time` is reached, but for the rounding of their sum, or passed."""
        steps = math.ceil((time - self.time) / self.dt - 0.5e-6)
        if steps > 0:
            self.advance(steps)

    def energies(self) -> dict[str, float]:
        """The ledger [J] at the time of the last force evaluation, `time` [s] among them."""
        return {"time": self.time - self._dt_before, **self.ledger.entries()}

    def status(self) -> dict[str, int]:
        """Small numbers for the progress line."""
        if self.relaxation is not None:
            return self.relaxation.status()
        return {"broken": self.rupture.broken - len(self.cut_cells), "fragments": self.rupture.fragments}

    @property
    def status_units(self) -> dict[str, str]:
        """Units of the entries of `status` that have one."""
        return getattr(self.relaxation, "units", {})

    def probes(self) -> dict[str, dict[str, float]]:
        """Displacement [m] and velocity [m/s] at the probes of the scene."""
        return {
            probe.name: {
                f"{letter}_{axis}": float(field[i][c]) if c < self.nodes.dim else 0.0
                for letter, field in (("u", self.nodes.u), ("v", self.nodes.v))
                for c, axis in enumerate("xyz")
            }
            for probe, i in self._probed
        }

    def frame(self) -> Frame:
        """The shell now: see BodyFrame for names and units."""
        n, m = self.nodes.n, self.cells.n
        dim = self.nodes.dim

        def three(values):
            return np.pad(values.astype(np.float64), ((0, 0), (0, 3 - dim)))

        cell_data = {
            "damage": runtime.get(self.cells.delayed, m).astype(np.float64),
            "broken": runtime.get(self.cells.broken, m).astype(np.uint8),
            "rupture_time": runtime.get(self.cells.rupture_time, m),
            "strain": runtime.get(self.cells.strain, m).astype(np.float64),
        }
        point_data = {
            "reference": self.mesh.points,
            "velocity": three(runtime.get(self.nodes.v, n)),
            "fragment": runtime.get(self.nodes.fragment, n).astype(np.uint8),
        }
        if self.nodes.bends:
            point_data["director"] = runtime.get(self.nodes.N, n) + runtime.get(self.nodes.d, n)
        points = self.mesh.points + three(runtime.get(self.nodes.u, n))
        body = BodyFrame(self.shell.name, points, self.mesh.cells, point_data, cell_data)
        return Frame(self.time, self.step, (body,))

    def _history(self) -> dict[str, object]:
        """Every field that is history, by name, with its length."""
        nodes, cells = self.nodes, self.cells
        fields = {
            "nodes.u": (nodes.u, nodes.n),
            "nodes.v": (nodes.v, nodes.n),
            "nodes.fragment": (nodes.fragment, nodes.n),
            "nodes.kinetic": (nodes.kinetic, nodes.n),
            "cells.broken": (cells.broken, cells.n),
            "cells.rupture_time": (cells.rupture_time, cells.n),
            "cells.damage": (cells.damage, cells.n),
            "cells.delayed": (cells.delayed, cells.n),
            "cells.strain": (cells.strain, cells.n),
            "cells.lost": (cells.lost, cells.n),
        }
        if nodes.bends:
            fields |= {"nodes.d": (nodes.d, nodes.n), "nodes.omega": (nodes.omega, nodes.n)}
        if nodes.bends and (self.loads.moves or self.loads.twists):
            fields |= {"loads.ahead_spin": (self.loads.ahead_spin, nodes.n)}
        if self.loads.acts:
            fields |= {"loads.work": (self.loads.work, nodes.n), "loads.ahead": (self.loads.ahead, nodes.n)}
        return fields

    @property
    def _parts(self) -> list:
        """What keeps history of its own, beside the internal forces."""
        return [*self.terms, *self.pressures, *([self.relaxation] if self.relaxation is not None else [])]

    def state(self) -> dict[str, np.ndarray]:
        """All that is history, for a checkpoint."""
        return {
            "time": np.array([self.time, self.dt, self._dt_before, self.ledger.injected]),
            "step": np.array(self.step),
            **{name: runtime.get(field, n) for name, (field, n) in self._history().items()},
            **self.rupture.state(),
            **self.stable.state(),
            **self.internal.state(),
            **{name: value for part in self._parts for name, value in part.state().items()},
        }

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Continue exactly from `state()`."""
        mine = self.state()
        for name, value in mine.items():
            if name not in state:
                raise SceneError(f"checkpoint: '{name}' is missing; it was written by another version or scene")
            if np.shape(state[name]) != value.shape:
                raise SceneError(
                    f"checkpoint: '{name}' has shape {np.shape(state[name])}, this scene needs {value.shape};"
                    " it belongs to another scene or quality"
                )
        for name, (field, _) in self._history().items():
            runtime.put(field, np.asarray(state[name]))
        self.time, self.dt, self._dt_before, self.ledger.injected = (float(x) for x in state["time"])
        self.step = int(state["step"])
        self.rupture.restore(state)
        self.stable.restore(state)
        self.internal.restore(state)
        for part in self._parts:
            part.restore(state)
