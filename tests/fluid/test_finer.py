"""Water that is finer in a part of it: what is split, and what a jump of the spacing does to waves, to rest, to walls and to sums."""

import numpy as np
import pytest
from pydantic import ValidationError

from taichi_sph import runtime
from taichi_sph.bodies.fluid.fill import fill
from taichi_sph.errors import SceneError
from taichi_sph.geometry.surfaces import generate
from taichi_sph.numerics.neighbours import Neighbours, Sizes
from taichi_sph.pool import restore_all, state_of
from taichi_sph.scene import Ball, Box, Finer, Fluid, FluidBox, Numerics, Plate, Scene, Shell, ShellFill, Sphere, Wall, Water

from ..exact import restarts_exactly
from .bodies import box, by_id, put, run, unbalanced
from .test_several import layers
from .test_wetted import BULLET, STEEL, can, integral, powers, shake, start, wetted

D = 0.01
MORE = (("quad", 0.8, 0.01), ("triangle", 0.4, 0.035))  # cells, height of particles in the finest spacing, deviation


def made(hi, finer, *, walls=(), gravity=(0.0, 0.0, 0.0), threads=None, precision="f64", **settings):
    """A FluidBody that fills the box [0, hi], in a Taichi started afresh."""
    from taichi_sph.bodies.fluid.body import FluidBody

    runtime.start("cpu", precision, threads)
    fluid = Fluid(name="water", fill=FluidBox(lo=(0, 0, 0), hi=hi), spacing=D, finer=finer, **settings)
    b = FluidBody([(fluid, fill(fluid, D))], gravity, walls)
    b.start()
    return b


def beyond(**sides) -> tuple[Finer, ...]:
    """Finer above those places along the axes of these names."""
    return (Finer(within=Box(lo=tuple(sides.get(axis) for axis in "xyz"))),)


def test_what_is_split_keeps_its_volume_and_mass():
    fluid = Fluid(
        name="w", fill=FluidBox(lo=(0, 0, 0), hi=(0.08, 0.04, 0.04)), spacing=D,
        finer=(*beyond(x=0.04), Finer(within=Ball(centre=(0.08, 0.02, 0.02), radius=0.02))),
    )  # fmt: skip
    f = fill(fluid, D)
    assert sorted(set(f.parts.tolist())) == [1, 2, 4]
    assert f.spacing == pytest.approx(D, rel=1e-12) and f.finest == pytest.approx(D / 4, rel=1e-12)
    assert (f.mass / f.parts**3).sum() == pytest.approx(1000 * 0.08 * 0.04 * 0.04, rel=1e-12)
    np.testing.assert_allclose(np.average(f.points, axis=0, weights=1.0 / f.parts**3), (0.04, 0.02, 0.02), atol=1e-12)
    assert (f.parts[f.points[:, 0] < 0.04] == 1).all() and (f.parts[f.points[:, 0] > 0.04] > 1).all()
    assert "64 of 10 mm" in f.sentence and f"{(f.parts == 4).sum()} of 2.5 mm" in f.sentence


def test_a_region_without_water_is_refused():
    fluid = Fluid(name="w", fill=FluidBox(lo=(0, 0, 0), hi=(0.08, 0.04, 0.04)), spacing=D, finer=beyond(x=0.2))
    with pytest.raises(SceneError, match=r"fluid 'w': finer\[0\]\.within holds none of its particles, which stand from \(0\.005"):
        fill(fluid, D)
    with pytest.raises(ValidationError, match="finer"):
        Fluid(name="w", fill=FluidBox(lo=(0, 0, 0), hi=(1, 1, 1)), finer=())


@pytest.mark.parametrize("times", [1, 2])
def test_none_is_split_through_a_wall(times):
    """In a ball, coarse beside its radius, every part of a particle stands inside, half its own spacing off the wall."""
    surface, thick = Sphere(radius=0.06), 1e-3
    fluid = Fluid(name="w", fill=ShellFill(shell="ball"), spacing=0.012, finer=times * (Finer(within=Box()),))
    f = fill(fluid, 0.012, generate(surface, Numerics(spacing=0.01)), thick, surface)
    away = 0.06 - np.linalg.norm(f.points, axis=1)
    print(f"{1e3 * away.min():.3f} mm, D {1e3 * f.finest:.3f} mm")
    assert away.min() > 0.4 * f.finest + 0.5 * thick and len(f.points) == 480 * 8**times


