"""Fields seen as NumPy arrays are what kernels see, and neither filling nor reading one compiles anything."""

import numpy as np
import pytest

from taichi_sph import frontend, runtime
from taichi_sph.runtime import ti

KINDS = {"f64": np.float64, "f32": np.float32, "i32": np.int32, "i8": np.int8}
SIZES = (0, 1, 2, 3, 6, 9)


def copies() -> list[str]:
    """Kernels of Taichi's own that were compiled."""
    made = [k.func for k in ti.lang.impl.get_runtime().kernels if k.compiled_kernels]
    return [f.__qualname__ for f in made if f.__module__.startswith("taichi.")]


@ti.kernel
def _double(f: ti.template(), n: ti.i32):
    for i in range(n):
        f[i] *= 2


@pytest.fixture(scope="module")
def fields():
    """Fields of all kinds and sizes in three trees, with their values."""
    runtime.start()
    made, rng = [], np.random.default_rng(0)
    for tree in range(3):
        for size in SIZES:
            for kind, real in KINDS.items():
                n = 37 * (tree + 1)
                values = rng.integers(-60, 60, (n, size) if size else n).astype(real)
                field = runtime.new(f"{tree}.{size}.{kind}", n, size, kind)
                runtime.put(field, values)
                made.append((field, values))
        first, values = made[-len(SIZES) * len(KINDS)]
        _double(first, len(values))  # lays out a tree, after what waits was written
        values *= 2
    return made


def test_values_come_back(fields):
    for field, values in fields:
        assert np.array_equal(runtime.get(field, len(values)), values)
        assert runtime.get(field, len(values)).dtype == values.dtype
    assert not copies()


def test_taichi_reads_the_same(fields):
    for field, values in fields[::5]:
        found = field.to_numpy()
        assert np.array_equal(found[: len(values)], values) and not found[len(values) :].any()


def test_an_array_is_a_copy_and_the_rest_is_zero(fields):
    field, values = fields[0]
    runtime.get(field, 3)[:] = 7.0
    assert np.array_equal(runtime.get(field, len(values)), values)
    runtime.fill(field, 3.0)
    assert (runtime.get(field, field.shape[0]) == 3.0).all()
    runtime.put(field, values[:5])
    assert np.array_equal(runtime.get(field, 5), values[:5]) and not runtime.get(field, field.shape[0])[5:].any()


def test_values_wait_for_their_field_and_the_last_one_counts():
    runtime.start()
    one, two = runtime.new("one", 20), runtime.new("two", 20, 3)
    values = np.arange(20.0)
    runtime.put(one, values)
    values[:] = -1.0  # it was copied
    runtime.fill(two, 4.0)
    runtime.put(two, np.ones((20, 3)))
    _double(one, 20)
    assert np.array_equal(runtime.get(one, 20), 2.0 * np.arange(20))
    assert (runtime.get(two, 20) == 1.0).all()
    late = runtime.new("late", 8)
    runtime.put(late, np.full(8, 5.0))
    runtime.put(one, np.zeros(20))  # a field that is laid out already, while another one waits
    _double(one, 20)
    assert (runtime.get(one, 20) == 0.0).all() and (runtime.get(late, 8) == 5.0).all()
    with pytest.raises(ValueError):
        runtime.put(two, np.ones(20))


def test_what_is_remembered_is_there_in_this_taichi():
    """Else the start is as slow as Taichi makes it, and nobody says so."""
    from taichi.lang import impl, kernel_impl, snode
    from taichi.lang.ast import ast_transformer_utils

    assert impl.get_traceback is snode.get_traceback is frontend._nowhere
    assert kernel_impl._inside_class is frontend._inside_class
    assert ast_transformer_utils.TextWrapper is frontend._wrapper
    assert hasattr(kernel_impl.getsourcelines, "cache_info") and hasattr(kernel_impl.getsourcefile, "cache_info")
    assert hasattr(kernel_impl.textwrap.fill, "cache_info")


def test_a_kernel_of_a_class_is_told_from_one_of_a_module():
    assert not _double._is_classkernel
    assert Doubler.double._is_classkernel


@ti.data_oriented
class Doubler:
    @ti.kernel
    def double(self) -> ti.i32:
        return 2
