"""Waves on a stretched lattice of nodes: which travel, which feel nothing, which grow (von Neumann's analysis, in the manner
of Belytschko, Guo, Liu and Xiao 2000).

An endless square lattice in its plane with D = 1, E = 1, rho = 1, thickness 1, stretched by F = diag(l, 1). With the law of
laws/elastic.py, S = H : E, P = F S and tau = F S F^T, the forms that are compared are

    Lagrangian kernel   F_s = F + sum_j u_j (x) g_sj(X)            f_i = - sum_s V_s P(F_s) g_si(X)
    Eulerian kernel     dF_s = (sum_j du_j (x) g_sj(x)) F_s        f_i = - sum_s V_s tau(F_s) g_si(x)

over points s where stresses live: the nodes alone, one point in each cell, or one in each of the two triangles of a cell. At
nodes g is the gradient of classical SPH, V (grad W)(x_s - x_j) in the form of differences, made exact for linear fields; at
stress points, between nodes, that of moving least squares of order 1 (T annex A). Kernel B3 (T 1.7), h = support D, fixed.
Beside them the package's own forms (galerkin, collocation), read off the running force kernels.

By translation the forces f(R) around one moved node 0 tell everything; a wave u = w exp(i (k . R - omega t)) has

    K(k) w = omega^2 w,    K(k) = - sum_R df(R)/du(0) exp(-i k . R).

omega^2 < 0 or complex: the wave grows. omega^2 = 0: it feels nothing. What must come out:

- nodes alone feel nothing at the shortest waves, where sin(k . R) = 0 for all R: K = 0 with a Lagrangian kernel;
- with an Eulerian one only tau and the second derivatives of W are left there, the criterion of Swegle et al. 1995,

    K_ij = - 2 V tau_jj B_jj sum_R W_ij(R) (1 - cos k . R)          (B: what makes g = - B grad W exact for linear fields)

  so tension grows where W'' > 0, whatever the stiffness is;
- one point in a square cell feels nothing of the checkerboard k = (pi, pi), two in triangles hardly anything: the fit of
  h = 1.2 D smooths it away. What holds it in the package is the residual of the nodes (bodies/shell_sph/galerkin.py).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from .elements import plane_stress

SUPPORT, POISSON = 1.2, 0.3
# where the stresses of a unit cell live, and the share of its area
LAYOUTS = {
    "nodes": ((0.0, 0.0, 1.0),),
    "cells": ((0.5, 0.5, 1.0),),
    "triangles": ((2 / 3, 1 / 3, 0.5), (1 / 3, 2 / 3, 0.5)),
}
NAMES = {"nodes": "nodes alone", "cells": "a stress point a cell", "triangles": "a stress point a triangle"}
KERNELS = ("Eulerian", "Lagrangian")
DIRECTIONS = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])  # of waves, up to k = pi in each component: the shortest
NOTHING = 0.01  # of the shear modulus: below that a wave feels nothing
SMALL = 1e-6  # displacement of the probing node


def b3(q: np.ndarray) -> np.ndarray:
    """Shape of T 1.7 at q = r / h (numerics/kernel.py, in NumPy)."""
    return np.where(q < 1, 1 - 1.5 * q**2 + 0.75 * q**3, 0.25 * np.clip(2 - q, 0, None) ** 3)


def b3_slope_over_q(q: np.ndarray) -> np.ndarray:
    """Its slope over q, finite at 0."""
    return np.where(q < 1, -3 + 2.25 * q, -0.75 * np.clip(2 - q, 0, None) ** 2 / np.maximum(q, 1.0))


def classical(d: np.ndarray, h: float) -> np.ndarray:
    """(P, C, 2) gradients at nodes to their neighbours at d (P, C, 2), of which the first is the node itself: classical
    SPH in differences, times the matrix that makes them exact for linear fields."""
    g = -b3_slope_over_q(np.linalg.norm(d, axis=2) / h)[:, :, None] * d
    exact = np.linalg.inv(np.einsum("pca,pcb->pab", d, g))
    g = np.einsum("pca,pab->pcb", g, exact)
    g[:, 0] = -g[:, 1:].sum(axis=1)
    return g


def least_squares(d: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
    """(P, C) values and (P, C, 2) gradients of moving least squares of order 1 (numerics/mls.py, in NumPy)."""
    q = np.linalg.norm(d, axis=2) / h
    w = b3(q)
    slope = -b3_slope_over_q(q)[:, :, None] * d / h**2  # of w, to the place of the point
    p = np.concatenate([np.ones_like(d[:, :, :1]), d], axis=2)
    A = np.einsum("pc,pck,pcl->pkl", w, p, p)
    inverse = np.linalg.inv(A)
    c = inverse[:, 0]
    cp = np.einsum("pk,pck->pc", c, p)
    g = np.empty_like(d)
    for a in range(2):
        moved = np.zeros(3)
        moved[1 + a] = -1.0  # of p, when the point moves and its neighbour does not
        A_a = np.einsum("pc,pck,pcl->pkl", slope[:, :, a], p, p) + np.einsum("pc,k,pcl->pkl", w, moved, p)
        A_a += np.einsum("pc,pck,l->pkl", w, p, moved)
        c_a = -np.einsum("pkl,plm,pm->pk", inverse, A_a, c)
        g[:, :, a] = slope[:, :, a] * cp + w * (np.einsum("pk,pck->pc", c_a, p) + np.einsum("pk,k->p", c, moved)[:, None])
    return w * cp, g


class Lattice:
    """n x n nodes, periodic, that stand for the endless lattice. u (n*n, 2); stresses at one or two points a node."""

    def __init__(
        self,
        kernel: str,
        layout: str,
        stretch: float,
        support: float = SUPPORT,
        poisson: float = POISSON,
        n: int | None = None,
    ):
        self.kernel, self.h = kernel, support
        self.at_nodes = layout == "nodes"
        self.F0 = np.diag([stretch, 1.0])
        self.H = plane_stress(1.0, poisson)
        scale = np.diag(self.F0) if kernel == "Eulerian" else np.ones(2)  # the kernel is in the present or in the reference
        reach = np.ceil(2 * support / scale + 0.7).astype(int)
        self.n = n or int(4 * reach.max() + 1)  # two reaches each way: nothing comes round
        i, j = (k.ravel() for k in np.meshgrid(*(np.arange(-r, r + 1) for r in reach), indexing="ij"))
        first = np.argsort(i**2 + j**2, kind="stable")  # the node itself leads
        offsets = np.stack([i, j], axis=1)[first]
        ix, iy = (k.ravel() for k in np.meshgrid(np.arange(self.n), np.arange(self.n), indexing="ij"))
        index, rest, volume = [], [], []
        for x, y, share in LAYOUTS[layout]:
            index.append(((ix[:, None] + offsets[:, 0]) % self.n) * self.n + (iy[:, None] + offsets[:, 1]) % self.n)
            rest.append(np.broadcast_to((offsets - [x, y]) * scale, (self.n**2, len(offsets), 2)))
            volume.append(np.full(self.n**2, share))
        self.index, self.rest, self.volume = np.concatenate(index), np.concatenate(rest), np.concatenate(volume)
        self.values, self.reference = self._gradients(self.rest)

    def _gradients(self, d: np.ndarray) -> tuple[np.ndarray | None, np.ndarray]:
        return (None, classical(d, self.h)) if self.at_nodes else least_squares(d, self.h)

    def gradients(self, u: np.ndarray) -> np.ndarray:
        """(P, C, 2), where the nodes have moved by u."""
        if self.kernel == "Lagrangian":
            return self.reference
        near = u[self.index]
        own = near[:, 0] if self.values is None else np.einsum("pc,pca->pa", self.values, near)
        return self._gradients(self.rest + near - own[:, None])[1]

    def turned(self, F: np.ndarray, du: np.ndarray, g: np.ndarray) -> np.ndarray:
        """F at the points after the nodes move on by du."""
        slope = np.einsum("pca,pcb->pab", du[self.index], g)
        return F + (slope if self.kernel == "Lagrangian" else slope @ F)

    def force(self, F: np.ndarray, g: np.ndarray) -> np.ndarray:
        """(n*n, 2) on the nodes."""
        C = 0.5 * (np.einsum("pka,pkb->pab", F, F) - np.eye(2))
        e = np.stack([C[:, 0, 0], C[:, 1, 1], 2 * C[:, 0, 1]], axis=1) @ self.H
        S = np.stack([e[:, [0, 2]], e[:, [2, 1]]], axis=1)
        stress = F @ S if self.kernel == "Lagrangian" else F @ S @ F.transpose(0, 2, 1)
        pull = -self.volume[:, None, None] * np.einsum("pab,pcb->pca", stress, g)
        f = np.zeros((self.n**2, 2))
        for a in range(2):
            f[:, a] = np.bincount(self.index.ravel(), pull[:, :, a].ravel(), minlength=self.n**2)
        return f

    def at_rest(self) -> np.ndarray:
        """F at the points of the stretched lattice."""
        return np.broadcast_to(self.F0, (len(self.index), 2, 2)).copy()

    def response(self) -> tuple[np.ndarray, np.ndarray]:
        """R (n*n, 2) and - df(R)/du(0) (n*n, 2, 2) of the moved node 0."""
        K = np.empty((self.n**2, 2, 2))
        for a in range(2):
            f = []
            for sign in (1, -1):
                u = np.zeros((self.n**2, 2))
                u[0, a] = sign * SMALL
                f.append(self.force(self.turned(self.at_rest(), u, self.reference), self.gradients(u)))
            K[:, :, a] = -(f[0] - f[1]) / (2 * SMALL)
        ix, iy = np.divmod(np.arange(self.n**2), self.n)
        half = self.n // 2
        return np.stack([(ix + half) % self.n - half, (iy + half) % self.n - half], axis=1).astype(float), K


def running(
    formulation: str, cells: str, stretches: Sequence[float] | np.ndarray, support: float = SUPPORT, poisson: float = POISSON
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """stretch -> (R, K) as of Lattice.response, of the running kernels: a node moved in the middle of a stretched plate."""
    from .. import runtime
    from ..scene import Material, Numerics, Plate, Scene, Shell
    from ..world.world import World

    n, young, thickness = 16, 210e9, 0.1  # forces over E e are those of a lattice where both are 1
    plate = Shell(
        name="plate", surface=Plate(length=n, width=n), thickness=thickness, motion="in_plane",
        material=Material(name="steel", young=young, poisson=poisson, density=7800),
    )  # fmt: skip
    numerics = Numerics(spacing=1.0, cells=cells, formulation={"kind": formulation, "support": support})
    sim = World(Scene(name="lattice", title="Lattice", source="", shells=[plate], duration=1.0, numerics=numerics), threads=1)
    nodes, X = sim.shell.nodes, sim.shell.mesh.points[:, :2]
    middle = int(np.argmin(np.linalg.norm(X - 0.5 * n, axis=1)))
    kinds = (middle, middle + 1)  # diagonals that alternate make two kinds of nodes: the mean is what one wave in both feels
    for stretch in stretches:
        K = np.empty((len(kinds), nodes.n, 2, 2))
        for m, moved in enumerate(kinds):
            for a in range(2):
                f = []
                for sign in (1, -1):
                    u = X * [stretch - 1, 0]
                    u[moved, a] += sign * SMALL
                    runtime.put(nodes.u, u)
                    sim.shell.internal.strain(0.0)
                    sim.shell.internal.force()
                    f.append(runtime.get(nodes.force, nodes.n))
                K[m, :, :, a] = -(f[0] - f[1]) / (2 * SMALL * young * thickness * len(kinds))
        yield np.concatenate([X - X[moved] for moved in kinds]), np.concatenate(K)


def symbol(R: np.ndarray, K: np.ndarray, k: np.ndarray) -> np.ndarray:
    """K(k) (Q, 2, 2) of waves k (Q, 2)."""
    return np.einsum("qr,rab->qab", np.exp(-1j * (k @ R.T)), K)


def squares(R: np.ndarray, K: np.ndarray, k: np.ndarray) -> np.ndarray:
    """(Q, 2) omega^2, complex, of waves k (Q, 2)."""
    return np.linalg.eigvals(symbol(R, K, k))


def continuum(stretch: float, k: np.ndarray, poisson: float = POISSON) -> np.ndarray:
    """(Q, 2) omega^2 of the continuum: k_b k_d (S_bd I + F_ik H_kbld F_jl), linear about the stretched state."""
    F, H = np.diag([stretch, 1.0]), plane_stress(1.0, poisson)
    S = H @ [0.5 * (stretch**2 - 1), 0.0, 0.0]
    A = np.zeros((len(k), 3, 2))  # E_11, E_22, 2 E_12 of a wave along k
    A[:, 0, 0], A[:, 1, 1], A[:, 2, 0], A[:, 2, 1] = k[:, 0], k[:, 1], k[:, 1], k[:, 0]
    A = A @ F.T
    K = np.einsum("qma,mn,qnb->qab", A, H, A)
    K += (S[0] * k[:, 0] ** 2 + S[1] * k[:, 1] ** 2)[:, None, None] * np.eye(2)
    return np.linalg.eigvalsh(K)


def least_stretch(poisson: float = POISSON) -> float:
    """Below it the continuum itself gives way (its law is no longer elliptic) along one of DIRECTIONS."""
    low, high = 0.1, 1.0
    while high - low > 1e-6:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if continuum(middle, DIRECTIONS, poisson).min() < 0 else (low, middle)
    return high


@dataclass(frozen=True)
class Domain:
    """worst (stretches, waves): the least omega^2 / (G k^2) over the directions and both polarisations, 1 for the shear wave
    at rest; of a complex omega^2 the real part less the imaginary one. waves: the largest component of k over pi."""

    name: str
    stretches: np.ndarray
    waves: np.ndarray
    worst: np.ndarray = field(repr=False)


def domain(
    name: str,
    responses: Iterable[tuple[np.ndarray, np.ndarray]],
    stretches: Sequence[float] | np.ndarray,
    waves: Sequence[float] | np.ndarray,
    poisson: float = POISSON,
) -> Domain:
    """The stability domain of a form: responses yields (R, K) for each stretch."""
    G = 0.5 / (1 + poisson)
    k = math.pi * np.asarray(waves)[None, :, None] * DIRECTIONS[:, None, :]
    flat, worst = k.reshape(-1, 2), []
    for R, K in responses:
        found = squares(R, K, flat)
        least = (found.real - np.abs(found.imag)).min(axis=1) / (G * np.einsum("qa,qa->q", flat, flat))
        worst.append(least.reshape(len(DIRECTIONS), -1).min(axis=0))
    return Domain(name, np.asarray(stretches), np.asarray(waves), np.array(worst))


def domains(stretches: Sequence[float] | np.ndarray, waves: Sequence[float] | np.ndarray) -> list[Domain]:
    """All forms: kernel by layout, then the package's own."""
    found = [
        domain(f"{kernel} kernel, {NAMES[layout]}", (Lattice(kernel, layout, s).response() for s in stretches), stretches, waves)
        for kernel in KERNELS
        for layout in LAYOUTS
    ]
    for formulation, cells in (("galerkin", "quad"), ("galerkin", "triangle"), ("collocation", "quad")):
        found.append(domain(f"here: {formulation}, {cells}", running(formulation, cells, stretches), stretches, waves))
    return found
