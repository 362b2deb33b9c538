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


def one(scene: Scene, name: str) -> Scene:
    """That tank with its water and its bullet."""

    def of(things):
        return tuple(thing for thing in things if thing.name.endswith(name))

    motions = tuple(motion for motion in scene.motions if motion.body == name)
    left = {"shells": of(scene.shells), "rigids": of(scene.rigids), "fluids": of(scene.fluids), "motions": motions}
    return Scene.model_validate(scene.model_copy(update={**left, "meetings": (), "quantities": ()}).model_dump())


@pytest.mark.long
def test_each_tank_moves_as_if_it_were_alone():
    """Bit for bit, at the same step. The waters are told not to meet: in one pool the grid and the origin of both would be one, and the
    last bits would follow from where the other tank stands."""
    scene = both()
    parted = scene.model_copy(update={"meetings": (Meeting(between=("water_left", "water_right"), meet=False),)})
    dt, found, kernels = 0.0, {}, {}
    for what in (parted, one(scene, "left"), one(scene, "right")):
        world = World(what, threads=2)
        dt = dt or 0.5 * world.dt
        for _ in range(STEPS):
            world.dt = dt  # a wall that is squeezed asks for another step, in each world at another time
            world.advance(1)
        kernels[len(what.shells)] = len(runtime.kernels())
        for body in world.frame().bodies:
            arrays = {**body.point_data, **body.cell_data, "points": body.points}
            found.setdefault(body.name, []).append(arrays)
    for name, (together, alone) in found.items():
        for key, value in together.items():
            assert np.asarray(value).tobytes() == np.asarray(alone[key]).tobytes(), f"{key} of {name}"
    assert np.ptp(found["bullet_left"][0]["velocity"][:, 0]) < 1e-9 and abs(found["bullet_left"][0]["velocity"][0, 0]) < 730
    assert kernels[2] == kernels[1], "a second tank compiles kernels of its own"


@pytest.mark.long
def test_restart_is_exact():
    restarts_exactly(lambda: World(both(), threads=2), 25, 25)


@pytest.mark.long
def test_the_number_of_threads_changes_nothing():
    threads_change_nothing(lambda threads: World(both(), threads=threads), STEPS)
