"""The thickness and the material of each cell of a shell. NumPy only, so that a plan knows them as well as a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...errors import SceneError
from ...geometry.mesh import SurfaceMesh
from ...geometry.regions import cells_in
from ...scene.laws import Material
from ...scene.surfaces import Given
from ...scene.units import show
from .said import Shell


class Sheet(NamedTuple):
    """Cells that are alike: their material, thickness [m], and width [m], which a neck is spread over."""

    material: Material
    thickness: float
    width: float = 0.0


@dataclass(frozen=True)
class Sheets:
    """The sheets of a shell, the shell's own first; of (M,): number of the sheet of each cell."""

    sheets: tuple[Sheet, ...]
    of: np.ndarray

    @property
    def even(self) -> bool:
        """Whether there is one alone."""
        return len(self.sheets) == 1

    @property
    def thickness(self) -> np.ndarray:
        """(M,) [m]"""
        return np.array([sheet.thickness for sheet in self.sheets])[self.of]

    @property
    def areal(self) -> np.ndarray:
        """(M,) mass per area [kg/m2]."""
        return np.array([sheet.thickness * sheet.material.density for sheet in self.sheets])[self.of]


def sheets_of(shell: Shell, mesh: SurfaceMesh, where: str = "sections", width: float | None = None) -> Sheets:
    """What the cells of a shell are made of; a section comes after what the file says. SceneError for a section without a cell, and for
    cells of a given mesh that are thicker than the mesh is wide; where: its key, for sentences; width [m]: of the cells, by itself the
    spacing of the mesh."""
    width = mesh.spacing if width is None else width
    sheets = [Sheet(shell.material, shell.thickness, width)]
    of = np.zeros(len(mesh.cells), np.int64)
    if getattr(shell.surface, "thicknesses", False):
        if not mesh.thickness:
            raise SceneError(f"{where.partition('.')[0]}.surface.thicknesses: the file says no thickness of its parts; give sections")
        for name, thickness in mesh.thickness.items():
            of[mesh.regions[name]] = len(sheets)
            sheets.append(Sheet(shell.material, thickness, width))
    for k, section in enumerate(shell.sections):
        try:
            caught = cells_in(section.where, mesh)
        except SceneError as error:
            raise SceneError(f"{where}[{k}].where: {error}") from None
        if not caught.any():
            raise SceneError(
                f"{where}[{k}].where catches no cell of shell '{shell.name}', whose nodes are {1e3 * mesh.spacing:.4g} mm apart"
            )
        for old in np.unique(of[caught]).tolist():
            before = sheets[old]
            of[caught & (of == old)] = len(sheets)
            sheets.append(Sheet(section.material or before.material, section.thickness or before.thickness, width))
    used, numbers = np.unique(of, return_inverse=True)
    made = Sheets(tuple(sheets[k] for k in used), numbers.astype(np.int32))
    if isinstance(shell.surface, Given):  # of the others the scene knows the size
        _fits(shell, float(made.thickness.max()), float(np.ptp(mesh.points, axis=0).max()))
    return made


def _fits(shell: Shell, thickest: float, across: float) -> None:
    """SceneError for a thickness [m] above the widest side of the box around a mesh [m]: such a shell would reach everything."""
    if thickest > across:
        raise SceneError(f"thickness {show(thickest, 'm')} of shell '{shell.name}' is larger than its mesh, {show(across, 'm')} across")


def mean_at_nodes(mesh: SurfaceMesh, values: Sequence[float] | np.ndarray) -> np.ndarray:
    """(M,) values of cells -> (N,) their mean over the cells around a node, weighted by area."""
    corner = mesh.cells >= 0
    node, share = mesh.cells[corner], np.repeat((mesh.areas / mesh.corners)[:, None], 4, axis=1)
    weighted = (share * np.asarray(values)[:, None])[corner]
    n = len(mesh.points)
    return np.bincount(node, weighted, minlength=n) / np.bincount(node, share[corner], minlength=n)
