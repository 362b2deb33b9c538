"""Points on the faces of a rigid body: rings of equal area each, on discs and tubes. NumPy only.

A ring's points are a multiple of four and stand off the axes across, so that a quarter of a face is a quarter of its points.
"""

from __future__ import annotations

import math

import numpy as np

from ...geometry.regions import inside
from .said import DiscFace, TubeFace


def points(face: DiscFace | TubeFace, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """(K, 3) places [m], about `spacing` [m] apart, and (K, 3) vector areas towards the water [m2] of a face, at t = 0."""
    found = _disc(face, spacing) if isinstance(face, DiscFace) else _tube(face, spacing)
    for region in face.within:
        kept = inside(region, found[0])
        found = found[0][kept], found[1][kept]
    return found


def _frame(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit vectors along an axis and twice across; along the scene's axes where it is one of them."""
    n = axis / np.linalg.norm(axis)
    across = np.roll(np.eye(3)[int(np.abs(n).argmax())], 1)
    one = across - across @ n * n
    one /= np.linalg.norm(one)
    return n, one, np.cross(n, one)


def _ring(radius: float, spacing: float, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(n, 3) directions of the points of a ring."""
    n = 4 * max(1, math.ceil(0.5 * math.pi * radius / spacing))
    turn = 2 * math.pi * (np.arange(n) + 0.5) / n
    return np.cos(turn)[:, None] * one + np.sin(turn)[:, None] * other


def _disc(face: DiscFace, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    normal, one, other = _frame(np.array(face.normal, float))
    rings = max(1, math.ceil((face.radius - face.hole) / spacing))
    edges = face.hole + (face.radius - face.hole) * np.arange(rings + 1) / rings
    places, areas = [], []
    for inner, outer in zip(edges, edges[1:]):
        way = _ring(0.5 * (inner + outer), spacing, one, other)
        places.append(np.array(face.centre) + 0.5 * (inner + outer) * way)
        areas.append(np.tile(math.pi * (outer**2 - inner**2) / len(way) * normal, (len(way), 1)))
    return np.concatenate(places), np.concatenate(areas)


def _tube(face: TubeFace, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    start, along = np.array(face.start), np.array(face.end) - np.array(face.start)
    length = float(np.linalg.norm(along))
    normal, one, other = _frame(along)
    rings = max(1, math.ceil(length / spacing))
    way = _ring(face.radius, spacing, one, other)
    area = 2 * math.pi * face.radius * length / rings / len(way)
    places = [start + (k + 0.5) / rings * length * normal + face.radius * way for k in range(rings)]
    sign = -1.0 if face.water == "inside" else 1.0
    return np.concatenate(places), np.tile(sign * area * way, (rings, 1))
