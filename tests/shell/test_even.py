"""Even loads give even accelerations: masses, pressures and the membrane of a curved shell come to the nodes with one set of weights."""

from __future__ import annotations

import math

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.bodies.shell_sph.bearing import bearing, kept_positive
from taichi_sph.bodies.shell_sph.galerkin_reference import shares
from taichi_sph.scene import Cylinder, SurfacePressure

from ..shells import of_nodes, shell_scene, start


def weights(sim) -> np.ndarray:
    return runtime.get(sim.shell.nodes.mass, sim.shell.nodes.n)


@pytest.mark.parametrize("cells", ["quad", "triangle"])
def test_a_free_plate_under_an_even_pressure_is_a_rigid_body(cells):
    """v = p t / (rho e) at every node, on nodes moved at random: to rounding."""
    pressure = [SurfacePressure(shell="shell", value=1e5, kind="dead")]
    sim = start(shell_scene("flat", n=10, cells=cells, thickness=0.01, duration=5e-5, pressures=pressure))
    sim.advance_to(5e-5)
    v, half = of_nodes(sim, "v"), sim.time - 0.5 * sim.dt
    assert v[:, 2] == pytest.approx(1e5 * half / (7800 * 0.01), rel=1e-9)
    assert np.abs(v[:, :2]).max() < 1e-9 * v[:, 2].max()
    mass, X = weights(sim), sim.shell.mesh.points
    assert mass.min() > 0.2 * 78 / 400 and mass.sum() == pytest.approx(78.0, rel=1e-12)
    # the centres of the cells, not the quarters, say where the mass is
    assert mass @ X[:, 0] / 78.0 == pytest.approx(0.5, abs=1e-12)


def test_a_short_free_cylinder_breathes_as_a_ring():
    """A pressure step on a ring of thin wall: u(t) = p R^2 / (E e) (1 - cos w t), w^2 = E / (rho R^2), at every node of every row."""
    radius, e, young, density, p = 0.5, 0.005, 210e9, 7800.0, 1e5
    period = 2 * math.pi * radius * math.sqrt(density / young)
    sim = start(
        shell_scene(
            Cylinder(radius=radius, length=0.2), n=20, irregularity=0.0, thickness=e, duration=0.6 * period,
            pressures=[SurfacePressure(shell="shell", value=p)],
        )
    )  # fmt: skip
    X = sim.shell.mesh.points
    out = X[:, :2] / np.linalg.norm(X[:, :2], axis=1)[:, None]
    static, peak = p * radius**2 / (young * e), np.zeros(len(X))
    for k in range(45, 56):
        sim.advance_to(0.01 * k * period)
        peak = np.maximum(peak, (of_nodes(sim, "u")[:, :2] * out).sum(axis=1))
    assert peak / static == pytest.approx(2.0, abs=0.02)
    assert abs(sim.energies()["closed_residual_percent"]) < 0.01


def test_shares_keep_the_centre_of_every_cell():
    for cells in ("quad", "triangle"):
        mesh = start(shell_scene("flat", n=5, cells=cells)).shell.mesh
        edges = mesh.edges.cell_edges
        middle = np.where((edges >= 0)[:, :, None], mesh.points[mesh.edges.nodes[np.maximum(edges, 0)]].mean(axis=2), 0.0)
        b, w = bearing(mesh), shares(mesh)
        assert b.sum(axis=1) == pytest.approx(1.0, abs=1e-14)
        assert np.einsum("mk,mki->mi", b, middle) == pytest.approx(np.einsum("mk,mki->mi", w, middle), abs=1e-14)
        assert (np.abs(b - w).max() > 0.1) == (cells == "quad")


def test_a_node_keeps_some_mass():
    quarters = np.array([1.0, 2.0, 1.0])
    found = kept_positive(np.array([-0.2, 3.0, 1.2]), quarters)
    assert (found / quarters).min() == pytest.approx(0.2) and found.sum() == pytest.approx(4.0)
    assert kept_positive(np.array([0.5, 2.5, 1.0]), quarters) == pytest.approx([0.5, 2.5, 1.0])
