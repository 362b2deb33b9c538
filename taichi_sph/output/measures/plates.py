"""Measures of bent shells: displacements at a point, where a point has gone, frequencies, the step's limit."""

from __future__ import annotations

import numpy as np

from ...scene import Scene
from ..folder import RunFolder

NEAREST = 16  # nodes of the fit around a point that is not a node


def at_point(reference: np.ndarray, values: np.ndarray, point: np.ndarray) -> np.ndarray:
    """(c,) of nodal values (N, c) at `point`: that of a node that lies there, else of a quadratic fit in the tangent
    plane to the 16 nearest nodes."""
    distance = np.linalg.norm(reference - point, axis=1)
    near = np.argsort(distance, kind="stable")[:NEAREST]
    far = distance[near[-1]]
    if distance[near[0]] < 1e-6 * far or len(near) < 8:
        return values[near[0]]
    _, _, axes = np.linalg.svd(reference[near] - reference[near].mean(axis=0), full_matrices=False)
    x, y = ((reference[near] - point) @ axes[:2].T / far).T
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    weight = np.exp(-3.0 * (distance[near] / far) ** 2)[:, None]
    return np.linalg.lstsq(weight * terms, weight * values[near], rcond=None)[0][0]


def _moved(run: RunFolder, body: str | None, point: tuple[float, float, float], index: int = -1) -> np.ndarray:
    frame = run.the("shell", body).body(index)
    return at_point(frame.reference, frame.points - frame.reference, np.asarray(point))


def displacement(run: RunFolder, scene: Scene, *, x: float, y: float, z: float = 0.0, axis: str = "z", body: str | None = None) -> float:
    """Displacement [m] along `axis` at the end, of the point (x, y, z) [m] of the reference."""
    return float(_moved(run, body, (x, y, z))["xyz".index(axis)])


def deflection_ratio(
    run: RunFolder,
    scene: Scene,
    *,
    reference: float,
    x: float,
    y: float,
    z: float = 0.0,
    axis: str = "z",
    body: str | None = None,
) -> float:
    """Displacement along `axis` at the end, at the point (x, y, z) [m], over the `reference` value [m]."""
    return displacement(run, scene, x=x, y=y, z=z, axis=axis, body=body) / reference


def place_error(
    run: RunFolder,
    scene: Scene,
    *,
    x: float,
    y: float,
    to_x: float,
    to_y: float,
    to_z: float,
    over: float,
    z: float = 0.0,
    body: str | None = None,
) -> float:
    """Distance at the end of the point (x, y, z) from where theory puts it, over the length `over` (all in m)."""
    place = np.array([x, y, z]) + _moved(run, body, (x, y, z))
    return float(np.linalg.norm(place - [to_x, to_y, to_z])) / over


def frequency_ratio(run: RunFolder, scene: Scene, *, mode: float, reference: float) -> float | None:
    """Frequency of the flexible mode number `mode` (from 1) over the `reference` [Hz]."""
    found = run.history("progress")
    rows = np.flatnonzero(found["mode"] == round(mode))
    return float(found["frequency"][rows[-1]]) / reference if len(rows) else None


def step_ratio(run: RunFolder, scene: Scene, *, rule: str = "predicted") -> float | None:
    """The stable step by a `rule` ("predicted": the operator's; "thesis": T 2.51) over the measured limit."""
    found = run.history("progress")
    measured = float(found["measured"][-1]) if len(found) else float("nan")
    return float(found[rule][-1]) / measured if measured > 0 else None


def relaxation_residual(run: RunFolder, scene: Scene) -> float | None:
    """Unbalanced force of the last equilibrium over the load."""
    found = run.history("progress")
    return float(found["residual"][-1]) if len(found) else None


def limit_load(run: RunFolder, scene: Scene, *, number: float = 1) -> float | None:
    """Part of the whole load at which the path of a search for equilibrium turns for the `number`-th time (from 1): the top, or bottom, of
    the parabola through the three samples around it; None where it does not."""
    load = run.history("progress")["load"]
    turns = [k for k in range(1, len(load) - 1) if (load[k] - load[k - 1]) * (load[k + 1] - load[k]) < 0]
    if round(number) > len(turns):
        return None
    k = turns[round(number) - 1]
    rise, bend = 0.5 * (load[k + 1] - load[k - 1]), load[k + 1] - 2 * load[k] + load[k - 1]
    return float(load[k] - 0.5 * rise**2 / bend)


def peak_time(run: RunFolder, scene: Scene, *, history: str, column: str, start: float = 0.0, end: float = 1e300) -> float | None:
    """When [s] a column is largest between `start` and `end` [s]: the top of the parabola through the three samples
    around the largest one; None without such a sample inside."""
    found = run.history(history)
    inside = np.flatnonzero((found.time >= start) & (found.time <= end))
    if len(inside) < 3:
        return None
    k = int(inside[np.argmax(found[column][inside])])
    if k in (inside[0], inside[-1]):
        return None
    t, v = found.time[k - 1 : k + 2], found[column][k - 1 : k + 2]
    a, b, _ = np.polyfit(t - t[1], v, 2)
    return float(t[1] - b / (2 * a)) if a else float(t[1])
