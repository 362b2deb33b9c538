"""Which nodes and cells a region of the scene means. NumPy only; decided once, on the reference."""

from __future__ import annotations

import numpy as np

from ..errors import SceneError, nearest
from ..scene.regions import Ball, Box, Group, Outside, Region
from .mesh import SurfaceMesh


def extent(points: np.ndarray) -> float:
    """Largest width [m] of points along an axis."""
    return float(np.ptp(points, axis=0).max(initial=0.0))


def nodes_in(region: Region, mesh: SurfaceMesh, size: float | None = None) -> np.ndarray:
    """(N,) bool: nodes of a mesh; of a group the nodes of its cells. size: the `extent` of its points, where it is known."""
    group = _group(region)
    if group is None:
        return inside(region, mesh.points, size)
    mine = mesh.cells[_of_group(group, mesh)]
    caught = np.zeros(len(mesh.points), bool)
    caught[mine[mine >= 0]] = True
    return caught if group is region else ~caught


def cells_in(region: Region, mesh: SurfaceMesh, size: float | None = None) -> np.ndarray:
    """(M,) bool: cells of a mesh whose middle is in the region, or those of a group. size: the `extent` of their centres."""
    group = _group(region)
    if group is None:
        return inside(region, mesh.centres, size)
    caught = _of_group(group, mesh)
    return caught if group is region else ~caught


def inside(region: Region, points: np.ndarray, size: float | None = None) -> np.ndarray:
    """(N, 3) reference positions [m] -> (N,) bool. Rounding does not decide: the border is 1e-9 sizes thick. size: their `extent`, where
    it is known. SceneError of a group, which belongs to a mesh."""
    group = _group(region)
    if group is not None:
        raise SceneError(f"group '{group.name}': the body has no mesh, so it has no groups; use a Box or a Ball")
    slack = 1e-9 * (extent(points) if size is None else size)
    return ~_inside(region.of, points, -slack) if isinstance(region, Outside) else _inside(region, points, slack)


def _group(region: Region) -> Group | None:
    """The group that a region speaks of."""
    of = region.of if isinstance(region, Outside) else region
    return of if isinstance(of, Group) else None


def _of_group(group: Group, mesh: SurfaceMesh) -> np.ndarray:
    names = (group.name.casefold(), f"pid {group.name}".casefold())
    found = next((mask for name, mask in mesh.regions.items() if name.casefold() in names), None)
    if found is None:
        has = f"it has {', '.join(list(mesh.regions)[:8])}" if mesh.regions else "it has none"
        raise SceneError(f"group '{group.name}': the mesh has no group of that name{nearest(group.name, mesh.regions)}; {has}")
    return found


def _inside(region: Region, points: np.ndarray, slack: float) -> np.ndarray:
    if isinstance(region, Ball):
        with np.errstate(over="ignore"):  # of a centre beyond all measure
            return np.linalg.norm(points - np.asarray(region.centre), axis=1) <= region.radius + slack
    assert isinstance(region, Box)
    caught = np.ones(len(points), bool)
    for axis in range(3):
        lo, hi = region.lo[axis], region.hi[axis]
        if lo is not None:
            caught &= points[:, axis] >= lo - slack
        if hi is not None:
            caught &= points[:, axis] <= hi + slack
    return caught
