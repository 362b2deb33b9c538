"""The smallest plates: one cell, one row, two rows. They must move rigidly for nothing and stay stable."""

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.scene import Cut

from ..plates import forces, linear, mass, plate_scene, put, start, stored, strains

D = 1e-3  # of the cut plate
S = 10e-3  # side of a small one's cells: a shell is wider than thick
SMALL = {
    "one quad": {"length": S, "width": S, "cells": "quad"},
    "two triangles": {"length": S, "width": S, "cells": "triangle"},
    "one row": {"length": 8 * S, "width": S, "cells": "quad"},
    "two rows": {"length": 8 * S, "width": 2 * S, "cells": "triangle"},
}


@pytest.mark.parametrize("name", SMALL)
def test_small_plates(name):
    sim = start(plate_scene(spacing=S, irregularity=0.0, duration=1.0, **SMALL[name]))
    stiff = 32e9 * 4e-3
    assert mass(sim).sum() == pytest.approx(SMALL[name]["length"] * SMALL[name]["width"] * 4e-3 * 2450, rel=1e-12)
    # rigid
    angle = 1.1
    R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    u = linear(sim, R - np.eye(2)) + [2 * S, -S]
    assert np.abs(forces(sim, u)).max() < 1e-11 * stiff * S
    assert np.abs(strains(sim)).max() < 1e-11
    # linear: exact strain and energy
    G = np.array([[1e-3, 2e-3], [-5e-4, 7e-4]])
    E = 0.5 * (G + G.T + G.T @ G)
    energy = stored(sim, linear(sim, G))
    assert np.abs(strains(sim) - [E[0, 0], E[1, 1], E[0, 1]]).max() < 1e-14
    stress = 32e9 / 0.96 * (0.8 * E + 0.2 * np.trace(E) * np.eye(2))
    assert energy == pytest.approx(0.5 * np.sum(stress * E) * sim.shell.mesh.areas.sum() * 4e-3, rel=1e-9)
    # random motion: bounded, closed
    put(sim, "u", np.zeros((sim.shell.nodes.n, 2)))
    put(sim, "v", 1e-3 * np.random.default_rng(0).normal(size=(sim.shell.nodes.n, 2)))
    sim.advance(500)
    assert abs(sim.energies()["closed_residual_percent"]) < 1e-4
    f = forces(sim, 1e-6 * np.random.default_rng(1).normal(size=(sim.shell.nodes.n, 2)))
    assert np.abs(f.sum(axis=0)).max() < 1e-12 * np.abs(f).sum()


def test_a_cell_left_alone_and_a_node_left_hanging():
    """Cut a corner off: what remains of it is one cell, and nodes without cells; all of it flies on in peace."""
    cuts = [Cut(start=(0, 1.6 * D, 0), end=(1.6 * D, 1.6 * D, 0)), Cut(start=(1.6 * D, 0, 0), end=(1.6 * D, 1.6 * D, 0))]
    sim = start(plate_scene(cells="quad", irregularity=0.0, cuts=cuts, duration=1.0))
    broken = runtime.get(sim.shell.cells.broken, sim.shell.cells.n)
    assert broken.sum() == 3 and broken[0] == 0
    lone = sim.shell.mesh.cells[0]
    corner = int(np.argmin(np.sum((sim.shell.mesh.points - [0, 0, 0]) ** 2, axis=1)))
    assert corner in lone
    assert sim.status()["loose nodes"] == 0
    rng = np.random.default_rng(3)
    put(sim, "v", 1e-2 * rng.normal(size=(sim.shell.nodes.n, 2)))
    sim.advance(500)
    assert abs(sim.energies()["closed_residual_percent"]) < 1e-3
    # the rest of the plate does not feel the lone cell
    u = np.zeros((sim.shell.nodes.n, 2))
    u[lone] = 0.2 * D * rng.normal(size=(4, 2))
    f = forces(sim, u)
    others = np.setdiff1d(np.arange(sim.shell.nodes.n), lone)
    assert np.abs(f[lone]).max() > 0 and np.all(f[others] == 0)
    # now the cell itself breaks: its three outer nodes hang on nothing
    sim.shell.rupture.cut(np.array([0]))
    assert sim.status()["loose nodes"] == 4
    assert np.all(forces(sim, u)[lone] == 0)
