"""Small meshes as the codes write them: a closed box and a plate in every format that is read, by hand where meshio cannot."""

from __future__ import annotations

import struct
import tempfile
from collections.abc import Callable
from pathlib import Path

import meshio
import numpy as np

Groups = dict[str, list[int]]


def box(n: tuple[int, int, int] = (3, 2, 2), d: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) and quadrangles (M, 4) of the six sides of a box, outward, its nodes shared."""
    number: dict[tuple[int, ...], int] = {}
    cells = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for end in (0, 1):
            for i in range(n[u]):
                for j in range(n[v]):
                    corners = []
                    for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
                        place = [0, 0, 0]
                        place[axis], place[u], place[v] = end * n[axis], i + a, j + b
                        corners.append(number.setdefault(tuple(place), len(number)))
                    cells.append(corners if end else corners[::-1])
    return d * np.array(list(number), float), np.array(cells)


def halves(quads: np.ndarray) -> np.ndarray:
    """(2 M, 3) triangles of quadrangles."""
    return np.stack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]], axis=1).reshape(-1, 3)


def _rows(kind: str, points: np.ndarray) -> str:
    return "".join(kind.format(k + 1, *p) for k, p in enumerate(points.tolist()))


def _by_region(cells: np.ndarray) -> list[tuple[str, np.ndarray]]:
    """Two regions: the first half of the cells and the second."""
    k = np.arange(len(cells))
    return [("front", k[: len(k) // 2]), ("back", k[len(k) // 2 :])]


def inp(points: np.ndarray, cells: np.ndarray) -> bytes:
    text = "*HEADING\nbox\n** a comment\n*NODE, NSET=all\n" + _rows("{}, {!r}, {!r}, {!r}\n", points)
    kind = {3: "S3", 4: "S4R"}[cells.shape[1]]
    for name, rows in _by_region(cells):
        text += f"*ELEMENT, TYPE={kind}, ELSET={name}\n"
        text += "".join(f"{k + 1}, {', '.join(str(n + 1) for n in cells[k])}\n" for k in rows)
    text += f"*ELSET, ELSET=odd, GENERATE\n1, {len(cells)}, 2\n*SHELL SECTION, ELSET=front, MATERIAL=steel\n0.002, 5\n"
    return text.encode()


def inp_parts(points: np.ndarray, cells: np.ndarray) -> bytes:
    """Two parts with equal numbers, three instances."""
    kind = {3: "S3", 4: "S4R"}[cells.shape[1]]
    text = "*HEADING\n"
    for name, shift in (("A", 0.0), ("B", 1.0)):
        text += f"*PART, NAME={name}\n*NODE\n" + _rows("{}, {!r}, {!r}, {!r}\n", points + [0, 0, shift]) + f"*ELEMENT, TYPE={kind}\n"
        text += (
            "".join(f"{k + 1}, {', '.join(str(n + 1) for n in c)}\n" for k, c in enumerate(cells))
            + "*ELSET, ELSET=first\n1, 2\n*END PART\n"
        )
    text += "*ASSEMBLY, NAME=all\n*INSTANCE, NAME=A-1, PART=A\n*END INSTANCE\n*INSTANCE, NAME=A-2, PART=A\n5., 0., 0.\n"
    text += "5., 0., 0., 5., 1., 0., 90.\n*END INSTANCE\n*INSTANCE, NAME=B-1, PART=B\n*END INSTANCE\n"
    return (text + "*ELSET, ELSET=top, INSTANCE=B-1\n3, 4\n*END ASSEMBLY\n").encode()


def _bdf(points: np.ndarray, cells: np.ndarray, grid: Callable, cell: Callable) -> bytes:
    text = "SOL 101\nCEND\nTITLE = box\nBEGIN BULK\n$ a comment\nPSHELL,1,1,0.002\nPSHELL,2,1,0.003\n"
    text += "".join(grid(k + 1, *p) for k, p in enumerate(points.tolist()))
    name = {3: "CTRIA3", 4: "CQUAD4"}[cells.shape[1]]
    for pid, (_, rows) in enumerate(_by_region(cells), 1):
        text += "".join(cell(name, k + 1, pid, *(cells[k] + 1)) for k in rows)
    return (text + "ENDDATA\n").encode()


def _eight(x: float) -> str:
    return f"{x:8.5f}" if x >= 0 else f"{x:8.4f}"


def bdf_free(points: np.ndarray, cells: np.ndarray) -> bytes:
    return _bdf(points, cells, lambda k, x, y, z: f"GRID,{k},,{x!r},{y!r},{z!r}\n", lambda name, *f: f"{name},{','.join(map(str, f))}\n")


def bdf_small(points: np.ndarray, cells: np.ndarray) -> bytes:
    def grid(k: int, x: float, y: float, z: float) -> str:
        return f"GRID    {k:8d}        {_eight(x)}{_eight(y)}{_eight(z)}\n"

    return _bdf(points, cells, grid, lambda name, *f: f"{name:8s}{''.join(f'{v:8d}' for v in f)}\n")


def bdf_large(points: np.ndarray, cells: np.ndarray) -> bytes:
    def real(x: float) -> str:
        return f"{x:.9E}".replace("E", "").rjust(16)  # 1.0-1 is 1.0e-1

    def grid(k: int, x: float, y: float, z: float) -> str:
        return f"GRID*   {k:16d}{'':16s}{real(x)}{real(y)}*\n*       {real(z)}\n"

    def cell(name: str, *f: int) -> str:
        first, rest = f[:4], f[4:]
        return f"{name + '*':8s}{''.join(f'{v:16d}' for v in first)}*C\n*C      {''.join(f'{v:16d}' for v in rest)}\n"

    return _bdf(points, cells, grid, cell)


def _k(points: np.ndarray, cells: np.ndarray, head: str, width: int, wide: int) -> bytes:
    def fields(values: list[int], width: int) -> str:
        return "".join(f"{v:{width}d}" for v in values)

    ten = 20 if width == 20 else 10
    text = f"$ a comment\n*KEYWORD{head}\n*TITLE\nbox\n*NODE\n"
    text += "".join(f"{k + 1:{width}d}{x:{wide}.8E}{y:{wide}.8E}{z:{wide}.8E}\n" for k, (x, y, z) in enumerate(points))
    text += "*ELEMENT_SHELL\n"
    for pid, (_, rows) in enumerate(_by_region(cells), 1):
        text += "".join(fields([k + 1, pid, *(cells[k] + 1), *([cells[k][2] + 1] * (4 - len(cells[k])))], width) + "\n" for k in rows)
    text += (
        f"*PART\nfront\n{fields([1, 7, 1], ten)}\nback\n{fields([2, 7, 1], ten)}\n*SECTION_SHELL\n{fields([7, 2], ten)}\n{2e-3:{ten}.3E}\n"
    )
    return (text + "*END\n").encode()


def k_standard(points: np.ndarray, cells: np.ndarray) -> bytes:
    return _k(points, cells, "", 8, 16)


def k_i10(points: np.ndarray, cells: np.ndarray) -> bytes:
    return _k(points, cells, " I10=Y", 10, 16)


def k_long(points: np.ndarray, cells: np.ndarray) -> bytes:
    return _k(points, cells, " LONG=Y", 20, 20)


def rad(points: np.ndarray, cells: np.ndarray) -> bytes:
    text = "#RADIOSS STARTER\n/BEGIN\nbox\n      2022         0\n                  kg                   m                   s\n"
    text += "                  kg                   m                   s\n/NODE\n"
    text += "".join(f"{k + 1:10d}{x:20.12g}{y:20.12g}{z:20.12g}\n" for k, (x, y, z) in enumerate(points))
    word = {3: "SH3N", 4: "SHELL"}[cells.shape[1]]
    for pid, (name, rows) in enumerate(_by_region(cells), 1):
        text += f"/PART/{pid}\n{name}\n{9:10d}{1:10d}{0:10d}\n/{word}/{pid}\n"
        text += "".join(f"{k + 1:10d}{''.join(f'{n + 1:10d}' for n in cells[k])}\n" for k in rows)
    text += f"/PROP/SHELL/9\nsheet\n#   Ishell\n{24:10d}\n{0:20d}\n{3:10d}{'':10s}{2e-3:20.6g}\n/END\n"
    return text.encode()


def obj(points: np.ndarray, cells: np.ndarray) -> bytes:
    text = "# a comment\nmtllib m.mtl\no box\n" + "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in points.tolist()) + "vn 0 0 1\nvt 0 0\n"
    for name, rows in _by_region(cells):
        text += f"g {name}\n" + "".join("f " + " ".join(f"{n + 1}/1/1" for n in cells[k]) + "\n" for k in rows)
    return text.encode()


def _ply_head(kind: str, n: int, m: int) -> bytes:
    xyz = "".join(f"property double {c}\n" for c in "xyz")
    head = f"ply\nformat {kind} 1.0\ncomment box\nelement vertex {n}\n{xyz}element face {m}\nproperty list uchar int vertex_indices\n"
    return (head + "end_header\n").encode()


def ply_text(points: np.ndarray, cells: np.ndarray) -> bytes:
    text = "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in points.tolist())
    text += "".join(f"{len(c)} {' '.join(map(str, c))}\n" for c in cells)
    return _ply_head("ascii", len(points), len(cells)) + text.encode()


def _ply_bytes(order: str, kind: str) -> Callable:
    def write(points: np.ndarray, cells: np.ndarray) -> bytes:
        faces = b"".join(struct.pack(f"{order}B{len(c)}i", len(c), *c) for c in cells.tolist())
        return _ply_head(kind, len(points), len(cells)) + points.astype(order + "f8").tobytes() + faces

    return write


def stl_text(points: np.ndarray, cells: np.ndarray) -> bytes:
    cells = cells if cells.shape[1] == 3 else halves(cells)
    text = ""
    for name, rows in _by_region(cells):
        text += f"solid {name}\n"
        for k in rows:
            loop = "".join(f"   vertex {x!r} {y!r} {z!r}\n" for x, y, z in points[cells[k]].tolist())
            text += f" facet normal 0 0 0\n  outer loop\n{loop}  endloop\n endfacet\n"
        text += f"endsolid {name}\n"
    return text.encode()


def stl_bytes(points: np.ndarray, cells: np.ndarray) -> bytes:
    cells = cells if cells.shape[1] == 3 else halves(cells)
    facets = b"".join(np.zeros(3, "<f4").tobytes() + points[c].astype("<f4").tobytes() + b"\0\0" for c in cells)
    return b"box".ljust(80) + struct.pack("<I", len(cells)) + facets


def off(points: np.ndarray, cells: np.ndarray) -> bytes:
    text = f"OFF\n# a comment\n{len(points)} {len(cells)} 0\n" + "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in points.tolist())
    return (text + "".join(f"{len(c)} {' '.join(map(str, c))}\n" for c in cells)).encode()


def msh22(points: np.ndarray, cells: np.ndarray) -> bytes:
    """Physical groups; the first cell stands in both, twice."""
    kind = {3: 2, 4: 3}[cells.shape[1]]
    text = '$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 1 "front"\n2 2 "back"\n$EndPhysicalNames\n'
    text += f"$Nodes\n{len(points)}\n" + "".join(f"{10 * (k + 1)} {x!r} {y!r} {z!r}\n" for k, (x, y, z) in enumerate(points.tolist()))
    rows = [(k, 1 if r == "front" else 2) for r, rows in _by_region(cells) for k in rows] + [(0, 2)]
    text += f"$EndNodes\n$Elements\n{len(rows) + 1}\n1 15 2 0 1 10\n"
    text += "".join(f"{n} {kind} 2 {g} 1 {' '.join(str(10 * (c + 1)) for c in cells[k])}\n" for n, (k, g) in enumerate(rows, 2))
    return (text + "$EndElements\n").encode()


def msh41(points: np.ndarray, cells: np.ndarray) -> bytes:
    """Two surfaces, the second in two physical groups."""
    kind = {3: 2, 4: 3}[cells.shape[1]]
    text = '$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 1 "front"\n2 2 "back"\n$EndPhysicalNames\n'
    text += "$Entities\n1 0 2 0\n1 0 0 0 0\n1 0 0 0 1 1 1 1 1 0\n2 0 0 0 1 1 1 2 1 2 0\n$EndEntities\n"
    text += f"$Nodes\n1 {len(points)} 10 {10 * len(points)}\n2 1 0 {len(points)}\n" + "".join(
        f"{10 * (k + 1)}\n" for k in range(len(points))
    )
    text += (
        "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in points.tolist()) + f"$EndNodes\n$Elements\n3 {len(cells) + 1} 1 {len(cells) + 1}\n"
    )
    text += "0 1 15 1\n1 10\n"
    for tag, (_, rows) in enumerate(_by_region(cells), 1):
        text += f"2 {tag} {kind} {len(rows)}\n" + "".join(f"{k + 2} {' '.join(str(10 * (c + 1)) for c in cells[k])}\n" for k in rows)
    return (text + "$EndElements\n").encode()


def _meshio(suffix: str, **options: object) -> Callable:
    def write(points: np.ndarray, cells: np.ndarray) -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"m{suffix}"
            region = np.where(np.arange(len(cells)) < len(cells) // 2, 1, 2)
            mesh = meshio.Mesh(points, [({3: "triangle", 4: "quad"}[cells.shape[1]], cells)], cell_data={"region": [region]})
            mesh.write(path, **options)
            return path.read_bytes()

    return write


WRITERS: dict[str, Callable[[np.ndarray, np.ndarray], bytes]] = {
    "flat.inp": inp,
    "parts.inp": inp_parts,
    "free.bdf": bdf_free,
    "small.bdf": bdf_small,
    "large.nas": bdf_large,
    "standard.k": k_standard,
    "ten.key": k_i10,
    "long.dyn": k_long,
    "m.rad": rad,
    "m.obj": obj,
    "text.ply": ply_text,
    "little.ply": _ply_bytes("<", "binary_little_endian"),
    "big.ply": _ply_bytes(">", "binary_big_endian"),
    "text.stl": stl_text,
    "bytes.stl": stl_bytes,
    "m.off": off,
    "two.msh": msh22,
    "four.msh": msh41,
    "twob.msh": _meshio(".msh", file_format="gmsh22"),
    "fourb.msh": _meshio(".msh", file_format="gmsh"),
    "m.vtu": _meshio(".vtu"),
    "text.vtu": _meshio(".vtu", binary=False),
    "m.vtk": _meshio(".vtk"),
    "text.vtk": _meshio(".vtk", binary=False),
    "m.mesh": _meshio(".mesh"),
}
