"""The slit bases of scenes/piston.py: who holds which node, and what is asked of each test."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from taichi_sph.errors import SceneError
from taichi_sph.geometry.regions import extent, inside
from taichi_sph.geometry.surfaces import mesh_of
from taichi_sph.run.gate import default_out
from taichi_sph.scene import Scene, load_scene

sys.path.insert(0, str(Path(__file__).parents[2] / "scenes"))
from _slit_disc import square
from piston import plate

SCENE = Path(__file__).parents[2] / "scenes" / "piston.py"


def piston(**settings: object) -> Scene:
    found = load_scene(SCENE, {"quality": "draft"} | settings)
    assert isinstance(found, Scene)
    return found


@pytest.mark.parametrize("specimen, whole", [("FU", False), ("X", False), ("FU", True), ("X", True), ("TF14", False)])
def test_planes_of_symmetry_hold_what_lies_on_them(specimen, whole, cells=None):
    """Each node of a plane, but for the rim, by one motion across that plane; where two petals end on the axis, each by its own."""
    scene = piston(specimen=specimen, velocity=5.0, whole=whole, cells=cells)
    points = mesh_of(scene.shells[0], scene).points
    by = np.array([inside(motion.where, points, extent(points)) for motion in scene.motions])
    assert (by.sum(axis=0) <= 1).all()
    held = {axis: np.zeros(len(points), bool) for axis in range(3)}
    for motion, there in zip(scene.motions, by):
        for axis, speed in enumerate(motion.velocity):
            held[axis] |= there & (speed == 0)
    rim = np.hypot(*points.T[:2]) > 0.0399
    assert all(held[axis][rim].all() for axis in range(3)) and not held[2][~rim].any()
    planes = () if whole else (1,) if specimen == "FU" else (0, 1)
    for axis in (0, 1):
        on = (np.abs(points[:, axis]) < 5e-8) & (axis in planes)
        assert (held[axis][~rim] == on[~rim]).all()
    ends = (np.abs(points[:, :2]) < 1e-6).all(axis=1)
    assert ends.sum() == {("X", False): 2, ("X", True): 4}.get((specimen, whole), 0 if specimen == "TF14" else 1)
    if (specimen, whole) == ("X", False):
        assert held[0][ends].sum() == held[1][ends].sum() == 1 and (held[0] ^ held[1])[ends].all()


def test_the_widest_cells_are_held_like_narrow_ones():
    test_planes_of_symmetry_hold_what_lies_on_them("X", False, cells=5e-3)


def test_squares_narrower_than_the_cells_are_free_beside_a_plane():
    """Two squares at least reach over half of a flap, however wide the cells: its mirror plane does not hold the next row."""
    assert square(10e-3, 30e-3) == 5e-3
    shells, motions = plate("FU", 2e-3, 30e-3, 2)
    points = shells[0].surface.points
    for motion in motions[1:]:
        axis = motion.velocity.index(0.0)
        there = inside(motion.where, np.array(points), extent(np.array(points)))
        assert there.any() and (np.abs(np.array(points)[there, axis]) < 5e-8).all()


@pytest.mark.parametrize(
    "wrong, said",
    [
        ({"cells": 0.0}, "cells = 0 m must be greater than 0"),
        ({"spacing": 0.0}, "spacing = 0 m must be greater than 0"),
        ({"velocity": "-2"}, "velocity = -2 m/s must be greater than 0"),
        ({"specimen": "E20", "cells": "1 mm"}, "base of E20 is rigid; leave cells out, or take a thin one: F14"),
        ({"specimen": "X", "cells": "30 mm"}, "cells = 0.03 m of the thin base are too wide: take at most 0.005"),
        ({"specimen": "FU", "spacing": "0.05"}, "spacing = 0.05 m of the water is too coarse: take at most 0.01"),
    ],
)
def test_what_is_no_test_is_refused(wrong, said):
    with pytest.raises(SceneError, match=said):
        piston(**wrong)


def test_what_is_expected_of_each():
    targets = {
        (specimen, speed): {
            (q.name, q.value, q.tolerance) for q in piston(specimen=specimen, velocity=speed).quantities if q.value is not None
        }
        for specimen, speed in (("FU", 5.0), ("FU", 2.0), ("TF14", 5.0), ("X", 5.0), ("FU", 3.0))
    }
    assert targets["FU", 5.0] == {("turn_angle", 50.0, 5.0), ("history_peak", 0.02, 0.003), ("face_frequency", 1300.0, 130.0)}
    assert targets["FU", 2.0] == {("turn_angle", 20.0, 5.0), ("history_peak", 0.018, 0.003), ("face_frequency", 1300.0, 130.0)}
    assert targets["TF14", 5.0] == {("rim_severed_at", 1.5e-3, 0.2e-3)}
    assert targets["X", 5.0] == {("petals", 1.0, 0.0)} and not targets["FU", 3.0]


def test_a_half_weighs_half():
    """Water, piston and chariot of half a cylinder."""
    half, whole = (piston(specimen="FU", whole=part) for part in (False, True))
    assert half.fluids[0].fill.volume == pytest.approx(0.5 * whole.fluids[0].fill.volume)
    for name in ("piston", "chariot"):
        assert half.body(name).mass == 0.5 * whole.body(name).mass
    assert len(half.walls) == 1 and not whole.walls


def test_the_specimen_names_the_folder_and_the_title():
    scene = piston(specimen="TF")
    assert default_out(scene) == Path("runs/piston-TF-draft") and "specimen TF, 5 m/s" in scene.title
