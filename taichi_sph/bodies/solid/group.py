"""Solids at work: pools, internal forces, loads and stable step of a group, in the order of a step."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ... import runtime
from ...errors import RunStopped
from ...frame import BodyFrame
from ...geometry.solids import joined
from ...numerics.reduce import Reducer, fastest
from ...pool import Pool
from ...scene.schema import Scene
from ..body import Entries, Group, Now, Rest, Span, Tips
from ..nodal.loads import Loads
from ..nodal.motion import kick_and_drift
from ..nodal.nodes import Nodes
from ..nodal.supports import UNITS
from ..within import each_of
from .build import SolidBody, alike, bodies_of, chemical, initial_velocity, lit, motions_of, node_forces, node_motions
from .forces import gather, strain
from .parts import Part
from .pool import SolidCells, SolidMaterial
from .port import Skin, SolidSurface
from .said import Solid
from .stable_dt import StableStep
from .surface import SolidPoints
from .table import OnFaces, Table, on_faces, table_of

OPEN = 3.0  # speed of a gas over that of its detonation


def groups(scene: Scene, others: Sequence[Group], own: Sequence[Solid]) -> list[SolidGroup]:
    """The groups of the scene's solids: one for each set of laws."""
    return [SolidGroup(scene, some, suffix) for suffix, some in alike(own)]


