"""What a run will be, before anything is computed: `validate` prints it, `run` refuses a bad scene by it.

Meshes are made (NumPy), regions and cuts are tried on them; sizes, steps and seconds are estimates.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..bodies.fluid.fill import Filling, fill_fluid
from ..bodies.fluid.said import Fluid
from ..bodies.fluid.step import stable_step
from ..bodies.rigid import solid as rigid_bodies
from ..bodies.shell.parts import Part, Split, meshed, particles_of, parts, split_of
from ..bodies.shell.sections import Sheet, Sheets, sheets_of
from ..bodies.solid import parts as of_solids
from ..bodies.solid.build import hastened, lit
from ..couplings.springs.said import longest_of
from ..couplings.welds.places import welded
from ..errors import SceneError
from ..geometry.cuts import cells_cut
from ..geometry.mesh import SurfaceMesh
from ..geometry.normals import report
from ..geometry.regions import cells_in, extent, inside, nodes_in
from ..geometry.solids import SolidMesh
from ..geometry.solids import count as nodes_of_solid
from ..geometry.solids import mesh_of as solid_mesh_of
from ..geometry.surfaces import mesh_of
from ..output import files
from ..output.checkpoint import KEPT
from ..scene import Body, Concrete, Numerics, Scene, Shell, Solid
from ..scene.instead import LARGEST
from ..scene.plausible import MAX_STEPS
from ..scene.regions import Region
from ..scene.solids import Made as Generated
from ..scene.surfaces import BoxTank, Given, Plate, Roof
from ..scene.units import show
from . import speed
from .coarse import too_coarse
from .counts import check_counts
from .openings import too_narrow
from .overlap import check_overlaps

# measured on scenes/beam_impact.py, f64: bytes of fields per node by formulation and cells; bending adds to them
BYTES_PER_NODE = {
    ("galerkin", "quad"): 3200,
    ("galerkin", "triangle"): 4300,
    ("collocation", "quad"): 1900,
    ("collocation", "triangle"): 3200,
    ("elements", "quad"): 1600,
    ("elements", "triangle"): 2900,
}
BENDING_BYTES_PER_NODE = 700
FLUID_BYTES_PER_PARTICLE = 1100
SOLID_BYTES_PER_NODE = {"trilinear": 1250, "particles": 4200}  # of a metal; elastic ones 400 less
SOLID_STEP = {"trilinear": 0.98, "particles": 1.05}  # over h / c of pressure waves, cubes
SINGLE = 0.75  # of it in f32: positions stay in f64, neighbour lists are integers
FRAME_BYTES_PER_NODE = 45  # positions in f64, everything else in f32
CHECKPOINT_BYTES_PER_NODE = 300
# stable step over D sqrt(rho (1 - nu^2) / E), measured like the above; a lattice moved at random by p spacings
# takes (1 - p^2) of it
STEP = {
    ("galerkin", "quad"): 1.10,
    ("galerkin", "triangle"): 0.93,
    ("collocation", "quad"): 1.60,
    ("collocation", "triangle"): 1.60,
    ("elements", "quad"): 0.99,
    ("elements", "triangle"): 0.83,
}
TURNING = 1.07  # of free directors, over D sqrt(...) sqrt(alpha + (e/D)^2)
ROUND, AT_HOLES = 0.78, 0.5  # finest spacing over D, of round ends and spheres, beside holes
LARGE = 200_000  # nodes and particles from which on `validate` makes none of them
HOLE = 800  # nodes that are made while one hole is cut
RELAXATION = 2000  # force evaluations to the equilibrium of one load increment, the order of magnitude
LEAST_WITHIN = 1e-3  # part of the direction of a gauge that must lie in the shell, as in bodies.shell.gauge
NEWTON = 5 * 4e-4  # s a node for one load increment of Newton's method, of some thousand nodes


@dataclass(frozen=True)
class BodyPlan:
    """One body: counts, masses [kg], lengths [m], bytes. `analytic_mass` is None where no formula gives it;
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
    memory: float = 0.0
    every: int = 1
    rate: float = speed.OTHER  # s a node and step
    more_nodes: int = 0  # and bytes: where all of a patch that grows has grown
    more_memory: float = 0.0


