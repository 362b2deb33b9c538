"""Forces of a shell that bends: rigid motion, derivative of the energy, balance, six rigid modes; flat and curved."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ..shells import forces, shell_scene, start, turned

THICKNESS = 0.05
K = 210e9 * THICKNESS  # N/m
CASES = [(surface, cells) for surface in ("flat", "curved") for cells in ("quad", "triangle")]


@pytest.fixture(scope="module", params=CASES, ids=["-".join(c) for c in CASES])
def sim(request):
    return start(shell_scene(request.param[0], cells=request.param[1]))


def moved(sim, size=1.0, seed=1):
    """A large rotation with noise of some percent on top."""
    rng = np.random.default_rng(seed)
    u, d = turned(sim, Rotation.from_rotvec([0.3, -1.2, 2.0]), (1.0, 2.0, 3.0))
    return u + 0.03 * size * rng.standard_normal(u.shape), d + 0.1 * size * rng.standard_normal(d.shape)


@pytest.mark.parametrize("turns", [0.1, 1.3, 100.0])
def test_rigid_motion_strains_nothing(sim, turns):
    """A2: no force and no energy, also on irregular nodes of a curved surface."""
    axis = np.array([0.3, -0.8, 0.5]) / np.linalg.norm([0.3, -0.8, 0.5])
    u, d = turned(sim, Rotation.from_rotvec(2 * np.pi * turns * axis), (0.3, -1.7, 0.4))
    f, couple, energy = forces(sim, u, d)
    assert np.abs(f).max() < 1e-12 * K
    assert np.abs(couple).max() < 1e-13 * K
    assert energy < 1e-24 * K


def test_forces_are_the_gradient_of_the_energy(sim):
    u, d = moved(sim)
    f, couple, _ = forces(sim, u, d)
    rng = np.random.default_rng(2)
    du, dd = rng.standard_normal(u.shape), rng.standard_normal(d.shape)
    h = 1e-6
    slope = (forces(sim, u + h * du, d + h * dd)[2] - forces(sim, u - h * du, d - h * dd)[2]) / (2 * h)
    assert slope == pytest.approx(-((f * du).sum() + (couple * dd).sum()), rel=1e-7)


def test_forces_and_moments_balance(sim):
    u, d = moved(sim)
    f, couple, _ = forces(sim, u, d)
    from ..shells import of_nodes

    x, n = sim.shell.mesh.points + u, of_nodes(sim, "N") + d
    arms = np.abs(np.cross(x, f)).sum()
    assert np.abs(f.sum(axis=0)).max() < 1e-12 * np.abs(f).sum()
    assert np.abs(np.cross(x, f).sum(axis=0) + np.cross(n, couple).sum(axis=0)).max() < 1e-12 * arms


def test_the_energy_does_not_see_a_rotation(sim):
    """Objectivity: the same deformation, turned, stores the same energy."""
    rng = np.random.default_rng(3)
    X = sim.shell.mesh.points
    u = 0.03 * rng.standard_normal(X.shape)
    d = 0.1 * rng.standard_normal(X.shape)
    from ..shells import of_nodes

    N = of_nodes(sim, "N")
    Q = Rotation.from_rotvec([1.0, 2.0, -0.5])
    before = forces(sim, u, d)[2]
    after = forces(sim, Q.apply(X + u) - X, Q.apply(N + d) - N)[2]
    assert after == pytest.approx(before, rel=1e-11)


def test_constant_curvature_is_exact_on_a_plate():
    """A plate bent to w = k x^2 / 2 with its directors: energy 1/2 D k^2 per area, no shear, on irregular nodes."""
    sim = start(shell_scene("flat"))
    X = sim.shell.mesh.points
    k = 1e-5
    u, d = np.zeros_like(X), np.zeros_like(X)
    u[:, 2] = 0.5 * k * X[:, 0] ** 2
    d[:, 0] = -k * X[:, 0]
    stiffness = 210e9 * THICKNESS**3 / 12 / (1 - 0.3**2)
    # the mean director of a cell is exact for linear fields only to O(D^2) of what bends: none here but the membrane's
    # second order, k^4
    assert forces(sim, u, d)[2] == pytest.approx(0.5 * stiffness * k**2, rel=2e-4)


@pytest.mark.long
@pytest.mark.parametrize("surface", ["flat", "curved"])
def test_six_rigid_modes_and_no_soft_one(surface):
    """Exactly six zero modes; the first flexible one is where it belongs, whatever the nodes."""
    from taichi_sph.bodies.shell.instead.modes import lowest

    found = {p: lowest(start(shell_scene(surface, irregularity=p)).shell, 6) for p in (0.0, 0.25)}
    for _, _, rigid in found.values():
        assert rigid == 6
    assert found[0.25][0] == pytest.approx(found[0.0][0], rel=0.03)
