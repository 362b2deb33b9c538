"""Water in a closed shell: momentum, tightness, rest, restart."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.scene import Box, Cylinder, Fluid, Material, Numerics, Pinball, PrescribedVelocity, Rigid, Scene, Shell, ShellFill

from ..exact import restarts_exactly, threads_change_nothing

STEEL = Material(name="steel", young=210e9, poisson=0.3, density=7800.0)


def can(level=None, gravity=None, velocity=(0.0, 0.0, 0.0), held=False, rigids=(), duration=1e-3, every=None, **more) -> Scene:
    """A steel can of 200 x 100 mm, full of water."""
    motions = [PrescribedVelocity(shell="can", where=Box(), velocity=(0, 0, 0), spin=(0, 0, 0))] if held else []
    return Scene(
        name="can",
        title="a can",
        source="tests",
        shells=[Shell(name="can", surface=Cylinder(radius=0.05, length=0.2, ends="discs"), thickness=1e-3, material=STEEL, motion="free")],
        fluids=[Fluid(name="water", fill=ShellFill(shell="can", level=level), velocity=velocity, every=every)],
        rigids=rigids,
        motions=motions,
        gravity=gravity,
        duration=duration,
        numerics=Numerics(spacing=0.0125, **more),
    )


def start(scene, **options):
    from taichi_sph.world.world import World

    return World(scene, **options)


def momentum(sim):
    mass = runtime.get(sim.shell.nodes.mass, sim.shell.nodes.n).astype(float)
    shell = mass @ runtime.get(sim.shell.nodes.v, sim.shell.nodes.n).astype(float)
    return shell + sim.fluid.p.one * runtime.get(sim.fluid.p.v, sim.fluid.p.n).astype(float).sum(axis=0)


@pytest.mark.parametrize("every", [None, pytest.param(2, marks=pytest.mark.long)])
def test_water_thrown_at_its_can_gives_it_its_momentum(every):
    sim = start(can(velocity=(30.0, 0, 10.0), every=every))
    before = momentum(sim)
    sim.advance(300)
    assert momentum(sim) == pytest.approx(before, rel=1e-12)
    assert np.linalg.norm(runtime.get(sim.shell.nodes.v, sim.shell.nodes.n).mean(axis=0)) > 0.5
    entries = sim.energies()
    assert entries["fluid viscous"] > 0
    assert abs(entries["contact"]) < 1e-3 * entries["injected"]  # pressure stops it before the pinballs do
    assert abs(entries["closed_residual_percent"]) < (0.5 if every is None else 2.0)
    assert sim.tracks()["leak"]["escaped_count"] == 0


@pytest.mark.long
def test_a_sound_can_at_rest_under_gravity_stays_so():
    sim = start(can(gravity=(0, 0, -9.81), held=True, duration=4e-2))
    sim.advance(8000)
    assert sim.tracks()["leak"]["escaped_count"] == 0
    # the lattice does not fit the round wall: the water settles a little, with a hundredth of the energy of its fall
    v = runtime.get(sim.fluid.p.v, sim.fluid.p.n)
    assert (v**2).sum(axis=1).mean() < 1e-2 * 2 * 9.81 * 0.2


@pytest.mark.long
@pytest.mark.parametrize("every", [None, 2])
def test_restart_is_exact_with_water_and_striker(every):
    bullet = Rigid(name="bullet", mass=0.03, pinballs=[Pinball(centre=(0.065, 0, 0.1), radius=0.009)], velocity=(-200.0, 0, 0))

    restarts_exactly(lambda: start(can(rigids=[bullet], duration=2e-4, every=every)), 61, 60)  # in the midst of two


@pytest.mark.long
def test_the_number_of_threads_changes_nothing():
    threads_change_nothing(lambda threads: start(can(velocity=(3.0, 0, 1.0)), threads=threads), 100)


def test_an_overfilled_can_is_refused():
    from taichi_sph.errors import SceneError

    with pytest.raises(SceneError, match="level 0.3 m lies outside the shell 'can'"):
        start(can(level=0.3))


def test_the_gauge_counts_what_has_left_and_nothing_else():
    """Particles put outside by hand, and one behind a wall that is bent inwards or outwards."""
    sim = start(can())
    x = runtime.get(sim.fluid.p.x, sim.fluid.p.n)
    gone = np.argsort(x[:, 0])[-3:]
    x[gone, 0] += 0.02
    runtime.put(sim.fluid.p.x, x)
    row = sim.leak.look(sim.time)
    assert row["escaped_count"] == 3
    assert row["escaped_mass"] == pytest.approx(3 * sim.fluid.p.one)
    # the wall comes in past the outermost particles beside it: they stand on its outer side, but within the tank as it was
    sim = start(can())
    u = np.zeros((sim.shell.nodes.n, 3))
    wall = (sim.shell.mesh.points[:, 0] > 0.04) & (np.abs(sim.shell.mesh.points[:, 2] - 0.1) < 0.05)
    u[wall, 0] = -0.02
    runtime.put(sim.shell.nodes.u, u)
    assert sim.leak.look(sim.time)["escaped_count"] == 0
    # and a bulge: water that follows it outwards is still inside
    sim = start(can())
    u[wall, 0] = 0.02
    runtime.put(sim.shell.nodes.u, u)
    x = runtime.get(sim.fluid.p.x, sim.fluid.p.n)
    follow = (x[:, 0] > 0.03) & (np.abs(x[:, 2] - 0.1) < 0.03) & (np.abs(x[:, 1]) < 0.01)
    x[follow, 0] += 0.015
    runtime.put(sim.fluid.p.x, x)
    assert follow.any() and sim.leak.look(sim.time)["escaped_count"] == 0


def test_water_that_is_put_in_another_order_keeps_its_pairs():
    """What particles may touch goes with them: the pairs of a step that sorts are those of the step before, by the particles' numbers."""
    sim = start(can(velocity=(30.0, 0, 10.0)))
    contact = next(c for c in sim.couplings if hasattr(c, "contact")).contact
    pairs, fluid = contact.pairs, sim.fluid

    def listed():
        ball, other = runtime.get(pairs.ball, pairs.n), runtime.get(pairs.other, pairs.n)
        water = ball < fluid.p.n
        return set(zip(runtime.get(fluid.p.id, fluid.p.n)[ball[water]].tolist(), other[water].tolist()))

    sim.advance(20)
    kept = 0
    while kept < 2 and sim.step < 300:
        sorts, before, travelled = fluid.sorts, listed(), runtime.get(contact.travelled, pairs.port.n_bodies).max()
        sim.advance(1)
        if fluid.sorts > sorts and runtime.get(contact.travelled, pairs.port.n_bodies).max() > travelled:  # and there was no search
            assert before and listed() == before
            kept += 1
    assert kept == 2
