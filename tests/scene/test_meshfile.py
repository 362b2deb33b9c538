"""Meshes from files: what is read, what is mended, what is refused."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest

from taichi_sph.errors import SceneError
from taichi_sph.geometry.mesh import plate
from taichi_sph.geometry.meshfile import read_mesh


def grid(nx: int = 4, ny: int = 3, d: float = 0.01) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) and counter-clockwise quadrangles of a small plate."""
    mesh = plate(nx * d, ny * d, d)
    return mesh.points.copy(), mesh.cells.astype(int)


def triangles(quads: np.ndarray) -> np.ndarray:
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def write(folder: Path, points, cells, name: str = "m.vtu", kind: str = "quad") -> Path:
    path = folder / name
    meshio.write(path, meshio.Mesh(points, [(kind, np.asarray(cells))]), file_format="gmsh" if path.suffix == ".msh" else None)
    return path


@pytest.mark.parametrize("name", ["m.msh", "m.inp", "m.vtu", "m.vtk", "m.stl", "m.ply", "m.obj", "m.off"])
def test_formats(tmp_path, name):
    points, quads = grid()
    mesh = read_mesh(write(tmp_path, points, triangles(quads), name, "triangle"), plane=True)
    assert len(mesh.points) == 20 and len(mesh.cells) == 24
    assert mesh.areas.sum() == pytest.approx(0.04 * 0.03, rel=1e-6)
    assert (mesh.cells[:, 3] == -1).all() and (mesh.area_vectors[:, 2] > 0).all()
    assert mesh.spacing == pytest.approx(0.01, rel=1e-6)


def test_triangles_and_quads_together_and_scale(tmp_path):
    points, quads = grid()
    path = tmp_path / "m.vtu"
    cells = [("quad", quads[:6]), ("triangle", triangles(quads[6:])), ("line", np.array([[0, 1]]))]
    meshio.write(path, meshio.Mesh(points * 1000, cells))
    mesh = read_mesh(path, scale=1e-3)
    assert sorted(mesh.corners) == [3] * 12 + [4] * 6
    assert mesh.areas.sum() == pytest.approx(0.04 * 0.03) and mesh.spacing == pytest.approx(0.01)


def test_cells_turned_round_are_turned_back(tmp_path):
    points, quads = grid()
    quads[[1, 5, 6]] = quads[[1, 5, 6]][:, ::-1]
    flat = read_mesh(write(tmp_path, points, quads), plane=True)
    assert (flat.area_vectors[:, 2] > 0).all()
    bent = points.copy()
    bent[:, 2] = 0.2 * bent[:, 0] ** 2
    curved = read_mesh(write(tmp_path, bent, quads))
    assert len(np.unique(np.sign(curved.area_vectors[:, 2]))) == 1


def test_unused_points_are_dropped(tmp_path):
    points, quads = grid()
    mesh = read_mesh(write(tmp_path, np.vstack([[[9, 9, 9]], points]), quads + 1))
    assert len(mesh.points) == 20 and mesh.areas.sum() == pytest.approx(0.04 * 0.03)


def bad_nan(points, quads):
    points[3, 1] = np.nan
    return points, quads


def bad_flat(points, quads):
    points[6] = points[1] + [1e-7, 1e-7, 0]
    return points, quads


def bad_bow_tie(points, quads):
    quads[4] = quads[4][[0, 2, 1, 3]]
    return points, quads


def bad_twice(points, quads):
    quads[2, 3] = quads[2, 0]
    return points, quads


def bad_duplicate(points, quads):
    return points, np.vstack([quads, quads[3]])


def bad_three_on_an_edge(points, quads):
    a, b = quads[5][:2]
    top = points[[a, b]] + [0, 0, 0.01]
    return np.vstack([points, top]), np.vstack([quads, [a, b, len(points) + 1, len(points)]])


def bad_large(points, quads):
    return points * 1e6, quads


