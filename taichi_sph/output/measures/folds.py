"""Measures of tubes that are crushed along z into rings. The axis goes through the middle of the reference."""

from __future__ import annotations

import numpy as np

from ...scene import Scene
from ..folder import RunFolder


def outward_rings(run: RunFolder, scene: Scene, body: str | None = None) -> np.ndarray:
    """(F,) places along the tube in the reference [m], from the low end up, of the rings that have folded outward at the end: farther out
    than they stood by more than a thickness, and than the tube on both sides by half of one. Between nodes by the parabola through three
    rings."""
    from scipy.signal import find_peaks

    shell = next(shell for shell in scene.shells if body in (None, shell.name))
    frame = run.frames(shell.name).body(-1)
    reference, middle = frame.reference, frame.reference[:, :2].mean(axis=0)
    along, ring, count = np.unique(np.round(reference[:, 2], 9), return_inverse=True, return_counts=True)
    moved = np.linalg.norm(frame.points[:, :2] - middle, axis=1) - np.linalg.norm(reference[:, :2] - middle, axis=1)
    outward = np.bincount(ring, moved) / count
    found = []
    for k in find_peaks(outward, height=shell.thickness, prominence=0.5 * shell.thickness)[0]:
        curved, slope, _ = np.polyfit(along[k - 1 : k + 2] - along[k], outward[k - 1 : k + 2], 2)
        found.append(along[k] - 0.5 * slope / curved)
    return np.array(found)


def fold_length(run: RunFolder, scene: Scene, *, body: str | None = None) -> float | None:
    """Length of the tube [m] from one ring that has folded outward to the next, in the reference: the mean of all that are less than one
    and a half times the least, for between two stacks of folds the tube is straight. None with fewer than two rings."""
    apart = np.diff(outward_rings(run, scene, body))
    return float(apart[apart < 1.5 * apart.min()].mean()) if len(apart) else None
