"""Scene -> pools: meshes become nodes and cells, loads become node lists. The only bridge between the two."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...geometry.mesh import SurfaceMesh, joined
from ...geometry.regions import cells_in, nodes_in
from ...laws.scatter import shares
from ...scene import Ramp, Scene, Step
from ...scene.histories import Points
from ...scene.numerics import Numerics
from ...scene.regions import Region
from ..body import Span
from ..nodal.nodes import Nodes
from .parts import Part, Split, meshed, parts
from .pool import Cells, MaterialPool, StressPoints, Topology
from .said import Shell
from .sections import Sheets, mean_at_nodes, sheets_of


@dataclass(frozen=True)
class ShellBody:
    """One shell of a group: what was said of it, how it is computed, its mesh, of what its cells are made, and its share of the pools.
    points: its stress points; first_sheet: row of the first of its sheets in the pool of materials.

    of: the name of the shell that it is, or is a part of; split: the parts of that shell, None where it is whole."""

    said: Shell
    numerics: Numerics
    mesh: SurfaceMesh
    made: Sheets
    first_sheet: int
    nodes: Span
    cells: Span
    points: Span
    of: str
    split: Split | None = None

    @property
    def name(self) -> str:
        return self.said.name

    @property
    def thickness(self) -> np.ndarray:
        """(n,) at the nodes [m]: where sheets meet the mean of theirs."""
        return spread_over_nodes([self], [sheet.thickness for sheet in self.made.sheets])

    @property
    def node_areas(self) -> np.ndarray:
        """(N,) area that each node owns by its cells alone, weighed where there are two parts [m2]."""
        if self.split is None:
            return self.mesh.node_areas
        return self.split.areas_of_elements if self.name == self.of else self.split.areas_of_particles

    @property
    def weights(self) -> np.ndarray | None:
        """(M,) or (M, points) what each stress point counts; None: 1."""
        if self.split is None:
            return None
        if self.name == self.of:
            return self.split.of_elements(self.points.n // self.cells.n)
        return self.split.of_particles

    def share(self, where: Region | None, own: float) -> float:
        """Area of the nodes of the whole shell in a region [m2]; own: of those of this part."""
        return own if self.split is None else self.split.area_in(where)


@dataclass
class Model:
    """What exists: the bodies, their meshes as one, and the pools. cells: what the cells of the mesh join; points: the stress points, which
    are the cells where each of them has one."""

    bodies: tuple[ShellBody, ...]
    mesh: SurfaceMesh
    nodes: Nodes
    cells: Any  # Cells, or a Topology
    points: StressPoints
    material: MaterialPool


def laws(scene: Scene, shell: Shell) -> tuple:
    """What is compiled for a shell. Shells of the same laws stand in one pool; numbers do not count, for they are fields.

    Last: how many steps of the clock its own step is long."""
    material, form = shell.material, scene.numerics_of(shell).formulation
    bends = shell.motion == "free"
    history = (*material.laws, bool(shell.sound))
    terms: tuple = ()
    if form.kind == "collocation":
        viscous = bool(form.viscosity.alpha or form.viscosity.beta or (form.viscosity.gamma and bends))
        terms = (viscous, bool(form.edge_filter), bool(form.spin_filter), form.selective_shear)
    if form.kind == "elements":
        terms = (form.points,)
    every = 1 if scene.increments is not None else shell.every or 1
    return (shell.motion, history, form.kind, terms, every)


def alike(scene: Scene, kind: str) -> Iterator[tuple[str, list[Part]]]:
    """The shells of the scene, or parts of them, whose form belongs to that kind of body, those of the same laws together, in the order of
    the first of them; before each set the end of the names of its pools: "", "_2" and so on. A part stands alone."""
    found: dict[tuple, list[Part]] = {}
    for one in parts(scene):
        alone = () if one.whole.patch is None else (one.said.name,)
        found.setdefault((laws(scene, one.said), *alone), []).append(one)
    for k, some in enumerate(found.values(), start=1):
        if scene.numerics_of(some[0].said).formulation.body == kind:
            yield f"_{k}" if k > 1 else "", some


def build(scene: Scene, some: Sequence[Part], suffix: str = "", per_cell: int = 1) -> Model:
    """Allocate and fill the pools of shells of the same laws; suffix: of the names of the pools; per_cell: stress points of a cell, those
    of cell c from per_cell * c on."""
    bodies: list[ShellBody] = []
    node, cell, sheet = 0, 0, 0
    shells = [one.said for one in some]
    for one, shell in zip(some, shells):
        split, mesh = meshed(one, scene)
        n, m = len(mesh.points), len(mesh.cells)
        spans = Span(shell.name, node, n), Span(shell.name, cell, m), Span(shell.name, per_cell * cell, per_cell * m)
        # a neck is spread over the width of a cell; both parts of a shell take that of the particles
        made = sheets_of(shell, mesh, f"{scene.key_of(one.whole)}.sections", mesh.spacing if split is None else split.spacing)
        bodies.append(ShellBody(shell, scene.numerics_of(shell), mesh, made, sheet, *spans, one.whole.name, split))
        node, cell, sheet = node + n, cell + m, sheet + len(made.sheets)
    mesh = joined([body.mesh for body in bodies])
    bends = shells[0].motion == "free"
    mass, inertia = masses(bodies, lambda of_cells: quarters(bodies, of_cells))
    numbers = np.arange(len(bodies))
    nodes = Nodes(mesh, mass, inertia, by_node(bodies, numbers), f"nodes{suffix}")
    material = MaterialPool([made for body in bodies for made in body.made.sheets], bends, f"material{suffix}")
    spared = None
    if shells[0].sound:
        spared = np.concatenate([np.any([cells_in(region, body.mesh) for region in body.said.sound], axis=0) for body in bodies])
    of_cell = by_cell(bodies, numbers)
    sheets = None if all(body.made.even for body in bodies) else np.concatenate([body.first_sheet + body.made.of for body in bodies])
    tough = np.concatenate([_tough(body) for body in bodies]) if material.scatters else None
    if per_cell == 1:
        cells = Cells(mesh, nodes, material, spared, of_cell, sheets, f"cells{suffix}")
        if tough is not None:
            cells.scatter(tough)
        return Model(tuple(bodies), mesh, nodes, cells, cells, material)
    spared, sheets = (None if of is None else np.repeat(of, per_cell) for of in (spared, sheets))
    points = StressPoints(per_cell * len(mesh.cells), nodes, material, spared, np.repeat(of_cell, per_cell), sheets, f"points{suffix}")
    if tough is not None:
        points.scatter(np.repeat(tough, per_cell))
    return Model(tuple(bodies), mesh, nodes, Topology(mesh, nodes, f"cells{suffix}"), points, material)


def _tough(body: ShellBody) -> np.ndarray:
    """(M,) share of the strains of damage that each cell of a body has."""
    variation = [getattr(sheet.material.damage, "scatter", None) for sheet in body.made.sheets]
    found = np.ones(len(body.mesh.cells))
    for k, one in enumerate(variation):
        own = body.made.of == k
        if one and own.any():
            found[own] = shares(body.mesh.centres[own], one, body.numerics.seed)
    return found


def quarters(bodies: Sequence[ShellBody], of_cells: np.ndarray | None = None) -> np.ndarray:
    """(N,) area that each node owns by its cells alone: a quarter of a quadrangle [m2]; of_cells (M,): what a cell has per area instead of
    1."""
    if of_cells is None:
        return np.concatenate([body.node_areas for body in bodies])
    return np.concatenate([body.mesh.shared(of_cells[body.cells.rows]) for body in bodies])


def masses(bodies: Sequence[ShellBody], areas: Callable[[np.ndarray | None], np.ndarray]) -> tuple[np.ndarray, np.ndarray | None]:
    """(N,) masses [kg] and rotary inertias [kg m2] of nodes; inertia None where the bodies stay in their plane. areas: the area of each
    node [m2], or what cells with so much per area (M,) give it."""
    if all(body.made.even for body in bodies):
        mass = areas(None) * by_node(bodies, [body.made.sheets[0].thickness for body in bodies])
        mass = mass * by_node(bodies, [body.made.sheets[0].material.density for body in bodies])
    else:
        mass = areas(np.concatenate([body.made.areal for body in bodies]))
    if bodies[0].said.motion != "free":
        return mass, None
    return mass, mass * np.concatenate([rotary(node_widths(body), body.thickness, body.numerics) for body in bodies])


def by_node(bodies: Sequence[ShellBody], values: Any) -> np.ndarray:
    """(N,) one value a body -> that of the body of each node."""
    return np.repeat(np.asarray(values), [body.nodes.n for body in bodies])


def by_cell(bodies: Sequence[ShellBody], values: Any) -> np.ndarray:
    """(M,) one value a body -> that of the body of each cell."""
    return np.repeat(np.asarray(values), [body.cells.n for body in bodies])


def spread_over_nodes(bodies: Sequence[ShellBody], values: Any) -> np.ndarray:
    """(N,) one value a sheet -> at each node the mean of those of the cells around it."""
    values = np.asarray(values, float)
    parts = []
    for body, first in zip(bodies, np.cumsum([0, *(len(body.made.sheets) for body in bodies)])):
        own = values[first : first + len(body.made.sheets)]
        parts.append(np.full(body.nodes.n, own[0]) if body.made.even else mean_at_nodes(body.mesh, own[body.made.of]))
    return np.concatenate(parts)


def spread_over_cells(bodies: Sequence[ShellBody], values: Any) -> np.ndarray:
    """(M,) one value a sheet -> that of the sheet of each cell."""
    first = np.cumsum([0, *(len(body.made.sheets) for body in bodies)])
    return np.concatenate([np.asarray(values)[start + body.made.of] for body, start in zip(bodies, first)])


def centred(bodies: Sequence[ShellBody]) -> np.ndarray:
    """(N, 3) reference positions, from the mean of the body's own [m]."""
    return np.concatenate([body.mesh.points - body.mesh.points.mean(axis=0) for body in bodies])


