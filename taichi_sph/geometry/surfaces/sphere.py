"""Spheres and parts of them. NumPy only."""

from __future__ import annotations

import numpy as np

from ...scene.surfaces import Sphere
from ..mesh import SurfaceMesh
from ..ogrid import coons
from .patch import Finish, Patch, Place, along, mirrored, one_of_each, put, strip, then, welded
from .round import cap, rim_of
from .tank import seated


def sphere(surface: Sphere, d: float, finish: Finish, there: Place) -> SurfaceMesh:
    """About 0: two hemispheres, a cap, a zone, a cap on a zone, or a sector."""
    radius, half = surface.radius, np.pi / 2
    if surface.top > 0:
        return finish(_zone(surface, surface.top, None, d), there)
    if not surface.whole:
        return finish(_sector(surface, d), there)
    if surface.bottom <= half * (1 + 1e-9):
        up = along("z", (0.0, 0.0, radius * np.cos(surface.bottom)))
        circle = radius * np.sin(surface.bottom)
        return put(finish(cap(rim_of(circle, d), circle, surface.bottom), then(up, there)), up)
    rim = rim_of(radius, d)
    c, s = np.cos(surface.start_angle), np.sin(surface.start_angle)
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    parts = []
    for top in (True, False):
        if top or surface.to_pole:
            seat = seated(turn, top, 0.0)
            part = put(finish(cap(rim, radius, half), then(seat, there)), seat)
            parts.append(part if top else SurfaceMesh(part.points, mirrored(part.cells), part.spacing, part.normals))
        else:
            parts.append(finish(_zone(surface, half, rim, d), there))
    return welded(parts)


def _zone(surface: Sphere, top: float, columns: int | None, spacing: float) -> Patch:
    """Part of a sphere about 0 between two angles from +z, `top` and that of the surface (Mercator's chart)."""
    radius, bottom, angle = surface.radius, surface.bottom, min(surface.angle, 2 * np.pi)
    mean = radius * (np.cos(top) - np.cos(bottom)) / (bottom - top)
    if columns is None:
        columns = rim_of(mean, spacing) if surface.whole else max(1, round(mean * angle / spacing))
    rows = max(1, round(radius * (bottom - top) / spacing))

    def bend(chart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        phi, up = surface.start_angle + chart[:, 0] / radius, np.tanh(chart[:, 1] / radius)
        flat = 1 / np.cosh(chart[:, 1] / radius)
        normal = np.column_stack([flat * np.cos(phi), flat * np.sin(phi), up])
        return radius * normal, normal

    heights = radius * np.arctanh(np.cos(np.linspace(bottom, top, rows + 1)))
    return strip(radius * angle, columns, heights, surface.whole, bend)


def _sector(surface: Sphere, d: float) -> Patch:
    """Sector of a sphere about 0 that holds the pole: three nets of quadrangles about a node within, in arc length from the pole."""
    radius, angle, reach = surface.radius, surface.angle, surface.bottom
    p = max(1, round(radius * np.sin(reach) * angle / (2 * d)))  # cells on half of its base, and on a straight side as far from the pole
    r = max(1, round(radius * reach / d) - p)  # on the rest of a straight side
    part = p / (p + r)
    a, b = [np.array([np.cos(phi), np.sin(phi)]) for phi in (-angle / 2, angle / 2)]
    centre = np.array([min(part / np.sqrt(np.cos(angle / 2)), 1 - 0.7 * (1 - part)), 0.0])

    def straight(start: np.ndarray, end: np.ndarray, cells: int) -> np.ndarray:
        return start + (end - start) * np.linspace(0, 1, cells + 1)[:, None]

    def arc(start: float, end: float) -> np.ndarray:
        phi = np.linspace(start, end, p + 1)
        return np.column_stack([np.cos(phi), np.sin(phi)])

    pole, q, s, m = np.zeros(2), part * a, part * b, np.array([1.0, 0.0])
    inward = straight(centre, m, r)
    nets = [
        (straight(pole, q, p), straight(s, centre, p), straight(pole, s, p), straight(q, centre, p)),
        (straight(q, a, r), inward, straight(q, centre, p), arc(-angle / 2, 0)),
        (inward, straight(s, b, r), straight(centre, s, p), arc(0, angle / 2)),
    ]
    points, quads, n = [], [], 0
    for lower, upper, left, right in nets:  # sides of each, in u and in v
        net = coons(lower, upper, left, right)
        number = n + np.arange(net.shape[0] * net.shape[1]).reshape(net.shape[:2])
        quads.append(np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4))
        points.append(net.reshape(-1, 2))
        n += number.size
    xy, cells = one_of_each(np.concatenate(points), np.concatenate(quads), 1e-9)
    far = np.linalg.norm(xy, axis=1)
    chart = xy * np.where(far > 0, 2 * np.tan(far * reach / 2) / np.where(far > 0, far, 1.0), 0.0)[:, None] * radius
    turn = surface.start_angle + angle / 2

    def bend(chart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        t2 = np.einsum("ni,ni->n", chart, chart) / (4 * radius**2)
        x, y = (chart / (1 + t2)[:, None] / radius).T
        normal = np.column_stack([x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn), (1 - t2) / (1 + t2)])
        return radius * normal, normal

    return Patch(chart, cells, _within(cells, len(chart)), bend)


def _within(quads: np.ndarray, n: int) -> np.ndarray:
    """(n,) bool: nodes that are on no side of a single quadrangle."""
    sides = np.sort(np.stack([quads.ravel(), np.roll(quads, -1, axis=1).ravel()], axis=1), axis=1)
    side, count = np.unique(sides, axis=0, return_counts=True)
    inner = np.ones(n, bool)
    inner[side[count == 1]] = False
    return inner
