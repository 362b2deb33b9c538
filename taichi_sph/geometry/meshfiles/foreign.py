"""Formats that meshio reads (VTK, VTU, MED, XDMF, Medit), in a process of their own with a limit of time and memory.

A damaged file may lead a reader into an endless loop or to an array of any size; neither reaches the caller.
"""

from __future__ import annotations

import contextlib
import io
import os
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import SceneError, nearest
from .raw import Raw, refused

FORMATS = {".vtu": "vtu", ".vtk": "vtk", ".med": "med", ".xdmf": "xdmf", ".mesh": "medit"}
SOLIDS = FORMATS | {".msh": "gmsh", ".inp": "abaqus", ".bdf": "nastran", ".nas": "nastran"}  # of solids, which no other reader takes
MEMORY = 16 * 2**30  # bytes of address space of the process
IGNORED = ("vertex", "line")
WANTED = {False: ("a shell is made of triangles and quadrangles of first order", {"triangle": 3, "quad": 4}),
          True: ("a solid is made of hexahedra and tetrahedra of first order", {"tetra": 4, "hexahedron": 8})}  # fmt: skip
GROUPS = ("gmsh:physical", "medit:ref", "region", "part", "group", "material")  # cell data whose values are regions
FROM = {".med": 1, ".mesh": 1}  # first number of a node; VTK and XDMF count from 0


def read_solid(path: Path, time_limit: float, part: str | tuple[str, ...] | None = None) -> Raw:
    """The hexahedra and tetrahedra of a file: cells (M, 8), -1 behind a tetrahedron. part: the region, or regions, that are read."""
    if not path.is_file():
        raise refused(f"there is no mesh file '{path}'")
    if path.suffix.lower() not in SOLIDS:
        raise refused(f"mesh {path.name}: '{path.suffix}' is no format of solid meshes; readable are {', '.join(SOLIDS)}")
    raw = read(path, time_limit, solid=True)
    if not len(raw.cells):
        raise refused(f"mesh {path.name} has no hexahedra and no tetrahedra: a solid is made of them")
    if part is not None:
        names = (part,) if isinstance(part, str) else part
        for name in names:
            if name not in raw.regions:
                raise refused(f"mesh {path.name} has no part '{name}'{nearest(name, raw.regions)}")
        raw.cells = raw.cells[np.unique(np.concatenate([raw.regions[name] for name in names]))]
    return raw


def read(path: Path, time_limit: float, solid: bool = False) -> Raw:
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "mesh.npz"
        root = str(Path(__file__).parents[3])  # of this package, wherever it was found
        paths = [os.path.abspath(p) for p in os.environ.get("PYTHONPATH", "").split(os.pathsep) if p]
        try:
            done = subprocess.run(
                [sys.executable, "-P", "-m", "taichi_sph.geometry.meshfiles.foreign", str(path.resolve()), str(out), str(int(solid))],
                capture_output=True,
                timeout=time_limit,
                stdin=subprocess.DEVNULL,
                env={**os.environ, "PYTHONPATH": os.pathsep.join([root, *paths])},
                cwd=path.resolve().parent,  # an XDMF file names the arrays beside it; with -P no program there is imported
            )
        except subprocess.TimeoutExpired:
            raise refused(f"mesh {path.name} was not read within {time_limit:g} s: it is damaged, or needs a longer time_limit") from None
        if done.returncode == 3:
            raise refused(done.stdout.decode("utf-8", errors="replace").strip())
        if done.returncode != 0 or not out.is_file():
            raise refused(f"mesh {path.name} cannot be read as {path.suffix}: its reader broke off (code {done.returncode})")
        with np.load(out) as arrays:
            regions = {str(name): arrays[f"region_{k}"] for k, name in enumerate(arrays["names"])}
            points, cells = arrays["points"], arrays["cells"]
    return _raw(path, points, cells, regions)


def _raw(path: Path, points: np.ndarray, cells: np.ndarray, regions: dict[str, np.ndarray]) -> Raw:
    first = FROM.get(path.suffix.lower(), 0)
    return Raw(points, cells, first + np.arange(len(points)), first + np.arange(len(cells)), first=first, regions=regions)


