"""The pool of a surface's nodes: mass and motion. Every kind of shell made of nodes has it.

`dim` is the number of displacement components: 2 for a surface that stays in its plane, 3 for a solid, and for a surface that bends
(`bends`), which also has a director at each node. Both are constants of the run, so the same kernels serve all, and a scene without
bending allocates and compiles nothing of it.
"""

from typing import Any

import numpy as np

from ... import runtime
from ...pool import Pool
from ...runtime import ti


@ti.func
def body_of(pool: ti.template(), i):
    """Number of the body that row i of a pool of nodes or cells belongs to; nothing is read where there is one."""
    b = 0
    if ti.static(pool.several):
        b = pool.body[i]
    return b


class Nodes(Pool):
    """Shell nodes: mass and motion."""

    def __init__(
        self,
        mesh: Any,
        mass: np.ndarray,
        inertia: np.ndarray | None = None,
        body: np.ndarray | None = None,
        name: str = "nodes",
        dim: int = 2,
    ):
        """mass (N,) [kg]; inertia (N,) [kg m2] of the director, None for nodes without a director; body (N,) number of the
        body, None where there is one; dim: of nodes without a director, components of their displacements."""
        super().__init__(name)
        self.n = n = len(mesh.points)
        body = np.zeros(n, np.int32) if body is None else body.astype(np.int32)
        self.several = bool(body.any())
        self.bends = inertia is not None
        self.dim = dim = 3 if self.bends else dim
        half = "at the half step before (T 2.31)"
        self.X = self.field("X", n, 3, "f64", unit="m", doc="reference position")
        self.body = self.field("body", n, dtype="i32", doc="number of its body in the group")
        self.mass = self.field("mass", n, unit="kg", doc="mass")
        self.u = self.field("u", n, dim, unit="m", doc="displacement", keeps=True)
        self.v = self.field("v", n, dim, unit="m/s", doc=f"velocity {half}", keeps=True, shown="velocity")
        self.force = self.field("force", n, dim, unit="N", doc="sum of the terms")
        self.kinetic = self.field("kinetic", n, unit="J", doc="kinetic energy of the last step", keeps=True)
        self.fragment = self.field("fragment", n, dtype="i32", doc="1: no live cell around it", keeps=True, shown="fragment")
        self.fixed = self.field("fixed", n, dtype="i32", doc="number of its prescribed motion + 1, 0: free")
        runtime.put(self.X, mesh.points)
        runtime.put(self.mass, mass)
        if self.several:
            runtime.put(self.body, body)
        if inertia is not None:
            self.N = self.field("N", n, 3, doc="reference director, unit")
            self.d = self.field("d", n, 3, doc="director now minus N", keeps=True)
            self.omega = self.field("omega", n, 3, unit="rad/s", doc=f"spin, across the director, {half}", keeps=True)
            self.couple = self.field("couple", n, 3, unit="N m", doc="force on the director")
            self.inertia = self.field("inertia", n, unit="kg m2", doc="rotary inertia")
            runtime.put(self.N, mesh.node_normals)
            runtime.put(self.inertia, inertia)
