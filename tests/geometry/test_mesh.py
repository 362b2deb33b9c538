"""Meshes: areas, edges, frames, spacings, and the plate generator's counts."""

import numpy as np
import pytest

from taichi_sph.errors import SceneError
from taichi_sph.geometry.mesh import SurfaceMesh, plate, tangent_frames

PLATES = [("quad", 0.0), ("quad", 0.3), ("triangle", 0.0), ("triangle", 0.3)]


@pytest.mark.parametrize("cells, irregularity", PLATES)
def test_plate(cells, irregularity):
    mesh = plate(0.03, 0.02, 1e-3, cells, irregularity, seed=3, origin=(1.0, 2.0, 3.0))
    assert len(mesh.points) == 31 * 21
    assert len(mesh.cells) == 30 * 20 * (1 if cells == "quad" else 2)
    assert mesh.areas.sum() == pytest.approx(6e-4, rel=1e-12)
    assert mesh.node_areas.sum() == pytest.approx(6e-4, rel=1e-12)
    assert mesh.node_areas.min() > 0 and mesh.areas.min() > 0
    assert mesh.points.min(axis=0) == pytest.approx([1.0, 2.0, 3.0])
    assert mesh.points.max(axis=0) == pytest.approx([1.03, 2.02, 3.0])
    assert mesh.frames == pytest.approx(np.broadcast_to(np.eye(3), (len(mesh.cells), 3, 3)))
    # a node owns about a square of side D; irregularity moves that by its own size, not more
    assert np.all(np.abs(mesh.node_spacing / 1e-3 - 1) < 0.02 + irregularity)
    if irregularity == 0:
        assert mesh.node_spacing == pytest.approx(np.full(len(mesh.points), 1e-3))
        again = plate(0.03, 0.02, 1e-3, cells, irregularity, seed=9, origin=(1.0, 2.0, 3.0))
        assert np.array_equal(mesh.points, again.points)
    else:
        other = plate(0.03, 0.02, 1e-3, cells, irregularity, seed=4, origin=(1.0, 2.0, 3.0))
        assert not np.array_equal(mesh.points, other.points)


def test_counts_of_the_thesis():
    """B1: 200 x 86 nodes at 0.5 mm (T 2.4.3)."""
    mesh = plate(0.1 - 0.5e-3, 0.04 + 5 * 0.5e-3, 0.5e-3)
    assert (len(mesh.points), len(mesh.cells)) == (17200, 199 * 85) == (17200, 16915)


@pytest.mark.parametrize("cells, irregularity", PLATES)
def test_edges(cells, irregularity):
    mesh = plate(0.012, 0.009, 1e-3, cells, irregularity)
    edges = mesh.edges
    n, m, r = len(mesh.points), len(mesh.cells), len(edges.nodes)
    assert n - r + m == 1  # Euler, a disc
    border = edges.sides[:, 1] < 0
    assert border.sum() == 2 * (12 + 9)
    assert len({tuple(sorted(e)) for e in edges.nodes}) == r
    corners = [[int(c) for c in cell if c >= 0] for cell in mesh.cells]
    for e, (nodes, sides) in enumerate(zip(edges.nodes, edges.sides)):
        for side in sides[sides >= 0]:
            cell, k = divmod(int(side), 4)
            assert mesh.edges.cell_edges[cell, k] == e
            assert set(nodes) == {corners[cell][k], corners[cell][(k + 1) % len(corners[cell])]}
    assert ((edges.cell_edges >= 0).sum(axis=1) == mesh.corners).all()


def _sphere(cells):
    """A cap of the unit sphere, and its exact normals."""
    flat = plate(0.8, 0.8, 0.1, cells, 0.2, origin=(-0.4, -0.4, 0.0))
    p = flat.points.copy()
    p[:, 2] = np.sqrt(1 - p[:, 0] ** 2 - p[:, 1] ** 2)
    return SurfaceMesh(p, flat.cells, 0.1)


@pytest.mark.parametrize("cells", ["quad", "triangle"])
def test_curved(cells):
    mesh = _sphere(cells)
    assert np.einsum("mai,mbi->mab", mesh.frames, mesh.frames) == pytest.approx(
        np.broadcast_to(np.eye(3), (len(mesh.cells), 3, 3)), abs=1e-14
    )
    assert np.linalg.det(mesh.frames) == pytest.approx(np.ones(len(mesh.cells)))
    assert np.einsum("ni,ni->n", mesh.node_normals, mesh.points).min() > 0.995
    radial = mesh.centres / np.linalg.norm(mesh.centres, axis=1)[:, None]
    assert np.einsum("mi,mi->m", mesh.frames[:, 2], radial).min() > 0.99


def test_frames_at_the_poles():
    normals = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, 0, -1], [0.95, 0.3122498999, 0]])
    frames = tangent_frames(normals / np.linalg.norm(normals, axis=1)[:, None])
    assert np.einsum("kai,kbi->kab", frames, frames) == pytest.approx(np.broadcast_to(np.eye(3), (5, 3, 3)), abs=1e-9)
    assert np.linalg.det(frames) == pytest.approx(np.ones(5))


def test_graded_spacing_follows():
    """A mesh whose spacing doubles from one end to the other: the local spacing follows."""
    mesh = plate(1.0, 0.2, 0.02)
    p = mesh.points.copy()
    p[:, 0] = p[:, 0] + 0.5 * p[:, 0] ** 2
    graded = SurfaceMesh(p, mesh.cells, 0.02)
    expected = 0.02 * np.sqrt(1 + mesh.points[:, 0])
    assert graded.node_spacing == pytest.approx(expected, rel=0.03)


def test_an_edge_of_three_cells_is_refused():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]])
    cells = np.array([[0, 1, 2, -1], [1, 0, 3, -1], [0, 1, 4, -1]], np.int32)
    with pytest.raises(SceneError, match="nodes 0 and 1 bounds 3 cells"):
        _ = SurfaceMesh(points, cells, 1.0).edges
