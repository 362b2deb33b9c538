"""Which part of a shell is computed in which form. A shell of elements with a patch is two bodies: its elements, and its particles.

    patch       elements whose middle is in a region of the patch: particles alone
    overlap     elements around them, one wide: elements and particles, whose energies and masses are weighed, 1 - alpha and alpha
    the rest    elements alone

Particles of patch and overlap are the nodes of their elements, divided n x n. In the overlap they stay on the elements, so that both bodies
have the same linear fields. alpha is 0 on the border of the particles, 1 on that of the elements, and in between as the patch says
("half": 1/2 everywhere between). Each point of stress has its alpha: each of
the four points of an element, or its only one; a cell of particles has the mean over the cell. NumPy only.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from weakref import WeakValueDictionary

import numpy as np

from ...errors import SceneError
from ...geometry.mesh import SurfaceMesh, tangent_frames
from ...geometry.regions import inside
from ...geometry.subdivide import Subdivided, subdivided
from ...geometry.surfaces import mesh_key, mesh_of
from ...scene import Scene
from ...scene.regions import Region
from ...scene.units import show
from .said import PARTICLES, Patch, Shell

FEWEST, MOST = 2, 20  # particles along the side of an element
AHEAD = 2  # elements around those near rupture that become particles with them
SHARPEST = np.cos(np.radians(25.0))  # between the middle of an element of a patch and its corners
GAUSS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) / np.sqrt(3.0)
CORNER = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


@dataclass(frozen=True)
class Part:
    """said: the shell in its own form; whole: what the scene says, the same where it has no patch."""

    said: Shell
    whole: Shell


def parts(scene: Scene) -> Iterator[Part]:
    """The parts of the shells of a scene, in its order. The elements of a shell keep its name. They carry damage and never break. A patch
    that has not begun yet has no particles."""
    for shell in scene.shells:
        if (patch := shell.patch) is None:
            yield Part(shell, shell)
            continue
        yield Part(shell.model_copy(update={"material": shell.material.model_copy(update={"critical_damage": None})}), shell)
        if not patch.there:
            continue
        yield Part(particles_of(shell, scene), shell)


def particles_of(shell: Shell, scene: Scene) -> Shell:
    """What the particles of a shell with a patch are, or will be."""
    assert (patch := shell.patch) is not None
    spacing = patch.apart(scene.numerics_of(shell).spacing)
    own = {"name": shell.name + PARTICLES, "formulation": patch.formulation, "spacing": spacing, "patch": None}
    return shell.model_copy(update=own)


def meshed(one: Part, scene: Scene) -> tuple[Split | None, SurfaceMesh]:
    """The parts of its shell, None where that is whole, and its mesh; SceneError where the patch does not fit."""
    if one.whole.patch is None:
        return None, mesh_of(one.said, scene)
    split = split_of(one.whole, scene)
    return split, split.elements if one.said.name == one.whole.name else split.fine.mesh


@dataclass(frozen=True, eq=False)
class Split:
    """A mesh and a patch in it: n particles along the side of an element; held, said, patched, overlap (M,) bool of the cells: those that
    supports hold (of a patch that grows), those in the regions, with those that have grown, and around them; alpha (N,) of the nodes, 0 or
    1."""

    whole: SurfaceMesh
    patch: Patch
    n: int
    held: np.ndarray
    said: np.ndarray
    patched: np.ndarray
    overlap: np.ndarray
    alpha: np.ndarray
    fine: Subdivided

    @property
    def spacing(self) -> float:
        """D of the particles [m]: rotary inertia, bounded shear and necks of both parts go by it."""
        return self.fine.mesh.spacing

    @cached_property
    def cells(self) -> np.ndarray:
        """Numbers of the elements in the whole mesh."""
        return np.flatnonzero(~self.patched)

    @cached_property
    def nodes(self) -> np.ndarray:
        """Numbers of their nodes in the whole mesh."""
        node = np.unique(self.whole.cells[self.cells])
        return node[node >= 0]

    @cached_property
    def number(self) -> np.ndarray:
        """(N,) number of a node of the whole mesh among those of the elements, -1: it is not there."""
        found = np.full(len(self.whole.points), -1)
        found[self.nodes] = np.arange(len(self.nodes))
        return found

    @cached_property
    def elements(self) -> SurfaceMesh:
        """The elements alone."""
        cells = self.whole.cells[self.cells]
        cells = np.where(cells < 0, -1, self.number[cells]).astype(np.int32)
        return SurfaceMesh(self.whole.points[self.nodes], cells, self.whole.spacing, self.whole.node_normals[self.nodes])

    @cached_property
    def most(self) -> Subdivided:
        """All that can become particles: what frames show of a patch that grows, at any time."""
        quads = np.flatnonzero(self.whole.cells[:, 3] >= 0)
        return subdivided(self.whole, quads, self.n, ~self.said[quads])

    @cached_property
    def able(self) -> np.ndarray:
        """(M,) bool: elements that can become particles, for they and all around them can be divided, and no support holds them."""
        return _able(self.whole, self.held)

    @cached_property
    def rim(self) -> np.ndarray:
        """(M,) bool: elements with a node on a border of the mesh."""
        node = np.zeros(len(self.whole.points), bool)
        node[self.whole.edges.nodes[(self.whole.edges.sides < 0).any(axis=1)]] = True
        return np.asarray(node[_corners(self.whole)].any(axis=1))

    def wider(self, near: np.ndarray) -> tuple[int, ...]:
        """Numbers of elements that are particles beside those of the regions once the patch holds `near` (M,) bool and two elements around
        them, of those that can. Patches whose overlaps would touch become one. Some elements must stay. Where that would take all of them,
        those at the borders stay that are none yet, or fewer around `near` go with it; all are left to go where neither helps."""
        corner = _corners(self.whole)
        around = [near]
        for _ in range(AHEAD):
            around.append(_around(corner, around[-1]))
        patched = self._merged(around[-1] & self.able)
        if patched.all():
            within = [self._merged(self.able & ~self.rim), *(self._merged(wide & self.able) for wide in around[-2::-1])]
            patched = next((few for few in within if not few.all() and few.any()), patched)
        return tuple(np.flatnonzero(patched & ~self.said).tolist())

    def counted(self, more: np.ndarray) -> tuple[int, int]:
        """Numbers of nodes of the elements and of particles once the patch holds the cells `more` (M,) and those around them as well, if
        they can (`wider`)."""
        patched = self.said.copy()
        patched[list(self.wider(more))] = True
        both = _around(_corners(self.whole), patched)
        edges = np.unique(self.whole.edges.cell_edges[both])
        corners, rest = np.unique(self.whole.cells[both]), np.unique(self.whole.cells[~patched])
        particles = (corners >= 0).sum() + (self.n - 1) * (edges >= 0).sum() + (self.n - 1) ** 2 * both.sum()
        return int((rest >= 0).sum()), int(particles)

    def _merged(self, more: np.ndarray) -> np.ndarray:
        """(M,) bool: the patch with `more` (M,), and with what lies between overlaps that would touch."""
        corner, patched = _corners(self.whole), self.patched | more
        while True:
            patched = _closed(patched, corner)
            overlap = _around(corner, patched) & ~patched
            node = np.zeros(len(self.whole.points), bool)
            node[_touching(self.whole, corner, patched, overlap)] = True
            between = overlap & self.able & node[corner].any(axis=1)
            if not between.any():
                return patched
            patched = patched | between

    def weight(self, cells: np.ndarray, r: np.ndarray, s: np.ndarray) -> np.ndarray:
        """alpha at the places (r, s), -1 to 1, of cells of the whole mesh."""
        corner = self.alpha[np.where(self.whole.cells[cells] < 0, 0, self.whole.cells[cells])]
        a = np.einsum("kc,kc->k", shapes(r, s), corner)
        within = {"half": 0.5 + 0.0 * a, "linear": a, "cubic": a**2 * (3.0 - 2.0 * a)}[self.patch.weight]
        return np.where(self.patched[cells], 1.0, np.where(self.overlap[cells], within, 0.0))

    @cached_property
    def of_particles(self) -> np.ndarray:
        """(cells of particles,) alpha: its mean over the cell, by the rule of two points along each side."""
        total = np.zeros(len(self.fine.parent))
        for at in GAUSS:
            r, s = (2.0 * (self.fine.place + 0.5 + 0.5 * at) / self.n - 1.0).T
            total += 0.25 * self.weight(self.fine.parent, r, s)
        return total

    def of_elements(self, points: int) -> np.ndarray:
        """(elements, points) 1 - alpha at their points of stress."""
        at = GAUSS if points == 4 else np.zeros((1, 2))
        one = np.ones(len(self.cells))
        return 1.0 - np.column_stack([self.weight(self.cells, r * one, s * one) for r, s in at])

    @cached_property
    def areas_of_elements(self) -> np.ndarray:
        """(nodes of the elements,) int (1 - alpha) N_k [m2]; outside the overlap what a node of the mesh owns."""
        both = self.overlap[self.cells]
        total = replace(self.elements, cells=self.elements.cells[~both]).node_areas
        quads = self.elements.cells[both]
        X = self.elements.points[quads]
        for r, s in GAUSS:
            along = np.einsum("pk,mki->mpi", slopes(r, s), X)
            area = np.linalg.norm(np.cross(along[:, 0], along[:, 1]), axis=1)
            one = np.ones(len(quads))
            share = ((1.0 - self.weight(self.cells[both], r * one, s * one)) * area)[:, None] * shapes(r * one, s * one)
            total = total + np.bincount(quads.ravel(), share.ravel(), minlength=len(total))
        return total

    @cached_property
    def areas_of_particles(self) -> np.ndarray:
        """(particles,) sum of alpha A / 4 of the cells around [m2]."""
        mesh = self.fine.mesh
        return np.bincount(mesh.cells.ravel(), np.repeat(0.25 * self.of_particles * mesh.areas, 4), minlength=len(mesh.points))

    def area_in(self, region: Region | None) -> float:
        """What all nodes of both parts in a region own together [m2]."""
        both = ((self.elements.points, self.areas_of_elements), (self.fine.mesh.points, self.areas_of_particles))
        return float(sum((areas if region is None else areas[inside(region, points)]).sum() for points, areas in both))


def shapes(r: np.ndarray, s: np.ndarray) -> np.ndarray:
    """(K, 4) N_k of a quadrangle."""
    return 0.25 * np.stack([(1 - r) * (1 - s), (1 + r) * (1 - s), (1 + r) * (1 + s), (1 - r) * (1 + s)], axis=1)


def slopes(r: float, s: float) -> np.ndarray:
    """(2, 4) dN_k/dr, dN_k/ds."""
    return 0.25 * np.stack([CORNER[:, 0] * (1.0 + CORNER[:, 1] * s), CORNER[:, 1] * (1.0 + CORNER[:, 0] * r)])


_SPLITS: WeakValueDictionary[Hashable, Split] = WeakValueDictionary()


def split_of(shell: Shell, scene: Scene) -> Split:
    """Of a shell with a patch, made once as long as somebody holds it; SceneError where the patch does not fit the mesh or a support."""
    regions = [motion.where for motion in scene.motions if motion.body == shell.name] if shell.patch and shell.patch.grows else []
    key = shell.name, mesh_key(shell, scene), shell.model_dump_json(include={"patch"}), repr(regions)
    split = _SPLITS.get(key)
    if split is None:
        split = _SPLITS[key] = _split(shell, scene, regions)
    _supports(scene, shell, split)
    return split


def _split(shell: Shell, scene: Scene, regions: Sequence[Region | None]) -> Split:
    """regions: where supports hold the shell."""
    mesh, patch, where = mesh_of(shell, scene), shell.patch, f"{scene.key_of(shell)}.patch"
    assert patch is not None
    patched = np.zeros(len(mesh.cells), bool)
    for number, region in enumerate(patch.where):
        caught = inside(region, mesh.centres)
        if not caught.any():
            low, high = (", ".join(show(x, "m") for x in f(mesh.centres, axis=0)) for f in (np.min, np.max))
            raise SceneError(
                f"{where}.where[{number}] lies off the mesh: it holds the middle of no element of shell '{shell.name}', which are "
                f"{show(mesh.spacing, 'm')} wide and reach from ({low}) to ({high})"
            )
        patched |= caught
    corner = _corners(mesh)
    held = np.zeros(len(mesh.points), bool)
    for support in regions:
        held |= inside(support, mesh.points) if support is not None else True
    said = patched = _closed(patched, corner)
    if patch.cells:
        if max(patch.cells) >= len(mesh.cells):
            raise SceneError(f"{where}.cells: shell '{shell.name}' has {len(mesh.cells)} elements, and {max(patch.cells)} is none of them")
        patched = patched.copy()
        patched[list(patch.cells)] = True
        patched = _closed(patched, corner)
    if patched.all() and patch.cells:
        raise SceneError(
            f"{where}: all elements of shell '{shell.name}' would become particles, and none would be left; set its formulation "
            "to 'galerkin' and leave the patch out, or make the elements finer"
        )
    if patched.all():
        raise SceneError(f"{where} takes all elements of shell '{shell.name}'; leave the patch out and set its formulation to 'galerkin'")
    overlap = _around(corner, patched) & ~patched
    both = np.flatnonzero(patched | overlap)
    able = _able(mesh, held[corner].any(axis=1)) if patch.grows else patched
    if not patch.where and not able.any():
        raise SceneError(
            f"{where} = 'auto': no element of shell '{shell.name}' can become particles: beside each there is a triangle, an edge where "
            "the surface turns by more than 25 degrees over half an element, or a support; refine the mesh, or leave the patch out"
        )
    if (mesh.cells[both, 3] < 0).any():
        bad = mesh.centres[both[mesh.cells[both, 3] < 0][0]]
        raise SceneError(
            f"{where}: the element at ({', '.join(show(x, 'm') for x in bad)}) is a triangle, and only quadrangles can be divided; "
            "mesh the patch and one element around it with quadrangles, or move it"
        )
    _apart(mesh, corner, patched, overlap, where)
    # of a patch that grows: where it begins, for n must stay
    begins = _around(corner, said) if patch.where else able
    size = float(np.sqrt(mesh.areas[begins if patch.grows else both].mean()))
    apart = patch.apart(size)
    n = round(size / apart)
    if not FEWEST <= n <= MOST:
        limit = f"may be at most {MOST} times" if n > MOST else f"must be at least {FEWEST} times"
        change = "refine the mesh there, or raise the patch's spacing" if n > MOST else "lower the patch's spacing"
        raise SceneError(
            f"{where}.spacing {show(apart, 'm')}: the elements there are {show(size, 'm')} wide, and {limit} as wide; {change}"
        )
    lean = _leans(mesh)[both]
    if lean.min(initial=1.0) < SHARPEST:
        bad = mesh.centres[both[lean.argmin()]]
        raise SceneError(
            f"{where}: at ({', '.join(show(x, 'm') for x in bad)}) the surface turns by more than 25 degrees over half an element, and no "
            "particles can follow it; refine the mesh there, or keep the patch two elements away from the edge"
        )
    alpha = np.zeros(len(mesh.points))
    alpha[corner[patched]] = 1.0
    fine = subdivided(mesh, both, n, ~said[both])  # what has grown stays where its elements were
    return Split(mesh, patch, n, held[corner].any(axis=1), said, patched, overlap, alpha, _moved(fine, patch))


def _corners(mesh: SurfaceMesh) -> np.ndarray:
    """(M, 4) nodes of the cells; a triangle has its first one twice."""
    return np.where(mesh.cells < 0, mesh.cells[:, :1], mesh.cells)


def _around(corner: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """(M,) bool: the cells that are chosen, and all that share a node with them."""
    node = np.zeros(corner.max() + 1, bool)
    node[corner[chosen]] = True
    return np.asarray(node[corner].any(axis=1))


def _able(mesh: SurfaceMesh, held: np.ndarray) -> np.ndarray:
    """(M,) bool: elements beside none that cannot be divided or that is `held` (M,)."""
    return ~_around(_corners(mesh), (mesh.cells[:, 3] < 0) | (_leans(mesh) < SHARPEST) | held)


def _leans(mesh: SurfaceMesh) -> np.ndarray:
    """(M,) the least cosine between the middle of a cell and its corners."""
    return np.abs(np.einsum("mi,mki->mk", mesh.frames[:, 2], mesh.node_normals[_corners(mesh)])).min(axis=1)


def _closed(patched: np.ndarray, corner: np.ndarray) -> np.ndarray:
    """(M,) bool: with elements between two of them."""
    while True:
        node = np.zeros(corner.max() + 1, bool)
        node[corner[patched]] = True
        grown = patched | node[corner].all(axis=1)
        if (grown == patched).all():
            return patched
        patched = grown


def _moved(fine: Subdivided, patch: Patch) -> Subdivided:
    """Particles off the overlap and off true edges, moved at random along the surface."""
    if patch.irregularity == 0.0:
        return fine
    mesh = fine.mesh
    fixed = fine.tied.copy()
    fixed[np.unique(mesh.edges.nodes[(mesh.edges.sides < 0).any(axis=1)])] = True
    step = np.random.default_rng(0).uniform(-1.0, 1.0, (len(mesh.points), 2)) * (patch.irregularity * mesh.spacing)
    move = np.einsum("na,nai->ni", step, tangent_frames(mesh.node_normals)[:, :2])
    return replace(fine, mesh=replace(mesh, points=mesh.points + np.where(fixed[:, None], 0.0, move)))


def _apart(mesh: SurfaceMesh, corner: np.ndarray, patched: np.ndarray, overlap: np.ndarray, where: str) -> None:
    """SceneError where the overlaps of two patches share a node: an element there would be weighed twice."""
    bad = _touching(mesh, corner, patched, overlap)
    if len(bad):
        at = ", ".join(show(x, "m") for x in mesh.points[bad[0]])
        raise SceneError(
            f"{where}.where: the overlaps of two patches touch at ({at}); keep at least three elements between patches, or let them be one"
        )


def _touching(mesh: SurfaceMesh, corner: np.ndarray, patched: np.ndarray, overlap: np.ndarray) -> np.ndarray:
    """Numbers of nodes that the overlaps of two patches share."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    n = len(mesh.points)
    cells = corner[patched]
    ends = np.repeat(cells[:, :1], 4, axis=1)
    _, label = connected_components(coo_array((np.ones(cells.size), (ends.ravel(), cells.ravel())), shape=(n, n)), directed=False)
    own = np.full(n, -1)
    own[cells] = label[cells]
    around = corner[overlap]
    first, last = np.where(own[around] < 0, n, own[around]).min(axis=1), own[around].max(axis=1)
    low, high = np.full(n, n), np.full(n, -1)
    np.minimum.at(low, around.ravel(), np.repeat(first, 4))
    np.maximum.at(high, around.ravel(), np.repeat(last, 4))
    return np.flatnonzero((high >= 0) & (low != high))


def _supports(scene: Scene, shell: Shell, split: Split) -> None:
    """SceneError where a prescribed motion holds what is tied, or both parts."""
    if not split.patched.any():
        return
    for number, motion in enumerate(scene.motions):
        if motion.body != shell.name:
            continue
        tied = np.unique(split.whole.cells[split.overlap])
        fine = split.fine.mesh.points
        held = inside(motion.where, split.whole.points[tied]).sum() + inside(motion.where, fine[split.fine.tied]).sum()
        where = f"motions[{number}].where"
        if held:
            raise SceneError(
                f"{where} holds {held} nodes of the overlap around a patch of shell '{shell.name}', which are tied; move the patch one "
                "element away from the support, or let it include the support by an element or more"
            )
        if inside(motion.where, split.elements.points).any() and inside(motion.where, fine).any():
            raise SceneError(f"{where} holds elements and particles of shell '{shell.name}'; say it twice, with a region for each")
