"""Finite elements in motion: the ledger closes, bits do not depend on restarts or threads, momentum and energy of a flight stay."""

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.scene import (
    Ball,
    Box,
    InitialVelocity,
    NodalForce,
    NodalMoment,
    Perfect,
    PrescribedVelocity,
    Ramp,
    SurfacePressure,
)

from ..exact import restarts_exactly, threads_change_nothing
from ..shells import of_nodes, shell_scene, spin, start

HELD = PrescribedVelocity(shell="shell", where=Box(hi=(1e-6, None, None)), velocity=(0, 0, 0), spin=(0, 0, 0))
LOADS = {
    "motions": [HELD],
    "forces": [NodalForce(shell="shell", where=Ball(centre=(1, 1, 0), radius=0.2), total=(0, 2e5, 1e5))],
    "moments": [NodalMoment(shell="shell", where=Box(lo=(0.99, None, None)), total=(0, 2e4, 0), history=Ramp(rise=2e-4))],
    "pressures": [
        SurfacePressure(shell="shell", value=1e6, history=Ramp(rise=1e-4)),
        SurfacePressure(shell="shell", value=-2e5, kind="dead"),
    ],
}


def scene_of(points: int = 4, cells: str = "quad", surface: str = "flat", **more):
    material = more.pop("material", None)
    plain = shell_scene(surface, cells=cells, n=4, thickness=0.03, material=material, **more)
    return plain.derive(**{"numerics.formulation": {"kind": "elements", "points": points}})


@pytest.mark.long
@pytest.mark.parametrize("points, cells", [(4, "quad"), (1, "quad"), (4, "triangle")])
def test_the_ledger_closes(points, cells):
    """Forces, moments, pressures that follow and dead ones, supports: a bent shell at finite rotations."""
    sim = start(scene_of(points, cells, duration=2e-2, **LOADS))
    sim.advance_to(1e-2)
    energies = sim.energies()
    assert np.abs(of_nodes(sim, "u")).max() > 0.05
    assert energies["kinetic"] > 0.05 * energies["external"] and energies["elastic"] > 0.05 * energies["external"]
    assert abs(energies["closed_residual_percent"]) < 1e-3


@pytest.mark.parametrize("points", [4, 1])
@pytest.mark.long
def test_restart_and_threads(points):
    """A metal, for it has the most history."""
    material = {"strength": Perfect(yield_stress=2e8)}
    restarts_exactly(lambda: start(scene_of(points, material=material, **LOADS)), 60, 60)
    threads_change_nothing(lambda threads: start(scene_of(points, material=material, **LOADS), threads=threads), 60)


def test_restart_of_four_points():
    restarts_exactly(lambda: start(scene_of(4, **LOADS)), 30, 30)


@pytest.mark.parametrize("points", [4, 1])
def test_a_turning_shell(points):
    """Half a turn of a curved shell that flies: momenta to rounding, energy to the second order of the step."""
    omega = np.array([300.0, 100.0, -200.0])
    sim = start(scene_of(points, surface="curved", duration=5e-2))
    spin(sim, omega, (3.0, -20.0, 5.0))
    mass = runtime.get(sim.shell.nodes.mass, sim.shell.nodes.n)
    inertia = runtime.get(sim.shell.nodes.inertia, sim.shell.nodes.n)

    def momenta():
        x, v = sim.shell.mesh.points + of_nodes(sim, "u"), of_nodes(sim, "v")
        return mass @ v, mass @ np.cross(x - 0.5 * sim.dt * v, v) + inertia @ of_nodes(sim, "omega")

    sim.advance(1)
    (p, turn), energy = momenta(), sim.energies()
    sim.advance_to(np.pi / np.linalg.norm(omega))
    (p_end, turn_end), end = momenta(), sim.energies()
    assert np.abs(p_end - p).max() < 1e-11 * np.abs(p).max()
    assert np.abs(turn_end - turn).max() < 1e-3 * np.abs(turn).max()
    assert abs(end["kinetic"] + end["elastic"] - energy["kinetic"] - energy["elastic"]) < 1e-3 * energy["kinetic"]


@pytest.mark.long
def test_single_precision():
    """The same motion to 1e-3; a flat plate in flight strains nothing."""
    ends = []
    for precision in ("f64", "f32"):
        sim = start(scene_of(precision=precision, duration=2e-2, **LOADS))
        sim.advance_to(2e-3)
        ends.append(of_nodes(sim, "u"))
    assert np.abs(ends[1] - ends[0]).max() < 1e-3 * np.abs(ends[0]).max()
    sim = start(scene_of(precision="f32", initial=[InitialVelocity(shell="shell", velocity=(1, 2, 3))]))
    sim.advance(50)
    assert sim.energies()["elastic"] < 1e-9 * sim.energies()["kinetic"]
