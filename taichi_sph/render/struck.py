"""Pictures of bodies that are struck, perforated or leak: true deformation, seen from the struck side, from behind, and cut open.

The flight of the fastest rigid body at the start says which side is struck. Broken cells are not drawn, so that cracks
and holes are seen through; fragments and loose nodes are. A section takes away the half nearer to the eye, along the flight
and the upright axis, and shows the pressure of the water on its plane. Water that is out is drawn as drops, coloured by their speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.figure import Figure

from ..bodies.shell.said import PARTICLES
from ..frame import BodyFrame
from ..output.folder import RunFolder
from ..output.measures.fragments import flight, fragments, ruptured, thrown_solids
from ..output.measures.leak import tanks
from ..output.measures.pattern import cell_centres, node_spacing
from . import plots
from .backend import Backend
from .panel import DAMAGE, PLASTIC, PRESSURE, SPRAY, UPRIGHT, Look, View, oblique
from .section import chosen, cut_open
from .sheet import Shot, sheet

STRIP_TIMES = 5
AROUND = 0.5  # of its width, how far from a shell things are still shown
LONGER = 1.2  # along x over along y, from which on a section without a striker lies along x
PLANE = 3.0  # sizes of all shells together: a ball of a larger radius is not drawn
LARGE = 0.1  # of a shell's width: a striker of a larger radius is halved in sections
SMALL = 0.5  # of the overview's height: smaller shells are shown alone in a window of their own
DROP = 0.6  # of its diameter: how large a particle is drawn once it is out
CLOSE = 1.35  # the close-up shows this much more than the broken cells
NEAR_ENOUGH = 0.8  # a close-up that shows more of the body than this is left out
UNLIKE = 4.0  # times as large: runs that are drawn to their own scales
THIN = 0.25  # a fluid that is thinner than this share of its size is seen from the side
REACHED = 98.0  # % of the particles under pressure, whose pressure the colours tell apart
LOW = 0.2  # of that range: where half of them are below, colours follow the root, so that water at rest is a gradient beside a shock
PRESSURES = ((1.0, "Pa"), (1e-3, "kPa"), (1e-6, "MPa"), (1e-9, "GPa"))


def applies(run: RunFolder) -> bool:
    """Whether the run has bodies other than shells: rigid ones, fluids, solids that strike them."""
    return bool(run.of_kind("rigid") or run.of_kind("fluid") or (run.of_kind("shell") and thrown_solids(run)))


def suffers(run: RunFolder) -> bool:
    """Whether a shell is what is looked at: struck, or a tank from which water may leak."""
    return bool(run.of_kind("shell")) and (flight(run) is not None or bool(tanks(run)))


def hidden(run: RunFolder) -> list[str]:
    """Explosives beside shells: their gas would hide what it drives."""
    return [solid.name for solid in run.scene.solids if solid.material.burns is not None] if run.of_kind("shell") else []


def whole(run: RunFolder, index: int) -> list[BodyFrame]:
    """All bodies of a frame, without those that are `hidden`."""
    return [run.frames(name).body(index) for name in run.bodies() if name not in hidden(run)]


def bodies_at(run: RunFolder, index: int) -> list[BodyFrame]:
    """`whole`, without balls much wider than the shells: such a ball stands for a plane, and would hide what it touches."""
    bodies = whole(run, index)
    if not run.of_kind("shell"):
        return bodies
    most = PLANE * float(np.linalg.norm(np.subtract(*box(run))))
    seen = [chosen(body, body.point_data["radius"] <= most) if body.form == "balls" else body for body in bodies]
    return [body for body in seen if len(body.points)]


def _round_up(value: float) -> float:
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * next(m for m in (1, 1.5, 2, 3, 4, 5, 6, 8, 10) if m * power >= value * (1 - 1e-9)))


# --- colours ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Looks:
    """One set of colours for all pictures of some runs."""

    shell: Look
    pressure: Look
    speed: Look
    density: Look  # tells fluids apart


def looks_of(runs: Sequence[RunFolder], instants: Sequence[int] | None = None) -> Looks:
    """Plastic strain where a metal has any, else damage; pressure and speed up to what all but a few particles reach, at some instants
    (None: twelve of the whole run)."""
    plastic, speed = [0.0], [0.0]
    for run in runs:
        for file in run.of_kind("shell"):
            last = file.body(-1)
            if "plastic" in last.cell_data:
                plastic.append(float(np.percentile(last.cell_data["plastic"], 99.8)))
        for file in run.of_kind("fluid"):
            for index in _instants(len(file), instants):
                speeds = np.linalg.norm(file.array("PointData", "velocity", index), axis=1)
                out = file.array("PointData", "outside", index) != 0
                speed.append(float(np.percentile(speeds[out] if out.any() else speeds, 98)))
    if max(plastic) > 0:
        shell = Look("plastic", "plastic strain [-]", PLASTIC, 0.0, _round_up(max(plastic)), 1.0, loose=True)
    else:
        soft = any(shell.material.damage for run in runs for shell in run.scene.shells)
        shell = Look("damage", "damage D [-]" if soft else "", DAMAGE, 0.0, 1.0, 1.0, loose=True)
    return Looks(
        shell,
        pressure_look(runs, instants),
        Look("speed", "speed of fluid [m/s]", SPRAY, 0.0, _round_up(max(max(speed), 1e-6)), 1.0),
        Look("density", "density of fluid [kg/m3]", SPRAY, min(densities(runs), default=0.0), max(densities(runs), default=1.0), 1.0),
    )


def _instants(frames: int, instants: Sequence[int] | None) -> Sequence[int]:
    return range(0, frames, max(1, frames // 12)) if instants is None else instants


def pressure_look(runs: Sequence[RunFolder], instants: Sequence[int] | None = None) -> Look:
    """Pressure of fluids, up to what all but a few of the particles under pressure reach at the instants that are shown."""
    found = [
        np.asarray(file.array("PointData", "pressure", index), float)
        for run in runs
        for file in run.of_kind("fluid")
        for index in _instants(len(file), instants)
    ]
    pressed = np.concatenate([p[p > 0.0] for p in found] or [np.zeros(0)])
    top = _round_up(max(float(np.percentile(pressed, REACHED)), 1.0)) if len(pressed) else 1.0
    power = 0.5 if len(pressed) and float(np.median(pressed)) < LOW * top else 1.0
    factor, unit = next(((f, u) for f, u in PRESSURES if top * f < 1000), PRESSURES[-1])
    return Look("pressure", f"pressure of fluid [{unit}]", PRESSURE, 0.0, top, 1.0, factor, power=power)


def densities(runs: Sequence[RunFolder]) -> set[float]:
    """At rest [kg/m3], of all fluids."""
    return {fluid.water.density for run in runs for fluid in run.scene.fluids}


# --- where to look from -------------------------------------------------------------------------


@dataclass(frozen=True)
class Sides:
    """Rotations (3, 3) of the views: front (the struck side), back, section; `removed` (3,) points from the plane of the
    section to the eye."""

    direction: np.ndarray
    front: np.ndarray
    back: np.ndarray
    section: np.ndarray
    removed: np.ndarray


def sides(run: RunFolder) -> Sides:
    """From the flight of the striker; without one, from -y, and the section along what is longer across."""
    path = flight(run)
    d = path[1] if path is not None else np.array([0.0, 1.0, 0.0])
    if abs(d @ UPRIGHT) > 0.9:  # a flat body, struck from above or below
        aside = np.array([0.35, -0.75, 0.0])
        front, back = -0.75 * d + aside, 0.75 * d + aside
        removed = np.array([0.0, -1.0, 0.0])
        eye = removed - 0.18 * d
    else:
        aside = np.cross(d, UPRIGHT)
        aside /= np.linalg.norm(aside)
        front, back = -d + 0.4 * aside + 0.3 * UPRIGHT, d + 0.4 * aside + 0.3 * UPRIGHT
        low, high = box(run)
        if path is None and (high - low)[0] > LONGER * (high - low)[1]:
            removed, d_section = np.array([0.0, -1.0, 0.0]), np.array([1.0, 0.0, 0.0])
        else:
            removed, d_section = aside, d
        eye = removed - 0.35 * d_section + 0.22 * UPRIGHT
    return Sides(d, oblique(front), oblique(back), oblique(eye), removed)


def box(run: RunFolder) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest coordinates (3,) [m] of the shells' reference."""
    points = np.concatenate([file.body(0).reference for file in run.of_kind("shell")])
    return points.min(axis=0), points.max(axis=0)


