"""A column of water between a driven piston and a base with a hole: measures, and the reduced model beside them (docs/piston.md).

The model: N cells of the column (rho, c), which bear no tension; the piston, a mass under a spring that only pushes, which ends on a mass
that falls; water of length `slug` in the hole,

    rho L dv/dt = p - 1/2 rho (v / C)^2,      jet = v / C,      L = slug + 0.85 r

with the speed v over the area of the hole and the contraction C of its jet (0.6 to 0.65 for a sharp rim, detached).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...errors import SceneError
from ...scene import Rigid, Scene
from ..folder import RunFolder
from .fluid import between, diameters, said_of, weight
from .perforation import of

CUTOFF = 75e3  # Hz, of the low pass of the sensor (T annex G)
CELLS = 60


def pressure(run: RunFolder, scene: Scene, face: str, cutoff: float = CUTOFF) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and the mean pressure [Pa] of water on the first face of a rigid body, behind a low pass of that frequency [Hz]."""
    from scipy.signal import butter, sosfiltfilt

    from ...bodies.rigid.faces import points
    from ...couplings.wetted.wetted import FINE

    said: Rigid | None = next((one for one in scene.rigids if one.name == face), None)
    if said is None or not said.faces:
        raise SceneError(f"option 'face': there is no rigid body '{face}' with faces")
    area = points(said.faces[0], FINE * float(diameters(run).min()))[1].sum(axis=0)
    history = of(run, face)
    p = -np.column_stack([history["fx"], history["fy"], history["fz"]]) @ area / (area @ area)
    rate = (len(history) - 1) / max(float(history.time[-1] - history.time[0]), 1e-300) if len(history) > 1 else 0.0
    if len(p) > 30 and cutoff < 0.45 * rate:
        even = np.linspace(history.time[0], history.time[-1], len(p))
        p = np.interp(history.time, even, sosfiltfilt(butter(4, cutoff, fs=rate, output="sos"), np.interp(even, history.time, p)))
    return history.time, p


def face_pressure(run: RunFolder, scene: Scene, *, face: str, start: float, end: float) -> float | None:
    """Mean over time of the pressure [Pa] on a rigid body's first face between two times [s]; None where the run has no two samples."""
    t, p = pressure(run, scene, face)
    inside = (t >= start) & (t <= end * (1 + 1e-9))
    return float(np.trapezoid(p[inside], t[inside]) / np.ptp(t[inside])) if inside.sum() > 1 else None


def face_pressure_peak(run: RunFolder, scene: Scene, *, face: str, start: float = 0.0, end: float = math.inf) -> float | None:
    """Largest pressure [Pa] on a rigid body's first face between two times [s]."""
    t, p = pressure(run, scene, face)
    inside = (t >= start) & (t <= end)
    return float(p[inside].max()) if inside.any() else None


def face_frequency(run: RunFolder, scene: Scene, *, face: str, start: float, low: float = 300.0, high: float = 6000.0) -> float | None:
    """Strongest frequency [Hz] between two of the pressure on a rigid body's first face from `start` [s] on; None where it lasts less than
    two periods of the lowest."""
    t, p = pressure(run, scene, face)
    return frequency(t[t >= start], p[t >= start], low, high)


def frequency(t: np.ndarray, p: np.ndarray, low: float, high: float) -> float | None:
    """Of a signal less its cubic trend, behind Hann's window."""
    if len(t) < 16 or np.ptp(t) * low < 2:
        return None
    even = np.linspace(t[0], t[-1], len(t))
    x = np.linspace(-1, 1, len(t))
    y = np.interp(even, t, p)
    y = (y - np.polyval(np.polyfit(x, y, 3), x)) * np.hanning(len(y))
    n = 2**18
    f, spectrum = np.fft.rfftfreq(n, even[1] - even[0]), np.abs(np.fft.rfft(y, n))
    inside = (f > low) & (f < high)
    peaks = np.flatnonzero(inside[1:-1] & (spectrum[1:-1] > spectrum[:-2]) & (spectrum[1:-1] > spectrum[2:])) + 1
    return float(f[peaks[np.argmax(spectrum[peaks])]]) if len(peaks) else None


