"""Meshes from files and from arrays."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, StrictBool, StrictInt, model_validator

from ..base import Frozen
from ..units import Dimensionless, Length, Time

Corners = Annotated[tuple[StrictInt, ...], Field(min_length=3, max_length=4)]


def _plain(value: Any) -> Any:
    """An array as nested lists."""
    return value.tolist() if isinstance(value, np.ndarray) else value


def _in_space(points: Any) -> Any:
    """Points in the plane as points in space."""
    if isinstance(points, list | tuple):
        return [[*p, 0.0] if isinstance(p, list | tuple) and len(p) == 2 else p for p in points]
    return points


class MeshFile(Frozen):
    """A surface mesh of triangles and quadrangles from a file; `scale` turns its unit into metres. `part`: the group, set, part or
    property of the file that is read, or several of them. `thicknesses`: those that the file says of its parts hold, and that of the shell
    elsewhere. `merge` = false keeps nodes in one place apart, so that a slit of zero width stays open. `time_limit`: for the formats that
    a process of its own reads (.vtu, .vtk, .med, .xdmf, .mesh)."""

    kind: Literal["mesh"] = "mesh"
    path: Path
    scale: Annotated[Dimensionless, Field(gt=0)] = 1.0
    part: str | Annotated[tuple[str, ...], Field(min_length=1)] | None = None
    thicknesses: StrictBool | None = None
    merge: bool = True
    time_limit: Annotated[Time, Field(gt=0)] = 60.0


class Net(Frozen):
    """A surface from arrays: `points` (N, 3), or (N, 2) in the plane z = 0, and `cells`, three or four numbers of points each, from 0 on (a
    fourth of -1 makes a triangle); `groups`: numbers of cells by name. Checked as a mesh from a file is; `merge` as there."""

    kind: Literal["net"] = "net"
    points: Annotated[tuple[tuple[Length, Length, Length], ...], BeforeValidator(lambda value: _in_space(_plain(value)))]
    cells: Annotated[tuple[Corners, ...], BeforeValidator(_plain)]
    groups: dict[str, Annotated[tuple[StrictInt, ...], Field(min_length=1), BeforeValidator(_plain)]] = {}
    merge: bool = True

    @property
    def area(self) -> float:
        """Of its cells as they are [m2]."""
        p = np.asarray(self.points)
        c = np.array([cell if len(cell) == 4 and cell[3] >= 0 else (*cell[:3], cell[2]) for cell in self.cells])
        return 0.5 * float(np.linalg.norm(np.cross(p[c[:, 2]] - p[c[:, 0]], p[c[:, 3]] - p[c[:, 1]]), axis=1).sum())

    @model_validator(mode="after")
    def _has_cells(self) -> Net:
        if not self.cells or not self.points:
            raise ValueError("points and cells are empty: a net needs at least one cell")
        for n, cell in enumerate(self.cells):
            if min(cell[:3]) < 0 or max(cell) >= len(self.points) or (len(cell) == 4 and cell[3] < -1):
                raise ValueError(f"cells[{n}] = {cell} names a point that is not there; the {len(self.points)} points count from 0")
        for name, rows in self.groups.items():
            if min(rows) < 0 or max(rows) >= len(self.cells):
                raise ValueError(f"groups.{name} names a cell that is not there; the {len(self.cells)} cells count from 0")
        return self

    def __hash__(self) -> int:
        return hash((self.points, self.cells, tuple(self.groups), self.merge))
