"""Laws at a point against closed forms, quadrature and a fine integration of their differential equations."""

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from taichi_sph import runtime
from taichi_sph.laws import delay, ductile, elastic, hardening, johnson_cook, mazars
from taichi_sph.runtime import ti

THRESHOLD, A, B = 8.5e-5, 0.9, 7300.0  # T table 2.2, A lowered so that it matters
YOUNG, NU = 32e9, 0.2


@ti.kernel
def _elastic(young: ti.f64, nu: ti.f64, E: ti.types.ndarray(), S: ti.types.ndarray()):
    for k in range(E.shape[0]):
        s = elastic.plane_stress(young, nu, E[k, 0], E[k, 1], E[k, 2])
        for c in ti.static(range(3)):
            S[k, c] = s[c]


@ti.kernel
def _equivalent(nu: ti.f64, E: ti.types.ndarray(), eps: ti.types.ndarray()):
    for k in range(E.shape[0]):
        eps[k] = mazars.equivalent_strain(nu, E[k, 0], E[k, 1], E[k, 2])


@ti.kernel
def _damage(eps: ti.types.ndarray(), threshold: ti.f64, A: ti.f64, B: ti.f64, D: ti.types.ndarray()):
    for k in range(eps.shape[0]):
        D[k] = mazars.damage(eps[k], threshold, A, B)


@ti.kernel
def _delay(D: ti.types.ndarray(), start: ti.f64, a: ti.f64, tau_c: ti.f64, dt: ti.f64, delayed: ti.types.ndarray()):
    ti.loop_config(serialize=True)
    for k in range(D.shape[0]):
        before = start
        if k > 0:
            before = delayed[k - 1]
        delayed[k] = delay.advance(before, D[k], a, tau_c, dt)


@ti.kernel
def _power(A: ti.f64, B: ti.f64, n: ti.f64, lam: ti.types.ndarray(), more: ti.types.ndarray(), out: ti.types.ndarray()):
    for k in range(lam.shape[0]):
        stress, slope = hardening.power(lam[k], A, B, n)
        after, slope_after = hardening.power_after(lam[k], more[k], stress, A, B, n)
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = stress, slope, after, slope_after


@ti.kernel
def _table(points: ti.template(), count: ti.i32, lam: ti.types.ndarray(), out: ti.types.ndarray()):
    for k in range(lam.shape[0]):
        stress, slope = hardening.table(lam[k], points, 0, count)
        out[k, 0], out[k, 1] = stress, slope


@ti.kernel
def _factor(rate: ti.types.ndarray(), C: ti.f64, rate0: ti.f64, out: ti.types.ndarray()):
    for k in range(rate.shape[0]):
        out[k] = johnson_cook.factor(rate[k], C, rate0)


@ti.kernel
def _growth(p: ti.types.ndarray(), dp: ti.f64, ratio2: ti.f64, nu: ti.f64, d: ti.f64, r: ti.f64, c: ti.f64, out: ti.types.ndarray()):
    for k in range(p.shape[0]):
        out[k] = ductile.growth(p[k], dp, ductile.triaxiality(nu, ratio2), d, r, c)


@pytest.fixture(scope="module", autouse=True)
def taichi():
    runtime.start()


def stress(E, young=YOUNG, nu=NU):
    S = np.zeros_like(E)
    _elastic(young, nu, E, S)
    return S


def equivalent(E, nu=NU):
    eps = np.zeros(len(E))
    _equivalent(nu, np.ascontiguousarray(E), eps)
    return eps


def damage(eps, threshold=THRESHOLD, a=A, b=B):
    D = np.zeros(len(eps))
    _damage(np.ascontiguousarray(eps), threshold, a, b, D)
    return D


def delayed(D, start=0.0, a=10.0, tau_c=1e-6, dt=1e-8):
    result = np.zeros(len(D))
    _delay(np.ascontiguousarray(D), start, a, tau_c, dt, result)
    return result


# --- elasticity -------------------------------------------------------------------------------------


def test_plane_stress_is_3d_elasticity_with_free_thickness():
    E = np.random.default_rng(0).normal(size=(50, 3)) * 1e-3
    lam, mu = YOUNG * NU / ((1 + NU) * (1 - 2 * NU)), YOUNG / (2 * (1 + NU))
    e33 = -lam / (lam + 2 * mu) * (E[:, 0] + E[:, 1])
    trace = E[:, 0] + E[:, 1] + e33
    expected = np.stack([lam * trace + 2 * mu * E[:, 0], lam * trace + 2 * mu * E[:, 1], 2 * mu * E[:, 2]], axis=1)
    assert stress(E) == pytest.approx(expected, rel=1e-12, abs=1e-3)
    assert lam * trace + 2 * mu * e33 == pytest.approx(np.zeros(50), abs=1e-3)


