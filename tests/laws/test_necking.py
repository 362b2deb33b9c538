"""Necks spread over wide cells, against Considere's closed forms."""

import pytest

from taichi_sph.laws.hardening import at
from taichi_sph.laws.necking import rupture_strain, uniform_strain
from taichi_sph.scene import LemaitreChaboche, Perfect, Power, Table, material

STEEL = material("steel, tank")
NECKED = material(STEEL.name, damage=STEEL.damage.model_copy(update={"necks": True}))


def test_uniform_strain_in_closed_form():
    """sigma = B eps^n necks at n; a straight line A + H eps at 1 - A / H; what does not harden at once."""
    assert uniform_strain(Power(A=1.0, B=500e6, n=0.25)) == pytest.approx(0.25, rel=1e-6)
    assert uniform_strain(Table(points=[(0, 100e6), (5, 1100e6)])) == pytest.approx(1 - 100 / 200, rel=1e-6)
    assert uniform_strain(Perfect(yield_stress=1e8)) == pytest.approx(0, abs=1e-9)


def test_at_the_uniform_strain_the_slope_is_the_stress():
    stress, slope = at(STEEL.strength, uniform_strain(STEEL.strength))
    assert slope == pytest.approx(stress, rel=1e-6)


def test_only_cells_wider_than_the_sheet_and_only_when_asked():
    assert rupture_strain(STEEL, 6e-3, 1e-3) == 1.0
    assert rupture_strain(NECKED, 0.5e-3, 1e-3) == 1.0
    even = uniform_strain(STEEL.strength)
    # width * (rupture - even) = e * (1 - even): the same elongation of the neck at any width
    for width in (2e-3, 6.25e-3, 15e-3):
        assert width * (rupture_strain(NECKED, width, 1e-3) - even) == pytest.approx(1e-3 * (1 - even), rel=1e-9)


def test_a_rupture_before_the_uniform_strain_stays():
    brittle = material(STEEL.name, damage=LemaitreChaboche(threshold=0, rupture=0.05, critical=0.25, necks=True))
    assert rupture_strain(brittle, 1e-2, 1e-3) == 0.05


def test_the_pool_has_the_spread_strain(tmp_path):
    from taichi_sph import runtime
    from taichi_sph.bodies.shell.pool import MaterialPool
    from taichi_sph.bodies.shell.sections import Sheet

    runtime.start("cpu", "f64", 1)
    assert MaterialPool([Sheet(NECKED, 1e-3, 8e-3)], True).eps_r[0] == pytest.approx(rupture_strain(NECKED, 8e-3, 1e-3))
