"""The area that is open in a torn shell: closed forms on a flat sheet."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph.geometry.mesh import SurfaceMesh
from taichi_sph.observers.opening import opening

D, N = 0.01, 12  # m, cells along each side


def sheet(triangles: bool = False) -> SurfaceMesh:
    x = D * np.stack(np.meshgrid(np.arange(N + 1), np.arange(N + 1), indexing="ij"), axis=-1).reshape(-1, 2)
    first = (np.arange(N)[:, None] * (N + 1) + np.arange(N)).ravel()
    quads = np.stack([first, first + N + 1, first + N + 2, first + 1], axis=1)
    if triangles:
        none = np.full(len(quads), -1)
        quads = np.stack([np.column_stack([quads[:, [0, 1, 2]], none]), np.column_stack([quads[:, [0, 2, 3]], none])], axis=1).reshape(
            -1, 4
        )
    return SurfaceMesh(np.column_stack([x, np.zeros(len(x))]), quads.astype(np.int32), D)


def cell(i: int, j: int) -> int:
    return i * N + j


def opened(mesh: SurfaceMesh, places: np.ndarray, broken: list[int], plug: tuple[int, ...] = (), loose: tuple[int, ...] = ()) -> float:
    torn, whole, free = np.zeros(len(mesh.cells), bool), np.ones(len(mesh.cells), bool), np.zeros(len(mesh.points), bool)
    torn[broken] = True
    whole[[*broken, *plug]] = False
    free[list(loose)] = True
    return opening(places, mesh.cells, mesh.edges.sides, mesh.areas, torn, free, whole)


@pytest.mark.parametrize("width", [0.0, 0.3 * D, 11 * D])
def test_a_crack_is_as_wide_as_its_lips_are_apart(width: float) -> None:
    """However many widths of a cell that are; its ends stay where they were."""
    mesh, n = sheet(), 6
    places = mesh.points.copy()
    for i in range(4, 4 + n - 1):
        places[i * (N + 1) + 5, 1] -= 0.5 * width
        places[i * (N + 1) + 6, 1] += 0.5 * width
    found = opened(mesh, places, [cell(i, 5) for i in range(3, 3 + n)])
    assert found == pytest.approx((n - 1) * D * width, abs=1e-15)


def test_a_hole_is_as_large_as_its_lip() -> None:
    """The cells around a plug that is cut out, and those around a node that fell out, are open themselves."""
    mesh = sheet()
    ring = [cell(i, j) for i in (2, 3, 4) for j in (2, 3, 4) if (i, j) != (3, 3)]
    assert opened(mesh, mesh.points, ring, plug=(cell(3, 3),)) == pytest.approx(9 * D**2)
    four = [cell(i, j) for i in (7, 8) for j in (7, 8)]
    assert opened(mesh, mesh.points, four, loose=(8 * (N + 1) + 8,)) == pytest.approx(4 * D**2)
    assert opened(mesh, mesh.points, ring + four, (cell(3, 3),), (8 * (N + 1) + 8,)) == pytest.approx(13 * D**2)


def test_a_hole_of_triangles_in_a_sheet_that_leans() -> None:
    mesh = sheet(triangles=True)
    lean = np.array([[1, 0, 0], [0, 0.8, 0.6], [0, -0.6, 0.8]])
    node = 8 * (N + 1) + 8
    around = np.flatnonzero((mesh.cells == node).any(axis=1)).tolist()
    assert opened(mesh, mesh.points @ lean + 0.3, around, loose=(node,)) == pytest.approx(3 * D**2)  # six triangles


def test_a_sound_sheet_is_closed() -> None:
    mesh = sheet()
    assert opened(mesh, 1.1 * mesh.points, []) == 0.0
