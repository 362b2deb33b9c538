"""A stress point of a solid, driven along paths of deformation: one cube whose eight nodes are put where F says."""

from __future__ import annotations

from typing import Any

import numpy as np

from taichi_sph import runtime
from taichi_sph.bodies.solid.forces import gather, strain
from taichi_sph.scene import Brick

from ..solids import group_of, solid_scene, start


class Point:
    """A unit cube of a material. `time` [s] of the step taken so far; `work` [J] that the stress has done, by the trapezoidal rule."""

    def __init__(self, material: dict[str, Any], **solid: Any):
        world = start(solid_scene(Brick(size=(1, 1, 1)), material, spacing=1.0, duration=100.0, solid=solid))
        self.group = group_of(world)
        self.X = self.group.mesh.points
        self.F, self.P, self.time, self.work = np.eye(3), np.zeros((3, 3)), 0.0, 0.0
        self.ahead, self.slope = 0.0, 2.0 * material["young"]

    def _forces(self, F: np.ndarray, dt: float) -> np.ndarray:
        g = self.group
        runtime.put(g.nodes.u, self.X @ (F - np.eye(3)).T)
        strain(g.cells, g.nodes, g.material, 1, dt, self.time)
        gather(g.cells, g.nodes, 8)
        return -np.einsum("ki,kj->ij", runtime.get(g.nodes.force, 8), self.X)

    def go(self, F: np.ndarray, dt: float) -> np.ndarray:
        """A step to F; returns Cauchy's stress [Pa]."""
        P = self._forces(F, dt)
        self.work += 0.5 * float(((self.P + P) * (F - self.F)).sum())
        self.F, self.P, self.time = F, P, self.time + dt
        return P @ F.T / np.linalg.det(F)

    def cauchy(self, F: np.ndarray) -> np.ndarray:
        """What the stress would be there; the history stays."""
        return self._forces(F, 0.0) @ F.T / np.linalg.det(F)

    def pull(self, stretch: float, dt: float, lateral: float = 0.0) -> np.ndarray:
        """A step of uniaxial stress to that stretch along x, under a lateral stress [Pa]."""
        a = self.F[1, 1] + self.ahead
        before = None
        for _ in range(30):
            at = self.cauchy(np.diag([stretch, a, a]))[1, 1] - lateral
            if before is not None and at != before[1]:
                self.slope = (at - before[1]) / (a - before[0])
            change = -at / self.slope
            if abs(change) < 1e-11:
                break
            before, a = (a, at), a + change
        self.ahead = a - self.F[1, 1]
        return self.go(np.diag([stretch, a, a]), dt)

    def read(self, name: str) -> float:
        """A field of the cell."""
        return float(runtime.get(getattr(self.group.cells, name), 1)[0])

    @property
    def kept(self) -> float:
        """Energy [J] that is stored and taken."""
        cells = self.group.cells
        return sum(self.read(name) for name in ("stored", "lost", "dissipated", "damped", "released") if hasattr(cells, name))
