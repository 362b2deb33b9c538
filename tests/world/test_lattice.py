"""Waves on a stretched lattice: against the continuum, closed forms at the shortest waves, and a time integration."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph.verification.lattice import (
    KERNELS,
    LAYOUTS,
    NOTHING,
    Lattice,
    b3_slope_over_q,
    classical,
    continuum,
    domain,
    least_squares,
    running,
    squares,
    symbol,
)

from ..geometry import mls_reference

LONG = 0.05 * np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.3]])
SHORTEST = np.pi * np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
FORMS = [(kernel, layout) for kernel in KERNELS for layout in LAYOUTS]


def test_gradients_are_those_of_the_fit():
    d = np.random.default_rng(0).uniform(-2, 2, (3, 20, 2))
    for h in (1.0, 1.7):
        values, gradients = least_squares(d, h)
        for point in range(3):
            near = np.linalg.norm(d[point], axis=1) < 2 * h
            x = np.zeros(2)
            assert values[point, near] == pytest.approx(mls_reference.value(x, d[point, near], h, 1), abs=1e-12)
            assert gradients[point, near] == pytest.approx(mls_reference.gradient(x, d[point, near], h, 1), abs=1e-8)
            assert not values[point, ~near].any() and not gradients[point, ~near].any()


def test_the_classical_gradient_is_exact_for_linear_fields_and_points_along_the_slope_of_the_kernel():
    d = np.random.default_rng(1).uniform(-1, 1, (1, 12, 2))
    d[:, 0] = 0.0
    g = classical(d, 1.2)[0]
    assert g.sum(axis=0) == pytest.approx(0, abs=1e-12)
    assert d[0].T @ g == pytest.approx(np.eye(2), abs=1e-12)
    lattice = Lattice("Eulerian", "nodes", 1.0)
    d, g = lattice.rest[0], lattice.reference[0]
    slope = -b3_slope_over_q(np.linalg.norm(d, axis=1) / lattice.h)[:, None] * d
    assert g[1:] == pytest.approx(slope[1:] * (g[1, 0] / slope[1, 0]), abs=1e-12)  # one factor on a square lattice
    q = np.array([0.3, 0.99, 1.01, 1.9])
    assert q * b3_slope_over_q(q) == pytest.approx((mls_reference.b3(q + 1e-6) - mls_reference.b3(q - 1e-6)) / 2e-6, abs=1e-8)


@pytest.mark.parametrize("stretch", [0.8, 1.0, 1.3])
@pytest.mark.parametrize("kernel, layout", FORMS)
def test_long_waves_are_those_of_the_continuum(kernel, layout, stretch):
    found = np.sort(squares(*Lattice(kernel, layout, stretch).response(), LONG).real, axis=1)
    assert found == pytest.approx(continuum(stretch, LONG), rel=0.01)


@pytest.mark.parametrize("stretch", [0.8, 1.3])
def test_nodes_alone_feel_nothing_of_the_shortest_waves(stretch):
    """sin(k . R) = 0 for every neighbour: stretched or not, with a Lagrangian kernel nothing is left."""
    assert np.abs(symbol(*Lattice("Lagrangian", "nodes", stretch).response(), SHORTEST)).max() < 1e-9


def curvature(x: np.ndarray, h: float) -> np.ndarray:
    """(R, 2) W_xx and W_yy of the shape of B3 at x (R, 2), by hand: W'' n n + W' / r (1 - n n)."""
    r = np.linalg.norm(x, axis=1)
    q = r / h
    slope = np.where(q < 1, -3 * q + 2.25 * q**2, -0.75 * np.clip(2 - q, 0, None) ** 2) / h
    second = np.where(q < 1, -3 + 4.5 * q, 1.5 * np.clip(2 - q, 0, None)) / h**2
    n = x / r[:, None]
    return second[:, None] * n**2 + (slope / r)[:, None] * (1 - n**2)


@pytest.mark.parametrize("support", [1.2, 1.0, 2.0])
@pytest.mark.parametrize("stretch", [0.9, 1.1, 1.4])
def test_tension_and_an_eulerian_kernel(stretch, support):
    """Swegle's criterion: at the shortest waves no strain is felt, and -2 tau_jj B_jj sum W_ij (1 - cos k . R) is left."""
    lattice = Lattice("Eulerian", "nodes", stretch, support)
    R = lattice.rest[0][1:]
    at = R / [stretch, 1.0]  # of the reference: what waves are counted in
    tau = 0.5 * (stretch**2 - 1) / (1 - 0.3**2) * np.array([stretch**2, 0.3])
    slope = -b3_slope_over_q(np.linalg.norm(R, axis=1) / support)[:, None] * R  # h^2 times -grad W
    exact = 1 / np.einsum("ra,ra->a", R, slope)
    for wave, found in zip(SHORTEST, symbol(*lattice.response(), SHORTEST), strict=True):
        W = np.diag((1 - np.cos(at @ wave)) @ curvature(R, support)) * support**2
        assert found == pytest.approx(-2 * W @ np.diag(tau * exact), abs=2e-6)
    grows = symbol(*lattice.response(), SHORTEST)[0, 0, 0].real < 0
    assert grows == ((stretch > 1) == (stretch / support > 2 / 3))  # tension where W'' > 0, compression where W'' < 0


