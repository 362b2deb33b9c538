"""Several shells and strikers: they meet like any two bodies, as the table of meetings says, and no part follows from one far away."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.errors import RunStopped, SceneError
from taichi_sph.scene import Cylinder, Fluid, InitialVelocity, Material, Meeting, Numerics, Pinball, Plate, Rigid, Scene, Shell, ShellFill
from taichi_sph.world.world import World

STEEL = Material(name="steel", young=210e9, poisson=0.3, density=7800.0)
THICKNESS, D = 0.8e-3, 1e-3
SPEED = 20.0


def plate(name, z, x=0.0, n=6, thickness=THICKNESS, every=None):
    surface = Plate(length=n * D, width=n * D, origin=(x, 0, z))
    return Shell(name=name, surface=surface, thickness=thickness, material=STEEL, motion="free", every=every)


def ball(name, centre, velocity, radius=2e-3):
    return Rigid(name=name, mass=1e-3, pinballs=[Pinball(centre=centre, radius=radius)], velocity=velocity)


def start(shells, speeds, rigids=(), threads=None, spacing=D, **more):
    initial = [InitialVelocity(body=name, velocity=(0, 0, v)) for name, v in speeds.items() if v]
    scene = Scene(
        name="several", title="t", source="tests", shells=shells, rigids=rigids, initial=initial, duration=150e-6,
        numerics=Numerics(spacing=spacing, irregularity=0), **more,
    )  # fmt: skip
    return World(scene, threads=threads)


def of(sim, name, field):
    """Rows of a field of the shell's nodes."""
    for group in sim.groups:
        for span in group.bodies:
            if span.name == name:
                return runtime.get(getattr(group.nodes, field), group.nodes.n)[span.first : span.first + span.n].astype(float)
    raise KeyError(name)


def momentum(sim):
    shells = [span.name for group in sim.groups if group.kind == "shell" for span in group.bodies]
    total = sum(of(sim, name, "mass") @ of(sim, name, "v") for name in shells)
    if sim.rigids is not None:
        total = total + runtime.get(sim.rigids.mass, sim.rigids.n) @ runtime.get(sim.rigids.v, sim.rigids.n)
    return total


@pytest.mark.parametrize(
    ("e", "thicker", "every"), [(None, 1, None), (1.0, 1, None), (0.5, 2, None), pytest.param(1.0, 1, 2, marks=pytest.mark.long)]
)
def test_a_plate_thrown_flat_at_a_plate(e, thicker, every):
    """As bars in one dimension: what does not bounce takes the common speed, equal plates of restitution 1 exchange theirs. every: steps
    of the clock between two of the upper plate's own, which then stands in another group."""
    meetings = [] if e is None else [Meeting(between=("low", "high"), restitution=e)]
    gap = 0.5 * THICKNESS * (1 + thicker) + 0.05e-3
    sim = start([plate("low", 0.0), plate("high", gap, thickness=thicker * THICKNESS, every=every)], {"high": -SPEED}, meetings=meetings)
    before = momentum(sim)
    sim.advance_to(8e-6)
    m, M, e = of(sim, "low", "mass").sum(), of(sim, "high", "mass").sum(), e or 0.0
    low, high = (of(sim, name, "v")[:, 2] for name in ("low", "high"))
    common = -SPEED * M / (m + M)
    assert low == pytest.approx(np.full(len(low), common * (1 + e)), rel=1e-3)
    assert high == pytest.approx(np.full(len(high), common + e * SPEED * m / (m + M)), rel=1e-3, abs=1e-3 * SPEED)
    assert momentum(sim) == pytest.approx(before, rel=1e-12, abs=1e-15)
    entries = sim.energies()
    loss = 0.5 * m * M / (m + M) * SPEED**2 * (1 - e**2)
    assert entries["contact"] == pytest.approx(loss, rel=1e-3, abs=1e-3 * entries["injected"])
    assert abs(entries["B_percent"]) < 1e-3
    gap = (of(sim, "high", "u")[:, 2] + gap) - of(sim, "low", "u")[:, 2]
    assert gap.min() > 0.5 * THICKNESS * (1 + thicker) * (1 - 1e-3)


