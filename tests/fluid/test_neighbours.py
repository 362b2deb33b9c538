"""Lists against scipy's tree: sets exact, each point once, after moves, across the wrap of the cells, far away."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from taichi_sph import runtime
from taichi_sph.numerics.neighbours import Neighbours

REACH = 0.1


@pytest.fixture(scope="module")
def cloud():
    runtime.start()
    n = 3000
    rng = np.random.default_rng(3)
    x = rng.uniform(0, 1, (n, 3)) * [1.0, 0.6, 0.5] + [50.0, -0.3, -70.0]
    field = runtime.new("x", n, 3, "f64")
    runtime.put(field, x)
    return Neighbours("cloud", field, n, REACH, 0.05, np.array([x.min(axis=0), x.max(axis=0)])), x


def lists(nb, x):
    """The lists of points x, sorted first; compared with the tree's in the order of the sort."""
    runtime.put(nb.x, x)
    nb.order()
    source = runtime.get(nb.source, nb.n)
    assert np.array_equal(np.sort(source), np.arange(nb.n))
    runtime.put(nb.x, x[source])
    nb.list()
    number, near = runtime.get(nb.number, nb.n), runtime.get(nb.near, nb.n * nb.width).reshape(nb.n, nb.width)
    assert number.max() <= nb.width
    for i, true in enumerate(cKDTree(x[source]).query_ball_point(x[source], REACH * (1 - 1e-13))):
        assert sorted(near[i, : number[i]]) == sorted(true)


def test_exact(cloud):
    lists(*cloud)


def test_after_moves_beyond_the_first_box(cloud):
    nb, x = cloud
    lists(nb, 3.0 * (x[::-1] - 7.0))


def test_a_stray_particle_far_away(cloud):
    nb, x = cloud
    far = x.copy()
    far[17] += [1e5, -2e5, 3e5]
    lists(nb, far)


def test_a_crowd_widens_the_lists(cloud):
    nb, x = cloud
    before = nb.width
    lists(nb, (x - x.mean(axis=0)) * 0.6)
    assert nb.width > before


def test_moved_bounds_the_relative_displacement(cloud):
    nb, x = cloud
    lists(nb, x)
    now = runtime.get(nb.x, nb.n)
    move = np.random.default_rng(5).uniform(-0.01, 0.01, now.shape)
    runtime.put(nb.x, now + move + [0.3, 0, 0])
    relative = nb.moved()
    pairs = np.linalg.norm(move[:, None] - move[None], axis=2).max()
    assert pairs <= relative <= np.sqrt(3) * 0.0201


def test_order_keeps_what_stands_in_order(cloud):
    nb, x = cloud
    lists(nb, x)
    nb.order()
    assert np.array_equal(runtime.get(nb.source, nb.n), np.arange(nb.n))
