"""Frames of the parts of a shell whose patch grows. Points and cells of a body are the same in all frames, so each part is shown as large
as it can ever be: all elements, and the particles of all of them. What is not there is hidden, at its place in the reference."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...frame import BodyFrame
from .parts import Split

HIDDEN = {"hidden": 1.0, "rupture_time": np.nan}  # of cells that are not there; 0 of all else


def at_most(frame: BodyFrame, split: Split, elements: bool) -> BodyFrame:
    """The frame of the elements, or of the particles, spread over all that there can be."""
    if elements:
        mesh, nodes, cells = split.whole, split.nodes, split.cells
    else:
        mesh, (nodes, cells) = split.most.mesh, _places(split)
    cell_data = {"hidden": np.zeros(len(frame.cells), np.uint8)} | frame.cell_data
    points = mesh.points.copy()
    points[nodes] = frame.points
    return replace(
        frame,
        points=points,
        cells=mesh.cells,
        point_data={name: mesh.points if name == "reference" else _spread(v, nodes, len(points)) for name, v in frame.point_data.items()},
        cell_data={name: _spread(v, cells, len(mesh.cells), HIDDEN.get(name, 0.0)) for name, v in cell_data.items()},
    )


def none_of(frame: BodyFrame, name: str) -> BodyFrame:
    """The frame of particles that are not there yet, with what frames show of elements."""
    cell_data = {key: values[:0] for key, values in frame.cell_data.items() if key != "hidden"}
    point_data = {key: values[:0] for key, values in frame.point_data.items()}
    return replace(frame, name=name, points=frame.points[:0], cells=frame.cells[:0], point_data=point_data, cell_data=cell_data)


def _spread(values: np.ndarray, rows: np.ndarray, n: int, beyond: float = 0.0) -> np.ndarray:
    found = np.full((n, *values.shape[1:]), beyond, values.dtype)
    found[rows] = values
    return found


def _places(split: Split) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the particles and of their cells among all that there can be."""
    most, fine, n = split.most, split.fine, split.n
    first = np.full(len(split.whole.cells), -1)
    parents = most.parent[:: n * n]  # the cells of an element stand together, row by row
    first[parents] = np.arange(len(parents)) * n * n
    cells = first[fine.parent] + fine.place[:, 1] * n + fine.place[:, 0]
    nodes = np.zeros(len(fine.mesh.points), int)
    nodes[fine.mesh.cells] = most.mesh.cells[cells]
    return nodes, cells
