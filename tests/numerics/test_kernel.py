"""B3 (T 1.7): moments, slope, compact support, against quadrature and closed forms."""

import numpy as np
import pytest
from scipy.integrate import quad

from taichi_sph import runtime
from taichi_sph.numerics.kernel import CONSTANT, b3, b3_slope
from taichi_sph.runtime import ti


@ti.kernel
def _evaluate(q: ti.types.ndarray(), value: ti.types.ndarray(), slope: ti.types.ndarray()):
    for k in range(q.shape[0]):
        value[k] = b3(q[k])
        slope[k] = b3_slope(q[k])


@pytest.fixture(scope="module")
def curve():
    """q, b3, slope on a fine grid that holds 0, 1 and 2."""
    runtime.start()
    q = np.linspace(0.0, 2.5, 5001)
    value, slope = np.empty_like(q), np.empty_like(q)
    _evaluate(q, value, slope)
    return q, value, slope


@pytest.mark.parametrize("dim, second", [(1, 1 / 3), (2, 31 / 49), (3, 9 / 10)])
def test_moments(curve, dim, second):
    """Partition of unity (T 1.3), and the second moment of the cubic spline in units of h2."""
    q, value, _ = curve
    sphere = {1: 2.0, 2: 2 * np.pi, 3: 4 * np.pi}[dim]

    def moment(k):
        # the pieces are polynomials: Simpson's rule on 5000 intervals is exact to 1e-13
        y = CONSTANT[dim] * sphere * value * q ** (dim - 1 + k)
        return (q[1] - q[0]) / 3 * (y[0] + y[-1] + 4 * y[1:-1:2].sum() + 2 * y[2:-1:2].sum())

    assert moment(0) == pytest.approx(1.0, abs=1e-10)
    assert moment(2) == pytest.approx(second, abs=1e-10)


def test_constants_by_quadrature():
    """The same constants from scipy and the formula of T 1.7 alone."""

    def formula(q):
        return 1 - 1.5 * q**2 + 0.75 * q**3 if q < 1 else 0.25 * (2 - q) ** 3

    for dim, sphere in {1: 2.0, 2: 2 * np.pi, 3: 4 * np.pi}.items():
        whole = sphere * sum(quad(lambda q, dim=dim: formula(q) * q ** (dim - 1), a, a + 1)[0] for a in (0, 1))
        assert CONSTANT[dim] * whole == pytest.approx(1.0, abs=1e-12)


def test_slope_is_the_derivative(curve):
    q, value, slope = curve
    step = q[1] - q[0]
    central = (value[2:] - value[:-2]) / (2 * step)
    smooth = (np.abs(q[1:-1] - 1) > step) & (np.abs(q[1:-1] - 2) > step)
    assert np.abs(central - slope[1:-1])[smooth].max() < 2 * step**2
    # twice differentiable: no jump where the pieces meet
    assert np.abs(np.diff(slope)).max() < 3.1 * step
    assert slope[0] == 0.0


def test_compact_support(curve):
    q, value, slope = curve
    assert np.all(value[q >= 2] == 0) and np.all(slope[q >= 2] == 0)
    assert np.all(value[q < 2] > 0) and np.all(slope[(q > 0) & (q < 2)] < 0)
    assert value[0] == 1.0