@pytest.mark.long
def test_a_small_plate_falls_aslant_on_a_large_one():
    """Beside the border of the upper one its nodes meet the lower one's discs, and the other way round: no node passes."""
    sim = start([plate("low", 0.0, n=10), plate("high", THICKNESS + 0.05e-3, x=2.5e-3, n=4)], {"high": -3 * SPEED})
    before = momentum(sim)
    sim.advance_to(40e-6)
    assert momentum(sim) == pytest.approx(before, rel=1e-11, abs=1e-15)
    assert np.ptp(of(sim, "low", "u")[:, 2]) > 0.05e-3
    assert sim.contact.penetration < 0.02 * THICKNESS
    assert abs(sim.energies()["B_percent"]) < 0.1


def test_plates_that_may_not_meet_pass_through_each_other():
    shells = [plate("low", 0.0), plate("high", THICKNESS + 0.05e-3)]
    sim = start(shells, {"high": -SPEED}, meetings=[Meeting(between=("low", "high"), meet=False)])
    assert sim.contact is None
    sim.advance_to(8e-6)
    assert of(sim, "high", "v")[:, 2] == pytest.approx(np.full(49, -SPEED), rel=1e-9)


def test_a_ball_bounces_off_a_plate_as_the_table_says():
    """A light free plate of one cell, struck in its middle: Newton's restitution between its nodes and the ball."""
    side = 4e-3
    centres = [(x, y, 2e-3 + 0.5 * THICKNESS + 30e-6) for x in (0.0, side) for y in (0.0, side)]
    striker = Rigid(name="ball", mass=0.01, pinballs=[Pinball(centre=c, radius=2e-3) for c in centres], velocity=(0, 0, -10.0))
    shell = Shell(name="plate", surface=Plate(length=side, width=side), thickness=THICKNESS, material=STEEL, motion="free")
    sim = start([shell], {}, [striker], spacing=side, meetings=[Meeting(between=("ball", "plate"), restitution=1.0)])
    sim.advance_to(3e-6 + 3 * sim.dt)
    m, M = side**2 * THICKNESS * 7800.0, 0.01
    assert of(sim, "plate", "v")[:, 2] == pytest.approx(np.full(4, -10.0 * 2 * M / (m + M)), rel=1e-4)
    assert runtime.get(sim.rigids.v, 1)[0, 2] == pytest.approx(-10.0 * (M - m) / (m + M), rel=1e-5)
    assert abs(sim.energies()["contact"]) < 1e-3 * 0.5 * M * 100.0


@pytest.mark.long
def test_a_shell_inside_a_shell_stays_inside():
    """A cylinder flies across in a wider one and gives it its momentum."""
    d = 2.5e-3
    outer = Shell(name="outer", surface=Cylinder(radius=12e-3, length=10e-3), thickness=1e-3, material=STEEL, motion="free")
    inner = Shell(
        name="inner", surface=Cylinder(radius=8e-3, length=5e-3, origin=(0, 0, 2.5e-3)), thickness=1e-3, material=STEEL, motion="free"
    )
    scene = Scene(
        name="in", title="t", source="tests", shells=[outer, inner], duration=300e-6, numerics=Numerics(spacing=d),
        initial=[InitialVelocity(body="inner", velocity=(60.0, 0, 0))],
    )  # fmt: skip
    sim = World(scene)
    before = momentum(sim)
    sim.advance_to(200e-6)
    assert momentum(sim) == pytest.approx(before, rel=1e-11, abs=1e-15)
    assert of(sim, "outer", "v")[:, 0].mean() > 10.0
    frames = {body.name: body.points for body in sim.frame().bodies}
    middle = frames["outer"][:, :2].mean(axis=0)
    assert np.linalg.norm(frames["inner"][:, :2] - middle, axis=1).max() < 12e-3
    assert sim.contact.penetration < 0.2e-3  # the discs are wide, and their rims swing as the directors turn
    assert abs(sim.energies()["B_percent"]) < 0.2


def pair_of_hits(far):
    """A plate and its striker at 0, and `far` away another pair; None: without the other."""
    shells, rigids = [plate("one", 0.0)], [ball("first", (3e-3, 2.5e-3, 2.5e-3), (0, 0, -100.0))]
    if far is not None:
        shells.append(plate("two", 0.0, x=far))
        rigids.append(ball("second", (far + 2e-3, 3e-3, 2.45e-3), (0, 0, -170.0)))
    return shells, rigids


