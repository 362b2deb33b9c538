"""A running scene: the pools, the terms that the scene needs, and time."""

from __future__ import annotations

import math
import time as clock

import numpy as np

from .. import runtime
from ..bodies.fluid.body import FluidBody
from ..bodies.fluid.fill import fill_fluid
from ..bodies.nodal.loads import Loads
from ..bodies.rigid.pool import RigidBodies, place, spins
from ..bodies.shell_sph.build import build, initial_velocity, node_forces, node_moments, node_motions, rise
from ..bodies.shell_sph.collocation import Collocation
from ..bodies.shell_sph.edge_filter import THESIS_STEP, EdgeFilter
from ..bodies.shell_sph.galerkin import Galerkin
from ..bodies.shell_sph.metal import thicknesses
from ..bodies.shell_sph.pressure import SurfacePressure
from ..bodies.shell_sph.rupture import Rupture
from ..bodies.shell_sph.spin_filter import SpinFilter
from ..bodies.shell_sph.stable_dt import StableStep
from ..bodies.shell_sph.viscosity import PairViscosity
from ..couplings.contact.bodies import Bodies
from ..couplings.contact.multipliers import Contact
from ..couplings.wetted.wetted import Wettable
from ..errors import SceneError
from ..frame import BodyFrame, Frame
from ..geometry.cuts import cells_cut
from ..observers.leak import LeakGauge
from ..scene import PinballContact, Scene
from .instead.limit import LimitSearch
from .instead.modes import ModeSearch
from .instead.statics import Relaxation
from .ledger import Ledger
from .step import step
from .watchdog import Watchdog

LOOK = 10  # steps between two looks at the speed of a fluid