@dataclass(frozen=True)
class Made:
    """What was made for a plan, by the names of bodies. Whoever builds the scene while the plan is held gets the very same."""

    meshes: dict[str, SurfaceMesh]
    fillings: dict[str, Filling]
    splits: dict[str, Split] = field(default_factory=dict)
    solids: dict[str, SolidMesh] = field(default_factory=dict)


@dataclass(frozen=True)
class Plan:
    """The whole run: dt [s] and what follows are estimates, `memory` and `disk` in bytes. most_memory: where patches grow as far as they
    can. counted: so are the numbers of nodes, and nothing
    was made."""

    bodies: tuple[BodyPlan, ...]
    dt: float
    steps: int
    memory: int
    disk: int
    seconds: float
    made: Made = field(compare=False, repr=False)
    counted: bool = False
    most_memory: int = 0
    warnings: tuple[str, ...] = ()  # of what the run may answer wrongly
    compiling: float = 0.0  # s, beside `seconds` of stepping
    writing: float = 0.0
    drawing: float = 0.0

    @property
    def nodes(self) -> int:
        return sum(body.nodes for body in self.bodies)

    def total(self, pictures: bool = True) -> float:
        """Seconds of the whole run, with or without pictures, where no patch grows."""
        return speed.BEGIN + self.seconds + self.compiling + self.writing + (self.drawing if pictures else 0.0)

    @property
    def most(self) -> float:
        """How many times as many nodes there are where patches grow as far as they can; 1 where none grows."""
        return 1.0 + sum(body.more_nodes for body in self.bodies) / max(self.nodes, 1)


def make(scene: Scene, memory_there: int | None = None) -> Made:
    """The meshes of the shells and the fillings of the fluids; SceneError where those would not fit into `memory_there` bytes."""
    meshes = {shell.name: mesh_of(shell, scene) for shell in scene.shells}
    check_counts(scene, memory_there, meshes)
    splits = {shell.name: split_of(shell, scene) for shell in scene.shells if shell.patch is not None}
    meshes |= {body.name: mesh_of(body, scene) for body in scene.rigids if body.surface is not None}
    solids = {solid.name: solid_mesh_of(solid, scene) for solid in scene.solids}
    return Made(meshes, {f.name: fill_fluid(f, scene, meshes) for f in scene.fluids}, splits, solids)


def plan(scene: Scene, costs: speed.Costs | None = None, large: float = math.inf) -> Plan:
    """Checks the scene against its meshes (SceneError) and estimates the run. costs: of runs before. large: nodes and particles beyond
    which it makes none and judges by their counts alone; a hole counts as some of them."""
    memory_there = files.memory()
    counts = check_counts(scene, memory_there)  # before anything is made
    generated = [shell.surface for shell in scene.shells if not isinstance(shell.surface, Given) and shell.patch is None]
    given = len(generated) < len(scene.shells) or any(not isinstance(s.shape, Generated) or s.patch is not None for s in scene.solids)
    if sum(counts.values()) + HOLE * sum(len(surface.holes) for surface in generated) > large and not given:
        rigids = {body.name: rigid_bodies.solid_of(body, scene) for body in scene.rigids}
        bodies = tuple(_counted_shell(shell, counts[shell.name], scene) for shell in scene.shells)
        bodies += tuple(map(_rigid, rigids.values()))
        bodies += tuple(_counted_fluid(fluid, counts[fluid.name], scene) for fluid in scene.fluids)
        bodies += tuple(_counted_solid(solid, scene) for solid in scene.solids)
        counted = _estimated(scene, (*bodies, *map(_other, scene.others)), costs)
        return replace(counted, warnings=tuple(too_coarse(scene, rigids, {})))
    made = make(scene, memory_there)
    _check_regions(scene, {**made.meshes, **made.solids})
    _check_cuts(scene, made.meshes)
    _check_modes(scene, made.meshes)
    _check_springs(scene, {**made.meshes, **made.solids})
    _check_gauges(scene, made.meshes)
    if scene.welds:
        shells = {shell.name: made.meshes[shell.name] for shell in scene.shells}
        welded(scene.welds, {name: mesh.points for name, mesh in shells.items()}, {name: mesh.spacing for name, mesh in shells.items()})
    _check_gases(scene, made)
    _check_detonations(scene, made.solids)
    rigids = {body.name: rigid_bodies.solid_of(body, scene) for body in scene.rigids}
    check_overlaps(scene, made.meshes, made.fillings, rigids, made.solids)
    bodies = tuple(_part(one, made, scene) for one in parts(scene))
    bodies += tuple(map(_rigid, rigids.values()))
    bodies += tuple(_fluid(fluid, made.fillings[fluid.name], scene, made.meshes) for fluid in scene.fluids)
    bodies += tuple(_solid_part(one, made, scene) for one in of_solids.parts(scene.solids))
    planned = _estimated(scene, (*bodies, *map(_other, scene.others)), costs, made)
    return replace(planned, warnings=tuple(too_coarse(scene, rigids, made.solids)))


