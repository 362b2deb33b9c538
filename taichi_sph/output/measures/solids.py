"""Measures of solids: how long and how wide they have become."""

from __future__ import annotations

import numpy as np

from ...scene import Scene
from ..folder import RunFolder


def _points(run: RunFolder, body: str | None, axis: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(N,) places along the axis now and in the reference, (N,) distances now from the middle line along it, of the surface [m]."""
    frame = run.the("solid", body).body(-1)
    own = np.unique(frame.cells[frame.cells >= 0])
    x, X, k = frame.points[own], frame.reference[own], "xyz".index(axis)
    across = np.delete(x, k, axis=1)
    return x[:, k], X[:, k], np.linalg.norm(across - np.delete(X, k, axis=1).mean(axis=0), axis=1)


def body_length(run: RunFolder, scene: Scene, *, axis: str = "z", body: str | None = None) -> float:
    """Length [m] along an axis at the end."""
    along, _, _ = _points(run, body, axis)
    return float(np.ptp(along))


def body_diameter(run: RunFolder, scene: Scene, *, axis: str = "z", at: float = -1.0, body: str | None = None) -> float:
    """Diameter [m] about an axis at the end: the largest, or that at the height `at` [m] above the lower end."""
    along, reference, away = _points(run, body, axis)
    if at < 0.0:
        return 2.0 * float(away.max())
    height, radius = [], []
    for layer in np.unique(np.round(reference, 9)):  # rings of the reference: their widest nodes
        own = np.flatnonzero(np.abs(reference - layer) < 2e-9)
        widest = own[np.argmax(away[own])]
        height.append(along[widest] - along.min())
        radius.append(away[widest])
    order = np.argsort(height)
    return 2.0 * float(np.interp(at, np.array(height)[order], np.array(radius)[order]))
