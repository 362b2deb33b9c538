"""Rupture: what a crack cuts, what it leaves, what it costs, on the thesis's branching plate and on torn small ones."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.scene.script import load_scene

from ..exact import same_state
from ..plates import CELLS, SIDE, crack, displacement, mass, plane, plate_scene, put, start, tearing, velocity

D = SIDE / CELLS
B1 = Path(__file__).parents[2] / "scenes" / "crack_branching.py"


# --- which links a crack cuts -------------------------------------------------------------------------


def depth_inside(a, b, polygon):
    """(K,) deepest distance inside a convex polygon along each segment a-b (K, 2): > 0 where it crosses the interior.

    By samples, each 1/400 of the segment; segments whose boxes are apart are not sampled (-inf).
    """
    result = np.full(len(a), -np.inf)
    lo, hi = polygon.min(axis=0) - 1e-6, polygon.max(axis=0) + 1e-6
    near = ((np.maximum(a, b) >= lo) & (np.minimum(a, b) <= hi)).all(axis=1)
    a, b = a[near], b[near]
    t = np.linspace(0, 1, 401)[None, :, None]
    x = a[:, None] * (1 - t) + b[:, None] * t
    side = np.roll(polygon, -1, axis=0) - polygon
    result[near] = np.min(
        [(s[0] * (x[..., 1] - p[1]) - s[1] * (x[..., 0] - p[0])) / np.hypot(*s) for p, s in zip(polygon, side)], axis=0
    ).max(axis=1)
    return result


def links_of(sim, links):
    """For every link and evaluation point: (from, to, cut, source), in the plane."""
    start_ = runtime.get(links.start, links.n + 1)
    source = runtime.get(links.source, links.pairs)
    cut = runtime.get(links.cut, links.pairs)
    at = runtime.get(links.at, 2 * links.n)[:, :2].reshape(-1, 2, 2)
    place = runtime.get(links.sources, links.n_sources)[:, :2]
    row = np.repeat(np.arange(links.n), np.diff(start_))
    points = runtime.get(links.n_points, links.n)
    coef = np.abs(runtime.get(links.coef, links.pairs)).reshape(links.pairs, -1).max(axis=1)
    result = []
    for g in (0, 1):
        has = points[row] > g
        result.append((at[row, g][has], place[source][has], (cut[has] >> g) & 1 == 1, source[has], coef[has]))
    return [np.concatenate(x) for x in zip(*result)]


@pytest.fixture(scope="module", params=[("galerkin", "triangle", 0.25), ("galerkin", "quad", 0.0), ("collocation", "quad", 0.25)])
def cracked(request):
    """A plate with a pre-crack: every link of every kind, the broken cells' polygons, the fragments."""
    kind, cells, irregularity = request.param
    sim = start(plate_scene(formulation=kind, cells=cells, irregularity=irregularity, cuts=[crack()]))
    broken = runtime.get(sim.shell.cells.broken, sim.shell.cells.n) == 1
    assert np.array_equal(np.flatnonzero(broken), sim.shell.cut_cells)
    polygons = [sim.shell.mesh.points[c[c >= 0], :2] for c in sim.shell.mesh.cells[broken]]
    dead = {
        "nodes": runtime.get(sim.shell.nodes.fragment, sim.shell.nodes.n) == 1,
        "cells": broken,
    }
    kinds = [
        (links_of(sim, links), dead["cells" if links.n_sources == sim.shell.cells.n else "nodes"]) for links in sim.shell.internal.links
    ]
    return SimpleNamespace(kinds=kinds, polygons=polygons, broken=broken, dead=dead, mesh=sim.shell.mesh, u=None)


def test_no_live_link_crosses_the_crack(cracked):
    for (a, b, cut, source, _), dead in cracked.kinds:
        deepest = np.max([depth_inside(a, b, p) for p in cracked.polygons], axis=0)
        assert not np.any((deepest > 1e-5 * D) & ~cut)
        assert np.all(cut[dead[source]])
        assert cut.sum() > 100


def test_no_link_is_cut_without_a_reason(cracked):
    """A cut link crosses a broken cell, runs along its border, or leads to something dead."""
    for (a, b, cut, source, _), dead in cracked.kinds:
        near = np.max([depth_inside(a, b, p) for p in cracked.polygons], axis=0) > -0.01 * D  # samples may miss a corner
        assert np.all(near[cut & ~dead[source]])


