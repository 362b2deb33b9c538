"""What is said of a patch, tried on the mesh of a shell or of a solid: sentences that are the same for both. NumPy only."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import SceneError
from ..geometry.parted import Parted, touching
from ..geometry.regions import inside
from ..scene import Scene
from ..scene.regions import Region
from ..scene.units import show


def at(point: np.ndarray) -> str:
    """A place in words, '0.1 m, 20 mm, 0 m'."""
    return ", ".join(show(x, "m") for x in point)


def caught(regions: Sequence[Region], centres: np.ndarray, spacing: float, body: str, where: str) -> np.ndarray:
    """(M,) bool: elements whose middle is in a region of a patch; SceneError where one holds none. where: the key of the patch."""
    found = np.zeros(len(centres), bool)
    for number, region in enumerate(regions):
        own = inside(region, centres)
        if not own.any():
            raise SceneError(
                f"{where}.where[{number}] lies off the mesh: it holds the middle of no element of {body}, which are "
                f"{show(spacing, 'm')} wide and reach from ({at(centres.min(axis=0))}) to ({at(centres.max(axis=0))})"
            )
        found |= own
    return found


def apart(points: np.ndarray, corner: np.ndarray, patched: np.ndarray, overlap: np.ndarray, where: str) -> None:
    """SceneError where the overlaps of two patches share a node: an element there would be weighed twice."""
    bad = touching(len(points), corner, patched, overlap)
    if len(bad):
        raise SceneError(
            f"{where}.where: the overlaps of two patches touch at ({at(points[bad[0]])}); keep at least three elements between patches, or "
            "let them be one"
        )


def along(size: float, spacing: float, fewest: int, most: int, where: str) -> int:
    """How many particles stand along the edge of elements that are `size` [m] wide; SceneError where they are fewer or more than may be."""
    n = round(size / spacing)
    if not fewest <= n <= most:
        limit = f"may be at most {most} times" if n > most else f"must be at least{f' {fewest} times' if fewest > 1 else ''}"
        change = "refine the mesh there, or raise the patch's spacing" if n > most else "lower the patch's spacing"
        raise SceneError(
            f"{where}.spacing {show(spacing, 'm')}: the elements there are {show(size, 'm')} wide, and {limit} as wide; {change}"
        )
    return n


def held(scene: Scene, name: str, body: str, split: Parted, tied: tuple[np.ndarray, np.ndarray]) -> None:
    """SceneError where a prescribed motion holds what is tied, or both parts. tied: the nodes of the overlap, of the whole mesh and of
    particles."""
    fine = split.fine.mesh.points
    for number, motion in enumerate(scene.motions):
        if motion.body != name:
            continue
        count = inside(motion.where, split.whole.points[tied[0]]).sum() + inside(motion.where, fine[tied[1]]).sum()
        where = f"motions[{number}].where"
        if count:
            raise SceneError(
                f"{where} holds {count} nodes of the overlap around a patch of {body}, which are tied; move the patch one "
                "element away from the support, or let it include the support by an element or more"
            )
        if inside(motion.where, split.whole.points[split.nodes]).any() and inside(motion.where, fine).any():
            raise SceneError(f"{where} holds elements and particles of {body}; say it twice, with a region for each")
