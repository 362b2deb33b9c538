"""Boxes of flat walls. NumPy only."""

from __future__ import annotations

import numpy as np

from ...scene.surfaces import BoxTank
from ..mesh import SurfaceMesh
from .flat import flat
from .patch import Finish, along, put, stood, then, welded


def box(surface: BoxTank, d: float, finish: Finish) -> SurfaceMesh:
    """Its walls, from outside: normals on edges and in corners are the mean of those that meet there."""
    lines = [np.linspace(0, size, max(1, round(size / d)) + 1) for size in surface.size]
    parts = []
    for face in surface.faces:
        across, outward = "xyz".index(face[1]), face[0] == "+"
        one, two = (
            [(1, 2), (2, 0), (0, 1)][across] if outward else [(2, 1), (0, 2), (1, 0)][across]
        )  # from one to two turns about the normal
        frame = np.zeros((3, 3))
        frame[0, one] = frame[1, two] = 1.0
        frame[2, across] = 1.0 if outward else -1.0
        corner = np.zeros(3)
        corner[across] = surface.size[across] if outward else 0.0
        there = then(stood(frame, corner), along("z", surface.origin))
        parts.append(put(finish(flat(surface.size[one], lines[two], len(lines[one]) - 1), there), there))
    return welded(parts)