def longest_diagonal(mesh: SurfaceMesh) -> float:
    """Largest distance between two corners of a cell [m]."""
    ends = mesh.points[np.where(mesh.cells < 0, mesh.cells[:, :1], mesh.cells)]
    return float(np.linalg.norm(ends[:, :, None] - ends[:, None, :], axis=3).max())


def cell_spacing(mesh: SurfaceMesh) -> np.ndarray:
    """(M,) mean of the local spacing at the corners [m]; a triangle's first corner counts twice."""
    corner = np.where(mesh.cells < 0, mesh.cells[:, :1], mesh.cells)
    return mesh.node_spacing[corner].mean(axis=1)


def node_widths(body: ShellBody) -> np.ndarray:
    """(N,) local spacing [m] that the rotary inertia goes by: of a shell in parts that of its particles, everywhere."""
    return body.mesh.node_spacing if body.split is None else np.full(len(body.mesh.points), body.split.spacing)


def cell_widths(bodies: Sequence[ShellBody], mesh: SurfaceMesh) -> np.ndarray:
    """(M,) spacing [m] that the bounded shear of the cells goes by, in the same way."""
    found = cell_spacing(mesh)
    for body in bodies:
        if body.split is not None:
            found[body.cells.rows] = body.split.spacing
    return found