def test_uniaxial_tension():
    assert stress(np.array([[1e-3, -NU * 1e-3, 0.0]]))[0] == pytest.approx([YOUNG * 1e-3, 0, 0], abs=1e-6)


# --- Mazars -----------------------------------------------------------------------------------------


def test_equivalent_strain_from_eigenvalues():
    E = np.random.default_rng(1).normal(size=(200, 3)) * 1e-4
    tensors = np.zeros((200, 3, 3))
    tensors[:, 0, 0], tensors[:, 1, 1], tensors[:, 0, 1], tensors[:, 1, 0] = E[:, 0], E[:, 1], E[:, 2], E[:, 2]
    tensors[:, 2, 2] = -NU / (1 - NU) * (E[:, 0] + E[:, 1])
    expected = np.linalg.norm(np.maximum(np.linalg.eigvalsh(tensors), 0), axis=1)
    assert equivalent(E) == pytest.approx(expected, rel=1e-10)


def test_equivalent_strain_does_not_see_the_axes():
    E = np.array([[2e-4, -1e-4, 5e-5]])
    turned = []
    for angle in np.linspace(0, np.pi, 7):
        R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        T = R @ np.array([[E[0, 0], E[0, 2]], [E[0, 2], E[0, 1]]]) @ R.T
        turned.append([T[0, 0], T[1, 1], T[0, 1]])
    assert equivalent(np.array(turned)) == pytest.approx(np.full(7, equivalent(E)[0]), rel=1e-12)


def test_damage_integrates_its_rate():
    """T 2.64 with the sign of its second term put right: dD/deps = eps_D (1 - A)/eps^2 + A B exp(-B (eps - eps_D))."""
    for eps in (1.01e-4, 2e-4, 5e-4, 3e-3):
        whole, _ = quad(
            lambda x: THRESHOLD * (1 - A) / x**2 + A * B * np.exp(-B * (x - THRESHOLD)), THRESHOLD, eps, epsabs=1e-12, limit=200
        )
        assert damage(np.array([eps]))[0] == pytest.approx(whole, abs=1e-9)


def test_damage_grows_from_zero_to_one():
    eps = np.linspace(0, 0.05, 5001)
    D = damage(eps)
    assert np.all(D[eps <= THRESHOLD] == 0) and np.all(np.diff(D) >= 0)
    assert D[-1] < 1 and damage(np.array([1e6]))[0] == pytest.approx(1.0, abs=1e-9)
    just = damage(np.array([THRESHOLD * (1 + 1e-9)]))[0]
    assert 0 < just < 1e-8  # no jump at the threshold


@pytest.mark.parametrize("changed", [{"threshold": 1e-4}, {"a": 0.8}, {"b": 8000.0}])
def test_every_parameter_counts(changed):
    eps = np.array([3e-4])
    assert abs(damage(eps, **changed)[0] - damage(eps)[0]) > 1e-3


def test_poisson_counts():
    E = np.array([[-2e-4, -1e-4, 0.0]])
    assert equivalent(E)[0] == pytest.approx(NU / (1 - NU) * 3e-4)  # squeezed in the plane, it swells through the thickness
    assert equivalent(E, nu=0.3)[0] > equivalent(E)[0]
    assert np.all(stress(E, nu=0.3) != stress(E)) or stress(E, nu=0.3)[0, 0] != stress(E)[0, 0]


# --- delay ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("a, tau_c", [(10.0, 1e-6), (1.0, 15e-6), (0.5, 2e-7)])
def test_delay_against_a_fine_integration(a, tau_c):
    """D rises in stairs: between two of them the law's own exact solution, T 2.73 by scipy."""

    def rate(_, r, target):
        return [(1 - np.exp(-a * max(target - r[0], 0.0))) / tau_c]

    dt, n = tau_c / 7, 60
    D = np.minimum(1.0, np.floor(np.linspace(0, 6, n)) / 5)
    expected, y = [], 0.0
    for target in D:
        solution = solve_ivp(
            lambda _, r, target=target: [(1 - np.exp(-a * max(target - r[0], 0.0))) / tau_c], (0, dt), [y], rtol=1e-11, atol=1e-13
        )
        y = solution.y[0, -1]
        expected.append(y)
    assert delayed(D, a=a, tau_c=tau_c, dt=dt) == pytest.approx(expected, abs=1e-6)


