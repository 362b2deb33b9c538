"""Measures of tubes that are crushed along z into rings. The axis goes through the middle of the reference."""

from __future__ import annotations

import numpy as np

from ...scene import Scene
from ..folder import RunFolder
from .pattern import node_spacing


def outward_rings(run: RunFolder, scene: Scene, body: str | None = None) -> np.ndarray:
    """(F,) places along the tube in the reference [m], from the low end up, of the rings that have folded outward at the end: farther out
    than both neighbours, and by more than a thickness than they stood. Between nodes by the parabola through three rings."""
    shell = next(shell for shell in scene.shells if body in (None, shell.name))
    frame = run.frames(shell.name).body(-1)
    reference, middle = frame.reference, frame.reference[:, :2].mean(axis=0)
    low, spacing = reference[:, 2].min(), node_spacing(reference, frame.cells)
    ring = np.rint((reference[:, 2] - low) / spacing).astype(int)
    ring = np.unique(ring, return_inverse=True)[1]
    count = np.bincount(ring)
    along = np.bincount(ring, reference[:, 2]) / count
    moved = np.linalg.norm(frame.points[:, :2] - middle, axis=1) - np.linalg.norm(reference[:, :2] - middle, axis=1)
    outward = np.bincount(ring, moved) / count
    found = []
    for k in range(1, len(along) - 1):
        if outward[k] > shell.thickness and outward[k - 1] <= outward[k] > outward[k + 1]:
            curved, slope, _ = np.polyfit(along[k - 1 : k + 2] - along[k], outward[k - 1 : k + 2], 2)
            found.append(along[k] - 0.5 * slope / curved)
    return np.array(found)


def fold_length(run: RunFolder, scene: Scene, *, body: str | None = None) -> float | None:
    """Length of the tube [m] from one ring that has folded outward to the next, in the reference: the mean of all that are less than one
    and a half times the least, for between two stacks of folds the tube is straight. None with fewer than two rings."""
    apart = np.diff(outward_rings(run, scene, body))
    return float(apart[apart < 1.5 * apart.min()].mean()) if len(apart) else None
