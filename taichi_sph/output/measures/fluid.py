"""Measures of fluids, from their frames: pressure at rest, fronts, outflow, momentum.

Heights are measured against the gravity of the scene. A number over a span of time is the mean over the frames in it.
"""

from __future__ import annotations

import math

import numpy as np

from ...bodies.rigid.solid import solid_of
from ...errors import SceneError
from ...frame import BodyFrame
from ...scene import Fluid, Scene
from ..folder import RunFolder
from .perforation import of, striker_names

# surge front of a column of width a and height 2a (n^2 = 2, a = 2.25 in), T = t sqrt(2 g / a) and Z = x / a:
# Martin and Moyce 1952, table 2, as the dam-break example of the Lethe project has it
MARTIN_MOYCE = np.array([
    (0.41, 1.11), (0.84, 1.23), (1.19, 1.44), (1.43, 1.67), (1.63, 1.89), (1.82, 2.11), (1.97, 2.33),
    (2.20, 2.56), (2.32, 2.78), (2.50, 3.00), (2.64, 3.22), (2.82, 3.44), (2.96, 3.67),
])  # fmt: skip


def between(run: RunFolder, start: float, end: float, fluid: str | None = None) -> list[tuple[float, BodyFrame]]:
    """(time [s], frame) of a fluid from `start` to `end` [s]."""
    file = run.the("fluid", fluid)
    slack = 1e-9 * float(file.times[-1])
    return [(float(t), file.body(i)) for i, t in enumerate(file.times) if start - slack <= t <= end + slack]


def said_of(run: RunFolder, scene: Scene, fluid: str | None) -> Fluid:
    """What the scene says of a fluid."""
    name = run.the("fluid", fluid).name
    return next(f for f in scene.fluids if f.name == name)


def weight(scene: Scene) -> tuple[float, np.ndarray]:
    """Strength [m/s2] and direction of gravity."""
    if scene.gravity is None or not any(scene.gravity):
        raise SceneError("this measure needs the gravity of the scene")
    g = float(np.linalg.norm(scene.gravity))
    return g, np.asarray(scene.gravity) / g


def height(frame: BodyFrame, scene: Scene) -> np.ndarray:
    """(N,) [m]"""
    return -frame.points @ weight(scene)[1]


