"""The same bits at one and two threads and over a restart, for scenes with everything in them; and what is violent beyond reason."""

import json

import numpy as np
import pytest

from taichi_sph.errors import RunStopped, SceneError
from taichi_sph.run.session import checked_plan
from taichi_sph.scene.script import derive, load_scene
from taichi_sph.world.world import World

from ..exact import same_state
from .test_rupture import B1

SCENES = B1.parent
COARSE = {"numerics.spacing": 0.016, "fluids.0.spacing": 0.024}
KINDS = {
    "tank": ("tank_leak", COARSE, 120),
    "tank in f32": ("tank_leak", COARSE | {"numerics.precision": "f32"}, 120),
    "metal": ("plate_perforation", {}, 300),
    "metal in f32": ("plate_perforation", {"numerics.precision": "f32"}, 300),
    "brittle in f32": ("crack_branching", {"numerics.spacing": 0.0015, "numerics.precision": "f32"}, 120),
    "water in f32": ("dam_break", {"numerics.precision": "f32"}, 200),
}


def state_of(world):
    return {k: np.array(v) for k, v in world.state().items()} | {k: np.array(v) for k, v in world.energies().items()}


@pytest.mark.long
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("kind", KINDS)
def test_threads_and_restart(kind):
    name, settings, steps = KINDS[kind]
    scene = load_scene(SCENES / f"{name}.py", {"quality": "draft", **settings})
    one = World(scene, threads=1)
    one.advance(steps)
    half = {k: np.array(v) for k, v in one.state().items()}
    one.advance(steps)
    whole = state_of(one)
    assert whole["kinetic"] > 0
    two = World(scene, threads=2)
    two.advance(2 * steps)
    assert same_state(state_of(two), whole) == []
    again = World(scene, threads=2)
    again.restore(half)
    again.advance(steps)
    assert same_state(state_of(again), whole) == []


VIOLENT = {
    "3 km/s": ("plate_perforation", {"velocity": 3000.0}),
    "10 km/s": ("plate_perforation", {"velocity": 10_000.0}),
    "1e-9 kg": ("plate_perforation", {"rigids.0.mass": 1e-9}),
    "1e9 kg": ("plate_perforation", {"rigids.0.mass": 1e9}),
    "light": ("plate_perforation", {"rigids.0.mass": 0.0006}),
    "heavy": ("plate_perforation", {"rigids.0.mass": 500.0}),
    "gravity": ("dam_break", {"gravity": [0.0, 0.0, -1e6]}),
    "sound": ("dam_break", {"fluids.0.water.sound": 1.0}),
    "tank at 3 km/s": ("tank_leak", COARSE | {"velocity": 3000.0}),
    "tank at 10 km/s": ("tank_leak", COARSE | {"velocity": 10_000.0}),
}


@pytest.mark.long
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("what", VIOLENT)
def test_what_is_violent_is_stable_or_stops_with_its_cause(what):
    name, settings = VIOLENT[what]
    try:
        own = {k: v for k, v in settings.items() if k != "gravity"}
        scene = load_scene(SCENES / f"{name}.py", {"quality": "draft", **own})
        scene = derive(scene, gravity=settings["gravity"]) if "gravity" in settings else scene
        checked_plan(scene, "cpu")
        world = World(scene, threads=2)
        world.advance_to(min(scene.duration, 1500 * world.dt))
    except (SceneError, RunStopped) as stop:
        print(f"{what}: {type(stop).__name__}: {stop}")
        assert "\n" not in str(stop)
        assert "numerics.time_step_safety" not in str(stop) or "violent" in str(stop) or "fast" in str(stop)
        return
    energies = world.energies()
    print(f"{what}: stable after {world.step} steps, {json.dumps(energies)}")
    assert all(np.isfinite(v) for v in energies.values())
    assert abs(energies["closed_residual_percent"]) < 5
