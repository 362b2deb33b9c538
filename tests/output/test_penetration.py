"""Craters in frames made by hand: what belongs to one, and how wide it is."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph.frame import BodyFrame
from taichi_sph.geometry.solids.made import brick
from taichi_sph.output.measures.penetration import crater, crater_width, struck_faces
from taichi_sph.scene import Brick

DOWN, ABOVE = np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, 0.3])


def block(quarter: bool, radius: float, isle: bool = False) -> BodyFrame:
    """1 m wide, cells of 25 mm, broken within `radius`, ruptured in the middle; an isle of rubble far off. Beyond 0.1 m all flies up."""
    low = 0.0 if quarter else -0.5
    mesh = brick(Brick(size=(0.5 - low, 0.5 - low, 0.1), origin=(low, low, -0.1)), 0.025)
    nodes = mesh.faces.nodes
    middle = mesh.points[nodes].mean(axis=1)
    off = np.hypot(middle[:, 0], middle[:, 1])
    damage = np.where(off < radius, 1.0, 0.5)
    if isle:
        damage[np.hypot(middle[:, 0] - 0.4, middle[:, 1] - 0.4) < 0.07] = 1.0
    far = np.hypot(mesh.points[:, 0], mesh.points[:, 1])
    v = np.zeros_like(mesh.points)
    v[far > 0.1, 2] = 5.0
    data = {"damage": np.where(off < 0.05, 0.2, damage), "rupture_time": np.where(off < 0.05, 1e-6, np.nan)}
    return BodyFrame("block", mesh.points, nodes, {"reference": mesh.points, "velocity": v}, data, kind="solid")


@pytest.mark.parametrize("quarter", [False, True])
def test_a_round_crater(quarter):
    frame = block(quarter, 0.3, isle=True)
    own = struck_faces(frame, DOWN)
    assert len(own) == (400 if quarter else 1600) and (frame.reference[frame.cells[own], 2] == 0).all()
    assert crater_width(frame, ABOVE, DOWN, 0.95, 1.0) == pytest.approx(0.6, rel=0.05)
    _, inside = crater(frame, ABOVE, DOWN, 0.95, 1.0)
    middle = frame.reference[frame.cells[own]].mean(axis=1)
    assert not inside[np.hypot(middle[:, 0], middle[:, 1]) > 0.31].any()  # the isle hangs together with nothing


def test_what_stays_is_no_crater():
    frame = block(True, 0.3)
    assert crater_width(frame, ABOVE, DOWN, 0.95, 6.0) is None
    assert crater_width(block(True, 0.0), ABOVE, DOWN, 0.95, 1.0) is None
