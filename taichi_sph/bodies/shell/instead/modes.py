"""Natural modes about the reference: the lowest eigenpairs of M^-1/2 K M^-1/2, read off the running force kernels.

Nodes farther apart than twice the reach of a node's force do not share a row of K: they are displaced together, so
the whole sparse matrix takes some hundred force evaluations whatever the number of nodes. What motions hold is left
out; a director has the two turns across itself, less what a held spin takes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .... import runtime
from ....pool import Pool
from ..stable_dt import Operator

if TYPE_CHECKING:
    from ...body import Clocked
    from ..group import ShellGroup

STILL = 1e-3  # a mode is rigid when its frequency is below this part of the next one's
SHOWN = 0.1  # largest displacement of a mode's picture, over the size of the body


class ModeSearch(Pool):
    """Steps through the flexible modes of a simulation, lowest first: each becomes its displacements.

    frequency (count,) [Hz], modes (count, N, 6) mass-normalised, rigid: how many modes are still.
    """

    kept = ("shown",)

    def __init__(self, world: Clocked, group: ShellGroup, count: int):
        super().__init__("modes")
        self.world, self.group, self.count, self.shown, self.work = world, group, count, -1, 0.0
        self.frequency, self.modes, self.rigid = lowest(group, count)

    def settle(self, time: float) -> None:
        """Show the next mode."""
        group = self.group
        self.shown = min(self.shown + 1, self.count - 1)
        self.world.step += 1
        shape = self.modes[self.shown]
        size = float(np.ptp(group.mesh.points, axis=0).max())
        scale = SHOWN * size / max(np.linalg.norm(shape[:, :3], axis=1).max(), 1e-300)
        n, dim = group.nodes.n, group.nodes.dim
        runtime.put(group.nodes.u, (scale * shape[:, :dim]).astype(runtime.get(group.nodes.u, n).dtype))
        if group.nodes.bends:
            N = runtime.get(group.nodes.N, n)
            director = N + scale * shape[:, 3:]
            director /= np.linalg.norm(director, axis=1)[:, None]
            runtime.put(group.nodes.d, (director - N).astype(N.dtype))

    def pools(self) -> list[Pool]:
        """All that has history."""
        return [self]

    def status(self) -> dict[str, float]:
        return {
            "mode": self.shown + 1,
            "frequency": float(self.frequency[max(self.shown, 0)]),
            "rigid_modes": self.rigid,
        }

    units = {"frequency": "Hz"}
    rule = "one natural mode a step"


def free_directions(group: ShellGroup) -> np.ndarray:
    """(N, c, f) orthonormal directions in which each node may move, of its c unknowns (u, then d); zero columns
    where a motion or the director leaves none."""
    nodes, n, dim = group.nodes, group.nodes.n, group.nodes.dim
    c = dim + 3 if nodes.bends else dim
    free = np.zeros((n, c, c))
    free[:, range(dim), range(dim)] = 1.0
    fixed = runtime.get(nodes.fixed, n)
    if group.loads.moves:
        mask = runtime.get(group.loads.mask, int(fixed.max(initial=0)))
        held = fixed > 0
        keep = np.ones((int(held.sum()), c))
        keep[:, :dim] -= mask[fixed[held] - 1]
        free[held] *= keep[:, None, :]
    if nodes.bends:
        N = runtime.get(nodes.N, n).astype(np.float64)
        axes = np.tile(np.eye(3), (n, 1, 1))
        if group.loads.moves:
            spin = runtime.get(group.loads.spin_mask, int(fixed.max(initial=0)))
            axes[held] *= 1.0 - spin[fixed[held] - 1].astype(float)[:, :, None]
        turned = np.cross(axes, N[:, None, :]).transpose(0, 2, 1)  # columns: what a turn about an axis does to N
        vectors, size, _ = np.linalg.svd(turned)
        free[:, 3:, 3:] = vectors * (size > 1e-6)[:, None, :]
    return free


def stiffness(group: ShellGroup) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray]:
    """Sparse M^-1/2 K M^-1/2 (free unknowns) [1/s2], the (N, c, f) directions of its unknowns with the number of each,
    -1 where there is none, and the (N, c) roots of the masses."""
    import scipy.sparse
    from scipy.spatial import cKDTree

    operator = Operator(group)
    X = group.mesh.points
    reach = group.internal.reach
    tree = cKDTree(X)
    colour = _colours(tree, X, 2.0 * reach)
    free = free_directions(group)
    n, c, f = free.shape
    present = np.abs(free).max(axis=1) > 0.5
    number = np.where(present, np.cumsum(present.ravel()).reshape(present.shape) - 1, -1)
    rows, columns, values = [], [], []
    for k in range(colour.max() + 1):
        chosen = np.flatnonzero(colour == k)
        _, owner = cKDTree(X[chosen]).query(X)
        owner = chosen[owner]
        near = np.linalg.norm(X - X[owner], axis=1) <= reach
        for direction in range(f):
            y = np.zeros(operator.shape)
            y[chosen] = free[chosen, :, direction]
            if not y.any():
                continue
            out = 0.5 * (operator(y) - operator(-y))  # what is of second order cancels
            out = np.einsum("ncf,nc->nf", free, out)
            i, g = np.nonzero(present & near[:, None] & present[owner, direction][:, None])
            rows.append(number[i, g])
            columns.append(number[owner[i], direction])
            values.append(out[i, g])
    operator.close()
    size = int(present.sum())
    where = (np.concatenate(rows), np.concatenate(columns))
    A = scipy.sparse.csc_array((np.concatenate(values), where), shape=(size, size))
    return A, free, number, operator.root


def _colours(tree: Any, X: np.ndarray, apart: float) -> np.ndarray:
    """(N,) numbers such that nodes of the same one are more than `apart` from each other."""
    colour = np.full(len(X), -1)
    for i in range(len(X)):
        taken = colour[tree.query_ball_point(X[i], apart)]
        used = np.zeros(len(taken) + 1, bool)
        used[taken[(taken >= 0) & (taken <= len(taken))]] = True
        colour[i] = int(np.argmin(used))
    return colour


def lowest(group: ShellGroup, count: int) -> tuple[np.ndarray, np.ndarray, int]:
    """Frequencies [Hz] (count,) of the lowest flexible modes, their shapes (count, N, 6), the number of rigid ones."""
    import scipy.sparse
    from scipy.sparse.linalg import eigsh

    A, free, number, root = stiffness(group)
    A = 0.5 * (A + A.T)  # but for rounding it is symmetric
    wanted = min(count + 6, A.shape[0] - 2)
    # a shift beside zero, which may be an eigenvalue: far below the lowest flexible one, far above rounding
    shift = -1e-9 * float(A.diagonal().max())
    start = np.random.default_rng(0).standard_normal(A.shape[0])
    values, vectors = eigsh(scipy.sparse.csc_matrix(A), k=wanted, sigma=shift, which="LM", v0=start)
    order = np.argsort(values)
    values, vectors = np.maximum(values[order], 0.0), vectors[:, order]
    omega = np.sqrt(values)
    rigid = 0
    for k in range(min(6, wanted - 1), 0, -1):
        if omega[k - 1] < STILL * omega[k]:
            rigid = k
            break
    chosen = slice(rigid, rigid + count)
    n, c, f = free.shape
    shapes = []
    for vector in vectors[:, chosen].T:
        entries = np.where(number >= 0, vector[np.maximum(number, 0)], 0.0)
        shape = np.einsum("ncf,nf->nc", free, entries) / root
        shapes.append(np.hstack([shape[:, : group.nodes.dim], np.zeros((n, 3 - group.nodes.dim)), shape[:, group.nodes.dim :]]))
    return omega[chosen] / (2.0 * np.pi), np.array(shapes), rigid
