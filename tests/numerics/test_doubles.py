"""exp, log, sin and cos of 64 bits made of sums and products, against NumPy; and what long loops did, against Taichi's own."""

import numpy as np

from taichi_sph import runtime
from taichi_sph.numerics import doubles
from taichi_sph.numerics.cells import CellGrid, group, running
from taichi_sph.numerics.neighbours import Neighbours
from taichi_sph.runtime import ti


@ti.kernel
def _all(x: ti.types.ndarray(), found: ti.types.ndarray()):
    for i in range(x.shape[0]):
        found[i, 0] = doubles._exp(x[i])
        found[i, 1] = doubles._log(ti.abs(x[i]) + 1e-3)
        found[i, 2] = doubles._wave(x[i], 0)
        found[i, 3] = doubles._wave(x[i], 1)


def test_functions_of_64_bits():
    runtime.start()
    x = np.concatenate([np.linspace(-30, 30, 2001), [0.0, 1e-9, -1e-9, np.pi, np.pi / 2, 3 * np.pi / 4]])
    found = np.zeros((len(x), 4))
    _all(x, found)
    exact = np.column_stack([np.exp(x), np.log(np.abs(x) + 1e-3), np.sin(x), np.cos(x)])
    np.testing.assert_allclose(found[:, 0], exact[:, 0], rtol=2e-15)
    np.testing.assert_allclose(found[:, 1:], exact[:, 1:], rtol=0, atol=4e-15)


def test_what_is_done_in_order_by_numpy_is_what_one_thread_does(monkeypatch):
    """Grids, lists and sums of a device that cuts long loops off."""
    n = 5000
    x = np.random.default_rng(3).normal(size=(n, 3))
    found = []
    for long_loops in (True, False):
        runtime.start()
        monkeypatch.setattr(runtime, "one_by_one", lambda: long_loops)  # noqa: B023, called in this round only
        points = runtime.new("points", n, 3, "f64")
        runtime.put(points, x)
        grid = CellGrid("grid", points, n, 0.3)
        near = Neighbours("near", points, n, 0.3, 0.2, np.array([[-3.0] * 3, [3.0] * 3]))
        near.order()
        counts = runtime.new("counts", n + 1, dtype="i32")
        runtime.put(counts, np.arange(n + 1, dtype=np.int32) % 7)
        total = running(counts, n)
        arrays = (grid.start, grid.table + 1), (grid.sorted, n), (near.start, near.cells + 1), (near.source, n), (counts, n + 1)
        found.append([np.array(total), *(runtime.get(*a) for a in arrays)])
    for one, other in zip(*found, strict=True):
        np.testing.assert_array_equal(one, other)


def test_group():
    runtime.start()
    owner, start, entry = (runtime.new(name, 20, dtype="i32") for name in ("owner", "start", "entry"))
    runtime.put(owner, np.array([2, 0, 2, 4, 0], np.int32))
    group(owner, start, entry, 5, 5)
    assert runtime.get(start, 6).tolist() == [0, 2, 2, 4, 4, 5] and runtime.get(entry, 5).tolist() == [1, 4, 0, 2, 3]
