"""A solid in two parts that overlap: which cells are elements, which are particles, what each counts. NumPy only.

What is patched and overlaps are hexahedra (geometry/parted.py), divided n x n x n.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..parted import Parted
from .mesh import CORNERS, SolidMesh
from .subdivide import Subdivided

SHARE = 0.5  # of each part in the overlap
SIDES = {(axis, side): np.flatnonzero(CORNERS[:, axis] == side) for axis in range(3) for side in (0, 1)}


@dataclass(frozen=True, eq=False)
class Split(Parted):
    """In the overlap each part counts one half."""

    whole: SolidMesh
    fine: Subdivided

    @cached_property
    def elements(self) -> SolidMesh:
        """The elements alone."""
        return SolidMesh(self.whole.points[self.nodes], self.numbered)

    @cached_property
    def of_elements(self) -> np.ndarray:
        """(elements,) 1 - alpha."""
        return np.where(self.overlap[self.cells], 1.0 - SHARE, 1.0)

    @cached_property
    def of_particles(self) -> np.ndarray:
        """(cells of particles,) alpha."""
        return np.where(self.overlap[self.fine.parent], SHARE, 1.0)

    @cached_property
    def tied(self) -> tuple[np.ndarray, np.ndarray]:
        """Numbers of the nodes of the overlap: of the whole mesh, and of particles."""
        return np.unique(self.whole.cells[self.overlap]), np.unique(self.fine.mesh.cells[self.of_particles < 1.0])

    @cached_property
    def skin_of_elements(self) -> np.ndarray:
        """Numbers of the faces of the elements on the surface of the whole body."""
        skin = self.elements.skin
        nodes = self.elements.faces.nodes[skin]
        return skin[_among(np.where(nodes < 0, -1, self.nodes[nodes]), self.whole.faces.nodes[self.whole.skin])]

    @cached_property
    def skin_of_particles(self) -> np.ndarray:
        """Numbers of the faces of the particles on the surface of the whole body."""
        mesh = self.fine.mesh
        skin = mesh.skin
        cell = mesh.faces.cells[skin, 0]
        at = self.coordinates(skin, cell)
        flat = (at == at[:, :1]).all(axis=1)
        axis = flat.argmax(axis=1)
        side = at[np.arange(len(skin)), 0, axis]
        nodes = np.empty((len(skin), 4), int)
        for (a, s), corners in SIDES.items():
            own = (axis == a) & (side == s)
            nodes[own] = self.whole.cells[self.fine.parent[cell[own]]][:, corners]
        return skin[_among(nodes, self.whole.faces.nodes[self.whole.skin])]

    def coordinates(self, faces: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """(F, 4, 3) where the nodes of faces of particles stand in the hexahedron that one cell of each face, cells (F,), is a part of: 0
        to 1 along each of its axes."""
        mesh = self.fine.mesh
        corner = (mesh.cells[cells][:, None, :] == mesh.faces.nodes[faces][:, :, None]).argmax(axis=2)
        return (self.fine.place[cells][:, None] + CORNERS[corner]) / self.n

    @cached_property
    def jumps(self) -> np.ndarray:
        """(faces of particles,) alpha beyond a face less alpha in its first cell: alpha is 0 beyond the particles, and does not jump on the
        surface of the body."""
        faces, alpha = self.fine.mesh.faces, self.of_particles
        found = np.where(faces.cells[:, 1] < 0, 0.0, alpha[faces.cells[:, 1]]) - alpha[faces.cells[:, 0]]
        found[self.skin_of_particles] = 0.0
        return found

    @cached_property
    def volumes_of_elements(self) -> np.ndarray:
        """(nodes of the elements,) even shares of (1 - alpha) V [m3]."""
        return self.elements.shared(self.of_elements * self.elements.volumes)

    @cached_property
    def volumes_of_particles(self) -> np.ndarray:
        """(particles,) even shares of alpha V [m3]."""
        return self.fine.mesh.shared(self.of_particles * self.fine.mesh.volumes)

    @cached_property
    def areas_of_elements(self) -> np.ndarray:
        """(nodes of the elements,) even shares of (1 - alpha) A of the surface of the body [m2]."""
        return _areas(self.elements, self.skin_of_elements, self.of_elements)

    @cached_property
    def areas_of_particles(self) -> np.ndarray:
        """(particles,) even shares of alpha A of the surface of the body [m2]."""
        return _areas(self.fine.mesh, self.skin_of_particles, self.of_particles)


def _areas(mesh: SolidMesh, skin: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """(N,) even shares of the areas of faces, times what the cell behind each counts [m2]."""
    nodes = mesh.faces.nodes[skin]
    area = np.linalg.norm(mesh.face_areas()[skin], axis=1) * counts[mesh.faces.cells[skin, 0]]
    share = np.repeat(area / (nodes >= 0).sum(axis=1), 4)[(nodes >= 0).ravel()]
    return np.bincount(nodes[nodes >= 0], share, minlength=len(mesh.points))


def _among(rows: np.ndarray, others: np.ndarray) -> np.ndarray:
    """(K,) bool: whether the numbers of a row (K, 4) are those of one of the others, in any order."""
    both = np.sort(np.concatenate([rows, others]), axis=1)
    _, number = np.unique(both, axis=0, return_inverse=True)
    number = number.ravel()
    return np.isin(number[: len(rows)], number[len(rows) :])