class SolidGroup(Rest):
    """Solids of the same laws. solids: the bodies; mesh: theirs as one; nodes, cells, material: the pools; loads: what acts; limit (B,):
    the speed that no node of a body reaches [m/s]: that of pressure waves, `named` in words."""

    kind = "solid"

    def __init__(self, scene: Scene, some: list[Part], suffix: str = ""):
        self.scene, self.suffix = scene, suffix
        self.solids: tuple[SolidBody, ...] = bodies_of(scene, some)
        solids = [one.said for one in some]
        self.mesh = joined([body.mesh for body in self.solids])
        self.bodies: tuple[Span, ...] = tuple(body.nodes for body in self.solids)
        count = np.array([[body.nodes.n, body.cells.n] for body in self.solids])
        numbers = np.arange(len(self.solids))
        density = np.array([body.said.material.density for body in self.solids])
        mass = np.repeat(density, count[:, 0]) * np.concatenate([body.node_volumes for body in self.solids])
        self.weights = mass
        thrown = {one.body for one in scene.initial}
        whole = [body for body in self.solids if body.split is None]
        self.thrown = [body for body in whole if body.name in thrown or (None in thrown and len(scene.bodies) == 1)]
        self.nodes = Nodes(self.mesh, mass, None, np.repeat(numbers, count[:, 0]), f"solid.nodes{suffix}", dim=3)
        self.material = SolidMaterial([s.material for s in solids], [s.viscous for s in solids], f"solid.material{suffix}")
        pull = [
            body.said.formulation.stabilisation * body.said.material.young * body.mesh.volumes / body.mesh.sizes**2
            * (body.mesh.corners == 8)  # a tetrahedron has no residual
            for body in self.solids
        ]  # fmt: skip
        table, counts = _table(self.solids), np.concatenate([body.weights for body in self.solids])
        self.cells = SolidCells(
            self.mesh, table, counts, np.concatenate(pull), self.nodes, self.material, np.repeat(numbers, count[:, 1]),
            f"solid.cells{suffix}",
        )  # fmt: skip
        self.reducer = Reducer(max(self.nodes.n, self.cells.n), f"reduce.solid{suffix}")
        self.loads = Loads(
            self.nodes, list(node_forces(scene, self.solids, mass)), list(node_motions(scene, self.solids)), (), f"solid.loads{suffix}"
        )
        self.limit, self.named = np.array(self.material.numbers("sound")), "the sound speed"
        if self.material.burns:  # gas that leaves into the open is faster than the front
            self.limit, self.named = OPEN * np.array(self.material.numbers("front")), f"{OPEN:g} times its detonation's speed"
        self.new = False  # cells broke in this step
        self.skin = Skin(self.mesh, self.material.breaks, f"solid.skin{suffix}")
        self.stable: StableStep

    def start(self) -> None:
        """Velocities, when explosives are lit, and the stable step, once all bodies are there."""
        runtime.put(self.nodes.v, initial_velocity(self.scene, self.solids))
        if self.material.burns:
            runtime.put(self.cells.lit, np.concatenate([lit(body.said, body.mesh) for body in self.solids]))
            runtime.put(self.cells.energy, np.concatenate([np.full(body.cells.n, chemical(body)) for body in self.solids]))
        self.stable = StableStep(self, f"solid.stable{self.suffix}")

    @property
    def stress_points(self) -> int:
        return self.cells.n

    def of(self, name: str) -> SolidBody:
        """The body of that name."""
        return next(body for body in self.solids if body.name == name)

    def strain(self, now: Now) -> None:
        if self.material.breaks:
            self.cells.n_new[0] = 0
        strain(self.cells, self.nodes, self.material, self.cells.n, now.dt, now.time)

    def events(self, now: Now) -> None:
        """The surface is another one where cells broke."""
        if self.material.breaks:
            self.new = int(self.cells.n_new[0]) > 0

    def force(self, now: Now) -> None:
        gather(self.cells, self.nodes, self.nodes.n)
        self.loads.update(now.time)

    def move(self, now: Now) -> None:
        kick_and_drift(self.nodes, self.loads, self.nodes.n, now.dt_before, now.dt, now.half_time)

    def longest_step(self) -> dict[str, float]:
        return {f"{self.stable.safety:g} of 2/omega_max": self.stable.dt}

    def hastens(self, now: Now) -> bool:
        return self.stable.watch(now)

    def entries(self) -> Entries:
        total, cells = self.reducer.total, self.cells
        internal, numerical = {"explosive" if self.material.burns else "elastic": total(cells.stored, cells.n)}, {}
        if self.material.remembers:
            internal["residual" if self.material.burns else "damage"] = total(cells.lost, cells.n)
        if self.material.yields:
            internal["plastic"] = total(cells.dissipated, cells.n)
        if self.material.breaks:
            internal["released"] = total(cells.released, cells.n)
        if self.material.damps:
            numerical["viscous"] = total(cells.damped, cells.n)
        external = total(self.loads.work, self.nodes.n) if self.loads.acts else 0.0
        return Entries(total(self.nodes.kinetic, self.nodes.n), external, internal, numerical)

    def given(self) -> float:
        """The chemical energy of explosives."""
        return sum(chemical(body) * float(body.mesh.volumes.sum()) for body in self.solids)

    def look(self, now: Now) -> None:
        """RunStopped where a node is faster than its body's limit."""
        if self.reducer.largest(self.nodes.v, self.nodes.n) <= self.limit.min():
            return
        speeds = np.linalg.norm(runtime.get(self.nodes.v, self.nodes.n).astype(np.float64), axis=1)
        for body, limit in zip(self.solids, self.limit):
            if not (speeds[body.nodes.rows] <= limit).all():
                i, moves = fastest(self.nodes.v, self.nodes.X, body.nodes.n, body.nodes.first)
                raise RunStopped(
                    f"solid '{body.name}': node {i} {moves} at t = {now.time:.6g} s, beyond {self.named}, {limit:.4g} m/s; the time step"
                    " is likely too long or the load too violent for this spacing: lower numerics.time_step_safety or the load"
                )

    def negligible(self, dt: float) -> float:
        """1/2 E strain^2 over all solids, twice."""
        rounding = 1e-6 if self.scene.numerics.precision == "f32" else 1e-12
        return sum(rounding**2 * body.said.material.young * float(body.mesh.volumes.sum()) for body in self.solids)

    def status(self) -> dict[str, int]:
        if not self.material.breaks:
            return {}
        return {"broken": int(runtime.get(self.cells.broken, self.cells.n).sum())}

    def frames(self) -> list[BodyFrame]:
        """Each solid by its surface. Where cells may break, by all of its faces, those that are not on the surface now being `broken`."""
        n = self.nodes.n
        nodes, cells = self.nodes.shows(), self.cells.shows()
        points = self.mesh.points + runtime.get(self.nodes.u, n).astype(np.float64)
        gone = cells.pop("broken").astype(bool)
        bound = self.mesh.cells[~gone]
        nodes["fragment"] = np.ones(n, np.uint8)  # no live cell around it
        nodes["fragment"][bound[bound >= 0]] = 0
        found = []
        for body in self.solids:
            faces = body.mesh.faces
            own = np.arange(len(faces.nodes)) if self.material.breaks else body.mesh.skin
            two = faces.cells[own]
            lives = np.where(two < 0, False, ~gone[body.cells.first + two])
            side = two[np.arange(len(own)), np.where(lives[:, 0], 0, np.where(lives[:, 1], 1, 0))]
            data = {name: values[body.cells.first + side] for name, values in cells.items()}
            data["broken"] = (lives.sum(axis=1) != 1).astype(np.uint8)
            if "damage" not in data:
                data["damage"] = np.zeros(len(own))
            if "rupture_time" not in data:
                data["rupture_time"] = np.full(len(own), np.nan)
            if body.split is not None:
                data["weight"] = body.weights[side]
            if body.split is not None and body.name == body.of:
                data["hidden"] = (data["weight"] < 1.0).astype(np.uint8)
            of_nodes = {"reference": body.mesh.points} | {name: values[body.nodes.rows] for name, values in nodes.items()}
            found.append(BodyFrame(body.name, points[body.nodes.rows], faces.nodes[own], of_nodes, data, kind="solid"))
        return found

    def probed(self, point: tuple[float, float, float], name: str | None = None) -> int:
        """Number in the group of the node nearest to a reference point [m], of the body of that name; None: of the first."""
        body = self.solids[0] if name is None else self.of(name)
        return body.nodes.first + int(np.argmin(np.linalg.norm(body.mesh.points - np.asarray(point), axis=1)))

    def probe(self, i: int) -> dict[str, float]:
        """Displacement [m] and velocity [m/s] of node i."""
        return {
            f"{letter}_{axis}": float(field[i][c])
            for letter, field in (("u", self.nodes.u), ("v", self.nodes.v))
            for c, axis in enumerate("xyz")
        }

    track_units = UNITS | dict.fromkeys("xyz", "m") | dict.fromkeys(("vx", "vy", "vz"), "m/s")

    def tracks(self, look: bool = True) -> dict[str, dict[str, float]]:
        """By the name of its history: place [m] and velocity [m/s] of the centre of mass of each solid that starts with a velocity; force
        [N] and moment [N m] of each prescribed motion on its nodes, about the middle of them."""
        found: dict[str, dict[str, float]] = {}
        for body in self.thrown:
            mass, rows = self.weights[body.nodes.rows], body.nodes.rows
            u, v = (runtime.get(field, self.nodes.n)[rows].astype(np.float64) for field in (self.nodes.u, self.nodes.v))
            for letter, values in (("", self.mesh.points[rows] + u), ("v", v)):
                mean = mass @ values / mass.sum()
                found.setdefault(f"solid_{body.name}", {}).update({f"{letter}{axis}": float(mean[c]) for c, axis in enumerate("xyz")})
        if not self.loads.moves:
            return found
        numbers = [k for body in self.solids for k in motions_of(self.scene, body)]
        return found | dict(zip((f"support_{k}" for k in numbers), self.loads.supports.rows()))

    def wettables(self, name: str, spacing: float, meets: Callable[[str], bool]) -> list[SolidPoints]:
        """The points within the faces of the solids that are met. spacing [m]: that of the points of rigid surfaces."""
        met = [body for body in self.solids if body.split is None and meets(body.name)]
        return [SolidPoints(name, self, each_of(max(body.mesh.spacing for body in met), spacing), meets)] if met else []

    def tips(self, meets: Callable[[str], bool]) -> Tips:
        """The nodes of the surface."""
        met = np.repeat([meets(span.name) for span in self.bodies], [span.n for span in self.bodies])
        own = self.skin.numbers[met[self.skin.numbers]]
        u, v = (runtime.get(field, self.nodes.n)[own].astype(np.float64) for field in (self.nodes.u, self.nodes.v))
        return Tips(self.mesh.points[own] + u, np.zeros(len(own)), v, np.zeros(len(own)))

    def surface(self) -> SolidSurface | None:
        """None of a part, which nothing touches yet."""
        return SolidSurface(self) if self.solids[0].split is None else None

    def functions_on(self, faces: np.ndarray) -> OnFaces:
        """Of the nodes, on faces of the mesh of a group that is one body."""
        return on_faces(self.mesh, self.solids[0].said.formulation, faces)

    def pools(self) -> list[Pool]:
        return [self.nodes, self.cells, self.material, *self.loads.pools(), self.skin, self.stable]


def _table(solids: Sequence[SolidBody]) -> Table:
    """The coefficients of all bodies as one."""
    tables = [table_of(body.mesh, body.said.formulation) for body in solids]
    first, entries = [np.zeros(1, np.int32)], 0
    for table in tables:
        first.append(table.first[1:] + entries)
        entries += len(table.node)
    node = [table.node + body.nodes.first for table, body in zip(tables, solids)]
    return Table(np.concatenate(first).astype(np.int32), np.concatenate(node).astype(np.int32), np.concatenate([t.B for t in tables]))
