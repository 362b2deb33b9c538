"""Every format: what it says comes through, what it cannot say is refused by its keyword, numbers are the file's own."""

from __future__ import annotations

import math
import time
from pathlib import Path

import meshio
import numpy as np
import pytest

from taichi_sph.errors import SceneError
from taichi_sph.geometry.mesh import SurfaceMesh
from taichi_sph.geometry.meshfile import read_mesh
from taichi_sph.geometry.normals import report

from .writers import WRITERS, bdf_free, box, halves, inp, inp_parts, k_standard, obj, rad, stl_text

INPUTS = Path(__file__).parent / "meshes"
NAMED = ("flat.inp", "standard.k", "ten.key", "long.dyn", "m.rad", "m.obj", "text.stl", "two.msh")


def volume(mesh: SurfaceMesh) -> float:
    p = mesh.points[np.where(mesh.cells < 0, mesh.cells[:, :1], mesh.cells)]
    return sum(float(np.einsum("mi,mi->m", p[:, 0], np.cross(p[:, k], p[:, k + 1])).sum()) for k in (1, 2)) / 6


def said(path: Path, **more) -> str:
    with pytest.raises(SceneError) as caught:
        read_mesh(path, **more)
    sentence = str(caught.value)
    assert path.name in sentence and "\n" not in sentence
    return sentence


def text_of(folder: Path, name: str, content: str | bytes) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


@pytest.mark.parametrize("corners", [3, 4])
@pytest.mark.parametrize("name", WRITERS)
def test_a_box_in_every_format(tmp_path, name, corners):
    points, quads = box()
    cells = quads if corners == 4 else halves(quads)
    mesh = read_mesh(text_of(tmp_path, name, WRITERS[name](points, cells)))
    times = 3 if name == "parts.inp" else 1
    found = 2 * len(quads) if name.endswith(".stl") else len(cells)
    assert len(mesh.points) == times * len(points) and len(mesh.cells) == times * found
    assert volume(mesh) == pytest.approx(times * 0.3 * 0.2 * 0.2, rel=1e-6) and "closed" in report(mesh)
    if name in NAMED:
        assert mesh.regions["front"].sum() == found // 2
    if name == "four.msh":
        assert mesh.regions["front"].all() and mesh.regions["back"].sum() == found // 2  # its second surface is in both groups
    if name == "two.msh":
        assert (mesh.regions["front"] & mesh.regions["back"]).sum() == 1
    if name.endswith((".bdf", ".nas", ".k", ".key", ".dyn", ".rad")):
        assert mesh.thickness["pid 1"] == pytest.approx(2e-3) and mesh.regions["pid 2"].sum() == found - found // 2


@pytest.mark.parametrize("name", ["flat.inp", "free.bdf", "standard.k", "m.rad", "m.obj", "text.stl", "two.msh", "m.vtu"])
def test_one_part_of_a_file(tmp_path, name):
    points, quads = box()
    path = text_of(tmp_path, name, WRITERS[name](points, quads))
    part = "front" if name in NAMED else "1"
    mesh = read_mesh(path, part=part)
    assert len(mesh.cells) == (2 if name.endswith("stl") else 1) * len(quads) // 2 and "open" in report(mesh)
    assert "has no part 'frnt'" in said(path, part="frnt")
    if name in NAMED:
        assert "did you mean 'front'?" in said(path, part="frnt")


TEXTS = [n for n in WRITERS if not n.startswith(("little", "big", "bytes", "twob", "fourb", "m.vt", "text.vt"))]


