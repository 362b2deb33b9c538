"""A body seen from above, as it goes into a picture: polygons, colours, view. And how it is drawn.

The page around it (axes, colour bar, titles) is matplotlib's with either renderer, so pictures look alike.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Colormap, LinearSegmentedColormap, Normalize

from ..output.frame import BodyFrame

DAMAGE = LinearSegmentedColormap.from_list(
    "damage",
    [(0.0, "#dbe3ea"), (0.15, "#f3d9a4"), (0.4, "#f0a04b"), (0.7, "#c8402f"), (1.0, "#4a0f1f")],
)
SPEED = LinearSegmentedColormap.from_list(
    "speed", [(0.0, "#eef2f5"), (0.25, "#a9cbe0"), (0.55, "#3f86b5"), (0.8, "#1b4f80"), (1.0, "#0b1f3a")]
)
OUTLINE = "#9aa5ae"
MARGIN = 0.02  # of the longer side, around the bodies
MOVED = 0.02  # the typical displacement is shown as this share of the longer side


@dataclass(frozen=True)
class Look:
    """What the colours mean, and how much displacements are magnified, for one or many panels."""

    field: str  # name of a cell field, or "speed"
    label: str  # with unit
    colours: Colormap
    low: float
    high: float
    magnification: float


@dataclass(frozen=True)
class View:
    """Window on the plane [m]."""

    x0: float
    x1: float
    y0: float
    y1: float

    @property
    def aspect(self) -> float:
        """Height over width."""
        return (self.y1 - self.y0) / (self.x1 - self.x0)


def round_down(value: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above `value`."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(power * m for m in (5, 2, 1) if power * m <= value * (1 + 1e-9))


def kept(body: BodyFrame) -> np.ndarray:
    """(M,) bool: cells that are drawn; broken ones leave a gap, which opens as the crack does."""
    return ~np.asarray(body.cell_data.get("broken", np.zeros(len(body.cells)))).astype(bool)


def magnification(bodies: Sequence[BodyFrame]) -> float:
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
    if largest <= 0 or size * MOVED <= largest:
        return 1.0
    return round_down(size * MOVED / largest)


def displaced(body: BodyFrame, factor: float) -> np.ndarray:
    """(N, 3) positions with displacements magnified."""
    return body.reference + factor * (body.points - body.reference)


def view_of(bodies: Sequence[BodyFrame], factor: float) -> View:
    """The window that holds sound cells of all bodies, with a narrow margin."""
    lo, hi = np.full(2, np.inf), np.full(2, -np.inf)
    for body in bodies:
        nodes = np.unique(body.cells[kept(body)])
        shown = np.concatenate([displaced(body, factor)[nodes[nodes >= 0], :2], body.reference[:, :2]])
        lo, hi = np.minimum(lo, shown.min(axis=0)), np.maximum(hi, shown.max(axis=0))
    margin = MARGIN * float((hi - lo).max())
    return View(lo[0] - margin, hi[0] + margin, lo[1] - margin, hi[1] + margin)


def cell_values(body: BodyFrame, field: str) -> np.ndarray:
    """(M,) values of a cell field; "speed" is the mean of |velocity| over the corners [m/s]."""
    if field != "speed":
        return np.asarray(body.cell_data[field], dtype=float)
    speed = np.linalg.norm(body.point_data["velocity"], axis=1)
    corner = body.cells >= 0
    return np.where(corner, speed[body.cells], 0.0).sum(axis=1) / corner.sum(axis=1)


def border(body: BodyFrame) -> np.ndarray:
    """(E, 2) node numbers of the edges that belong to one cell only: the outline of the whole body."""
    cells = body.cells
    following = np.roll(cells, -1, axis=1)
    triangles = cells[:, 3] < 0
    following[triangles, 2] = cells[triangles, 0]
    edges = np.sort(np.column_stack([cells.ravel(), following.ravel()]), axis=1)
    edges = edges[(edges >= 0).all(axis=1)]
    nodes = len(body.points)
    key, count = np.unique(edges[:, 0].astype(np.int64) * nodes + edges[:, 1], return_counts=True)
    return np.column_stack(np.divmod(key[count == 1], nodes))


def draw(axes: Axes, bodies: Sequence[BodyFrame], look: Look, view: View, with_vtk: bool) -> None:
    """Draws bodies into axes whose data are millimetres."""
    mm = 1e3
    axes.set_xlim(view.x0 * mm, view.x1 * mm)
    axes.set_ylim(view.y0 * mm, view.y1 * mm)
    axes.set_aspect("equal")
    for body in bodies:  # where the body was: thin line
        ends = body.reference[border(body)][:, :, :2] * mm
        axes.add_collection(LineCollection(list(ends), colors=OUTLINE, linewidths=0.6, zorder=1))
    if with_vtk:
        from .vtk_panel import image

        box = axes.get_window_extent()
        pixels = image(bodies, look, view, round(box.width), round(box.height))
        axes.imshow(
            pixels,
            extent=(view.x0 * mm, view.x1 * mm, view.y0 * mm, view.y1 * mm),
            interpolation="antialiased",
            aspect="equal",
            zorder=2,
        )
        return
    norm = Normalize(look.low, look.high)
    for body in bodies:
        sound = kept(body)
        points = displaced(body, look.magnification)[:, :2] * mm
        cells, values = body.cells[sound], cell_values(body, look.field)[sound]
        colours = look.colours(norm(values))
        for corners in (3, 4):
            chosen = (cells[:, 3] < 0) if corners == 3 else (cells[:, 3] >= 0)
            axes.add_collection(
                PolyCollection(
                    points[cells[chosen, :corners]],
                    facecolors=colours[chosen],
                    edgecolors=colours[chosen],  # closes the hair lines between neighbours
                    linewidths=0.15,
                    zorder=2,
                    rasterized=True,
                )
            )