class World:
    """Starts Taichi, builds the scene, and advances it.

    time [s], step, dt [s] and `dt_rule` (what sets it), nodes and stress_points counts, bytes of fields,
    compile_seconds until the first step could run.
    """

    def __init__(self, scene: Scene, arch: str = "cpu", threads: int | None = None):
        began = clock.perf_counter()
        runtime.start(arch, scene.numerics.precision, threads)
        self.scene = scene
        self.shell = scene.shells[0] if scene.shells else None
        self.time, self.step, self.dt, self._dt_before = 0.0, 0, 0.0, 0.0
        self.relaxation = None
        self.stepping = 0.0  # s of wall clock in steps
        self.spacing = scene.numerics.spacing
        self.nodes = self.cells = self.mesh = self.material = self.internal = self.loads = self.rupture = self.stable = None
        self.terms, self.pressures, self.cut_cells = [], [], np.zeros(0, np.int32)
        if self.shell is not None:
            self._make_shell()
        self.rigids = RigidBodies(scene.rigids) if scene.rigids else None
        if self.rigids is not None and scene.gravity is not None:
            mass = np.array([body.mass for body in scene.rigids])
            runtime.put(self.rigids.weight, mass[:, None] * np.asarray(scene.gravity))
        self.fluid = self._fluid() if scene.fluids else None
        tank = getattr(scene.fluids[0].fill, "shell", None) if scene.fluids else None
        self.leak = LeakGauge(self) if tank is not None else None
        meets_itself = self.shell is not None and bool(self.shell.self_contact)
        meets = self.rigids is not None or (self.fluid is not None and self.shell is not None) or meets_itself
        self.contact = self._contact(meets_itself) if meets else None
        self.every = scene.fluids[0].every or 1 if self.fluid is not None and self.shell is not None else 1
        self.refit = False  # dt is too long now; it changes when the fluid takes its next step
        self.ledger = Ledger(self)
        self.watchdog = Watchdog(self)
        if self.shell is not None:
            self.rupture.cut(self.cut_cells)
            runtime.put(self.nodes.v, initial_velocity(scene, self.mesh, self.nodes.dim))
            self.stable = StableStep(self)
        if self.contact is not None:
            self.contact.check_start(self.shell.name if self.shell is not None else "")
        self._fit_dt()
        self._dt_before = 0.0  # v_0 is given at t = 0: the first kick is half a step
        if scene.static is not None:
            self.relaxation = Relaxation(self, scene.static.residual, scene.static.max_steps)
        elif scene.modes is not None:
            self.relaxation = ModeSearch(self, scene.modes.count)
        elif scene.limit is not None:
            self.relaxation = LimitSearch(self, scene.limit.steps, scene.limit.resolution)
        if self.relaxation is not None:
            self.dt = scene.duration / scene.increments
        if self.shell is not None:
            self.internal.strain(0.0)  # so that the first step finds its kernels ready
        runtime.ti.sync()
        self.compile_seconds = clock.perf_counter() - began

    def _make_shell(self) -> None:
        """Pools, forces, loads and events of the shell."""
        scene = self.scene
        model = build(scene)
        self.mesh, self.nodes, self.cells, self.material = model.mesh, model.nodes, model.cells, model.material
        self.spacing = self.mesh.spacing
        self._probed = [(p, int(np.argmin(np.linalg.norm(self.mesh.points - np.asarray(p.point), axis=1)))) for p in scene.output.probes]
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
        self.cut_cells = np.unique(
            np.concatenate([cells_cut(self.mesh, c.start, c.end) for c in self.shell.cuts] or [np.zeros(0, np.int32)])
        )

    def _fluid(self) -> FluidBody:
        """The fluid where it stands at the start."""
        scene, fluid = self.scene, self.scene.fluids[0]
        filling = fill_fluid(fluid, scene, self.mesh)
        gravity = scene.gravity or (0.0, 0.0, 0.0)
        wettable = None
        if fluid.contact is None and (self.shell is not None or self.rigids is not None):
            thickness = self.shell.thickness if self.shell is not None else 0.0
            wettable = Wettable(self.mesh, self.nodes, self.cells, thickness, self.rigids, scene.rigids, self._held())
        return FluidBody(fluid, filling.points, filling.spacing, filling.mass, gravity, scene.walls, wettable=wettable)

    def _held(self) -> np.ndarray:
        """(N,) bool: nodes whose whole velocity is prescribed."""
        if self.shell is None or not self.loads.moves:
            return np.zeros(self.nodes.n if self.shell is not None else 0, bool)
        group = runtime.get(self.nodes.fixed, self.nodes.n)
        whole = runtime.get(self.loads.mask, int(group.max())).all(axis=1)
        return (group > 0) & whole[np.maximum(group, 1) - 1]

    def _contact(self, meets_itself: bool) -> Contact:
        """Pinballs of all bodies (T 3.3)."""
        scene = self.scene
        thickness = self.shell.thickness if self.shell is not None else 0.0
        fluid = self.fluid.p if self.fluid is not None else None
        pinballs = self.fluid is not None and self.fluid.wet is None
        bodies = Bodies(self.mesh, self.nodes, self.cells, self.loads, thickness, fluid, self.rigids, pinballs)
        lengths = [0.5 * p.radius for body in scene.rigids for p in body.pinballs]
        if self.shell is not None:
            lengths.append(self.spacing)
        if fluid is not None:
            lengths.append(fluid.spacing)
        return Contact(bodies, scene.numerics.contact or PinballContact(), meets_itself, 0.5 * min(lengths))

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

    def _fit_dt(self) -> None:
        """The stable step, shortened so that a whole number of steps ends the run."""
        left = self.scene.duration - self.time
        longest = min(self._steps().values())
        self.dt = left / self._whole(max(1, math.ceil(left / longest * (1 - 1e-12)))) if left > 0 else longest
        self.refit = False

    def _whole(self, steps: int) -> int:
        """So many steps, or a few more: whole steps of the fluid."""
        return math.ceil(steps / self.every) * self.every

    def _steps(self) -> dict[str, float]:
        """The longest step of each body, by what rules it [s]."""
        steps = {}
        if self.stable is not None:
            steps[f"{self.stable.safety:g} of 2/omega_max"] = self.stable.dt
        if self.fluid is not None:
            steps["sound in the fluid"] = self.scene.numerics.time_step_safety * self.fluid.stable_dt() / self.every
        return steps or {"the smallest pinball": self._rigid_dt()}

    def _rigid_dt(self) -> float:
        """Of rigid bodies alone: so short that no point moves by more than a twentieth of the smallest pinball [s]."""
        radius = min(p.radius for body in self.scene.rigids for p in body.pinballs)
        gravity = np.linalg.norm(self.scene.gravity or (0.0, 0.0, 0.0))
        speed = 0.0
        for body in self.scene.rigids:
            reach = max(np.linalg.norm(np.array(p.centre) - body.centre) + p.radius for p in body.pinballs)
            speed = max(speed, np.linalg.norm(body.velocity) + reach * np.linalg.norm(body.spin))
        return min(0.05 * radius / (speed + gravity * self.scene.duration + 1e-300), self.scene.duration / 100)

    @property
    def dt_rule(self) -> str:
        """What rules dt, in words."""
        if self.relaxation is not None:
            return self.relaxation.rule
        steps = self._steps()
        return min(steps, key=steps.get)

    @property
    def n_nodes(self) -> int:
        return (self.nodes.n if self.nodes is not None else 0) + (self.fluid.p.n if self.fluid is not None else 0)

    @property
    def stress_points(self) -> int:
        return self.cells.n if self.cells is not None else 0

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
        began = clock.perf_counter()
        for _ in range(steps):
            step(self, self._dt_before, self.dt)
            if self.step == 0:
                # the kinetic energy that the scheme conserves, 1/2 m v_-1/2 . v_+1/2: for a step load it starts
                # below 1/2 m v_0^2 by 1/8 m (dt a_0)^2 and stays there
                self.ledger.injected = self.ledger.kinetic() + (self.fluid.compressed if self.fluid is not None else 0.0)
                # what contact took at t = 0 is missing from that: give it back before it is taken (couplings.contact.multipliers)
                self.ledger.injected += self.contact.taken() if self.contact is not None else 0.0
            self._dt_before = self.dt
            self.time += self.dt
            self.step += 1
            self.refit |= (self.stable is not None and self.stable.watch()) or self._fluid_hastens()
            if self.refit and self.step % self.every == 0:
                self._fit_dt()
        self.stepping += clock.perf_counter() - began
        self.watchdog.look(self.energies())

    def _fluid_hastens(self) -> bool:
        """Whether the fluid has become too fast for the step; looked at now and then."""
        if self.fluid is None or self.step % LOOK:
            return False
        return self.scene.numerics.time_step_safety * self.fluid.stable_dt() < self.every * self.dt

    def advance_to(self, time: float) -> None:
        """Whole steps until `time` is reached, but for the rounding of their sum, or passed."""
        while (steps := math.ceil((time - self.time) / self.dt - 0.5e-6)) > 0:
            self.advance(self._whole(self.step + steps) - self.step)  # dt may become shorter on the way

    def energies(self) -> dict[str, float]:
        """The ledger [J] at the time of the last force evaluation, `time` [s] among them."""
        return {"time": self.time - self._dt_before, **self.ledger.entries()}

    def status(self) -> dict[str, int]:
        """Small numbers for the progress line."""
        if self.relaxation is not None:
            return self.relaxation.status()
        numbers = {}
        if self.shell is not None:
            numbers |= {"broken": self.rupture.broken - len(self.cut_cells), "fragments": self.rupture.fragments}
        if self.contact is not None:
            numbers |= {"contacts": self.contact.touching, "iterations": self.contact.iterations}
        return numbers

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

    def tracks(self, look: bool = True) -> dict[str, dict[str, float]]:
        """By the name of its history: place [m], velocity [m/s] and force [N] (water, contact) of each rigid body, now and the largest
        since the last look; the leak (observers.leak), looked at now or as it was at the last look."""
        if look and self.leak is not None:
            self.leak.look()
        found = {} if self.leak is None else {"leak": self.leak.row}
        if self.rigids is None:
            return found
        fields = {"": self.rigids.x, "v": self.rigids.v, "f": self.rigids.felt}
        values = {k: runtime.get(field, self.rigids.n) for k, field in fields.items()}
        hardest = self.rigids.hardest() if look else np.zeros(self.rigids.n)
        for r, name in enumerate(self.rigids.names):
            row = {f"{k}{axis}": float(values[k][r][c]) for k in fields for c, axis in enumerate("xyz")}
            found[f"rigid_{name}"] = row | {"f_max": float(hardest[r])}
        return found

    def contact_report(self) -> dict[str, float] | None:
        """How contact was solved, and its share of the steps of this session; None where there is none."""
        return None if self.contact is None else self.contact.report() | {"share": self.contact.seconds / max(self.stepping, 1e-300)}

    def frame(self) -> Frame:
        """All bodies now."""
        bodies = []
        if self.shell is not None:
            bodies.append(self._shell_frame())
        if self.rigids is not None:
            bodies += self._rigid_frames()
        if self.fluid is not None:
            bodies.append(self._fluid_frame())
        return Frame(self.time, self.step, tuple(bodies))

    def _fluid_frame(self) -> BodyFrame:
        data = self.fluid.frame()
        points = data.pop("points")
        n = len(points)
        outside = self.leak.outside if self.leak is not None else np.zeros(n, bool)
        data |= {"reference": self.fluid.start, "diameter": np.full(n, self.fluid.p.spacing), "outside": outside.astype(np.uint8)}
        return BodyFrame(self.fluid.name, points, np.zeros((0, 4), np.int32), data, {}, kind="fluid")

    def _rigid_frames(self) -> list[BodyFrame]:
        rigids = self.rigids
        place(rigids, rigids.n_balls)
        x, radius = runtime.get(rigids.ball_x, rigids.n_balls), runtime.get(rigids.ball_radius, rigids.n_balls)
        centre, v, omega = runtime.get(rigids.x, rigids.n), runtime.get(rigids.v, rigids.n), spins(rigids)
        frames = []
        for r, name in enumerate(rigids.names):
            own = rigids.balls_of(r)
            data = {
                "reference": rigids.ball_reference[own],
                "velocity": v[r] + np.cross(omega[r], x[own] - centre[r]),
                "radius": radius[own],
            }
            frames.append(BodyFrame(name, x[own], np.zeros((0, 4), np.int32), data, {}, kind="rigid"))
        return frames

    def _shell_frame(self) -> BodyFrame:
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
        if self.material.yields:
            cell_data["plastic"] = runtime.get(self.cells.plastic, m).astype(np.float64)
            cell_data["thickness"] = thicknesses(cell_data["strain"], self.shell.thickness)
        point_data = {
            "reference": self.mesh.points,
            "velocity": three(runtime.get(self.nodes.v, n)),
            "fragment": runtime.get(self.nodes.fragment, n).astype(np.uint8),
        }
        if self.nodes.bends:
            point_data["director"] = runtime.get(self.nodes.N, n) + runtime.get(self.nodes.d, n)
        points = self.mesh.points + three(runtime.get(self.nodes.u, n))
        return BodyFrame(self.shell.name, points, self.mesh.cells, point_data, cell_data)

    def _history(self) -> dict[str, object]:
        """Every field that is history, by name, with its length."""
        nodes, cells = self.nodes, self.cells
        fields = {} if self.rigids is None else self.rigids.history()
        if nodes is None:
            return fields
        fields |= {
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
            **cells.history,
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
        """What keeps history of its own, beside the pools."""
        shell = [self.rupture, self.stable, self.internal] if self.shell is not None else []
        others = [part for part in (self.fluid, self.leak, self.contact, self.relaxation) if part is not None]
        return [*shell, *self.terms, *self.pressures, *others]

    def state(self) -> dict[str, np.ndarray]:
        """All that is history, for a checkpoint."""
        return {
            "time": np.array([self.time, self.dt, self._dt_before, self.ledger.injected, self.refit]),
            "step": np.array(self.step),
            **{name: runtime.get(field, n) for name, (field, n) in self._history().items()},
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
        self.time, self.dt, self._dt_before, self.ledger.injected = (float(x) for x in state["time"][:4])
        self.refit = bool(state["time"][4])
        self.step = int(state["step"])
        for part in self._parts:
            part.restore(state)