def test_a_jump_of_four_to_one_is_refused():
    twice = (*beyond(x=0.04), *beyond(x=0.042))
    fluid = Fluid(name="w", fill=FluidBox(lo=(0, 0, 0), hi=(0.08, 0.04, 0.04)), spacing=D, finer=twice)
    with pytest.raises(SceneError, match="particles of 0.0025 m or less stand beside some of 0.01 m.* at least 0.015 m inside"):
        fill(fluid, D)
    assert fluid.halvings == 2 and fluid.spacing_at(D, (0.06, 0.0, 0.0)) == D / 4 and fluid.spacing_at(D, (0.0, 0.0, 0.0)) == D
    beside = (Finer(within=Ball(centre=(k, 0, 0), radius=0.3)) for k in range(3))
    assert fluid.model_copy(update={"finer": tuple(beside)}).halvings == 1


@pytest.mark.parametrize("far", [0.0, 1e5])
def test_lists_of_points_that_differ_in_size(far):
    """Each two within the mean of their supports, and the skin; across the wrap of the cells too."""
    runtime.start()
    rng, n, support, skin = np.random.default_rng(3), 3000, 0.1, 0.006
    x = rng.uniform(0, 1, (n, 3)) * [1.0, 0.6, 0.5] + [50.0, -0.3, -70.0]
    x[17] += far
    size = rng.choice([0.25, 0.5, 1.0], n)
    points, sizes = runtime.new("x", n, 3, "f64"), runtime.new("size", n, dtype="f64")
    runtime.put(points, x)
    runtime.put(sizes, size)
    near = Neighbours(
        "cloud", points, n, support + skin, 0.05, np.array([x[:17].min(axis=0), x[:17].max(axis=0)]), Sizes(sizes, (1.0, 0.5, 0.25), skin)
    )
    near.order()
    source = runtime.get(near.source, n)
    x, size = x[source], size[source]
    runtime.put(points, x)
    runtime.put(sizes, size)
    near.list()
    number, at = runtime.get(near.number, n), runtime.get(near.at, n + 1)
    lists = runtime.get(near.near, int(at[-1]))
    for i in range(n):
        reach = skin + 0.5 * support * (size[i] + size)
        assert sorted(lists[at[i] : at[i] + number[i]]) == np.flatnonzero(np.linalg.norm(x - x[i], axis=1) < reach).tolist()


def test_a_pulse_crosses_a_jump_of_two_to_one():
    """Less than 1 % of it comes back (0.2 %; 1.3 % from two lattices that nobody evened out). Its width at half its height is 17 D."""
    length, side, width = 1.2, 4 * D, 10 * D
    planes = [*box(length, side, side), Wall(point=(length, 0, 0), normal=(-1, 0, 0))]
    b = made((length, side, side), beyond(x=0.6), walls=planes[:-1], water=Water(sound=1.0, tension=None), alpha=0.0, delta=0.0)
    x = by_id(b, "x")
    pulse = 1e-4 * np.exp(-(((x[:, 0] - 0.3) / width) ** 2))
    put(b, "v", pulse[:, None] * [1, 0, 0])
    put(b, "s", pulse)
    dt = 0.4 * b.stable_dt()
    run(b, dt, round(0.6 / dt))
    back = 0.5 * (by_id(b, "s") - by_id(b, "v")[:, 0])
    here = by_id(b, "x")[:, 0]
    returned, gone = back[(here > 0.05) & (here < 0.55)], by_id(b, "s")[here > 0.75]
    print(f"returned {np.abs(returned).max() / 1e-4:.4f}, gone on {gone.max() / 1e-4:.3f}")
    assert np.abs(returned).max() < 0.01e-4
    assert gone.max() > 0.95e-4


