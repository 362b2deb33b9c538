"""Measures of waves and of histories: the value of a column or of a pulse at a time."""

from __future__ import annotations

import math

import numpy as np

from ...scene import Material, Scene
from ..folder import RunFolder


def rayleigh_speed(material: Material) -> float:
    """Speed [m/s] of Rayleigh waves along the edge of a plate in plane stress.

    Viktorov's fit c_s (0.862 + 1.14 nu) / (1 + nu), good to 0.5 %, with nu / (1 + nu) for nu: the plane
    strain formula holds for plane stress with that ratio. Concrete of T table 2.6: 2104 m/s (T: 2100).
    """
    nu = material.poisson / (1 + material.poisson)
    shear = math.sqrt(material.young / (2 * (1 + material.poisson) * material.density))
    return shear * (0.862 + 1.14 * nu) / (1 + nu)


def history_value(run: RunFolder, scene: Scene, *, history: str, column: str, time: float) -> float | None:
    """Value of a column at `time` [s], by linear interpolation; None outside the history."""
    found = run.history(history)
    values = found[column]
    if len(found) == 0 or not found.time[0] <= time <= found.time[-1] * (1 + 1e-9):
        return None
    return float(np.interp(time, found.time, values))


def history_peak(run: RunFolder, scene: Scene, *, history: str, column: str, start: float = 0.0, end: float = math.inf) -> float | None:
    """Largest size of a column, whatever its sign, between `start` and `end` [s], of samples that are numbers; None without one there."""
    found = run.history(history)
    values = found[column][(found.time >= start) & (found.time <= end) & np.isfinite(found[column])]
    return float(np.abs(values).max()) if len(values) else None


def pulse_return(
    run: RunFolder, scene: Scene, *, time: float, body: str | None = None, x: float | None = None, width: float = 0.0
) -> float | None:
    """Amplitude of v_x at `time` [s], relative to that at the first frame, within `width` [m] of `x`
    (default: the middle of the body, the nearest nodes).

    Frames stand on both sides of `time`; the amplitude is read in each and interpolated. None when the
    run does not reach `time`.
    """
    file = run.the("shell", body)
    if not file.times[0] <= time <= file.times[-1] * (1 + 1e-6):
        return None
    reference = file.body(0).reference[:, 0]
    centre = (reference.min() + reference.max()) / 2 if x is None else x
    distance = np.abs(reference - centre)
    near = distance <= max(width, distance.min() * (1 + 1e-6) + 1e-12)

    def amplitude(index: int) -> float:
        values = file.array("PointData", "velocity", index)[near, 0]
        return float(values[np.argmax(np.abs(values))])

    after = min(int(np.searchsorted(file.times, time)), len(file) - 1)
    pair = [max(after - 1, 0), after]
    now = np.interp(time, file.times[pair], [amplitude(i) for i in pair])
    return float(now / amplitude(0))


def history_mean(run: RunFolder, scene: Scene, *, history: str, column: str, start: float = 0.0, end: float = math.inf) -> float | None:
    """Mean over time of a column between `start` and `end` [s]; None without two samples there."""
    found = run.history(history)
    inside = (found.time >= start) & (found.time <= end)
    t, values = found.time[inside], found[column][inside]
    return float(np.trapezoid(values, t) / (t[-1] - t[0])) if len(t) > 1 else None


def history_period(run: RunFolder, scene: Scene, *, history: str, column: str, start: float = 0.0, end: float = math.inf) -> float | None:
    """Mean period [s] of a column's swings about its mean between `start` and `end` [s], by its upward crossings; None with fewer than
    two."""
    found = run.history(history)
    inside = (found.time >= start) & (found.time <= end)
    t, y = found.time[inside], found[column][inside]
    if len(t) < 3:
        return None
    y = y - 0.5 * (y.max() + y.min())
    up = np.flatnonzero((y[:-1] < 0) & (y[1:] >= 0))
    crossings = t[up] - y[up] * (t[up + 1] - t[up]) / (y[up + 1] - y[up])
    return float(np.diff(crossings).mean()) if len(crossings) > 1 else None