def column(run: RunFolder, scene: Scene, start: float, fluid: str | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Height [m] and pressure [Pa] of each particle, means over the frames from `start` [s] on."""
    frames = [frame for _, frame in between(run, start, math.inf, fluid)]
    return np.mean([height(f, scene) for f in frames], axis=0), np.mean([f.point_data["pressure"] for f in frames], axis=0)


def diameters(run: RunFolder, fluid: str | None = None) -> np.ndarray:
    """(N,) D_0 of the particles [m]."""
    return run.the("fluid", fluid).array("PointData", "diameter", 0)


def diameter(run: RunFolder, fluid: str | None = None) -> float:
    """The largest D_0 [m]."""
    return float(diameters(run, fluid).max())


def volumes(frame: BodyFrame) -> np.ndarray:
    """(N,) of the particles at rest [m3]."""
    return frame.point_data["diameter"].astype(float) ** 3


def pressure_slope(run: RunFolder, scene: Scene, *, fluid: str | None = None, start: float, skip: float = 3.0) -> float | None:
    """Growth of the mean pressure with depth, over rho g: 1 in water at rest. Leaves out `skip` diameters at top and bottom;
    None where that leaves less than a diameter."""
    z, p = column(run, scene, start, fluid)
    margin = skip * diameter(run, fluid)
    inner = (z > z.min() + margin) & (z < z.max() - margin)
    if not inner.any() or np.ptp(z[inner]) < diameter(run, fluid):
        return None
    return float(-np.polyfit(z[inner], p[inner], 1)[0] / (said_of(run, scene, fluid).water.density * weight(scene)[0]))


def bottom_pressure(run: RunFolder, scene: Scene, *, fluid: str | None = None, start: float, level: float) -> float:
    """Mean pressure of the lowest layer over rho g times its depth below `level` [m]: 1 in water at rest."""
    z, p = column(run, scene, start, fluid)
    low = z < z.min() + 0.5 * float(diameters(run, fluid)[z.argmin()])
    return float(p[low].mean() / (said_of(run, scene, fluid).water.density * weight(scene)[0] * (level - z[low].mean())))


def restlessness(run: RunFolder, scene: Scene, *, fluid: str | None = None, start: float) -> float:
    """Root mean square speed of the particles from `start` [s] on, over that of a fall through the depth of the water."""
    frames = [frame for _, frame in between(run, start, math.inf, fluid)]
    square = np.mean([np.average((f.point_data["velocity"] ** 2).sum(axis=1), weights=volumes(f)) for f in frames])
    return float(np.sqrt(square / (2 * weight(scene)[0] * np.ptp(height(frames[0], scene)))))


def mean_height(run: RunFolder, scene: Scene, *, fluid: str | None = None, time: float = math.inf) -> float:
    """Mean height [m] of the particles of a fluid at the end, or in the frame nearest to `time` [s]."""
    file = run.the("fluid", fluid)
    frame = file.body(file.nearest(min(time, float(file.times[-1]))))
    return float(np.average(height(frame, scene), weights=volumes(frame)))


def front(run: RunFolder, scene: Scene, fluid: str | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and places [m] of the foremost water along x, half a diameter before the centre of a particle."""
    frames = between(run, 0.0, math.inf, fluid)
    half = 0.5 * diameters(run, fluid)
    return np.array([t for t, _ in frames]), np.array([(f.points[:, 0] + half).max() for _, f in frames])


def surge_delay(
    run: RunFolder, scene: Scene, *, fluid: str | None = None, width: float, start: float = 0.0, end: float = math.inf
) -> float | None:
    """By how much later than ours the front of Martin and Moyce 1952 stands at the same place, in T: mean over their points from T =
    `start` to `end`, None where our front reaches none of them; width [m] of the column."""
    t, x = front(run, scene, fluid)
    T = t * math.sqrt(2 * weight(scene)[0] / width)
    theirs, Z = MARTIN_MOYCE.T
    inside = (theirs >= start) & (theirs <= end) & (x[-1] / width >= Z)
    return float(np.mean(theirs[inside] - np.interp(Z[inside], x / width, T))) if inside.any() else None


def surge_deviation(
    run: RunFolder,
    scene: Scene,
    *,
    fluid: str | None = None,
    width: float,
    delay: float | None = None,
    start: float = 0.0,
    end: float = math.inf,
) -> float | None:
    """Largest deviation of the front from Martin and Moyce 1952, over their Z, between the dimensionless times `start` and
    `end` of theirs; width [m] of the column; delay: dimensionless, by which the experiment starts later; None: surge_delay."""
    t, x = front(run, scene, fluid)
    if delay is None:
        delay = surge_delay(run, scene, fluid=fluid, width=width, start=start, end=end)
    if delay is None:
        return None
    T = t * math.sqrt(2 * weight(scene)[0] / width) + delay
    inside = (MARTIN_MOYCE[:, 0] >= start) & (MARTIN_MOYCE[:, 0] <= min(end, T[-1]))
    at, Z = MARTIN_MOYCE[inside].T
    return float(np.abs(np.interp(at, T, x / width) / Z - 1).max()) if inside.any() else None


def surge_speed(run: RunFolder, scene: Scene, *, fluid: str | None = None, width: float, start: float, end: float) -> float:
    """Mean speed dZ/dT of the front between two dimensionless times, over that of Martin and Moyce 1952. No origin of time
    is in it."""
    t, x = front(run, scene, fluid)
    T, Z = t * math.sqrt(2 * weight(scene)[0] / width), x / width
    ours, theirs = (np.interp([start, end], *curve) for curve in ((T, Z), MARTIN_MOYCE.T))
    return float(np.diff(ours)[0] / np.diff(theirs)[0])


def fallen(frame: BodyFrame, scene: Scene, bottom: float) -> np.ndarray:
    """(N,) bool: below `bottom` [m]."""
    return height(frame, scene) < bottom


def head(frame: BodyFrame, scene: Scene, bottom: float, area: float) -> float:
    """Height of the water above `bottom` [m], by the volume of what is left over the area [m2] of the tank."""
    return float(volumes(frame)[~fallen(frame, scene, bottom)].sum() / area)


def outflow(
    run: RunFolder, scene: Scene, *, fluid: str | None = None, bottom: float, area: float, radius: float, start: float, end: float
) -> float:
    """Discharge coefficient of a hole of that radius [m] in the bottom [m] of a tank of that area [m2]: volume that fell through it
    between two times [s] over pi r^2 int sqrt(2 g H) dt, H the head of the moment."""
    frames = between(run, start, end, fluid)
    g = weight(scene)[0]
    speed = [math.sqrt(2 * g * head(f, scene, bottom, area)) for _, f in frames]
    out = [volumes(f)[fallen(f, scene, bottom)].sum() for _, f in frames]
    return float((out[-1] - out[0]) / (math.pi * radius**2 * np.trapezoid(speed, [t for t, _ in frames])))


def core_speed(
    run: RunFolder,
    scene: Scene,
    *,
    fluid: str | None = None,
    bottom: float,
    area: float,
    radius: float,
    start: float,
    end: float,
    below: float = 1.0,
) -> float:
    """Speed of a jet on its axis (0, 0) over Torricelli's sqrt(2 g (H + s)), s the way that a particle has fallen below the hole: mean
    over the particles within half a radius of the axis, `below` to `below` + 1 radii under the hole."""
    g, found = weight(scene)[0], []
    for _, frame in between(run, start, end, fluid):
        s = bottom - height(frame, scene)
        off = np.hypot(frame.points[:, 0], frame.points[:, 1])
        core = (s > below * radius) & (s < (below + 1) * radius) & (off < 0.5 * radius)
        if core.any():
            v = np.linalg.norm(frame.point_data["velocity"][core], axis=1)
            found.append((v / np.sqrt(2 * g * (head(frame, scene, bottom, area) + s[core]))).mean())
    return float(np.mean(found))


def momentum_drift(run: RunFolder, scene: Scene) -> float:
    """Largest change of the momentum of fluids and rigid bodies together, over that at the start. Of scenes without gravity and walls.

    Frames keep single precision: 1e-6 is nothing.
    """
    rigids = {name: of(run, name) for name in striker_names(run)}
    mass = {body.name: solid_of(body, scene).mass for body in scene.rigids}
    density = {fluid.name: fluid.water.density for fluid in scene.fluids}

    def water(frame: BodyFrame) -> np.ndarray:
        return density[frame.name] * (volumes(frame) @ frame.point_data["velocity"].astype(float))

    def solid(t: float) -> np.ndarray:
        each = [mass[n] * np.array([np.interp(t, h.time, h[f"v{a}"]) for a in "xyz"]) for n, h in rigids.items()]
        return np.sum(each, axis=0) if each else np.zeros(3)

    pools = [between(run, 0.0, math.inf, fluid.name) for fluid in scene.fluids]
    sums = np.array([sum(water(frame) for _, frame in instant) + solid(instant[0][0]) for instant in zip(*pools, strict=True)])
    return float(np.linalg.norm(sums - sums[0], axis=1).max() / np.linalg.norm(sums[0]))


def layer_pressure(
    run: RunFolder, scene: Scene, *, fluid: str | None = None, axis: str, low: float, high: float, start: float, end: float
) -> float | None:
    """Mean pressure [Pa] of the particles between two places [m] along an axis, over the frames between two times [s]."""
    c = "xyz".index(axis)
    values, weights = [np.zeros(0)], [np.zeros(0)]
    for _, f in between(run, start, end, fluid):
        there = (f.points[:, c] >= low) & (f.points[:, c] <= high)
        values.append(f.point_data["pressure"][there])
        weights.append(volumes(f)[there])
    found = np.concatenate(values)
    return float(np.average(found, weights=np.concatenate(weights))) if len(found) else None
