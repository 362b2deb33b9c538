"""A page of views in space: rows of shots, each with its scale bar, beside the colour bars of what they show."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.transforms import blended_transform_factory

from ..frame import BodyFrame
from . import plots
from .backend import Backend
from .panel import Look, View, draw, round_down

DPI = 170
WIDE = 12.0  # inches of the page
LEFT, RIGHT, TOP, BOTTOM, BETWEEN, NAME, FOOT = 0.3, 1.35, 0.66, 0.12, 0.14, 0.17, 0.26  # inches
HEAD, SHORTEST = 0.75, 0.9  # inches above a colour bar for its name, and of the bar at least
LETTER = 0.075  # inches, the mean width of one in the name of a shot
TALLEST = 5.2  # inches of a row
UNLIKE = 3.0  # times as wide: shots of one row that have scale bars of their own
INK, SOFT = "#1d2429", "#5a6670"


@dataclass(frozen=True)
class Shot:
    """Some bodies as one sees them: `look` colours shells, `wet` fluids; `cut`: a point of a plane and its normal (3,) towards
    the eye, by which pinballs are halved."""

    bodies: Sequence[BodyFrame]
    view: View
    name: str
    look: Look
    wet: Look | None = None
    cut: tuple[np.ndarray, np.ndarray] | None = None

    @property
    def looks(self) -> list[Look]:
        forms = {body.form for body in self.bodies if body.form == "surface" or len(body.points)}
        both = ((self.look, {"surface"}), (self.wet, {"particles", "field"}))
        return [look for look, of in both if of & forms and look is not None and look.label]


def length_text(metres: float) -> str:
    units = ((1.0, "m"), (1e3, "mm"), (1e6, "µm"))
    factor, unit = next((u for u in units if metres * u[0] >= 1), units[-1])
    return f"{metres * factor:g} {unit}"


def scale_bar(axes: Axes, view: View, length: float, height: float) -> None:
    """A bar of `length` [m] below axes that are `height` inches high."""
    length *= 1e3
    where = blended_transform_factory(axes.transData, axes.transAxes)
    x, y = view.x0 * 1e3, -0.13 / height
    axes.plot([x, x + length], [y, y], color=INK, lw=2.2, solid_capstyle="butt", transform=where, clip_on=False)
    axes.annotate(
        length_text(length / 1e3), (x + length, y), xycoords=where, xytext=(5, 0), textcoords="offset points", va="center",
        fontsize=9, color=INK, annotation_clip=False,
    )  # fmt: skip


def heights(rows: Sequence[Sequence[Shot]]) -> list[float]:
    """Inches of each row: as wide as the page, but no higher than TALLEST."""
    found = []
    for row in rows:
        room = WIDE - LEFT - RIGHT - BETWEEN * (len(row) - 1)
        found.append(min(TALLEST, room / sum(1 / shot.view.aspect for shot in row)))
    return found


def named(shot: Shot, height: float) -> str:
    """The name of a shot that is `height` inches high, in as many lines as it needs."""
    return textwrap.fill(shot.name, max(12, int(height / shot.view.aspect / LETTER)))


def sheet(rows: Sequence[Sequence[Shot]], title: str, subtitle: str, backend: Backend, dpi: int = DPI) -> Figure:
    """Rows of shots of equal height under one title."""
    tall = heights(rows)
    across = [sum(h / s.view.aspect for s in row) + BETWEEN * (len(row) - 1) for row, h in zip(rows, tall, strict=True)]
    names = [[named(shot, h) for shot in row] for row, h in zip(rows, tall, strict=True)]
    above = [0.13 + NAME * max(name.count("\n") + 1 for name in row) for row in names]
    # long titles need room too: about 0.105 inches a letter
    wide = max(max(across) + LEFT + RIGHT, 0.105 * len(title) + 2 * LEFT, 0.068 * len(subtitle) + 2 * LEFT)
    looks: list[Look] = []
    for row in rows:
        for shot in row:
            looks += [look for look in shot.looks if look not in looks]
    filled = sum(tall) + sum(above) + FOOT * len(rows) + BETWEEN * (len(rows) - 1)
    height = TOP + max(filled, (HEAD + SHORTEST) * len(looks)) + BOTTOM  # flat bodies leave their bars little room
    with plt.rc_context(plots.STYLE):
        figure = plt.figure(figsize=(wide, height), dpi=dpi)
        figure.text(LEFT / wide, 1 - 0.22 / height, title, fontsize=14, weight="bold", va="center", color=INK)
        figure.text(LEFT / wide, 1 - 0.48 / height, subtitle, fontsize=10, va="center", color=SOFT)
        y = height - TOP
        for row, texts, over, h in zip(rows, names, above, tall, strict=True):
            x = LEFT
            y -= over + h
            widths = [shot.view.x1 - shot.view.x0 for shot in row]
            common = max(widths) <= UNLIKE * min(widths)
            for shot, text in zip(row, texts, strict=True):
                w = h / shot.view.aspect
                axes = figure.add_axes((x / wide, y / height, w / wide, h / height))
                draw(axes, shot.bodies, shot.look, shot.view, backend.name == "vtk", shot.wet, shot.cut)
                axes.set_axis_off()
                axes.set_title(text, fontsize=10.5, weight="normal", pad=4, x=0.01, color="#2b333a")
                scale_bar(axes, shot.view, round_down(0.28 * (min(widths) if common else shot.view.x1 - shot.view.x0)), h)
                x += w + BETWEEN
            y -= FOOT + BETWEEN
        _bars(figure, looks, wide, height)
    return figure


def _bars(figure: Figure, looks: Sequence[Look], wide: float, height: float) -> None:
    """Colour bars at the right edge, one above the other."""
    if not looks:
        return
    room = (height - TOP - BOTTOM) / len(looks)
    for number, look in enumerate(looks):
        tall = min(room - HEAD, 2.4)
        y = height - TOP - (number + 0.5) * room - tall / 2 - 0.15
        bar = figure.add_axes(((wide - RIGHT + 0.25) / wide, y / height, 0.16 / wide, tall / height))
        colours = ScalarMappable(look.bar(), look.colours)
        figure.colorbar(colours, cax=bar, extend="neither" if look.field == "damage" else "max", extendfrac=0.04)
        name, _, unit = look.label.rpartition(" ")
        bar.set_title(f"{name}\n{unit}", fontsize=9.5, weight="normal", color="#2b333a", pad=8, loc="left", linespacing=1.3)
        bar.locator_params(axis="y", nbins=5)
        bar.tick_params(labelsize=9, length=2.5)
        for side in bar.spines.values():
            side.set_visible(False)


def pixels(figure: Figure) -> np.ndarray:
    """(height, width, 3) uint8"""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3]
