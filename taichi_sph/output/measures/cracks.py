"""Measures of a crack that runs from a cut: branches, arrival, tip speed, symmetry (B1 of the thesis).

All read the last frame only: the rupture time of each cell holds the whole story. "The crack" is
the set of broken cells linked to the cut (see `pattern`); lengths are reference lengths.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ...scene import Scene
from ..folder import RunFolder
from .fragments import crack_lengths
from .pattern import LINK, SMALL, STRIP, Pattern, pattern

FAR_SHARE = 0.3  # the part of the crack's length, at its end, in which branches are counted
STEADY = 5  # stations in a row with two branches that make a bifurcation
WINDOW = 8  # the speed is a straight line fitted to the front over this many spacings of travel
RISEN = 0.9  # of the median speed: the rise is over


def body_pattern(run: RunFolder, scene: Scene, body: str | None = None, cut: int = 0) -> Pattern:
    """The broken cells of a body at the end of the run, seen from one of its cuts."""
    file = run.the("shell", body)
    cuts = getattr(scene.body(file.name), "cuts", ())
    return pattern(file.body(-1), cuts, int(cut))


def _extent(p: Pattern) -> float:
    """How far ahead of the cut the crack has come [m]; 0 without one."""
    ahead = p.along[p.crack]
    return float(ahead.max()) if len(ahead) >= SMALL else 0.0


def count_branches(p: Pattern, station: float | None = None) -> int:
    """Branches that cross `along` = station; by default the median over the last 30 % of the crack."""
    reach = _extent(p)
    if reach <= 0:
        return 0
    if station is not None:
        return len(p.crossings(station, p.crack))
    stations = p.stations(reach * (1 - FAR_SHARE), reach)
    if len(stations) == 0:  # a crack too short for strips
        return 1
    counts = [len(p.crossings(s, p.crack)) for s in stations]
    return max(1, int(np.median(counts)))


def bifurcation_place(p: Pattern) -> float | None:
    """`along` [m] from which on the crack has two branches or more for 5 stations in a row."""
    if count_branches(p) < 2:
        return None
    stations = p.stations(0.0, _extent(p))
    several = np.array([len(p.crossings(s, p.crack)) >= 2 for s in stations])
    steady = STEADY if len(several) >= STEADY else 1
    run = np.convolve(several, np.ones(steady), mode="valid")
    first = np.flatnonzero(run == steady)
    return float(stations[first[0]]) if len(first) else None


def arrival_time(p: Pattern, within: float = 1.0) -> float | None:
    """When the crack came within `within` spacings of the last row of cells [s]; None: never."""
    there = p.linked[p.crack & (p.left <= (0.501 + within) * p.spacing)]
    return float(there.min()) if len(there) else None


def passing_time(p: Pattern, along: float) -> float | None:
    """When the crack first reached `along` [s]."""
    there = p.linked[p.crack & (p.along >= along)]
    return float(there.min()) if len(there) else None


@dataclass(frozen=True)
class TipHistory:
    """The foremost broken cell of the crack: time [s], along and across [m], speed [m/s], all (n,). Of a crack that has turned aside:
    the farthest along itself.

    `across` is the distance from the line of the cut, so a switch between mirror branches is no jump.
    """

    time: np.ndarray
    along: np.ndarray
    across: np.ndarray
    speed: np.ndarray
    plateau: float


def tip_history(p: Pattern, samples: int = 200) -> TipHistory | None:
    """Front against time, and its speed by straight lines fitted over a moving window.

    The front is the foremost cell linked to the cut at each time; of a crack that kinks (`Pattern.turned`) the farthest along the crack
    itself. Where it advances, its position is
    known; in between it is interpolated. The window is the time of 8 spacings of mean travel, so
    the steps of single cells do not show. The plateau is the mean speed from the end of the rise (90 % of
    the median over the later 60 %) to the end. None for a crack too short for a window.
    """
    come = p.ahead
    ahead = np.flatnonzero(p.crack & (come > 0))
    order = ahead[np.lexsort((-come[ahead], p.linked[ahead]))]
    lead = np.maximum.accumulate(come[order]) if len(order) else np.empty(0)
    record = np.flatnonzero(np.diff(lead, prepend=-np.inf) > 1e-3 * p.spacing)
    if len(record) < 2 * WINDOW or lead[-1] < 2 * WINDOW * p.spacing:
        return None
    t, come, x, y = p.linked[order[record]], lead[record], p.along[order[record]], np.abs(p.across[order[record]])
    distinct = np.append(np.diff(t) > 0, True)  # several cells in one step: the foremost counts
    t, come, x, y = t[distinct], come[distinct], x[distinct], y[distinct]
    if len(t) < WINDOW:
        return None
    half = 0.5 * WINDOW * p.spacing * (t[-1] - t[0]) / (come[-1] - come[0])
    grid = np.linspace(t[0], t[-1], samples)
    front, side = np.interp(grid, t, x), np.interp(grid, t, y)
    speed = np.empty(samples)
    for i, now in enumerate(grid):
        window = np.abs(grid - now) <= half
        local = grid[window] - now
        weight = local - local.mean()
        share = weight / (weight @ weight)
        speed[i] = np.hypot(share @ front[window], share @ side[window])
    late = grid >= t[0] + 0.4 * (t[-1] - t[0])
    risen = int(np.argmax(speed >= RISEN * np.median(speed[late])))
    inside = (np.arange(samples) >= risen) & (grid <= t[-1] - half)  # the last windows are one-sided
    if not inside.any():
        inside = np.arange(samples) >= risen
    return TipHistory(grid, front, side, speed, float(speed[inside].mean()))


# --- the measures -------------------------------------------------------------------------------


def branch_count(run: RunFolder, scene: Scene, *, body: str | None = None, cut: int = 0, station: float | None = None) -> float:
    """Branches of the crack near its end, or `station` metres ahead of the cut's tip. 0: no crack."""
    return float(count_branches(body_pattern(run, scene, body, cut), station))


