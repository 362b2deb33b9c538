"""Measures of leaking tanks, from their histories and the frames of their fluids.

A tank is a closed shell and the fluid that fills it. Where there is one its history is histories/leak.csv; where there are several
each has histories/leak_<fluid>.csv, and a measure names its fluid. Columns: time [s], escaped_mass [kg], escaped_count [-], rate [kg/s],
jet_speed [m/s], jet_x, jet_y, jet_z (direction), opening_area [m2]. Litres are the escaped mass over the density that the fluid starts
with.
"""

from __future__ import annotations

import math

import numpy as np

from ...errors import SceneError, nearest
from ...scene import Scene
from ..folder import RunFolder
from ..histories import History
from .fragments import ruptured
from .pattern import cell_centres

LITRE = 1e-3  # m3
LAST = 0.1  # of the run: over less, one particle makes a rate
PIECES = 4  # of that time, whose rates tell how much they scatter
CONTRACTION = 0.61  # discharge coefficient of a sharp edge
G = 9.81  # m/s2, where the scene has no gravity: a tank goes on to leak under it
HISTORY = "leak"


def _names(scene: Scene) -> dict[str, str]:
    """Fluid -> name of its history, for every fluid that fills a shell."""
    filled = [fluid.name for fluid in scene.fluids if getattr(fluid.fill, "shell", None) is not None]
    return {fluid: HISTORY if len(filled) == 1 else f"{HISTORY}_{fluid}" for fluid in filled}


def called(scene: Scene, fluid: str | None) -> str:
    """The name of the history of a tank; fluid None: of the only one."""
    names = _names(scene)
    return names[fluid or next(iter(names))]


def tanks(run: RunFolder) -> dict[str, str]:
    """Fluid -> name of its history, for every tank that is watched."""
    names = _names(run.scene)
    there = run.histories()
    return {fluid: name for fluid, name in names.items() if name in there}


def watched(run: RunFolder, fluid: str | None) -> tuple[str, History]:
    """The fluid of a tank and its history: the one that is named, else the only one."""
    found = tanks(run)
    if fluid is not None and fluid not in found:
        raise SceneError(f"'{run.path}' holds no history of a leak of '{fluid}'{nearest(fluid, found)}")
    if not found:
        raise SceneError(f"'{run.path}' holds no history '{HISTORY}': no fluid of it fills a shell")
    if fluid is None and len(found) > 1:
        raise SceneError(f"the run has {len(found)} tanks: name the fluid of one by the option 'fluid', one of {', '.join(found)}")
    name = fluid or next(iter(found))
    return name, run.history(found[name])


def density(run: RunFolder, fluid: str | None = None) -> float:
    """Density [kg/m3] of a fluid at the start, the median over its particles."""
    return float(np.median(run.the("fluid", fluid).array("PointData", "density", 0)))


def litres(run: RunFolder, history: History, fluid: str | None = None) -> np.ndarray:
    """(n,) what has escaped of a fluid [l]."""
    return history["escaped_mass"] / density(run, fluid) / LITRE


def window(history: History, start: float | None, end: float) -> np.ndarray:
    """(n,) bool: samples from `start` (by default the first escape) to `end` [s]."""
    if start is None:
        out = np.flatnonzero(history["escaped_mass"] > 0)
        start = float(history.time[max(out[0] - 1, 0)]) if len(out) else math.inf
    return (history.time >= start) & (history.time <= end)


def leak_rate(run: RunFolder, scene: Scene, *, fluid: str | None = None, start: float | None = None, end: float = math.inf) -> float:
    """Mean leak [l/s] from `start` to `end` [s]: what escaped over the time between; 0 where nothing did. By default the last
    tenth of the time until `end`: how fast it leaks then."""
    time, out = _late(run, fluid, start, end)
    return float((out[-1] - out[0]) / (time[-1] - time[0])) if len(time) > 1 else 0.0


def leak_rate_error(
    run: RunFolder, scene: Scene, *, fluid: str | None = None, start: float | None = None, end: float = math.inf
) -> float | None:
    """Standard error [l/s] of `leak_rate` over the same time: that of the mean of the rates in its four quarters, and one particle more or
    less, which is the finest that a run resolves. What the spacing makes of an opening is not in it. None with too few samples."""
    time, out = _late(run, fluid, start, end)
    fluid, history = watched(run, fluid)
    gone = float(history["escaped_count"][-1]) if len(history) else 0.0
    return _error(time, out, float(litres(run, history, fluid)[-1]) / gone if gone > 0 else 0.0)


