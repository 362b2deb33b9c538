"""A launch that is made again does what Taichi's own does."""

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.pool import Pool
from taichi_sph.runtime import ti


@ti.kernel
def add(pool: ti.template(), n: ti.i32, value: ti.f64) -> ti.f64:
    total = ti.cast(0.0, ti.f64)
    ti.loop_config(serialize=True)
    for i in range(n):
        pool.x[i] += value
        total += pool.x[i]
    return total


@ti.kernel
def scale(pool: ti.template(), power: ti.template(), by: ti.f32):
    for i in range(8):
        for _ in ti.static(range(power)):
            pool.x[i] *= by


@ti.kernel
def weigh(pool: ti.template(), first: ti.types.vector(3, ti.i32), scale: ti.f64, record: ti.types.vector(2, ti.f64)):
    for i in range(2):
        pool.x[first[i + 1]] += scale * record[i] + first[0]


def pool(name):
    made = Pool(name)
    made.x = made.field("x", 8, dtype="f64", doc="a number")
    return made


@pytest.fixture
def two():
    runtime.start(threads=1)
    return pool("one"), pool("two")


def known():
    return len(add._primal.known)


def test_numbers_and_templates_may_change(two):
    one, other = two
    assert add(one, 3, 1.5) == 4.5 and known() == 1
    assert add(one, 2, 1) == 5.0 and known() == 1  # whole numbers are real ones too, and so are NumPy's
    assert add(other, np.int64(2), np.float32(0.25)) == 0.5 and known() == 2
    assert add(other, np.int32(1), 0.0) == 0.25 and known() == 2
    assert runtime.get(one.x, 4) == pytest.approx([2.5, 2.5, 1.5, 0.0]) and runtime.get(other.x, 3) == pytest.approx([0.25, 0.25, 0.0])


def test_components_of_vectors_may_change(two):
    one, _ = two
    weigh(one, (5, 0, 1), 2.0, (0.5, 0.25))
    assert len(weigh._primal.known) == 1
    for first, record in (((7, 2, 3), [1.0, 2]), (np.array([0, 4, 5], np.int32), np.array([3.0, 4.0])), ((0, 6, 7), ti.Vector([0.5, 1.5]))):
        weigh(one, first, 2.0, record)
    assert len(weigh._primal.known) == 1
    assert runtime.get(one.x, 8) == pytest.approx([6.0, 5.5, 9.0, 11.0, 6.0, 8.0, 1.0, 3.0])
    for bad in ((1.5, 0, 1), (1, 0), (1, 0, "x"), 3):
        with pytest.raises(Exception) as quick:
            weigh(one, bad, 2.0, (0.5, 0.25))
        with pytest.raises(Exception) as slow:
            type(weigh._primal).__call__.__wrapped__(weigh._primal, one, bad, 2.0, (0.5, 0.25))
        assert type(quick.value) is type(slow.value)


def test_a_template_that_is_a_number_is_taken_by_its_value(two):
    one, _ = two
    runtime.fill(one.x, 1.0)
    for power in (1, 2, 1, 2):
        scale(one, power, 3.0)
    assert runtime.get(one.x, 8) == pytest.approx(np.full(8, 3.0**6)) and not scale._primal.known


@pytest.mark.parametrize("bad", [(2.5, 1.0), (1, "x"), ("1", 1.0), (None, 1.0), (2**80, 1.0)])
def test_what_is_no_number_is_refused_as_by_taichi(two, bad):
    one, _ = two
    add(one, 1, 1.0)
    with pytest.raises(Exception) as quick:
        add(one, *bad)
    with pytest.raises(Exception) as slow:
        type(add._primal).__call__.__wrapped__(add._primal, one, *bad)
    assert (
        type(quick.value) is type(slow.value) and str(quick.value).split(" at 0x")[0].strip() == str(slow.value).split(" at 0x")[0].strip()
    )
    assert runtime.get(one.x, 2) == pytest.approx([1.0, 0.0])
    with pytest.raises(Exception, match="missing"):
        add(one, 1)


def test_nothing_of_a_run_is_left_in_the_next(two):
    one, _ = two
    add(one, 1, 1.0)
    runtime.start(threads=1)
    assert known() == 0
    again = pool("one")
    assert add(again, 1, 2.0) == 2.0 and known() == 1


def test_what_waits_is_written_before_a_launch_that_is_known(two):
    """Values put into a field while another one has no place yet (memory.py)."""
    one, _ = two
    assert add(one, 1, 1.0) == 1.0 and known() == 1
    late = pool("late")
    runtime.put(one.x, np.full(8, 100.0))
    assert add(one, 1, 1.0) == 101.0
    assert runtime.get(one.x, 2) == pytest.approx([101.0, 100.0]) and not runtime.get(late.x, 8).any()