def weighed(bodies: Sequence[ShellBody], areas: np.ndarray) -> np.ndarray:
    """Areas of all stress points times what each counts."""
    found = areas.copy()
    for body in bodies:
        if (weights := body.weights) is not None:
            found[body.points.rows] *= weights.ravel()
    return found


def bounded_shear(
    bodies: Sequence[ShellBody],
    spread: Callable[[Sequence[ShellBody], Any], np.ndarray],
    constants: Sequence[tuple[float, float, float]],
    spacing: np.ndarray,
    scale: np.ndarray | float = 1.0,
) -> np.ndarray:
    """scale x G_s [N/m], G_s = 5/6 G e / (1 + alpha (D/e)^2), of nodes or cells of that spacing D; spread: over those, from sheets;
    constants: e, E, nu of each sheet."""
    whole = spread(bodies, [5.0 / 6.0 * young * e / (2.0 * (1.0 + nu)) for e, young, nu in constants])
    bound = spread(bodies, [body.numerics.formulation.shear_bound for body in bodies for _ in body.made.sheets])
    e = spread(bodies, [e for e, _, _ in constants])
    return scale * whole / (1.0 + bound * (spacing / e) ** 2)


def rotary(spacing: np.ndarray, thickness: np.ndarray, numerics: Numerics) -> np.ndarray:
    """(N,) rotary inertia per mass [m2]: e^2/12, raised so that turning does not rule the step.

    galerkin: with the bounded shear the fastest director turns at about sqrt(1 + 1/(alpha + (e/D)^2)) times the
    membrane frequency, so raising e^2/12 by 1 + (1.2/alpha - 1) / (1 + (e/D)^2 / alpha), 12 at most for
    alpha = 0.1, reaches the membrane's step. Without the bound, I_opt = max(e^2, D^2)/12 (T 2.52), which raises it by
    (D/e)^2 without limit.
    """
    alpha = numerics.formulation.shear_bound
    own = thickness**2 / 12.0
    if not numerics.raised_inertia:
        return own
    if alpha == 0:
        return np.maximum(own, spacing**2 / 12.0)
    return own * (1.0 + (1.2 / alpha - 1.0) / (1.0 + (thickness / spacing) ** 2 / alpha))