@pytest.mark.parametrize("sides", [{"x": 0.06}, pytest.param({"z": 0.06}, marks=pytest.mark.long)])
def test_water_at_rest_across_a_jump(sides):
    """The slope of the pressure is as near to rho g as that of one spacing (tests/fluid/test_body.py), and nothing moves."""
    b = made((0.12, 0.06, 0.12), beyond(**sides), gravity=(0, 0, -9.81), walls=box(0.12, 0.06), water=Water(sound=20, tension=None))
    before = by_id(b, "x")
    run(b, 0.9 * b.stable_dt(), 1000)
    f = b.frame()
    depth = 0.12 - f["points"][:, 2]
    deep = depth > 3 * D
    slope = np.polyfit(depth[deep], f["pressure"][deep], 1)[0] / (1000 * 9.81)
    moved = np.linalg.norm(by_id(b, "x") - before, axis=1).max() / D
    print(f"slope {slope:.4f}, moved {moved:.3f} D, {np.linalg.norm(f['velocity'], axis=1).max():.4f} m/s")
    assert slope == pytest.approx(1, abs=0.03)
    assert moved < 0.5 and abs(unbalanced(b)) < 1e-3


def waved(threads=None, precision="f64", **more):
    settings = {"alpha": 0.3, "beta": 0.2, **more}
    b = made((0.12, 0.12, 0.18), beyond(x=0.06, z=0.06), threads=threads, precision=precision, **settings)
    put(b, "v", 30 * np.sin(30 * by_id(b, "x")))
    return b


@pytest.mark.parametrize("more", [{}, {"dissipation": "riemann", "alpha": 0.1, "beta": 0.0}])
def test_momentum_and_energy_are_kept_across_a_jump(more):
    b = waved(**more)
    m = by_id(b, "mass")
    assert m.max() / m.min() == pytest.approx(8)
    b.injected = b.stored() + float((0.5 * m * (by_id(b, "v") ** 2).sum(axis=1)).sum())
    before = m @ by_id(b, "v")
    run(b, 0.5 * b.stable_dt(), 60)
    e = b.energies()
    print(unbalanced(b), {k: float(v) for k, v in e.items()})
    np.testing.assert_allclose(m @ by_id(b, "v"), before, atol=1e-10 * float((m[:, None] * np.abs(by_id(b, "v"))).sum()))
    assert abs(unbalanced(b)) < 2e-3 and e["viscous"] > 1e-3 * b.injected


@pytest.mark.long
def test_one_and_two_threads():
    states = []
    for threads in (1, 2):
        b = waved(threads)
        run(b, 1.5e-6, 40)
        assert b.sorts > 1
        states.append(state_of(b.pools()))
    assert all(np.array_equal(states[0][k], states[1][k]) for k in states[0])


def test_n_and_restart_and_n_is_2n():
    b = waved()
    run(b, 1.5e-6, 25)
    half = {k: np.array(v) for k, v in state_of(b.pools()).items()}
    run(b, 1.5e-6, 25, 1.5e-6)
    whole, energies = state_of(b.pools()), b.energies()
    again = waved()
    restore_all(again.pools(), half)
    run(again, 1.5e-6, 25, 1.5e-6)
    assert again.sorts > int(half["fluid.sums.sorts"])
    assert all(np.array_equal(whole[k], v) for k, v in state_of(again.pools()).items())
    assert energies == again.energies()


def finer_can(rigids=()) -> Scene:
    """A can of coarse cells with finer water in a part of it."""
    scene = can(rigids=rigids)
    level = 0.04 if rigids else None
    water = scene.fluids[0].model_copy(update={"finer": beyond(x=0.0), "fill": ShellFill(shell="can", level=level)})
    return scene.model_copy(update={"fluids": (water,)})


@pytest.mark.parametrize("rigids", [pytest.param((), marks=pytest.mark.long), (BULLET,)])
def test_pressure_does_the_work_that_the_density_stores(rigids):
    """As in tests/fluid/test_wetted.py, on points within the cells of the shell."""
    sim = start(finer_can(rigids))
    nodes = sim.shell.nodes
    assert wetted(sim).first[1] == 4 * len(sim.shell.mesh.cells)
    shake(nodes)
    if rigids:
        runtime.put(sim.rigids.v, np.random.default_rng(5).normal(size=(1, 3)))
    stored, done, felt = powers(sim)
    push = runtime.get(nodes.force, nodes.n)
    done += (push * runtime.get(nodes.v, nodes.n)).sum()
    force = felt.sum(axis=0) + push.sum(axis=0)
    if rigids:
        done += runtime.get(sim.rigids.force, 1)[0] @ runtime.get(sim.rigids.v, 1)[0]
        force += runtime.get(sim.rigids.force, 1)[0]
    assert np.abs(push).max() > 0.0
    assert done == pytest.approx(stored, rel=1e-9)
    assert np.abs(force).max() < 1e-9 * np.abs(felt).sum()


