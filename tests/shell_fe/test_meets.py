"""Finite elements meet other bodies by the ports of shells: strikers, water, springs, other shells."""

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.scene import InitialVelocity, Numerics, Plate, Scene, Shell, Spring

from ..contact.test_shell import STEEL, shell_momentum
from ..contact.test_shell import start as strike
from ..exact import restarts_exactly
from ..fluid.test_wetted import can
from ..shells import of_nodes, start

ELEMENTS = {"kind": "elements", "points": 1}


def test_a_striker():
    """What it loses the shell gains; it goes on as on a shell of particles."""
    ends = {}
    for form in ("galerkin", ELEMENTS):
        sim = strike(formulation=form)
        sim.advance_to(30e-6)
        lost = 0.154 * (np.array([0, 0, -40.0]) - runtime.get(sim.rigids.v, 1)[0])
        assert shell_momentum(sim) == pytest.approx(lost, rel=1e-10, abs=1e-12)
        assert sim.energies()["contact"] > 0 and abs(sim.energies()["closed_residual_percent"]) < 1e-2
        assert sim.contact.unsolved == 0
        ends[str(form)] = lost[2]
    assert ends[str(ELEMENTS)] == pytest.approx(ends["galerkin"], rel=0.03)


@pytest.mark.long
def test_a_can_of_water():
    """The can swells under the blow of its water; momentum stays, and the ledger closes."""
    said = can(velocity=(10.0, 0.0, 0.0)).derive(**{"numerics.formulation": ELEMENTS, "duration": 2e-4})
    sim = start(said)
    mass = runtime.get(sim.shell.nodes.mass, sim.shell.nodes.n)
    water = float(sim.fluid.p.masses[0]) * sim.fluid.p.n * 10.0
    sim.advance_to(2e-4)
    v = runtime.get(sim.fluid.p.v, sim.fluid.p.n).astype(float).sum(axis=0) * float(sim.fluid.p.masses[0])
    gained = mass @ of_nodes(sim, "v")
    assert gained[0] > 0.1 * water and gained[0] + v[0] == pytest.approx(water, rel=1e-6)
    assert abs(sim.energies()["closed_residual_percent"]) < 1.0
    restarts_exactly(lambda: start(said), 10, 10)


def test_beside_a_shell_of_particles():
    """Two plates in one scene, each of its form: the springs between them part equal momenta, and the blow of one on the other does."""

    def plate(name: str, z: float, **more) -> Shell:
        surface = Plate(length=0.02, width=0.02, origin=(0, 0, z))
        return Shell(name=name, surface=surface, thickness=1e-3, material=STEEL, motion="free", **more)

    said = Scene(
        name="two",
        title="two plates",
        source="tests",
        shells=[plate("particles", 0.0), plate("elements", 1.5e-3, formulation=ELEMENTS)],
        springs=[Spring(name="link", between=("particles", "elements"), points=((0.01, 0.01, 0), (0.01, 0.01, 1.5e-3)), stiffness=1e5)],
        initial=[InitialVelocity(body="elements", velocity=(0, 0, -30.0))],
        duration=6e-5,
        numerics=Numerics(spacing=2e-3),
    )
    sim = start(said)
    assert [type(group).__name__ for group in sim.groups] == ["ParticleShells", "ElementShells"]
    masses = [runtime.get(group.nodes.mass, group.nodes.n) for group in sim.groups]
    sim.advance_to(6e-5)
    momenta = [mass @ runtime.get(group.nodes.v, group.nodes.n) for mass, group in zip(masses, sim.groups)]
    total = -30.0 * masses[1].sum()
    assert momenta[0][2] < 0.4 * total
    assert momenta[0][2] + momenta[1][2] == pytest.approx(total, rel=1e-9)
    assert sim.energies()["contact"] > 0 and abs(sim.energies()["closed_residual_percent"]) < 0.1
    assert [body.name for body in sim.frame().bodies] == ["particles", "elements"]
