"""Scatter of ductility: the distribution, what it depends on, and a strip that tears at its weakest cell."""

import numpy as np
import pytest

from taichi_sph.laws.scatter import shares

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