def _loaded(scene: Scene, bodies: Sequence[ShellBody], key: str) -> Iterator[tuple[ShellBody, Any, np.ndarray]]:
    """Each load under that key with its body and its nodes, by their numbers in the body."""
    for body in bodies:
        for load in scene.loads_of(key, body.of):
            yield body, load, np.flatnonzero(nodes_in(load.where, body.mesh))


def node_forces(scene: Scene, bodies: Sequence[ShellBody], areas: np.ndarray, mass: np.ndarray, dim: int) -> Iterator[tuple]:
    """For bodies.nodal.loads: (node numbers, (n, dim) forces, history) of every NodalForce, shared by the areas (N,) of the nodes, and
    gravity on their masses (N,) [kg]."""
    for body, load, i in _loaded(scene, bodies, "forces"):
        own = areas[body.nodes.rows][i]
        share = own / body.share(load.where, own.sum())
        yield body.nodes.first + i, share[:, None] * np.asarray(load.total)[None, :dim], curve(scene, load.history)
    if scene.gravity is not None:
        for body in bodies:
            weight = mass[body.nodes.rows]
            numbers = body.nodes.first + np.arange(len(weight))
            yield numbers, weight[:, None] * np.asarray(scene.gravity)[None, :dim], curve(scene)


def node_moments(scene: Scene, bodies: Sequence[ShellBody], areas: np.ndarray) -> Iterator[tuple]:
    """For bodies.nodal.loads: (node numbers, (n, 3) moments, history) of every NodalMoment, shared by the areas (N,) of the nodes."""
    for body, load, i in _loaded(scene, bodies, "moments"):
        own = areas[body.nodes.rows][i]
        share = own / body.share(load.where, own.sum())
        yield body.nodes.first + i, share[:, None] * np.asarray(load.total)[None, :], curve(scene, load.history)


def node_motions(scene: Scene, bodies: Sequence[ShellBody], dim: int) -> Iterator[tuple]:
    """For bodies.nodal.loads: (node numbers, mask, velocity, mask, spin, history) of every PrescribedVelocity."""
    for body, motion, i in _loaded(scene, bodies, "motions"):
        if body.split is not None and not len(i):
            continue  # it holds the other part
        given, spin = motion.velocity[:dim], motion.spin
        yield (
            body.nodes.first + i,
            [v is not None for v in given],
            [v or 0.0 for v in given],
            [w is not None for w in spin],
            [w or 0.0 for w in spin],
            curve(scene, motion.history),
        )


def initial_velocity(scene: Scene, bodies: Sequence[ShellBody], dim: int) -> np.ndarray:
    """(N, dim) velocities at t = 0; later entries of the scene overwrite earlier ones."""
    v = np.zeros((sum(body.nodes.n for body in bodies), dim))
    for body, start, i in _loaded(scene, bodies, "initial"):
        v[body.nodes.first + i] = start.at(body.mesh.points[i])[:, :dim]
    return v


def initial_spin(scene: Scene, bodies: Sequence[ShellBody]) -> np.ndarray:
    """(N, 3) spins of the directors at t = 0: what of a rotation lies across them, for there is no drilling."""
    omega = np.zeros((sum(body.nodes.n for body in bodies), 3))
    for body, start, i in _loaded(scene, bodies, "initial"):
        normal = body.mesh.node_normals[i]
        spin = np.broadcast_to((0.0, 0.0, 0.0) if start.rotation is None else start.rotation.spin, normal.shape)
        omega[body.nodes.first + i] = spin - np.einsum("ni,ni->n", spin, normal)[:, None] * normal
    return omega


def pressed_cells(body: ShellBody, where: Region | None) -> np.ndarray:
    """Numbers of the cells of a body that a pressure acts on: those whose middle is in the region, by itself all."""
    mine = np.arange(body.cells.n) if where is None else np.flatnonzero(cells_in(where, body.mesh))
    return body.cells.first + mine


def curve(scene: Scene, history: Any = None) -> Points:
    """Points of a load's history, by itself a step; in a static scene a step grows over the whole pseudo-time."""
    if scene.static is not None and isinstance(history, Step | None):
        return Ramp(rise=scene.duration).points
    return (history or Step()).points