@pytest.mark.parametrize("name", TEXTS)
def test_ends_of_lines_comments_and_capitals_change_nothing(tmp_path, name):
    points, quads = box()
    data = WRITERS[name](points, quads)
    sound = read_mesh(text_of(tmp_path, name, data))
    comment = {
        ".inp": b"** x\n",
        ".bdf": b"$ x\n",
        ".nas": b"$ x\n",
        ".k": b"$ x\n",
        ".key": b"$ x\n",
        ".dyn": b"$ x\n",
        ".rad": b"# x\n",
        ".obj": b"# x\n",
    }
    others = [data.replace(b"\n", b"\r\n"), data.rstrip(b"\n")]
    if Path(name).suffix in comment:
        others.append(data.replace(b"\n", b"\n" + comment[Path(name).suffix]))
    if Path(name).suffix in (".inp", ".bdf", ".nas"):
        others.append(data.lower())
    if Path(name).suffix in (".obj", ".inp"):
        others.append(data.replace(b"\n", b"  \n\n"))
    for other in others:
        mesh = read_mesh(text_of(tmp_path, name, other))
        assert np.array_equal(mesh.points, sound.points) and np.array_equal(mesh.cells, sound.cells)


EXPECTED = {
    "folded.obj": "is folded onto its neighbour 54",
    "folded.ply": "is folded onto its neighbour 73",
    "truncated_hangs.ply": "it is cut off",
    "hangs.msh": "this is a mesh of ANSYS Fluent",
    "parts_b.inp": "line 363: *ELEMENT, TYPE=S4R has no elements",
    "incl.inp": "*INCLUDE is not followed: merge the files",
    "n3.bdf": "its nodes 1000 and 1010 stand in one place",  # radius 0 in cylinder coordinates
}


@pytest.mark.parametrize("name", EXPECTED)
def test_inputs_that_are_refused(name):
    before = time.perf_counter()
    assert EXPECTED[name] in said(INPUTS / name)
    assert time.perf_counter() - before < 2.0


@pytest.mark.parametrize(
    ("name", "nodes", "cells", "litres"),
    [
        ("inst.inp", 260, 256, 24),
        ("inst1.inp", 130, 128, 12),
        ("o2.obj", 130, 128, 12),
        ("first.vtu", 130, 128, 12),
        ("comp_inward.vtu", 228, 224, 13),
    ],
)
def test_inputs_that_are_right(name, nodes, cells, litres):
    mesh = read_mesh(INPUTS / name)
    assert (len(mesh.points), len(mesh.cells)) == (nodes, cells)
    assert volume(mesh) == pytest.approx(litres * 1e-3)


def test_parts_with_equal_numbers():
    mesh = read_mesh(INPUTS / "partsAB.inp")
    assert mesh.areas.sum() == pytest.approx(0.2 * 0.2 + 0.08 * 0.04)
    assert (
        mesh.points[mesh.cells[mesh.regions["A"]].ravel(), 2].max() == 0.0
        and mesh.points[mesh.cells[mesh.regions["B"]].ravel(), 2].min() == 1.0
    )


def test_instances_stand_where_they_are_placed():
    mesh = read_mesh(INPUTS / "inst.inp")
    one, two = (mesh.points[np.unique(mesh.cells[mesh.regions[n]])] for n in ("A1", "A2"))
    assert np.allclose(one.min(axis=0), [0, -0.2, 0]) and np.allclose(one.max(axis=0), [0.3, 0, 0.2])  # y -> z, z -> -y
    assert np.allclose(two.min(axis=0), [1, 0, 0]) and np.allclose(two.max(axis=0), [1.3, 0.2, 0.2])
    moved = read_mesh(INPUTS / "inst1.inp")
    assert moved.points[:, 0].min() == 5.0


def test_millimetres_are_caught():
    assert "spacing 50 m of the mesh against 50 mm of the numerics: is the file in millimetres? (scale = 0.001)" in said(
        INPUTS / "mm.vtu", spacing=0.05
    )
    assert len(read_mesh(INPUTS / "mm.vtu", scale=1e-3, spacing=0.05).cells) == 128


# ---------------------------------------------------------------- Abaqus
def test_abaqus_sets_instances_and_names(tmp_path):
    points, quads = box()
    mesh = read_mesh(text_of(tmp_path, "m.inp", inp_parts(points, quads)))
    assert {n: int(m.sum()) for n, m in mesh.regions.items()} == {
        "A-1": 32, "A-1.first": 2, "A-2": 32, "A-2.first": 2, "B-1": 32, "B-1.first": 2, "top": 2,
    }  # fmt: skip
    bad = inp_parts(points, quads).replace(b"1, 0.3", b"1, nonsense", 1)
    assert "line" in said(text_of(tmp_path, "bad.inp", bad))
    broken = inp_parts(points, np.vstack([quads, [0, 1, 2, 0]]))
    assert "element A-1.33 uses the same node twice" in said(text_of(tmp_path, "b.inp", broken))


