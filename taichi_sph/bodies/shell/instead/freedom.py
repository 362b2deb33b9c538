"""What nodes of shells may do: the unknowns of equilibrium, and what a form says of its stiffness."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from .... import runtime

if TYPE_CHECKING:
    from ..group import ShellGroup

LEAN = 1e-6  # sine below which a turn about an axis does nothing to a director


@dataclass
class Freedom:
    """What the nodes may do now: basis (N, c, f) of their moves (u, then d), axes (N, 3, f - dim) of the turns, (N, f) numbers of the
    unknowns, -1 where there is none."""

    basis: np.ndarray
    axes: np.ndarray
    number: np.ndarray

    @property
    def size(self) -> int:
        """Unknowns."""
        return int(self.number.max(initial=-1)) + 1

    def gather(self, of_nodes: np.ndarray) -> np.ndarray:
        """(N, f) -> (size,)."""
        return of_nodes[self.number >= 0]

    def spread(self, unknowns: np.ndarray) -> np.ndarray:
        """(size,) -> (N, f), 0 where there is none."""
        return np.where(self.number >= 0, unknowns[np.maximum(self.number, 0)], 0.0)


class Stiffness(Protocol):
    """The tangent of a form, as Newton's method asks for it. u and d (N, dim): displacements and changes of the directors.

    width: components of a node (u, then d); elimination (N,): nodes in the order in which a factorisation takes them. The stresses that the
    geometric part takes are the form's own affair.
    """

    width: int
    elimination: np.ndarray

    def stresses(self, u: np.ndarray, d: np.ndarray) -> Any:
        """Those of a place."""

    def foreseen(self, u: np.ndarray, d: np.ndarray, du: np.ndarray, dd: np.ndarray) -> Any:
        """Those of a place plus their slope along a step."""

    def matrix(self, u: np.ndarray, d: np.ndarray, stresses: Any, pressures: np.ndarray, free: Freedom, moments: np.ndarray | None) -> Any:
        """(size, size) sparse derivative of the forces on the unknowns, loads among them, with its sign turned."""

    def pressed(self, u: np.ndarray, following: np.ndarray, dead: np.ndarray) -> np.ndarray:
        """(N, 3) forces [N] of pressures (M,) [Pa] on the cells."""


def freedom(group: ShellGroup, director: np.ndarray) -> Freedom:
    """Of the nodes of a group, whose directors are (N, 3). A turn about the director itself is none (bodies.nodal.loads.undrilled)."""
    nodes, n, dim = group.nodes, group.nodes.n, group.nodes.dim
    held, spins = np.zeros((n, dim), bool), np.zeros((n, 3), bool)
    if group.loads.moves:
        fixed = runtime.get(nodes.fixed, n)
        some = fixed > 0
        held[some] = runtime.get(group.loads.mask, int(fixed.max(initial=1)))[fixed[some] - 1] > 0
        if nodes.bends:
            spins[some] = runtime.get(group.loads.spin_mask, int(fixed.max(initial=1)))[fixed[some] - 1] > 0
    turns = 2 if nodes.bends else 0
    c = dim + 3 if nodes.bends else dim
    basis = np.zeros((n, c, dim + turns))
    basis[:, range(dim), range(dim)] = ~held
    axes = np.zeros((n, 3, turns))
    if turns:
        first, second = _across(director)
        axes[:, :, 0], axes[:, :, 1] = first, second
        for i in np.flatnonzero(spins.any(axis=1)):
            axes[i] = _turns(director[i], ~spins[i])
        moved = np.cross(axes, director[:, :, None], axis=1)
        size = np.linalg.norm(moved, axis=1)
        there = size > LEAN
        scale = np.where(there, 1.0 / np.maximum(size, LEAN), 0.0)[:, None, :]
        axes = axes * scale
        basis[:, dim:, dim:] = moved * scale
    present = np.abs(basis).max(axis=1) > 0.0
    number = np.where(present, np.cumsum(present.ravel()).reshape(present.shape) - 1, -1)
    return Freedom(basis, axes, number)


def _across(n: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors across each of the directors (N, 3)."""
    least = np.argmin(np.abs(n), axis=1)
    first = np.cross(n, np.eye(3)[least])
    first /= np.linalg.norm(first, axis=1)[:, None]
    return first, np.cross(n, first)


def _turns(n: np.ndarray, free: np.ndarray) -> np.ndarray:
    """(3, 2) axes about which a director n turns, of the axes that are free; 0 where there is none."""
    axes = np.zeros((3, 2))
    if free.sum() == 2:
        held = np.eye(3)[np.argmin(free)]
        along = np.where(free, n, 0.0)
        if along @ n > 1e-6:  # the other one would turn it about itself
            axes[:, 0] = np.cross(held, n) / np.linalg.norm(np.cross(held, n))
        else:
            axes[:, :] = np.eye(3)[free].T
    elif free.sum() == 1:
        axes[:, 0] = np.eye(3)[np.argmax(free)]
    return axes


def elimination(incidence: Any) -> np.ndarray:
    """(N,) nodes in the order in which a factorisation takes them: least degree first, of the graph of nodes that share a row of the
    sparse (R, N) incidence, whose entries are not negative."""
    import scipy.sparse as sparse
    from scipy.sparse.linalg import splu

    n = incidence.shape[1]
    graph = sparse.csc_array(incidence.T @ incidence)
    graph.data[:] = -1.0
    graph = graph + sparse.diags_array(np.full(n, 2.0 * n), format="csc")
    return np.argsort(splu(sparse.csc_matrix(graph), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).perm_c)


def turning(n: np.ndarray, pull: np.ndarray, free: Freedom, moments: np.ndarray | None) -> np.ndarray:
    """(N, 2, 2) what directors n (N, 3) of length one add to a tangent; pull (N, 3): dE/dd [N m]; moments (N, 3) [N m]: dead ones."""
    axes = free.axes.transpose(0, 2, 1)
    along, pulled = np.einsum("nai,ni->na", axes, n), np.einsum("nai,ni->na", axes, pull)
    cross = along[:, :, None] * pulled[:, None, :]
    found = 0.5 * (cross + cross.transpose(0, 2, 1)) - (axes @ axes.transpose(0, 2, 1)) * np.einsum("ni,ni->n", n, pull)[:, None, None]
    if moments is not None:
        moved = free.basis[:, 3:, 3:].transpose(0, 2, 1)
        drill = np.einsum("ni,ni->n", moments, np.cross(moved[:, 1], moved[:, 0]))
        found[:, 0, 1] -= drill
        found[:, 1, 0] += drill
    return found
