"""The dissipation that vanishes at low Mach number: by hand, and what it takes from a flow at two speeds of sound."""

import math

import numpy as np
import pytest
from pydantic import ValidationError

from taichi_sph.bodies.fluid.columns import STIFFNESS
from taichi_sph.bodies.fluid.said import Fluid, FluidBox, Water

from .bodies import SPACING, body, by_id, lattice, put, rates, run, unbalanced


@pytest.mark.parametrize("closing", [2.0, 2000.0])
def test_two_particles_by_hand(closing):
    """u below c/3: 3 rho u^2; above: rho c u, the stress of a Riemann problem."""
    b = body([[0, 0, 0], [1.2 * SPACING, 0, 0]], dissipation="riemann")
    put(b, "s", np.array([1e6, 1e6]) / b.constants[0, STIFFNESS])
    put(b, "v", np.array([[0.5 * closing, 0, 0], [-0.5 * closing, 0, 0]]))
    rates(b, 0.0, 1e-9)
    D = SPACING * (1 + 1e6 / b.constants[0, STIFFNESS]) ** (-1 / 3)
    h, r = 1.165 * D, 1.2 * SPACING
    slope = -21 / (16 * math.pi * h**4) * 5 * (r / h) * (1 - r / (2 * h)) ** 3  # W'
    stress = 2e6 + 1000 * closing * min(1450.0, 3 * closing)
    assert by_id(b, "force")[0] == pytest.approx([D**6 * stress * slope, 0, 0], rel=1e-5)


def loss(sound: float, **said) -> float:
    """Energy that viscosity has taken from a shear flow while it moves by a spacing, over what it had."""
    points = lattice((8, 8, 8))
    b = body(points, water=Water(sound=sound, tension=None), **said)
    v = np.zeros_like(points)
    v[:, 0] = np.sin(2 * np.pi * points[:, 1] / (8 * SPACING))
    put(b, "v", v)
    b.injected = b.stored() + 0.5 * float(b.p.masses[0]) * float((v**2).sum())
    dt = 0.4 * SPACING / (sound + 1.0)
    run(b, dt, math.ceil(SPACING / dt))
    assert abs(unbalanced(b)) < 2e-3
    return b.energies()["viscous"] / b.injected


def test_what_it_takes_does_not_grow_with_the_speed_of_sound():
    """Four times the speed of sound: viscosity takes about four times as much, the Riemann stress the same."""
    slow, fast = (loss(sound, dissipation="riemann") for sound in (20.0, 80.0))
    before, after = (loss(sound, alpha=0.1) for sound in (20.0, 80.0))
    assert after > 2.0 * before
    assert 0.5 * slow < fast < 1.3 * slow


def test_one_dissipation_at_a_time():
    with pytest.raises(ValidationError, match="alpha is of artificial viscosity"):
        Fluid(name="water", fill=FluidBox(lo=(0, 0, 0), hi=(1, 1, 1)), dissipation="riemann", alpha=0.02)
