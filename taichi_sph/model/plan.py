"""What a run will be, before anything is computed: `validate` prints it, `run` refuses a bad scene by it.

Meshes are made (NumPy), regions and cuts are tried on them; sizes, steps and seconds are estimates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..errors import SceneError
from ..scene.schema import Plate, Scene, Shell
from ..scene.units import show
from .cuts import cells_cut
from .mesh import SurfaceMesh, plate
from .meshfile import read_mesh
from .regions import inside

# measured on runs of these scenes, f64; f32 takes about 0.6 of it
BYTES_PER_NODE = {"galerkin": 3500, "collocation": 4500}
FRAME_BYTES_PER_NODE = 45  # positions in f64, everything else in f32
CHECKPOINT_BYTES_PER_NODE = 200


@dataclass(frozen=True)
class BodyPlan:
    """One body: counts, masses [kg], lengths [m]. `analytic_mass` is None where no formula gives it."""

    name: str
    nodes: int
    stress_points: int
    mass: float
    analytic_mass: float | None
    thickness: float
    spacing_min: float
    spacing_max: float
    dt: float


@dataclass(frozen=True)
class Plan:
    """The whole run: dt [s] and what follows are estimates, `memory` and `disk` in bytes."""

    bodies: tuple[BodyPlan, ...]
    dt: float
    steps: int
    memory: int
    disk: int
    seconds: float

    @property
    def nodes(self) -> int:
        return sum(body.nodes for body in self.bodies)


def mesh_of(shell: Shell, scene: Scene) -> SurfaceMesh:
    """The mid-surface of a shell, generated or read."""
    n = scene.numerics
    if isinstance(shell.surface, Plate):
        s = shell.surface
        return plate(s.length, s.width, n.spacing, n.cells, n.irregularity, n.seed, s.origin)
    return read_mesh(shell.surface.path, shell.surface.scale, plane=shell.motion == "in_plane")


def plan(scene: Scene, node_steps_per_second: float = 1e6) -> Plan:
    """Checks the scene against its meshes (SceneError) and estimates the run."""
    meshes = {shell.name: mesh_of(shell, scene) for shell in scene.shells}
    _check_regions(scene, meshes)
    _check_cuts(scene, meshes)
    bodies = tuple(_body(shell, meshes[shell.name], scene) for shell in scene.shells)
    nodes = sum(body.nodes for body in bodies)
    dt = min(body.dt for body in bodies)
    steps = math.ceil(scene.duration / dt)
    single = 0.6 if scene.numerics.precision == "f32" else 1.0
    out = scene.output
    per_node = (out.frames + 1) * FRAME_BYTES_PER_NODE + min(out.checkpoints, out.keep_checkpoints) * CHECKPOINT_BYTES_PER_NODE
    return Plan(
        bodies=bodies,
        dt=dt,
        steps=steps,
        memory=round(nodes * BYTES_PER_NODE[scene.numerics.formulation.kind] * single),
        disk=round(nodes * per_node + out.samples * 200 + 1e6),
        seconds=nodes * steps / node_steps_per_second,
    )


def _body(shell: Shell, mesh: SurfaceMesh, scene: Scene) -> BodyPlan:
    ends = mesh.points[mesh.edges.nodes]
    edge = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    m = shell.material
    # the membrane step of a shell with cell-mean gradients (T 2.51 for e << D has the same form)
    dt = scene.numerics.time_step_safety * 0.85 * float(edge.min()) * math.sqrt(m.density * (1 - m.poisson**2) / m.young)
    area = shell.surface.length * shell.surface.width if isinstance(shell.surface, Plate) else None
    return BodyPlan(
        name=shell.name,
        nodes=len(mesh.points),
        stress_points=len(mesh.cells),
        mass=float(mesh.node_areas.sum() * shell.thickness * m.density),
        analytic_mass=None if area is None else area * shell.thickness * m.density,
        thickness=shell.thickness,
        spacing_min=float(edge.min()),
        spacing_max=float(edge.max()),
        dt=dt,
    )


def _check_regions(scene: Scene, meshes: dict[str, SurfaceMesh]) -> None:
    held: dict[str, list[tuple[int, np.ndarray]]] = {}
    for key in ("forces", "motions", "initial"):
        for number, load in enumerate(getattr(scene, key)):
            points = meshes[load.shell].points
            caught = inside(load.where, points)
            if not caught.any():
                low, high = points.min(axis=0), points.max(axis=0)
                reach = ", ".join(f"{a} {show(lo, 'm')} to {show(hi, 'm')}" for a, lo, hi in zip("xyz", low, high))
                raise SceneError(
                    f"{key}[{number}].where catches no node of shell '{load.shell}', which reaches over {reach} with "
                    f"nodes {show(meshes[load.shell].spacing, 'm')} apart"
                )
            if key == "motions":
                held.setdefault(load.shell, []).append((number, caught))
    for name, regions in held.items():
        for i, (one, first) in enumerate(regions):
            for two, second in regions[i + 1 :]:
                shared = int((first & second).sum())
                if shared:
                    raise SceneError(
                        f"motions[{one}] and motions[{two}] both hold {shared} nodes of shell '{name}': a node can follow "
                        "one motion, so let the regions not overlap"
                    )


def _check_cuts(scene: Scene, meshes: dict[str, SurfaceMesh]) -> None:
    for index, shell in enumerate(scene.shells):
        points = meshes[shell.name].points
        low, high = points.min(axis=0), points.max(axis=0)
        margin = 0.05 * (high - low).max()
        for number, cut in enumerate(shell.cuts):
            key = f"shells[{index}].cuts[{number}]"
            for end, point in (("start", cut.start), ("end", cut.end)):
                off = (np.asarray(point) < low - margin) | (np.asarray(point) > high + margin)
                if off.any():
                    axis = int(np.argmax(off))
                    raise SceneError(
                        f"{key}.{end}: {'xyz'[axis]} = {show(point[axis], 'm')} is outside shell '{shell.name}' "
                        f"({show(low[axis], 'm')} to {show(high[axis], 'm')})"
                    )
            if not len(cells_cut(meshes[shell.name], cut.start, cut.end)):
                raise SceneError(
                    f"{key}, {show(math.dist(cut.start, cut.end), 'm')} long, crosses no cell of shell '{shell.name}' "
                    f"(node spacing {show(meshes[shell.name].spacing, 'm')})"
                )
