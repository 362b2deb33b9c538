"""Equations of state: c^2 = dp/d rho at rest, p = rho^2 de/d rho everywhere, small compressions keep their digits."""

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.laws import eos_acoustic, eos_tait
from taichi_sph.runtime import ti

C, RHO, GAMMA = 1450.0, 1000.0, 7.15


@pytest.fixture(scope="module")
def laws():
    """name -> function of s: p, e / c^2, s(p)."""
    runtime.start()

    def of(law):
        @ti.kernel
        def kernel(s: ti.f64, out: ti.types.ndarray()):
            for _ in range(1):
                p = law.pressure(RHO * C**2, GAMMA, s)
                out[0], out[1], out[2] = p, law.energy(GAMMA, s), law.compression(RHO * C**2, GAMMA, p)

        def call(s):
            out = np.zeros(3)
            kernel(s, out)
            return out

        return call

    return {"acoustic": of(eos_acoustic), "tait": of(eos_tait)}


@pytest.mark.parametrize("name", ["acoustic", "tait"])
def test_sound_speed(laws, name):
    d = 1e-5
    slope = (laws[name](d)[0] - laws[name](-d)[0]) / (2 * d * RHO)
    assert slope == pytest.approx(C**2, rel=1e-8)


@pytest.mark.parametrize("name", ["acoustic", "tait"])
@pytest.mark.parametrize("s", [-0.05, -2e-4, 1e-6, 5e-5, 9.9e-4, 1.01e-3, 0.01, 0.2])
def test_energy_is_the_integral_of_the_pressure(laws, name, s):
    d = 1e-4 * abs(s)
    slope = (laws[name](s + d)[1] - laws[name](s - d)[1]) * C**2 / (2 * d * RHO)
    assert slope == pytest.approx(laws[name](s)[0] / (RHO * (1 + s)) ** 2, rel=3e-7)
    assert laws[name](s)[2] == pytest.approx(s, rel=1e-12)


@pytest.mark.parametrize("name", ["acoustic", "tait"])
def test_small_compressions_keep_their_digits(laws, name):
    p, e, _ = laws[name](1e-9)
    assert p == pytest.approx(RHO * C**2 * 1e-9, rel=1e-8) and e == pytest.approx(0.5e-18, rel=1e-8)
