"""Shells at work: pools, internal forces, loads, rupture and stable step of a group, in the order of a step."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from ... import runtime
from ...errors import RunStopped
from ...frame import BodyFrame
from ...geometry.cuts import cells_cut
from ...numerics.reduce import BLOCK, Reducer, fastest
from ...pool import Pool
from ...scene.schema import Scene
from ..body import Clocked, Entries, Group, InPlace, Now, Rest, Span
from ..nodal.loads import Loads
from ..nodal.motion import kick_and_drift
from ..nodal.slow import SlowNodes
from .build import (
    ShellBody,
    alike,
    build,
    curve,
    initial_spin,
    initial_velocity,
    laws,
    node_forces,
    node_moments,
    node_motions,
    pressed_cells,
)
from .collocation import Collocation
from .damper import Damper
from .edge_filter import THESIS_STEP, EdgeFilter
from .galerkin import Galerkin
from .metal import thicknesses
from .port import ShellSurface
from .pressure import BOOK, START, Pressed, SurfacePressures
from .rupture import Rupture
from .said import Shell
from .spin_filter import SpinFilter
from .stable_dt import StableStep
from .stress import stored_energy
from .surface import ShellPoints
from .viscosity import PairViscosity


def groups(scene: Scene, others: Sequence[Group] = ()) -> list[ShellGroup]:
    """The groups of the scene's shells: one for each set of laws. The pools of the second are called "nodes_2" and so on."""
    return [ShellGroup(scene, shells, f"_{k}" if k > 1 else "") for k, shells in enumerate(alike(scene), start=1)]


