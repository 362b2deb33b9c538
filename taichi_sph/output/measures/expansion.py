"""Measures of tubes that an explosive drives outward. The axis of a tube is z, through the middle of its reference."""

from __future__ import annotations

import math

import numpy as np

from ...errors import SceneError
from ...frame import BodyFrame
from ...scene import Scene
from ..folder import RunFolder
from .pattern import node_spacing

LOW, HIGH = 0.25, 0.75  # of what the front has passed, between which a cone is read


def _tube(run: RunFolder, scene: Scene, body: str | None) -> tuple[str, float]:
    """Name and thickness [m]: of the only shell where none is named."""
    shell = next(shell for shell in scene.shells if body in (None, shell.name))
    return shell.name, shell.thickness


def _rings(run: RunFolder, scene: Scene, body: str | None, along: float) -> tuple[np.ndarray, np.ndarray]:
    """(F,) over all frames: radius of the inner wall over that of the start, and its mean speed outward [m/s]; of the nodes that stood
    within a spacing of z = along [m]."""
    name, thickness = _tube(run, scene, body)
    ratios, speeds = [], []
    for frame in run.frames(name):
        reference = frame.reference
        near = np.abs(reference[:, 2] - along) <= node_spacing(reference, frame.cells)
        if not near.any():
            raise SceneError(f"expansion: tube '{name}' has no node near along = {along:g} m")
        across = frame.points[near, :2] - reference[:, :2].mean(axis=0)
        radius = np.linalg.norm(across, axis=1)
        start = np.linalg.norm(reference[near, :2] - reference[:, :2].mean(axis=0), axis=1).mean()
        thin = thickness * start / radius.mean()  # the wall keeps its volume, but for its length
        ratios.append((radius.mean() - 0.5 * thin) / (start - 0.5 * thickness))
        speeds.append(float((np.einsum("ni,ni->n", frame.point_data["velocity"][near, :2], across) / radius).mean()))
    return np.array(ratios), np.array(speeds)


def expansion_speed(run: RunFolder, scene: Scene, *, along: float, ratio: float, body: str | None = None) -> float | None:
    """Speed outward [m/s] of the ring of a tube at z = along [m], where its inner radius has grown to `ratio` times that of the start. None
    where it does not come so far."""
    ratios, speeds = _rings(run, scene, body, along)
    beyond = np.flatnonzero(ratios >= ratio)
    if not len(beyond) or beyond[0] == 0:
        return None
    k = slice(beyond[0] - 1, beyond[0] + 1)
    return float(np.interp(ratio, ratios[k], speeds[k]))


def expansion_speed_max(run: RunFolder, scene: Scene, *, along: float, body: str | None = None) -> float:
    """Largest speed outward [m/s] of the ring of a tube at z = along [m]."""
    return float(_rings(run, scene, body, along)[1].max())


def cone_angle(run: RunFolder, scene: Scene, *, time: float, body: str | None = None) -> float | None:
    """Angle [deg] between axis and wall at the frame nearest to `time` [s], by a line through radius over z, between a quarter and three
    quarters of the length so far moved. None where nothing has moved."""
    name, _ = _tube(run, scene, body)
    frames = run.frames(name)
    return _cone(frames.body(int(np.abs(frames.times - time).argmin())))


def _cone(frame: BodyFrame) -> float | None:
    centre = frame.reference[:, :2].mean(axis=0)
    grown = np.linalg.norm(frame.points[:, :2] - centre, axis=1) - np.linalg.norm(frame.reference[:, :2] - centre, axis=1)
    z = frame.points[:, 2]
    moved = z[grown > 1e-3 * grown.max()] if grown.max() > 0 else z[:0]
    if not len(moved):
        return None
    low, size = moved.min(), np.ptp(moved)
    inside = (z >= low + LOW * size) & (z <= low + HIGH * size)
    if not inside.any() or np.ptp(z[inside]) <= 0.0:
        return None
    slope = np.polyfit(z[inside], grown[inside], 1)[0]
    return float(math.degrees(math.atan(abs(slope))))
