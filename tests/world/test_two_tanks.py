"""Two filled tanks, each hit by its own bullet, in one scene: what happens to one is what happens to it alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.scene import Meeting, Scene
from taichi_sph.scene.script import load_scene
from taichi_sph.world.world import World

from ..exact import restarts_exactly, threads_change_nothing

SCENE = Path(__file__).parents[2] / "scenes" / "two_tanks.py"
COARSE = {"quality": "draft"}
STEPS = 40


def both() -> Scene:
    return load_scene(SCENE, COARSE)


def apart(scene: Scene) -> Scene:
    """No body of one tank meets one of the other."""
    sides = [[body.name for body in scene.bodies if body.name.endswith(side)] for side in ("left", "right")]
    return scene.model_copy(update={"meetings": tuple(Meeting(between=(a, b), meet=False) for a in sides[0] for b in sides[1])})


def one(scene: Scene, name: str) -> Scene:
    """That tank with its water and its bullet."""

    def of(things):
        return tuple(thing for thing in things if thing.name.endswith(name))

    motions = tuple(motion for motion in scene.motions if motion.body == name)
    left = {"shells": of(scene.shells), "rigids": of(scene.rigids), "fluids": of(scene.fluids), "motions": motions}
    return Scene.model_validate(scene.model_copy(update={**left, "meetings": (), "quantities": ()}).model_dump())


@pytest.mark.long
def test_each_tank_moves_as_if_it_were_alone():
    """Bit for bit at the same step. No body of one tank meets one of the other. If they could, their waters would share a pool with its
    grid and origin, and what moves in one tank would time the lists of the other: the last bits would follow from both."""
    scene = both()
    parted = apart(scene)
    dt, found = 0.0, {}
    for what in (parted, one(scene, "left"), one(scene, "right")):
        world = World(what, threads=2)
        dt = dt or 0.5 * world.dt
        for _ in range(STEPS):
            world.dt = dt  # a wall that is squeezed asks for another step, in each world at another time
            world.advance(1)
        for body in world.frame().bodies:
            arrays = {**body.point_data, **body.cell_data, "points": body.points}
            if body.kind == "rigid":  # its frame is made by NumPy, whose last bits follow from the length of arrays
                r = world.rigids.names.index(body.name)
                arrays = {k: runtime.get(getattr(world.rigids, k), r + 1)[r] for k in ("x", "v", "q", "L", "kinetic")}
            found.setdefault(body.name, []).append(arrays)
    for name, (together, alone) in found.items():
        for key, value in together.items():
            assert np.asarray(value).tobytes() == np.asarray(alone[key]).tobytes(), f"{key} of {name}"
    assert 0 < abs(found["bullet_left"][0]["v"][0]) < 730, "the bullet has met its tank"


@pytest.mark.long
def test_restart_is_exact():
    restarts_exactly(lambda: World(both(), threads=2), 25, 25)


@pytest.mark.long
def test_the_number_of_threads_changes_nothing():
    threads_change_nothing(lambda threads: World(both(), threads=threads), STEPS)