class ShellGroup(Rest):
    """Shells of the same laws. shells: the bodies; mesh: theirs as one; nodes, cells, material: the pools; internal, terms, pressures,
    loads: what acts; sound (B,): the speed of sound in each body [m/s]."""

    kind = "shell"

    def __init__(self, scene: Scene, shells: list[Shell], suffix: str = ""):
        self.scene, self.suffix = scene, suffix
        self.now = Now()
        model = self.model = build(scene, shells, suffix)
        self.shells, self.mesh = model.bodies, model.mesh
        self.nodes, self.cells, self.material = model.nodes, model.cells, model.material
        self.bodies: tuple[Span, ...] = tuple(body.nodes for body in self.shells)
        self.every = laws(scene, shells[0])[-1]
        self.reducer = Reducer(max(self.nodes.n, self.cells.n), f"reduce{suffix}")
        self.internal: Galerkin | Collocation
        if self.shells[0].numerics.formulation.kind == "galerkin":
            self.internal = Galerkin(model, suffix)
        else:
            self.internal = Collocation(model, suffix)
        self.terms = self._dampers() if isinstance(self.internal, Collocation) else []
        dim = self.nodes.dim
        self.loads = Loads(
            self.nodes,
            list(node_forces(scene, self.shells, dim)),
            list(node_motions(scene, self.shells, dim)),
            list(node_moments(scene, self.shells)),
            f"loads{suffix}",
            self.every > 1,
        )
        self.slow = SlowNodes(self.nodes, self.loads, self.every, f"slow{suffix}") if self.every > 1 else None
        self.pressures = self._pressures()
        self.rupture = Rupture(self, f"rupture{suffix}")
        cut = [body.cells.first + cells_cut(body.mesh, c.start, c.end) for body in self.shells for c in body.said.cuts]
        self.cut_cells = np.unique(np.concatenate([*cut, np.zeros(0, np.int32)]))
        materials = [body.said.material for body in self.shells]
        self.sound = np.array([float(np.sqrt(m.young / m.density / (1 - m.poisson**2))) for m in materials])
        self.stable: StableStep

    def start(self) -> None:
        """Cuts, velocities and the stable step, once all bodies are there."""
        self.rupture.cut(self.cut_cells)
        runtime.put(self.nodes.v, initial_velocity(self.scene, self.shells, self.nodes.dim))
        if self.nodes.bends and any(start.rotation is not None for start in self.scene.initial):
            runtime.put(self.nodes.omega, initial_spin(self.scene, self.shells))
        self.stable = StableStep(self, f"stable{self.suffix}")

    def of(self, name: str) -> ShellBody:
        """The body of that name."""
        return next(body for body in self.shells if body.name == name)

    @property
    def shell(self) -> Shell:
        """What was said of the only body."""
        (body,) = self.shells
        return body.said

    @property
    def spacing(self) -> float:
        """The smallest spacing of the bodies [m]."""
        return self.mesh.spacing

    def _dampers(self) -> list[Damper]:
        """The terms of the collocation form that take energy."""
        assert isinstance(self.internal, Collocation)
        forms: list[Any] = [body.numerics.formulation for body in self.shells]
        form, pairs = forms[0], self.internal.pairs
        terms: list[Damper] = []
        rates = []
        for body in self.shells:
            material = body.said.material
            rates.append(math.sqrt(material.young / material.density) / (THESIS_STEP * body.mesh.spacing))
        viscous = form.viscosity
        if viscous.alpha or viscous.beta or (viscous.gamma and self.nodes.bends):
            terms.append(PairViscosity(self.model, pairs, self.internal.area, f"viscosity{self.suffix}"))
        if form.edge_filter and self.material.breaks:
            shares = [one.edge_filter * rate for one, rate in zip(forms, rates)]
            terms.append(EdgeFilter(self.nodes, self.cells, pairs, shares, f"filter{self.suffix}"))
        if form.spin_filter and self.nodes.bends:
            shares = [one.spin_filter * rate for one, rate in zip(forms, rates)]
            terms.append(SpinFilter(self.nodes, pairs, shares, f"spin_filter{self.suffix}"))
        return terms

    def _pressures(self) -> SurfacePressures | None:
        pressed = [
            Pressed(pressed_cells(body, p.where), p.value, curve(self.scene, p.history), p.kind == "follower")
            for body in self.shells
            for p in self.scene.loads_of("pressures", body.name)
        ]
        if not pressed:
            return None
        assert isinstance(self.internal, Galerkin)  # no other form bears a pressure
        return SurfacePressures(pressed, self.internal, self.cells, f"pressure{self.suffix}")

    def strain(self, now: Now) -> None:
        self.now = now
        self.internal.strain(self.every * now.dt)

    def events(self, now: Now) -> None:
        """Rupture; the work of pressures is booked around it."""
        ruptured = self.rupture.happen()
        if self.pressures is not None:
            self.pressures.press(now.time, START if ruptured else BOOK)

    def force(self, now: Now) -> None:
        self.internal.force()
        for term in self.terms:
            term.add(self.every * now.dt)
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
        """The points that water presses on: the nodes of the shells that are met, wherever they are."""
        if not self.nodes.bends:
            return []
        runs = [list(run) for met, run in groupby(self.shells, key=lambda body: meets(body.name)) if met]
        return [ShellPoints(f"{name}_{k}" if k > 1 else name, self, run) for k, run in enumerate(runs, start=1)]

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
                raise RunStopped(
                    f"shell '{body.name}': node {i} {moves} at t = {now.time:.6g} s,"
                    f" beyond the sound speed {sound:.4g} m/s; the time step is likely too long or the load too"
                    " violent for this spacing: lower numerics.time_step_safety or the load"
                )

    def negligible(self) -> float:
        """That of the body that has the least of it."""
        rounding = 1e-6 if self.scene.numerics.precision == "f32" else 1e-12
        return min(rounding**2 * body.said.material.young * body.said.thickness * float(body.mesh.areas.sum()) for body in self.shells)

    def status(self) -> dict[str, int]:
        return {"broken": self.rupture.broken - len(self.cut_cells), "fragments": self.rupture.fragments}

    def frames(self) -> list[BodyFrame]:
        """The shells now: see BodyFrame for names and units."""
        nodes, cells = self.nodes.shows(), self.cells.shows()
        nodes["velocity"] = self._in_space(nodes["velocity"])
        nodes["fragment"], cells["broken"] = nodes["fragment"].astype(np.uint8), cells["broken"].astype(np.uint8)
        n = self.nodes.n
        points = self.mesh.points + self._in_space(runtime.get(self.nodes.u, n))
        if self.nodes.bends:
            nodes["director"] = runtime.get(self.nodes.N, n) + runtime.get(self.nodes.d, n)
        found = []
        for body in self.shells:
            own = {name: values[body.cells.rows] for name, values in cells.items()}
            if self.material.yields:
                own["thickness"] = thicknesses(own["strain"], body.said.thickness)
            of_nodes = {"reference": body.mesh.points} | {name: values[body.nodes.rows] for name, values in nodes.items()}
            found.append(BodyFrame(body.name, points[body.nodes.rows], body.mesh.cells, of_nodes, own))
        return found

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

    def surface(self) -> ShellSurface | None:
        return ShellSurface(self) if self.nodes.bends else None

    def instead(self, world: Clocked, alike: Sequence[Any]) -> InPlace | None:
        from .instead import in_place

        return in_place(world, alike)

    def pools(self) -> list[Pool]:
        """All that has fields or history; what the links and the internal forces renew follows from nodes and cells."""
        parts = [self.nodes, self.cells, self.material, *self.loads.pools(), self.rupture, self.stable]
        others = [part for part in (self.pressures, self.slow) if part is not None]
        return [*parts, *self.internal.pools(), *self.terms, *others]
