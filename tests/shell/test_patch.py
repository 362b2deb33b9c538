"""Patch test and rigid motion on irregular plates: exact to rounding, in f64 and in f32."""

from types import SimpleNamespace

import numpy as np
import pytest

from taichi_sph import runtime

from ..plates import CELLS, SIDE, THICKNESS, forces, inner, linear, plane, plate_scene, start, stored, strains

GRADIENT = np.array([[2e-3, -1e-3], [3e-3, 1.5e-3]])
LARGE = np.array([[0.10, -0.25], [0.30, -0.05]])
YOUNG, NU, D = 32e9, 0.2, SIDE / CELLS


def green(G):
    """E and the force per unit reference length n^a = e S^ab x_,b (rows a) of u = G X."""
    F = np.eye(2) + G
    E = 0.5 * (F.T @ F - np.eye(2))
    S = YOUNG / (1 - NU**2) * ((1 - NU) * E + NU * np.trace(E) * np.eye(2))
    return np.array([E[0, 0], E[1, 1], E[0, 1]]), THICKNESS * S @ F.T


CASES = [
    ("galerkin", "triangle", 0.25, "f64"),
    ("galerkin", "quad", 0.25, "f64"),
    ("galerkin", "triangle", 0.25, "f32"),
    ("collocation", "quad", 0.25, "f64"),
    ("collocation", "triangle", 0.25, "f64"),
]
PARAMS = [*CASES[:-1], pytest.param(CASES[-1], marks=pytest.mark.long)]


@pytest.fixture(scope="module", params=PARAMS, ids=["-".join(map(str, c)) for c in CASES])
def case(request):
    """What the plate answers to linear fields and rigid motions, as arrays."""
    kind, cells, irregularity, precision = request.param
    sim = start(plate_scene(formulation=kind, cells=cells, irregularity=irregularity, precision=precision))
    result = SimpleNamespace(
        kind=kind,
        eps=1e-12 if precision == "f64" else 2e-5,  # of the largest gradient, or of the force that it makes on a side
        # positions of 2 m, rounded, differentiated over D
        rounding=2.0 / D * (1.1e-16 if precision == "f64" else 6e-8),
        X=plane(sim),
        areas=sim.shell.mesh.areas,
        linear={},
        turned=[],
        inner=inner(sim, 3.0 * D),
    )
    for name, G in (("small", GRADIENT), ("large", LARGE)):
        f = forces(sim, linear(sim, G))
        result.linear[name] = SimpleNamespace(G=G, f=f, E=strains(sim), energy=stored(sim, linear(sim, G)))
    for turns in (0.1, 0.25, 1.0, 37.37, 100.0):
        angle = 2 * np.pi * turns
        R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        u = linear(sim, R - np.eye(2)) + [0.3, -1.7]
        result.turned.append(SimpleNamespace(f=forces(sim, u), E=strains(sim), energy=stored(sim, u)))
    if kind == "galerkin":
        rows, edges = sim.shell.internal.rows, sim.shell.mesh.edges
        start_, coef = runtime.get(rows.start, rows.n + 1), runtime.get(rows.coef, rows.pairs).astype(float)
        source = runtime.get(rows.source, rows.pairs)
        border = np.flatnonzero(edges.sides[:, 1] < 0)
        shape = np.zeros((len(border), sim.shell.nodes.n))
        for k, e in enumerate(border):
            shape[k, source[start_[e] : start_[e + 1]]] = coef[start_[e] : start_[e + 1]]
        a, b = (result.X[edges.nodes[border, c]] for c in (0, 1))
        normal = np.stack([b[:, 1] - a[:, 1], a[:, 0] - b[:, 0]], axis=1)  # times length
        outward = np.einsum("ki,ki->k", normal, 0.5 * (a + b) - result.X.mean(axis=0))
        result.border = shape, normal * np.sign(outward)[:, None]
    return result


@pytest.mark.parametrize("field", ["small", "large"])
def test_strain_is_constant(case, field):
    got = case.linear[field]
    expected, _ = green(got.G)
    assert np.abs(got.E - expected).max() < case.eps * np.abs(got.G).max()


@pytest.mark.parametrize("field", ["small", "large"])
def test_inner_nodes_feel_nothing(case, field):
    got = case.linear[field]
    _, n = green(got.G)
    assert case.inner.sum() > 10
    assert np.abs(got.f[case.inner]).max() < case.eps * np.abs(n).max() * D


@pytest.mark.parametrize("field", ["small", "large"])
def test_borders_carry_the_tractions(case, field):
    """galerkin: node forces are exactly the tractions on the border's edges, spread by the edges' shape functions."""
    if case.kind != "galerkin":
        return  # the collocation form is consistent in the interior only
    got = case.linear[field]
    _, n = green(got.G)
    shape, normal = case.border
    assert np.abs(got.f + shape.T @ (normal @ n)).max() < case.eps * np.abs(n).max() * D
    # and therefore the virial: sum f (x) X = - area n
    assert got.f.T @ case.X == pytest.approx(-case.areas.sum() * n.T, rel=case.eps, abs=case.eps * np.abs(n).max() * SIDE**2)


@pytest.mark.parametrize("field", ["small", "large"])
def test_energy_of_the_patch(case, field):
    got = case.linear[field]
    E, n = green(got.G)
    F = np.eye(2) + got.G
    S = n @ np.linalg.inv(F.T)
    energy = 0.5 * case.areas.sum() * (S[0, 0] * E[0] + S[1, 1] * E[1] + 2 * S[0, 1] * E[2])
    assert got.energy == pytest.approx(energy, rel=10 * case.eps)


def test_rigid_motion(case):
    """A2: up to 100 turns and a translation of many plates: no strain, no force, no energy."""
    stiff = YOUNG * THICKNESS
    for got in case.turned:
        assert np.abs(got.E).max() < 50 * case.rounding
        assert np.abs(got.f).max() < 50 * case.rounding * stiff * D
        assert got.energy < (50 * case.rounding) ** 2 * stiff * SIDE**2
