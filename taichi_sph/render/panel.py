"""A body seen from above, or obliquely where it is not flat, as it goes into a picture: polygons, colours, view. And how it is drawn.

Surfaces are polygons, rigid bodies their balls, fluids a ball for each particle: what a body is made of tells (frame.BodyFrame.form), not
its kind. The page around it (axes, colour bar, titles) is matplotlib's with either renderer, so pictures look alike.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, LineCollection, PolyCollection
from matplotlib.colors import Colormap, LinearSegmentedColormap, Normalize, PowerNorm, to_rgba

from ..bodies.shell.said import PARTICLES
from ..frame import BodyFrame
from ..output.measures.fragments import border

DAMAGE = LinearSegmentedColormap.from_list(
    "damage",
    [(0.0, "#dbe3ea"), (0.15, "#f3d9a4"), (0.4, "#f0a04b"), (0.7, "#c8402f"), (1.0, "#4a0f1f")],
)
SPEED = LinearSegmentedColormap.from_list(
    "speed", [(0.0, "#eef2f5"), (0.25, "#a9cbe0"), (0.55, "#3f86b5"), (0.8, "#1b4f80"), (1.0, "#0b1f3a")]
)
PLASTIC = LinearSegmentedColormap.from_list(
    "plastic",
    [(0.0, "#c3d0da"), (0.12, "#e9dcae"), (0.35, "#f0a04b"), (0.65, "#c8402f"), (1.0, "#4a0f1f")],
)
PRESSURE = LinearSegmentedColormap.from_list(  # of no hue that SPRAY has where both are pale
    "pressure",
    [(0.0, "#f9f4c4"), (0.15, "#d3e279"), (0.35, "#6cc765"), (0.55, "#22978a"), (0.75, "#3b5a8f"), (0.9, "#4b2c7f"), (1.0, "#2a0845")],
)
SPRAY = LinearSegmentedColormap.from_list("spray", [(0.0, "#a9d3ec"), (0.35, "#4a9bd0"), (0.7, "#1b5f9e"), (1.0, "#0b2447")])
OUTLINE = "#9aa5ae"
ELEMENT = "#7d8992"  # outlines of elements
METAL = "#59636b"  # rigid bodies
CORE = "#aab3ba"  # where a section goes through one
DOT = 0.008  # of the width of the window: how large a point without a size is drawn
LOOSE = "#6d5a52"  # nodes without a cell
MARGIN = 0.02  # of the longer side, around the bodies
MOVED = 0.02  # the typical displacement is shown as this share of the longer side
BENT = 0.08  # the same where displacements are what the picture is about
FLAT = 0.02  # a body that is lower than this share of its size is seen from above
TOWARDS = np.array([0.8, -0.9, 0.7])  # from the body to the eye
UPRIGHT = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Look:
    """What the colours mean, and how much displacements are magnified, for one or many panels."""

    field: str  # name of a cell field, or "speed"
    label: str  # with unit; "" where there is nothing to tell, and no colour bar
    colours: Colormap
    low: float
    high: float
    magnification: float
    shown: float = 1.0  # what the colour bar shows, over SI
    loose: bool = False  # nodes without a live cell are drawn too, and no outline of where the body was
    power: float = 1.0  # of the share of the range, by which colours are chosen: below 1 small values are told apart

    def shade(self, values: np.ndarray) -> np.ndarray:
        """Values as places (0 to 1) among the colours."""
        return np.clip((np.asarray(values, float) - self.low) / max(self.high - self.low, 1e-300), 0.0, 1.0) ** self.power

    def bar(self) -> Normalize:
        """What the colour bar shows."""
        low, high = self.low * self.shown, self.high * self.shown
        return Normalize(low, high) if self.power == 1.0 else PowerNorm(self.power, low, high)


@dataclass(frozen=True)
class View:
    """Window [m] on the plane of the picture: that of x and y, or the one that `turn` (3, 3) makes of it."""

    x0: float
    x1: float
    y0: float
    y1: float
    turn: np.ndarray | None = None

    def seen(self, points: np.ndarray) -> np.ndarray:
        """(N, 3) right, up, and towards the eye."""
        return points if self.turn is None else points @ self.turn.T

    @property
    def aspect(self) -> float:
        """Height over width."""
        return (self.y1 - self.y0) / (self.x1 - self.x0)


def round_down(value: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above `value`."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(power * m for m in (5, 2, 1) if power * m <= value * (1 + 1e-9))


def kept(body: BodyFrame) -> np.ndarray:
    """(M,) bool: cells that are drawn; broken ones leave a gap, which opens as the crack does, and hidden ones lie under others."""
    none = np.zeros(len(body.cells))
    return ~(np.asarray(body.cell_data.get("broken", none)).astype(bool) | np.asarray(body.cell_data.get("hidden", none)).astype(bool))


def outlined(body: BodyFrame) -> bool:
    """Whether the cells of a body are outlined: elements beside particles."""
    return "hidden" in body.cell_data and not body.name.endswith(PARTICLES)


def magnification(bodies: Sequence[BodyFrame], moved_to: float = MOVED) -> float:
    """A round factor that makes the typical largest displacement visible; 1 where it is already.

    The displacements that count are those of nodes of sound cells, at the 95th percentile: loose
    particles do not decide.
    """
    largest, size = 0.0, 0.0
    for body in bodies:
        nodes = np.unique(body.cells[kept(body)])
        nodes = nodes[nodes >= 0]
        moved = np.linalg.norm((body.points - body.reference)[nodes], axis=1)
        largest = max(largest, float(np.percentile(moved, 95))) if len(nodes) else largest
        size = max(size, float(np.ptp(body.reference, axis=0).max()))
    if largest <= 0 or size * moved_to <= largest:
        return 1.0
    return round_down(size * moved_to / largest)


def displaced(body: BodyFrame, factor: float) -> np.ndarray:
    """(N, 3) positions with displacements magnified."""
    return body.reference + factor * (body.points - body.reference)


def oblique(towards: np.ndarray = TOWARDS, upright: np.ndarray = UPRIGHT) -> np.ndarray:
    """(3, 3) rows: right, up, towards the eye; `upright` stays vertical on the page."""
    eye = towards / np.linalg.norm(towards)
    right = np.cross(upright, eye)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(eye, right), eye])


def view_of(bodies: Sequence[BodyFrame], factor: float, others: Sequence[BodyFrame] = ()) -> View:
    """The window that holds sound cells of all bodies, with a narrow margin; oblique where one is not flat.

    `others`: the same bodies at other instants, which are to fit too where they leave their plane.
    """
    everything = [*bodies, *others]
    shown = []
    for body in everything:
        nodes = np.unique(body.cells[kept(body)])
        shown += [displaced(body, factor)[nodes[nodes >= 0]], body.reference]
    low = np.array([q.min(axis=0) for q in shown if len(q)]).min(axis=0)
    high = np.array([q.max(axis=0) for q in shown if len(q)]).max(axis=0)
    turn = oblique() if high[2] - low[2] > FLAT * (high - low).max() else None
    if turn is not None:
        # loose pieces fly far: the middle 99.8 % of the nodes is what must fit
        window = View(0, 0, 0, 0, turn)
        seen = [window.seen(q) for q in shown if len(q)]
        low = np.array([np.percentile(q, 0.1, axis=0) for q in seen]).min(axis=0)
        high = np.array([np.percentile(q, 99.9, axis=0) for q in seen]).max(axis=0)
    else:
        low = np.array([q.min(axis=0) for q in shown[: 2 * len(bodies)] if len(q)]).min(axis=0)
        high = np.array([q.max(axis=0) for q in shown[: 2 * len(bodies)] if len(q)]).max(axis=0)
    margin = MARGIN * float((high - low)[:2].max())
    return View(low[0] - margin, high[0] + margin, low[1] - margin, high[1] + margin, turn)


def cell_values(body: BodyFrame, field: str) -> np.ndarray:
    """(M,) values of a cell field; "speed" and "displacement" are means over the corners of
    |velocity| [m/s] and of |displacement| [m]."""
    if field not in ("speed", "displacement") or field in body.cell_data:
        return np.asarray(body.cell_data.get(field, np.zeros(len(body.cells))), dtype=float)
    moves = body.point_data["velocity"] if field == "speed" else body.points - body.reference
    speed = np.linalg.norm(moves, axis=1)
    corner = body.cells >= 0
    return np.where(corner, speed[body.cells], 0.0).sum(axis=1) / corner.sum(axis=1)


def scattered(body: BodyFrame) -> np.ndarray:
    """(N,) bool: nodes of cells that are all broken."""
    corner = body.cells >= 0
    some, alive = np.zeros((2, len(body.points)), dtype=bool)
    some[body.cells[corner]] = True
    whole = np.asarray(body.cell_data.get("broken", np.zeros(len(body.cells)))) == 0
    alive[body.cells[whole][corner[whole]]] = True
    return some & ~alive


def point_values(body: BodyFrame, field: str) -> np.ndarray:
    """(N,) values of a fluid: a field, or "speed" [m/s]."""
    if field == "speed":
        return np.linalg.norm(body.point_data["velocity"], axis=1)
    return np.asarray(body.point_data[field], dtype=float)


def draw(
    axes: Axes,
    bodies: Sequence[BodyFrame],
    look: Look,
    view: View,
    with_vtk: bool,
    wet: Look | None = None,
    cut: tuple[np.ndarray, np.ndarray] | None = None,
) -> None:
    """Draws bodies into axes whose data are millimetres; `look` is that of shells, `wet` that of fluids. `cut`, a point and
    a normal, halves pinballs (with VTK)."""
    mm = 1e3
    axes.set_xlim(view.x0 * mm, view.x1 * mm)
    axes.set_ylim(view.y0 * mm, view.y1 * mm)
    axes.set_aspect("equal")
    for body in bodies if not look.loose else ():  # where the body was: thin line
        ends = view.seen(body.reference)[border(body.cells)][:, :, :2] * mm
        axes.add_collection(LineCollection(list(ends), colors=OUTLINE, linewidths=0.6, zorder=1))
    if with_vtk:
        from .vtk_panel import image

        if view.turn is None:
            _draw_outlines(axes, bodies, look, view)
        box = axes.get_window_extent()
        pixels = image(bodies, look, view, round(box.width), round(box.height), wet, cut)
        axes.imshow(
            pixels,
            extent=(view.x0 * mm, view.x1 * mm, view.y0 * mm, view.y1 * mm),
            interpolation="antialiased",
            aspect="equal",
            zorder=2,
        )
        return
    for body in bodies:
        if body.form not in ("surface", "field", "solid"):
            _draw_balls(axes, body, view, wet)
            continue
        of = look if body.form in ("surface", "solid") else wet
        if of is None:
            continue
        solid = body.form == "solid"
        sound = np.ones(len(body.cells), bool) if solid else kept(body)
        points = view.seen(displaced(body, look.magnification)) * mm
        cells = body.cells[sound]
        if solid:
            colours = np.tile(to_rgba(METAL), (len(cells), 1))
        else:
            colours = of.colours(of.shade(cell_values(body, of.field)[sound]))
        if view.turn is not None:  # the farthest first, and darker where the light grazes
            corner = np.where(cells < 0, cells[:, :1], cells)
            order = np.argsort(points[corner, 2].mean(axis=1), kind="stable")
            cells, colours, corner = cells[order], colours[order], corner[order]
            facing = np.cross(points[corner[:, 2]] - points[corner[:, 0]], points[corner[:, 3]] - points[corner[:, 1]])
            facing[cells[:, 3] < 0] = np.cross(points[corner[:, 1]] - points[corner[:, 0]], points[corner[:, 2]] - points[corner[:, 0]])[
                cells[:, 3] < 0
            ]
            light = np.abs(facing[:, 2]) / np.maximum(np.linalg.norm(facing, axis=1), 1e-300)
            colours[:, :3] *= (0.55 + 0.45 * light)[:, None]
        points = points[:, :2]
        for corners in (3, 4):
            chosen = (cells[:, 3] < 0) if corners == 3 else (cells[:, 3] >= 0)
            axes.add_collection(
                PolyCollection(
                    points[cells[chosen, :corners]],
                    facecolors=colours[chosen],
                    edgecolors=ELEMENT if outlined(body) else colours[chosen],  # closes the hair lines between neighbours
                    linewidths=0.3 if outlined(body) else 0.15,
                    zorder=2,
                    rasterized=True,
                )
            )
    if view.turn is None:
        _draw_outlines(axes, bodies, look, view)


def _draw_outlines(axes: Axes, bodies: Sequence[BodyFrame], look: Look, view: View) -> None:
    """Of the elements beside particles, those of the overlap too."""
    for body in bodies:
        if outlined(body):
            points = view.seen(displaced(body, look.magnification))[:, :2] * 1e3
            corner = np.where(body.cells < 0, body.cells[:, :1], body.cells)
            axes.add_collection(PolyCollection(list(points[corner]), facecolors="none", edgecolors=ELEMENT, linewidths=0.3, zorder=3))


def _draw_balls(axes: Axes, body: BodyFrame, view: View, wet: Look | None) -> None:
    """Pinballs or particles as discs, the farthest first."""
    points = view.seen(body.points) * 1e3
    order = np.argsort(points[:, 2], kind="stable")
    if body.form == "balls":
        across, colours = 2e3 * body.point_data["radius"], np.full(len(points), METAL)
    elif body.form == "points":
        across, colours = np.full(len(points), DOT * 1e3 * (view.x1 - view.x0)), np.full(len(points), METAL)
    elif wet is None:
        return
    else:
        across = 1e3 * body.point_data["diameter"]
        colours = wet.colours(wet.shade(point_values(body, wet.field)))
    size = across[order]
    axes.add_collection(
        EllipseCollection(
            size, size, np.zeros(len(size)), units="xy", offsets=points[order, :2], transOffset=axes.transData,
            facecolors=colours[order], linewidths=0, zorder=1.5 if body.form == "particles" else 2.5, rasterized=True,
        )
    )  # fmt: skip
