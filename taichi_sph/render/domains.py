"""Which waves on a stretched lattice travel, feel nothing or grow: a map for each form."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap

from .pictures import _save
from .plots import STYLE

EDGES = (-10.0, -0.3, -0.1, -0.01, 0.01, 0.1, 0.3, 0.6, 10.0)
COLOURS = ("#8e1f17", "#c8402f", "#eb9a8c", "#f7e27a", "#d5e2ee", "#9dbddb", "#5b8fbf", "#1b4f80")
WORDS = ("grows", "", "", "feels nothing", "", "", "", "travels")


def render_domains(found: Sequence[Any], title: str, lost: float, path: Path) -> Path:
    """found: nine of lattice.Domain, row by row. Stretch over the length of the wave; lost: stretch below which the continuum
    gives way."""
    with plt.rc_context(STYLE):
        figure, grid = plt.subplots(3, 3, figsize=(11, 9.6), sharex=True, sharey=True, layout="constrained")
        norm = BoundaryNorm(EDGES, len(COLOURS))
        colours = {"cmap": ListedColormap(COLOURS), "norm": norm, "shading": "nearest"}
        for axes, one in zip(grid.ravel(), found, strict=True):
            image = axes.pcolormesh(one.waves, one.stretches, one.worst, **colours)
            axes.axhline(1.0, color="white", linewidth=0.8)
            axes.axhline(lost, color="black", linewidth=0.8, linestyle="--")
            axes.set_title(one.name, fontsize=9)
        for axes in grid[:, 0]:
            axes.set_ylabel("stretch")
        for axes in grid[-1]:
            axes.set_xticks([0.1, 0.25, 0.5, 1.0], ["20", "8", "4", "2"])
            axes.set_xlabel("length of the wave over D")
        bar = figure.colorbar(image, ax=grid, orientation="horizontal", fraction=0.03, pad=0.04, aspect=60)
        bar.set_ticks(EDGES[1:-1], labels=[f"{e:g}" for e in EDGES[1:-1]])
        bar.set_label(
            "least ω² over (G/ρ) k² of three directions and two polarisations, 1 for the shear wave at rest\n"
            f"dashed: stretch {lost:.2f}, below which the continuum itself gives way"
        )
        middles = 0.5 * (np.arange(len(COLOURS)) + np.arange(1, len(COLOURS) + 1)) / len(COLOURS)
        for x, word in zip(middles, WORDS, strict=True):
            colour = "#2b333a" if word == "feels nothing" else "white"
            bar.ax.text(x, 0.5, word, transform=bar.ax.transAxes, ha="center", va="center", fontsize=8, color=colour)
        figure.suptitle(title, x=0.01, ha="left", fontweight="bold")
        return _save(figure, path, dpi=90)
