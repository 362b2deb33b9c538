"""What acts from outside, in motion: histories give their impulse, a region its pressure, a rotation its energy."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.scene import (
    Box,
    Friedlander,
    HalfSine,
    InitialVelocity,
    NodalForce,
    PrescribedVelocity,
    Rotation,
    SurfacePressure,
    TimePulse,
    TimeTable,
)
from taichi_sph.scene.histories import factor, impulse

from ..plates import SIDE, mass, plate_scene, start, velocity
from ..shells import of_nodes, shell_scene
from ..shells import start as start_shell


def test_histories_give_their_impulse():
    """A free plate takes up what the forces' histories add up to; a driven edge follows its own."""
    table = TimeTable(points=((0, 0.5), (3e-6, 1.0), (9e-6, -0.5)))
    forces = [
        NodalForce(where=Box(lo=(0.3 * SIDE, None, None)), total=(40.0, 0, 0), history=HalfSine(duration=10e-6)),
        NodalForce(where=Box(), total=(0, 30.0, 0), history=table),
    ]
    sim = start(plate_scene(forces=forces, duration=1e-3))
    while sim.time < 14e-6:
        sim.advance(5)
    momentum = mass(sim) @ velocity(sim)
    end = sim.time - 0.5 * sim.dt  # of the velocities
    expected = np.array([40.0 * impulse(forces[0].history.points), 30.0 * (impulse(table.points) - 0.5 * (end - 9e-6))])
    assert momentum == pytest.approx(expected, rel=0.005)
    driven = TimePulse(rise=2e-6, hold=2e-6, fall=4e-6)
    motion = PrescribedVelocity(where=Box(hi=(1e-6, None, None)), velocity=(3.0, None, None), history=driven)
    sim = start(plate_scene(motions=[motion], duration=1e-3))
    edge = runtime.get(sim.shell.nodes.X, sim.shell.nodes.n)[:, 0] < 1e-6
    for _ in range(12):
        sim.advance(4)
        half = sim.time - 0.5 * sim.dt
        assert velocity(sim)[edge, 0] == pytest.approx(
            np.full(edge.sum(), 3.0 * factor(driven.points, half)), abs=1e-9 + 3.0 * sim.dt / 2e-6
        )


def test_pressure_on_a_region_and_a_rotation():
    """Half of a plate under a blast: its impulse. A rotation's energy is that of a rigid body, directors included, and stays."""
    blast = Friedlander(positive=2e-4, decay=1.0)
    pressure = SurfacePressure(value=1e5, kind="dead", where=Box(lo=(0.5, None, None)), history=blast)
    sim = start_shell(shell_scene(irregularity=0.0, pressures=[pressure], initial=[], duration=1e-2))
    sim.advance(5)
    kicks = [factor(blast.points, n * sim.dt) * sim.dt * (0.5 if n == 0 else 1.0) for n in range(5)]
    wanted = 1e5 * 0.5 * sum(kicks)
    assert (of_nodes(sim, "mass") @ of_nodes(sim, "v"))[2] == pytest.approx(wanted, rel=1e-9)
    turn = InitialVelocity(rotation=Rotation(axis=(0, 1, 0), rate=50.0, centre=(0.5, 0.5, 0)))
    sim = start_shell(shell_scene(irregularity=0.0, initial=[turn], duration=1e-2))
    sim.advance(1)
    X, m = of_nodes(sim, "X") - [0.5, 0.5, 0], of_nodes(sim, "mass")
    energy = 0.5 * 50.0**2 * (m @ X[:, 0] ** 2 + of_nodes(sim, "inertia").sum())
    assert sim.energies()["injected"] == pytest.approx(energy, rel=1e-3)
    sim.advance(200)
    after = sim.energies()
    assert after["elastic"] < 0.01 * energy and abs(after["closed_residual_percent"]) < 0.01
