"""The linear answer of a shell to the loads of a scene, from the matrix of its running kernels: no relaxation."""

from __future__ import annotations

import numpy as np
import scipy.sparse
from scipy.sparse.linalg import spsolve

from taichi_sph import runtime
from taichi_sph.bodies.shell.instead.modes import stiffness
from taichi_sph.bodies.shell.pressure import LEAVE

from ..shells import start


def answer(scene, at) -> np.ndarray:
    """(3,) displacement [m] at the node nearest to a point of the reference."""
    sim = start(scene)
    group, n, dim = sim.shell, sim.shell.nodes.n, sim.shell.nodes.dim
    group.loads.update(scene.duration)
    group.internal.strain(0.0)
    if group.pressures is not None:
        group.pressures.press(scene.duration, LEAVE)
    group.internal.force()
    force = runtime.get(group.nodes.force, n)
    if group.loads.pushes:
        force = force + runtime.get(group.loads.force.total, n)
    A, free, number, root = stiffness(group)
    load = np.zeros_like(root)
    load[:, :dim] = force
    right = np.einsum("ncf,nc->nf", free, load / root)[number >= 0]
    found = spsolve(scipy.sparse.csc_matrix(0.5 * (A + A.T)), right)
    moved = np.einsum("ncf,nf->nc", free, np.where(number >= 0, found[np.maximum(number, 0)], 0.0)) / root
    i = int(np.argmin(np.linalg.norm(group.mesh.points - np.asarray(at), axis=1)))
    return np.pad(moved[i, :dim], (0, 3 - dim))
