"""The constraints that tie elements and particles in their overlap, C v = 0, C = [C_E, -C_P]. NumPy and SciPy only.

**On the gradient of the weight.** Under a uniform tension s the elements feel -int (1 - alpha) s : grad v and the particles
-int alpha s : grad v. Apart, each needs the force s . grad alpha, so this is the measure of the multipliers. alpha belongs to cells of
particles, so its gradient stands on their sides e, of length L and normal n from left to right:

    b_e        = (alpha_right - alpha_left) n L           true edges of the part left out; outside of the particles alpha is 0
    C_E[la, k] = sum_e N_l(x_e) (b_e . t_la) N_k(x_e)     x_e: the middle of the side; N_k is linear along it
    C_P[la, j] = sum_e N_l(x_e) (b_e . t_la) Phi_ej       Phi: the edge means of the galerkin form

With l a node of the elements of the overlap and t_la the principal directions of the b_e around it: one on a straight run, two at a corner.
sum_e b_e . s Phi_e is minus the force that the particles make of a uniform tension s, wherever their nodes are, and the elements' side is
minus theirs. So uniform tensions pass to rounding (patch test) where the weight is 1/2, or linear on a straight strip.

**On the volume**, as T 4.29 and 4.30 have it: rows l, int N_l (v_E - v_P), from the Gauss points of the elements and moving least squares
of first order over r_g.

**On a curved surface** both bodies have the nodes of the overlap on the elements, but the fit over several elements rounds their folds.
So C X, and C N of the directors, would not vanish, and a rigid turn would be held back. The rows of the particles are changed by the
smallest amount that makes C (1, X, N) = 0. It is zero where the surface is flat. Directors of particles are as long as the elements would
have them there (`length`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ...bodies.shell.parts import GAUSS, Split, shapes, slopes
from ...geometry.mesh import SurfaceMesh, tangent_frames

SMALLEST = 1e-4  # of the largest row: shorter ones tie nothing
ROUNDING = 1e-13  # of C X over the size of its row
SPAN = 1e-7  # of the largest spread of places and directors: below, the surface is flat that way


@dataclass
class Constraints:
    """elements (R, nodes of the elements), particles (R, particles): C_E and C_P; length (particles,): of their directors."""

    elements: sp.csr_array
    particles: sp.csr_array
    length: np.ndarray

    def __call__(self, of_elements: np.ndarray, of_particles: np.ndarray) -> np.ndarray:
        """(R, c) C v."""
        return self.elements @ of_elements - self.particles @ of_particles


def constraints(split: Split, edge_means: sp.csr_array, points: np.ndarray, normals: np.ndarray) -> Constraints:
    """edge_means (sides, particles): Phi; points, normals (particles, 3)."""
    if split.patch.multipliers == "volume":
        elements, particles = _on_volume(split, points)
        return Constraints(elements, particles, split.fine.length)
    at = Sides.of(split)
    N = _of_elements(split, at.cell, at.r, at.s)
    weight = rows_along(N, at.b)
    elements = weight @ N
    particles = weight @ edge_means[at.edge]
    found = Constraints(sp.csr_array(elements), sp.csr_array(particles), split.fine.length)
    _bend(found, split, points, normals)
    return found


@dataclass
class Sides:
    """Sides of cells of particles with a jump of alpha: edge number, b (K, 3) [m], the element of the overlap, the middle in it."""

    edge: np.ndarray
    b: np.ndarray
    cell: np.ndarray
    r: np.ndarray
    s: np.ndarray

    @staticmethod
    def of(split: Split) -> Sides:
        fine, alpha = split.fine, split.of_particles
        mesh, sides = fine.mesh, fine.mesh.edges.sides
        left, right = sides.T
        one = right < 0
        beyond = np.zeros(len(sides))
        jump = np.where(one, beyond, alpha[np.where(one, 0, right // 4)]) - alpha[left // 4]
        # a border is that of the particles where an element goes on behind it, else a true edge of the shell
        border = np.flatnonzero(one)
        cell, k = left[border] // 4, left[border] % 4
        across = split.whole.edges.sides[split.whole.edges.cell_edges[fine.parent[cell], k]]
        jump[border[(across < 0).any(axis=1)]] = 0.0
        edge = np.flatnonzero(np.abs(jump) > 1e-12)
        out = _outward(mesh, left[edge])
        inner = ~one[edge]
        out[inner] = 0.5 * (out[inner] - _outward(mesh, right[edge][inner]))
        side = left[edge].copy()
        off = ~split.overlap[fine.parent[side // 4]]
        side[off] = right[edge][off]
        place = fine.place[side // 4] + np.array([[0.5, 0.0], [1.0, 0.5], [0.5, 1.0], [0.0, 0.5]])[side % 4]
        r, s = (2.0 * place / split.n - 1.0).T
        return Sides(edge, jump[edge][:, None] * out, fine.parent[side // 4], r, s)


def _outward(mesh: SurfaceMesh, side: np.ndarray) -> np.ndarray:
    """(K, 3) normal out of the cell, in its plane, times the length of the side [m]."""
    cell, k = side // 4, side % 4
    first, second = mesh.points[mesh.cells[cell, k]], mesh.points[mesh.cells[cell, (k + 1) % 4]]
    return np.cross(second - first, mesh.frames[cell, 2])


def _of_elements(split: Split, cell: np.ndarray, r: np.ndarray, s: np.ndarray) -> sp.csr_array:
    """(K, nodes of the elements) N_k at places in elements."""
    node = split.number[split.whole.cells[cell]]
    row = np.repeat(np.arange(len(cell)), 4)
    return sp.csr_array(sp.coo_array((shapes(r, s).ravel(), (row, node.ravel())), shape=(len(cell), len(split.nodes))))


def rows_along(N: sp.csr_array, b: np.ndarray) -> sp.csr_array:
    """(R, K) N_l(x_e) b_e . t_la, rows of one node one after the other; N (K, nodes of the elements), b (K, 3)."""
    tensor = np.einsum("ki,kj->kij", b, b).reshape(len(b), 9)
    square = N.copy()
    square.data **= 2
    around = (square.T @ tensor).reshape(-1, 3, 3)
    size, axes = np.linalg.eigh(around)
    node, which = np.nonzero(size > SMALLEST**2 * size.max())
    turned = axes[node, :, which]
    of_node = sp.csr_array(N.T)[node]
    weight = sp.csr_array(of_node)
    row = np.repeat(np.arange(len(node)), np.diff(weight.indptr))
    weight.data = weight.data * np.einsum("ki,ki->k", turned[row], b[weight.indices])
    return weight


def _bend(found: Constraints, split: Split, points: np.ndarray, normals: np.ndarray) -> None:
    """Rows of the particles such that C (1, X, N) = 0, changed as little as possible."""
    theirs = np.column_stack([points, normals * found.length[:, None]])
    mine = np.column_stack([split.elements.points, split.elements.node_normals])
    lack = found.elements @ mine - found.particles @ theirs
    rows, extent = found.particles, np.ptp(points, axis=0).max()
    for row in range(rows.shape[0]):
        span = slice(rows.indptr[row], rows.indptr[row + 1])
        near = rows.indices[span]
        size = np.abs(rows.data[span]).sum()
        missed = np.abs(lack[row, :3]).max() + split.spacing * np.abs(lack[row, 3:]).max()
        if missed <= ROUNDING * size * extent:
            continue
        fields = theirs[near] - theirs[near].mean(axis=0)
        fields[:, :3] /= split.spacing
        wanted = np.r_[0.0, lack[row, :3] / split.spacing, lack[row, 3:]]
        basis = np.column_stack([np.ones(len(near)), fields])
        rows.data[span] += np.linalg.lstsq(basis.T, wanted, rcond=SPAN)[0]


def _on_volume(split: Split, points: np.ndarray) -> tuple[sp.csr_array, sp.csr_array]:
    """T's own rows: the Gauss points of the overlap."""
    both = np.flatnonzero(split.overlap)
    X = split.whole.points[split.whole.cells[both]]
    cell = np.repeat(both, 4)
    r, s = np.tile(GAUSS, (len(both), 1)).T
    along = np.stack([np.einsum("pk,mki->mpi", slopes(*at), X) for at in GAUSS], axis=1)
    normal = np.cross(along[:, :, 0], along[:, :, 1]).reshape(-1, 3)
    area = np.linalg.norm(normal, axis=1)
    N = _of_elements(split, cell, r, s)
    place = N @ split.elements.points
    middle = np.repeat(X.mean(axis=1), 4, axis=0)
    radius = split.patch.reach * np.linalg.norm(place - middle, axis=1)
    frames = tangent_frames(normal / area[:, None])
    means = _first_order(points, place, np.maximum(radius, 1.6 * split.spacing), frames)
    used = np.unique(split.number[split.whole.cells[both]])
    weight = sp.csr_array(N.T)[used] @ sp.diags_array(area)
    return sp.csr_array(weight @ N), sp.csr_array(weight @ means)


def _first_order(points: np.ndarray, place: np.ndarray, radius: np.ndarray, frames: np.ndarray) -> sp.csr_array:
    """(K, particles) moving least squares of first order at places, with the kernel of radius (K,) [m]."""
    from scipy.spatial import cKDTree

    tree = cKDTree(points)
    data, column, start = [], [], [0]
    for x, reach, frame in zip(place, radius, frames):
        near = np.sort(np.array(tree.query_ball_point(x, reach * (1 - 1e-9)), dtype=int))
        y = (points[near] - x) @ frame[:2].T / reach
        basis = np.column_stack([np.ones(len(near)), y])
        q = 2.0 * np.linalg.norm(points[near] - x, axis=1) / reach
        w = np.where(q < 1.0, 1.0 - 1.5 * q**2 + 0.75 * q**3, 0.25 * np.maximum(2.0 - q, 0.0) ** 3)
        data.append(w * (basis @ np.linalg.solve(basis.T @ (w[:, None] * basis), np.eye(3)[0])))
        column.append(near)
        start.append(start[-1] + len(near))
    return sp.csr_array((np.concatenate(data), np.concatenate(column), start), shape=(len(place), len(points)))
