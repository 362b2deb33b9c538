"""Densities that follow the divergence of both ends of a step: by hand, and what a bullet that ploughs through water leaves open."""

import math

import numpy as np
import pytest

from taichi_sph.errors import SceneError
from taichi_sph.scene import Fluid, FluidBox, Material, Numerics, Pinball, Plate, Rigid, Scene, Shell

from .bodies import SPACING, body, by_id, put, rates

WATER = {"fill": FluidBox(lo=(-0.08, -0.04, -0.04), hi=(0.0, 0.04, 0.04)), "delta": 0.0}

STEEL = Material(name="steel", young=210e9, poisson=0.3, density=7800)
BESIDE = Shell(  # its steps are those of the clock
    name="plate", surface=Plate(length=0.06, width=0.06, origin=(0, 0, 0.5)), thickness=1e-3, material=STEEL, motion="free"
)


@pytest.mark.parametrize("divergence", [None, "mean"])
def test_two_particles_by_hand(divergence):
    """They close at 500 m/s and have come a twentieth of a spacing nearer in the step: 6 % of G x."""
    x, v, dt = SPACING * np.array([1.1, 0.1, 0.0]), np.array([-500.0, 50.0, 0.0]), 1e-6
    b = body([[0, 0, 0], x.tolist()], divergence=divergence)
    put(b, "v", np.array([[0.0, 0, 0], v]))
    rates(b, dt, dt)
    h = 1.165 * SPACING

    def approach(at: np.ndarray) -> float:
        """-V G v.x at a distance."""
        r = np.linalg.norm(at)
        return SPACING**3 * 21 / (16 * math.pi * h**5) * 5 * (1 - r / (2 * h)) ** 3 * float(v @ at)

    now, before = approach(x), approach(x - dt * v)
    assert abs(before / now - 1) > 0.05
    assert by_id(b, "s") == pytest.approx(-dt * (now if divergence is None else 0.5 * (now + before)), rel=1e-9)


def opened(divergence: str | None, every: int | None = None) -> float:
    """What a ball of 31 g that has gone 40 mm into a block of water at 500 m/s leaves open, over its energy."""
    from taichi_sph.world.world import World

    ball = Rigid(name="ball", mass=0.031, pinballs=[Pinball(centre=(0.0101, 0.001, 0.002), radius=0.01)], velocity=(-500.0, 0, 0))
    water = Fluid(name="water", divergence=divergence, every=every, **WATER)
    scene = Scene(
        name="shot",
        title="a ball shot into water",
        source="tests",
        shells=[BESIDE] if every else [],
        rigids=[ball],
        fluids=[water],
        duration=8e-5,
        numerics=Numerics(spacing=SPACING, time_step_safety=0.75),
    )
    sim = World(scene, threads=1)
    sim.advance_to(scene.duration)
    booked = sim.energies()
    assert booked["kinetic"] < 0.95 * booked["injected"] and booked["elastic"] > 0
    return booked["closed_residual_percent"]


@pytest.mark.parametrize("every, least", [(None, 0.1), (2, 0.2)])
def test_a_bullet_in_water_makes_no_energy(every, least):
    """Of first order in dt by the divergence at the end of the step, of second order by that of both ends; also where the water takes one
    step in two of the bullet's."""
    end, both = opened(None, every), opened("mean", every)
    print(f"every {every}: {end:.3f} and {both:.3f} % open")
    assert end > 0.5
    assert abs(both) < least * end


def test_fluids_that_meet_follow_one_divergence():
    one, other = Fluid(name="one", **WATER), Fluid(name="other", divergence="mean", fill=FluidBox(lo=(0, 0, 0), hi=(0.04, 0.04, 0.04)))
    with pytest.raises((SceneError, ValueError), match="divergence is not that of 'one'"):
        Scene(name="two", title="two", source="tests", fluids=[one, other], duration=1e-3, numerics=Numerics(spacing=SPACING))
