"""Scene -> pools of solids: meshes become nodes and cells, loads become node lists."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...geometry.regions import inside
from ...geometry.solids import SolidMesh, Split
from ...scene import Material, Scene, Step
from ..body import Span
from .parts import Part, meshed, parts
from .said import Solid

BURNS = 2.5  # of the frequency: bulk viscosity in the front of a detonation


@dataclass(frozen=True)
class SolidBody:
    """One solid of a group: what was said of it, its mesh, and its share of the pools.

    of: the name of the solid that it is, or is a part of; split: the parts of that solid, None where it is whole."""

    said: Solid
    mesh: SolidMesh
    nodes: Span
    cells: Span
    of: str
    split: Split | None = None

    @property
    def name(self) -> str:
        return self.said.name

    @property
    def weights(self) -> np.ndarray:
        """(M,) what each cell counts."""
        if self.split is None:
            return np.ones(len(self.mesh.cells))
        return self.split.of_elements if self.name == self.of else self.split.of_particles

    @property
    def node_volumes(self) -> np.ndarray:
        """(N,) what each node owns, weighed where there are two parts [m3]."""
        if self.split is None:
            return self.mesh.node_volumes
        return self.split.volumes_of_elements if self.name == self.of else self.split.volumes_of_particles

    def shares(self, where: Any, i: np.ndarray) -> np.ndarray:
        """(n,) of a force on the nodes of the whole solid in a region, the shares of the nodes i of this part: by their areas, and where
        none of them has any by their volumes."""
        if self.split is None:
            own = self.mesh.node_areas[i]
            own = own if own.any() else self.mesh.node_volumes[i]
            return own / own.sum()
        split, mine = self.split, self.name == self.of
        elements, particles = inside(where, split.elements.points), inside(where, split.fine.mesh.points)
        area = split.areas_of_elements[elements].sum() + split.areas_of_particles[particles].sum()
        if area > 0:
            return (split.areas_of_elements if mine else split.areas_of_particles)[i] / area
        return self.node_volumes[i] / (split.volumes_of_elements[elements].sum() + split.volumes_of_particles[particles].sum())


def laws(solid: Solid) -> tuple:
    """What is compiled for a solid. Solids of the same laws stand in one pool; numbers do not count, for they are fields."""
    material = solid.material
    strength, damage = material.strength, material.damage
    hardens = (
        None
        if strength is None
        else (strength.kind == "table", strength.kind == "johnson_cook", getattr(strength, "heat", None) is not None)
    )
    breaks = (
        None
        if damage is None
        else (damage.kind, getattr(damage, "strain", None), getattr(damage, "rubble", None), getattr(damage, "flattest", None) is None)
    )
    burns = material.burns is not None
    return (hardens, breaks, material.delay is not None, material.critical_damage is not None, solid.viscous, solid.formulation.kind, burns)


def alike(solids: Sequence[Solid]) -> Iterator[tuple[str, list[Part]]]:
    """The solids of the same laws, or parts of them, together, in the order of the first of them; before each set the end of the names of
    its pools. A part stands alone."""
    found: dict[tuple, list[Part]] = {}
    for one in parts(solids):
        alone = () if one.whole.patch is None else (one.said.name,)
        found.setdefault((*laws(one.said), *alone), []).append(one)
    for k, same in enumerate(found.values(), start=1):
        yield f"_{k}" if k > 1 else "", same


def bodies_of(scene: Scene, some: Sequence[Part]) -> tuple[SolidBody, ...]:
    """Their meshes, one after the other."""
    made: list[SolidBody] = []
    node, cell = 0, 0
    for one in some:
        solid, (split, mesh) = one.said, meshed(one, scene)
        n, m = len(mesh.points), len(mesh.cells)
        made.append(SolidBody(solid, mesh, Span(solid.name, node, n), Span(solid.name, cell, m), one.whole.name, split))
        node, cell = node + n, cell + m
    return tuple(made)


def _loaded(scene: Scene, bodies: Sequence[SolidBody], key: str) -> Iterator[tuple[SolidBody, Any, np.ndarray]]:
    """Each load under that key with its body and its nodes, by their numbers in the body."""
    for body in bodies:
        for load in scene.loads_of(key, body.of):
            yield body, load, np.flatnonzero(inside(load.where, body.mesh.points))


def node_forces(scene: Scene, bodies: Sequence[SolidBody], mass: np.ndarray) -> Iterator[tuple]:
    """For bodies.nodal.loads: (node numbers, (n, 3) forces, history) of every NodalForce, and gravity. A force is shared by the areas of
    the nodes on the surface; where it catches none of those, by their volumes."""
    for body, load, i in _loaded(scene, bodies, "forces"):
        yield body.nodes.first + i, body.shares(load.where, i)[:, None] * np.asarray(load.total), load.history.points
    if scene.gravity is not None:
        yield np.arange(len(mass)), mass[:, None] * np.asarray(scene.gravity), Step().points


def motions_of(scene: Scene, body: SolidBody) -> list[int]:
    """Numbers, from 1 on, of the motions of the scene that hold a body."""
    return [
        k
        for k, motion in enumerate(scene.motions, start=1)
        if motion.body == body.of and (body.split is None or inside(motion.where, body.mesh.points).any())
    ]


def node_motions(scene: Scene, bodies: Sequence[SolidBody]) -> Iterator[tuple]:
    """For bodies.nodal.loads: (node numbers, mask, velocity, no mask and no spin, history) of every PrescribedVelocity."""
    for body, motion, i in _loaded(scene, bodies, "motions"):
        if body.split is not None and not len(i):
            continue  # it holds the other part
        given = motion.velocity
        yield body.nodes.first + i, [v is not None for v in given], [v or 0.0 for v in given], (), (), motion.history.points


def hastened(material: Material) -> float:
    """How many times as fast as before it burns an explosive swings, in the front of its detonation; 1 for others."""
    return 1.0 if material.burns is None else BURNS * max(1.0, material.burns.speed / material.wave_speed)


def chemical(body: SolidBody) -> float:
    """Energy [J/m3] of a body of explosive before it burns; 0 of others."""
    gas = body.said.material.burns
    return 0.0 if gas is None else gas.energy


def lit(solid: Solid, mesh: SolidMesh) -> np.ndarray:
    """(M,) when the front of the detonation reaches the middle of each cell of a body of explosive [s]. It runs straight: nothing stands in
    its way. From a plane it runs to both sides."""
    said, gas = solid.detonation, solid.material.burns
    assert said is not None and gas is not None
    away = mesh.centres - np.asarray(said.point)
    if said.normal is None:
        far = np.linalg.norm(away, axis=1)
    else:
        far = np.abs(away @ np.asarray(said.normal)) / np.linalg.norm(said.normal)
    return said.time + far / gas.speed


def initial_velocity(scene: Scene, bodies: Sequence[SolidBody]) -> np.ndarray:
    """(N, 3) velocities at t = 0; later entries of the scene overwrite earlier ones."""
    v = np.zeros((sum(body.nodes.n for body in bodies), 3))
    for body, start, i in _loaded(scene, bodies, "initial"):
        v[body.nodes.first + i] = start.at(body.mesh.points[i])
    return v
