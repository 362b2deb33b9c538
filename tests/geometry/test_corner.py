"""The corner between a wall and its end: MLS in the local tangent plane goes right across it.

A node of the wall sees nodes of the disc, foreshortened in its tangent plane; the polynomials are met all the same,
so a rigid motion of the whole body strains nothing and pulls at nothing, and what pulls has no resultant.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from taichi_sph import runtime
from taichi_sph.scene import CappedTank, Cylinder, Material, Numerics, Scene, Shell

BODIES = {
    "can": Cylinder(radius=1, length=1.2, ends="discs"),
    "tank": CappedTank(radius=1, length=0.6, cap_height=0.5),
}
SPACING, THICKNESS, YOUNG = 0.2, 0.05, 2.1e11
STIFFNESS = YOUNG * THICKNESS  # N/m
CASES = [("can", "quad", 0.0), ("can", "quad", 0.25), ("can", "triangle", 0.25), ("tank", "quad", 0.25)]


@pytest.fixture(scope="module", params=CASES, ids=lambda p: "-".join(map(str, p)))
def closed(request):
    from taichi_sph.world.world import World

    body, cells, irregularity = request.param
    steel = Material(name="steel", young=YOUNG, poisson=0.3, density=7800)
    shell = Shell(name="body", surface=BODIES[body], thickness=THICKNESS, material=steel, motion="free")
    numerics = Numerics(spacing=SPACING, cells=cells, irregularity=irregularity)
    return World(Scene(name="corner", title="", source="tests", shells=[shell], duration=1e-3, numerics=numerics))


def loads(sim, u: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(N, 3) forces [N] and couples [N m] at displacements u [m] and changes of directors d."""
    n = sim.shell.nodes.n
    runtime.put(sim.shell.nodes.u, u)
    runtime.put(sim.shell.nodes.d, d)
    sim.shell.internal.strain(0.0)
    sim.shell.internal.force()
    return runtime.get(sim.shell.nodes.force, n), runtime.get(sim.shell.nodes.couple, n)


def rigid(sim) -> tuple[np.ndarray, np.ndarray]:
    """A turn of 135 degrees about an odd axis, and a shift."""
    X, N = sim.shell.mesh.points, sim.shell.mesh.node_normals
    Q = Rotation.from_rotvec([0.3, -1.2, 2.0]).as_matrix()
    return X @ Q.T - X + [1, 2, 3], N @ Q.T - N


@pytest.mark.long
def test_normals_at_the_rim_are_halfway(closed):
    mesh = closed.shell.mesh
    rim = (np.abs(np.hypot(*mesh.points[:, :2].T) - 1) < 1e-9) & (np.abs(mesh.node_normals[:, 2]) > 1e-3)
    assert rim.sum() == 2 * 32
    if closed.scene.shells[0].surface.kind == "cylinder":
        assert np.abs(mesh.node_normals[rim, 2]) == pytest.approx(np.full(64, np.sqrt(0.5)))


def test_a_rigid_motion_strains_nothing(closed):
    force, _ = loads(closed, *rigid(closed))
    assert np.abs(runtime.get(closed.shell.cells.strain, closed.shell.cells.n)).max() < 2e-12
    assert np.abs(force).max() < 1e-12 * STIFFNESS * SPACING


def test_forces_have_no_resultant(closed):
    rng = np.random.default_rng(3)
    u, d = rigid(closed)
    force, _ = loads(closed, u + 0.03 * rng.standard_normal(u.shape), d + 0.1 * rng.standard_normal(d.shape))
    assert np.abs(force.sum(axis=0)).max() < 1e-10 * np.abs(force).max()


def test_forces_are_the_slope_of_the_energy(closed):
    rng = np.random.default_rng(4)
    u, d = rigid(closed)
    u, d = u + 0.03 * rng.standard_normal(u.shape), d + 0.1 * rng.standard_normal(d.shape)
    du, dd = rng.standard_normal((2, *u.shape))
    force, couple = loads(closed, u, d)
    energy = []
    for step in (1e-5, -1e-5):
        loads(closed, u + step * du, d + step * dd)
        energy.append(closed.shell.stored())
    slope = (energy[0] - energy[1]) / 2e-5
    assert -((force * du).sum() + (couple * dd).sum()) == pytest.approx(slope, rel=1e-6)


def test_a_rigid_motion_pulls_at_no_director(closed):
    _, couple = loads(closed, *rigid(closed))
    assert np.abs(couple).max() < 1e-12 * STIFFNESS * SPACING * THICKNESS


def test_moments_are_in_balance(closed):
    rng = np.random.default_rng(5)
    u, d = rigid(closed)
    u, d = u + 0.03 * rng.standard_normal(u.shape), d + 0.1 * rng.standard_normal(d.shape)
    force, couple = loads(closed, u, d)
    moment = np.cross(closed.shell.mesh.points + u, force) + np.cross(closed.shell.mesh.node_normals + d, couple)
    assert np.abs(moment.sum(axis=0)).max() < 1e-10 * np.abs(moment).max()
