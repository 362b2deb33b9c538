"""What a run will be, before anything is computed: `validate` prints it, `run` refuses a bad scene by it.

Meshes are made (NumPy), regions and cuts are tried on them; sizes, steps and seconds are estimates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..bodies.fluid.fill import fill_fluid
from ..bodies.fluid.said import Fluid
from ..bodies.rigid.said import Rigid
from ..errors import SceneError
from ..geometry.cuts import cells_cut
from ..geometry.mesh import SurfaceMesh
from ..geometry.normals import report
from ..geometry.regions import inside
from ..geometry.surfaces import mesh_of
from ..scene import Numerics, Scene, Shell
from ..scene.surfaces import MeshFile, Plate
from ..scene.units import show

# measured on scenes/beam_impact.py, f64: bytes of fields per node by formulation and cells; bending adds to them
BYTES_PER_NODE = {
    ("galerkin", "quad"): 3200,
    ("galerkin", "triangle"): 4300,
    ("collocation", "quad"): 1900,
    ("collocation", "triangle"): 3200,
}
BENDING_BYTES_PER_NODE = 700
FLUID_BYTES_PER_PARTICLE = 1100
SINGLE = 0.75  # of it in f32: positions stay in f64, neighbour lists are integers
FRAME_BYTES_PER_NODE = 45  # positions in f64, everything else in f32
CHECKPOINT_BYTES_PER_NODE = 300
# stable step over D sqrt(rho (1 - nu^2) / E), measured like the above; a lattice moved at random by p spacings
# takes (1 - p^2) of it
STEP = {("galerkin", "quad"): 1.10, ("galerkin", "triangle"): 0.93, ("collocation", "quad"): 1.60, ("collocation", "triangle"): 1.60}
TURNING = 1.07  # of free directors, over D sqrt(...) sqrt(alpha + (e/D)^2)
RELAXATION = 2000  # force evaluations to the equilibrium of one load increment, the order of magnitude


@dataclass(frozen=True)
class BodyPlan:
    """One body: counts, masses [kg], lengths [m]. `analytic_mass` is None where no formula gives it;
    `note` says whether the surface is closed."""

    name: str
    nodes: int
    stress_points: int
    mass: float
    analytic_mass: float | None
    thickness: float
    spacing_min: float
    spacing_max: float
    dt: float
    note: str = ""


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


def plan(scene: Scene, node_steps_per_second: float = 1e6) -> Plan:
    """Checks the scene against its meshes (SceneError) and estimates the run."""
    meshes = {shell.name: mesh_of(shell, scene) for shell in scene.shells}
    _check_regions(scene, meshes)
    _check_cuts(scene, meshes)
    _check_modes(scene, meshes)
    bodies = tuple(_body(shell, meshes[shell.name], scene) for shell in scene.shells)
    bodies += tuple(_rigid(body, scene) for body in scene.rigids)
    bodies += tuple(_fluid(fluid, scene, meshes) for fluid in scene.fluids)
    nodes = sum(body.nodes for body in bodies)
    dt = min(body.dt for body in bodies)
    steps = math.ceil(scene.duration / dt)
    work = steps  # evaluations of the forces
    if scene.increments is not None:
        steps = scene.increments
        dt, work = scene.duration / steps, steps * RELAXATION
    kinds = {name: (scene.numerics.formulation.kind, _cells(mesh)) for name, mesh in meshes.items()}
    memory = FLUID_BYTES_PER_PARTICLE * sum(body.nodes for body in bodies if body.name in [f.name for f in scene.fluids])
    memory += sum(
        body.nodes * (BYTES_PER_NODE[kinds[body.name]] + (BENDING_BYTES_PER_NODE if shell.motion == "free" else 0))
        for body, shell in zip(bodies, scene.shells)
    )
    out = scene.output
    per_node = (out.frames + 1) * FRAME_BYTES_PER_NODE + min(out.checkpoints, out.keep_checkpoints) * CHECKPOINT_BYTES_PER_NODE
    return Plan(
        bodies=bodies,
        dt=dt,
        steps=steps,
        memory=round(memory * (SINGLE if scene.numerics.precision == "f32" else 1.0)),
        disk=round(nodes * per_node + out.samples * 200 + 1e6),
        seconds=nodes * work / node_steps_per_second,
    )


def _body(shell: Shell, mesh: SurfaceMesh, scene: Scene) -> BodyPlan:
    ends = mesh.points[mesh.edges.nodes]
    edge = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    m = shell.material
    n = scene.numerics
    generated = not isinstance(shell.surface, MeshFile)
    finest = mesh.spacing if isinstance(shell.surface, Plate) else float(mesh.node_spacing.min())
    factor = STEP[n.formulation.kind, _cells(mesh)]
    if shell.motion == "free":
        factor = (factor**-6 + _turning(shell.thickness / finest, n) ** -6) ** (-1 / 6)
    factor *= 1 - n.irregularity**2 if generated else 1.0
    dt = n.time_step_safety * factor * finest * math.sqrt(m.density * (1 - m.poisson**2) / m.young)
    area = None if isinstance(shell.surface, MeshFile) else shell.surface.area
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
        note=report(mesh),
    )


def _rigid(body: Rigid, scene: Scene) -> BodyPlan:
    """Its pinballs; alone it takes hundredths of the duration as steps, beside a shell it follows the shell's."""
    radii = [p.radius for p in body.pinballs]
    return BodyPlan(
        name=body.name,
        nodes=len(radii),
        stress_points=0,
        mass=body.mass,
        analytic_mass=None,
        thickness=2 * min(radii),
        spacing_min=2 * min(radii),
        spacing_max=2 * max(radii),
        dt=math.inf if scene.shells else scene.duration / 100,
        note=f"rigid, inertia {', '.join(f'{m:.3g}' for m in body.moments.diagonal())} kg m2 along x, y, z",
    )


