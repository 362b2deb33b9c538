"""Openings that a scene has from the start and that are too narrow for its water: what `validate` says of them."""

from __future__ import annotations

from ..bodies.fluid.narrow import FLOWS, narrow
from ..scene import Scene
from ..scene.units import show


def too_narrow(scene: Scene, fluid: str) -> list[str]:
    """A sentence for each round hole in a wall, or in a shell that the fluid meets, below FLOWS spacings of the fluid."""
    said = next(f for f in scene.fluids if f.name == fluid)
    spacing = scene.numerics_of(said).spacing
    found = []
    for number, wall in enumerate(scene.walls):
        if wall.hole is not None and wall.holds(fluid) and 2 * wall.hole.radius < FLOWS * spacing:
            found.append(narrow(f"the hole of walls[{number}]", 2 * wall.hole.radius, fluid, spacing, show))
    for shell in scene.shells:
        if not scene.met(shell.name, fluid).meet:
            continue
        for number, hole in enumerate(getattr(shell.surface, "holes", ())):
            if 2 * hole.radius < FLOWS * spacing:
                found.append(narrow(f"holes[{number}] of '{shell.name}'", 2 * hole.radius, fluid, spacing, show))
    return found
