"""A quarter of a plate between planes of symmetry (motions that hold what cannot cross) beside the whole one: result and cost."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.scene import Plate, load_scene
from taichi_sph.scene.supports import clamped, held, symmetry
from taichi_sph.world.world import World

SCENE = Path(__file__).parents[2] / "scenes" / "clamped_plate.py"
SPACING = 1 / 16  # 16 cells a side: the planes of symmetry lie on nodes


def solved(scene) -> tuple[float, int]:
    """Deflection at (0.5, 0.5) over the one expected, and node-steps."""
    sim = World(scene, threads=1)
    sim.advance(1)
    middle = np.argmin(np.linalg.norm(sim.shell.mesh.points[:, :2] - 0.5, axis=1))
    reference = scene.quantities[0].options["reference"]
    return float(runtime.get(sim.shell.nodes.u, sim.shell.nodes.n)[middle, 2]) / reference, sim.shell.nodes.n * sim.instead.steps


@pytest.mark.long
@pytest.mark.parametrize("cells", ["quad", "triangle"])
def test_a_quarter_of_a_clamped_plate(cells):
    whole = load_scene(SCENE, {"slenderness": 1e-2, "numerics.spacing": SPACING, "cells": cells})
    edges = [[clamped(axis, 0.0, "above"), symmetry(axis, 0.5, "below")] for axis in ("x", "y")]
    shell = whole.shells[0].model_copy(update={"surface": Plate(length=0.5, width=0.5)})
    quarter = whole.model_copy(update={"shells": (shell,), "motions": tuple(held("plate", SPACING, *edges))})
    (all_of_it, cost), (part, cheaper) = solved(whole), solved(quarter)
    said = f"{cells}: whole {all_of_it:.4f} of theory for {cost} node-steps, quarter {part:.4f} for {cheaper}"
    print(f"\n{said}, {cost / cheaper:.2f} times less")
    assert all_of_it == pytest.approx(1, abs=0.02)
    assert part == pytest.approx(all_of_it, rel=0.01)
    assert cheaper < 0.35 * cost
