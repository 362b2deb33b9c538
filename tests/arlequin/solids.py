"""Small solids of elements with particles in them, and what holds them in equilibrium."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from taichi_sph import runtime
from taichi_sph.scene import Box, Brick, SolidPatch

from ..solids import shaken, solid_scene

BAR = Brick(size=(8, 3, 3)), (Box(lo=(5, None, None)),)
INSIDE = Brick(size=(5, 5, 5)), (Box(lo=(2, 2, 2), hi=(3, 3, 3)),)


def patched(shape: Any = BAR[0], where: Any = BAR[1], n: int = 2, **more: Any) -> Any:
    """A Scene of elements 1 m wide, n particles along each; `patch`: more keys of the patch."""
    patch = SolidPatch(**{"where": where, "spacing": 1.0 / n} | more.pop("patch", {}))
    solid = {"patch": patch} | more.pop("solid", {})
    return solid_scene(shape, more.pop("material", None), 1.0, more.pop("duration", 1.0), solid=solid, **more)


def skew(n: tuple[int, int, int], by: float = 0.2) -> Any:
    """A brick of cubes 1 m wide whose inner nodes are moved at random, then sheared and stretched: no cell is a parallelepiped."""
    made = shaken(n, tuple(map(float, n)), by)
    points = np.asarray(made.points) @ np.array([[1.0, 0.0, 0.0], [0.3, 1.1, 0.0], [0.1, -0.2, 0.9]])
    return made.model_copy(update={"points": tuple(map(tuple, points.tolist()))})


def forces(group: Any, u: np.ndarray) -> np.ndarray:
    """(N, 3) internal forces [N] of a group at displacements u (N, 3) [m]."""
    from taichi_sph.bodies.solid.forces import gather, strain

    runtime.put(group.nodes.u, u)
    strain(group.cells, group.nodes, group.material, group.cells.n, 0.0, 0.0)
    gather(group.cells, group.nodes, group.nodes.n)
    return runtime.get(group.nodes.force, group.nodes.n)


def stiffness(group: Any, size: float = 1e-6) -> sp.csc_array:
    """(3 N, 3 N) K, column by column."""
    n = group.nodes.n
    K = np.empty((3 * n, 3 * n))
    for k in range(3 * n):
        u = np.zeros(3 * n)
        u[k] = size
        K[:, k] = -(forces(group, u.reshape(n, 3)) - forces(group, -u.reshape(n, 3))).ravel() / (2 * size)
    return sp.csc_array(np.where(np.abs(K) > 1e-13 * np.abs(K).max(), K, 0.0))


def answer(coupling: Any, held: tuple[np.ndarray, np.ndarray], wanted: tuple[np.ndarray, np.ndarray]) -> list[np.ndarray]:
    """[(N, 3) displacements of the elements, of the particles] in equilibrium, with the nodes `held` of each at what is wanted of it."""
    rows = coupling.factor.rows
    K = sp.csr_array(sp.block_diag([stiffness(group) for group in coupling.groups], format="csr"))
    C = sp.csr_array(sp.kron(sp.hstack([rows.elements, -1.0 * rows.particles]), sp.eye_array(3), format="csr"))
    first = 3 * coupling.elements.nodes.n
    y = np.concatenate([u.ravel() for u in wanted])
    fixed = np.concatenate([(3 * i[:, None] + np.arange(3)).ravel() + at for i, at in zip(held, (0, first))]).astype(int)
    free = np.setdiff1d(np.arange(len(y)), fixed)
    K, C = K / abs(K.diagonal()).max(), C / abs(C.data).max()
    known = np.zeros_like(y)
    known[fixed] = y[fixed]
    system = sp.block_array([[K[free][:, free], C[:, free].T], [C[:, free], None]], format="csc")
    found = splu(system).solve(np.concatenate([-(K @ known)[free], -(C @ known)]))
    known[free] = found[: len(free)]
    return [known[:first].reshape(-1, 3), known[first:].reshape(-1, 3)]


def gradients(group: Any, u: np.ndarray) -> np.ndarray:
    """(cells, 3, 3) mean gradients of displacements u (N, 3)."""
    cells = group.cells
    first = runtime.get(cells.first, cells.n + 1)
    node, B = (runtime.get(field, first[-1]) for field in (cells.node, cells.B))
    return np.add.reduceat(u[node][:, :, None] * B[:, None, :], first[:-1], axis=0)
