"""Measures of rigid strikers, from histories/rigid_<name>.csv, and of the rupture that they cause.

Columns: time [s]; x, y, z [m] and vx, vy, vz [m/s] of the centre of mass; fx, fy, fz [N] force of contact and water, and f_max [N] the
largest of all steps since the row before.
"""

from __future__ import annotations

import math

import numpy as np

from ...bodies.rigid.solid import solid_of
from ...errors import SceneError, nearest
from ...scene import Scene
from ..folder import RunFolder
from ..histories import History
from .fragments import SOLID, ruptured, thrown_solids

PREFIX = "rigid_"


def striker_names(run: RunFolder) -> list[str]:
    """Rigid bodies with a history, the one that was fastest at the start first."""
    names = [name.removeprefix(PREFIX) for name in run.histories() if name.startswith(PREFIX)]
    speed = {name: start_speed(run.history(PREFIX + name)) for name in names}
    return sorted(names, key=lambda name: -speed[name])


def of(run: RunFolder, striker: str | None) -> History:
    """The history of a rigid body: the one that is named, else the only one, or the only one that moves at the start."""
    names = striker_names(run)
    if not names:
        raise SceneError(f"'{run.path}' holds no history of a rigid body")
    if striker is not None and striker not in names:
        raise SceneError(f"'{run.path}' holds no history of a rigid body '{striker}'{nearest(striker, names)}")
    if striker is None and len(names) > 1:
        moving = [name for name in names if start_speed(run.history(PREFIX + name)) > 0]
        if len(moving) != 1:
            raise SceneError(f"the run has {len(names)} rigid bodies: name one of {', '.join(names)} by the option 'striker'")
    return run.history(PREFIX + (names[0] if striker is None else striker))


def speeds(history: History) -> np.ndarray:
    """(n,) [m/s]"""
    return np.sqrt(history["vx"] ** 2 + history["vy"] ** 2 + history["vz"] ** 2)


def forces(history: History) -> np.ndarray:
    """(n,) [N]"""
    return np.sqrt(history["fx"] ** 2 + history["fy"] ** 2 + history["fz"] ** 2)


def start_speed(history: History) -> float:
    return float(speeds(history)[0]) if len(history) else 0.0


def energy_share_lost(history: History) -> float | None:
    """Of the energy of translation; None for a body that starts at rest."""
    v = speeds(history)
    return float(1 - (v[-1] / v[0]) ** 2) if len(v) and v[0] > 0 else None


def striker_speed(
    run: RunFolder,
    scene: Scene,
    *,
    striker: str | None = None,
    time: float | None = None,
    axis: str = "z",
    beyond: float | None = None,
) -> float | None:
    """Speed [m/s] of a rigid body at the end, at `time` [s], or when its centre passes the coordinate `beyond` [m] of
    `axis`. None where the run does not reach that."""
    return speed_of(of(run, striker), time, axis, beyond)


def body_speed(
    run: RunFolder, scene: Scene, *, body: str | None = None, time: float | None = None, axis: str = "z", beyond: float | None = None
) -> float | None:
    """Speed [m/s] of the centre of mass of a solid that starts with a velocity: as striker_speed has it of a rigid body."""
    names = thrown_solids(run)
    if not names or (body is None and len(names) > 1) or (body is not None and body not in names):
        there = f"it has {', '.join(names)}" if names else "it has none"
        raise SceneError(f"option 'body' names a solid that starts with a velocity{'' if body is None else nearest(body, names)}; {there}")
    return speed_of(run.history(SOLID + (body or names[0])), time, axis, beyond)


def speed_of(history: History, time: float | None = None, axis: str = "z", beyond: float | None = None) -> float | None:
    """Speed [m/s] at the end, at `time` [s], or where the place along `axis` passes `beyond` [m]; None where it does not."""
    v = speeds(history)
    if len(v) == 0:
        return None
    if beyond is not None:
        side = np.sign(history[axis] - beyond)
        passed = np.flatnonzero(side != side[0])
        if len(passed) == 0:
            return None
        after = int(passed[0])
        pair = slice(after - 1, after + 1)
        share = (beyond - history[axis][after - 1]) / np.diff(history[axis][pair])[0]
        return float(v[after - 1] + share * (v[after] - v[after - 1]))
    if time is None:
        return float(v[-1])
    inside = history.time[0] <= time <= history.time[-1] * (1 + 1e-9)
    return float(np.interp(time, history.time, v)) if inside else None


def striker_energy_lost(run: RunFolder, scene: Scene, *, striker: str | None = None) -> float:
    """Energy of translation [J] that a rigid body lost from the start to the end: m (v0^2 - v1^2) / 2."""
    history = of(run, striker)
    name = history.path.stem.removeprefix(PREFIX)
    mass = solid_of(next(rigid for rigid in scene.rigids if rigid.name == name), scene).mass
    v = speeds(history)
    return float(0.5 * mass * (v[0] ** 2 - v[-1] ** 2)) if len(v) else 0.0


def peak_force(run: RunFolder, scene: Scene, *, striker: str | None = None, start: float = 0.0, end: float = math.inf) -> float | None:
    """Largest force of contact and water [N] on a rigid body of all steps between `start` and `end` [s], both within a sample."""
    history = of(run, striker)
    inside = history["f_max"][(history.time >= start) & (history.time <= end)]
    return float(inside.max()) if len(inside) else None


def first_rupture(run: RunFolder, body: str | None = None) -> float | None:
    """When [s] the first cell of a shell (of any, when none is named) broke; None: it did not."""
    files = run.of_kind("shell") if body is None else [run.the("shell", body)]
    times = []
    for file in files:
        last = file.body(-1)
        if "rupture_time" in last.cell_data:
            times.append(np.asarray(last.cell_data["rupture_time"], dtype=float)[ruptured(last)])
    found = np.concatenate(times) if times else np.empty(0)
    return float(found.min()) if len(found) else None


def time_to_rupture(run: RunFolder, scene: Scene, *, body: str | None = None) -> float | None:
    """When [s] the first cell broke; None: none did."""
    return first_rupture(run, body)
