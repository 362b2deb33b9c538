"""Shapes of vibration of a plate in its plane or of a curved patch, one panel each: the mesh at rest, and moved."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from ..geometry.mesh import SurfaceMesh

MOVE = 0.12  # of the plate's size: the largest displacement drawn
TILT = (0.35, -0.75, 0.6)  # where a curved patch is seen from: across it, along its axis, out along its mean normal


def draw(path: Path, mesh: SurfaceMesh, shapes: np.ndarray, titles: list[str]) -> None:
    """Write a PNG: shapes (K, N, 2) or, seen obliquely, (K, N, 3) of largest displacement 1, a title for each."""
    columns = min(3, len(shapes))
    rows = -(-len(shapes) // columns)
    figure = Figure(figsize=(3.0 * columns, 3.2 * rows), layout="constrained")
    FigureCanvasAgg(figure)
    dim = shapes.shape[2]
    view = np.eye(2) if dim == 2 else _view(mesh)
    X = 1e3 * (mesh.points[:, :dim] - mesh.points[:, :dim].mean(axis=0))
    size = float(np.ptp(X, axis=0).max())
    still = X @ view.T
    corners = [cell[cell >= 0] for cell in mesh.cells]
    if dim == 3:  # from behind to the front
        depth = np.cross(*view)
        corners.sort(key=lambda c: float(mesh.points[c].mean(axis=0) @ depth))
    for k, (shape, title) in enumerate(zip(shapes, titles, strict=True)):
        axes = figure.add_subplot(rows, columns, k + 1)
        moved = (X + MOVE * size * shape) @ view.T
        speed = np.linalg.norm(shape, axis=1)
        axes.add_collection(PolyCollection([still[c] for c in corners], facecolor="none", edgecolor="#d5dadd", linewidth=0.5))
        patches = PolyCollection([moved[c] for c in corners], cmap="viridis", edgecolor="white", linewidth=0.3)
        patches.set_array(np.array([speed[c].mean() for c in corners]))
        patches.set_clim(0, 1)
        axes.add_collection(patches)
        axes.set_title(title, fontsize=10)
        axes.set_aspect("equal")
        axes.set_xlim(still[:, 0].min() - 0.2 * size, still[:, 0].max() + 0.2 * size)
        axes.set_ylim(still[:, 1].min() - 0.2 * size, still[:, 1].max() + 0.2 * size)
        axes.set_axis_off()
    figure.savefig(path, dpi=150, facecolor="white")


def _view(mesh: SurfaceMesh) -> np.ndarray:
    """(2, 3) right and up of the page for a patch whose axis is y, its mean normal upwards."""
    out = mesh.node_normals.mean(axis=0)
    out /= np.linalg.norm(out)
    axis = np.array([0.0, 1.0, 0.0])
    towards = np.array(TILT) @ np.array([np.cross(axis, out), axis, out])
    right = np.cross(out, towards)
    right /= np.linalg.norm(right)
    up = np.cross(towards, right)
    return np.array([right, up / np.linalg.norm(up)])