def axial_speed(
    run: RunFolder, scene: Scene, *, fluid: str | None = None, top: float, bottom: float, radius: float, start: float, end: float
) -> float | None:
    """Mean speed [m/s] along gravity of the water within `radius` [m] of the axis (0, 0), from height `bottom` to `top` [m], over the
    frames between two times [s]; None where there is none."""
    down = weight(scene)[1]
    found = []
    for _, frame in between(run, start, end, fluid):
        z = -frame.points @ down
        inside = (z > bottom) & (z < top) & (np.hypot(frame.points[:, 0], frame.points[:, 1]) < radius)
        found.append(frame.point_data["velocity"][inside] @ down)
    values = np.concatenate(found) if found else np.zeros(0)
    return float(values.mean()) if len(values) else None


def front_speed(run: RunFolder, scene: Scene, *, fluid: str | None = None, start: float, end: float) -> float | None:
    """Speed [m/s] along gravity of the foremost water between two times [s], as a camera sees it."""
    down = weight(scene)[1]
    frames = between(run, start, end, fluid)
    places = [float((frame.points @ down).max()) for _, frame in frames]
    return float(np.polyfit([t for t, _ in frames], places, 1)[0]) if len(frames) > 1 else None


def model(
    *, speed: float, falling: float, mass: float, stiffness: float, radius: float, height: float, hole: float, slug: float, sound: float,
    contraction: float, duration: float, density: float = 1000.0, gravity: float = 9.81, **_: Any,
) -> dict[str, np.ndarray]:  # fmt: skip
    """Histories of the reduced model: "time" [s], "pressure" [Pa] at the base, "jet" [m/s], "speed" [m/s] of the falling mass.

    speed [m/s], falling [kg], piston mass [kg], stiffness of its stem [N/m], radius and height of the column [m], radius of the hole [m],
    slug [m]: length of the water in it, sound [m/s] in the column."""
    area, opening = math.pi * radius**2, math.pi * hole**2
    length, bulk = slug + 0.85 * hole, density * sound**2
    dt = min(0.35 * height / CELLS / sound, 0.2 * math.sqrt(mass / stiffness))
    steps = math.ceil(duration / dt)
    strain, u = np.zeros(CELLS), np.zeros(CELLS + 1)
    fallen, moved, fall, push, v = 0.0, 0.0, speed, 0.0, 0.0
    out = np.zeros((steps, 4))
    for n in range(steps):
        dx = (height - moved) / CELLS
        p = np.maximum(bulk * strain, 0.0)
        whole = p - 0.1 * density * sound * np.diff(u)  # calms the grid
        u[1:-1] -= dt / (density * dx) * np.diff(whole)
        force = max(stiffness * (fallen - moved), 0.0)
        fall += dt * (gravity - force / falling)
        push += dt * (gravity + (force - whole[0] * area) / mass)
        v = max(v + dt * (whole[-1] - 0.5 * density * (v / contraction) ** 2) / (density * length), 0.0)
        fallen, moved = fallen + dt * fall, moved + dt * push
        u[0], u[-1] = push, v * opening / area
        strain -= dt * np.diff(u) / dx
        out[n] = (n + 1) * dt, whole[-1], v / contraction, fall
    return dict(zip(("time", "pressure", "jet", "speed"), out.T))


def column_ratio(
    run: RunFolder,
    scene: Scene,
    *,
    face: str,
    start: float,
    end: float,
    speed: float,
    falling: float,
    mass: float,
    stiffness: float,
    radius: float,
    height: float,
    hole: float,
    slug: float,
    contraction: float,
    fluid: str | None = None,
) -> float | None:
    """Mean pressure on a rigid body's first face between two times [s] over that of the reduced model (`model`)."""
    ours = face_pressure(run, scene, face=face, start=start, end=end)
    if ours is None:
        return None
    theirs = model(
        speed=speed, falling=falling, mass=mass, stiffness=stiffness, radius=radius, height=height, hole=hole, slug=slug,
        sound=said_of(run, scene, fluid).water.sound, contraction=contraction, duration=end, gravity=weight(scene)[0],
    )  # fmt: skip
    return ours / float(theirs["pressure"][theirs["time"] >= start].mean())
