"""Pieces of a ring whose broken cells are known."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph.frame import BodyFrame
from taichi_sph.output.measures.fragments import fragments

AROUND, ROWS, RADIUS = 60, 3, 0.05


def ring(broken: set[tuple[int, int]]) -> BodyFrame:
    """A ring of AROUND x ROWS cells, of which those at (place around, row) are broken, each piece moved outward by half a spacing."""
    angle, z = np.meshgrid(2 * np.pi * np.arange(AROUND) / AROUND, np.arange(ROWS + 1) * 2 * np.pi * RADIUS / AROUND, indexing="ij")
    points = np.column_stack([RADIUS * np.cos(angle.ravel()), RADIUS * np.sin(angle.ravel()), z.ravel()])
    j, k = (part.ravel() for part in np.meshgrid(np.arange(AROUND), np.arange(ROWS), indexing="ij"))
    here, there = j * (ROWS + 1) + k, (j + 1) % AROUND * (ROWS + 1) + k
    gone = np.array([pair in broken for pair in zip(j.tolist(), k.tolist())], np.uint8)
    cells = np.column_stack([here, there, there + 1, here + 1]).astype(np.int32)
    data = {"broken": gone, "rupture_time": np.where(gone, 1e-6, np.nan)}
    return BodyFrame("ring", points, cells, {"reference": points, "velocity": np.zeros_like(points)}, data)


def across(*places: int) -> set[tuple[int, int]]:
    """Cracks straight across the ring, one cell wide."""
    return {(place, row) for place in places for row in range(ROWS)}


@pytest.mark.parametrize(
    ("broken", "pieces", "dust"),
    [
        (set(), 1, 0),
        (across(7), 1, 0),  # open, and whole
        (across(0, 30), 2, 0),
        (across(*range(0, AROUND, 5)), 12, 0),
        (across(*range(0, AROUND, 2)), 30, 0),  # cells that stand alone are pieces of four nodes
        (across(0, 1, 2, 30), 2, 8),  # a crack three cells wide leaves two rows of nodes without a cell
        ({(7, 0), (8, 1), (9, 2), *across(30)}, 1, 0),  # a crack aslant: cells that share a corner still hang together
        ({(7, 0), (7, 1), (8, 1), (8, 2), *across(30)}, 2, 0),  # and one that cuts the corners does not
        ({*across(0, 30), (15, 0), (15, 1)}, 2, 0),  # a crack that ends
    ],
)  # fmt: skip
def test_a_ring_falls_into_as_many_pieces_as_its_cracks_cut(broken, pieces, dust):
    f = fragments(ring(broken))
    assert len(f.area) == pieces and (f.nodes >= 2).all() and int(f.dust.sum()) == dust
    assert f.area.sum() + f.node_area[f.dust].sum() == pytest.approx(f.node_area.sum(), rel=1e-12)
