"""Exact restart, and the same bits whatever the number of threads."""

import numpy as np
import pytest

from taichi_sph.errors import SceneError
from taichi_sph.scene.script import load_scene

from ..exact import same_state
from ..plates import start, tearing
from .test_rupture import B1

N = 30


@pytest.mark.parametrize(
    "kind, precision", [("galerkin", "f64"), pytest.param("collocation", "f64", marks=pytest.mark.long), ("galerkin", "f32")]
)
def test_n_and_restart_and_n_is_2n(kind, precision):
    """Bit for bit, in a Taichi started afresh, after ruptures; ledger and time step too."""
    scene = tearing(kind, cells="quad", irregularity=0.0, precision=precision)
    sim = start(scene)
    sim.advance(N)
    half = {k: np.array(v) for k, v in sim.state().items()}
    broken = sim.status()["broken"]
    sim.advance(N)
    whole, energies, status = sim.state(), sim.energies(), sim.status()
    assert 0 < broken < status["broken"]

    again = start(scene)
    again.restore(half)
    assert again.step == N and same_state(again.state(), half) == []
    again.advance(N)
    assert same_state(again.state(), whole) == []
    assert again.energies() == energies
    assert again.status() == status


@pytest.fixture(scope="module")
def checkpoint():
    sim = start(tearing())
    sim.advance(5)
    return sim, sim.state()


@pytest.mark.parametrize("spoil", ["missing", "shape"])
def test_a_foreign_state_is_refused(checkpoint, spoil):
    sim, state = checkpoint
    before = sim.state()
    bad = dict(state)
    if spoil == "missing":
        del bad["nodes.u"]
    else:
        bad["nodes.u"] = bad["nodes.u"][:-1]
    with pytest.raises(SceneError, match="checkpoint: 'nodes.u'"):
        sim.restore(bad)
    assert same_state(sim.state(), before) == []


@pytest.mark.parametrize("kind", ["galerkin", pytest.param("collocation", marks=pytest.mark.long)])
def test_one_and_two_threads(kind):
    """4600 nodes (several blocks for every thread), until a dozen cells have broken."""
    states = []
    for threads in (1, 2):
        sim = start(load_scene(B1, {"quality": "draft", "formulation": kind}), threads=threads)
        sim.advance_to(2.2e-5)
        assert sim.status()["broken"] > 8
        states.append(sim.state() | {k: np.array(v) for k, v in sim.energies().items()})
    assert same_state(*states) == []
