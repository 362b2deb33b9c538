"""Cells that a straight cut breaks, against points sampled along it."""

import numpy as np
import pytest

from taichi_sph.geometry.cuts import cells_cut
from taichi_sph.geometry.mesh import SurfaceMesh, plate


def sampled(mesh, start, end, shift=0.0):
    """Cells in which a dense row of points along the cut lies, deeper than the tolerance."""
    start, end = np.asarray(start, float)[:2], np.asarray(end, float)[:2]
    along = (end - start) / np.linalg.norm(end - start)
    x = start + np.linspace(0, 1, 20001)[:, None] * (end - start) + shift * np.array([-along[1], along[0]])
    found = []
    for s, cell in enumerate(mesh.cells):
        p = mesh.points[cell[cell >= 0], :2]
        side = np.roll(p, -1, axis=0) - p
        depth = np.min([(t[0] * (x[:, 1] - q[1]) - t[1] * (x[:, 0] - q[0])) / np.hypot(*t) for q, t in zip(p, side)], axis=0)
        if depth.max() > 1e-5 * mesh.spacing:
            found.append(s)
    return found


@pytest.mark.parametrize("cells, irregularity", [("quad", 0.0), ("triangle", 0.0), ("quad", 0.3), ("triangle", 0.3)])
def test_against_samples(cells, irregularity):
    mesh = plate(0.012, 0.012, 1e-3, cells, irregularity, seed=1)
    for start, end in [
        ((0, 0.0053, 0), (0.0071, 0.0053, 0)),
        ((0.001, 0.001, 0), (0.0107, 0.0072, 0)),
        ((0.0066, 0.012, 0), (0.0066, 0.004, 0)),
    ]:
        assert cells_cut(mesh, start, end).tolist() == sampled(mesh, start, end, 1e-3 * mesh.spacing)


def test_along_sides_breaks_one_row():
    mesh = plate(0.012, 0.012, 1e-3)
    cut = cells_cut(mesh, (0, 0.006, 0), (0.006, 0.006, 0))
    assert len(cut) == 6
    assert np.all(np.abs(mesh.centres[cut, 1] - 0.0065) < 1e-9)  # the row on its left
    assert np.all(mesh.centres[cut, 0] < 0.006)
    back = cells_cut(mesh, (0.006, 0.006, 0), (0, 0.006, 0))
    assert np.all(np.abs(mesh.centres[back, 1] - 0.0055) < 1e-9)


def test_only_the_near_sheet_of_a_folded_surface():
    """Two plates above each other: a cut in the lower one leaves the upper one alone."""
    low = plate(0.012, 0.012, 1e-3)
    high = low.points + [0, 0, 0.006]
    both = SurfaceMesh(np.vstack([low.points, high]), np.vstack([low.cells, low.cells + len(high)]), 1e-3)
    cut = cells_cut(both, (0, 0.0065, 0), (0.006, 0.0065, 0))
    assert len(cut) == 6 and cut.max() < len(low.cells)
