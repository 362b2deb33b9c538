"""A body of water: hydrostatics, sound, exact restart, threads."""

import numpy as np
import pytest

from taichi_sph.bodies.fluid.columns import STIFFNESS
from taichi_sph.bodies.fluid.said import Hole, Wall, Water
from taichi_sph.pool import restore_all, state_of

from .bodies import SPACING, body, box, by_id, lattice, put, rates, run, unbalanced


def test_water_at_rest_in_a_box():
    """Pressure within 3 %: 1.4 % comes from the first moment of the kernel on a cubic lattice (0.991)."""
    H = 16 * SPACING
    b = body(lattice((6, 6, 16)), gravity=(0, 0, -9.81), walls=box(0.06, 0.06), water=Water(sound=20, tension=None))
    run(b, 0.9 * b.stable_dt(), 2500)  # 0.7 s, 20 times the way of sound through it
    f = b.frame()
    depth = H - f["points"][:, 2]
    deep = depth > 3 * SPACING
    slope = np.polyfit(depth[deep], f["pressure"][deep], 1)[0] / (1000 * 9.81)
    bottom = f["pressure"][depth > H - SPACING].mean() / (1000 * 9.81 * (H - 0.5 * SPACING))
    print(f"slope {slope:.4f}, bottom {bottom:.4f}")
    assert slope == pytest.approx(1, abs=0.03) and bottom == pytest.approx(1, abs=0.03)
    assert abs(unbalanced(b)) < 1e-3
    assert f["points"].min() > 0.5 * SPACING * (1 - 1e-9)


@pytest.mark.long
def test_every_wall_within_reach_shows_its_images():
    """At one pressure nothing pushes, in the corner of a slice three spacings thick as well: four walls are within reach there, and six in
    a cube."""
    for counts, walls in (((8, 3, 8), box(1.0, 0.03)), ((3, 3, 3), box(0.03, 0.03, 0.03))):
        x = lattice(counts)
        b = body(x, walls=walls, delta=0.0)
        put(b, "s", np.full(len(x), 1e-3))
        rates(b, 0.0, 1e-9)
        inner = (x < 0.03 + 1e-9).all(axis=1)  # away from where the slice is open
        push = np.abs(by_id(b, "force"))[inner].max() / (b.constants[0, STIFFNESS] * 1e-3 * SPACING**2)
        print(f"{counts}: {push:.1e} of p D^2")
        assert push < 1e-12


@pytest.mark.long
def test_standing_wave_in_a_closed_column():
    """Between rigid ends f = c / (2 L); the first moment of the kernel lowers it by 0.9 %."""
    L = 20 * SPACING
    x = lattice((4, 4, 20))
    b = body(x, walls=box(0.04, 0.04, L), alpha=0.0, delta=0.0)
    mode = np.sin(np.pi * x[:, 2] / L)
    put(b, "v", 0.1 * mode[:, None] * [0, 0, 1])
    period = 2 * L / 1450
    dt = period / 200
    amplitude, before = [], 0.0
    for _ in range(450):
        run(b, dt, 1, before)
        before = dt
        amplitude.append((by_id(b, "v")[:, 2] * mode).mean())
    a = np.array(amplitude)
    t = (np.arange(450) + 0.5) * dt
    down = np.nonzero((a[:-1] > 0) & (a[1:] <= 0))[0]
    zero = t[down] + dt * a[down] / (a[down] - a[down + 1])
    assert zero[1] - zero[0] == pytest.approx(period, rel=0.015)
    assert a[395:405].max() > 0.99 * a[:5].max()  # nothing is lost in two periods but the lag's (w dt)^4 / 2


@pytest.mark.long
def test_a_lid_with_a_hole_lets_water_out():
    hole = Hole(centre=(0.03, 0.03, 0), radius=0.015)
    walls = [w for w in box(0.06, 0.06) if w.normal != (0, 0, 1)] + [Wall(point=(0, 0, 0), normal=(0, 0, 1), hole=hole)]
    b = body(lattice((6, 6, 10)), gravity=(0, 0, -9.81), walls=walls, water=Water(sound=20, tension=None))
    run(b, 0.8 * b.stable_dt(), 700)
    x = by_id(b, "x")
    out = x[:, 2] < 0
    assert out.sum() > 3
    near = out & (x[:, 2] > -SPACING)
    assert (np.hypot(x[near, 0] - 0.03, x[near, 1] - 0.03) < 0.02).all()


def waved(threads=None, precision="f64"):
    b = body(lattice((12, 12, 30), 0.1), gravity=(0, 0, -9.81), walls=box(0.12, 0.12), precision=precision, threads=threads)
    put(b, "v", 60 * np.sin(30 * lattice((12, 12, 30))))
    return b


def test_one_and_two_threads():
    states = []
    for threads in (1, 2):
        b = waved(threads)
        run(b, 3e-6, 40)
        assert b.sorts > 2
        states.append(state_of(b.pools()))
    assert all(np.array_equal(states[0][k], states[1][k]) for k in states[0])


@pytest.mark.parametrize("precision", ["f64", "f32"])
def test_n_and_restart_and_n_is_2n(precision):
    b = waved(precision=precision)
    run(b, 3e-6, 25)
    half = {k: np.array(v) for k, v in state_of(b.pools()).items()}
    run(b, 3e-6, 25, 3e-6)
    whole, energies = state_of(b.pools()), b.energies()
    again = waved(precision=precision)
    restore_all(again.pools(), half)
    run(again, 3e-6, 25, 3e-6)
    assert again.sorts > int(half["fluid.sums.sorts"])
    assert all(np.array_equal(whole[k], v) for k, v in state_of(again.pools()).items())
    assert energies == again.energies()