def middle(run: RunFolder) -> np.ndarray:
    """(3,) of the box [m]."""
    low, high = box(run)
    return 0.5 * (low + high)


def middles(run: RunFolder) -> dict[str, np.ndarray]:
    """By the name of each body the middle (3,) [m] of the shell that its section goes through: its own, else the nearest one's."""
    shells = {}
    for file in run.of_kind("shell"):
        reference = file.body(0).reference
        shells[file.name] = 0.5 * (reference.min(axis=0) + reference.max(axis=0))
    found = {}
    for name in run.bodies():
        centre = shells[name] if name in shells else run.frames(name).body(0).reference.mean(axis=0)
        found[name] = min(shells.values(), key=lambda at: float(np.linalg.norm(at - centre)))
    return found


def striker_radius(run: RunFolder) -> float:
    """Of the largest pinball that is drawn [m]."""
    balls = [body for body in bodies_at(run, 0) if body.form == "balls"]
    return max((float(body.point_data["radius"].max()) for body in balls), default=0.0)


def outside_only(bodies: Sequence[BodyFrame]) -> list[BodyFrame]:
    """Without the water that is still inside; what is out is drawn as smaller drops."""
    found = []
    for body in bodies:
        if body.form == "particles":
            body = chosen(body, body.outside)
            body = replace(body, point_data={**body.point_data, "diameter": DROP * body.point_data["diameter"]})
        found.append(body)
    return found