def _of_springs(scene: Scene, bodies: tuple[BodyPlan, ...]) -> dict[str, float]:
    """The longest step of each spring alone [s], by the masses that it holds: of a shell or solid those of the nodes within its radius."""
    found, plans = {}, {body.name: body for body in bodies}
    for spring in scene.springs:
        loose = 0.0  # 1/kg
        for name in spring.between:
            if (body := plans.get(name or "")) is not None and body.mass > 0 and getattr(scene.body(body.name), "free", True):
                near = 1.0 if spring.radius is None else max(1.0, math.pi * (spring.radius / body.spacing_max) ** 2)
                loose += max(1.0, body.nodes / near) / body.mass if scene.body(body.name).has_nodes else 1.0 / body.mass
        if loose * (spring.stiffness + spring.damping) > 0:
            found[spring.name] = scene.numerics.time_step_safety * longest_of(math.sqrt(loose * spring.stiffness), loose * spring.damping)
    return found


def _estimated(scene: Scene, bodies: tuple[BodyPlan, ...], costs: speed.Costs | None = None, made: Made | None = None) -> Plan:
    """Steps, memory, disk and seconds of bodies that are planned; SceneError for too many steps."""
    nodes = sum(body.nodes for body in bodies)
    dt = min(body.dt / body.every for body in bodies)  # of the clock
    dt = dt if math.isfinite(dt) else scene.duration / 100  # what follows any other body, alone
    slowest = min(bodies, key=lambda body: body.dt / body.every).name
    for spring, longest in _of_springs(scene, bodies).items():
        slowest = spring if longest < dt else slowest
        dt = 1.0 / math.hypot(1.0 / dt, 1.0 / longest)
    steps = math.ceil(min(scene.duration / dt, 1e300)) if dt > 0 else 10**300
    work = steps  # evaluations of the forces
    if scene.increments is None and steps > MAX_STEPS:
        raise SceneError(
            f"duration {show(scene.duration, 's')} takes about {steps:.2g} time steps of {show(dt, 's')}, which '{slowest}' asks for; "
            f"at most {MAX_STEPS // 1_000_000} million are allowed"
        )
    if scene.increments is not None:
        steps = scene.increments
        dt, work = scene.duration / steps, steps * RELAXATION
    costs = costs or speed.Costs()
    seconds = costs.pace * speed.stepping(scene, bodies, work)
    if _by_newton(scene, nodes):
        seconds = steps * nodes * NEWTON
    out, single = scene.output, SINGLE if scene.numerics.precision == "f32" else 1.0
    per_node = (out.frames + 1) * FRAME_BYTES_PER_NODE + min(out.checkpoints, KEPT) * CHECKPOINT_BYTES_PER_NODE
    return Plan(
        bodies=bodies,
        dt=dt,
        steps=steps,
        memory=round(sum(body.memory for body in bodies) * single),
        most_memory=round(sum(body.memory + body.more_memory for body in bodies) * single),
        disk=round(nodes * per_node + out.samples * 200 + 1e6),
        seconds=seconds,
        compiling=speed.compiling(scene, costs),
        writing=costs.write * speed.writing(scene, nodes, steps),
        drawing=costs.draw * speed.drawing(scene, nodes),
        made=made or Made({}, {}),
        counted=made is None,
    )


