"""Scene -> pools: meshes become nodes and cells, loads become node lists. The only bridge between the two."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.mesh import SurfaceMesh
from ...geometry.regions import inside
from ...geometry.surfaces import mesh_of
from ...scene import Ramp, Scene
from ..nodal.nodes import Nodes
from .pool import Cells, MaterialPool


@dataclass
class Model:
    """What exists."""

    mesh: SurfaceMesh
    nodes: Nodes
    cells: Cells
    material: MaterialPool


def build(scene: Scene) -> Model:
    """Allocate and fill the pools of the scene's shell."""
    shell = scene.shells[0]
    bends = shell.motion == "free"
    mesh = mesh_of(shell, scene)
    mass = mesh.node_areas * shell.thickness * shell.material.density
    inertia = mass * rotary(mesh.node_spacing, shell.thickness, scene.numerics) if bends else None
    nodes = Nodes(mesh, mass, inertia)
    spared = [inside(region, mesh.centres) for region in shell.sound]
    material = MaterialPool(shell.material, shell.thickness, bends, mesh.spacing)
    cells = Cells(mesh, nodes, material, np.any(spared, axis=0) if spared else None)
    return Model(mesh, nodes, cells, material)


def rotary(spacing: np.ndarray, thickness: float, numerics) -> np.ndarray:
    """(N,) rotary inertia per mass [m2]: e^2/12, raised so that turning does not rule the step.

    galerkin: with the bounded shear the fastest director turns at about sqrt(1 + 1/(alpha + (e/D)^2)) times the
    membrane frequency, so raising e^2/12 by 1 + (1.2/alpha - 1) / (1 + (e/D)^2 / alpha), 12 at most for
    alpha = 0.1, reaches the membrane's step. Without the bound, I_opt = max(e^2, D^2)/12 (T 2.52), which raises it by
    (D/e)^2 without limit.
    """
    alpha = numerics.formulation.shear_bound
    own = thickness**2 / 12.0 * np.ones_like(spacing)
    if not numerics.raised_inertia:
        return own
    if alpha == 0:
        return np.maximum(own, spacing**2 / 12.0)
    return own * (1.0 + (1.2 / alpha - 1.0) / (1.0 + (thickness / spacing) ** 2 / alpha))


def node_forces(scene: Scene, mesh: SurfaceMesh, dim: int):
    """For bodies.nodal.loads: (node numbers, (n, dim) forces, rise) of every NodalForce, shared by node area, and gravity."""
    for load in scene.forces:
        i = np.flatnonzero(inside(load.where, mesh.points))
        share = mesh.node_areas[i] / mesh.node_areas[i].sum()
        yield i, share[:, None] * np.asarray(load.total)[None, :dim], rise(scene, load.history)
    if scene.gravity is not None:
        shell = scene.shells[0]
        weight = mesh.node_areas * shell.thickness * shell.material.density
        yield np.arange(len(weight)), weight[:, None] * np.asarray(scene.gravity)[None, :dim], rise(scene, None)


def node_moments(scene: Scene, mesh: SurfaceMesh):
    """For bodies.nodal.loads: (node numbers, (n, 3) moments, rise) of every NodalMoment, shared by node area."""
    for load in scene.moments:
        i = np.flatnonzero(inside(load.where, mesh.points))
        share = mesh.node_areas[i] / mesh.node_areas[i].sum()
        yield i, share[:, None] * np.asarray(load.total)[None, :], rise(scene, load.history)


def node_motions(scene: Scene, mesh: SurfaceMesh, dim: int):
    """For bodies.nodal.loads: (node numbers, mask, velocity, mask, spin, rise) of every PrescribedVelocity."""
    for motion in scene.motions:
        i = np.flatnonzero(inside(motion.where, mesh.points))
        given, spin = motion.velocity[:dim], motion.spin
        yield (
            i,
            [v is not None for v in given],
            [v or 0.0 for v in given],
            [w is not None for w in spin],
            [w or 0.0 for w in spin],
            rise(scene, motion.history),
        )


def initial_velocity(scene: Scene, mesh: SurfaceMesh, dim: int) -> np.ndarray:
    """(N, dim) velocities at t = 0; later entries of the scene overwrite earlier ones."""
    v = np.zeros((len(mesh.points), dim))
    for start in scene.initial:
        i = inside(start.where, mesh.points)
        shape = np.ones(len(mesh.points))
        if start.pulse is not None:
            shape = np.exp(-(((mesh.points[:, 0] - start.pulse.centre) / start.pulse.width) ** 2))
        v[i] = shape[i, None] * np.asarray(start.velocity)[None, :dim]
    return v


def rise(scene: Scene, history) -> float:
    """Time over which a load grows [s]; of a static scene that asks for a step, the whole pseudo-time."""
    if isinstance(history, Ramp):
        return history.rise
    return scene.duration if scene.static is not None else 0.0
