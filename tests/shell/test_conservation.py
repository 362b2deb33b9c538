"""Galerkin: forces and moments sum to zero, and the force is the gradient of the energy, whatever the displacement."""

from types import SimpleNamespace

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.scene import Cut, Mazars

from ..plates import CELLS, SIDE, forces, plane, plate_scene, start, stored

D = SIDE / CELLS
CRACK = [Cut(start=(0, SIDE / 2, 0), end=(SIDE / 2, SIDE / 2, 0))]


@pytest.fixture(scope="module", params=["sound", "cracked", "damaged"])
def case(request):
    """Forces and energies at random displacements of a tenth of the spacing."""
    # a threshold that nothing reaches: the damage stays as it is put
    tough = {"damage": Mazars(threshold=0.99, A=1, B=1.0)} if request.param == "damaged" else {}
    sim = start(plate_scene(material=tough, cuts=CRACK if request.param != "sound" else ()))
    rng = np.random.default_rng(4)
    if tough:
        given = rng.uniform(0, 0.9, sim.shell.cells.n)
        runtime.put(sim.shell.cells.damage, given)
        runtime.put(sim.shell.cells.delayed, given)
    u = 0.1 * D * rng.uniform(-1, 1, (sim.shell.nodes.n, 2))
    f = forces(sim, u)
    slopes = []
    for _ in range(3):
        d = rng.normal(size=u.shape)
        step = 1e-4 * D
        w = [stored(sim, u + k * step * d) for k in (-2, -1, 1, 2)]
        slopes.append(((w[0] - 8 * w[1] + 8 * w[2] - w[3]) / (12 * step), -float(np.sum(f * d))))
    return SimpleNamespace(f=f, x=plane(sim) + u, slopes=slopes, residual=sim.shell.internal.stored(sim.shell.reducer))


def test_forces_sum_to_zero(case):
    assert np.abs(case.f.sum(axis=0)).max() < 1e-12 * np.abs(case.f).sum()


def test_moments_sum_to_zero(case):
    arm = case.x - case.x.mean(axis=0)
    moment = arm[:, 0] * case.f[:, 1] - arm[:, 1] * case.f[:, 0]
    assert abs(moment.sum()) < 1e-12 * np.abs(moment).sum()


def test_force_is_minus_the_gradient_of_the_energy(case):
    for difference, work in case.slopes:
        assert difference == pytest.approx(work, rel=1e-8)
    assert case.residual > 0  # the stabilisation takes part