def test_the_mouth_is_open(cracked):
    """Where the crack meets the border, upper and lower nodes do not see each other past its end."""
    found = 0
    for (a, b, cut, _, _), _ in cracked.kinds:
        mouth = (a[:, 0] < 0.01 * SIDE) & (b[:, 0] < 0.01 * SIDE)
        lips = np.array([p[:, 1] for p in cracked.polygons if p[:, 0].min() < 0.01 * SIDE], dtype=object)
        low, high = min(y.min() for y in lips), max(y.max() for y in lips)
        across = mouth & (np.minimum(a[:, 1], b[:, 1]) <= low + 1e-9) & (np.maximum(a[:, 1], b[:, 1]) >= high - 1e-9)
        assert np.all(cut[across])
        found += across.sum()
    assert found > 0


def test_cut_links_count_nothing(cracked):
    for (_, _, _, source, coef), dead in cracked.kinds:
        assert np.all(coef[dead[source]] == 0)


def test_an_opened_crack_strains_nothing():
    """The two halves of a plate that is cut through move rigidly apart: no strain, no force, no energy."""
    from taichi_sph.scene import Cut

    from ..plates import forces, stored, strains

    sim = start(plate_scene(cells="quad", irregularity=0.0, cuts=[Cut(start=(0, SIDE / 2, 0), end=(SIDE, SIDE / 2, 0))]))
    upper = plane(sim)[:, 1] > SIDE / 2 + 1e-9
    u = np.where(upper[:, None], [1e-4, 2e-4], [-3e-4, -1e-4])
    f = forces(sim, u)
    live = runtime.get(sim.shell.cells.broken, sim.shell.cells.n) == 0
    assert np.abs(strains(sim)[live]).max() < 1e-12
    assert np.abs(f).max() < 1e-12 * 32e9 * 4e-3 * 1e-3
    assert stored(sim, u) < 1e-20


# --- a running crack: B1 at draft ---------------------------------------------------------------------


@pytest.fixture(scope="module")
def branching():
    """B1, coarse: history of the ledger, of the symmetry, and of the links."""
    scene = load_scene(B1, {"quality": "draft"})
    sim = start(scene)
    X, C = plane(sim), sim.shell.mesh.centres[:, :2]
    image = np.array([np.argmin(np.sum((X - x * [1, -1]) ** 2, axis=1)) for x in X])
    cell_image = np.array([np.argmin(np.sum((C - x * [1, -1]) ** 2, axis=1)) for x in C])
    history, quiet = [], []
    links = None
    while sim.steps_left:
        before, events = links, sim.shell.rupture.events
        sim.advance(min(5, sim.steps_left))
        rows = sim.shell.internal.rows
        links = dict(rows.state()) | {"coef": runtime.get(rows.coef, rows.pairs)}
        if before is not None and sim.shell.rupture.events == events:
            quiet.append(all(np.array_equal(before[k], links[k]) for k in links))
        v, D = velocity(sim), runtime.get(sim.shell.cells.delayed, sim.shell.cells.n)
        history.append(
            {
                **sim.energies(),
                "t": sim.time,
                "broken": int(runtime.get(sim.shell.cells.broken, sim.shell.cells.n).sum()),
                "v_asymmetry": np.abs(v - v[image] * [1, -1]).max() / np.abs(v).max(),
                "D_asymmetry": np.abs(D - D[cell_image]).max(),
            }
        )
    return SimpleNamespace(
        history=history,
        quiet=quiet,
        mass=mass(sim).sum(),
        shell=scene.shells[0],
        precut=len(sim.shell.cut_cells),
        rupture_time=runtime.get(sim.shell.cells.rupture_time, sim.shell.cells.n),
        broken=runtime.get(sim.shell.cells.broken, sim.shell.cells.n),
        cut_cells=sim.shell.cut_cells,
    )


@pytest.mark.long
def test_the_crack_runs(branching):
    assert branching.history[-1]["broken"] - branching.precut > 30
    ran = np.setdiff1d(np.flatnonzero(branching.broken), branching.cut_cells)
    times = branching.rupture_time[ran]
    assert np.all((times > 5e-6) & (times < 80e-6))
    assert np.all(np.isnan(branching.rupture_time[branching.broken == 0]))
    assert np.all(np.isnan(branching.rupture_time[branching.cut_cells]))


