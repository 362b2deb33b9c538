"""The spectrum of a free plate beside the finite elements' on the same nodes: no soft spurious modes (galerkin)."""

import numpy as np
import pytest

from taichi_sph.spectrum import compare

from ..plates import plate_scene


@pytest.mark.parametrize("cells, irregularity", [("quad", 0.0), ("quad", 0.25), ("triangle", 0.0), ("triangle", 0.25)])
def test_galerkin(cells, irregularity):
    s = compare(plate_scene(cells=cells, irregularity=irregularity), cells=12, count=20)
    assert s.rigid == 3 and s.soft == 0 and s.growth < 1e-6
    assert s.ours.min() > 0.85 * s.elements[0]
    assert s.ours[:6] == pytest.approx(s.elements[:6], rel=0.15)
    assert s.ours[:6] == pytest.approx(s.fine[:6], rel=0.1)
    assert 0.8 < s.step < 1.2
    assert np.abs(s.shapes).max() <= 1 + 1e-12 and s.shapes.shape == (20, 169, 2)


def test_without_stabilisation_it_is_softer():
    """What gamma holds: quadrangles whose checkerboard modes the cells do not see."""
    scene = plate_scene(cells="quad", irregularity=0.0)
    held = compare(scene, cells=12, count=20)
    loose = compare(scene.derive(**{"numerics.formulation.stabilisation": 0.0}), cells=12, count=20)
    assert loose.ours.min() < 0.5 * held.ours.min() or loose.rigid > 3


def test_collocation_is_measured_too():
    """Not held to the same: the thesis's form has hourglass modes, and some of its modes grow."""
    s = compare(plate_scene(cells="quad", irregularity=0.0, formulation="collocation"), cells=12, count=12)
    assert s.rigid + s.soft >= 3
    assert s.growth > 1e-3


def test_picture(tmp_path):
    from taichi_sph.render.modes import draw

    from taichi_sph.model.mesh import plate

    mesh = plate(0.01, 0.01, 0.0025, "triangle")
    X = mesh.points[:, :2] / 0.01
    draw(tmp_path / "modes.png", mesh, np.stack([np.sin(3 * X), np.cos(3 * X)]), ["1 kHz", "2 kHz"])
    assert (tmp_path / "modes.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