def test_abaqus_systems_blocks_and_beams(tmp_path):
    """Two *NODE blocks, the second in a turned and moved system; cylinder coordinates; corners of S8R; a beam beside."""
    text = """*HEADING
*NODE
1, 0., 0., 0.
2, 1., 0., 0.
*SYSTEM
0., 0., 0., 0., 1., 0., -1., 0., 0.
*NODE
3, 1., -1., 0.
*SYSTEM
*NODE, SYSTEM=C
4, 1., 90., 0.
11, 0.5, 0., 0.
12, 0.5, 45., 0.
13, 0.5, 60., 0.
14, 0.5, 90., 0.
*ELEMENT, TYPE=S8R, ELSET=Plate
1, 1, 2, 3, 4, 11, 12,
13, 14
*ELEMENT, TYPE=B31, ELSET=Beams
2, 1, 2
*ELEMENT, TYPE=MASS
3, 1
"""
    mesh = read_mesh(text_of(tmp_path, "m.inp", text))
    assert np.allclose(mesh.points, [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], atol=1e-15)
    assert "1 B31, 1 MASS left out" in report(mesh) and "their corners only" in report(mesh) and list(mesh.regions) == ["Plate"]


@pytest.mark.parametrize(
    ("keyword", "words"),
    [
        ("*NGEN\n1,5,1", "*NGEN makes nodes"),
        ("*ELGEN\n1,2", "*ELGEN makes elements"),
        ("*PARAMETER\na=1", "*PARAMETER is not followed"),
        ("*NODE, INPUT=nodes.txt", "*NODE, INPUT= is not followed"),
        ("*NODE, SYSTEM=S\n1,1.,1.,1.", "SYSTEM=S is not supported"),
        ("*ELEMENT, TYPE=C3D8\n9,1,2,3,4,5,6,7,8", "type C3D8 are solids"),
        ("*ELEMENT, TYPE=S4Q\n9,1,2,3,4", "type S4Q are unknown here"),
        ("*ELEMENT, TYPE=S4R\n9,1,2,3", "has a number and 4 nodes, here are 4 numbers"),
        ("*ELEMENT, TYPE=S4R\n90,1,2,3,99", "element 90 refers to node 99, which the file does not give"),
        ("*ELEMENT, TYPE=S4R\n1,1,2,3,4", "element 1 is given twice"),
        ("*NODE\n1, 7., 7., 7.", "node 1 is given twice, in two places"),
        ("*ELSET, ELSET=x\nnowhere", "names the set 'nowhere', which is not there yet"),
        ("*INSTANCE, NAME=a, PART=b\n*END INSTANCE", "*INSTANCE stands outside *ASSEMBLY"),
        ("*PART, NAME=a", "the file ends inside *PART"),
    ],
)
def test_abaqus_refusals(tmp_path, keyword, words):
    points, quads = box()
    assert words in said(text_of(tmp_path, "m.inp", inp(points, quads) + f"{keyword}\n".encode()))


