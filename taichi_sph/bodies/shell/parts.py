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
from ...geometry.parted import Parted, around, closed, corners_of, touching
from ...geometry.regions import inside
from ...geometry.subdivide import Subdivided, subdivided
from ...geometry.surfaces import mesh_key, mesh_of
from ...scene import Scene
from ...scene.regions import Region
from .. import parted
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
class Split(Parted):
    """A mesh and a patch in it, where rotary inertia, bounded shear and necks of both parts go by the spacing of the particles. held, said
    (M,) bool of the cells: those that supports hold (of a patch that grows), those in the regions, which are patched with those that have
    grown; alpha (N,) of the nodes, 0 or 1."""

    whole: SurfaceMesh
    fine: Subdivided
    patch: Patch
    held: np.ndarray
    said: np.ndarray
    alpha: np.ndarray

    @cached_property
    def elements(self) -> SurfaceMesh:
        """The elements alone."""
        return SurfaceMesh(self.whole.points[self.nodes], self.numbered, self.whole.spacing, self.whole.node_normals[self.nodes])

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
        return np.asarray(node[corners_of(self.whole.cells)].any(axis=1))

    def wider(self, near: np.ndarray) -> tuple[int, ...]:
        """Numbers of elements that are particles beside those of the regions once the patch holds `near` (M,) bool and two elements around
        them, of those that can. Patches whose overlaps would touch become one. Some elements must stay. Where that would take all of them,
        those at the borders stay that are none yet, or fewer around `near` go with it; all are left to go where neither helps."""
        corner = corners_of(self.whole.cells)
        rings = [near]
        for _ in range(AHEAD):
            rings.append(around(corner, rings[-1]))
        patched = self._merged(rings[-1] & self.able)
        if patched.all():
            within = [self._merged(self.able & ~self.rim), *(self._merged(wide & self.able) for wide in rings[-2::-1])]
            patched = next((few for few in within if not few.all() and few.any()), patched)
        return tuple(np.flatnonzero(patched & ~self.said).tolist())

    def counted(self, more: np.ndarray) -> tuple[int, int]:
        """Numbers of nodes of the elements and of particles once the patch holds the cells `more` (M,) and those around them as well, if
        they can (`wider`)."""
        patched = self.said.copy()
        patched[list(self.wider(more))] = True
        both = around(corners_of(self.whole.cells), patched)
        edges = np.unique(self.whole.edges.cell_edges[both])
        corners, rest = np.unique(self.whole.cells[both]), np.unique(self.whole.cells[~patched])
        particles = (corners >= 0).sum() + (self.n - 1) * (edges >= 0).sum() + (self.n - 1) ** 2 * both.sum()
        return int((rest >= 0).sum()), int(particles)

    def _merged(self, more: np.ndarray) -> np.ndarray:
        """(M,) bool: the patch with `more` (M,), and with what lies between overlaps that would touch."""
        corner, patched = corners_of(self.whole.cells), self.patched | more
        while True:
            patched = closed(patched, corner)
            overlap = around(corner, patched) & ~patched
            node = np.zeros(len(self.whole.points), bool)
            node[touching(len(self.whole.points), corner, patched, overlap)] = True
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
    if split.patched.any():
        tied = np.unique(split.whole.cells[split.overlap]), np.flatnonzero(split.fine.tied)
        parted.held(scene, shell.name, f"shell '{shell.name}'", split, tied)
    return split


def _split(shell: Shell, scene: Scene, regions: Sequence[Region | None]) -> Split:
    """regions: where supports hold the shell."""
    mesh, patch, where = mesh_of(shell, scene), shell.patch, f"{scene.key_of(shell)}.patch"
    assert patch is not None
    patched = parted.caught(patch.where, mesh.centres, mesh.spacing, f"shell '{shell.name}'", where)
    corner = corners_of(mesh.cells)
    held = np.zeros(len(mesh.points), bool)
    for support in regions:
        held |= inside(support, mesh.points) if support is not None else True
    said = patched = closed(patched, corner)
    if patch.cells:
        if max(patch.cells) >= len(mesh.cells):
            raise SceneError(f"{where}.cells: shell '{shell.name}' has {len(mesh.cells)} elements, and {max(patch.cells)} is none of them")
        patched = patched.copy()
        patched[list(patch.cells)] = True
        patched = closed(patched, corner)
    if patched.all() and patch.cells:
        raise SceneError(
            f"{where}: all elements of shell '{shell.name}' would become particles, and none would be left; set its formulation "
            "to 'galerkin' and leave the patch out, or make the elements finer"
        )
    if patched.all():
        raise SceneError(f"{where} takes all elements of shell '{shell.name}'; leave the patch out and set its formulation to 'galerkin'")
    overlap = around(corner, patched) & ~patched
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
            f"{where}: the element at ({parted.at(bad)}) is a triangle, and only quadrangles can be divided; "
            "mesh the patch and one element around it with quadrangles, or move it"
        )
    parted.apart(mesh.points, corner, patched, overlap, where)
    # of a patch that grows: where it begins, for n must stay
    begins = around(corner, said) if patch.where else able
    size = float(np.sqrt(mesh.areas[begins if patch.grows else both].mean()))
    n = parted.along(size, patch.apart(size), FEWEST, MOST, where)
    lean = _leans(mesh)[both]
    if lean.min(initial=1.0) < SHARPEST:
        bad = mesh.centres[both[lean.argmin()]]
        raise SceneError(
            f"{where}: at ({parted.at(bad)}) the surface turns by more than 25 degrees over half an element, and no "
            "particles can follow it; refine the mesh there, or keep the patch two elements away from the edge"
        )
    alpha = np.zeros(len(mesh.points))
    alpha[corner[patched]] = 1.0
    fine = subdivided(mesh, both, n, ~said[both])  # what has grown stays where its elements were
    return Split(mesh, n, patched, overlap, _moved(fine, patch), patch, held[corner].any(axis=1), said, alpha)


def _able(mesh: SurfaceMesh, held: np.ndarray) -> np.ndarray:
    """(M,) bool: elements beside none that cannot be divided or that is `held` (M,)."""
    return ~around(corners_of(mesh.cells), (mesh.cells[:, 3] < 0) | (_leans(mesh) < SHARPEST) | held)


def _leans(mesh: SurfaceMesh) -> np.ndarray:
    """(M,) the least cosine between the middle of a cell and its corners."""
    return np.abs(np.einsum("mi,mki->mk", mesh.frames[:, 2], mesh.node_normals[corners_of(mesh.cells)])).min(axis=1)


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