def _error(time: np.ndarray, out: np.ndarray, one: float) -> float | None:
    """Standard error of the mean rate of what has gone `out` by these times, in particles of `one`; None with too few samples."""
    if len(time) <= PIECES:
        return None
    edges = np.linspace(time[0], time[-1], PIECES + 1)
    scatter = np.std(np.diff(np.interp(edges, time, out)) / np.diff(edges), ddof=1) / math.sqrt(PIECES)
    return float(math.hypot(scatter, one / (time[-1] - time[0])))


def rate_and_error(time: np.ndarray, out: np.ndarray, one: float) -> tuple[float, float | None]:
    """Mean rate over the last tenth of the times so far and its standard error, as `leak_rate` and `leak_rate_error` of a run that ends
    there; in the unit of `out` over seconds."""
    late = time >= (1.0 - LAST) * time[-1]
    time, out = time[late], out[late]
    return (float((out[-1] - out[0]) / (time[-1] - time[0])) if len(time) > 1 else 0.0), _error(time, out, one)


def orifice_rate(run: RunFolder, scene: Scene, *, fluid: str | None = None) -> float | None:
    """What the opening at the end would let out of a calm tank [l/s]: 0.61 A sqrt(2 g h), A the opening of the history, sqrt(h) the mean
    over the broken cells under the level of the start, at their places of the start; g of the scene, or 9.81 m/s2. None where nothing is
    open."""
    fluid, history = watched(run, fluid)
    fill = next(f.fill for f in scene.fluids if f.name == fluid)
    frame = run.frames(run.torn(fill.shell)).body(-1)
    broken = ruptured(frame)
    area = float(history["opening_area"][-1]) if len(history) else 0.0
    if area <= 0.0 or not broken.any():
        return None
    c = "xyz".index(fill.axis)
    level = run.frames(fill.shell).body(-1).reference[:, c].max() if fill.level is None else fill.level
    head = np.clip(level - cell_centres(frame.reference, frame.cells)[broken, c], 0.0, None)
    g = float(np.linalg.norm(scene.gravity)) if scene.gravity else G
    return float(CONTRACTION * area * np.sqrt(2.0 * g * head).mean() / LITRE)


def _late(run: RunFolder, fluid: str | None, start: float | None, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] from `start` to `end`, and what has escaped by then [l]; start None: over the last tenth."""
    fluid, history = watched(run, fluid)
    if start is None:
        start = (1.0 - LAST) * min(end, float(history.time[-1])) if len(history) else 0.0
    inside = window(history, start, end)
    return history.time[inside], litres(run, history, fluid)[inside]


def leaked_litres(run: RunFolder, scene: Scene, *, fluid: str | None = None, time: float | None = None) -> float:
    """What has escaped [l] by the end, or by `time` [s]."""
    fluid, history = watched(run, fluid)
    out = litres(run, history, fluid)
    if len(out) == 0:
        return 0.0
    return float(out[-1]) if time is None else float(np.interp(time, history.time, out))


def jet_speed(run: RunFolder, scene: Scene, *, fluid: str | None = None, start: float | None = None, end: float = math.inf) -> float | None:
    """Speed [m/s] of the jet, the mean over the mass that escapes between `start` and `end` [s]; None without a jet."""
    _, history = watched(run, fluid)
    inside = window(history, start, end)
    rate, speed = history["rate"][inside], history["jet_speed"][inside]
    good = np.isfinite(speed) & (rate > 0)
    return float(np.average(speed[good], weights=rate[good])) if good.any() else None


def peak_pressure(
    run: RunFolder,
    scene: Scene,
    *,
    x: float | None = None,
    y: float | None = None,
    z: float | None = None,
    within: float | None = None,
    body: str | None = None,
) -> float | None:
    """Largest pressure [Pa] of the frames, the mean over the particles that stand within `within` [m] (default: three
    diameters) of a point; without a point the largest of any particle. None where no particle comes there."""
    file = run.the("fluid", body)
    place = None if x is None and y is None and z is None else np.array([x or 0.0, y or 0.0, z or 0.0])
    peak = None
    for frame in file:
        pressure = frame.point_data["pressure"]
        if place is not None:
            reach = within or 3 * float(np.median(frame.point_data["diameter"]))
            pressure = pressure[np.linalg.norm(frame.points - place, axis=1) <= reach]
            pressure = np.array([pressure.mean()]) if len(pressure) else pressure
        if len(pressure):
            peak = max(float(pressure.max()), -math.inf if peak is None else peak)
    return peak
