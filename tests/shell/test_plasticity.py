"""C1: metals at a point along paths of strain, against closed forms or a fine integration, within 0.5 %."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from taichi_sph import runtime
from taichi_sph.scene import Delay, JohnsonCook, LemaitreChaboche, Perfect, Power, Table, material

from ..points import NU, THICKNESS, YOUNG, G, Points, bent, plane, steel

A, B, N = 200e6, 400e6, 0.3
HARD = Power(A=A, B=B, n=N)


@pytest.fixture(autouse=True)
def taichi():
    runtime.start()


def flow(lam):
    return A + B * np.asarray(lam) ** N


# Proportional paths, by their stress: strains per (stress, p), of which sigma_eq dp is the work.
PATHS = {
    "uniaxial": lambda s, p: plane(s / YOUNG + p, -NU * s / YOUNG - 0.5 * p),
    "compression": lambda s, p: plane(-s / YOUNG - p, NU * s / YOUNG + 0.5 * p),
    "biaxial": lambda s, p: plane(*[(1 - NU) * s / YOUNG + 0.5 * p] * 2),
    "shear": lambda s, p: plane(0, 0, 0.5 * (s / 3**0.5 / G + 3**0.5 * p)),
}
# Components of the returned stress over sigma_y, and R_nu
EXPECTED = {"uniaxial": (1, 0, 0, 1.0), "compression": (-1, 0, 0, 1.0), "biaxial": (1, 1, 0, 1.4), "shear": (0, 0, 3**-0.5, 2.6 / 3)}


def follow(points, path, stress, p, dt=1e-6):
    """Through the states (stress, p); the last stresses."""
    for s, q in zip(stress, p):
        points.go(path(s, q)[None], dt)
    return points.get("stress")[0]


def proportional(path, strength, steps=400, last=0.5, **more):
    p = last * (np.arange(1, steps + 1) / steps) ** 2
    points = Points(1, steel(strength, **more))
    return points, follow(points, PATHS[path], flow(p), p), flow(last)


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("strength", ["power", "perfect", "table", "layers"])
def test_proportional_paths(path, strength):
    """To a plastic strain of 0.5: sigma_y(p), its direction, p, and the work sigma_y dp."""
    p = 0.5 * (np.arange(1, 401) / 400) ** 2
    table = 0.6 * np.linspace(0, 1, 200) ** 4
    law = {
        "power": HARD,
        "perfect": Perfect(yield_stress=A),
        "table": Table(points=[(x, A + B * x**N) for x in table]),
        "layers": HARD.model_copy(update={"layers": 3}),
    }[strength]
    stress = np.full(400, A) if strength == "perfect" else flow(p)
    points = Points(1, steel(law))
    found = follow(points, PATHS[path], stress, p)
    assert found[:3] == pytest.approx(stress[-1] * np.array(EXPECTED[path][:3]), abs=2e-3 * stress[-1])
    assert points.get("plastic")[0] == pytest.approx(0.5, rel=2e-3)
    assert points.get("flow")[0] == pytest.approx(stress[-1], rel=2e-3)
    work = A * 0.5 + (0 if strength == "perfect" else B * 0.5 ** (N + 1) / (N + 1))
    assert points.get("dissipated")[0] / THICKNESS == pytest.approx(work, rel=3e-3)


def test_unloading_is_elastic():
    points, stress, _ = proportional("uniaxial", HARD)
    back = 0.3 * flow(0.5)
    e1, e2 = flow(0.5) / YOUNG + 0.5, -NU * flow(0.5) / YOUNG - 0.25
    points.go(plane(e1 - back / YOUNG, e2 + NU * back / YOUNG)[None])
    after = points.get("stress")[0]
    assert (stress - after)[:2] == pytest.approx([back, 0], abs=2e-3 * back)
    assert points.get("plastic")[0] == pytest.approx(0.5, rel=2e-3)


@pytest.mark.parametrize("alpha, moment", [(2 / 3, 0.25), (1.0, 1 / 6)])
def test_pure_bending(alpha, moment):
    """The hinge M = sigma_y e^2/4 with alpha = 2/3, yield of the skin M = sigma_y e^2/6 with alpha = 1."""
    p = 0.1 * (np.arange(1, 201) / 200) ** 2
    points = Points(1, steel(Perfect(yield_stress=A, alpha=alpha)))
    b = A / (3**0.5 * alpha)
    for q in p:
        turn = 3**0.5 * alpha * q
        r = points.go(bent(b / YOUNG + turn, -NU * b / YOUNG - 0.5 * turn)[None])[0]
    assert r[3] == pytest.approx(moment * A * THICKNESS**2, rel=1e-3)
    assert np.abs(r[[0, 1, 2, 4, 5]]) == pytest.approx(np.zeros(5), abs=1e-3 * r[3] / THICKNESS)
    assert points.get("plastic")[0] == pytest.approx(0.1, rel=1e-3)
    # sigma_y dp is the work, M dkappa
    assert points.get("dissipated")[0] == pytest.approx(0.1 * A * THICKNESS, rel=1e-3)


@pytest.mark.long
def test_layers_form_the_hinge_gradually():
    """Perfect plasticity, equal bending both ways: M = M_p (1 - 1/3 (kappa_y/kappa)^2), which the global form cuts short."""
    kappa_y = 2 * A * (1 - NU) / YOUNG / THICKNESS
    M_p = A * THICKNESS**2 / 4
    x = np.linspace(0.05, 4, 80)
    exact = M_p * np.where(x <= 1, 2 / 3 * x, 1 - 1 / (3 * x * x))
    worst = {}
    for layers in (None, 3, 5, 9, 15):
        points = Points(1, steel(Perfect(yield_stress=A, layers=layers)))
        M = [points.go(np.array([[0, 0, 0, k, k, 0, 0, 0]]))[0, 3] for k in x * kappa_y]
        worst[layers] = np.abs(M - exact).max() / M_p
    print("worst error of the moment over M_p:", worst)
    assert worst[None] == pytest.approx(4 / 27, abs=0.01)  # at 1.5 kappa_y
    assert worst[5] < 0.1 and worst[9] < 0.05 and worst[15] < 0.03


@pytest.mark.parametrize("rate", [1e-4, 1e-3, 1.0, 1e3, 1e5])
def test_johnson_cook(rate):
    law = material("steel, perforated plate").strength
    p = 0.3 * (np.arange(1, 401) / 400) ** 2
    factor = 1 + law.C * max(0.0, np.log(rate / law.rate0))
    stress = (law.A + law.B * p**law.n) * factor
    points = Points(1, steel(law))
    strain = np.r_[0, stress / YOUNG + p]
    for k in range(400):
        points.go(PATHS["uniaxial"](stress[k], p[k])[None], (strain[k + 1] - strain[k]) / rate)
    assert points.get("stress")[0][0] == pytest.approx(stress[-1], rel=5e-3)
    assert points.get("limit")[0] == pytest.approx(stress[-1], rel=5e-3)
    assert points.get("flow")[0] == pytest.approx(law.A + law.B * 0.3**law.n, rel=5e-3)


def test_the_rate_is_the_mean_of_two_steps():
    """T 2.106: a step ten times faster than those before raises the factor by ln of the mean."""
    law = JohnsonCook(A=A, B=0, n=1, C=0.1, rate0=1.0)
    points = Points(1, steel(law))
    e = 0.0
    for _ in range(200):
        e += 1e-3
        points.go(plane(e, -0.5 * e)[None], 1e-6)
    slow = points.get("limit")[0]
    e += 1e-3
    points.go(plane(e, -0.5 * e)[None], 1e-7)
    assert slow == pytest.approx(A * (1 + 0.1 * np.log(1e3)), rel=1e-3)
    assert points.get("limit")[0] == pytest.approx(A * (1 + 0.1 * np.log(5.5e3)), rel=1e-3)


@pytest.mark.parametrize("path", PATHS)
def test_damage_to_rupture(path):
    """D = D_c (R p - eps_d) / (eps_r - eps_d), lambda = int (1 - D) dp, stress (1 - D) sigma_y(lambda)."""
    law = LemaitreChaboche(threshold=0.1, rupture=0.6, critical=0.4)
    R = EXPECTED[path][3]
    slope = law.critical / (law.rupture - law.threshold) * R
    last = law.threshold / R + law.critical / slope
    p = last * (np.arange(1, 801) / 800) ** 2
    over = np.maximum(p - law.threshold / R, 0)
    D, lam = slope * over, p - 0.5 * slope * over**2
    points = Points(1, steel(HARD, damage=law))
    follow(points, PATHS[path], flow(lam), p)
    assert points.get("delayed")[0] == pytest.approx(law.critical, rel=5e-3)
    assert points.get("hardening")[0] == pytest.approx(lam[-1], rel=5e-3)
    r = points.go(PATHS[path](flow(lam[-1]), p[-1])[None])[0]
    U = 1 + 2 * np.array([PATHS[path](flow(lam[-1]), p[-1])[k] for k in (0, 1)])
    if path == "uniaxial":
        assert r[0] * U[0] / THICKNESS == pytest.approx((1 - D[-1]) * flow(lam[-1]), rel=5e-3)
    # what damage takes: the elastic energy it releases
    energy = np.cumsum(np.diff(np.r_[0, D]) * flow(lam) ** 2)[-1] / 2
    w = {"uniaxial": 1 / YOUNG, "compression": 1 / YOUNG, "biaxial": 2 * (1 - NU) / YOUNG, "shear": 1 / (3 * G)}[path]
    assert points.get("lost")[0] / THICKNESS == pytest.approx(w * energy, rel=5e-3)


def test_delayed_ductile_damage():
    """With the delay law, against a fine integration of T 2.66, 2.73 and 2.78."""
    law, late = LemaitreChaboche(threshold=0.0, rupture=1.0, critical=0.25), Delay(a=5.0, tau_c=1e-5)
    time, last, steps = 1e-5, 0.5, 500
    t = time * np.arange(1, steps + 1) / steps
    p = last * t / time

    def rates(x, y):
        D = law.critical * last * x / time
        return [(1 - np.exp(-late.a * max(D - y[0], 0))) / late.tau_c, (1 - y[0]) * last / time]

    exact = solve_ivp(rates, (0, time), [0, 0], t_eval=t, rtol=1e-9, atol=1e-12).y
    points = Points(1, steel(HARD, damage=law, delay=late))
    follow(points, PATHS["uniaxial"], flow(exact[1]), p, time / steps)
    assert points.get("delayed")[0] == pytest.approx(exact[0, -1], rel=5e-3)
    assert points.get("hardening")[0] == pytest.approx(exact[1, -1], rel=5e-3)
    assert points.get("damage")[0] == pytest.approx(0.125, rel=5e-3)
    assert exact[0, -1] < 0.1  # the delay matters


@pytest.mark.parametrize("angle", [0.3, np.pi / 4, 2.0])
def test_no_direction_of_the_reference_is_special(angle):
    """The same stretch, bending and shear along turned axes give the turned resultants."""
    c, s = np.cos(angle), np.sin(angle)
    R = np.array([[c, -s], [s, c]])
    rng = np.random.default_rng(3)
    plain, other = Points(1, steel(HARD)), Points(1, steel(HARD))
    E, K, q = np.zeros((2, 2)), np.zeros((2, 2)), np.zeros(2)
    for _ in range(60):
        E += 0.01 * _symmetric(rng)
        K += 10.0 * _symmetric(rng)
        q += 1e-3 * rng.standard_normal(2)
        r = plain.go(_voigt(E, K, q)[None])[0]
        t = other.go(_voigt(R @ E @ R.T, R @ K @ R.T, R @ q)[None])[0]
    for k in (0, 3):
        mine, theirs = _matrix(r[k : k + 3]), _matrix(t[k : k + 3])
        assert theirs == pytest.approx(R @ mine @ R.T, rel=1e-6, abs=1e-6 * np.abs(r[k : k + 3]).max())
    assert t[6:] == pytest.approx(R @ r[6:], rel=1e-6)


def _symmetric(rng):
    a = rng.standard_normal((2, 2))
    return 0.5 * (a + a.T)


def _voigt(E, K, q):
    return np.array([E[0, 0], E[1, 1], 2 * E[0, 1], K[0, 0], K[1, 1], 2 * K[0, 1], q[0], q[1]])


def _matrix(v):
    return np.array([[v[0], v[2]], [v[2], v[1]]])


def test_turning_the_axes_of_stretch_stores_no_energy_from_nowhere():
    """Elastic: simple shear to 1 and back, 2000 steps: the stress comes back, d(stored) is the work."""
    points = Points(1, steel(Perfect(yield_stress=2e10)), bends=False)
    path = np.r_[np.linspace(0, 0.05, 1001)[1:], np.linspace(0.05, 0, 1001)[1:]]
    for x in path:
        points.go(np.array([[0, 0.5 * x * x, x]]))
    assert np.abs(points.get("stress")[0]).max() < 1e-6 * G


def work_of(points, path, dt=1e-6):
    """Trapezoidal work of the resultants along a path (k, 8) [J/m2]."""
    before, r0, total = np.zeros(len(path[0])), np.zeros(len(path[0])), 0.0
    for g in path:
        r = points.go(g[None], dt)[0]
        total += 0.5 * (r + r0) @ (g - before)
        before, r0 = g, r
    return total


@pytest.mark.parametrize("layers", [None, 5])
def test_the_ledger_closes_to_second_order(layers):
    """stored + plastic + damage = the work, along a wild path, its error falling with the square of the step."""
    law = HARD.model_copy(update={"layers": layers})
    end = np.array([0.3, 0.1, 0.2, 60.0, -20.0, 50.0, 0.02, -0.01])
    off = []
    for steps in (200, 400, 800):
        x = np.linspace(0, 1, steps + 1)[1:, None]
        path = end * (x + 0.3 * np.sin(2 * np.pi * x * np.array([1, 2, 1, 3, 2, 1, 2, 1])))
        points = Points(1, steel(law, damage=LemaitreChaboche(threshold=0.05, rupture=0.8, critical=0.3)))
        work = work_of(points, path)
        parts = points.stored()[0], points.get("dissipated")[0], points.get("lost")[0]
        off.append((sum(parts) - work) / work)
    print("closed residual", off, "of", work, parts)
    assert parts[1] > 0 and parts[2] > 0
    assert abs(off[2]) < 2e-4
    assert abs(off[2]) < 0.4 * abs(off[1]) < 0.2 * abs(off[0]) or abs(off[2]) < 1e-6


def test_a_look_and_a_rebase_leave_the_state():
    points, stress, _ = proportional("uniaxial", HARD)
    names = [name for name, entry in points.fields.items() if entry.keeps and name != "strain"]
    before = {name: points.get(name) for name in names}
    g = points.get("strain")
    points.go(plane(0.9, -0.3)[None], 0.0)  # a look
    assert np.array_equal(points.get("strain"), g)
    points.go(plane(0.9, -0.3)[None], 0.0, rebase=1)  # what a rupture does
    assert np.array_equal(points.get("strain")[0], plane(0.9, -0.3))
    for name in names:
        assert np.array_equal(points.get(name), before[name]), name


@pytest.mark.parametrize(
    "changed",
    [
        {"strength": Power(A=1.1 * A, B=B, n=N)},
        {"strength": Power(A=A, B=1.1 * B, n=N)},
        {"strength": Power(A=A, B=B, n=0.4)},
        {"strength": JohnsonCook(A=A, B=B, n=N, C=0.1, rate0=1.0)},
        {"strength": JohnsonCook(A=A, B=B, n=N, C=0.1, rate0=100.0)},
        {"strength": Power(A=A, B=B, n=N, alpha=1.0)},
        {"strength": Power(A=A, B=B, n=N, kappa=1.0)},
        {"strength": Power(A=A, B=B, n=N, layers=5)},
        {"damage": LemaitreChaboche(threshold=0.02, rupture=0.5, critical=0.3)},
        {"damage": LemaitreChaboche(threshold=0.01, rupture=0.6, critical=0.3)},
        {"damage": LemaitreChaboche(threshold=0.01, rupture=0.5, critical=0.4)},
        {"delay": Delay(a=3.0, tau_c=1e-6)},
        {"delay": Delay(a=2.0, tau_c=2e-6)},
    ],
    ids=lambda c: str(c)[:70],
)
def test_every_parameter_counts(changed):
    def end(**more):
        plain = {"strength": HARD, "damage": LemaitreChaboche(threshold=0.01, rupture=0.5, critical=0.3), "delay": Delay(a=2.0, tau_c=1e-6)}
        points = Points(1, steel(**(plain | more)))
        for x in np.linspace(0, 1, 101)[1:]:
            r = points.go(x * np.array([[0.05, 0.02, 0.03, 60.0, 10.0, 5.0, 0.02, 0.01]]), 1e-7)
        return r[0]

    assert np.abs(end(**changed) / end() - 1).max() > 5e-4


# --- nothing fails ------------------------------------------------------------------------------------


LAWS = {
    "perfect": Perfect(yield_stress=1e8),
    "power": HARD,
    "steep": Power(A=1e6, B=5e9, n=0.05, alpha=1.0),
    "table": Table(points=[(0, 1e8), (0.001, 1.1e8), (0.01, 9e8), (0.5, 9e8)]),
    "johnson_cook": material("steel, perforated plate").strength,
    "kappa": Power(A=A, B=B, n=N, kappa=1.0),
    "layers": HARD.model_copy(update={"layers": 3}),
}


@pytest.mark.parametrize("damaged", [False, True])
@pytest.mark.parametrize("kind", LAWS)
def test_random_steps_never_fail(kind, damaged):
    """64 points through five random steps of 1e-6 to 0.5: finite, on or below the surface, p never falls."""
    law = LAWS[kind]
    more = {"damage": LemaitreChaboche(threshold=0.0, rupture=1.0, critical=0.9), "delay": Delay(a=1, tau_c=1e-8)} if damaged else {}
    points = Points(64, steel(law, **more))

    @settings(max_examples=20, deadline=None, database=None)
    @given(st.integers(0, 2**31), st.floats(-6, np.log10(0.5)))
    def walk(seed, size):
        points.reset()
        _walk(points, kind, law, np.random.default_rng(seed), 10.0**size)

    walk()


def _walk(points, kind, law, rng, step):
    scale = np.array([1, 1, 1, *[2 / THICKNESS] * 3, 1, 1]) * rng.choice([0, 1e-3, 1, 1], (64, 8))
    g, p = np.zeros((64, 8)), np.zeros(64)
    for _ in range(5):
        g = g + step * scale * rng.uniform(-1, 1, (64, 8))
        g[:, :2] = np.maximum(g[:, :2], -0.45)
        g[:, 2] = np.clip(g[:, 2], -0.05, 0.05)
        r = points.go(g, 1e-7)
        assert np.isfinite(r).all()
        stress, now = points.get("stress"), points.get("plastic")
        assert np.isfinite(stress).all() and (now >= p).all()
        if kind not in ("layers", "johnson_cook"):
            eq = equivalent(stress, law.alpha, law.kappa)
            assert (eq <= points.get("flow") * (1 + 1e-9)).all()
            yielding = now > p
            assert eq[yielding] == pytest.approx(points.get("flow")[yielding], rel=1e-9)
        if kind == "layers":
            inner = runtime.get(points.layer_stress, 64 * 3)
            assert (np.sqrt(product(inner, inner)) <= runtime.get(points.layer, 64 * 3)[:, 2] * (1 + 1e-9)).all()
        p = now
    assert np.isfinite(points.stored()).all()


def product(a, b):
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + 3 * a[:, 2] * b[:, 2] - 0.5 * (a[:, 0] * b[:, 1] + a[:, 1] * b[:, 0])


def equivalent(s, alpha, kappa):
    """T 2.43 with Ilyushin's sign, in skin stresses sigma_b = sqrt(3) b."""
    m, skin = s[:, :3], 3**0.5 * s[:, 3:6]
    cross = alpha / 3**0.5 * np.abs(product(m, skin))
    return np.sqrt(product(m, m) + alpha**2 * product(skin, skin) + cross + 3 * kappa * (s[:, 6:] ** 2).sum(axis=1))


