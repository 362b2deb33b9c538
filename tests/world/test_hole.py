"""A plate with a round hole in tension, against Kirsch's stresses in a plate without end (1898; Timoshenko and Goodier, 35)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from taichi_sph.scene import Box, HoleIn, Material, NodalForce, Numerics, Plate, Scene, Shell, Static
from taichi_sph.world.world import World

D, THICKNESS, PULL, YOUNG, POISSON = 1e-3, 1e-3, 1e6, 70e9, 0.3


def kirsch(x: np.ndarray, y: np.ndarray, a: float) -> np.ndarray:
    """(N, 2, 2) stress over that pulled along x, around a hole of radius a at the origin."""
    r2 = x * x + y * y
    c, s, q = x / np.sqrt(r2), y / np.sqrt(r2), a * a / r2
    twice, across = c * c - s * s, 2 * s * c
    radial = 0.5 * (1 - q) + 0.5 * (1 - 4 * q + 3 * q * q) * twice
    hoop = 0.5 * (1 + q) - 0.5 * (1 + 3 * q * q) * twice
    shear = -0.5 * (1 + 2 * q - 3 * q * q) * across
    polar = np.stack([np.stack([radial, shear], -1), np.stack([shear, hoop], -1)], -2)
    turn = np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)
    return turn @ polar @ turn.transpose(0, 2, 1)


def off(side: int, across: int) -> tuple[float, float]:
    """Of a square plate of `side` spacings with a hole `across` of them: root mean square of sigma_xx less Kirsch's within three radii, and
    the largest difference of any component there, over the stress that is pulled."""
    length, a = side * D, 0.5 * across * D
    plate = Plate(length=length, width=length, origin=(-length / 2, -length / 2, 0), holes=[HoleIn(centre=(0, 0, 0), radius=a)])
    metal = Material(name="metal", young=YOUNG, poisson=POISSON, density=2700)
    total, end = PULL * length * THICKNESS, length / 2 - 0.6 * D
    world = World(
        Scene(
            name="hole",
            title="A hole in tension",
            source="Kirsch 1898",
            duration=1.0,
            shells=[Shell(name="plate", surface=plate, thickness=THICKNESS, motion="in_plane", material=metal)],
            forces=[
                NodalForce(where=Box(lo=(end, None, None)), total=(total, 0, 0)),
                NodalForce(where=Box(hi=(-end, None, None)), total=(-total, 0, 0)),
            ],
            static=Static(residual=1e-4),
            numerics=Numerics(spacing=D, cells="quad"),
        )
    )
    world.advance(1)
    strain, mesh = world.frame().bodies[0].cell_data["strain"], world.shell.mesh
    k = YOUNG / (1 - POISSON**2)
    own = np.empty((len(strain), 2, 2))
    own[:, 0, 0], own[:, 1, 1] = k * (strain[:, 0] + POISSON * strain[:, 1]), k * (strain[:, 1] + POISSON * strain[:, 0])
    own[:, 0, 1] = own[:, 1, 0] = 0.5 * k * (1 - POISSON) * strain[:, 2]
    frame = mesh.frames[:, :2, :2]
    x, y = mesh.centres[:, 0], mesh.centres[:, 1]
    near = np.hypot(x, y) < 3 * a
    error = (frame.transpose(0, 2, 1) @ own @ frame / PULL - kirsch(x, y, a))[near]
    return math.sqrt((error[:, 0, 0] ** 2).mean()), float(np.abs(error).max())


@pytest.mark.long
def test_a_hole_ten_spacings_across():
    """In a plate six times as wide as its hole, which Kirsch's plate is not: most of the mean is that (docs/shapes.md)."""
    mean, largest = off(60, 10)
    assert mean < 0.072 and largest < 0.22


@pytest.mark.long
@pytest.mark.parametrize(("side", "across", "mean", "largest"), [(120, 10, 0.031, 0.19), (240, 20, 0.021, 0.125)])
def test_in_a_plate_twelve_times_as_wide(side, across, mean, largest):
    """The distance to Kirsch falls with the spacing."""
    found = off(side, across)
    assert found[0] < mean and found[1] < largest