@pytest.mark.parametrize(
    "cells, above, within", [("quad", 0.4, 0.01), ("triangle", 0.8, 0.035), *(pytest.param(*case, marks=pytest.mark.long) for case in MORE)]
)
def test_points_within_coarse_cells_give_the_integral_of_a_plane(cells, above, within):
    """w over a plate whose nodes stand 1.6 of the finest spacing apart; of its nodes alone 0.87 to 1.43 of the integral."""
    fine = 0.01
    there = FluidBox(lo=(-0.02, -0.02, above * fine - 0.5 * fine), hi=(0.02, 0.02, above * fine + 1.5 * fine))
    scene = Scene(
        name="plane", title="particles on a plate", source="tests",
        shells=[Shell(name="plate", surface=Plate(length=0.32, width=0.32, origin=(-0.16, -0.16, 0)), thickness=1e-6, material=STEEL,
                      motion="free")],
        fluids=[Fluid(name="water", fill=there, spacing=0.02, finer=(Finer(within=Box()),), hydrostatic=False)],
        duration=1e-3, numerics=Numerics(spacing=0.016, cells=cells),
    )  # fmt: skip
    sim = start(scene)
    f, w = sim.fluid, wetted(sim)
    places = np.array(f.points)
    places[:, 2] = above * fine  # all of them in one plane: one after the other they do not see each other here
    f.p.place(places)
    f.sort()
    f.pairs.pack(0.0)
    w.see(True)
    met = runtime.get(w.s.met, f.p.n)[:, :3]
    size = np.linalg.norm(met, axis=1)
    exact = integral(above * fine, f.support * f.p.finest)
    print(f"{size.min() / exact:.3f} to {size.max() / exact:.3f}")
    assert (np.abs(size / exact - 1.0) < within).all()
    assert (met[:, 2] > 0.99 * size).all()


@pytest.mark.long
def test_a_can_with_finer_water_restarts_exactly():
    restarts_exactly(lambda: start(finer_can()), 12, 12)


@pytest.mark.long
@pytest.mark.parametrize("precision", ["f64", "f32"])
def test_two_fluids_one_of_them_finer(precision):
    """800 over 1000 kg/m3, the upper one of half the spacing: at rest, and the ledger closes."""
    scene = layers(1000.0, 800.0, across=(0.06, 0.06), deep=0.06, alpha=0.1)
    upper = scene.fluids[1].model_copy(update={"finer": (Finer(within=Box()),)})
    numerics = scene.numerics.model_copy(update={"precision": precision})
    sim = start(scene.model_copy(update={"fluids": (scene.fluids[0], upper), "numerics": numerics}))
    sim.advance(600)
    f = sim.fluid
    x, p = f.frame()["points"], f.frame()["pressure"]
    for span, density, low in zip(f.spans, (1000.0, 800.0), (0.0, 0.06)):
        own = slice(span.first, span.first + span.n)
        inside = (x[own, 2] > low + 0.015) & (x[own, 2] < low + 0.045)
        slope = -np.polyfit(x[own, 2][inside], p[own][inside], 1)[0] / (density * 9.81)
        print(f"{span.name}: {slope:.3f}")
        assert slope == pytest.approx(1.0, abs=0.05)
    assert abs(sim.energies()["closed_residual_percent"]) < 0.5


@pytest.mark.long
def test_single_precision_is_double_precision_nearly():
    found = []
    for precision in ("f64", "f32"):
        b = waved(precision=precision)
        run(b, 1.5e-6, 60)
        found.append(by_id(b, "x"))
    assert np.abs(found[0] - found[1]).max() < 1e-3 * D
