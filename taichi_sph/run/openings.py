"""Openings that a scene has from the start, or opens as soon as a gate lifts, and that are too narrow for its water: what `validate` says
of them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..bodies.fluid.narrow import FLOWS, FREELY, SHUT, narrow
from ..bodies.fluid.said import Wall
from ..geometry.mesh import SurfaceMesh
from ..geometry.regions import extent, inside
from ..scene import Scene, Shell
from ..scene.units import show

FACES = 0.7  # least cosine between the outward direction of a border and the way to a wall that it stands on


def too_narrow(scene: Scene, fluid: str, meshes: Mapping[str, SurfaceMesh]) -> list[str]:
    """A sentence for each round hole in a wall, or in a shell that the fluid meets, and for each gap between a border of such a shell and a
    wall, below FLOWS spacings of the fluid; and for each border that stands on a wall and may lift."""
    said = next(f for f in scene.fluids if f.name == fluid)
    spacing = scene.numerics_of(said).spacing
    walls = [(f"walls[{number}]", wall) for number, wall in enumerate(scene.walls) if wall.holds(fluid)]
    found = [
        narrow(f"the hole of {name}", 2 * wall.hole.radius, fluid, d, show)
        for name, wall in walls
        if wall.hole is not None and 2 * wall.hole.radius < FLOWS * (d := said.spacing_at(spacing, wall.hole.centre))
    ]
    spacing /= 2**said.halvings  # of shells: whoever makes water finer does so where it opens
    for shell in scene.shells:
        if not scene.met(shell.name, fluid).meet:
            continue
        for number, hole in enumerate(getattr(shell.surface, "holes", ())):
            if 2 * hole.radius < FLOWS * spacing:
                found.append(narrow(f"holes[{number}] of '{shell.name}'", 2 * hole.radius, fluid, spacing, show))
        for name, wall in walls:
            found += _above(scene, shell, meshes[shell.name], name, wall, fluid, spacing)
    return found


def _above(scene: Scene, shell: Shell, mesh: SurfaceMesh, name: str, wall: Wall, fluid: str, spacing: float) -> list[str]:
    """What is said of the border of a shell over a wall: of a gap that there is, or of one that will open."""
    normal = np.asarray(wall.normal) / np.linalg.norm(wall.normal)
    ends, outward = _border(mesh)
    over = ends[outward @ normal < -FACES]
    if not len(over):
        return []
    height = (mesh.points[over].mean(axis=1) - np.asarray(wall.point)) @ normal
    stands = np.abs(height) < SHUT * spacing
    across, along = _held(scene, shell, mesh, over[stands], normal)
    gap = float(height[height >= SHUT * spacing].max(initial=0.0))
    if stands.any() and across and not along:
        gap *= 2  # the wall is a plane of symmetry of the shell, and mirrors what opens at it
    found = [narrow(f"the gap between '{shell.name}' and {name}", gap, fluid, spacing, show)] if 0.0 < gap < FLOWS * spacing else []
    if stands.any() and not across:
        found.append(
            f"'{shell.name}' stands on {name} and may lift: through a gap below {show(FLOWS * spacing, 'm')}, {FLOWS:g} D of '{fluid}', "
            f"water passes haltingly or not at all; take a spacing of 1/{FREELY:g} of the gap that you expect"
        )
    return found


def _border(mesh: SurfaceMesh) -> tuple[np.ndarray, np.ndarray]:
    """(B, 2) nodes of the sides of a shell that bound one cell alone, and (B, 3) unit vectors that point out of it there."""
    one = (np.asarray(mesh.edges.sides) < 0).any(axis=1)
    ends, cell = np.asarray(mesh.edges.nodes)[one], np.asarray(mesh.edges.sides)[one].max(axis=1) // 4
    corners = mesh.cells[cell]
    middle = np.where((corners >= 0)[..., None], mesh.points[corners], 0.0).sum(axis=1) / (corners >= 0).sum(axis=1)[:, None]
    along = mesh.points[ends[:, 1]] - mesh.points[ends[:, 0]]
    along /= np.linalg.norm(along, axis=1)[:, None]
    out = mesh.points[ends].mean(axis=1) - middle
    out -= (out * along).sum(axis=1)[:, None] * along
    return ends, out / np.linalg.norm(out, axis=1)[:, None]


def _held(scene: Scene, shell: Shell, mesh: SurfaceMesh, ends: np.ndarray, normal: np.ndarray) -> tuple[bool, bool]:
    """Whether motions keep all those nodes from leaving along the normal, and whether they keep them from sliding across it."""
    held = np.zeros((len(mesh.points), 3), bool)
    for motion in scene.motions:
        if motion.body == shell.name:
            there = inside(motion.where, mesh.points, extent(mesh.points))
            for axis, speed in enumerate(motion.velocity):
                if speed == 0.0:
                    held[there, axis] = True
    its, leans = held[np.unique(ends)], np.abs(normal) > 1e-6
    return bool(its[:, leans].all()), bool(its[:, ~leans].all())
