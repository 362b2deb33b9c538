"""Scenes of rigid balls on springs."""

from __future__ import annotations

from typing import Any

from taichi_sph.scene import Numerics, Pinball, Rigid, Scene, Spring
from taichi_sph.world.world import World


def ball(name: str, x: float, mass: float = 2.0, **more: Any) -> Rigid:
    return Rigid(name=name, mass=mass, pinballs=[Pinball(centre=(x, 0, 0), radius=0.05)], **more)


def world(springs: list[Spring], rigids: list[Rigid], duration: float = 1.0, safety: float = 0.9, **more: Any) -> World:
    scene = Scene(
        name="springs",
        title="Springs",
        source="tests",
        duration=duration,
        rigids=rigids,
        springs=springs,
        numerics=Numerics(spacing=0.01, time_step_safety=safety),
        **more,
    )
    return World(scene, threads=1)
