"""Which cells a straight cut of the scene breaks (pre-cracks, notches). NumPy only."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .mesh import SurfaceMesh


def cells_cut(mesh: SurfaceMesh, start: Sequence[float], end: Sequence[float]) -> np.ndarray:
    """Numbers of the cells whose interior the segment start-end crosses.

    A cut that runs exactly along sides of cells is taken a thousandth of a spacing to its left, so that it
    breaks one row of cells and not two. Crossing is by clipping in the tangent plane of each cell; a cell
    farther from the segment than its own size is not looked at.
    """
    first, past = np.asarray(start, float), np.asarray(end, float)
    # the segment's own line may pass far above a curved surface: only cells close to it count
    axis = past - first
    about = mesh.cells_about(0.5 * (first + past), 0.5 * float(np.linalg.norm(axis)) + 2.01 * float(np.sqrt(mesh.areas.max())))
    centres = mesh.centres[about]
    s = np.clip(((centres - first) @ axis) / max(float(axis @ axis), 1e-300), 0.0, 1.0)
    near = about[np.linalg.norm(centres - first - s[:, None] * axis, axis=1) < 2.0 * np.sqrt(mesh.areas[about])]
    t1, t2, centre, cells = mesh.frames[near, 0], mesh.frames[near, 1], mesh.centres[near], mesh.cells[near]

    def plane(x: np.ndarray) -> np.ndarray:
        return np.stack([np.einsum("mi,mi->m", x - centre, t1), np.einsum("mi,mi->m", x - centre, t2)], axis=1)

    a, b = plane(first), plane(past)
    along = (b - a) / np.maximum(np.linalg.norm(b - a, axis=1), 1e-300)[:, None]
    left = 1e-3 * mesh.spacing * np.stack([-along[:, 1], along[:, 0]], axis=1)
    a, b = a + left, b + left
    enter, leave = np.zeros(len(centre)), np.ones(len(centre))
    last = mesh.corners[near] - 1
    for k in range(4):
        there = k <= last
        p = plane(mesh.points[cells[:, k]])
        following = np.where(k == last, cells[:, 0], cells[:, min(k + 1, 3)])
        q = plane(mesh.points[following])
        side = q - p
        outward = np.stack([side[:, 1], -side[:, 0]], axis=1) / np.maximum(np.linalg.norm(side, axis=1), 1e-300)[:, None]
        da = np.einsum("mi,mi->m", a - p, outward) + 1e-6 * mesh.spacing
        db = np.einsum("mi,mi->m", b - p, outward) + 1e-6 * mesh.spacing
        span = np.where(da == db, 1.0, da - db)
        t = da / span
        leave = np.where(there & (da > 0) & (db > 0), -1.0, leave)
        enter = np.where(there & (da > 0) & (db <= 0), np.maximum(enter, t), enter)
        leave = np.where(there & (da <= 0) & (db > 0), np.minimum(leave, t), leave)
    return near[leave > enter]
