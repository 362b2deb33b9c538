"""Scatter of ductility: the distribution, what it depends on, and a strip that tears at its weakest cell."""

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.laws.scatter import shares
from taichi_sph.scene import Box, LemaitreChaboche, Material, Numerics, Plate, Power, PrescribedVelocity, Scene, Shell
from taichi_sph.world.world import World

PLACES = np.random.default_rng(1).uniform(-1, 1, (200_000, 3))


@pytest.mark.parametrize("variation", [0.01, 0.1, 0.3])
def test_the_distribution_is_weibulls(variation):
    found = shares(PLACES, variation, 0)
    assert found.mean() == pytest.approx(1.0, abs=5 * variation / np.sqrt(len(PLACES)))
    assert found.std() == pytest.approx(variation, rel=0.02)
    # Weibull's plot is a line: ln(-ln(1 - F)) over ln x
    x = np.sort(found)[1000:-1000:500]
    rank = (np.searchsorted(np.sort(found), x) + 0.5) / len(found)
    assert np.corrcoef(np.log(x), np.log(-np.log1p(-rank)))[0, 1] > 0.9999


def test_a_share_belongs_to_its_place_and_seed():
    found, order = shares(PLACES, 0.1, 3), np.random.default_rng(2).permutation(len(PLACES))
    assert (shares(PLACES[order], 0.1, 3) == found[order]).all()
    assert abs(np.corrcoef(found, shares(PLACES, 0.1, 4))[0, 1]) < 0.01
    grid = np.stack(np.meshgrid(*[np.arange(60) * 1e-3] * 3, indexing="ij"), axis=-1)  # neighbours are strangers
    even = shares(grid.reshape(-1, 3), 0.1, 0).reshape(60, 60, 60)
    for axis in range(3):
        assert abs(np.corrcoef(np.moveaxis(even, axis, 0)[1:].ravel(), np.moveaxis(even, axis, 0)[:-1].ravel())[0, 1]) < 0.01


@pytest.mark.parametrize("layers", [None, pytest.param(3, marks=pytest.mark.long)])
def test_a_strip_tears_at_its_weakest_cells(layers):
    """Pulled evenly, the cell that breaks first is the one whose strains of damage are the least."""
    metal = Material(
        name="m", young=70e9, poisson=0.3, density=2700, strength=Power(A=1e8, B=1e9, n=1.0, layers=layers),
        damage=LemaitreChaboche(threshold=0.0, rupture=0.05, critical=0.1, scatter=0.2), critical_damage=0.1,
    )  # fmt: skip
    strip = Shell(name="strip", surface=Plate(length=0.04, width=0.02), thickness=1e-3, material=metal, motion="free")
    scene = Scene(
        name="strip", title="Strip", source="tests", duration=1e-4, shells=[strip], numerics=Numerics(spacing=2e-3),
        motions=[
            PrescribedVelocity(where=Box(hi=(1e-6, None, None)), velocity=(-20, None, 0)),
            PrescribedVelocity(where=Box(lo=(0.04 - 1e-6, None, None)), velocity=(20, None, 0)),
        ],
    )  # fmt: skip
    world = World(scene, threads=1)
    cells = world.shell.cells
    while not runtime.get(cells.broken, cells.n).any():
        world.advance(5)
    tough = runtime.get(cells.tough, cells.n)
    first = np.flatnonzero(runtime.get(cells.broken, cells.n))
    assert tough.std() == pytest.approx(0.2, rel=0.15)
    assert tough[first].max() <= np.sort(tough)[len(tough) // 20]