def test_a_point_in_each_cell_misses_the_checkerboard_and_two_see_it_dimly():
    for kernel in KERNELS:
        assert np.abs(symbol(*Lattice(kernel, "cells", 1.0).response(), SHORTEST[2:])).max() < 1e-9
    two = squares(*Lattice("Lagrangian", "triangles", 1.0).response(), SHORTEST[2:]).real
    assert 0 < two.max() < 1e-3  # the fit of h = 1.2 D smooths it away
    assert squares(*Lattice("Lagrangian", "triangles", 1.0).response(), SHORTEST[:1]).real.min() > 0.05


def integrated(kernel: str, stretch: float, n: int, steps: int, dt: float) -> np.ndarray:
    """(steps, n*n, 2) displacements of n x n periodic nodes, from random ones of 1e-9 on."""
    lattice = Lattice(kernel, "nodes", stretch, n=n)
    u = 1e-9 * np.random.default_rng(0).standard_normal((n * n, 2))
    v, F, path = np.zeros_like(u), lattice.turned(lattice.at_rest(), u, lattice.reference), []
    for _ in range(steps):
        g = lattice.gradients(u)
        v = v + dt * lattice.force(F, g)
        F = lattice.turned(F, dt * v, g)
        u = u + dt * v
        path.append(u)
    return np.array(path)


def test_time_integration_grows_as_predicted():
    """The fastest of the waves that fit into 8 x 8 nodes at 5 % stretch with an Eulerian kernel; with a Lagrangian one none grows."""
    n, steps, dt = 8, 350, 0.1
    X = np.stack(np.divmod(np.arange(n * n), n), axis=1)
    k = 2 * np.pi / n * X
    found = squares(*Lattice("Eulerian", "nodes", 1.05).response(), k).real.min(axis=1)
    wave = np.exp(-1j * X @ k[found.argmin()])
    size = np.abs(np.einsum("tna,n->ta", integrated("Eulerian", 1.05, n, steps, dt), wave)).max(axis=1)
    late = dt * np.arange(steps)[200:]
    assert np.polyfit(late, np.log(size[200:]), 1)[0] == pytest.approx(np.sqrt(-found.min()), rel=0.01)
    calm = np.abs(integrated("Lagrangian", 1.05, n, steps, dt)).max(axis=(1, 2))
    assert calm.max() < 3 * calm[0]


def test_the_domain_names_what_grows():
    stretches, waves = [0.95, 1.0, 1.1], np.linspace(0.1, 1, 10)
    found = domain("", (Lattice("Eulerian", "nodes", s).response() for s in stretches), stretches, waves)
    assert found.worst.shape == (3, 10)
    growing = found.worst < -NOTHING
    assert growing[2, :-1].any() and not growing[1].any()
    sound = domain("", (Lattice("Lagrangian", "nodes", s).response() for s in stretches), stretches, waves)
    assert not (sound.worst < -NOTHING).any()
    assert np.abs(sound.worst[:, -1]).max() < 1e-9


@pytest.mark.long
@pytest.mark.parametrize("formulation, cells", [("galerkin", "quad"), ("galerkin", "triangle"), ("collocation", "quad")])
def test_the_running_kernels(formulation, cells):
    """Long waves of a stretched plate are the continuum's; galerkin feels every wave, the thesis's form not the checkerboard."""
    for stretch, (R, K) in zip((1.0, 1.2), running(formulation, cells, (1.0, 1.2))):
        assert np.sort(squares(R, K, LONG).real, axis=1) == pytest.approx(continuum(stretch, LONG), rel=0.01)
        least = squares(R, K, SHORTEST).real.min()
        assert least > 0.1 if formulation == "galerkin" else abs(least) < 1e-3
        if formulation == "collocation":  # on square cells it is the lattice with one point in each
            alone = Lattice("Lagrangian", "cells", stretch).response()
            assert np.sort(squares(R, K, SHORTEST).real) == pytest.approx(np.sort(squares(*alone, SHORTEST).real), abs=1e-3)
