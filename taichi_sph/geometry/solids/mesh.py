"""A solid as nodes and cells, and what follows from it: volumes, faces, mean gradients of the trilinear functions. NumPy only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

# corners of each face in VTK's order of a hexahedron and a tetrahedron, counter-clockwise seen from outside
HEXAHEDRON = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
TETRAHEDRON = ((0, 2, 1, -1), (0, 1, 3, -1), (1, 2, 3, -1), (2, 0, 3, -1))
CORNERS = 0.5 * (1.0 + np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]))
GAUSS = 0.5 + 0.5 / np.sqrt(3.0) * np.array([-1.0, 1.0])


@dataclass(frozen=True)
class Faces:
    """Each face once. nodes (F, 4), -1 behind a triangle, counter-clockwise seen from outside the first cell; cells (F, 2), the second -1
    on the surface."""

    nodes: np.ndarray
    cells: np.ndarray


@dataclass(frozen=True)
class SolidMesh:
    """points (N, 3) [m]; cells (M, 8) int32 in VTK's order, a tetrahedron has -1 in its last four; spacing [m]: the cube root of the mean
    volume of a hexahedron, of a tetrahedron 6 times that; notes: what was mended."""

    points: np.ndarray
    cells: np.ndarray
    notes: tuple[str, ...] = ()

    @cached_property
    def corners(self) -> np.ndarray:
        """(M,) number of corners of each cell, 8 or 4."""
        return np.where(self.cells[:, 4] < 0, 4, 8).astype(np.int32)

    @cached_property
    def _measured(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(M,) volumes, (M, 8, 3) integrals of the gradients of the corners' functions, (M,) least determinant over the mean one."""
        volume = np.zeros(len(self.cells))
        gradient = np.zeros((len(self.cells), 8, 3))
        least = np.full(len(self.cells), np.inf)
        hexa = self.corners == 8
        p = self.points[self.cells[hexa]]
        for at in np.stack(np.meshgrid(GAUSS, GAUSS, GAUSS, indexing="ij"), axis=-1).reshape(-1, 3):  # exact: cubic in each coordinate
            cofactor, slopes = _cofactors(p, at)
            gradient[hexa] += 0.125 * np.einsum("mic,kc->mki", cofactor, slopes)
        volume[hexa] = np.einsum("mki,mki->m", gradient[hexa], p) / 3.0
        for at in CORNERS:
            cofactor, slopes = _cofactors(p, at)
            jacobian = np.einsum("mki,kc->mic", p, slopes)
            least[hexa] = np.minimum(least[hexa], np.einsum("mi,mi->m", jacobian[:, :, 0], cofactor[:, :, 0]))
        tetra = ~hexa
        q = self.points[np.where(self.cells[tetra, :4] < 0, 0, self.cells[tetra, :4])]
        for k, (a, b, c) in enumerate(((1, 2, 3), (2, 0, 3), (0, 1, 3), (1, 0, 2))):
            gradient[tetra, k] = -np.cross(q[:, b] - q[:, a], q[:, c] - q[:, a]) / 6.0
        volume[tetra] = np.einsum("mki,mki->m", gradient[tetra, :4], q) / 3.0
        least[tetra] = volume[tetra]
        with np.errstate(all="ignore"):
            return volume, gradient, least / np.abs(volume)

    @property
    def volumes(self) -> np.ndarray:
        """(M,) [m3], negative where a cell is turned inside out."""
        return self._measured[0]

    @property
    def gradients(self) -> np.ndarray:
        """(M, 8, 3) [m2] integrals over the cell of the gradients of its corners' functions, 0 for corners that are not there."""
        return self._measured[1]

    @property
    def straightness(self) -> np.ndarray:
        """(M,) least Jacobian determinant at a corner over the mean one: 1 of a parallelepiped, not above 0 of a cell that is folded."""
        return self._measured[2]

    @cached_property
    def _real(self) -> np.ndarray:
        """(M, 8) corner numbers, those that are not there replaced by the first."""
        return np.where(self.cells < 0, self.cells[:, :1], self.cells)

    @cached_property
    def centres(self) -> np.ndarray:
        """(M, 3) mean of the corners [m]."""
        p = np.where((self.cells < 0)[:, :, None], 0.0, self.points[self._real])
        return p.sum(axis=1) / self.corners[:, None]

    @cached_property
    def sizes(self) -> np.ndarray:
        """(M,) h [m]: 1/h^2 is the mean of the inverse squares of the three widths of a brick, of other cells that of the brick with the
        same moments of its corners."""
        arm = np.where((self.cells < 0)[:, :, None], 0.0, self.points[self._real] - self.centres[:, None])
        moments = np.einsum("mki,mkj->mij", arm, arm) / self.corners[:, None, None]
        return np.sqrt(12.0 / np.trace(np.linalg.inv(moments), axis1=1, axis2=2))

    @cached_property
    def spacing(self) -> float:
        """[m]"""
        return float(np.mean(self.volumes * np.where(self.corners == 8, 1.0, 6.0)) ** (1 / 3))

    @cached_property
    def node_volumes(self) -> np.ndarray:
        """(N,) even shares of the cells around a node [m3]."""
        return self.shared(self.volumes)

    def shared(self, of_cells: np.ndarray) -> np.ndarray:
        """(N,) even shares of what cells (M,) have."""
        share = np.repeat(of_cells / self.corners, 8)[(self.cells >= 0).ravel()]
        return np.bincount(self.cells[self.cells >= 0], share, minlength=len(self.points))

    @cached_property
    def faces(self) -> Faces:
        """All faces, in the order in which the cells meet them."""
        found, owner = [], []
        for table, which in ((HEXAHEDRON, self.corners == 8), (TETRAHEDRON, self.corners == 4)):
            rows = np.flatnonzero(which)
            for side in table:
                at = np.array(side)
                nodes = np.where(at < 0, -1, self.cells[rows][:, np.maximum(at, 0)])
                found.append(nodes)
                owner.append(rows)
        nodes, cell = np.concatenate(found), np.concatenate(owner)
        order = np.argsort(cell, kind="stable")
        nodes, cell = nodes[order], cell[order]
        key = np.sort(nodes, axis=1)
        _, first, inverse, count = np.unique(key, axis=0, return_index=True, return_inverse=True, return_counts=True)
        inverse = inverse.ravel()
        if count.max() > 2:
            bad = nodes[first[np.argmax(count)]]
            raise ValueError(f"the face of nodes {', '.join(str(n) for n in bad if n >= 0)} belongs to {count.max()} cells; at most 2 do")
        rank = np.empty(len(first), int)
        rank[np.argsort(first, kind="stable")] = np.arange(len(first))
        number = rank[inverse]
        cells = np.full((len(first), 2), -1, np.int32)
        opening = first[inverse] == np.arange(len(inverse))
        cells[number[opening], 0] = cell[opening]
        cells[number[~opening], 1] = cell[~opening]
        of_face = np.empty((len(first), 4), np.int32)
        of_face[number[opening]] = nodes[opening]
        return Faces(of_face, cells)

    def face_areas(self, points: np.ndarray | None = None) -> np.ndarray:
        """(F, 3) area vectors [m2], out of the first cell; points: where the nodes are, by themselves the reference."""
        x = self.points if points is None else points
        n = self.faces.nodes
        p = x[np.where(n < 0, n[:, :1], n)]
        return 0.5 * np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])

    @cached_property
    def skin(self) -> np.ndarray:
        """(S,) numbers of the faces on the surface."""
        return np.flatnonzero(self.faces.cells[:, 1] < 0)

    @cached_property
    def node_areas(self) -> np.ndarray:
        """(N,) even shares of the surface around a node [m2]; 0 inside."""
        nodes = self.faces.nodes[self.skin]
        corners = (nodes >= 0).sum(axis=1)
        share = np.repeat(np.linalg.norm(self.face_areas()[self.skin], axis=1) / corners, 4)[(nodes >= 0).ravel()]
        return np.bincount(nodes[nodes >= 0], share, minlength=len(self.points))


