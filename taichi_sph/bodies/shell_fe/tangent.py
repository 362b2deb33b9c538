"""Tangent stiffness of finite elements on elastic shells: the derivative of the forces that the kernels compute, as a sparse matrix.

Every strain of an element, and every change that its points do not see (elements.py), is a quadratic function g of its corners' u and d.
With resultants r = C g the tangent is

    material part   B^T C B, B = dg/d(u, d)          geometric part   sum_k r_k d2 g_k

and the second derivatives are constants: products of slopes, times the unit matrix between u and u or between u and d. A follower pressure
adds the derivative of its forces, which is not symmetric. The unknowns are those of every form (bodies/shell/instead/freedom.py), and the
stresses of the geometric part are those that the step before foresaw, as in bodies/shell_sph/tangent.py.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import runtime
from ..shell.group import ShellGroup
from ..shell.instead.freedom import Freedom, elimination, turning
from .elements import Elements
from .shapes import CORNER, HOURGLASS

NEXT = np.roll(np.eye(4), 1, axis=1)  # row k: the corner after corner k
ALONG, MEAN = NEXT - np.eye(4), 0.5 * (NEXT + np.eye(4))  # of the sides


@dataclass
class Stresses:
    """(M, P, 8) or (M, P, 3) resultants of the points, (M, 6) or (M, 2) forces on what they do not see."""

    points: np.ndarray
    held: np.ndarray


@dataclass
class _Place:
    """Of elements at a place: x (M, P, 2, dim) tangents, n (M, P, 2, 3) slopes of the directors; sides (M, 4, 3), means (M, 4, 3) of the
    directors along them; x_h, n_h (M, dim): what a linear field leaves."""

    x: np.ndarray
    n: np.ndarray
    sides: np.ndarray
    means: np.ndarray
    x_h: np.ndarray
    n_h: np.ndarray


class Tangent:
    """K of a group. What does not change is read from its fields once."""

    def __init__(self, group: ShellGroup):
        import scipy.sparse as sparse

        term, nodes = group.internal, group.nodes
        assert isinstance(term, Elements)
        self.n, self.m, self.dim, self.bends = nodes.n, group.cells.n, nodes.dim, nodes.bends
        self.width = self.dim + 3 if self.bends else self.dim
        m, per = self.m, term.per_cell

        def read(field: Any, n: int) -> np.ndarray:
            return runtime.get(field, n).astype(np.float64)

        points = group.points
        self.corner = runtime.get(term.corner, m)
        self.slopes = np.stack([read(f, m * per).reshape(m, per, 4) for f in (term.slope_1, term.slope_2)], axis=2)
        self.area = read(points.area, m * per).reshape(m, per)
        sheet = runtime.get(points.sheet, m * per).reshape(m, per)[:, 0]
        young, nu, e = (np.array(group.material.numbers(key))[sheet] for key in ("young", "poisson", "thickness"))
        plane = np.zeros((m, 3, 3))
        plane[:, 0, 0] = plane[:, 1, 1] = 1.0
        plane[:, 0, 1] = plane[:, 1, 0] = nu
        plane[:, 2, 2] = 0.5 * (1.0 - nu)
        plane *= (young * e / (1.0 - nu**2))[:, None, None]
        size, q = (8, 6) if self.bends else (3, 2)
        self.C = np.zeros((m, size, size))
        self.C[:, :3, :3] = plane
        self.held, self.hourglass = np.zeros((m, q)), np.zeros((m, 4))
        self.along, self.twists = np.zeros((m, 2, 2)), np.zeros((m, 2, 4))
        shear = np.zeros(m)
        self.X = read(nodes.X, nodes.n)[:, : self.dim]
        if self.bends:
            shear = read(points.shear, m * per).reshape(m, per)[:, 0]
            self.C[:, 3:6, 3:6] = plane * (e**2 / 12.0)[:, None, None]
            self.C[:, 6, 6] = self.C[:, 7, 7] = shear
            self.ties = np.stack([read(f, m * per).reshape(m, per, 4) for f in (term.tie_1, term.tie_2)], axis=2)
            self.N = read(nodes.N, nodes.n)
        if term.holds:
            moduli = [young * e, young * e, *([young * e**3 / 12.0] * 2 + [shear] * 2 if self.bends else [])]
            self.held = read(term.held, m)[:, None] * np.stack(moduli, axis=1)
            self.hourglass, self.along = read(term.hourglass, m), read(term.along, m).reshape(m, 2, 2)
            if self.bends:
                self.twists = np.stack([read(term.twist_1, m), read(term.twist_2, m)], axis=1)
        u = np.zeros((self.n, self.dim))
        self.rest = self._strains(self._place(u, u))
        four = runtime.get(group.cells.n_corners, m) == 4
        r, s = 0.25 * CORNER.T
        self.faces = np.stack(
            [np.where(four[:, None], a, b) for a, b in ((r, [-1, 1, 0, 0]), (s, [-1, 0, 1, 0]), (0.25 * HOURGLASS, 0.0 * r))]
        )
        whole = np.where(four[:, None], 1.0, np.array([1.0, 1.0, 1.0, 0.0]) / 6.0)
        self.shares = np.stack([whole, *(np.where(four[:, None], c / 3.0, 0.0) for c in CORNER.T)])
        incidence = sparse.csr_array((np.ones(4 * m), (np.repeat(np.arange(m), 4), self.corner.ravel())), shape=(m, self.n))
        self.elimination = elimination(incidence)

    def _place(self, u: np.ndarray, d: np.ndarray) -> _Place:
        places = (self.X + u)[self.corner]
        x = np.einsum("mpak,mki->mpai", self.slopes, places)
        x_h = np.einsum("mk,mki->mi", self.hourglass, places)
        if not self.bends:
            return _Place(x, x, x, x, x_h, x_h)
        directors = (self.N + d)[self.corner]
        n = np.einsum("mpak,mki->mpai", self.slopes, directors)
        n_h = np.einsum("mk,mki->mi", self.hourglass, directors)
        return _Place(x, n, ALONG @ places, MEAN @ directors, x_h, n_h)

    def _strains(self, at: _Place) -> tuple[np.ndarray, np.ndarray]:
        """(M, P, 8) or (M, P, 3), and (M, 6) or (M, 2) changes; those at rest are not taken off."""
        xx = np.einsum("mpai,mpbi->mpab", at.x, at.x)
        g = [0.5 * xx[..., 0, 0], 0.5 * xx[..., 1, 1], xx[..., 0, 1]]
        m = np.einsum("mia,maj,mj->mi", self.along, at.x[:, 0], at.x_h)
        if not self.bends:
            return np.stack(g, axis=-1), m
        xn = np.einsum("mpai,mpbi->mpab", at.x, at.n)
        shears = np.einsum("mki,mki->mk", at.sides, at.means)
        g += [xn[..., 0, 0], xn[..., 1, 1], xn[..., 0, 1] + xn[..., 1, 0]]
        gamma = np.einsum("mpak,mk->mpa", self.ties, shears)
        b = np.einsum("mia,maj,mj->mi", self.along, at.x[:, 0], at.n_h) + np.einsum("mia,maj,mj->mi", self.along, at.n[:, 0], at.x_h)
        q = np.concatenate([m, b, np.einsum("mik,mk->mi", self.twists, shears)], axis=1)
        return np.concatenate([np.stack(g, axis=-1), gamma], axis=-1), q

    def _slopes(self, at: _Place) -> tuple[np.ndarray, np.ndarray]:
        """(M, P, 8, 4, c) and (M, 6, 4, c): derivatives of the strains by u and d of the corners."""
        h, dim, m = self.slopes, self.dim, self.m
        B = np.zeros((m, h.shape[1], self.C.shape[1], 4, self.width))
        Q = np.zeros((m, self.held.shape[1], 4, self.width))

        def mixed(one: int, two: int, v: np.ndarray) -> np.ndarray:
            return np.einsum("mpk,mpi->mpki", h[:, :, one], v[:, :, two])

        def over(v: np.ndarray, v_h: np.ndarray) -> np.ndarray:
            """sum_a rho_ia (N_k,a v_h + gamma_k v_,a)."""
            first = np.einsum("mia,mak,mj->mikj", self.along, h[:, 0], v_h)
            return first + np.einsum("mia,maj,mk->mikj", self.along, v[:, 0], self.hourglass)

        B[:, :, 0, :, :dim], B[:, :, 1, :, :dim] = mixed(0, 0, at.x), mixed(1, 1, at.x)
        B[:, :, 2, :, :dim] = mixed(0, 1, at.x) + mixed(1, 0, at.x)
        Q[:, :2, :, :dim] = over(at.x, at.x_h)
        if self.bends:
            for part, v in ((slice(0, 3), at.n), (slice(3, 6), at.x)):
                B[:, :, 3, :, part], B[:, :, 4, :, part] = mixed(0, 0, v), mixed(1, 1, v)
                B[:, :, 5, :, part] = mixed(0, 1, v) + mixed(1, 0, v)
            Q[:, 2:4, :, :3], Q[:, 2:4, :, 3:] = over(at.n, at.n_h), over(at.x, at.x_h)
            of_sides = np.concatenate(
                [np.einsum("kl,mki->mkli", NEXT - np.eye(4), at.means), np.einsum("kl,mki->mkli", 0.5 * (NEXT + np.eye(4)), at.sides)],
                axis=3,
            )
            B[:, :, 6:] = np.einsum("mpak,mkli->mpali", self.ties, of_sides)
            Q[:, 4:] = np.einsum("mak,mkli->mali", self.twists, of_sides)
        return B, Q

    def stresses(self, u: np.ndarray, d: np.ndarray) -> Stresses:
        """Those of the displacements."""
        g, q = self._strains(self._place(u, d))
        return Stresses(np.einsum("mab,mpb->mpa", self.C, g - self.rest[0]), self.held * (q - self.rest[1]))

    def foreseen(self, u: np.ndarray, d: np.ndarray, du: np.ndarray, dd: np.ndarray) -> Stresses:
        """Stresses at (u, d) plus their slope along the step (du, dd)."""
        at = self._place(u, d)
        g, q = self._strains(at)
        B, Q = self._slopes(at)
        step = (np.concatenate([du, dd], axis=1) if self.bends else du)[self.corner]
        g = g - self.rest[0] + np.einsum("mpakc,mkc->mpa", B, step)
        q = q - self.rest[1] + np.einsum("mikc,mkc->mi", Q, step)
        return Stresses(np.einsum("mab,mpb->mpa", self.C, g), self.held * q)

    def matrix(
        self, u: np.ndarray, d: np.ndarray, stresses: Stresses, pressures: np.ndarray, free: Freedom, moments: np.ndarray | None
    ) -> Any:
        """K [N/m, N, N m] of the unknowns, as a csc_array. pressures (M,) [Pa]: those that follow. moments (N, 3) [N m]: dead ones."""
        import scipy.sparse as sparse

        at = self._place(u, d)
        B, Q = self._slopes(at)
        B, Q = B.reshape(*B.shape[:3], -1), Q.reshape(*Q.shape[:2], -1)
        weighted = (self.area[:, :, None, None] * self.C[:, None]) @ B
        K = np.einsum("mpax,mpay->mxy", B, weighted, optimize=True) + Q.transpose(0, 2, 1) @ (self.held[:, :, None] * Q)
        blocks = K.reshape(self.m, 4, self.width, 4, self.width)
        straight, bent = self._seconds(stresses)
        for i in range(self.dim):
            blocks[:, :, i, :, i] += straight
            if self.bends:
                blocks[:, :, i, :, 3 + i] += bent
                blocks[:, :, 3 + i, :, i] += bent.transpose(0, 2, 1)
        if pressures.any():
            blocks[:, :, :3, :, :3] -= self._pressing(u, pressures)
        row, column = np.repeat(self.corner, 4, axis=1).ravel(), np.tile(self.corner, (1, 4)).ravel()
        data = blocks.transpose(0, 1, 3, 2, 4).reshape(-1, self.width, self.width)
        reduced = free.basis[row].transpose(0, 2, 1) @ data @ free.basis[column]
        i, j = free.number[row][:, :, None], free.number[column][:, None, :]
        keep = (i >= 0) & (j >= 0)
        i, j = np.broadcast_to(i, keep.shape)[keep], np.broadcast_to(j, keep.shape)[keep]
        found = sparse.csc_array((reduced[keep], (i, j)), shape=(free.size, free.size))
        if self.bends:
            turns = turning(self.N + d, self.pull(u, d, stresses), free, moments)
            a, b = free.number[:, 3:, None], free.number[:, None, 3:]
            keep = (a >= 0) & (b >= 0)
            a, b = np.broadcast_to(a, keep.shape)[keep], np.broadcast_to(b, keep.shape)[keep]
            found = sparse.csc_array(found + sparse.csc_array((turns[keep], (a, b)), shape=found.shape))
        return found

    def _seconds(self, stresses: Stresses) -> tuple[np.ndarray, np.ndarray]:
        """(M, 4, 4) second derivatives of the energy between u and u, and between u and d, for each component."""
        h, r, f = self.slopes, self.area[:, :, None] * stresses.points, stresses.held

        def products(first: np.ndarray, second: np.ndarray, both: np.ndarray, held: np.ndarray) -> np.ndarray:
            tensor = np.stack([np.stack([first, both], axis=-1), np.stack([both, second], axis=-1)], axis=-2)
            skew = np.einsum("mi,mia,mak,ml->mkl", held, self.along, h[:, 0], self.hourglass)
            return np.einsum("mpak,mpab,mpbl->mkl", h, tensor, h, optimize=True) + skew + skew.transpose(0, 2, 1)

        straight = products(r[..., 0], r[..., 1], r[..., 2], f[:, :2])
        if not self.bends:
            return straight, straight
        pull = np.einsum("mpak,mpa->mk", self.ties, r[..., 6:]) + np.einsum("mak,ma->mk", self.twists, f[:, 4:])
        bent = products(r[..., 3], r[..., 4], r[..., 5], f[:, 2:4])
        return straight, bent + np.einsum("ka,mk,kb->mab", ALONG, pull, MEAN)

    def pull(self, u: np.ndarray, d: np.ndarray, stresses: Stresses) -> np.ndarray:
        """(N, 3) dE/dd of those stresses [N m]."""
        B, Q = self._slopes(self._place(u, d))
        of_corners = np.einsum("mpa,mpakc->mkc", self.area[:, :, None] * stresses.points, B[..., 3:], optimize=True)
        of_corners += np.einsum("mi,mikc->mkc", stresses.held, Q[..., 3:])
        found = np.zeros((self.n, 3))
        np.add.at(found, self.corner, of_corners)
        return found

    def _face(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(M, 3) x_,r, x_,s and x_h of elements whose nodes are at x."""
        r, s, h = (np.einsum("mk,mki->mi", weights, x[self.corner]) for weights in self.faces)
        return r, s, h

    def pressed(self, u: np.ndarray, following: np.ndarray, dead: np.ndarray) -> np.ndarray:
        """(N, 3) forces [N] of pressures (M,) [Pa] on the cells: those that follow the surface, those that keep its first direction."""
        found = np.zeros((self.n, 3))
        for x, p in ((self.X + u, following), (self.X, dead)):
            r, s, h = self._face(x)
            areas = np.stack([np.cross(r, s), np.cross(r, h), np.cross(h, s)])
            np.add.at(found, self.corner, p[:, None, None] * np.einsum("tmk,tmi->mki", self.shares, areas))
        return found

    def _pressing(self, u: np.ndarray, pressures: np.ndarray) -> np.ndarray:
        """(M, 4, 3, 4, 3) derivatives of the forces of pressures that follow."""
        r, s, h = self._face(self.X + u)
        of = []
        for (one, a), (two, b) in (((r, 0), (s, 1)), ((r, 0), (h, 2)), ((h, 2), (s, 1))):
            of.append(np.einsum("ml,mij->mlij", self.faces[b], _cross(one)) - np.einsum("ml,mij->mlij", self.faces[a], _cross(two)))
        return pressures[:, None, None, None, None] * np.einsum("tmk,tmlij->mkilj", self.shares, np.stack(of))


def _cross(v: np.ndarray) -> np.ndarray:
    """(M, 3, 3) the matrices of v x."""
    zero = np.zeros(len(v))
    return np.stack([zero, -v[:, 2], v[:, 1], v[:, 2], zero, -v[:, 0], -v[:, 1], v[:, 0], zero], axis=1).reshape(-1, 3, 3)
