"""The bar of Taylor, coarse: what codes and the recovered cylinder say of it."""

from pathlib import Path

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.scene.script import load_scene
from taichi_sph.world.world import World

from ..solids import group_of

SCENE = Path(__file__).parents[2] / "scenes" / "taylor_bar.py"


@pytest.mark.long
@pytest.mark.parametrize("case, length, foot", [("wilkins", 21.45e-3, 14.3e-3), ("fitted", 16.21e-3, 13.56e-3)])
def test_length_and_foot(case, length, foot):
    """Four cells over the radius: within 3 % in length, 7 % at the foot, and the ledger closes."""
    scene = load_scene(SCENE, {"quality": "draft", "case": case, "numerics.spacing": 0.8e-3})
    world = World(scene)
    world.advance_to(scene.duration)
    group = group_of(world)
    x = group.mesh.points + runtime.get(group.nodes.u, group.nodes.n)
    assert np.ptp(x[:, 2]) == pytest.approx(length, rel=0.03)
    assert 2 * np.linalg.norm(x[:, :2], axis=1).max() == pytest.approx(foot, rel=0.07)
    found = world.energies()
    assert abs(found["closed_residual_percent"]) < 0.2 and found["plastic"] > 0.9 * found["injected"]
