"""Laws of solids along paths of deformation, against closed forms and NumPy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from taichi_sph.scene import Concrete, Delay, Heat, JohnsonCook, LemaitreChaboche, Perfect, Power

from .point import Point

STEEL = {"young": 200e9, "poisson": 0.3, "density": 7800.0}
CONCRETE = {"young": 30e9, "poisson": 0.22, "density": 2300.0}
DAMAGE = {"tension": 19.3e6, "compression": 115e6, "B": 965.0}


def turned(k: float, F: np.ndarray) -> np.ndarray:
    """F, turned by some angle that grows with the step."""
    return Rotation.from_rotvec(0.02 * k * np.array([1.0, 2.0, -0.5])).as_matrix() @ F


def test_elastic_uniaxial_stress():
    point = Point(STEEL)
    stretch = 1.02
    sigma = point.pull(stretch, 1.0)
    E = 0.5 * (stretch**2 - 1)
    a2 = point.F[1, 1] ** 2
    assert a2 == pytest.approx(1 - 2 * 0.3 * E, rel=1e-9)  # E_22 = -nu E_11
    assert sigma[0, 0] == pytest.approx(200e9 * E * stretch / a2, rel=1e-8)


def test_hardening_in_tension_follows_the_curve_in_log_strain():
    point = Point({**STEEL, "strength": Power(A=3e8, B=5e8, n=0.4)})
    for k in range(1, 201):
        sigma = point.pull(np.exp(1e-3 * k), 1e-6)
    p = point.read("plastic")
    tau = sigma[0, 0] * np.linalg.det(point.F)
    assert tau == pytest.approx(3e8 + 5e8 * p**0.4, rel=1e-9)
    assert p == pytest.approx(0.2 - tau / 200e9, rel=1e-5)
    assert point.kept == pytest.approx(point.work, rel=1e-5)


def test_simple_shear_of_perfect_plasticity_while_turning():
    """q stays at yield; turning the whole at the same time changes nothing. (One point lives at a time: Taichi starts anew for each.)"""
    found = []
    for turning, closes in ((0.0, 1e-5), (1.0, 3e-3)):  # the trapezoidal rule sees turns of 2.6 degrees a step
        point = Point({**STEEL, "strength": Perfect(yield_stress=3e8)})
        for k in range(1, 301):
            sigma = point.go(turned(turning * k, np.array([[1, 2e-3 * k, 0], [0, 1, 0], [0, 0, 1.0]])), 1e-6)
        found.append(sigma)
        assert point.kept == pytest.approx(point.work, rel=closes)
    R = turned(300, np.eye(3))
    assert R.T @ found[1] @ R == pytest.approx(found[0], abs=1e-5 * 3e8)
    s = found[0] - np.trace(found[0]) / 3 * np.eye(3)
    assert np.sqrt(1.5 * (s**2).sum()) == pytest.approx(3e8, rel=1e-6)
    # the axes of the logarithmic strain lag behind the shear: a little less than gamma / sqrt(3)
    assert 0.6 / np.sqrt(3) * 0.95 < point.read("plastic") + 3e8 / 3 / (200e9 / 2.6) < 0.6 / np.sqrt(3) * 1.001


def test_rate_and_heat_of_johnson_and_cook():
    law = JohnsonCook(A=90e6, B=292e6, n=0.31, C=0.025, rate0=1.0, heat=Heat(m=1.09, melting=1356, capacity=383, room=294))
    point = Point({"young": 124e9, "poisson": 0.34, "density": 8960, "strength": law})
    rate, dt = 1e4, 1e-7
    for k in range(1, 201):
        sigma = point.pull(np.exp(rate * dt * k), dt)
    p, T = point.read("plastic"), point.read("temperature")
    factor = (1 + 0.025 * np.log(rate)) * (1 - ((T - 294) / (1356 - 294)) ** 1.09)
    assert sigma[0, 0] * np.linalg.det(point.F) == pytest.approx((90e6 + 292e6 * p**0.31) * factor, rel=2e-4)
    assert T - 294 == pytest.approx(0.9 * point.read("dissipated") / (8960 * 383), rel=1e-9)
    assert 10 < T - 294 < 30


def test_ductile_damage():
    """In tension D = D_c (p - eps_d) / (eps_r - eps_d), and the stress is that of the undamaged part; in compression none."""
    law = {"strength": Perfect(yield_stress=3e8), "damage": LemaitreChaboche(threshold=0.02, rupture=0.25, critical=0.4)}
    point = Point({**STEEL, **law})
    for k in range(1, 151):
        point.pull(np.exp(-1e-3 * k), 1e-6)
    assert point.read("damage") < 1e-6 and point.read("plastic") > 0.1
    point = Point({**STEEL, **law})
    for k in range(1, 151):
        sigma = point.pull(np.exp(1e-3 * k), 1e-6)
    p, D = point.read("plastic"), point.read("damage")
    assert D == pytest.approx(0.4 * (p - 0.02) / 0.23, rel=1e-3)
    assert sigma[0, 0] * np.linalg.det(point.F) == pytest.approx((1 - D) * 3e8, rel=1e-9)
    assert point.kept == pytest.approx(point.work, rel=1e-3)


def test_delay_and_rupture():
    damage = {"damage": LemaitreChaboche(threshold=0.02, rupture=0.05, critical=0.4), "delay": Delay(a=1, tau_c=1e-5)}
    point = Point({**STEEL, "strength": Perfect(yield_stress=3e8), **damage, "critical_damage": 0.2})
    before, k = 0.0, 0
    while point.read("broken") == 0:
        k += 1
        assert k < 2000
        point.go(np.diag([np.exp(1e-4 * k), np.exp(-5e-5 * k), np.exp(-5e-5 * k)]), 1e-7)
        now = point.read("delayed")
        assert now - before <= 1e-7 / 1e-5
        before = now
    assert before >= 0.2 and np.abs(point.P).max() == 0.0
    assert point.read("released") > 0 and point.read("stored") == 0


# --- concrete -------------------------------------------------------------------------------------------------------------------------


def concrete(**more) -> Point:
    return Point({**CONCRETE, "damage": Concrete(**{**DAMAGE, **more})})


def test_concrete_breaks_at_both_strengths():
    """Damage starts at 19.3 MPa in tension and 115 MPa in compression."""
    point = concrete()
    for k in range(1, 200):
        sigma = point.pull(1 + 2e-5 * k, 1e-3)[0, 0]
        if point.read("damage") > 0:
            break
    assert sigma == pytest.approx(19.3e6, rel=0.035)
    point = concrete()
    for k in range(1, 400):
        sigma = -point.pull(1 - 2e-5 * k, 1e-3)[0, 0]
        if point.read("damage") > 0:
            break
    assert sigma == pytest.approx(115e6, rel=0.01)


def test_principal_strain_starts_in_compression_where_p_has_it():
    """share 0.1: 44 MPa (nu 0.22: sqrt(2 nu^2 + 0.1) of the strain)."""
    point = concrete(strain="principal")
    for k in range(1, 400):
        sigma = -point.pull(1 - 1e-5 * k, 1e-3)[0, 0]
        if point.read("damage") > 0:
            break
    assert sigma == pytest.approx(19.3e6 / np.sqrt(2 * 0.22**2 + 0.1), rel=0.01)


def test_pressure_alone_does_not_damage_and_keeps_its_stiffness():
    point = concrete()
    for k in range(1, 101):
        sigma = point.go((1 - 1e-3 * k) * np.eye(3), 1e-3)
    J = np.linalg.det(point.F)
    assert point.read("damage") == 0
    assert sigma[0, 0] == pytest.approx(30e9 / 3 / 0.56 * np.log(J) / J, rel=1e-9)
    point = concrete()
    for k in range(1, 101):  # torn first, then pressed
        point.pull(1 + 4e-5 * k, 1e-3)
    assert point.read("damage") > 0.9
    for k in range(1, 101):
        pressed = point.go((1 - 1e-3 * k) * np.eye(3), 1e-3)
    assert np.trace(pressed) == pytest.approx(np.trace(sigma), rel=1e-6)


def test_rubble_rubs():
    """Sheared under pressure until all is broken: q = 1.6 fc (p / fc)^0.61; without rubble nothing is left."""
    for rubs in (True, False):
        point = concrete(rubble=rubs)
        for k in range(1, 201):
            sigma = point.go(0.998 * np.array([[1, 4e-4 * k, 0], [0, 1, 0], [0, 0, 1]]), 1e-3)
        J = np.linalg.det(point.F)
        p = -np.trace(sigma) / 3
        s = sigma + p * np.eye(3)
        q = np.sqrt(1.5 * (s**2).sum())
        assert point.read("damage") > 0.99 and p > 50e6
        rubble = 1.6 * 115e6 * (p * J / 115e6) ** 0.61 / J
        assert q == pytest.approx(rubble if rubs else 0.0, rel=0.02, abs=3e6)


def test_what_concrete_takes_is_never_negative():
    """Torn, pressed, sheared, turned back and forth: the dissipation only grows, and closes the work."""
    rng = np.random.default_rng(0)
    for strain in ("de_vree", "principal"):
        point = concrete(strain=strain)
        F, taken = np.eye(3), 0.0
        for _ in range(8):
            goal = np.eye(3) + 3e-3 * rng.standard_normal((3, 3))
            steps = np.linspace(0, 1, 40)[1:]
            for t in steps:
                point.go((1 - t) * F + t * goal, 1e-3)
                now = point.read("lost")
                assert now >= taken - 1e-3 * abs(taken) - 1.0
                taken = max(now, taken)
            F = goal
        assert point.kept == pytest.approx(point.work, rel=2e-3)


def test_concrete_under_pressure_bears_what_holmquist_has():
    """Triaxial compression, q at 230 MPa of confinement at most that of the whole, at least that of rubble."""
    point = concrete()
    for k in range(1, 51):
        point.go((1 - 2.5e-4 * k) * np.eye(3), 1e-3)
    lateral = point.cauchy(point.F)[1, 1]
    a = point.F[0, 0]
    best = 0.0
    for k in range(1, 201):
        sigma = point.pull(a - 3e-4 * k, 1e-3, lateral)
        p = -np.trace(sigma) / 3
        q = abs(sigma[0, 0] - sigma[1, 1])
        best = max(best, q / (115e6 * (0.79 + 1.6 * (p / 115e6) ** 0.61)))
    assert 0.5 < best <= 1.05
