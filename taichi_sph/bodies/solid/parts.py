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
from ...geometry.regions import inside
from ...geometry.solids import SolidMesh, Split, mesh_key, mesh_of, subdivided
from ...scene import Scene
from ...scene.plausible import MAX_NODES
from ...scene.units import show
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
    _supports(scene, solid, split)
    return split


def _split(solid: Solid, scene: Scene) -> Split:
    mesh, patch, where = mesh_of(solid, scene), solid.patch, f"{scene.key_of(solid)}.patch"
    assert patch is not None
    patched = np.zeros(len(mesh.cells), bool)
    for number, region in enumerate(patch.where):
        caught = inside(region, mesh.centres)
        if not caught.any():
            low, high = (", ".join(show(x, "m") for x in f(mesh.centres, axis=0)) for f in (np.min, np.max))
            raise SceneError(
                f"{where}.where[{number}] lies off the mesh: it holds the middle of no element of solid '{solid.name}', which are "
                f"{show(mesh.spacing, 'm')} wide and reach from ({low}) to ({high})"
            )
        patched |= caught
    corner = np.where(mesh.cells < 0, mesh.cells[:, :1], mesh.cells)
    patched = _closed(patched, corner)
    node = np.zeros(len(mesh.points), bool)
    node[corner[patched]] = True
    overlap = node[corner].any(axis=1) & ~patched
    if (patched | overlap).all():
        raise SceneError(
            f"{where} leaves no elements of solid '{solid.name}' beyond the overlap; leave the patch out and set its formulation to "
            "'particles'"
        )
    both = np.flatnonzero(patched | overlap)
    if (mesh.corners[both] < 8).any():
        bad = mesh.centres[both[mesh.corners[both] < 8][0]]
        raise SceneError(
            f"{where}: the element at ({', '.join(show(x, 'm') for x in bad)}) is a tetrahedron, and only hexahedra can be divided; mesh "
            "the patch and one element around it with hexahedra, or move it"
        )
    _apart(mesh, patched, overlap, where)
    size = float(np.cbrt(mesh.volumes[both].mean()))
    n = round(size / patch.spacing)
    if not FEWEST <= n <= MOST:
        limit = f"may be at most {MOST} times" if n > MOST else "must be at least"
        change = "refine the mesh there, or raise the patch's spacing" if n > MOST else "lower the patch's spacing"
        raise SceneError(
            f"{where}.spacing {show(patch.spacing, 'm')}: the elements there are {show(size, 'm')} wide, and {limit} as wide; {change}"
        )
    if (count := len(both) * n**3) > MAX_NODES:
        raise SceneError(
            f"{where}.spacing {show(patch.spacing, 'm')} gives solid '{solid.name}' {count:.2g} particles; at most {MAX_NODES / 1e6:g} "
            "million are allowed"
        )
    return Split(mesh, n, patched, overlap, subdivided(mesh, both, n))


def _closed(patched: np.ndarray, corner: np.ndarray) -> np.ndarray:
    """(M,) bool: with elements between those of the patch."""
    while True:
        node = np.zeros(corner.max() + 1, bool)
        node[corner[patched]] = True
        grown = patched | node[corner].all(axis=1)
        if (grown == patched).all():
            return patched
        patched = grown


def _apart(mesh: SolidMesh, patched: np.ndarray, overlap: np.ndarray, where: str) -> None:
    """SceneError where the overlaps of two patches share a node: an element there would be weighed twice."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    n, cells = len(mesh.points), mesh.cells[patched]
    ends = np.repeat(cells[:, :1], 8, axis=1)
    _, label = connected_components(coo_array((np.ones(cells.size), (ends.ravel(), cells.ravel())), shape=(n, n)), directed=False)
    own = np.full(n, -1)
    own[cells] = label[cells]
    around = mesh.cells[overlap]
    first, last = np.where(own[around] < 0, n, own[around]).min(axis=1), own[around].max(axis=1)
    low, high = np.full(n, n), np.full(n, -1)
    np.minimum.at(low, around.ravel(), np.repeat(first, 8))
    np.maximum.at(high, around.ravel(), np.repeat(last, 8))
    bad = np.flatnonzero((high >= 0) & (low != high))
    if len(bad):
        at = ", ".join(show(x, "m") for x in mesh.points[bad[0]])
        raise SceneError(
            f"{where}.where: the overlaps of two patches touch at ({at}); keep at least three elements between patches, or let them be one"
        )


def _supports(scene: Scene, solid: Solid, split: Split) -> None:
    """SceneError where a prescribed motion holds what is tied, or both parts."""
    tied = split.tied
    fine = split.fine.mesh.points
    for number, motion in enumerate(scene.motions):
        if motion.body != solid.name:
            continue
        held = inside(motion.where, split.whole.points[tied[0]]).sum() + inside(motion.where, fine[tied[1]]).sum()
        where = f"motions[{number}].where"
        if held:
            raise SceneError(
                f"{where} holds {held} nodes of the overlap around a patch of solid '{solid.name}', which are tied; move the patch one "
                "element away from the support, or let it include the support by an element or more"
            )
        if inside(motion.where, split.elements.points).any() and inside(motion.where, fine).any():
            raise SceneError(f"{where} holds elements and particles of solid '{solid.name}'; say it twice, with a region for each")