def test_the_ledger_closes(branching):
    assert max(abs(e["closed_residual_percent"]) for e in branching.history) < 0.2
    assert max(abs(e["B_percent"]) for e in branching.history) < 0.5


def test_what_is_taken_never_comes_back(branching):
    assert np.all(np.diff([e["damage"] for e in branching.history]) >= 0)
    # rupture takes energy; at the end of the pre-crack and at the border renewed fits may give a little back
    released = np.diff([e["released"] for e in branching.history])
    assert released[released > 0].sum() > 10 * -released[released < 0].sum()


def test_symmetry(branching):
    """The load and the lattice are symmetric about the mid-plane: so is the crack, to rounding."""
    early = [e for e in branching.history if e["t"] < 30e-6]
    assert early[-1]["broken"] > branching.precut
    assert max(e["v_asymmetry"] for e in early) < 1e-11
    assert max(e["D_asymmetry"] for e in early) < 1e-11


def test_quiet_steps_leave_the_links_alone(branching):
    assert len(branching.quiet) > 10 and all(branching.quiet)


def test_mass(branching):
    shell = branching.shell
    area = shell.surface.length * shell.surface.width
    assert branching.mass == pytest.approx(area * shell.thickness * shell.material.density, rel=1e-12)


# --- fragments ----------------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize("kind", ["galerkin", "collocation"])
def test_a_fragment_keeps_mass_and_velocity(kind):
    """Break every cell around one node: it flies on, and its neighbours do not feel it any more."""
    sim = start(tearing(kind, cells="quad", irregularity=0.0))
    m = mass(sim)
    sim.advance(3)
    X = plane(sim)
    lone = int(np.argmin(np.sum((X - [0.75 * SIDE, 0.25 * SIDE]) ** 2, axis=1)))
    around = np.flatnonzero((sim.shell.mesh.cells == lone).any(axis=1))
    assert len(around) == 4
    sim.shell.rupture.cut(around)
    v = velocity(sim)
    fragment = runtime.get(sim.shell.nodes.fragment, sim.shell.nodes.n)
    assert fragment[lone] == 1 and sim.status()["loose nodes"] == fragment.sum()
    u = displacement(sim)
    sim.advance(10)
    assert np.array_equal(velocity(sim)[lone], v[lone])
    assert displacement(sim)[lone] - u[lone] == pytest.approx(10 * sim.dt * v[lone], rel=1e-9)
    assert np.array_equal(mass(sim), m)
    # moved far away, it changes no force on any other node
    sim.shell.internal.strain(0.0)
    sim.shell.internal.force()
    before = runtime.get(sim.shell.nodes.force, sim.shell.nodes.n)
    far = displacement(sim)
    far[lone] += 1.0
    put(sim, "u", far)
    sim.shell.internal.strain(0.0)
    sim.shell.internal.force()
    assert np.array_equal(runtime.get(sim.shell.nodes.force, sim.shell.nodes.n), before)


@pytest.mark.long
def test_tearing_stays_below_the_stable_step():
    """Leftovers around fragments must not be stiffer than the step allows (a fit that extrapolates is lowered)."""
    from taichi_sph.bodies.shell.stable_dt import largest_frequency

    sim = start(tearing())
    events, above = -1, 0
    while sim.steps_left:
        sim.advance(1)
        if sim.shell.rupture.events != events:
            events = sim.shell.rupture.events
            above += sim.dt * largest_frequency(sim.shell)[0] / 2 > 1.0
    assert sim.status()["broken"] > 40 and sim.status()["loose nodes"] > 10
    assert above == 0
    assert abs(sim.energies()["closed_residual_percent"]) < 0.2


def test_a_look_changes_nothing():
    """Forces of a tearing plate at other displacements, without time: its state stays, to the bit."""
    sim = start(tearing())
    while sim.status()["broken"] < 10:
        sim.advance(5)
    before = sim.state()
    u = displacement(sim)
    put(sim, "u", 1.5 * u)
    sim.shell.internal.strain(0.0)
    put(sim, "u", u)
    assert same_state(sim.state(), before) == []