# ---------------------------------------------------------------- Nastran
def test_nastran_systems(tmp_path):
    """A quarter of a cylinder of radius 2 in CORD2C upon a moved CORD2R; CORD1R by three nodes; CORD2S."""
    text = "BEGIN BULK\nCORD2R,1,0,10.,0.,0.,10.,0.,1.\n,10.,1.,0.\nCORD2C,2,1,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\n"
    n = 6
    for k in range(n + 1):
        for j in (0, 1):
            text += f"GRID,{100 * k + j + 1},2,2.,{90 * k / n},{0.5 * j}\n"
    for k in range(n):
        a, b = 100 * k + 1, 100 * k + 101
        text += f"CQUAD4,{k + 1},7,{a},{b},{b + 1},{a + 1}\n"
    mesh = read_mesh(text_of(tmp_path, "c.bdf", text + "CBAR,99,3,1,101\nENDDATA\n"))
    p = mesh.points - [10, 0, 0]
    assert np.allclose(np.hypot(p[:, 0], p[:, 1]), 2.0)
    assert np.allclose(p[0], [0, 2, 0]) and np.allclose(p[-2], [-2, 0, 0])  # x' = y, y' = -x of the basic system
    assert "1 CBAR left out" in report(mesh)
    spin = "BEGIN BULK\nGRID,1,,0.,0.,0.\nGRID,2,,0.,1.,0.\nGRID,3,,1.,0.,0.\nCORD1R,4,1,2,3\nCORD2S,5,0,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\n"
    spin += f"GRID,4,4,1.,1.,0.\nGRID,5,5,{math.sqrt(2)!r},45.,0.\nCTRIA3,1,1,1,3,5\nCTRIA3,2,1,1,4,3\nENDDATA\n"
    mesh = read_mesh(text_of(tmp_path, "s.bdf", spin))
    assert np.allclose(mesh.points, [[0, 0, 0], [1, 0, 0], [1, 0, -1], [1, 0, 1]], atol=1e-12)


@pytest.mark.parametrize(
    ("card", "words"),
    [
        ("GRID    800                     1.      1.      1.                      +A\n+B", "continuation '+B' stands behind a card"),
        ("INCLUDE 'other.bdf'", "INCLUDE is not followed: merge the files"),
        ("CHEXA,90,1,1,2,3,4,5,6\n,7,8", "CHEXA is a solid"),
        ("CQAD4,90,1,1,2,3,4", "card 'CQAD4' is not known"),
        ("=,*1,=,*1", "cards repeated with = are not followed"),
        ("GRID,1,,9.,9.,9.", "node 1 is given twice, in two places"),
        ("GRID,900,77,1.,1.,1.\nCTRIA3,900,1,900,1,2", "coordinate system 77 is not given"),
        ("CORD2R,8,8,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\nGRID,900,8,1.,1.,1.\nCTRIA3,900,1,900,1,2", "coordinate system 8 rests on itself"),
        ("CORD2R,8,0,0.,0.,0.,0.,0.,1.\n,0.,0.,2.\nGRID,900,8,1.,1.,1.\nCTRIA3,900,1,900,1,2", "lie on one line"),
        ("CTRIA3,900,1,1,2,999", "element 900 refers to node 999, which the file does not give"),
        ("CTRIA3,1,1,1,2,3", "element 1 is given twice"),
        ("CTRIA3,900,1,1,2,2", "element 900 uses the same node twice"),
    ],
)
def test_nastran_refusals(tmp_path, card, words):
    points, quads = box()
    text = bdf_free(points, quads).replace(b"ENDDATA", card.encode() + b"\nENDDATA")
    assert words in said(text_of(tmp_path, "m.bdf", text))


# ---------------------------------------------------------------- LS-DYNA and Radioss
@pytest.mark.parametrize(
    ("keyword", "words"),
    [
        ("*INCLUDE\nother.k", "*INCLUDE is not followed: merge the files"),
        ("*NODE_TRANSFORM\n1,2", "*NODE_TRANSFORM is not followed"),
        ("*ELEMENT_SOLID\n1,1,1,2,3,4,5,6,7,8", "*ELEMENT_SOLID is not supported"),
        ("*ELEMENT_SHELL\n900,1,1,2,3,999", "element 900 refers to node 999"),
        ("*ELEMENT_SHELL_COMPOSITE\n900,1,1,2,3,4", "*ELEMENT_SHELL_COMPOSITE is not supported"),
        ("*NODE\n900,&x,0,0", "parameters (&) are not followed"),
    ],
)
def test_dyna_refusals(tmp_path, keyword, words):
    points, quads = box()
    text = k_standard(points, quads)
    assert words in said(text_of(tmp_path, "m.k", text.replace(b"*END\n", keyword.encode() + b"\n*END\n")))
    assert "the file has no *END" in said(text_of(tmp_path, "cut.k", text[:-5]))