def test_delay_never_outruns_its_bound():
    tau_c = 1e-6
    for a in (0.1, 10.0, 200.0):
        for dt in (1e-9, 1e-7, 5e-7):
            D = delayed(np.ones(40), a=a, tau_c=tau_c, dt=dt)
            rate = np.diff(np.r_[0.0, D]) / dt
            assert np.all(rate <= 1 / tau_c * (1 + 1e-9)) and np.all(rate >= 0) and np.all(D <= 1)
    # a steep law comes close to the bound: it is the bound that is met, not something below
    assert delayed(np.ones(1), a=200.0, dt=1e-9)[0] == pytest.approx(1e-9 / tau_c, rel=1e-6)


def test_delay_does_not_heal_and_does_not_overtake():
    D = np.array([0.5, 0.8, 0.2, 0.1, 0.9])
    result = delayed(D, dt=2e-7)
    assert np.all(np.diff(result) >= 0)
    assert delayed(np.array([0.3]), start=0.6)[0] == 0.6
    assert delayed(np.array([0.3]), dt=1.0)[0] == pytest.approx(0.3)
    assert delayed(np.array([0.7]), dt=0.0)[0] == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("changed", [{"a": 5.0}, {"tau_c": 2e-6}])
def test_every_delay_parameter_counts(changed):
    D = np.array([0.4])
    assert abs(delayed(D, dt=5e-7, **changed)[0] - delayed(D, dt=5e-7)[0]) > 1e-2


@pytest.mark.parametrize("a", [10.0, 90.0, 1e3, 1e5])
def test_a_brittle_delay_does_not_overflow(a):
    """exp(a y) is beyond any float; D_r must still follow D at the rate 1 / tau_c, then catch up with it."""
    D_r = delayed(np.ones(20), a=a, tau_c=1.0, dt=0.1)
    assert D_r == pytest.approx(np.minimum(0.1 * np.arange(1, 21), 1.0), abs=2.0 / a)


# --- metals (paths through the whole law: tests/shell/test_plasticity.py) -----------------------------


@pytest.mark.parametrize("n", [0.05, 0.3, 1.0])
def test_power_hardening(n):
    """A + B lambda^n and its slope, guarded at 0; from a state near by as from nothing, within rounding."""
    lam = np.r_[0.0, 1e-12, 1e-6, 1e-3, 0.1, 1.0, 3.0]
    for more in (0.0, 1e-9, 0.02, 0.5):
        out = np.zeros((len(lam), 4))
        _power(2e8, 4e8, n, lam, np.full(len(lam), more) * np.maximum(lam, 1e-9), out)
        after = lam + more * np.maximum(lam, 1e-9)
        assert np.isfinite(out).all()
        assert out[2:, 0] == pytest.approx(2e8 + 4e8 * lam[2:] ** n, rel=1e-12)
        assert out[2:, 2] == pytest.approx(2e8 + 4e8 * after[2:] ** n, rel=1e-11)
        assert out[2:, 1] == pytest.approx(4e8 * n * lam[2:] ** (n - 1), rel=1e-9)
        assert out[2:, 3] == pytest.approx(4e8 * n * after[2:] ** (n - 1), rel=1e-9)
        assert out[0, 0] == 2e8


def test_table_hardening():
    x, y = np.array([0.0, 0.01, 0.1, 0.5]), np.array([2e8, 3e8, 3.5e8, 3.5e8])
    points = runtime.new("test.points", 4, 2)
    runtime.put(points, np.stack([x, y], axis=1))
    lam = np.r_[np.linspace(0, 0.7, 71), x]
    out = np.zeros((len(lam), 2))
    _table(points, 4, lam, out)
    assert out[:, 0] == pytest.approx(np.interp(lam, x, y), rel=1e-12)
    assert out[0, 1] == pytest.approx(1e10) and out[-1, 1] == 0.0


def test_johnson_cook_factor():
    out = np.zeros(5)
    _factor(np.array([0.0, 1e-4, 1e-3, 1.0, 1e5]), 0.38, 1e-3, out)
    assert out == pytest.approx([1, 1, 1, 1 + 0.38 * np.log(1e3), 1 + 0.38 * np.log(1e8)])


def test_ductile_growth():
    """Linear from the threshold to D_c at eps_r in tension (R_nu = 1); the step that crosses counts in part."""
    out = np.zeros(4)
    _growth(np.array([0.05, 0.1, 0.13, 0.5]), 0.05, 1 / 9, 0.3, 0.1, 0.6, 0.2, out)
    assert out == pytest.approx([0, 0, 0.2 / 0.5 * 0.03, 0.2 / 0.5 * 0.05])
    _growth(np.array([0.5, 0.5, 0.5, 0.5]), 0.05, 4 / 9, 0.3, 0.1, 0.6, 0.2, out)
    assert out[0] == pytest.approx(0.2 / 0.5 * 0.05 * 1.4)  # equal tension both ways
