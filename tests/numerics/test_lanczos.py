"""Krylov iterations have the same bits whatever the number of threads that NumPy's sums may use."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from taichi_sph.numerics.lanczos import inner, largest, length

ITERATION = """
import numpy as np
from taichi_sph.bodies.shell.stable_dt import _Arnoldi
from taichi_sph.numerics.lanczos import largest
shape = (30_000, 3)
stiff = 1.0 + np.random.default_rng(1).random(shape)

def operator(y):
    along = stiff * y
    along[1:] += 0.3 * y[:-1]
    along[:-1] += 0.3 * y[1:]
    return along

one = _Arnoldi(20, shape[1], shape[0], None)
while not one.done:
    one.take(operator(one.basis[one.k]))
frequency, mode = one.largest()
print(frequency.hex(), mode.ravel()[::1000].tobytes().hex(), largest(operator, shape).hex())
"""


def test_bits_do_not_follow_from_threads_of_blas():
    found = {
        subprocess.run(
            [sys.executable, "-c", ITERATION], env={**os.environ, "OPENBLAS_NUM_THREADS": n, "OMP_NUM_THREADS": n}, check=True,
            capture_output=True, text=True,
        ).stdout
        for n in "12"
    }  # fmt: skip
    assert len(found) == 1


def test_sums_and_the_largest_eigenvalue():
    a, b = np.random.default_rng(2).standard_normal((2, 12_345, 3))
    assert inner(a, b) == pytest.approx(float((a * b).sum()), rel=1e-12, abs=1e-9)
    assert length(a) == pytest.approx(np.sqrt((a * a).sum()), rel=1e-13)
    values = np.linspace(1.0, 7.0, 500)
    values[-1] = 9.0
    assert largest(lambda y: values * y, (500,)) == pytest.approx(9.0, rel=1e-6)