def _part(one: Part, made: Made, scene: Scene) -> BodyPlan:
    """A shell, or its elements, or its particles."""
    if one.whole.patch is None:
        return _body(one.said, made.meshes[one.whole.name], scene)
    split, mesh = meshed(one, scene)
    assert split is not None
    own = one.said.name == one.whole.name
    areas = split.areas_of_elements if own else split.areas_of_particles
    mass = float(areas.sum() * one.said.thickness * one.said.material.density)
    note = f"{'elements' if own else 'particles'} of shell '{one.whole.name}'"
    plan = replace(_body(one.said, mesh, scene), mass=mass, analytic_mass=None, note=note)
    if one.whole.patch is not None and not one.whole.patch.there:  # its step lasts until then, which nobody knows
        finest = float(mesh.node_spacing.min()) / split.n
        to_come = _shell(particles_of(one.whole, scene), scene, (0, 0), "quad", 0.0, finest, (finest, finest), "").dt
        later = f"dt {show(plan.dt, 's')}, and {show(to_come, 's')} once there are particles, {show(split.spacing, 'm')} apart"
        plan = replace(plan, dt=min(plan.dt, to_come), note=f"{note}: {later}")
    return _growing(plan, one.whole, split, scene) if own and one.whole.patch.grows else plan


def _growing(plan: BodyPlan, shell: Shell, split: Split, scene: Scene) -> BodyPlan:
    """The elements of a shell whose patch grows: from what it has now to where all elements have become particles that can. Nobody knows
    before the run which do."""
    now, able = split.counted(np.zeros(len(split.able), bool)) if split.patch.there else (len(split.nodes), 0), np.flatnonzero(split.able)
    most = split.counted(split.able)
    one = np.zeros(len(split.able), bool)
    one[able[len(able) // 2 : len(able) // 2 + 1]] = True
    place = sum(split.counted(one)) - sum(now)
    made = particles_of(shell, scene)
    of_particles = BYTES_PER_NODE[scene.numerics_of(made).formulation.kind, "quad"] + (
        BENDING_BYTES_PER_NODE if shell.motion == "free" else 0
    )
    own = plan.memory / max(plan.nodes, 1)
    more = (most[0] - now[0]) * own + (most[1] - now[1]) * of_particles
    grows = (
        f"particles take over where damage or a striker comes, which is not known before: {sum(now)} nodes at first, some {max(place, 0)} "
        f"more for each place where they begin, and {sum(most)} where all {len(able)} elements that can have turned"
    )
    return replace(plan, note=f"{plan.note}; {grows}", more_nodes=sum(most) - sum(now), more_memory=max(more, 0.0))


def _body(shell: Shell, mesh: SurfaceMesh, scene: Scene) -> BodyPlan:
    ends = mesh.points[mesh.edges.nodes]
    edge = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    finest = mesh.spacing if isinstance(shell.surface, Plate) else float(mesh.node_spacing.min())
    made = sheets_of(shell, mesh, f"{scene.key_of(scene.body(shell.name))}.sections")
    mass = float(mesh.shared(made.areal).sum())
    between = float(edge.min()), float(edge.max())
    note = report(mesh) + ("" if made.even else f"; {_sections(made, mesh)}")
    size = len(mesh.points), _points(scene.numerics_of(shell).formulation, mesh)
    return _shell(shell, scene, size, _cells(mesh), mass, finest, between, note, made.sheets)


def _sections(made: Sheets, mesh: SurfaceMesh) -> str:
    """Of what the cells are made, in words."""
    parts = [(made.of == k, sheet) for k, sheet in enumerate(made.sheets)]
    said = [f"{own.sum()} cells of {show(sheet.thickness, 'm')} {sheet.material.name}" for own, sheet in parts[:6]]
    return f"sections: {', '.join(said)}" + (f" and {len(parts) - 6} more" if len(parts) > 6 else "")


def _counted_shell(shell: Shell, nodes: int, scene: Scene) -> BodyPlan:
    """By the count of its nodes and its own area."""
    assert not isinstance(shell.surface, Given)
    n = scene.numerics_of(shell)
    kind = "triangle" if n.cells == "triangle" else "quad"
    mass = shell.surface.area * shell.thickness * shell.material.density
    round_end = not isinstance(shell.surface, Plate | Roof | BoxTank) and getattr(shell.surface, "ends", "discs") == "discs"
    finest = n.spacing * (AT_HOLES if shell.surface.holes else ROUND if round_end else 1.0)
    return _shell(shell, scene, (nodes, nodes * (2 if kind == "triangle" else 1)), kind, mass, finest, (finest, n.spacing), "counted")


def _shell(
    shell: Shell,
    scene: Scene,
    size: tuple[int, int],
    kind: str,
    mass: float,
    finest: float,
    between: tuple[float, float],
    note: str,
    sheets: Sequence[Sheet] = (),
) -> BodyPlan:
    """size: nodes and cells; kind of most cells; mass [kg]; finest spacing and least and largest edge [m]; sheets: of its sections."""
    n = scene.numerics_of(shell)
    generated = not isinstance(shell.surface, Given)
    dt = math.inf
    for m, thickness, _ in sheets or [Sheet(shell.material, shell.thickness)]:
        factor = STEP[n.formulation.kind, kind]
        if shell.motion == "free":
            factor = (factor**-6 + _turning(thickness / finest, n) ** -6) ** (-1 / 6)
        factor *= 1 - n.irregularity**2 if generated else 1.0
        dt = min(dt, n.time_step_safety * factor * finest * math.sqrt(m.density * (1 - m.poisson**2) / m.young))
    area = None if isinstance(shell.surface, Given) or shell.sections else shell.surface.area
    return BodyPlan(
        name=shell.name,
        nodes=size[0],
        stress_points=size[1],
        mass=mass,
        analytic_mass=None if area is None else area * shell.thickness * shell.material.density,
        thickness=shell.thickness,
        spacing_min=between[0],
        spacing_max=between[1],
        dt=dt,
        note=note,
        memory=size[0] * (BYTES_PER_NODE[n.formulation.kind, kind] + (BENDING_BYTES_PER_NODE if shell.motion == "free" else 0)),
        every=shell.every or 1,
        rate=speed.RATE[speed.kind_of(shell)],
    )


def _check_detonations(scene: Scene, meshes: Mapping[str, SolidMesh]) -> None:
    """Every explosive begins to burn while the scene lasts."""
    for solid in scene.solids:
        if solid.material.burns is not None and (first := float(lit(solid, meshes[solid.name]).min())) >= scene.duration:
            raise SceneError(
                f"{scene.key_of(solid)}.detonation: its front comes to '{solid.name}' after {show(first, 's')}, and the scene lasts"
                f" {show(scene.duration, 's')}; light it nearer or sooner"
            )


def _rigid(solid: rigid_bodies.Solid) -> BodyPlan:
    """Its pinballs; it follows the step of the others."""
    body, radii = solid.said, solid.radii.tolist()
    surface = "" if solid.mesh is None else f"; surface of {len(solid.mesh.points)} nodes, {report(solid.mesh)}"
    note = f"rigid, inertia {', '.join(f'{m:.3g}' for m in solid.moments.diagonal())} kg m2 along x, y, z"
    return BodyPlan(
        name=body.name,
        nodes=len(radii),
        stress_points=0,
        mass=solid.mass,
        analytic_mass=None,
        thickness=2 * min(radii),
        spacing_min=2 * min(radii),
        spacing_max=2 * max(radii),
        dt=math.inf,
        rate=0.0,
        note=(note if body.free else "rigid, held" if body.held else "rigid, driven") + surface,
    )


def _fluid(fluid: Fluid, filling: Filling, scene: Scene, meshes: Mapping[str, SurfaceMesh]) -> BodyPlan:
    """Its particles, and the step of sound through them."""
    n, note = len(filling.points), "; ".join([filling.sentence, *too_narrow(scene, fluid.name, meshes)])
    mass = float(filling.mass * filling.whole)
    return _of_particles(fluid, scene, n, mass, fluid.water.density * filling.volume, filling.spacing, filling.finest, note)


def _counted_fluid(fluid: Fluid, n: int, scene: Scene) -> BodyPlan:
    """By the count of its particles, none of them split."""
    d = scene.numerics_of(fluid).spacing
    finest = d / 2**fluid.halvings
    return _of_particles(
        fluid, scene, n, fluid.water.density * n * d**3, None, d, finest, "counted" if finest == d else "counted, none of them split"
    )


def _of_particles(
    fluid: Fluid, scene: Scene, n: int, mass: float, analytic: float | None, spacing: float, finest: float, note: str
) -> BodyPlan:
    """A fluid of n particles; masses [kg], spacings [m]. Its step is that at rest, beside the shells that it presses on."""
    met = [shell for shell in scene.shells if fluid.contact is None and scene.met(fluid.name, shell.name).meet]
    light = min((shell.material.density * shell.thickness for shell in met), default=None)
    step = min(stable_step(d, fluid.water.sound, 0.0, fluid.support, fluid.water.density * d, light) for d in {spacing, finest})
    return BodyPlan(
        name=fluid.name,
        nodes=n,
        stress_points=0,
        mass=mass,
        analytic_mass=analytic,
        thickness=spacing,
        spacing_min=finest,
        spacing_max=spacing,
        dt=scene.numerics.time_step_safety * step,
        note=note,
        memory=FLUID_BYTES_PER_PARTICLE * n,
        every=fluid.every or 1,
        rate=speed.RATE["fluid"],
    )


def _solid(solid: Solid, mesh: SolidMesh, scene: Scene) -> BodyPlan:
    """Its cells, and the step of pressure waves through the smallest of them."""
    finest = float(np.cbrt(mesh.volumes * np.where(mesh.corners == 8, 1.0, 6.0)).min())
    mass = float(mesh.volumes.sum()) * solid.material.density
    note = "; ".join((f"{len(mesh.cells)} cells", *mesh.notes, *_pressed(solid)))
    return _of_cells(solid, scene, (len(mesh.points), len(mesh.cells)), mass, finest, note)


def _solid_part(one: of_solids.Part, made: Made, scene: Scene) -> BodyPlan:
    """A solid, or its elements, or its particles."""
    if one.whole.patch is None:
        return _solid(one.said, made.solids[one.whole.name], scene)
    split, mesh = of_solids.meshed(one, scene)
    assert split is not None
    own = one.said.name == one.whole.name
    mass = float((split.volumes_of_elements if own else split.volumes_of_particles).sum()) * one.said.material.density
    note = f"{'elements' if own else 'particles'} of solid '{one.whole.name}', {len(mesh.cells)} cells"
    return replace(_solid(one.said, mesh, scene), mass=mass, analytic_mass=None, note=note)


def _pressed(solid: Solid) -> list[str]:
    """A sentence on concrete whose cells may be pressed flat, which lowers the step under the one that is estimated."""
    damage = solid.material.damage
    if not isinstance(damage, Concrete) or damage.flattest is None:
        return []
    viscous = ", lower still by bulk viscosity" if solid.viscous else ""
    return [f"a cell may be pressed to {damage.flattest:g} of its length: the step may fall to that share of the estimate{viscous}"]


def _counted_solid(solid: Solid, scene: Scene) -> BodyPlan:
    """By the count of its nodes."""
    spacing = scene.numerics_of(solid).spacing
    assert isinstance(solid.shape, Generated)
    n = round(nodes_of_solid(solid.shape, spacing))
    return _of_cells(solid, scene, (n, n), solid.shape.volume * solid.material.density, spacing, "counted")


def _of_cells(solid: Solid, scene: Scene, size: tuple[int, int], mass: float, finest: float, note: str) -> BodyPlan:
    """size: nodes and cells; mass [kg]; finest spacing [m]."""
    m, kind = solid.material, solid.formulation.kind
    shape = solid.shape
    return BodyPlan(
        name=solid.name,
        nodes=size[0],
        stress_points=size[1],
        mass=mass,
        analytic_mass=shape.volume * m.density if isinstance(shape, Generated) else None,
        thickness=0.0,
        spacing_min=finest,
        spacing_max=scene.numerics_of(solid).spacing,
        dt=scene.numerics.time_step_safety * SOLID_STEP[kind] * finest / m.wave_speed / hastened(m),
        note=note,
        memory=size[0] * SOLID_BYTES_PER_NODE[kind],
        rate=speed.RATE[speed.kind_of(solid)],
    )


def _other(body: Body) -> BodyPlan:
    """A body of a kind that is not known here: what it says of itself."""
    points, mass, dt = body.sizes()
    return BodyPlan(body.name, points, 0, mass, None, 0.0, 0.0, 0.0, dt)


def _turning(slenderness: float, numerics: Numerics) -> float:
    """Stable step of the directors, like STEP; infinite where raised inertia keeps it above the membrane's (build.rotary)."""
    bound = numerics.formulation.shear_bound
    if numerics.raised_inertia and bound > 0:
        return math.inf
    return TURNING * math.sqrt(bound + max(slenderness**2, 1.0 if numerics.raised_inertia else 0.0))


def _points(form: Any, mesh: SurfaceMesh) -> int:
    """Stress points of a mesh in that form: one a cell, and as many as a quadrangle of finite elements has."""
    return len(mesh.cells) + (getattr(form, "points", 1) - 1) * int((mesh.cells[:, 3] >= 0).sum())


def _cells(mesh: SurfaceMesh) -> str:
    """What most of the cells are."""
    return "triangle" if (mesh.cells[:, 3] < 0).mean() > 0.5 else "quad"


def _by_newton(scene: Scene, nodes: int) -> bool:
    """Whether a search for equilibrium begins with Newton's method (bodies.shell.instead.statics)."""
    if scene.static is None or scene.static.method == "relaxation":
        return False
    able = scene.numerics.precision == "f64" and all(scene.numerics_of(shell).formulation.kind != "collocation" for shell in scene.shells)
    return scene.static.method is not None or (able and nodes <= LARGEST)


def _check_regions(scene: Scene, meshes: dict[str, Any]) -> None:
    held: dict[str, list[tuple[int, np.ndarray]]] = {}
    sizes = {name: (extent(mesh.points), extent(mesh.centres)) for name, mesh in meshes.items()}
    for key in ("forces", "moments", "motions", "initial"):
        for number, load in enumerate(getattr(scene, key)):
            body, mesh = scene.body(load.body), meshes.get(load.body)
            points = body.places() if mesh is None else mesh.points
            if points is None:
                continue
            try:
                caught = inside(load.where, points) if mesh is None else nodes_in(load.where, mesh, sizes[load.body][0])
            except SceneError as error:
                raise SceneError(f"{key}[{number}].where: {error}") from None
            if not caught.any():
                low, high = points.min(axis=0), points.max(axis=0)
                where = f"{key}[{number}].where catches no"
                if mesh is None and len(points) == 1:
                    there = ", ".join(f"{a} {show(at, 'm')}" for a, at in zip("xyz", low))
                    raise SceneError(f"{where} point of {body.what} '{load.body}', which is at {there}")
                reach = ", ".join(f"{a} {show(lo, 'm')} to {show(hi, 'm')}" for a, lo, hi in zip("xyz", low, high))
                point, apart = ("point", "") if mesh is None else ("node", f" with nodes {show(mesh.spacing, 'm')} apart")
                raise SceneError(f"{where} {point} of {body.what} '{load.body}', which reaches over {reach}{apart}")
            if key == "motions":
                held.setdefault(load.body, []).append((number, caught))
    for number, pressure in enumerate(scene.pressures):
        mesh = meshes.get(pressure.body)
        if mesh is None or pressure.where is None:
            continue
        if not _caught(pressure.where, mesh, sizes[pressure.body][1], f"pressures[{number}].where"):
            raise SceneError(
                f"pressures[{number}].where catches no cell of shell '{pressure.body}', whose nodes are {show(mesh.spacing, 'm')} apart"
            )
    for index, shell in enumerate(scene.shells):
        for number, region in enumerate(shell.sound):
            if not _caught(region, meshes[shell.name], sizes[shell.name][1], f"shells[{index}].sound[{number}]"):
                raise SceneError(
                    f"shells[{index}].sound[{number}] catches no stress point of shell '{shell.name}', whose nodes are "
                    f"{show(meshes[shell.name].spacing, 'm')} apart"
                )
    for name, regions in held.items():
        holder = np.full(len(regions[0][1]), -1)  # the first region that holds a node
        clashes = []
        for place, (_, caught) in enumerate(regions):
            before = holder[caught]
            clashes += [(int(before[before >= 0].min()), place)] if (before >= 0).any() else []
            holder[caught & (holder < 0)] = place
        if clashes:
            i, j = min(clashes)
            raise SceneError(
                f"motions[{regions[i][0]}] and motions[{regions[j][0]}] both hold {int((regions[i][1] & regions[j][1]).sum())} nodes of "
                f"{scene.body(name).what} '{name}': a node can follow one motion, so let the regions not overlap"
            )


def _caught(region: Region, mesh: SurfaceMesh, size: float, key: str) -> bool:
    """Whether a region holds a cell; SceneError that names its key for a group that is not there."""
    try:
        return bool(cells_in(region, mesh, size).any())
    except SceneError as error:
        raise SceneError(f"{key}: {error}") from None


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


def _check_springs(scene: Scene, meshes: dict[str, Any]) -> None:
    """The ends of springs lie on their bodies."""
    for number, spring in enumerate(scene.springs):
        for end, (name, point) in enumerate(zip(spring.between, spring.points)):
            if name not in meshes:
                continue
            mesh = meshes[name]
            away = float(np.linalg.norm(mesh.points - np.asarray(point), axis=1).min())
            allowed = spring.radius or 2 * mesh.spacing
            if away > allowed:
                within = "its radius" if spring.radius else "2 node spacings"
                raise SceneError(
                    f"springs[{number}].points[{end}] is {show(away, 'm')} from the nearest node of '{name}', beyond {within}, "
                    f"{show(allowed, 'm')}: an end must lie on its body"
                )


def _check_gauges(scene: Scene, meshes: dict[str, SurfaceMesh]) -> None:
    """Strain gauges lie on their shells, in their surface."""
    for number, gauge in enumerate(scene.output.gauges):
        assert gauge.body is not None  # the scene names it
        shell, mesh = scene.body(gauge.body), meshes[gauge.body]
        away = np.linalg.norm(mesh.centres - np.asarray(gauge.point), axis=1)
        nearest, allowed = int(away.argmin()), mesh.spacing + 0.5 * shell.thickness
        if away[nearest] > allowed:
            place, there = (", ".join(show(float(at), "m") for at in p) for p in (gauge.point, mesh.centres[nearest]))
            raise SceneError(
                f"output.gauges[{number}].point ({place}) is {show(float(away[nearest]), 'm')} from shell '{shell.name}': its nearest cell "
                f"is at ({there}), and a gauge may be {show(allowed, 'm')} off"
            )
        normals = mesh.frames[away <= max(away[nearest], 0.5 * (gauge.length or 0.0)), 2]
        along = np.asarray(gauge.along, float) / np.linalg.norm(gauge.along)
        if (np.linalg.norm(along - np.outer(normals @ along, np.ones(3)) * normals, axis=1) < LEAST_WITHIN).any():
            raise SceneError(
                f"output.gauges[{number}].along {gauge.along} is the normal of shell '{shell.name}' there; a gauge lies in its surface"
            )


def _check_gases(scene: Scene, made: Made) -> None:
    """Gas is in a closed shell and has room there."""
    for number, gas in enumerate(scene.gases):
        mesh = made.meshes[gas.body]
        if (mesh.edges.sides[:, 1] < 0).any():
            raise SceneError(f"gases[{number}]: shell '{gas.body}' is open, and gas that flows out is not possible yet; close it")
        water = sum(made.fillings[f.name].volume for f in scene.fluids if getattr(f.fill, "shell", None) == gas.body)
        if mesh.volume < 0 or water > 0.99 * mesh.volume:
            why = "its normals point inward" if mesh.volume < 0 else "it is full of water"
            raise SceneError(f"gases[{number}]: there is no room for gas in shell '{gas.body}': {why}")


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
