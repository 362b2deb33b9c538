"""Measures of strikers that fly through water: their drag and the cavity behind them."""

from __future__ import annotations

import math

import numpy as np

from ...scene import Scene
from ..folder import RunFolder
from ..histories import History
from .fluid import said_of
from .perforation import PREFIX, of, speeds

FEWEST = 5  # samples of a fit


def way(history: History) -> np.ndarray | None:
    """(n,) how far a body has gone along its first direction [m]; None of one that rests at first, which has no direction."""
    x, v = (np.stack([history[name] for name in names], axis=-1) for names in (("x", "y", "z"), ("vx", "vy", "vz")))
    speed = np.linalg.norm(v[0]) if len(v) else 0.0
    return (x - x[0]) @ (v[0] / speed) if speed > 0 else None


def drag_coefficient(
    run: RunFolder,
    scene: Scene,
    *,
    striker: str | None = None,
    fluid: str | None = None,
    radius: float,
    start: float = 0.0,
    end: float = math.inf,
) -> float | None:
    """C_d of a rigid body over a stretch of its way [m]: -2 m / (rho pi r^2) d ln v / ds by a fit of ln v, which is straight where C_d is
    constant; radius [m] of its frontal area; None with fewer than five samples there, or of a body that rests at first."""
    history = of(run, striker)
    name = history.path.stem.removeprefix(PREFIX)
    mass = next(rigid.mass for rigid in scene.rigids if rigid.name == name)
    density = said_of(run, scene, fluid).water.density
    s, v = way(history), speeds(history)
    if s is None:
        return None
    inside = (s >= start) & (s <= end) & (v > 0.0)
    if inside.sum() < FEWEST:
        return None
    return float(-2.0 * mass / (density * math.pi * radius**2) * np.polyfit(s[inside], np.log(v[inside]), 1)[0])


def cavity_radius(
    run: RunFolder, scene: Scene, *, striker: str | None = None, fluid: str | None = None, depth: float, within: float
) -> float | None:
    """Radius [m] at the end of the cavity that a striker has left `depth` [m] along its way, about the line of its flight: mean distance of
    the innermost particles within `within` [m] of that depth, a quarter of those that the wall of the cavity has there, less half a
    diameter. None where the striker has not come so far, or rests at first."""
    history = of(run, striker)
    gone = way(history)
    if gone is None or gone[-1] <= depth:
        return None
    x = np.array([history[axis][0] for axis in "xyz"])
    v = np.array([history[f"v{axis}"][0] for axis in "xyz"])
    along = v / np.linalg.norm(v)
    frame = run.the("fluid", fluid).body(-1)
    far = frame.points - x
    s = far @ along
    off = np.linalg.norm(far - s[:, None] * along, axis=1)
    there = np.abs(s - depth) <= within
    near = np.sort(off[there])
    if not len(near):
        return None
    d = float(frame.point_data["diameter"][there][off[there].argmin()])
    ring = near[: max(4, int(2.0 * math.pi * near[0] * 2.0 * within / d**2 / 4))]  # a quarter of a layer on the wall of the cavity
    return float(ring.mean() - 0.5 * d)
