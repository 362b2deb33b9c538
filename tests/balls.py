"""Scenes of rigid balls, apart, in contact or on springs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from taichi_sph.scene import Numerics, Pinball, Rigid, Scene, Spring
from taichi_sph.world.world import World


def ball(
    name: str, centre: tuple[float, float, float], velocity: Any = (0.0, 0.0, 0.0), mass: float = 1.0, radius: float = 0.1, **more: Any
):
    """A rigid body of one pinball."""
    return Rigid(name=name, mass=mass, pinballs=[Pinball(centre=centre, radius=radius)], velocity=velocity, **more)


def start(
    *rigids: Rigid, duration: float = 0.1, springs: Sequence[Spring] = (), gravity: Any = None, threads: int | None = None, **numerics: Any
) -> World:
    """Their world; numerics: changes to it."""
    return World(
        Scene(
            name="balls",
            title="Balls",
            source="tests",
            rigids=rigids,
            springs=springs,
            gravity=gravity,
            duration=duration,
            numerics=Numerics(**{"spacing": 0.1} | numerics),
        ),
        threads=threads,
    )