def test_dyna_beams_thickness_and_sets(tmp_path):
    points, quads = box()
    more = "*ELEMENT_BEAM\n     900       1       1       2       3\n*SET_SHELL_LIST_TITLE\nlid\n         4\n         1         2\n*END\n"
    mesh = read_mesh(text_of(tmp_path, "m.k", k_standard(points, quads).replace(b"*END\n", more.encode())))
    assert "1 *ELEMENT_BEAM left out" in report(mesh) and mesh.regions["lid"].sum() == 2 and mesh.thickness["front"] == pytest.approx(2e-3)


@pytest.mark.parametrize(
    ("keyword", "words"),
    [
        ("#include other.inc", "#include is not followed: merge the files"),
        ("/TRANSFORM/TRA/1\nt\n1,2", "/TRANSFORM moves nodes"),
        ("/BRICK/1\n         1         1", "/BRICK is not supported"),
        ("/SHELL/1\n       900         1         2         3       999", "element 900 refers to node 999"),
        ("/NODE\n  1 2 3 4", "is no node: number in 10 columns"),
    ],
)
def test_radioss_refusals(tmp_path, keyword, words):
    points, quads = box()
    assert words in said(text_of(tmp_path, "m.rad", rad(points, quads).replace(b"/END", keyword.encode() + b"\n/END")))


def test_radioss_says_its_unit(tmp_path):
    points, quads = box()
    path = text_of(tmp_path, "m.rad", rad(1000 * points, quads).replace(b"   m ", b"  mm "))
    assert "its unit of length is 0.001 m, and scale is 1: write scale = 0.001" in said(path)
    assert volume(read_mesh(path, scale=1e-3)) == pytest.approx(0.012)


# ---------------------------------------------------------------- OBJ
def test_obj_notations(tmp_path):
    text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1//1 2//1 3//1\nf -4/1 -2/1/1 \\\n-1\n"
    assert read_mesh(text_of(tmp_path, "m.obj", text)).areas.sum() == pytest.approx(1.0)
    points, quads = box()
    good = obj(points, quads)
    for more, words in (
        (b"f 1 2 3 4 5\n", "face 33 has 5 corners"),
        (b"f 1 2 99\n", "face 33 refers to vertex 99"),
        (b"f 1 2 -99\n", "face 33 refers to vertex '-99'"),
        (b"f 0 1 2\n", "face 33 refers to vertex '0'"),
        (b"curv2 1 2\n", "'curv2' is no keyword"),
        (b"v 1 nan 2\n", "'nan' stands where a coordinate should"),
        (b"v 1 1e999 2\n", "'1e999' stands where a coordinate should"),
    ):
        assert words in said(text_of(tmp_path, "m.obj", good + more))


# ---------------------------------------------------------------- by meshio
def test_groups_of_med(tmp_path):
    """Families are sets of groups: a cell of family -3 is in both."""
    points, quads = box()
    family = np.where(np.arange(32) < 8, -1, np.where(np.arange(32) < 16, -3, -2))
    mesh = meshio.Mesh(points, [("quad", quads)], cell_data={"cell_tags": [family]})
    mesh.cell_tags = {-1: ["front"], -2: ["back"], -3: ["front", "back"]}
    mesh.write(tmp_path / "m.med")
    found = read_mesh(tmp_path / "m.med")
    assert (found.regions["front"].sum(), found.regions["back"].sum()) == (16, 24) and "closed" in report(found)
    assert len(read_mesh(tmp_path / "m.med", part="front").cells) == 16


@pytest.mark.parametrize("name", ["m.xdmf", "m.inp"])
def test_what_meshio_writes(tmp_path, name):
    points, quads = box()
    meshio.Mesh(points, [("quad", quads)]).write(tmp_path / name)
    (tmp_path / "numpy.py").write_text("raise SystemExit(7)")  # a stranger's folder: nothing in it is run
    assert volume(read_mesh(tmp_path / name)) == pytest.approx(0.012)