@pytest.mark.parametrize("alpha, kappa", [(2 / 3, 0.0), (1.0, 0.0), (2 / 3, 1.0)])
@pytest.mark.parametrize("size", [1e-5, 1e-3, 0.1])
def test_the_return_is_the_nearest_point(alpha, kappa, size):
    """Normality on faces and on the edge (m, b) = 0: with perfect plasticity the returned stress s obeys
    (t - s) w (trial - s) <= 0 for every stress t within the surface (a convex one has no other such point)."""
    rng = np.random.default_rng(5)
    n = 400
    points = Points(n, steel(Perfect(yield_stress=A, alpha=alpha, kappa=kappa)))
    scale = np.array([1, 1, 1, *[12**0.5 / THICKNESS] * 3, 1, 1])
    start = 3e-3 * rng.standard_normal((n, 8)) * rng.choice([0.05, 1], (n, 8))
    points.go(scale * start)
    before, g, p = points.get("stress"), points.get("strain"), points.get("plastic")
    change = size * rng.standard_normal((n, 8))
    # small strains, so that the increments are those of the strains: compare with what the law was given
    points.go(g + scale * change)
    s = points.get("stress")
    d = _given(g, g + scale * change)
    H = np.zeros((8, 8))
    c = YOUNG / (1 - NU**2)
    for k in (0, 3):
        H[k : k + 3, k : k + 3] = c * np.array([[1, NU, 0], [NU, 1, 0], [0, 0, 1 - NU]])
    H[6, 6] = H[7, 7] = 5 / 6 * G
    trial = before + d @ H.T
    w = np.diag([1.0, 1, 2, 1, 1, 2, 1, 1]) @ np.linalg.inv(H)  # tensor shear counts twice in the work
    back = (trial - s) @ w.T
    yields = points.get("plastic") > p
    n, s, back = int(yields.sum()), s[yields], back[yields]
    assert n > 50
    worst = -1.0
    for k in range(200):
        t = s + A * 10.0 ** -(k % 4) * rng.standard_normal((n, 8))  # far and near
        t *= (A / equivalent(t, alpha, kappa))[:, None]
        beyond = ((t - s) * back).sum(axis=1) / (s * back).sum(axis=1)
        worst = max(worst, float(beyond.max()))
    print("beyond the nearest point:", worst, "of", n)
    assert worst < 1e-4


def _given(a, b):
    """The increments of bodies/shell/metal.py, in NumPy by eigenvectors."""
    d = np.zeros_like(a)
    for k in range(len(a)):
        g, change = 0.5 * (a[k] + b[k]), b[k] - a[k]
        values, vectors = np.linalg.eigh([[1 + 2 * g[0], g[2]], [g[2], 1 + 2 * g[1]]])
        u = vectors @ np.diag(values**-0.5) @ vectors.T
        eps = u @ np.array([[change[0], change[2] / 2], [change[2] / 2, change[1]]]) @ u
        beta = THICKNESS / 12**0.5 / np.sqrt(values.prod()) * u @ np.array([[change[3], change[5] / 2], [change[5] / 2, change[4]]]) @ u
        d[k] = [eps[0, 0], eps[1, 1], eps[0, 1], beta[0, 0], beta[1, 1], beta[0, 1], *(u @ change[6:])]
    return d
