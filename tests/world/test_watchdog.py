"""Nonsense is stopped with a sentence."""

import math

import numpy as np
import pytest

from taichi_sph.bodies.body import Entries, Now, Rest
from taichi_sph.errors import RunStopped
from taichi_sph.world import watchdog
from taichi_sph.world.ledger import balance

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


def balanced(kinetic: float, external: float, nothing: float) -> None:
    """A look at a group of that energy, which was given so much."""
    watchdog.look([Rest()], ["one"], balance(Entries(kinetic, external, {"elastic": 0.0}), 0.0), Now(1e-3), nothing)


@pytest.mark.parametrize(("kinetic", "external", "nothing"), [(1.0, 1.0, 0.0), (1e-14, 1e-15, 1e-13), (0.0, 0.0, 0.0)])
def test_what_was_given_or_is_rounding_passes(kinetic, external, nothing):
    balanced(kinetic, external, nothing)


@pytest.mark.parametrize(("kinetic", "external", "nothing"), [(2.0, 1.0, 0.0), (1e-14, 1e-15, 0.0), (math.nan, 1.0, 1e-13)])
def test_what_nobody_gave_stops_the_run(kinetic, external, nothing):
    with pytest.raises(RunStopped, match="'one': energy appears from nowhere"):
        balanced(kinetic, external, nothing)
