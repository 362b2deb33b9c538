"""The pass against numbers worked out by hand and against NumPy; what it conserves."""

import math

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.bodies.fluid.columns import STIFFNESS
from taichi_sph.bodies.fluid.said import Tait, Water
from taichi_sph.numerics.kernel import w2_slope
from taichi_sph.runtime import ti

from .bodies import SPACING, body, by_id, lattice, put, rates, run


def test_kernel():
    """Slope of W = 21 / (16 pi h^3) (1 - q/2)^4 (1 + 2q), whose integral is 1; zero at and beyond the support."""
    runtime.start()

    @ti.kernel
    def slopes(r: ti.types.ndarray(), inverse: ti.f64, out: ti.types.ndarray()):
        for k in range(r.shape[0]):
            out[k] = w2_slope(r[k], inverse)

    h = 0.7
    r = np.linspace(1e-3, 1.6, 4001)
    got = np.zeros_like(r)
    slopes(r, 1 / (2 * h), got)
    W = np.where(r < 2 * h, 21 / (16 * np.pi * h**3) * (1 - r / (2 * h)) ** 4 * (1 + 2 * r / h), 0)
    assert np.trapezoid(4 * np.pi * r**2 * W, r) == pytest.approx(1, abs=1e-5)
    assert np.allclose(got[1:-1] * r[1:-1], np.gradient(W, r)[1:-1], atol=2e-5 * np.abs(np.gradient(W, r)).max())
    assert not got[r >= 2 * h].any()


def test_two_particles_by_hand():
    """p = 1 and 3 MPa, approach at 2 m/s, 1.2 D apart along x: force, rate, viscous pressure."""
    b = body([[0, 0, 0], [1.2 * SPACING, 0, 0]], alpha=0.5, beta=2.0, delta=0.1)
    s = np.array([1e6, 3e6]) / b.constants[0, STIFFNESS]
    put(b, "s", s)
    put(b, "v", np.array([[1.0, 0, 0], [-1.0, 0, 0]]))
    rates(b, 0.0, 1e-7)
    D = SPACING * (1 + s) ** (-1 / 3)
    h = 1.165 * D.mean()
    r = 1.2 * SPACING
    slope = -21 / (16 * math.pi * h**4) * 5 * (r / h) * (1 - r / (2 * h)) ** 3  # W'
    h0 = 1.165 * SPACING
    mu = -2.0 * r / (r**2 + 0.01 * h0**2)
    viscous = 1000 * (-0.5 * 1450 * h0 * mu + 2.0 * h0**2 * mu**2)
    force = D[0] ** 3 * D[1] ** 3 * (1e6 + 3e6 + viscous) * slope  # on the first, towards -x
    f = by_id(b, "force")
    assert f[0] == pytest.approx([force, 0, 0], rel=1e-6) and f[1] == pytest.approx(-f[0], rel=1e-12)
    # compressed at (1 + s) V_j (v_j - v_i) . grad_i W, grad_i W along -x_ij
    assert by_id(b, "rate") == pytest.approx((1 + s) * D[::-1] ** 3 * -slope * 2.0, rel=1e-6)


def test_diffusion_levels_density_and_leaves_the_hydrostatic_alone():
    g = np.array([0.0, 0.0, -9.81])
    b = body(lattice((6, 6, 6)), gravity=g, delta=0.1)
    before = by_id(b, "s")
    rates(b, 0.0, 1e-6)
    rates(b, 1e-6, 1e-6)  # nothing has moved: what changes s is diffusion
    assert np.abs(by_id(b, "s") - before).max() < 1e-12 * before.max()
    s = np.where(np.arange(b.p.n) == 3 * 36 + 3 * 6 + 3, 1e-3, 0.0)
    put(b, "s", s)
    rates(b, 0.0, 1e-6)
    rates(b, 1e-6, 1e-6)
    after = by_id(b, "s")
    assert after.max() < 1e-3 and (after > 2e-9).sum() > 50  # all that its support holds
    assert after.sum() - s.sum() == pytest.approx(0.0, abs=1e-3 * (s.max() - after.max()))  # of equal volumes: kept


@pytest.mark.parametrize("precision, tolerance", [("f64", 1e-12), ("f32", 2e-5)])
def test_a_free_blob_keeps_momentum_and_moment_of_momentum(precision, tolerance):
    x = lattice((9, 9, 9), 0.2)
    x = x[np.linalg.norm(x - x.mean(axis=0), axis=1) < 4.5 * SPACING]
    b = body(x, precision=precision, beta=1.0, water=Water(law=Tait()))
    rng = np.random.default_rng(1)
    v = rng.normal(0, 5, x.shape)
    put(b, "v", v)
    dt = 0.9 * b.stable_dt()
    run(b, dt, 60)
    assert b.sorts > 1
    x1, v1 = by_id(b, "x"), by_id(b, "v")
    scale = np.abs(v).sum()
    assert np.abs(v1.sum(axis=0) - v.sum(axis=0)).max() < tolerance * scale
    # x at full steps and v at the half ones before: x x v is the same for x before or after the drift
    moment = np.cross(x1, v1).sum(axis=0) - np.cross(x, v).sum(axis=0)
    assert np.abs(moment).max() < tolerance * scale * np.abs(x).max()


def test_one_particle_falls():
    b = body([[0.3, 0.2, 0.1]], gravity=(1.0, 0.0, -9.81), velocity=(1.0, 2.0, 3.0), hydrostatic=False)
    run(b, 1e-3, 100)
    t = 0.1
    assert by_id(b, "x")[0] == pytest.approx([0.3 + t + 0.5 * t**2, 0.2 + 2 * t, 0.1 + 3 * t - 0.5 * 9.81 * t**2], rel=1e-12)
    e = b.energies()
    assert e["kinetic"] == pytest.approx(e["external"] + e["injected"], rel=1e-4)


@pytest.mark.parametrize("law", ["acoustic", "tait"])
@pytest.mark.parametrize("tension", [None, 1e5])
def test_the_ledger_closes(law, tension):
    from .bodies import unbalanced

    b = body(lattice((8, 8, 8), 0.1), water=Water(law=law, tension=tension), beta=1.0)
    x = lattice((8, 8, 8))
    put(b, "v", 10 * np.sin(40 * x))
    b.injected = 0.5 * b.p.one * float((by_id(b, "v") ** 2).sum())
    dt, before = 0.3 * b.stable_dt(), 0.0
    for _ in range(4):
        run(b, dt, 50, before)
        before = dt
        print(unbalanced(b), b.energies())
        assert b.energies()["elastic"] > 1e-6 * b.injected and abs(unbalanced(b)) < 2e-3
