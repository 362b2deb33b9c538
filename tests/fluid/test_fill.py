"""Fillings: inside, clear of the wall, true mass; what cannot be is refused with a sentence."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from taichi_sph.bodies.fluid.fill import CONTACT, fill
from taichi_sph.bodies.fluid.said import Fluid, FluidBox, ShellFill
from taichi_sph.errors import SceneError
from taichi_sph.geometry.surfaces import generate
from taichi_sph.scene import BoxTank, CappedTank, Cylinder, HoleIn, Numerics, Plate

D, E = 0.0125, 0.001
CAN = Cylinder(radius=0.15, length=0.4, ends="discs", origin=(1.0, 0, 0))
TANK = CappedTank(radius=0.15, length=0.3, axis="x", origin=(0.0, 2.0, 0.0))


def filled(surface, level=None, axis="z", contact=None):
    fluid = Fluid(name="water", fill=ShellFill(shell="tank", level=level, axis=axis), contact=contact)
    return fill(fluid, D, generate(surface, Numerics(spacing=D)), E, surface)


def cell(f) -> float:
    return f.lattice**3


@pytest.mark.parametrize("contact", CONTACT)
@pytest.mark.parametrize("level, height", [(None, 0.4 - E), (0.2, 0.2 - E / 2)])
def test_can(level, height, contact):
    f = filled(CAN, level, contact=contact)
    x = f.points - [1.0, 0, 0]
    clear = CONTACT[contact] * 0.95 * D + E / 2  # the pitch of the lattice is within 5 % of D
    assert np.hypot(x[:, 0], x[:, 1]).max() < 0.15 - clear
    assert x[:, 2].min() > clear and x[:, 2].max() < (level or 0.4 - E / 2) - 0.95 * D / 2
    assert f.mass * len(x) == pytest.approx(1000 * np.pi * (0.15 - E / 2) ** 2 * height, rel=1e-6)
    assert f.spacing == pytest.approx(np.cbrt(f.mass / 1000))
    assert f.lattice == pytest.approx(D, rel=0.05)
    assert cKDTree(x).query(x, k=2)[0][:, 1].min() > 0.45 * f.lattice


@pytest.mark.parametrize("contact", CONTACT)
@pytest.mark.parametrize(
    "surface, axis, wet",
    [(CAN, "z", 2 * np.pi * 0.15 * 0.55), (TANK, "x", 2 * np.pi * 0.15 * (0.3 + 0.3)), (TANK, "z", 2 * np.pi * 0.15 * 0.6)],
)
def test_the_lattice_holds_the_volume_less_what_contact_keeps_clear(surface, axis, wet, contact):
    """A cell of the lattice reaches D/2 beyond its particle, contact keeps CONTACT D clear: (CONTACT - 1/2) D of every wall."""
    f = filled(surface, None, axis, contact)
    assert len(f.points) * cell(f) == pytest.approx(f.volume - (CONTACT[contact] - 0.5) * f.lattice * wet, rel=0.02)


def test_domed_tank_across_its_axis():
    f = filled(TANK, 0.0)
    assert f.volume == pytest.approx(0.5 * (np.pi * 0.1495**2 * 0.3 + 4 / 3 * np.pi * 0.1495**3), rel=0.01)
    x = f.points - [0, 2.0, 0]
    beyond = np.maximum(np.maximum(-x[:, 0], x[:, 0] - 0.3), 0)
    assert np.sqrt(x[:, 1] ** 2 + x[:, 2] ** 2 + beyond**2).max() < 0.15 - CONTACT[None] * 0.95 * D - E / 2 + 1e-4
    assert x[:, 2].max() < -0.95 * D / 2 + 1e-9


def test_domed_tank_along_its_axis():
    f = filled(TANK, None, "x")
    assert f.volume == pytest.approx(np.pi * 0.1495**2 * 0.3 + 4 / 3 * np.pi * 0.1495**3, rel=1e-5)


def test_box():
    f = fill(Fluid(name="water", fill=FluidBox(lo=(0, 0, 0), hi=(0.1, 0.2, 0.05))), 0.01)
    assert len(f.points) == 10 * 20 * 5 and f.mass == pytest.approx(1e-3) and f.points.min() == pytest.approx(0.005)


def test_a_vent_and_a_box_without_a_lid_hold_water():
    """A hole does not change what is inside; where a wall is missing, a plane stands for it."""
    vented = CAN.model_copy(update={"holes": (HoleIn(centre=(1, 0, 0.4), radius=0.04), HoleIn(centre=(1.15, 0, 0.2), radius=0.04))})
    closed, open_ = filled(CAN, 0.3), filled(vented, 0.3)
    assert open_.volume == closed.volume and len(open_.points) == pytest.approx(len(closed.points), rel=0.02)
    box = filled(BoxTank(size=(0.2, 0.15, 0.25), without=("+z",)), 0.2)
    assert box.volume == pytest.approx((0.2 - 1e-3) * (0.15 - 1e-3) * (0.2 - 0.5e-3), rel=0.01)
    assert box.points[:, 2].max() < 0.2


@pytest.mark.parametrize(
    "surface, level, said",
    [
        (BoxTank(size=(0.2, 0.2, 0.2), without=("+z", "+x")), 0.1, "is open"),
        (CAN, 0.5, "level 0.5 m lies outside the shell 'tank', whose inside reaches from 0.0005 to 0.3995 m along z"),
        (CAN, -0.1, "lies outside"),
        (CAN, 0.01, "no particle of 0.0125 m fits"),
        (Cylinder(radius=0.15, length=0.4), 0.2, "is open"),
    ],
)
def test_refused(surface, level, said):
    with pytest.raises(SceneError, match=said):
        filled(surface, level)


@pytest.mark.parametrize("contact", CONTACT)
@pytest.mark.parametrize("aside", [0.0, 0.3 * D])
def test_particles_keep_off_a_baffle(aside, contact):
    """An upright plate in the can, whose edges end 60 mm before its wall: both sides are wet, and the water is less by the plate."""
    baffle, thick = Plate(length=0.18, width=0.24, origin=(0.91, aside, 0.08), normal=(0, -1, 0), along=(1, 0, 0)), 3e-3
    fluid = Fluid(name="water", fill=ShellFill(shell="tank"), contact=contact)
    can, plate = (generate(surface, Numerics(spacing=D)) for surface in (CAN, baffle))
    f, plain = fill(fluid, D, can, E, CAN, [(plate, thick)]), fill(fluid, D, can, E, CAN)
    assert f.volume == pytest.approx(plain.volume - 0.18 * 0.24 * thick, rel=1e-9)
    x = f.points - [1.0, aside, 0.2]
    beside = (np.abs(x[:, 0]) < 0.09) & (np.abs(x[:, 2]) < 0.12)
    clear = CONTACT[contact] * 0.95 * D + thick / 2
    assert np.abs(x[beside, 1]).min() > clear - 1e-9
    assert (x[beside, 1] > 0).sum() > 100 < (x[beside, 1] < 0).sum()
    bare = 2 * np.pi * 0.15 * 0.55 + 2 * 0.18 * 0.24
    assert len(x) * cell(f) == pytest.approx(f.volume - (CONTACT[contact] - 0.5) * f.lattice * bare, rel=0.02), "no layer is lost"


def test_what_was_moved_keeps_off_the_walls():
    """A can without length to spare: a particle moved into its corner comes off both walls, one moved out of it goes back."""
    f = filled(CAN)
    centre = np.array([1.0, 0, 0])
    corner = int(np.argmax(np.hypot(*(f.points - centre)[:, :2].T) - 1e-3 * f.points[:, 2]))
    moved = f.points.copy()
    out = (moved[corner, :2] - centre[:2]) / np.linalg.norm(moved[corner, :2] - centre[:2])
    moved[corner] = [*(centre[:2] + 0.1489 * out), 0.001]
    low = int(np.argmin(np.linalg.norm(f.points - centre, axis=1)))
    moved[low, 2] -= D  # through the bottom
    kept = f.kept_off(moved)
    clear = 0.3 * f.spacing + E / 2
    assert kept[corner, 2] == pytest.approx(clear, rel=1e-6)
    assert 0.15 - np.linalg.norm(kept[corner, :2] - centre[:2]) == pytest.approx(clear, rel=0.02), "off the polygon that the can is"
    np.testing.assert_array_equal(kept[low], f.points[low])
    others = np.delete(np.arange(len(kept)), [low, corner])
    np.testing.assert_array_equal(kept[others], f.points[others])


def test_two_fluids_in_one_can_lie_on_each_other():
    """Their volumes are those of the can below and above the surface between them, their lattices are one."""
    can = generate(CAN, Numerics(spacing=D))
    low, high, whole = (
        fill(Fluid(name="w", fill=ShellFill(shell="tank", level=level, above=above)), D, can, E, CAN)
        for level, above in ((0.15, None), (0.3, 0.15), (0.3, None))
    )
    assert low.volume + high.volume == pytest.approx(whole.volume, rel=1e-6)
    assert high.points[:, 2].min() - 0.15 == pytest.approx(0.15 - low.points[:, 2].max(), rel=0.05)
    assert high.spacing == pytest.approx(low.spacing, rel=0.03)
    both = np.concatenate([low.points, high.points])
    assert cKDTree(both).query(both, k=2)[0][:, 1].min() > 0.45 * low.lattice


@pytest.mark.parametrize(("above", "level", "words"), [(0.3, 0.2, "not below level"), (-0.1, 0.2, "does not lie between the bottom")])
def test_a_fill_that_holds_nothing_is_refused(above, level, words):
    with pytest.raises((ValueError, SceneError), match=words):
        fill(Fluid(name="w", fill=ShellFill(shell="tank", level=level, above=above)), D, generate(CAN, Numerics(spacing=D)), E, CAN)