def dry(bodies: Sequence[BodyFrame]) -> list[BodyFrame]:
    """Surfaces only."""
    return [body for body in bodies if body.form == "surface"]


# --- windows --------------------------------------------------------------------------------------


def window(points: np.ndarray, turn: np.ndarray, margin: float = 0.03) -> View:
    """The window that holds points (N, 3) [m]."""
    seen = points @ turn.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    room = margin * float((high - low)[:2].max())
    return View(low[0] - room, high[0] + room, low[1] - room, high[1] + room, turn)


def together(views: Sequence[View]) -> View | list[View]:
    """One window that holds all, so that a page has one scale; where one of them would be small in it, windows of their own, of one
    aspect."""
    sizes = [max(v.x1 - v.x0, v.y1 - v.y0) for v in views]
    if max(sizes) <= UNLIKE * min(sizes):
        return View(min(v.x0 for v in views), max(v.x1 for v in views), min(v.y0 for v in views), max(v.y1 for v in views), views[0].turn)
    aspect = float(np.exp(np.mean(np.log([v.aspect for v in views]))))
    found = []
    for v in views:
        wide = max(v.x1 - v.x0, (v.y1 - v.y0) / aspect)
        x, y = 0.5 * (v.x0 + v.x1), 0.5 * (v.y0 + v.y1)
        found.append(View(x - wide / 2, x + wide / 2, y - wide * aspect / 2, y + wide * aspect / 2, v.turn))
    return found


def shown_points(run: RunFolder, instants: Sequence[int]) -> np.ndarray:
    """What an overview is to hold: the held parts of shells, and strikers, fragments and spray not far from them."""
    low, high = box(run)
    room = max(AROUND * float(np.median(high - low)), 2.5 * striker_radius(run))
    found = []

    def near(points: np.ndarray) -> np.ndarray:
        return np.all((points >= low - room) & (points <= high + room), axis=1)

    for index in instants:
        for body in bodies_at(run, index):
            if body.kind == "shell":
                found += [body.reference, body.points[~fragments(body).gone]]
            away = body.points if body.form != "particles" else body.points[body.outside]
            here = away[near(away)]
            if body.form == "balls" and len(here):
                radius = float(body.point_data["radius"].max())
                here = np.concatenate([here - radius, here + radius])
            found.append(here)
    return np.concatenate(found)


def close_up(run: RunFolder, shell: str, turn: np.ndarray, side: float) -> View | None:
    """Around the broken cells of one side of a shell (`side` -1: struck, +1: behind), where they take a small part of it."""
    direction, body = sides(run).direction, run.frames(shell).body(-1)
    broke = ruptured(body)
    centres, size = cell_centres(body.reference, body.cells), np.ptp(body.reference, axis=0).max()
    if np.ptp(body.reference @ direction) > 0.2 * size:  # deep: a tank has two sides
        broke &= (centres - middles(run)[shell]) @ direction * side > 0
    if not broke.any():
        return None
    place = centres[broke].mean(axis=0)
    reach = CLOSE * max(
        float(np.percentile(np.linalg.norm(centres[broke] - place, axis=1), 97)), 5 * node_spacing(body.reference, body.cells)
    )
    if 2 * reach > NEAR_ENOUGH * size:
        return None
    near = np.linalg.norm(body.reference - place, axis=1) <= reach
    held = ~fragments(body).gone & near
    return window(body.points[held] if held.any() else body.reference[near], turn, 0.06)


# --- the pages ------------------------------------------------------------------------------------


def strip_instants(run: RunFolder) -> list[int]:
    """Frames that show how it ruptured."""
    broke = np.concatenate([np.zeros(0), *(_broke_at(file.body(-1)) for file in run.of_kind("shell"))])
    return instants(np.asarray(run.frames().times), broke, bool(run.of_kind("fluid")))