def _cofactors(p: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(M, 3, 3) cofactors of the Jacobian of hexahedra p (M, 8, 3) at a place in [0, 1]^3, (8, 3) slopes of the functions there."""
    one = np.where(CORNERS > 0.5, at, 1.0 - at)
    sign = np.where(CORNERS > 0.5, 1.0, -1.0)
    slopes = np.stack([sign[:, c] * one[:, (c + 1) % 3] * one[:, (c + 2) % 3] for c in range(3)], axis=1)
    j = np.einsum("mki,kc->mic", p, slopes)
    return np.stack([np.cross(j[:, :, (c + 1) % 3], j[:, :, (c + 2) % 3]) for c in range(3)], axis=2), slopes


def shapes(at: np.ndarray) -> np.ndarray:
    """(K, 8) trilinear functions of the corners of a hexahedron at places (K, 3) in [0, 1]^3."""
    return np.where(CORNERS[None] > 0.5, at[:, None], 1.0 - at[:, None]).prod(axis=2)


def joined(meshes: Sequence[SolidMesh]) -> SolidMesh:
    """Several solids as one, one after the other; no two share a node."""
    if len(meshes) == 1:
        return meshes[0]
    first = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    cells = [np.where(mesh.cells < 0, -1, mesh.cells + n) for mesh, n in zip(meshes, first)]
    return SolidMesh(np.concatenate([mesh.points for mesh in meshes]), np.concatenate(cells).astype(np.int32))
