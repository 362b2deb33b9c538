"""The predicted step against what the plate really bears, and against the dense spectrum."""

import numpy as np
import pytest

from taichi_sph.verification.spectrum import stiffness

from ..plates import mass, plate_scene, put, start, velocity

CASES = [
    ("quad", 0.0, 0.2, "f64"),
    ("quad", 0.25, 0.45, "f64"),
    ("triangle", 0.0, 0.45, "f64"),
    ("triangle", 0.25, 0.0, "f64"),
    ("triangle", 0.25, 0.2, "f32"),
]
STEPS = 500  # 0.1 % above the limit a mode grows by 9 % a step


def growth(sim, dt):
    """Largest speed after many steps of dt, over the largest at the start; random velocities, tiny strains."""
    v = 1e-2 * np.random.default_rng(1).normal(size=(sim.shell.nodes.n, 2))
    put(sim, "v", v)
    put(sim, "u", np.zeros_like(v))
    worst = 0.0
    for k in range(STEPS):
        sim.take(dt, dt)
        if k % 50 == 49:
            worst = max(worst, np.nan_to_num(np.abs(velocity(sim)).max(), nan=np.inf) / np.abs(v).max())
            if worst > 1e6:
                break
    put(sim, "u", np.zeros_like(v))
    return worst


@pytest.mark.long
@pytest.mark.parametrize("cells, irregularity, poisson, precision", CASES)
def test_never_above_and_at_most_a_tenth_below(cells, irregularity, poisson, precision):
    sim = start(plate_scene(cells=cells, irregularity=irregularity, precision=precision, material={"poisson": poisson}, safety=1.0))
    if precision == "f64":
        root = np.repeat(mass(sim), 2) ** -0.5
        K = stiffness(sim)
        assert np.abs(K - K.T).max() < 1e-6 * np.abs(K).max()
        exact = np.sqrt(np.linalg.eigvalsh(root[:, None] * 0.5 * (K + K.T) * root)[-1])
        assert exact * (1 - 1e-6) < sim.shell.stable.frequency < 1.01 * exact
    limit = 2 / sim.shell.stable.frequency
    assert sim.dt <= limit * (1 + 1e-9)
    assert growth(sim, 0.999 * limit) < 100  # at the limit itself the highest mode grows with the number of steps
    assert growth(sim, 1.1 * limit) > 1e6


def test_safety_and_whole_number_of_steps():
    sim = start(plate_scene(safety=0.5, duration=1.23e-5))
    assert sim.dt <= 0.5 * 2 / sim.shell.stable.frequency
    assert sim.steps_left * sim.dt == pytest.approx(1.23e-5, rel=1e-12)
    sim.advance_to(1.23e-5)
    assert sim.time == pytest.approx(1.23e-5, rel=1e-12) and sim.steps_left == 0