def instants(times: np.ndarray, broke: np.ndarray, fluid: bool, count: int = STRIP_TIMES) -> list[int]:
    """Of frames at those times [s] the first with a rupture, those by which a third, two thirds and all of the broken cells broke, and the
    end; then the middles of the longest gaps. broke (K,) [s]. Without a rupture even times; in a fluid the early ones stand closer, for
    its pressure waves."""
    last = len(times) - 1
    if not len(broke):
        wanted = times[0] + (times[-1] - times[0]) * np.linspace(0, 1, count) ** (1.5 if fluid else 1.0)
    else:
        wanted = np.append(np.quantile(broke, np.linspace(0, 1, count - 1)), times[-1])
        wanted[0] *= 1.05
    found = {min(int(np.searchsorted(times, t * (1 - 1e-9))), last) for t in wanted}
    while len(found) < min(count, last):
        chosen = sorted(found)
        gap, start = max((b - a, a) for a, b in zip(chosen, chosen[1:])) if len(chosen) > 1 else (0, 0)
        if gap < 2:
            break
        found.add(start + gap // 2)
    return sorted(found)


def _broke_at(body: BodyFrame) -> np.ndarray:
    """When [s] the cells of a shell broke that did during the run."""
    return np.asarray(body.cell_data["rupture_time"], dtype=float)[ruptured(body)] if "rupture_time" in body.cell_data else np.zeros(0)


def _when(run: RunFolder, index: int) -> str:
    times = run.frames().times
    scale, unit = plots.time_scale(float(times[-1]))
    return f"t = {times[index] * scale:.3g} {unit}"


def _side_view(run: RunFolder) -> np.ndarray:
    """What is thin is seen along its thinnest axis, anything else obliquely."""
    points = np.concatenate([run.frames(name).body(0).reference for name in run.bodies()])
    extent = np.ptp(points, axis=0)
    thin = int(np.argmin(extent[:2]))
    if extent[thin] > THIN * extent.max():
        return oblique()
    eye = np.zeros(3)
    eye[thin] = -1.0 if thin == 1 else 1.0
    return oblique(eye)


def _most(body: BodyFrame, turn: np.ndarray) -> np.ndarray:
    """(2, 3) corners, along the axes of the picture, of a box that holds all but a few particles [m]."""
    low, high = np.percentile(body.points @ turn.T, [0.2, 99.8], axis=0)
    radius = 0.5 * float(np.median(body.point_data["diameter"]))
    return np.array([low - radius, high + radius]) @ turn


def free_strip(run: RunFolder, looks: Looks, field: str, backend: Backend, instants: Sequence[int], subtitle: str, dpi: int) -> Figure:
    """All bodies at some instants where no shell is struck or leaks, fluids coloured by "pressure", "density" or "speed"."""
    pressure = pressure_look([run], instants) if len(instants) > 1 else looks.pressure  # a movie has one range
    look = {"pressure": pressure, "density": looks.density}.get(field, looks.speed)
    turn = _side_view(run)
    everything = [b for i in range(0, len(run.frames().times), max(1, len(run.frames().times) // 12)) for b in bodies_at(run, i)]
    points = [_most(b, turn) if b.form == "particles" else b.points for b in everything]
    radii = [b.points + s * b.point_data["radius"][:, None] for b in everything if b.form == "balls" for s in (-1, 1)]
    view = window(np.concatenate([*points, *radii]), turn)
    shots = [Shot(bodies_at(run, i), view, _when(run, i), looks.shell, look) for i in instants]
    columns = 1 if len(shots) == 1 else 3 if view.aspect > 0.8 else 2
    return sheet([shots[i : i + columns] for i in range(0, len(shots), columns)], run.scene.title, subtitle, backend, dpi)


def views_of(run: RunFolder, instants: Sequence[int]) -> dict[str, View]:
    """Windows of the overviews that hold all `instants`, all of one height, so that a page has one scale. "dry", of the shells alone: that
    of the front, or their own where they are small in it."""
    s, points = sides(run), shown_points(run, instants)
    views = {name: window(points, getattr(s, name)) for name in ("front", "back", "section")}
    tall = max(v.y1 - v.y0 for v in views.values())
    views = {name: replace(v, y0=(v.y0 + v.y1 - tall) / 2, y1=(v.y0 + v.y1 + tall) / 2) for name, v in views.items()}
    held = [b.points[~fragments(b).gone] for i in instants for b in bodies_at(run, i) if b.kind == "shell"]
    own = window(np.concatenate([*held, run.of_kind("shell")[0].body(0).reference]), s.front)
    return views | {"dry": own if max(own.x1 - own.x0, own.y1 - own.y0) < SMALL * tall else views["front"]}


def shots_at(run: RunFolder, index: int, looks: Looks, views: dict[str, View], names: Sequence[str], prefix: str = "") -> list[Shot]:
    """Views named "front", "back", "section", or "dry" (the front without water) of one instant."""
    s, bodies = sides(run), bodies_at(run, index)
    titles = {"front": "struck side", "back": "rear side", "section": "section", "dry": "struck side, shell alone"}
    if flight(run) is None:
        titles["front"] = "from outside"
    # a large striker would hide what a section is to show; a small one is to be seen
    low, high = box(run)
    halved = (middle(run), s.removed) if striker_radius(run) > LARGE * float(np.median(high - low)) else None
    found = []
    for name in names:
        inside = name == "section"
        shown = cut_open(bodies, middles(run), s.removed) if inside else dry(bodies) if name == "dry" else outside_only(bodies)
        text = f"{prefix}{', ' if prefix else ''}{titles[name]}"
        wet, cut = (looks.pressure, halved) if inside else (looks.speed, None)
        found.append(Shot(shown, views[name], text, looks.shell, wet, cut))
    return found


def final_page(run: RunFolder, looks: Looks, backend: Backend, subtitle: str, index: int = -1, dpi: int = 170) -> Figure:
    """The end: overviews from both sides and cut open, then close-ups around what broke."""
    names = ("front", "section", "dry", "back") if run.of_kind("fluid") else ("front", "section", "back")
    now = replace(looks, pressure=pressure_look([run], [index]))
    rows = [shots_at(run, index, now, views_of(run, [index]), names)]
    s, shells, close = sides(run), list(dict.fromkeys(file.name.removesuffix(PARTICLES) for file in run.of_kind("shell"))), []
    for shell in shells:
        whose = f"{shell}, " if len(shells) > 1 else ""
        parts = [run.frames(name).body(index) for name in dict.fromkeys((shell, run.torn(shell)))]  # elements, too
        for turn, side, name in ((s.front, -1.0, "struck side, close"), (s.back, 1.0, "rear side, close")):
            view = close_up(run, run.torn(shell), turn, side)
            if view is not None:
                close.append(Shot(parts, view, whose + name, looks.shell))
    rows += [close[k : k + 2] for k in range(0, len(close), 2)]
    return sheet(rows, run.scene.title, subtitle, backend, dpi)


def strip_page(run: RunFolder, looks: Looks, backend: Backend, subtitle: str, instants: Sequence[int]) -> Figure:
    """Some instants: cut open above; below from behind where it is flat, from the struck side where it is a tank; where there is water,
    which would hide how the shell tears, the shell alone."""
    views, looks = views_of(run, instants), replace(looks, pressure=pressure_look([run], instants))
    outer = "dry" if run.of_kind("fluid") else "back" if abs(sides(run).direction @ UPRIGHT) > 0.9 else "front"
    columns = [shots_at(run, i, looks, views, ("section", outer), _when(run, i)) for i in instants]
    columns = [columns[0]] + [[replace(s, name=_when(run, i)) for s in c] for c, i in zip(columns[1:], instants[1:], strict=True)]
    return sheet([[c[0] for c in columns], [c[1] for c in columns]], run.scene.title, subtitle, backend)


def compare_page(runs: Sequence[RunFolder], names: Sequence[str], title: str, backend: Backend) -> Figure:
    """The ends of several runs side by side, from outside (with water: the shell alone, which it hides) and cut open, to one scale and
    in the same colours."""
    looks = looks_of(runs, [-1])
    rows: list[list[Shot]] = [[], []]
    boxes = [views_of(run, [-1]) for run in runs]
    unlike = False
    outer = "dry" if any(run.of_kind("fluid") for run in runs) else "front"
    for name in (outer, "section"):
        shared = together([box[name] for box in boxes])
        unlike = unlike or isinstance(shared, list)
        for k, box in enumerate(boxes):
            box[name] = replace(shared[k] if isinstance(shared, list) else shared, turn=box[name].turn)
    for run, box, name in zip(runs, boxes, names, strict=True):
        front, section = shots_at(run, -1, looks, box, (outer, "section"), f"{name}, {_when(run, len(run.frames()) - 1)}")
        rows[0].append(front)
        rows[1].append(section)
    if all(shot.view.aspect > 1 for row in rows for shot in row) and len(runs) <= 3:  # tall bodies stand side by side
        rows = [[*rows[0], *rows[1]]]
    words = "at the end of each run, true deformation   ·   broken cells removed"
    return sheet(rows, title, words + ("   ·   sizes are unlike: each run to its own scale" if unlike else ""), backend)
