"""Nonsense is stopped with a sentence."""

import numpy as np
import pytest

from taichi_sph.errors import RunStopped

from ..plates import plate_scene, put, start


@pytest.fixture(scope="module")
def sim():
    return start(plate_scene(duration=1.0))


def test_a_step_three_times_too_long(sim):
    put(sim, "v", np.random.default_rng(0).normal(size=(sim.shell.nodes.n, 2)))
    sim.dt *= 3
    with pytest.raises(RunStopped) as stopped:
        for _ in range(20):
            sim.advance(10)
    text = str(stopped.value)
    assert stopped.value.exit_code == 3
    assert "shell 'plate'" in text and "t = " in text and "step" in text and "numerics.time_step_safety" in text


def test_not_a_number(sim):
    v = np.zeros((sim.shell.nodes.n, 2))
    v[17] = np.nan
    put(sim, "v", v)
    put(sim, "u", np.zeros_like(v))
    with pytest.raises(
        RunStopped, match=r"node 17 at \(.*\) mm moves at nan m/s .*, while no other node is fast: a force, a load or a place"
    ):
        sim.look()


def test_faster_than_sound(sim):
    v = np.zeros((sim.shell.nodes.n, 2))
    v[23, 0] = 5000.0
    put(sim, "v", v)
    place = ", ".join(f"{1e3 * x:.4g}" for x in sim.shell.mesh.points[23])
    with pytest.raises(RunStopped) as stopped:
        sim.look()
    assert "node 23" in str(stopped.value) and f"({place}) mm" in str(stopped.value) and "sound speed" in str(stopped.value)
