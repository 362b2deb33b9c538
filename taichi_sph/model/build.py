"""Scene -> pools: meshes become nodes and cells, loads become node lists. The only bridge between the two."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..scene.schema import Ramp, Scene
from .mesh import SurfaceMesh
from .plan import mesh_of
from .pools import Cells, MaterialPool, Nodes
from .regions import inside


@dataclass
class Model:
    """What exists."""

    mesh: SurfaceMesh
    nodes: Nodes
    cells: Cells
    material: MaterialPool


def build(scene: Scene) -> Model:
    """Allocate and fill the pools of the scene's shell. `dim` 2: it stays in its plane."""
    shell = scene.shells[0]
    mesh = mesh_of(shell, scene)
    nodes = Nodes(mesh, mesh.node_areas * shell.thickness * shell.material.density, dim=2)
    return Model(mesh, nodes, Cells(mesh, shell.thickness, nodes), MaterialPool(shell.material, shell.thickness))


def node_forces(scene: Scene, mesh: SurfaceMesh, dim: int):
    """For forces.loads: (node numbers, (n, dim) forces, rise) of every NodalForce, shared by node area."""
    for load in scene.forces:
        i = np.flatnonzero(inside(load.where, mesh.points))
        share = mesh.node_areas[i] / mesh.node_areas[i].sum()
        yield i, share[:, None] * np.asarray(load.total)[None, :dim], _rise(load.history)


def node_motions(scene: Scene, mesh: SurfaceMesh, dim: int):
    """For forces.loads: (node numbers, mask, velocity, rise) of every PrescribedVelocity."""
    for motion in scene.motions:
        i = np.flatnonzero(inside(motion.where, mesh.points))
        given = motion.velocity[:dim]
        yield i, [v is not None for v in given], [v or 0.0 for v in given], _rise(motion.history)


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


def _rise(history) -> float:
    return history.rise if isinstance(history, Ramp) else 0.0
