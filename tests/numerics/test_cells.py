"""Grid hash against brute force: far from the origin, in 3-D, with hash collisions, after points moved."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from taichi_sph import runtime
from taichi_sph.numerics.cells import CUBES, CellGrid, beside, cube
from taichi_sph.runtime import ti


@ti.kernel
def _neighbours(grid: ti.template(), points: ti.template(), n: ti.i32, table: ti.i32, reach: ti.f64, found: ti.types.ndarray()):
    for i in range(n):
        for k in range(CUBES):
            there, first, last = beside(grid, points[i], k, 1.0 / reach, table)
            for m in range(first, last):
                j = grid.sorted[m]
                if all(cube(points[j], 1.0 / reach) == there):
                    if (points[j] - points[i]).norm() < reach:
                        found[i, j] += 1


def _brute(x, reach):
    result = np.zeros((len(x), len(x)), np.int32)
    for i, near in enumerate(cKDTree(x).query_ball_point(x, reach * (1 - 1e-12))):
        result[i, near] = 1
    return result


@pytest.fixture(scope="module")
def cloud():
    """(grid, field of points, reach): 600 points around a place far from the origin, on both sides of zero in y."""
    runtime.start()
    n, reach = 600, 0.11
    points = runtime.new("points", n, 3, "f64")
    x = np.random.default_rng(1).uniform(0, 1, (n, 3)) + [4000.0, -0.5, -7000.0]
    runtime.put(points, x)
    return CellGrid("cloud", points, n, reach), points, x, reach


def _search(grid, points, n, reach):
    found = np.zeros((n, n), np.int32)
    _neighbours(grid, points, n, grid.table, reach, found)
    return found


def test_every_neighbour_once(cloud):
    grid, points, x, reach = cloud
    assert np.array_equal(_search(grid, points, len(x), reach), _brute(x, reach))


def test_table_is_a_counting_sort(cloud):
    grid, _, x, reach = cloud
    start, order = runtime.get(grid.start, grid.table + 1), runtime.get(grid.sorted, len(x))
    assert np.array_equal(np.sort(order), np.arange(len(x)))
    assert start[0] == 0 and start[-1] == len(x) and np.all(np.diff(start) >= 0)
    assert all(np.all(np.diff(order[a:b]) > 0) for a, b in zip(start, start[1:]))
    cubes = np.floor(x / reach).astype(int)
    shared = [len(np.unique(cubes[order[a:b]], axis=0)) for a, b in zip(start, start[1:]) if b > a]
    assert max(shared) > 1, "no two cubes met in a bucket: this cloud tests no collision"


def test_moved_points_are_found_again(cloud):
    grid, points, x, reach = cloud
    moved = x[::-1] * 0.7 + [30.0, 0.4, -9.0]
    runtime.put(points, moved)
    grid.rebuild()
    assert np.array_equal(_search(grid, points, len(x), reach), _brute(moved, reach))


def test_all_in_one_bucket(cloud):
    """Points closer than the reach: one cube, or a few around a corner of the lattice of cubes."""
    grid, points, x, reach = cloud
    dense = 0.3 * reach * (x - x.mean(axis=0))
    runtime.put(points, dense)
    grid.rebuild()
    assert np.array_equal(_search(grid, points, len(x), reach), _brute(dense, reach))