def edge_arrival(run: RunFolder, scene: Scene, *, body: str | None = None, cut: int = 0, within: float = 1.0) -> float | None:
    """Time [s] at which the crack comes within `within` spacings of the last row of cells at the far edge, of a crack that has turned
    aside at the edge it meets; None: never."""
    return arrival_time(body_pattern(run, scene, body, cut), within)


def tip_speed_plateau(run: RunFolder, scene: Scene, *, body: str | None = None, cut: int = 0) -> float | None:
    """Mean speed [m/s] of the crack's tip after its rise; None for a crack too short to tell."""
    tip = tip_history(body_pattern(run, scene, body, cut))
    return None if tip is None else tip.plateau


def tip_speed_max(run: RunFolder, scene: Scene, *, body: str | None = None, cut: int = 0) -> float | None:
    """Largest speed [m/s] of the crack's tip (windowed): to be compared with the Rayleigh speed."""
    tip = tip_history(body_pattern(run, scene, body, cut))
    return None if tip is None else float(tip.speed.max())


def asymmetry(run: RunFolder, scene: Scene, *, body: str | None = None, cut: int = 0, within: float = 1.0) -> float | None:
    """Share (0 to 1) of the crack's cells without a broken cell within `within` spacings of their mirror
    image about the body's mid-line along the cut; None without a crack."""
    p = body_pattern(run, scene, body, cut)
    here = np.column_stack([p.along[p.crack], p.across[p.crack]])
    if len(here) < SMALL:
        return None
    mirrored = here * [1, -1] + [0, p.low + p.high]
    distance, _ = cKDTree(here).query(mirrored)
    return float(np.mean(distance > (within + 1e-6) * p.spacing))


def bifurcation_time(run: RunFolder, scene: Scene, *, body: str | None = None, cut: int = 0) -> float | None:
    """Time [s] at which the front passes the place where the crack splits for good; None: it does not."""
    p = body_pattern(run, scene, body, cut)
    place = bifurcation_place(p)
    return None if place is None else passing_time(p, place)


def bifurcation_length(run: RunFolder, scene: Scene, *, body: str | None = None, cut: int = 0) -> float | None:
    """Distance [m] from the cut's tip, along the cut, at which the crack splits; None: it does not."""
    return bifurcation_place(body_pattern(run, scene, body, cut))


def crack_start(run: RunFolder, scene: Scene, *, body: str | None = None, cut: int = 0) -> float | None:
    """Time [s] at which the first cell of the crack broke; None without a crack."""
    p = body_pattern(run, scene, body, cut)
    return float(p.linked[p.crack].min()) if p.crack.sum() >= SMALL else None


def crack_length(run: RunFolder, scene: Scene, *, body: str | None = None, cut: int = 0, how: str = "straight") -> float:
    """Length [m] of the crack: "straight", the distance from the cut's tip to its farthest cell; "longest", the longest
    path through linked broken cells of any surface, from a cut or not; "total", the sum of these over all cracks."""
    if how != "straight":
        lengths = crack_lengths(run.the("shell", body).body(-1))
        return float(lengths[:1].sum() if how == "longest" else lengths.sum())
    p = body_pattern(run, scene, body, cut)
    if p.crack.sum() < SMALL:
        return 0.0
    return float(np.hypot(p.along[p.crack], p.across[p.crack]).max() + p.spacing / 2)


