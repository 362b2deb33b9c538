"""Measures of thin plates that part along lines known before: flaps that turn, a rim that is cut through, cracks from the tips of slits.

The rim is a circle about an axis along z: of it, each direction counts as severed from when on the first cell broke there, `width` or less
inside of the circle.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.sparse.csgraph import dijkstra

from ...errors import SceneError
from ...frame import BodyFrame
from ...scene import Scene
from ..folder import RunFolder
from .fragments import crack_sets, live, ruptured
from .pattern import SEED, cell_centres, node_spacing

DIRECTIONS = 7200  # of a whole rim: far finer than its cells
ACROSS = 0.02  # sine of the angle between a normal and an axis below which it shows no turn about it
BAND = 2.5  # spacings: how wide a rim is by itself


def _vector_area(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """(3,) sum of normal times area [m2]."""
    p = points[np.where(cells < 0, cells[:, :1], cells)]
    triangle = (cells[:, 3] < 0)[:, None]
    of_four = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
    return 0.5 * np.where(triangle, np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), of_four).sum(axis=0)


def turn_angle(
    run: RunFolder,
    scene: Scene,
    *,
    x: float,
    y: float,
    radius: float,
    z: float = 0.0,
    axis: str = "y",
    time: float | None = None,
    body: str | None = None,
) -> float | None:
    """Angle [deg] about `axis` by which the live cells within `radius` of (x, y, z) [m] of the reference have turned, by their mean normal;
    at the frame nearest to `time` [s], by itself at the end. None where none lives, and where that normal lies along the axis, before or
    after: it does not show a turn about itself."""
    file = run.the("shell", body)
    frame = file.body(-1 if time is None else int(np.argmin(np.abs(np.asarray(file.times) - time))))
    near = np.linalg.norm(cell_centres(frame.reference, frame.cells) - [x, y, z], axis=1) <= radius
    chosen = frame.cells[near & live(frame)]
    if not len(chosen):
        return None
    a, b = ("yz", "zx", "xy")["xyz".index(axis)]
    place = ["xyz".index(a), "xyz".index(b)]
    whole = [_vector_area(points, chosen) for points in (frame.reference, frame.points)]
    before, now = (area[place] for area in whole)
    if any(np.hypot(*area[place]) < ACROSS * np.linalg.norm(area) for area in whole):
        return None
    return abs(math.degrees(math.atan2(before[0] * now[1] - before[1] * now[0], before @ now)))


def severed(body: BodyFrame, centre: tuple[float, float], radius: float, width: float) -> np.ndarray:
    """(K,) when [s] the rim was cut through in each direction in which the body has cells there; inf: not yet."""
    middle = cell_centres(body.reference, body.cells)[:, :2] - centre
    away = np.hypot(*middle.T)
    chosen = np.flatnonzero((away >= radius - width) & (away <= radius))
    corners = np.where(body.cells < 0, body.cells[:, :1], body.cells)[chosen]
    along = np.arctan2(middle[chosen, 1], middle[chosen, 0])
    places = body.reference[corners][..., :2] - centre
    aside = np.mod(np.arctan2(places[..., 1], places[..., 0]) - along[:, None] + np.pi, 2 * np.pi) - np.pi
    step = 2 * np.pi / DIRECTIONS
    first = np.rint((along + aside.min(axis=1)) / step).astype(int)
    last = np.rint((along + aside.max(axis=1)) / step).astype(int)
    broke = np.where(ruptured(body), np.asarray(body.cell_data["rupture_time"], dtype=float), np.inf)[chosen]
    when, there = np.full(DIRECTIONS, np.inf), np.zeros(DIRECTIONS, bool)
    for low, high, time in zip(first, last, broke):
        own = np.arange(low, max(high, low + 1)) % DIRECTIONS
        there[own] = True
        when[own] = np.minimum(when[own], time)
    return when[there]


def _severed(run: RunFolder, body: str | None, x: float, y: float, radius: float, width: float | None) -> np.ndarray:
    if width is not None and not width > 0.0:
        raise SceneError(f"option 'width' is above 0 m, not {width:g}; leave it out for {BAND:g} spacings")
    last = run.the("shell", body).body(-1)
    found = severed(last, (x, y), radius, BAND * node_spacing(last.reference, last.cells) if width is None else width)
    if not len(found):
        raise SceneError(f"the shell has no cell at the rim of radius {radius:g} m about ({x:g}, {y:g}) m")
    return found


def rim_severed(
    run: RunFolder, scene: Scene, *, radius: float, x: float = 0.0, y: float = 0.0, width: float | None = None, body: str | None = None
) -> float:
    """Share (0 to 1) of the length of a rim that is cut through at the end, within `width` [m] of it, by itself 2.5 spacings."""
    return float(np.isfinite(_severed(run, body, x, y, radius, width)).mean())


def rim_severed_at(
    run: RunFolder,
    scene: Scene,
    *,
    radius: float,
    share: float = 1.0,
    x: float = 0.0,
    y: float = 0.0,
    width: float | None = None,
    body: str | None = None,
) -> float | None:
    """When [s] a `share` (0 to 1) of the length of a rim was cut through (see rim_severed); None: never."""
    if not 0.0 < share <= 1.0:
        raise SceneError(f"option 'share' is above 0 and at most 1, not {share:g}")
    when = np.sort(_severed(run, body, x, y, radius, width))
    time = float(when[math.ceil(share * len(when) - 1e-9) - 1])
    return time if math.isfinite(time) else None


def tip_crack_length(run: RunFolder, scene: Scene, *, x: float, y: float, z: float = 0.0, body: str | None = None) -> float:
    """Length [m] of the crack from the tip (x, y, z) [m] of a slit: the longest of the shortest ways through linked broken cells that begin
    within 3 spacings of it; 0 without one."""
    cracks = crack_sets(run.the("shell", body).body(-1))
    away = np.linalg.norm(cracks.centres - [x, y, z], axis=1)
    start = np.flatnonzero(away <= SEED * cracks.spacing)
    if not len(start):
        return 0.0
    ways = dijkstra(cracks.graph.tocsr(), directed=False, indices=start) + away[start][:, None]
    nearest = ways.min(axis=0)
    return float(nearest[np.isfinite(nearest)].max()) + 0.5 * cracks.spacing
