"""What supports bear: the load in equilibrium, the change of momentum in motion, the same after a restart and at longer steps."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.scene import Box, NodalForce, Plate, PrescribedVelocity, Static, SurfacePressure, TimeTable

from ..exact import restarts_exactly, threads_change_nothing
from ..shells import of_nodes, shell_scene, start

CLAMP = {"velocity": (0, 0, 0), "spin": (0, 0, 0)}


def forces(world, k: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """(3,) force [N] and (3,) moment [N m] of a support."""
    row = world.tracks()[f"support_{k}"]
    return np.array([row["fx"], row["fy"], row["fz"]]), np.array([row["mx"], row["my"], row["mz"]])


def test_a_clamped_plate_hands_its_pressure_to_its_clamps():
    """A plate of 1 m under 1 kPa, two edges clamped: each bears half, and the moments of a beam, p L^2 / 12."""
    ends = [
        PrescribedVelocity(where=Box(hi=(1e-6, None, None)), **CLAMP),
        PrescribedVelocity(where=Box(lo=(1 - 1e-6, None, None)), **CLAMP),
    ]
    said = shell_scene(
        irregularity=0.0,
        motions=ends,
        pressures=[SurfacePressure(value=1e3)],
        static=Static(residual=1e-7),
        duration=1.0,
        material={"poisson": 0.0},
    )
    world = start(said)
    world.advance(1)
    (one, turn), (other, back) = forces(world, 1), forces(world, 2)
    assert one + other == pytest.approx([0, 0, -1e3], abs=2e-3)
    assert one == pytest.approx([one[0], 0, -500], abs=2e-3) and one[0] == pytest.approx(-other[0])
    assert turn[1] == pytest.approx(-back[1], rel=1e-6) and abs(turn[1]) == pytest.approx(1e3 / 12, rel=0.02)


def test_a_cantilever_bears_its_tip():
    """Force F, moment F L about the clamp: to the residual."""
    said = shell_scene(
        Plate(length=1.0, width=0.25),
        irregularity=0.25,
        motions=[PrescribedVelocity(where=Box(hi=(1e-6, None, None)), **CLAMP)],
        forces=[NodalForce(where=Box(lo=(1 - 1e-6, None, None)), total=(3.0, 2.0, 1.0))],
        static=Static(residual=1e-8),
        duration=1.0,
    )
    world = start(said)
    world.advance(1)
    force, moment = forces(world)
    assert force == pytest.approx([-3, -2, -1], abs=1e-6)
    # shared by area; the tip has gone down a little, where the force along the plate pulls at it
    X, share = of_nodes(world, "X"), of_nodes(world, "mass")
    share *= X[:, 0] > 1 - 1e-6
    arm = share @ (X + of_nodes(world, "u")) / share.sum() - X[X[:, 0] < 1e-6].mean(axis=0)
    assert moment == pytest.approx(-np.cross(arm, [3, 2, 1]), abs=2e-6)


def driven(every: int = 1):
    """A free plate that an edge draws along, faster and faster, aslant."""
    motion = PrescribedVelocity(
        where=Box(hi=(1e-6, None, None)),
        velocity=(2.0, None, 1.0),
        spin=(None, 0, None),
        history=TimeTable(points=((0, 0), (1e-3, 1), (2e-3, 0.4))),
    )
    said = shell_scene(irregularity=0.0, motions=[motion], duration=2e-3)
    return said if every == 1 else said.model_copy(update={"shells": [said.shells[0].model_copy(update={"every": every})]})


@pytest.mark.parametrize("every", [1, pytest.param(2, marks=pytest.mark.long)])
def test_a_drive_gives_the_momentum(every):
    """Nothing else acts: force times time is the change of the momentum, step by step."""
    world = start(driven(every))
    mass = of_nodes(world, "mass")
    before = mass @ of_nodes(world, "v")
    for n in range(6):
        world.advance(every)
        after = mass @ of_nodes(world, "v")
        kick = world.dt * every * (0.5 if n == 0 and every == 1 else 1.0)
        if n or every == 1:
            assert forces(world)[0] * kick == pytest.approx(after - before, rel=1e-9, abs=1e-9 * np.abs(after).max())
        before = after
    assert np.abs(forces(world)[0]).max() > 1


@pytest.mark.long
def test_bits_of_supports():
    restarts_exactly(lambda: start(driven()), 10, 10)
    threads_change_nothing(lambda n: start(driven(), threads=n), 10)


def test_a_support_without_nodes_bears_nothing():
    said = shell_scene(irregularity=0.0, motions=[PrescribedVelocity(where=Box(lo=(5, None, None)), **CLAMP)])
    world = start(said)
    world.advance(1)
    assert forces(world)[0] == pytest.approx(0) and len(runtime.get(world.shell.loads.supports.force, 1)) == 1