def _fluid(fluid: Fluid, scene: Scene, meshes: dict[str, SurfaceMesh]) -> BodyPlan:
    """Its particles, and the step of sound through them."""
    filling = fill_fluid(fluid, scene, meshes.get(getattr(fluid.fill, "shell", "")))
    analytic = fluid.water.density * filling.volume
    return BodyPlan(
        name=fluid.name,
        nodes=len(filling.points),
        stress_points=0,
        mass=filling.mass * len(filling.points),
        analytic_mass=analytic,
        thickness=filling.spacing,
        spacing_min=filling.spacing,
        spacing_max=filling.spacing,
        dt=scene.numerics.time_step_safety * 0.6 * filling.spacing / fluid.water.sound,
        note=filling.sentence,
    )


def _turning(slenderness: float, numerics: Numerics) -> float:
    """Stable step of the directors, like STEP; infinite where raised inertia keeps it above the membrane's (build.rotary)."""
    bound = numerics.formulation.shear_bound
    if numerics.raised_inertia and bound > 0:
        return math.inf
    return TURNING * math.sqrt(bound + max(slenderness**2, 1.0 if numerics.raised_inertia else 0.0))


def _cells(mesh: SurfaceMesh) -> str:
    """What most of the cells are."""
    return "triangle" if (mesh.cells[:, 3] < 0).mean() > 0.5 else "quad"


def _check_regions(scene: Scene, meshes: dict[str, SurfaceMesh]) -> None:
    held: dict[str, list[tuple[int, np.ndarray]]] = {}
    for key in ("forces", "moments", "motions", "initial"):
        for number, load in enumerate(getattr(scene, key)):
            points = meshes[load.body].points
            caught = inside(load.where, points)
            if not caught.any():
                low, high = points.min(axis=0), points.max(axis=0)
                reach = ", ".join(f"{a} {show(lo, 'm')} to {show(hi, 'm')}" for a, lo, hi in zip("xyz", low, high))
                raise SceneError(
                    f"{key}[{number}].where catches no node of shell '{load.body}', which reaches over {reach} with "
                    f"nodes {show(meshes[load.body].spacing, 'm')} apart"
                )
            if key == "motions":
                held.setdefault(load.body, []).append((number, caught))
    for index, shell in enumerate(scene.shells):
        for number, region in enumerate(shell.sound):
            if not inside(region, meshes[shell.name].centres).any():
                raise SceneError(
                    f"shells[{index}].sound[{number}] catches no stress point of shell '{shell.name}', whose nodes are "
                    f"{show(meshes[shell.name].spacing, 'm')} apart"
                )
    for name, regions in held.items():
        for i, (one, first) in enumerate(regions):
            for two, second in regions[i + 1 :]:
                shared = int((first & second).sum())
                if shared:
                    raise SceneError(
                        f"motions[{one}] and motions[{two}] both hold {shared} nodes of shell '{name}': a node can follow "
                        "one motion, so let the regions not overlap"
                    )


def _check_modes(scene: Scene, meshes: dict[str, SurfaceMesh]) -> None:
    """A body has as many modes as unknowns, and the search for a few of them needs some more."""
    if scene.modes is None:
        return
    for shell in scene.shells:
        unknowns = len(meshes[shell.name].points) * (5 if shell.motion == "free" else 2)
        if scene.modes.count > unknowns // 4 - 6:
            raise SceneError(
                f"modes.count = {scene.modes.count} is too many for shell '{shell.name}' with its {unknowns} unknowns; "
                f"ask for at most {max(unknowns // 4 - 6, 0)}, or take a smaller numerics.spacing"
            )


def _check_cuts(scene: Scene, meshes: dict[str, SurfaceMesh]) -> None:
    for index, shell in enumerate(scene.shells):
        points = meshes[shell.name].points
        low, high = points.min(axis=0), points.max(axis=0)
        margin = 0.05 * (high - low).max()
        gone: set[int] = set()
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
            crossed = cells_cut(meshes[shell.name], cut.start, cut.end)
            gone.update(crossed.tolist())
            if not len(crossed):
                raise SceneError(
                    f"{key}, {show(math.dist(cut.start, cut.end), 'm')} long, crosses no cell of shell '{shell.name}' "
                    f"(node spacing {show(meshes[shell.name].spacing, 'm')})"
                )
        if gone and len(gone) == len(meshes[shell.name].cells):
            raise SceneError(f"shells[{index}].cuts break every cell of shell '{shell.name}': nothing would be left of it")
