"""Patches of walls that are cylinders and cones, and of round ends. NumPy only."""

from __future__ import annotations

import numpy as np

from ...scene.surfaces import Frustum
from ..mesh import SurfaceMesh
from ..ogrid import ogrid
from .patch import Patch, mesh_from, strip


def eights_of(radius: float, spacing: float) -> int:
    """Columns round a circle with two planes of symmetry and their bisectors."""
    return 8 * max(1, round(2 * np.pi * radius / spacing / 8))


def rim_of(radius: float, spacing: float) -> int:
    """Columns round a circle: a multiple of 8, which has two planes of symmetry and their bisectors, or of 4 where
    eights are too far apart."""
    around, eights = 2 * np.pi * radius / spacing, eights_of(radius, spacing)
    return eights if abs(eights / around - 1) < 0.08 else 4 * max(2, round(around / 4))


def wall(radius: float, length: float, start: float, angle: float | None, spacing: float, columns: int = 0) -> Patch:
    """Cylinder about z from z = 0, counter-clockwise from `start`, whole where `angle` is None [rad]; columns: where they are given."""
    columns = columns or (rim_of(radius, spacing) if angle is None else max(1, round(radius * angle / spacing)))
    rows = max(1, round(length / spacing))

    def bend(chart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        phi = start + chart[:, 0] / radius
        normal = np.column_stack([np.cos(phi), np.sin(phi), np.zeros_like(phi)])
        return np.column_stack([radius * normal[:, :2], chart[:, 1]]), normal

    return strip(radius * (2 * np.pi if angle is None else angle), columns, np.linspace(0, length, rows + 1), angle is None, bend)


def cone(surface: Frustum, angle: float | None, spacing: float) -> Patch:
    """Wall of a frustum about z from z = 0. Its chart is as wide as the first end: y grows as ds / r along the slant s."""
    first, mean = surface.radius, (surface.radius + surface.end_radius) / 2
    opening, leaning = (surface.end_radius - first) / surface.slant, surface.length / surface.slant  # sine and cosine
    columns = rim_of(mean, spacing) if angle is None else max(1, round(mean * angle / spacing))
    s = np.linspace(0, surface.slant, max(1, round(surface.slant / spacing)) + 1)

    def bend(chart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        s = first * np.expm1(chart[:, 1] * opening / first) / opening
        phi = surface.start_angle + chart[:, 0] / first
        x, y, r = np.cos(phi), np.sin(phi), first + s * opening
        return np.column_stack([r * x, r * y, s * leaning]), np.column_stack([leaning * x, leaning * y, np.full_like(x, -opening)])

    heights = first * np.log1p(s * opening / first) / opening
    return strip(first * (2 * np.pi if angle is None else angle), columns, heights, angle is None, bend)


def cap(rim: int, radius: float, half_angle: float) -> Patch:
    """Spherical cap, flat for half_angle = 0, above the circle of `radius` in z = 0, with `rim` nodes on it."""
    xy, quads = ogrid(rim, half_angle)
    curvature = np.sin(half_angle) / radius
    if half_angle > 0:  # arc length from the pole -> stereographic distance
        far = np.linalg.norm(xy, axis=1)
        xy = xy * np.where(far > 0, 2 * np.tan(far * half_angle / 2) / np.where(far > 0, far, 1.0), 0.0)[:, None] / curvature
    else:
        xy = radius * xy

    def bend(chart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        t2 = (0.5 * curvature) ** 2 * np.einsum("ni,ni->n", chart, chart)  # tan^2 of half the angle from the pole
        flat, cosine = chart / (1 + t2)[:, None], (1 - t2) / (1 + t2)
        up = (cosine - np.cos(half_angle)) / curvature if half_angle > 0 else np.zeros(len(chart))
        return np.column_stack([flat, up]), np.column_stack([flat * curvature, cosine])

    return Patch(xy, quads, np.arange(len(xy)) < len(xy) - rim, bend)


def quarter(mesh: SurfaceMesh) -> SurfaceMesh:
    """What of a mesh about the origin lies where x and y are above 0. It has nodes on both planes."""
    near = 1e-9 * np.abs(mesh.points).max()
    inside = (mesh.points[:, :2] > -near).all(axis=1)
    cells = mesh.cells[(inside[mesh.cells] | (mesh.cells < 0)).all(axis=1)]
    own = np.unique(cells[cells >= 0])
    number = np.full(len(mesh.points) + 1, -1, np.int32)
    number[own] = np.arange(len(own))
    points = mesh.points[own]
    points[:, :2] = np.where(points[:, :2] < near, 0.0, points[:, :2])  # on the planes
    return mesh_from(points, number[cells], mesh.node_normals[own])