# ---------------------------------------------------------------- seams, slits, normals
def test_seams_and_noise_are_merged_and_said(tmp_path):
    points, quads = box()
    rng = np.random.default_rng(1)
    apart = points[quads].reshape(-1, 3) + 2e-5 * rng.uniform(-1, 1, (4 * len(quads), 3))  # every cell its own nodes, 0.0002 D of noise
    mesh = read_mesh(text_of(tmp_path, "m.obj", obj(apart, np.arange(len(apart)).reshape(-1, 4))))
    assert len(mesh.points) == len(points) and "closed" in report(mesh) and "nodes merged with others within 0.001" in report(mesh)
    noisy = stl_text(points, quads).replace(b"vertex 0.0 0.0 0.0", b"vertex 0.00002 0.0 0.0", 1)
    assert "merged with others" in report(read_mesh(text_of(tmp_path, "m.stl", noisy)))
    clean = report(read_mesh(text_of(tmp_path, "c.stl", stl_text(points, quads))))
    assert "merged" not in clean


def test_near_nodes_that_remain_are_an_error(tmp_path):
    points, quads = box()
    first = quads[0, 0] + 1
    points = np.vstack([points, points[quads[0, 0]] + [5e-4, 0, 0]])
    quads[0, 0] = len(points) - 1
    sentence = said(text_of(tmp_path, "m.obj", obj(points, quads)))
    assert f"nodes {first} and {len(points)} at" in sentence and "500 um apart, 0.005 of their cells, and no cell joins them" in sentence


def test_a_slit_of_zero_width(tmp_path):
    """Two rows of cells that share no node along y = 1, but for its ends."""
    n = 4
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(3.0), indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    k = np.arange(3 * (n + 1)).reshape(n + 1, 3)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1, 4)
    middle = k[1:-1, 1]
    twin = dict(zip(middle.tolist(), range(len(points), len(points) + n - 1)))
    upper = points[quads].mean(axis=1)[:, 1] > 1
    quads[upper] = [[twin.get(c, c) for c in q] for q in quads[upper].tolist()]
    path = text_of(tmp_path, "m.obj", obj(np.vstack([points, points[middle]]), quads))
    joined, slit = read_mesh(path), read_mesh(path, merge=False)
    assert len(joined.points) == 15 and len(slit.points) == 18
    assert (joined.edges.sides[:, 1] < 0).sum() == 12 and (slit.edges.sides[:, 1] < 0).sum() == 12 + 2 * n
    assert "3 pairs of nodes in one place kept" in report(slit) and "3 nodes merged" in report(joined)


def test_most_of_a_piece_says_where_out_is(tmp_path):
    points, quads = box()
    for turned in ([0], [1, 5], [31]):
        some = quads.copy()
        some[turned] = some[turned][:, ::-1]
        mesh = read_mesh(text_of(tmp_path, "m.obj", obj(points, some)))
        assert volume(mesh) == pytest.approx(0.012) and "turned round, as most of their piece say" in report(mesh)
    wall = quads[:8].copy()  # open: nothing but its cells says where out is
    normal = read_mesh(text_of(tmp_path, "w.obj", obj(points, wall))).area_vectors
    wall[0] = wall[0, ::-1]
    assert np.allclose(read_mesh(text_of(tmp_path, "v.obj", obj(points, wall))).area_vectors, normal)
    assert "1 closed piece turned outward" in report(read_mesh(text_of(tmp_path, "i.obj", obj(points, quads[:, ::-1]))))


def test_a_plane_mesh_that_is_folded(tmp_path):
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.4, 0.2, 0]], float)
    cells = np.array([[0, 1, 2], [0, 2, 4]])  # the second lies upon the first
    assert "is folded onto its neighbour 2" in said(text_of(tmp_path, "m.obj", obj(points, cells)), plane=True)
    assert "is folded onto its neighbour 2" in said(text_of(tmp_path, "m.obj", obj(points, cells)))


def test_a_reader_that_does_not_answer(tmp_path, monkeypatch):
    points, quads = box()
    path = text_of(tmp_path, "m.vtu", WRITERS["m.vtu"](points, quads))
    before = time.perf_counter()
    assert "was not read within 0.01 s" in said(path, time_limit=0.01)
    assert time.perf_counter() - before < 5.0
