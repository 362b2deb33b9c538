"""Which part of a solid is computed in which form. A solid of elements with a patch is two bodies: its elements, and its particles.

Elements whose middle is in a region of the patch are particles alone. Those around them, one wide, are both, and each of the two counts one
half there (geometry/solids/split.py). NumPy only.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from weakref import WeakValueDictionary

import numpy as np

from ...errors import SceneError
from ...geometry.parted import around, closed, corners_of
from ...geometry.solids import SolidMesh, Split, mesh_key, mesh_of, subdivided
from ...scene import Scene
from ...scene.plausible import MAX_NODES
from ...scene.units import show
from .. import parted
from ..shell.said import PARTICLES
from .said import Solid

FEWEST, MOST = 1, 20  # particles along the edge of an element


@dataclass(frozen=True)
class Part:
    """said: the solid in its own form; whole: what the scene says, the same where it has no patch."""

    said: Solid
    whole: Solid


def parts(solids: Sequence[Solid]) -> Iterator[Part]:
    """The parts of solids, in their order. The elements of a solid keep its name."""
    for solid in solids:
        yield Part(solid, solid)
        if (patch := solid.patch) is not None:
            own = {"name": solid.name + PARTICLES, "formulation": patch.formulation, "spacing": patch.spacing, "patch": None}
            yield Part(solid.model_copy(update=own), solid)


def meshed(one: Part, scene: Scene) -> tuple[Split | None, SolidMesh]:
    """The parts of its solid, None where that is whole, and its mesh; SceneError where the patch does not fit."""
    if one.whole.patch is None:
        return None, mesh_of(one.said, scene)
    split = split_of(one.whole, scene)
    return split, split.elements if one.said.name == one.whole.name else split.fine.mesh


_SPLITS: WeakValueDictionary[Hashable, Split] = WeakValueDictionary()


def split_of(solid: Solid, scene: Scene) -> Split:
    """Of a solid with a patch, made once as long as somebody holds it; SceneError where the patch does not fit the mesh or a support."""
    key = mesh_key(solid, scene), solid.model_dump_json(include={"patch"})
    split = _SPLITS.get(key)
    if split is None:
        split = _SPLITS[key] = _split(solid, scene)
    parted.held(scene, solid.name, f"solid '{solid.name}'", split, split.tied)
    return split


def _split(solid: Solid, scene: Scene) -> Split:
    mesh, patch, where = mesh_of(solid, scene), solid.patch, f"{scene.key_of(solid)}.patch"
    assert patch is not None
    patched = parted.caught(patch.where, mesh.centres, mesh.spacing, f"solid '{solid.name}'", where)
    corner = corners_of(mesh.cells)
    patched = closed(patched, corner)
    overlap = around(corner, patched) & ~patched
    if (patched | overlap).all():
        raise SceneError(
            f"{where} leaves no elements of solid '{solid.name}' beyond the overlap; leave the patch out and set its formulation to "
            "'particles'"
        )
    both = np.flatnonzero(patched | overlap)
    if (mesh.corners[both] < 8).any():
        bad = mesh.centres[both[mesh.corners[both] < 8][0]]
        raise SceneError(
            f"{where}: the element at ({parted.at(bad)}) is a tetrahedron, and only hexahedra can be divided; mesh "
            "the patch and one element around it with hexahedra, or move it"
        )
    parted.apart(mesh.points, corner, patched, overlap, where)
    size = float(np.cbrt(mesh.volumes[both].mean()))
    n = parted.along(size, patch.spacing, FEWEST, MOST, where)
    if (count := len(both) * n**3) > MAX_NODES:
        raise SceneError(
            f"{where}.spacing {show(patch.spacing, 'm')} gives solid '{solid.name}' {count:.2g} particles; at most {MAX_NODES / 1e6:g} "
            "million are allowed"
        )
    return Split(mesh, n, patched, overlap, subdivided(mesh, both, n))
