"""Shapes of vibration of a plate in its plane, one panel each: the mesh at rest, and moved."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from ..model.mesh import SurfaceMesh

MOVE = 0.12  # of the plate's size: the largest displacement drawn


def draw(path: Path, mesh: SurfaceMesh, shapes: np.ndarray, titles: list[str]) -> None:
    """Write a PNG: shapes (K, N, 2) of largest displacement 1, a title for each."""
    columns = min(3, len(shapes))
    rows = -(-len(shapes) // columns)
    figure = Figure(figsize=(3.0 * columns, 3.2 * rows), layout="constrained")
    FigureCanvasAgg(figure)
    X = 1e3 * mesh.points[:, :2]
    size = float(np.ptp(X, axis=0).max())
    corners = [cell[cell >= 0] for cell in mesh.cells]
    for k, (shape, title) in enumerate(zip(shapes, titles, strict=True)):
        axes = figure.add_subplot(rows, columns, k + 1)
        moved = X + MOVE * size * shape
        speed = np.linalg.norm(shape, axis=1)
        axes.add_collection(PolyCollection([X[c] for c in corners], facecolor="none", edgecolor="#d5dadd", linewidth=0.5))
        patches = PolyCollection([moved[c] for c in corners], cmap="viridis", edgecolor="white", linewidth=0.3)
        patches.set_array(np.array([speed[c].mean() for c in corners]))
        patches.set_clim(0, 1)
        axes.add_collection(patches)
        axes.set_title(title, fontsize=10)
        axes.set_aspect("equal")
        axes.set_xlim(X[:, 0].min() - 0.2 * size, X[:, 0].max() + 0.2 * size)
        axes.set_ylim(X[:, 1].min() - 0.2 * size, X[:, 1].max() + 0.2 * size)
        axes.set_axis_off()
    figure.savefig(path, dpi=150, facecolor="white")
