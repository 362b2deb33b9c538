"""The spectrum of a free plate in its plane, and of a curved patch that bends, beside the finite elements' on the same nodes: no soft
spurious modes (galerkin)."""

import numpy as np
import pytest

from taichi_sph.geometry.mesh import plate
from taichi_sph.verification.elements import shell_stiffness
from taichi_sph.verification.spectrum import compare, compare_bent

from ..plates import plate_scene
from . import ritz


@pytest.mark.parametrize("cells, irregularity", [("quad", 0.0), ("quad", 0.25), ("triangle", 0.0), ("triangle", 0.25)])
@pytest.mark.long
def test_galerkin(cells, irregularity):
    s = compare(plate_scene(cells=cells, irregularity=irregularity), cells=12, count=20)
    assert s.rigid == 3 and s.soft == 0 and s.growth < 1e-6
    assert s.ours.min() > 0.85 * s.elements[0]
    assert s.ours[:6] == pytest.approx(s.elements[:6], rel=0.15)
    assert s.ours[:6] == pytest.approx(s.fine[:6], rel=0.1)
    assert 0.8 < s.step < 1.2
    assert np.abs(s.shapes).max() <= 1 + 1e-12 and s.shapes.shape == (20, 169, 2)


@pytest.mark.long
def test_without_stabilisation_it_is_softer():
    """What gamma holds: quadrangles whose checkerboard modes the cells do not see."""
    scene = plate_scene(cells="quad", irregularity=0.0)
    held = compare(scene, cells=12, count=20)
    loose = compare(scene.derive(**{"numerics.formulation.stabilisation": 0.0}), cells=12, count=20)
    assert loose.ours.min() < 0.5 * held.ours.min() or loose.rigid > 3


@pytest.mark.long
def test_collocation_is_measured_too():
    """Not held to the same: the thesis's form has hourglass modes, and some of its modes grow."""
    s = compare(plate_scene(cells="quad", irregularity=0.0, formulation="collocation"), cells=12, count=12)
    assert s.rigid + s.soft >= 3
    assert s.growth > 1e-3


@pytest.mark.parametrize("cells, irregularity", [("quad", 0.0), ("quad", 0.25), ("triangle", 0.0), ("triangle", 0.25)])
@pytest.mark.long
def test_a_curved_patch_has_six_rigid_modes_and_no_soft_one(cells, irregularity):
    """Its lowest twelve flexible modes within 10 % of MITC shell elements' on the same nodes."""
    s = compare_bent(plate_scene(cells=cells, irregularity=irregularity), cells=12, count=12)
    assert s.rigid == 6 and s.soft == 0
    assert s.ours == pytest.approx(s.elements, rel=0.1)
    assert s.shapes.shape == (12, 169, 3)


@pytest.mark.long
def test_collocation_has_soft_modes_on_a_curved_patch():
    s = compare_bent(plate_scene(cells="quad", irregularity=0.0, formulation="collocation"), cells=8, count=6)
    assert s.soft >= 3 and s.growth > 1e-3


@pytest.mark.parametrize("cells, irregularity", [("quad", 0.0), ("quad", 0.2), ("triangle", 0.0)])
@pytest.mark.long
def test_the_shell_elements_that_are_compared_with(cells, irregularity):
    """Free plate: six still modes, the first flexible ones within 4 % of Mindlin's on 12 x 12 cells."""
    import scipy.linalg

    e, nu = 0.02, 0.3
    mesh = plate(1.0, 1.0, 1 / 12, cells, irregularity, seed=1)
    young = 12 * (1 - nu**2) / e**3
    mass = np.repeat(mesh.node_areas, 6) * np.tile([1, 1, 1, e**2 / 12, e**2 / 12, 1], len(mesh.points))
    keep = np.tile([True] * 5 + [False], len(mesh.points))  # d has no part along the director
    K = shell_stiffness(mesh, young, nu, e).toarray()[np.ix_(keep, keep)]
    values = scipy.linalg.eigh(K, np.diag(mass[keep]), eigvals_only=True, subset_by_index=[0, 11])
    assert np.abs(values[:6]).max() < 1e-8 * values[6]
    assert np.sqrt(values[6:]) == pytest.approx(ritz.free_frequencies(e), rel=0.04)


@pytest.mark.long
def test_picture(tmp_path):
    from taichi_sph.render.modes import draw

    mesh = plate(0.01, 0.01, 0.0025, "triangle")
    X = mesh.points[:, :2] / 0.01
    draw(tmp_path / "modes.png", mesh, np.stack([np.sin(3 * X), np.cos(3 * X)]), ["1 kHz", "2 kHz"])
    assert (tmp_path / "modes.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
