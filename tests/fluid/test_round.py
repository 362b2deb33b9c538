"""Round fillings and the faces of rigid bodies around them."""

import numpy as np
import pytest
from pydantic import ValidationError

from taichi_sph.bodies.fluid.fill import fill
from taichi_sph.bodies.fluid.said import Fluid, FluidRound
from taichi_sph.bodies.rigid.faces import points
from taichi_sph.bodies.rigid.said import DiscFace, TubeFace
from taichi_sph.scene import Box


@pytest.mark.parametrize("quarter", [False, True])
def test_rings_follow_the_wall_and_hold_the_volume(quarter):
    d = 2e-3
    made = fill(Fluid(name="water", fill=FluidRound(columns=[(0.04, 0, 0.05), (0.01, -0.02, 0)], quarter=quarter)), d)
    r = np.hypot(*made.points[:, :2].T)
    volume = np.pi * (0.04**2 * 0.05 + 0.01**2 * 0.02) * (0.25 if quarter else 1.0)
    assert made.volume == pytest.approx(volume) and made.spacing == pytest.approx(d, rel=0.02)
    column = made.points[:, 2] > 0
    assert r[column].max() == pytest.approx(0.04 - 0.5 * d, abs=0.05 * d) and r[~column].max() == pytest.approx(0.01 - 0.5 * d, abs=0.1 * d)
    assert len(np.unique(made.points, axis=0)) == len(made.points)
    assert (made.points[:, :2] > 0).all() or not quarter
    # as many in equal areas
    within = (r < 0.04 * np.sqrt(0.5)) & column
    assert within.sum() / column.sum() == pytest.approx(0.5, abs=0.03)


def test_faces_have_their_areas_and_close():
    """A disc with a hole, a tube and a piece of one; a quarter of each is a quarter of its area; a closed can has no vector area."""
    d = 1e-3
    quarter = Box(lo=(0, 0, None))
    disc = {"centre": (0, 0, 0), "normal": (0, 0, 2), "radius": 0.04, "hole": 0.01}
    tube = {"start": (0, 0, 0), "end": (0, 0, 0.05), "radius": 0.04}
    for make, said, area in ((DiscFace, disc, np.pi * (0.04**2 - 0.01**2)), (TubeFace, tube, 2 * np.pi * 0.04 * 0.05)):
        whole, part = (np.linalg.norm(points(make(**said, within=kept), d)[1], axis=1).sum() for kept in ((), (quarter,)))
        assert whole == pytest.approx(area, rel=1e-12) and part == pytest.approx(0.25 * area, rel=1e-12)
    x, a = points(TubeFace(**tube), d)
    assert (np.einsum("ni,ni->n", x[:, :2], a[:, :2]) < 0).all()  # towards the water inside
    lid = points(DiscFace(centre=(0, 0, 0.05), normal=(0, 0, -1), radius=0.04), d)[1]
    floor = points(DiscFace(centre=(0, 0, 0), normal=(0, 0, 1), radius=0.04), d)[1]
    assert np.abs(a.sum(axis=0) + lid.sum(axis=0) + floor.sum(axis=0)).max() < 1e-12


def test_what_is_no_face_is_refused():
    with pytest.raises(ValidationError, match="nothing is left of the face"):
        DiscFace(centre=(0, 0, 0), normal=(0, 0, 1), radius=0.01, hole=0.01)
    with pytest.raises(ValidationError, match="no length"):
        TubeFace(start=(0, 0, 0), end=(0, 0, 0), radius=0.01)
    with pytest.raises(ValidationError, match="holds nothing"):
        FluidRound(columns=[(0.01, 1.0, 1.0)])
