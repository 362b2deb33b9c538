"""Tangent stiffness of the galerkin form on elastic shells: the derivative of the forces that the kernels compute, as a sparse matrix.

The form sums rows: an edge mean, a residual (its part of the fits, the node's own value, its turns) is a row A_r of coefficients, and the
energy is a function of A x, x = (u, d). So

    K = A^T H A,    H: second derivative of the energy by the rows, blocks between the rows of one cell and of one node.

A cell with strains g (bodies/shell/stress.py), resultants r = C g and gradients q has in H

    material part   dg/dq^T C dg/dq          geometric part   sum_k r_k d2 g_k / dq2

and a residual r_i = u part - c_i d_i with w = r_i . n has k_t 1 + (k_n - k_t) n n^T and, beside it, (k_n - k_t) w d2 (r . n). A follower
pressure adds the derivative of p (x_,1 x x_,2) A, which is not symmetric.

**Mixed stresses.** The geometric part takes its stresses from `Stresses`, not from the displacements. They are those that the linear step
before foresaw: the strains at the old place and their slope along the step. At equilibrium both agree, so K there is the derivative of
the forces. On the way a step that turns a thin shell far leaves membrane strains of second order, and their stress would throw the next
step out; the foreseen stress has none of it (Magisano, Leonetti and Garcea 2017, mixed integration points).

**Unknowns.** A director stays of length one. It turns about the axes w of its node, n <- n + w x n + 1/2 w x (w x n), which adds
1/2 sum d2 n . dE/dd to K. What motions hold has no unknown (bodies/shell/instead/freedom.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import runtime
from ..shell.group import ShellGroup
from ..shell.instead.freedom import Freedom, elimination, turning
from .galerkin import Galerkin


@dataclass
class Stresses:
    """(M, 8) or (M, 3) resultants of the cells, (N,) (k_n - k_t) w of the residuals [N]: what the geometric part is made of."""

    cells: np.ndarray
    nodes: np.ndarray


class Tangent:
    """K of a group. What does not change is read from its fields once."""

    def __init__(self, group: ShellGroup):
        import scipy.sparse as sparse

        assert isinstance(group.internal, Galerkin)
        term, nodes, cells = group.internal, group.nodes, group.cells
        self.group, self.term = group, term
        self.n, self.edges, self.m = nodes.n, term.n_edges, cells.n
        self.dim, self.bends = nodes.dim, nodes.bends
        self.width = self.dim + 3 if self.bends else self.dim
        get = runtime.get
        coef, source = get(term.rows.coef, term.rows.pairs).astype(np.float64), get(term.rows.source, term.rows.pairs)
        start = get(term.rows.start, term.rows.n + 1)
        rows = sparse.csr_array((coef, source, start), shape=(term.rows.n, self.n))
        parts = [rows]
        if self.bends:
            parts.append(sparse.eye_array(self.n, format="csr"))
            if term.turns:
                turn = get(term.turn, term.rows.pairs).astype(np.float64)
                parts.append(sparse.csr_array((turn, source, start), shape=(term.rows.n, self.n))[self.edges :])
        self.A = sparse.csr_array(sparse.vstack(parts))
        self.A.sum_duplicates()
        self.B = sparse.csr_array(self.A.T)
        self._read_cells()
        self._read_nodes()
        self._pattern()
        self.elimination = self._elimination()

    def _read_cells(self) -> None:
        """Constants of the cells; broken ones weigh nothing."""
        get, cells, term, m = runtime.get, self.group.cells, self.term, self.m
        there = get(cells.edge, m) >= 0
        self.edge = np.where(there, get(cells.edge, m), get(cells.edge, m)[:, :1])
        self.side = get(term.side, 4 * m).astype(np.float64).reshape(m, 4, 2) * there[:, :, None]
        self.area = get(cells.area, m).astype(np.float64) * (get(cells.broken, m) == 0)
        self.a = np.stack([get(cells.a1, m), get(cells.a2, m)], axis=1).astype(np.float64)
        sheet = get(cells.sheet, m)
        young, nu, e = (np.array(self.group.material.numbers(key))[sheet] for key in ("young", "poisson", "thickness"))
        plane = np.zeros((m, 3, 3))
        plane[:, 0, 0] = plane[:, 1, 1] = 1.0
        plane[:, 0, 1] = plane[:, 1, 0] = nu
        plane[:, 2, 2] = 0.5 * (1.0 - nu)
        plane *= (young * e / (1.0 - nu**2))[:, None, None]
        size = 8 if self.bends else 3
        self.C = np.zeros((m, size, size))
        self.C[:, :3, :3] = plane
        q = 5 if self.bends else 2
        slots = np.zeros((m, q, 4, 2 if self.bends else 1))  # of a gradient: by side, of u or of d
        slots[:, 0, :, 0], slots[:, 1, :, 0] = self.side[:, :, 0], self.side[:, :, 1]
        if self.bends:
            self.C[:, 3:6, 3:6] = plane * (e**2 / 12.0)[:, None, None]
            shear = get(cells.shear, m).astype(np.float64)
            self.C[:, 6, 6] = self.C[:, 7, 7] = shear
            self.share = get(term.share, 4 * m).astype(np.float64).reshape(m, 4) * there
            self.bears = get(term.bears, 4 * m).astype(np.float64).reshape(m, 4) * there
            self.N = np.stack([get(f, m) for f in (cells.director_1, cells.director_2, cells.director)], axis=1).astype(np.float64)
            slots[:, 2, :, 1], slots[:, 3, :, 1], slots[:, 4, :, 1] = self.side[:, :, 0], self.side[:, :, 1], self.share
        # (M, q dim, 4 c): gradients of the values of the sides
        self.L = np.einsum("mqkv,ij->mqikvj", slots, np.eye(self.dim)).reshape(m, q * self.dim, 4 * self.width)

    def _read_nodes(self) -> None:
        """Constants of the residuals."""
        get, term, n = runtime.get, self.term, self.n
        self.k = get(term.stiffness, n).astype(np.float64)
        if self.bends:
            self.N0 = get(self.group.nodes.N, n).astype(np.float64)
            self.k_more = get(term.stiffness_n, n).astype(np.float64) - self.k
            self.k_d = get(term.stiffness_d, n).astype(np.float64)
            self.left, self.left_d = get(term.left, n).astype(np.float64), get(term.left_d, n).astype(np.float64)

    def _pattern(self) -> None:
        """Where the blocks of H stand: those of the cells first, then those of the nodes; and how they are summed."""
        first, second = np.repeat(self.edge, 4, axis=1).ravel(), np.tile(self.edge, (1, 4)).ravel()
        node = self.edges + np.arange(self.n)
        kinds = [0] if not self.bends else [0, 1, 2] if self.term.turns else [0, 1]
        self.kinds = [(a, b) for a in kinds for b in kinds]
        first = np.concatenate([first, *(node + a * self.n for a, _ in self.kinds)])
        second = np.concatenate([second, *(node + b * self.n for _, b in self.kinds)])
        size = self.A.shape[0]
        self.entry = np.lexsort((second, first))
        row, column = first[self.entry], second[self.entry]
        new = np.r_[True, (row[1:] != row[:-1]) | (column[1:] != column[:-1])]
        self.begin = np.flatnonzero(new)
        self.columns = column[new].astype(np.int32)
        self.row_start = np.r_[0, np.cumsum(np.bincount(row[new], minlength=size))].astype(np.int32)

    def _elimination(self) -> np.ndarray:
        """(N,) nodes in the order in which a factorisation of K takes them."""
        return elimination(abs(self.A))

    def gradients(self, u: np.ndarray, d: np.ndarray) -> np.ndarray:
        """(M, q, dim) gradients u_,1 u_,2 (d_,1 d_,2 d) of the cells."""
        values = np.concatenate([u, d], axis=1) if self.bends else u
        of_sides = (self.A[: self.edges] @ values)[self.edge].reshape(self.m, 4 * self.width, 1)
        return (self.L @ of_sides).reshape(self.m, -1, self.dim)

    def strains(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(M, 8) or (M, 3) strains of gradients q, and their derivative (M, ., q dim); the numbers are those of bodies/shell/stress.py."""
        dim, x = self.dim, self.a + q[:, :2]

        def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
            return np.einsum("mi,mi->m", a, b)

        g = np.zeros(self.C.shape[:2])
        B = np.zeros((*self.C.shape[:2], q.shape[1], dim))
        for a in (0, 1):
            g[:, a] = dot(self.a[:, a], q[:, a]) + 0.5 * dot(q[:, a], q[:, a])
            B[:, a, a] = x[:, a]
        g[:, 2] = dot(self.a[:, 0], q[:, 1]) + dot(self.a[:, 1], q[:, 0]) + dot(q[:, 0], q[:, 1])
        B[:, 2, 0], B[:, 2, 1] = x[:, 1], x[:, 0]
        if self.bends:
            n = self.N + q[:, 2:]  # n_,1 n_,2 n
            for row, a, b in ((3, 0, 0), (4, 1, 1), (5, 0, 1), (5, 1, 0), (6, 0, 2), (7, 1, 2)):
                g[:, row] += dot(self.a[:, a], q[:, 2 + b]) + dot(q[:, a], n[:, b])
                B[:, row, a] += n[:, b]
                B[:, row, 2 + b] += x[:, a]
        return g, B.reshape(*self.C.shape[:2], -1)

    def _residuals(self, u: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """r_i (N, 3) and the directors."""
        return self.A[self.edges : self.edges + self.n] @ u - self.left[:, None] * d, self.N0 + d

    def stresses(self, u: np.ndarray, d: np.ndarray) -> Stresses:
        """Those of the displacements."""
        g, _ = self.strains(self.gradients(u, d))
        nodes = np.zeros(self.n)
        if self.bends:
            r, n = self._residuals(u, d)
            nodes = self.k_more * np.einsum("ni,ni->n", r, n)
        return Stresses(np.einsum("mab,mb->ma", self.C, g), nodes)

    def foreseen(self, u: np.ndarray, d: np.ndarray, du: np.ndarray, dd: np.ndarray) -> Stresses:
        """Stresses at (u, d) plus their slope along the step (du, dd)."""
        g, B = self.strains(self.gradients(u, d))
        g = g + np.einsum("map,mp->ma", B, self.gradients(du, dd).reshape(self.m, -1))
        nodes = np.zeros(self.n)
        if self.bends:
            r, n = self._residuals(u, d)
            dr = self.A[self.edges : self.edges + self.n] @ du - self.left[:, None] * dd
            nodes = self.k_more * (np.einsum("ni,ni->n", r, n) + np.einsum("ni,ni->n", dr, n) + np.einsum("ni,ni->n", r, dd))
        return Stresses(np.einsum("mab,mb->ma", self.C, g), nodes)

    def matrix(
        self, u: np.ndarray, d: np.ndarray, stresses: Stresses, pressures: np.ndarray, free: Freedom, moments: np.ndarray | None
    ) -> Any:
        """K [N/m, N, N m] of the unknowns, as a csc_array. pressures (M,) [Pa]: those that follow. moments (N, 3) [N m]: dead ones."""
        import scipy.sparse as sparse

        q = self.gradients(u, d)
        _, B = self.strains(q)
        H = B.transpose(0, 2, 1) @ (self.C @ B)
        dim, size, s = self.dim, q.shape[1], stresses.cells
        blocks = H.reshape(self.m, size, dim, size, dim)
        spots = [(0, 0, 0), (1, 1, 1), (2, 0, 1)]
        if self.bends:
            spots += [(3, 0, 2), (4, 1, 3), (5, 0, 3), (5, 1, 2), (6, 0, 4), (7, 1, 4)]
        for k, a, b in spots:
            for i in range(dim):
                blocks[:, a, i, b, i] += s[:, k]
                if a != b:
                    blocks[:, b, i, a, i] += s[:, k]
        H *= self.area[:, None, None]
        of_cells = (self.L.transpose(0, 2, 1) @ (H @ self.L)).reshape(self.m, 4, self.width, 4, self.width)
        if pressures.any():
            x = self.a + q[:, :2]
            slope = np.einsum("mlc,mcij->mlij", self.side, np.stack([-_cross(x[:, 1]), _cross(x[:, 0])], axis=1))
            force = (self.bears * (pressures * self.area)[:, None])[:, :, None, None, None] * slope[:, None]
            of_cells[:, :, :3, :, :3] -= force.transpose(0, 1, 3, 2, 4)
        width2 = self.width**2
        entries = of_cells.transpose(0, 1, 3, 2, 4).reshape(-1, width2)
        of_nodes = self._of_nodes(u, d, stresses.nodes)
        entries = np.concatenate([entries, *(of_nodes[kind].reshape(-1, width2) for kind in self.kinds)])
        entries = np.add.reduceat(entries[self.entry], self.begin, axis=0)
        data, columns, row_start = _sandwich(self.A, self.B, entries, self.columns, self.row_start)
        row = np.repeat(np.arange(self.n), np.diff(row_start))
        data = data.reshape(-1, self.width, self.width)
        reduced = free.basis[row].transpose(0, 2, 1) @ data @ free.basis[columns]
        if self.bends:
            same = np.flatnonzero(row == columns)
            reduced[same, 3:, 3:] += self._turning(u, d, stresses, free, moments)[row[same]]
        keep = (free.number[row][:, :, None] >= 0) & (free.number[columns][:, None, :] >= 0)
        i = np.broadcast_to(free.number[row][:, :, None], keep.shape)[keep]
        j = np.broadcast_to(free.number[columns][:, None, :], keep.shape)[keep]
        return sparse.csc_array((reduced[keep], (i, j)), shape=(free.size, free.size))

    def pressed(self, u: np.ndarray, following: np.ndarray, dead: np.ndarray) -> np.ndarray:
        """(N, 3) forces [N] of pressures (M,) [Pa] on the cells: those that follow the surface, those that keep its first direction."""
        x = self.a + self.gradients(u, np.zeros_like(u))[:, :2]
        force = following[:, None] * np.cross(x[:, 0], x[:, 1]) + dead[:, None] * np.cross(self.a[:, 0], self.a[:, 1])
        of_edges = np.zeros((self.edges, 3))
        np.add.at(of_edges, self.edge, self.bears[:, :, None] * (self.area[:, None] * force)[:, None])
        return self.B[:, : self.edges] @ of_edges

    def _of_nodes(self, u: np.ndarray, d: np.ndarray, stress: np.ndarray) -> dict[tuple[int, int], np.ndarray]:
        """Blocks (N, c, c) of H between the rows of a residual: 0 its fit, 1 the node's own value, 2 its turns."""
        eye = np.eye(self.dim)
        if not self.bends:
            return {(0, 0): self.k[:, None, None] * eye}
        r, n = self._residuals(u, d)
        more = self.k_more[:, None, None]
        rr = self.k[:, None, None] * eye + more * n[:, :, None] * n[:, None, :]
        rn = more * n[:, :, None] * r[:, None, :] + stress[:, None, None] * eye
        nn = more * r[:, :, None] * r[:, None, :]
        c, c_d, k_d = (values[:, None, None] for values in (self.left, self.left_d, self.k_d))
        found = {kind: np.zeros((self.n, 6, 6)) for kind in self.kinds}
        found[0, 0][:, :3, :3], found[0, 0][:, 3:, 3:] = rr, k_d * eye
        found[0, 1][:, :3, 3:], found[0, 1][:, 3:, 3:] = rn - c * rr, -c_d * k_d * eye
        found[1, 0] = found[0, 1].transpose(0, 2, 1)
        found[1, 1][:, 3:, 3:] = c**2 * rr - c * (rn + rn.transpose(0, 2, 1)) + nn + c_d**2 * k_d * eye
        if self.term.turns:
            found[0, 2][:, 3:, :3], found[1, 2][:, 3:, :3], found[2, 2][:, :3, :3] = -k_d * eye, c_d * k_d * eye, k_d * eye
            found[2, 0], found[2, 1] = found[0, 2].transpose(0, 2, 1), found[1, 2].transpose(0, 2, 1)
        return found

    def _turning(self, u: np.ndarray, d: np.ndarray, stresses: Stresses, free: Freedom, moments: np.ndarray | None) -> np.ndarray:
        """(N, 2, 2) what directors of length one add to K."""
        return turning(self.N0 + d, self.pull(u, d, stresses), free, moments)

    def pull(self, u: np.ndarray, d: np.ndarray, stresses: Stresses) -> np.ndarray:
        """(N, 3) dE/dd of those stresses [N m]."""
        q = self.gradients(u, d)
        x, s = self.a + q[:, :2], stresses.cells[:, :, None]
        m1, m2 = s[:, 3] * x[:, 0] + s[:, 5] * x[:, 1], s[:, 5] * x[:, 0] + s[:, 4] * x[:, 1]
        shear = s[:, 6] * x[:, 0] + s[:, 7] * x[:, 1]
        gradient = np.stack([m1, m2], axis=1)
        of_sides = self.area[:, None, None] * (self.side @ gradient + self.share[:, :, None] * shear[:, None])
        of_edges = np.zeros((self.edges, 3))
        np.add.at(of_edges, self.edge, of_sides)
        r, n = self._residuals(u, d)
        rest_d = self.A[self.edges : self.edges + self.n] @ d - self.left_d[:, None] * d
        if self.term.turns:
            rest_d -= self.A[self.edges + 2 * self.n :] @ u
        pull_d = self.k_d[:, None] * rest_d
        own = stresses.nodes[:, None] * r - self.left[:, None] * (self.k[:, None] * r + stresses.nodes[:, None] * n)
        own -= self.left_d[:, None] * pull_d
        return self.B[:, : self.edges] @ of_edges + self.B[:, self.edges : self.edges + self.n] @ pull_d + own


def _cross(v: np.ndarray) -> np.ndarray:
    """(M, 3, 3) the matrices of v x."""
    zero = np.zeros(len(v))
    return np.stack([zero, -v[:, 2], v[:, 1], v[:, 2], zero, -v[:, 0], -v[:, 1], v[:, 0], zero], axis=1).reshape(-1, 3, 3)


def _sandwich(A: Any, B: Any, blocks: np.ndarray, columns: np.ndarray, row_start: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Blocks (P, w), columns and row starts of A^T H A; B = A^T. A block counts as a row of w numbers: a scalar times it is one step."""
    import scipy.sparse as sparse

    w, rows, n = blocks.shape[1], A.shape[0], A.shape[1]

    def times(data: np.ndarray, indices: np.ndarray, indptr: np.ndarray, width: int) -> Any:
        left = sparse.bsr_array((B.data[:, None, None], B.indices, B.indptr), shape=B.shape)
        return left @ sparse.bsr_array((data[:, None, :], indices, indptr), shape=(rows, width * w))

    half = times(blocks, columns, row_start, rows)  # A^T H: (n, rows)
    data, indices, indptr = _turned(half, rows)
    whole = times(data, indices, indptr, n)  # its transpose, A^T from the left again
    return _turned(whole, n)


def _turned(matrix: Any, width: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Blocks, columns and row starts of the transpose; the blocks stay as they are."""
    import scipy.sparse as sparse

    places = sparse.csr_array((np.arange(len(matrix.indices)), matrix.indices, matrix.indptr), shape=(matrix.indptr.size - 1, width))
    turned = sparse.csr_array(places.T)
    return matrix.data[turned.data, 0], turned.indices, turned.indptr
