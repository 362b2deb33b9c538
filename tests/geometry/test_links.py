"""Neighbourhoods and MLS coefficients against brute force and the NumPy reference."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from taichi_sph import runtime
from taichi_sph.bodies.shell_sph.links import Links, Rows, Sources
from taichi_sph.geometry.mesh import plate, tangent_frames
from taichi_sph.numerics.mls import LEBESGUE

from . import mls_reference as reference

D = 1.0e-3
H = 1.3 * D
TILT = tangent_frames(np.array([[0.36, -0.48, 0.8]]))[0]  # a plane that is not z = 0
ORIGIN = np.array([0.3, -0.2, 0.1])


def lift(plane):
    """(K, 2) plane coordinates -> (K, 3) places."""
    return ORIGIN + np.asarray(plane) @ TILT[:2]


def make(name, sources, points, order, *, n_points=None, h=H, residual_of=None, **options):
    """A Links on the tilted plane: sources (S, 2), points (R, 2, 2)."""
    n = len(points)
    x = runtime.new(f"{name}.x", len(sources), 3, "f64")
    dead = runtime.new(f"{name}.dead", len(sources), dtype="i32")
    runtime.put(x, lift(sources))
    rows = Rows(
        points=lift(np.asarray(points).reshape(-1, 2)).reshape(n, 2, 3),
        n_points=np.ones(n) if n_points is None else n_points,
        frames=np.broadcast_to(TILT, (n, 3, 3)),
        h=np.broadcast_to(np.asarray(h, float), n).copy(),
        order=order,
        residual_of=residual_of,
    )
    return Links(name, Sources(x, len(sources), dead), rows, **options)


def read(links):
    """Everything as arrays."""
    return SimpleNamespace(
        start=runtime.get(links.start, links.n + 1),
        source=runtime.get(links.source, links.pairs),
        coef=runtime.get(links.coef, links.pairs),
        alive=runtime.get(links.alive, links.n),
        row=lambda r, a: a[slice(*runtime.get(links.start, links.n + 1)[r : r + 2])],
    )


@pytest.fixture(scope="module")
def irregular():
    """Rows of all three kinds on an irregular plate, read back as arrays: one compilation for the whole module."""
    runtime.start()
    nodes = plate(12 * D, 12 * D, D, "triangle", 0.3, seed=5).points[:, :2]
    rng = np.random.default_rng(7)
    a = rng.uniform(0, 12 * D, (150, 2))
    pairs = np.stack([a, np.clip(a + rng.uniform(-0.5, 0.5, a.shape) * D, 0, 12 * D)], axis=1)
    order = np.arange(150) % 3
    values = make("values", nodes, pairs, order, n_points=np.full(150, 2), transposed=True)
    values.renew_all()
    value = read(values)
    transposed = [
        runtime.get(f, k) for f, k in ((values.t_start, len(nodes) + 1), (values.t_row, values.pairs), (values.t_coef, values.pairs))
    ]

    itself = np.repeat(nodes[:, None], 2, axis=1)
    residuals = make("residuals", nodes, itself, 2, residual_of=np.arange(len(nodes)))
    residuals.renew_all()
    residual = read(residuals)

    single = np.repeat(a[:, None], 2, axis=1)
    gradients = make("gradients", nodes, single, order, gradient=True)
    own = (np.arange(150) // 3 % 2).astype(np.int32)  # every order with and without its own place
    runtime.put(gradients.own, own)
    gradients.renew_all()
    gradient = read(gradients)
    return SimpleNamespace(
        nodes=nodes, pairs=pairs, points=a, order=order, own=own,
        value=value, residual=residual, gradient=gradient, transposed=transposed,
    )  # fmt: skip


def test_neighbours(irregular):
    tree = cKDTree(irregular.nodes)
    near = 2 * H * (1 - 1e-12)
    for r, (a, b) in enumerate(irregular.pairs):
        expected = set(tree.query_ball_point(a, near)) | set(tree.query_ball_point(b, near))
        got = irregular.value.row(r, irregular.value.source)
        assert len(got) == len(set(got)) and set(got) == expected
    for r, x in enumerate(irregular.nodes):
        assert set(irregular.residual.row(r, irregular.residual.source)) == set(tree.query_ball_point(x, near))


def test_value_is_the_mean_over_both_points(irregular):
    for r, points in enumerate(irregular.pairs):
        near = irregular.nodes[irregular.value.row(r, irregular.value.source)]
        expected = np.mean([reference.value(x, near, H, irregular.order[r]) for x in points], axis=0)
        assert irregular.value.row(r, irregular.value.coef) == pytest.approx(expected, abs=1e-12)


def test_residual(irregular):
    for r, x in enumerate(irregular.nodes):
        source = irregular.residual.row(r, irregular.residual.source)
        expected = (source == r) - reference.value(x, irregular.nodes[source], H, 2)
        assert irregular.residual.row(r, irregular.residual.coef) == pytest.approx(expected, abs=1e-11)


def test_gradient_against_finite_differences(irregular):
    for r, x in enumerate(irregular.points):
        near = irregular.nodes[irregular.gradient.row(r, irregular.gradient.source)]
        own = x if irregular.own[r] else None
        got = irregular.gradient.row(r, irregular.gradient.coef)
        if own is None:
            expected = reference.gradient(x, near, H, irregular.order[r])
        else:
            # the place that joins moves with nothing: it is the edge node itself
            expected = reference.gradient(x, near, H, irregular.order[r], own)
        assert H * got == pytest.approx(H * expected, abs=1e-9), f"row {r}, order {irregular.order[r]}, own {own is not None}"


def test_monomials_are_reproduced(irregular):
    """Values give back, gradients derive, residuals kill every monomial up to the order."""
    o = irregular.nodes.mean(axis=0)

    def terms(x):
        return reference.basis((x - o) / D, 2)

    def slopes(x):
        d = (x - o) / D
        zero, one = np.zeros(len(d)), np.ones(len(d))
        return np.stack(
            [
                np.stack([zero, one, zero, 2 * d[:, 0], d[:, 1], zero], axis=1),
                np.stack([zero, zero, one, zero, d[:, 0], 2 * d[:, 1]], axis=1),
            ],
            axis=2,
        )

    for r, k in enumerate(irregular.order):
        n = (k + 1) * (k + 2) // 2
        source = irregular.value.row(r, irregular.value.source)
        got = irregular.value.row(r, irregular.value.coef) @ terms(irregular.nodes[source])[:, :n]
        assert got == pytest.approx(terms(irregular.pairs[r]).mean(axis=0)[:n], abs=1e-11)
        if not irregular.own[r]:
            source = irregular.gradient.row(r, irregular.gradient.source)
            got = D * terms(irregular.nodes[source])[:, :n].T @ irregular.gradient.row(r, irregular.gradient.coef)
            assert got == pytest.approx(slopes(irregular.points[r : r + 1])[0][:n], abs=1e-10)
    for r in range(len(irregular.nodes)):
        source = irregular.residual.row(r, irregular.residual.source)
        assert irregular.residual.row(r, irregular.residual.coef) @ terms(irregular.nodes[source]) == pytest.approx(np.zeros(6), abs=1e-10)


def test_transposed_list(irregular):
    t_start, t_row, t_coef = irregular.transposed
    v = irregular.value
    rows = np.repeat(np.arange(len(irregular.pairs)), np.diff(v.start))
    for j in range(len(irregular.nodes)):
        mine = v.source == j
        assert t_row[t_start[j] : t_start[j + 1]].tolist() == rows[mine].tolist()
        assert t_coef[t_start[j] : t_start[j + 1]].tolist() == v.coef[mine].tolist()


@pytest.mark.long
def test_order_falls_back():
    """Too few, or all on a line: order 2 -> 1 -> 0 -> nothing; the fit that is left is the reference's of that order."""
    runtime.start()
    rng = np.random.default_rng(2)
    spread = rng.uniform(-0.8, 0.8, (12, 2)) * D
    line = np.linspace(-1.5, 1.5, 7)[:, None] * np.array([0.6, 0.5]) * D
    clusters = [
        (spread, 2),
        (spread[:5], 1),
        (spread[:3], 1),
        (spread[:2], 0),
        (spread[:1], 0),
        (line, 0),
        (line[:3], 0),
        (spread[:0], None),
    ]
    centres = np.array([[20.0 * k * D, 0.0] for k in range(len(clusters))])
    nodes = np.vstack([c + x for c, (x, _) in zip(centres, clusters)])
    links = make("falls", nodes, np.repeat(centres[:, None], 2, axis=1), 2, transposed=True)
    links.renew_all()
    got = read(links)
    assert got.alive.tolist() == [1] * (len(clusters) - 1) + [0]
    for r, (_, order) in enumerate(clusters):
        near = nodes[got.row(r, got.source)]
        if order is None:
            assert len(near) == 0
        else:
            assert got.row(r, got.coef) == pytest.approx(reference.value(centres[r], near, H, order), abs=1e-10)
    assert got.row(0, got.coef).sum() == pytest.approx(1.0, abs=1e-12)

    # far outside a one-sided cluster, order 2 would extrapolate: sum |Phi| must stay bounded in every row
    one_sided = np.array([[0.9, 0.0], [1.3, 0.5], [1.3, -0.5], [1.7, 0.3], [1.7, -0.3], [2.0, 0.0], [1.1, 0.2]]) * D
    links = make("outside", one_sided, np.zeros((1, 2, 2)), 2, transposed=True)
    links.renew_all()
    got = read(links)
    full = reference.value(np.zeros(2), one_sided[got.source], H, 2)
    assert np.abs(full).sum() > LEBESGUE > np.abs(got.coef).sum()
    assert got.coef.sum() == pytest.approx(1.0, abs=1e-12)


def test_residual_without_slopes_is_left_out():
    """A node whose fit fell back to order 0 would resist rotations: its residual is nothing."""
    runtime.start()
    nodes = np.array([[0.0, 0.0], [0.5, 0.0], [10.0, 0.0]]) * D
    links = make("lonely", nodes, np.repeat(nodes[:, None], 2, axis=1), 2, residual_of=np.arange(3))
    links.renew_all()
    assert np.all(read(links).coef == 0.0)