def read_here(path: Path, solid: bool = False) -> Raw:
    """As `read`, in this process and without limits."""
    return _raw(path, *_arrays(path.name, _meshio(path), solid))


def _meshio(path: Path) -> Any:
    import meshio

    try:
        # meshio prints, and ends the program, where the readers of an ending have all failed
        said = io.StringIO()
        with warnings.catch_warnings(), contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            warnings.simplefilter("ignore")
            with np.errstate(all="ignore"):
                return meshio.read(path, file_format=SOLIDS[path.suffix.lower()])
    except (Exception, SystemExit) as error:
        why = "" if isinstance(error, SystemExit) else "".join(c for c in " ".join(str(error).split()) if c.isprintable())[:120]
        raise refused(f"mesh {path.name} cannot be read as {path.suffix}{f' ({why})' if why else ''}") from None


def _arrays(name: str, mesh: Any, solid: bool = False) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """points (N, 3) f64, cells (M, 4) int64 with -1 behind triangles, of a solid (M, 8); rows of cells by name of region."""
    made_of, kinds = WANTED[solid]
    most = max(kinds.values())
    ignored = (*IGNORED, *WANTED[False][1]) if solid else IGNORED
    try:
        points = np.asarray(mesh.points, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] not in (2, 3) or len(points) == 0:
            raise refused(f"mesh {name} has no points")
        points = np.column_stack([points, np.zeros((len(points), 3 - points.shape[1]))])
        blocks, kept = [], []
        for number, block in enumerate(mesh.cells):
            if block.type in kinds:
                data = np.asarray(block.data)
                if data.dtype.kind not in "iu" or data.ndim != 2:
                    raise refused(f"mesh {name}: its cells refer to nodes by numbers that are not whole")
                wrong = (data.astype(np.float64) < 0) | (data.astype(np.float64) >= len(points))
                if wrong.any():
                    raise refused(
                        f"mesh {name}: a {block.type} refers to node {data[wrong][0]}, which does not exist ({len(points)} nodes)"
                    )
                full = np.full((len(data), most), -1, np.int64)
                full[:, : data.shape[1]] = data
                blocks.append(full)
                kept.append(number)
            elif not block.type.startswith(ignored):
                raise refused(f"mesh {name} has {len(block.data)} cells of type '{block.type}'; {made_of}")
        cells = np.concatenate(blocks) if blocks else np.empty((0, most), np.int64)
        return points, cells, _regions(mesh, kept)
    except SceneError:
        raise
    except (ValueError, TypeError, IndexError, KeyError) as error:
        raise refused(f"mesh {name}: its arrays do not fit each other ({' '.join(str(error).split())[:100]})") from None


def _regions(mesh: Any, kept: list[int]) -> dict[str, np.ndarray]:
    regions: dict[str, np.ndarray] = {}
    tags = getattr(mesh, "cell_tags", {})  # of MED: names by the number of a family
    for key, data in mesh.cell_data.items():
        if key not in GROUPS and not (key == "cell_tags" and tags):
            continue
        blocks = [np.asarray(data[k]).ravel() for k in kept]
        values = np.concatenate(blocks) if blocks else np.zeros(0)
        for value in np.unique(values):
            if not float(value).is_integer():
                continue
            for name in tags.get(int(value), []) if key == "cell_tags" else [str(int(value))]:
                rows = np.flatnonzero(values == value)
                regions[str(name)] = np.union1d(regions[str(name)], rows) if str(name) in regions else rows
    return regions


def _main(path: str, out: str, solid: str) -> int:
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    try:
        raw = read_here(Path(path), solid == "1")
    except SceneError as error:
        print(error)
        return 3
    except MemoryError:
        print(f"mesh {Path(path).name} asks for more than {MEMORY // 2**30} GB of memory: it is damaged or too large")
        return 3
    names = np.array(list(raw.regions), dtype=str)
    arrays: dict[str, Any] = {f"region_{k}": v for k, v in enumerate(raw.regions.values())}
    np.savez(out, points=raw.points, cells=raw.cells, names=names, **arrays)
    return 0


if __name__ == "__main__":
    sys.exit(_main(*sys.argv[1:]))
