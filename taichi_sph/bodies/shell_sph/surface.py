"""The surface of shells for water: every node is a point, with the vector area of its sound cells as they lie now."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ... import runtime
from ...geometry.mesh import SurfaceMesh
from ...pool import Pool
from ...runtime import ti
from ..wettable import SurfacePoints

if TYPE_CHECKING:
    from .group import ShellGroup


class ShellPoints(Pool):
    """Points of a group of shells; water may stand on both sides of them."""

    thin = True

    def __init__(self, name: str, group: "ShellGroup", meets: Callable[[str], bool]):
        super().__init__(name)
        self.nodes, self.cells, mesh = group.nodes, group.cells, group.mesh
        self.n = n = self.nodes.n
        half, met = np.zeros(n), np.zeros(n, bool)
        for body in group.shells:
            own = slice(body.nodes.first, body.nodes.first + body.nodes.n)
            half[own], met[own] = 0.5 * body.said.thickness, meets(body.name)
        self.halves = np.unique(half).tolist()
        self.half_of = self.field("half_of", n, dtype="f64", unit="m", doc="half the thickness at a node")
        self.turn = self.field(
            "turn",
            self.cells.n,
            dtype="f64",
            doc="1: corners are numbered round the director, -1: against it; 0: of a body that is not met",
        )
        runtime.put(self.half_of, half)
        runtime.put(self.turn, _turns(mesh) * met[mesh.cells[:, 0]])
        free = ~group.held() & met
        self.lightest = float((runtime.get(self.nodes.mass, n)[free] / mesh.node_areas[free]).min(initial=np.inf))

    def pools(self) -> Sequence[Pool]:
        return [self]

    def lay(self, points: SurfacePoints, first: int, since: float) -> None:
        _lay(points, self, first, self.n, since)

    def bear(self, points: SurfacePoints, first: int, times: int) -> None:
        if times:
            _bear(points, self.nodes, first, self.n, times)


def _turns(mesh: SurfaceMesh) -> np.ndarray:
    x, c = mesh.points, mesh.cells
    last = np.where(c[:, 3] < 0, c[:, 0], c[:, 3])
    area = np.cross(x[c[:, 2]] - x[c[:, 0]], x[last] - x[c[:, 1]])
    return np.where((area * mesh.node_normals[c[:, 0]]).sum(axis=1) < 0, -1.0, 1.0)


@ti.func
def place(nodes: ti.template(), i):
    """Where node i is [m], f64."""
    return nodes.X[i] + ti.cast(nodes.u[i], ti.f64)


@ti.kernel
def _lay(points: ti.template(), shell: ti.template(), first: ti.i32, n: ti.i32, since: ti.f64):
    for i in range(n):
        a = ti.Vector([0.0, 0.0, 0.0], ti.f64)
        for m in range(shell.cells.start_of_node[i], shell.cells.start_of_node[i + 1]):
            s = shell.cells.of_node[m]
            if shell.cells.broken[s] == 0:
                last = shell.cells.n_corners[s] - 1
                # half the cross product of the diagonals; of a triangle the second one is a side
                one = place(shell.nodes, shell.cells.corner[s][2]) - place(shell.nodes, shell.cells.corner[s][0])
                two = place(shell.nodes, shell.cells.corner[s][3 if last == 3 else 0]) - place(shell.nodes, shell.cells.corner[s][1])
                a += 0.5 * shell.turn[s] / (last + 1.0) * one.cross(two)
        points.note(first + i, place(shell.nodes, i), a, ti.cast(shell.nodes.v[i], ti.f64), shell.half_of[i], 1, since)


@ti.kernel
def _bear(points: ti.template(), nodes: ti.template(), first: ti.i32, n: ti.i32, times: ti.i32):
    for i in range(n):
        nodes.force[i] += times * points.push[first + i]