def _centre_line(p: Pattern, upto: float) -> tuple[np.ndarray, np.ndarray]:
    """Middle of the crack in each row of cells, followed from the tip up to `along` = upto."""
    rows, middle, last = [], [], 0.0
    cells = p.crack
    for row in np.arange(0.5, upto / p.spacing, 1.0) * p.spacing:
        here = np.sort(p.across[cells & (np.abs(p.along - row) <= 0.5 * p.spacing * 1.001)])
        if len(here) == 0:
            continue
        groups = np.split(here, np.flatnonzero(np.diff(here) > LINK * p.spacing) + 1)
        centres = np.array([(g[0] + g[-1]) / 2 for g in groups])
        last = float(centres[np.argmin(np.abs(centres - last))])
        rows.append(row)
        middle.append(last)
    return np.array(rows), np.array(middle)


def crack_angle(
    run: RunFolder,
    scene: Scene,
    *,
    body: str | None = None,
    cut: int = 0,
    load_x: float | None = None,
    upto: float = 0.8,
) -> float | None:
    """Angle [deg] of the crack to the normal of the cut: 90 straight ahead, less when it leans to the load.

    A straight line is fitted by least squares to the middle of the crack in each row of cells, from the
    tip to `upto` of the ligament (beyond, it turns in the field of the load). `load_x` [m] is where the
    load stands, by default the middle of the body. None for a crack over fewer than 5 rows.
    """
    p = body_pattern(run, scene, body, cut)
    rows, middle = _centre_line(p, upto * p.far)
    if len(rows) < SMALL:
        return None
    lean = float(np.polyfit(rows, middle, 1)[0])
    normal = np.array([-p.direction[1], p.direction[0]])
    ahead = (p.low + p.high) / 2 if load_x is None else float((load_x - p.tip[0]) * normal[0])
    towards = lean * np.sign(ahead) if abs(ahead) > p.spacing else abs(lean)
    return float(np.degrees(np.arctan2(1.0, towards)))


def through_cracks(p: Pattern, span: float = 0.4) -> list[float]:
    """`across` [m] of the cracks that cross the middle of the body, in the direction of the cut.

    A crack counts when its cells span at least `span` of the body in that direction. Each of the strips
    between 40 and 60 % of the body votes on the number; the places are those of a strip that agrees.
    """
    whole = p.far - p.near
    tall = np.zeros(len(p.size), dtype=bool)
    for number in np.flatnonzero(p.size >= SMALL):
        tall[number] = np.ptp(p.along[p.component == number]) >= span * whole
    cells = tall[p.component] if len(p.component) else np.zeros(0, dtype=bool)
    stations = p.stations(p.near + 0.4 * whole - STRIP * p.spacing, p.near + 0.6 * whole + STRIP * p.spacing)
    found = [[float(p.across[g].mean()) for g in p.crossings(s, cells)] for s in stations]
    if not found:
        return []
    agreed = sorted(len(f) for f in found)[len(found) // 2]
    return next(f for f in found if len(f) == agreed)


def crack_count(run: RunFolder, scene: Scene, *, body: str | None = None, cut: int = 0, span: float = 0.4) -> float:
    """Distinct cracks that go through the middle of the body in the direction of the cut."""
    return float(len(through_cracks(body_pattern(run, scene, body, cut), span)))


def crack_width(
    run: RunFolder,
    scene: Scene,
    *,
    body: str | None = None,
    cut: int = 0,
    at: float = 0.5,
    damage: float | None = None,
) -> float | None:
    """Width [m] of the widest band of broken cells, or of cells with at least `damage`, at the share `at`
    of the body in the direction of the cut (0.5: mid-height): extent of the centres in the row of cells
    there, plus one spacing. None where no crack crosses."""
    file = run.the("shell", body)
    last = file.body(-1)
    cuts = getattr(scene.body(file.name), "cuts", ())
    p = pattern(last, cuts, int(cut), None if damage is None else last.cell_data["damage"] >= damage)
    place = p.near + at * (p.far - p.near)
    if len(p.along) == 0:
        return None
    row = p.along[np.argmin(np.abs(p.along - place))]  # one row, so that a slope adds no width
    if abs(row - place) > p.spacing:
        return None
    here = np.sort(p.across[np.abs(p.along - row) <= 0.5 * p.spacing])
    groups = np.split(here, np.flatnonzero(np.diff(here) > LINK * p.spacing) + 1)
    return float(max(np.ptp(g) for g in groups) + p.spacing)
