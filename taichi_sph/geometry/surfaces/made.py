"""The mesh of a shell, generated or read, made once as long as somebody holds it."""

from __future__ import annotations

from collections.abc import Hashable
from weakref import WeakValueDictionary

import numpy as np

from ...errors import SceneError
from ...scene import Rigid, Scene, Shell
from ...scene.plausible import MAX_NODES
from ...scene.surfaces import MeshFile, Net
from ...scene.units import show
from ..mesh import SurfaceMesh
from ..meshfile import read_mesh
from ..meshfile import surface as surface_of
from ..meshfiles.raw import Raw
from .counts import count
from .generated import generate

_MADE: WeakValueDictionary[Hashable, SurfaceMesh] = WeakValueDictionary()


def _plane(body: Shell | Rigid) -> bool:
    """Whether it stays in its plane."""
    return body.motion == "in_plane"


def mesh_key(shell: Shell | Rigid, scene: Scene) -> Hashable:
    """What the mesh of a shell follows from."""
    surface = shell.surface
    if isinstance(surface, MeshFile):
        written = surface.path.stat().st_mtime_ns if surface.path.is_file() else 0
        return surface, written, _plane(shell), scene.numerics_of(shell).spacing
    n = scene.numerics_of(shell)
    if isinstance(surface, Net):
        return surface, _plane(shell)
    return surface, n.spacing, n.cells, n.irregularity, n.seed


def mesh_of(shell: Shell | Rigid, scene: Scene) -> SurfaceMesh:
    """The mid-surface of a shell, or the surface of a rigid body, generated or read; refused by its count where it is too large.

    As long as somebody holds a mesh (the plan of a run does), the mesh is not made again.
    """
    key = mesh_key(shell, scene)
    mesh = _MADE.get(key)
    if mesh is None:
        mesh = _MADE[key] = _mesh_of(shell, scene)
    return mesh


def _mesh_of(shell: Shell | Rigid, scene: Scene) -> SurfaceMesh:
    numerics = scene.numerics_of(shell)
    plane = _plane(shell)
    if isinstance(shell.surface, Net):
        return _of_arrays(shell.surface, plane)
    assert shell.surface is not None
    if not isinstance(shell.surface, MeshFile):
        nodes = count(shell.surface, numerics)
        if nodes > MAX_NODES:
            raise SceneError(
                f"numerics.spacing {show(numerics.spacing, 'm')} gives {shell.what} '{shell.name}' {nodes:.2g} nodes; at most "
                f"{MAX_NODES / 1e6:g} million are allowed"
            )
        return generate(shell.surface, numerics)
    file = shell.surface
    return read_mesh(
        file.path,
        file.scale,
        plane=plane,
        part=file.part,
        merge=file.merge,
        spacing=numerics.spacing,
        time_limit=file.time_limit,
    )


def _of_arrays(net: Net, plane: bool) -> SurfaceMesh:
    """Checked as what a file says; its points and cells count from 0."""
    points = np.asarray(net.points, dtype=np.float64)
    cells = np.full((len(net.cells), 4), -1, np.int64)
    for row, cell in enumerate(net.cells):
        cells[row, : len(cell)] = cell
    groups = {name: np.array(rows) for name, rows in net.groups.items()}
    raw = Raw(points, cells, np.arange(len(points)), np.arange(len(cells)), first=0, regions=groups)
    return surface_of("net", raw, plane=plane, merge=net.merge)