def bad_not_convex(points, quads):
    points[6, :2] = points[12, :2] - [0.001, 0.001]
    return points, quads


MESHES = [
    (bad_nan, "node 3 has a coordinate that is not a number"),
    (bad_flat, "is flat"),
    (bad_bow_tie, "cell 4, a quadrangle at"),
    (bad_twice, "cell 2 uses the same node twice"),
    (bad_duplicate, "is there 2 times"),
    (bad_three_on_an_edge, "bounds 3 cells"),
    (bad_large, "is it in millimetres (scale = 0.001)?"),
    (bad_not_convex, "crosses itself or is not convex"),
]


@pytest.mark.parametrize(("spoil", "said"), MESHES, ids=lambda v: getattr(v, "__name__", ""))
def test_malformed_meshes(tmp_path, spoil, said):
    with pytest.raises(SceneError) as caught:
        read_mesh(write(tmp_path, *spoil(*grid())))
    assert said in str(caught.value) and "mesh m.vtu" in str(caught.value) and "\n" not in str(caught.value)


def test_moebius_strip(tmp_path):
    n = 24
    angle = np.linspace(0, 2 * np.pi, n, endpoint=False)
    rows = [
        np.column_stack([(1 + s * np.cos(angle / 2)) * np.cos(angle), (1 + s * np.cos(angle / 2)) * np.sin(angle), s * np.sin(angle / 2)])
        for s in (-0.2, 0.2)
    ]
    i = np.arange(n - 1)
    cells = np.column_stack([i, i + 1, i + 1 + n, i + n])
    cells = np.vstack([cells, [n - 1, n, 0, 2 * n - 1]])  # closes with a twist
    with pytest.raises(SceneError, match="Moebius"):
        read_mesh(write(tmp_path, np.vstack(rows), cells))


def test_in_plane_needs_a_plane(tmp_path):
    points, quads = grid()
    points[9, 2] = 0.001
    with pytest.raises(SceneError, match="node 9 has z = 0.001 m.*z = constant"):
        read_mesh(write(tmp_path, points, quads), plane=True)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("m.msh", b"", "is an empty file"),
        ("m.msh", b"$MeshFormat\n4.1 0 8\n", "it is cut off"),
        ("m.stl", b"solid\nendsolid\n", "mesh m.stl"),
        ("m.ply", b"ply\nformat ascii 1.0\nend_header\n", "mesh m.ply"),
        ("m.vtu", b"<VTKFile", "cannot be read as .vtu"),
        ("m.inp", b"\xff\xfe\x00garbage", "mesh m.inp"),
        ("m.obj", b"f 1 2 3\n", "mesh m.obj"),
        ("m.docx", b"x", "is no mesh format; readable are"),
    ],
)
def test_malformed_files(tmp_path, name, content, said):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(SceneError) as caught:
        read_mesh(tmp_path / name)
    assert said in str(caught.value) and "\n" not in str(caught.value)


def test_missing_file_names_its_neighbours(tmp_path):
    points, quads = grid()
    write(tmp_path, points, quads, "plate.vtu")
    with pytest.raises(SceneError, match="there is no mesh file.*the folder has plate.vtu"):
        read_mesh(tmp_path / "plat.vtu")


def test_solids_and_higher_orders_are_refused(tmp_path):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.5, 0, 0], [0.5, 0.5, 0.1], [0, 0.5, 0]])
    with pytest.raises(SceneError, match="1 cells of type 'tetra'"):
        read_mesh(write(tmp_path, points[:4], [[0, 1, 2, 3]], kind="tetra"))
    with pytest.raises(SceneError, match="'triangle6'.*first order"):
        read_mesh(write(tmp_path, points, [[0, 1, 2, 4, 5, 6]], kind="triangle6"))
    with pytest.raises(SceneError, match="no triangles or quadrangles"):
        read_mesh(write(tmp_path, points, [[0, 1]], kind="line"))