@pytest.mark.long
def test_a_part_does_not_follow_from_another_far_away():
    """Bit for bit: a plate hit by its ball, alone and beside another plate that another ball hits earlier and harder."""
    kept, dt = {}, None
    for far in (0.1, None):
        shells, rigids = pair_of_hits(far)
        sim = start(shells, {}, rigids)
        dt = sim.dt = dt or sim.dt
        sim.advance(300)
        kept[far] = [of(sim, "one", field) for field in ("u", "v", "d", "omega")] + [runtime.get(sim.rigids.v, 1)[0]]
        if far is not None:
            assert (of(sim, "two", "v")[:, 2] < -10.0).any()
    assert np.abs(kept[None][0][:, 2]).max() > 1e-5
    for mine, alone in zip(kept[0.1], kept[None], strict=True):
        assert np.array_equal(mine, alone)


def four(threads=None):
    shells, rigids = [plate("low", 0.0), plate("high", 2.4e-3)], []
    for k, name in enumerate(("first", "second")):
        rigids.append(ball(name, ((1 + 3 * k) * 1e-3, 3e-3, 2.4e-3 + 1.65e-3), (0, 0, -150.0 - 20 * k), radius=1.2e-3))
    return start(shells, {"low": 60.0}, rigids, threads)


def test_restart_is_exact_with_two_shells_and_two_strikers():
    whole = four()
    whole.advance(150)
    half = {k: np.copy(v) for k, v in whole.state().items()}
    whole.advance(150)
    end = whole.state()
    assert whole.contact.solves > 100
    again = four()
    again.restore(half)
    again.advance(150)
    for name, value in again.state().items():
        assert np.array_equal(value, end[name], equal_nan=True), name


@pytest.mark.long
def test_the_number_of_threads_changes_nothing():
    states = []
    for threads in (1, 2):
        sim = four(threads)
        sim.advance(200)
        states.append(sim.state())
    for name, value in states[0].items():
        assert np.array_equal(value, states[1][name], equal_nan=True), name


def test_a_list_without_room_says_so():
    sim = four()
    sim.contact.pairs.capacity = 5
    with pytest.raises(RunStopped, match="pairs of pinballs are near each other and 5 have room"):
        sim.advance(300)


def test_shells_that_start_in_each_other_are_refused_by_name():
    with pytest.raises(SceneError, match="shell 'low' starts 0.3 mm inside shell 'high'|shell 'high' starts 0.3 mm inside shell 'low'"):
        start([plate("low", 0.0), plate("high", 0.5e-3)], {})


@pytest.mark.long
def test_a_baffle_in_a_filled_can():
    """The can's water, thrown along, carries the plate that stands across it: all momentum stays, and no water crosses the plate."""
    can = Shell(name="can", surface=Cylinder(radius=0.05, length=0.1, ends="discs"), thickness=1e-3, material=STEEL, motion="free")
    across = Plate(length=0.06, width=0.06, origin=(-0.03, -0.03, 0.05))
    baffle = Shell(name="baffle", surface=across, thickness=1e-3, material=STEEL, motion="free")
    water = Fluid(name="water", fill=ShellFill(shell="can"), velocity=(0.0, 0.0, 2.0))
    sim = start([can, baffle], {}, fluids=[water], spacing=8e-3)
    f = sim.fluid
    inside = (np.abs(f.points[:, :2]) < 0.02).all(axis=1)

    def total():
        return momentum(sim)[2] + float(runtime.get(f.p.mass, f.p.n) @ runtime.get(f.p.v, f.p.n)[:, 2])

    def above():
        heights = runtime.get(f.p.x, f.p.n)[f.numbered()][inside, 2]
        return np.sign(heights - 0.05 - of(sim, "baffle", "u")[:, 2].mean())

    sides, before = above(), total()
    sim.advance_to(1e-3)
    assert total() == pytest.approx(before, rel=1e-6)
    assert of(sim, "baffle", "u")[:, 2].mean() > 2e-4 and (above() == sides).all()
    assert abs(sim.energies()["closed_residual_percent"]) < 2.0
