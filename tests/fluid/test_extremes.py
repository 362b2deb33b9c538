"""The ends of what can be asked of water: one particle, none, too much, far too fast."""

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.errors import RunStopped, SceneError
from taichi_sph.scene import Cylinder, Fluid, FluidBox, Material, Numerics, Pinball, Rigid, Scene, Shell, ShellFill, Wall, Water

STEEL = Material(name="steel", young=210e9, poisson=0.3, density=7800.0)
G = 9.81


def start(scene: Scene):
    from taichi_sph.world.world import World

    return World(scene)


def boxed(hi, **more) -> Scene:
    values = {
        "name": "drop", "title": "a drop", "source": "tests", "duration": 0.1, "numerics": Numerics(spacing=0.01),
        "fluids": [Fluid(name="water", fill=FluidBox(lo=(0, 0, 0), hi=hi), water=Water(sound=20))],
    }  # fmt: skip
    return Scene(**{**values, **more})


def can(level=None, bullet: float | None = None, young=210e9, **more) -> Scene:
    """A small can of water, and a bullet at so many m/s."""
    ball = Pinball(centre=(0.041, 0, 0.04), radius=0.01)
    return Scene(
        name="can",
        title="a can",
        source="tests",
        shells=[Shell(name="can", surface=Cylinder(radius=0.03, length=0.08, ends="discs"), thickness=1e-3, material=STEEL, motion="free")],
        fluids=[Fluid(name="water", fill=ShellFill(shell="can", level=level), **more)],
        rigids=[Rigid(name="bullet", mass=0.03, pinballs=[ball], velocity=(-bullet, 0, 0))] if bullet else [],
        duration=1e-3,
        numerics=Numerics(spacing=0.01),
    )


@pytest.mark.long
def test_one_particle_falls_and_stays_above_the_floor():
    floor = [Wall(point=(0, 0, -0.02), normal=(0, 0, 1))]
    fine = Numerics(spacing=0.01, time_step_safety=0.1)  # what is left falls as the step
    sim = start(boxed((0.01, 0.01, 0.01), walls=floor, gravity=(0, 0, -G), numerics=fine))
    assert sim.n_nodes == 1
    sim.advance_to(0.05)
    fall = 0.5 * G * sim.time**2
    assert runtime.get(sim.fluid.p.x, 1)[0, 2] == pytest.approx(0.005 - fall, abs=1e-5)
    lowest = 1.0
    while sim.time < 0.1:  # it bounces off its own image, which it compresses
        sim.advance(10)
        lowest = min(lowest, runtime.get(sim.fluid.p.x, 1)[0, 2])
    assert -0.015 - 1e-9 < lowest < -0.005
    e = sim.energies()
    left = e["kinetic"] + e["elastic"] + e["fluid viscous"] + e["lag"] - e["external"] - e["injected"]
    assert abs(left) < 0.01 * sim.fluid.p.one * G * 0.02  # of the energy of its fall


@pytest.mark.parametrize(
    "level, said",
    [(0.0, "level 0 m lies outside the shell 'can'"), (0.081, "level 0.081 m lies outside"), (0.003, "no particle of 0.01 m fits")],
)
@pytest.mark.long
def test_dry_and_overfilled_tanks_are_refused(level, said):
    with pytest.raises(SceneError, match=said):
        start(can(level))


@pytest.mark.long
@pytest.mark.parametrize("speed", [100.0, 500.0, 1500.0])
def test_an_impact_runs_or_is_stopped_with_a_sentence(speed):
    """From a tap to faster than sound."""
    sim = start(can(bullet=speed))
    try:
        for _ in range(12):
            sim.advance(20)
    except RunStopped as stopped:
        assert "likely" in str(stopped)
        print(stopped)
    else:
        entries = sim.energies()
        print(entries)
        assert all(np.isfinite(v) for v in entries.values()) and abs(entries["closed_residual_percent"]) < 5
        assert runtime.get(sim.rigids.v, 1)[0, 0] > -speed  # it met something


@pytest.mark.long
def test_the_watchdog_names_the_particle():
    sim = start(boxed((0.03, 0.03, 0.03)))
    sim.advance(2)
    v = runtime.get(sim.fluid.p.v, sim.fluid.p.n)
    v[5] = [70.0, 0, 0]
    runtime.put(sim.fluid.p.v, v)
    with pytest.raises(
        RunStopped,
        match=r"fluid 'water': particle \d+ at \(.*\) mm moves at .* m/s at t = .* beyond 3 times the sound speed 20 m/s; the impact",
    ):
        sim.look()
    v[5] = np.nan
    runtime.put(sim.fluid.p.v, v)
    with pytest.raises(RunStopped, match="moves at nan m/s"):
        sim.look()
