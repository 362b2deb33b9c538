"""The surface of shells for water: every node is a point, with the vector area of its sound cells as they lie now.

A shell of elements with particles in it is two surfaces in one place where the two overlap. Each cell there has the share of its area that
it has of energy and mass, 1 - alpha and alpha (parts.py). So water meets the shell once, and loads each part by what that counts, as a
pressure of the scene does.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import runtime
from ...geometry.mesh import SurfaceMesh
from ...pool import Pool
from ...runtime import ti
from ..wettable import SurfacePoints

if TYPE_CHECKING:
    from .group import ShellGroup


class ShellPoints(Pool):
    """Points of shells that stand one after the other in their group; water may stand on both sides of them."""

    thin = True

    def __init__(self, name: str, group: "ShellGroup", shells: Sequence[Any]):
        super().__init__(name)
        self.nodes, self.cells, mesh = group.nodes, group.cells, group.mesh
        self.begin, self.n = shells[0].nodes.first, sum(body.nodes.n for body in shells)
        half = np.concatenate([0.5 * body.thickness for body in shells])
        self.halves = np.unique(half).tolist()
        self.half_of = self.field("half_of", self.n, dtype="f64", unit="m", doc="half the thickness at a point")
        self.turn = self.field(
            "turn",
            self.cells.n,
            dtype="f64",
            doc="1: corners of a cell of the group are numbered round the director, -1: against it; times what it counts",
        )
        runtime.put(self.half_of, half)
        runtime.put(self.turn, _turns(mesh) * _counted(group))
        own = slice(self.begin, self.begin + self.n)
        free = ~group.held()[own]
        areas = mesh.node_areas if group.shells[0].split is None else group.shells[0].node_areas  # a part stands alone in its group
        weights = runtime.get(self.nodes.mass, self.nodes.n)[own] / areas[own]
        self.lightest = float(weights[free].min(initial=np.inf))

    def pools(self) -> Sequence[Pool]:
        return [self]

    def lay(self, points: SurfacePoints, first: int, since: float) -> None:
        _lay(points, self, first, self.begin, self.n, since)

    def bear(self, points: SurfacePoints, first: int, times: int) -> None:
        if times:
            _bear(points, self.nodes, first, self.begin, self.n, times)


def _turns(mesh: SurfaceMesh) -> np.ndarray:
    x, c = mesh.points, mesh.cells
    last = np.where(c[:, 3] < 0, c[:, 0], c[:, 3])
    area = np.cross(x[c[:, 2]] - x[c[:, 0]], x[last] - x[c[:, 1]])
    return np.where((area * mesh.node_normals[c[:, 0]]).sum(axis=1) < 0, -1.0, 1.0)


def _counted(group: "ShellGroup") -> np.ndarray:
    """(M,) what the cells of a group count: 1, less where elements and particles overlap."""
    each = [(body.cells.n, body.weights) for body in group.shells]
    return np.concatenate([np.ones(n) if of is None else of.reshape(n, -1).mean(axis=1) for n, of in each])


@ti.func
def place(nodes: ti.template(), i):
    """Where node i is [m], f64."""
    return nodes.X[i] + ti.cast(nodes.u[i], ti.f64)


@ti.kernel
def _lay(points: ti.template(), shell: ti.template(), first: ti.i32, begin: ti.i32, n: ti.i32, since: ti.f64):
    for k in range(n):
        i = begin + k
        a = ti.Vector([0.0, 0.0, 0.0], ti.f64)
        for m in range(shell.cells.start_of_node[i], shell.cells.start_of_node[i + 1]):
            s = shell.cells.of_node[m]
            if shell.cells.broken[s] == 0:
                last = shell.cells.n_corners[s] - 1
                # half the cross product of the diagonals; of a triangle the second one is a side
                one = place(shell.nodes, shell.cells.corner[s][2]) - place(shell.nodes, shell.cells.corner[s][0])
                two = place(shell.nodes, shell.cells.corner[s][3 if last == 3 else 0]) - place(shell.nodes, shell.cells.corner[s][1])
                a += 0.5 * shell.turn[s] / (last + 1.0) * one.cross(two)
        points.note(first + k, place(shell.nodes, i), a, ti.cast(shell.nodes.v[i], ti.f64), shell.half_of[k], 1, since)


@ti.kernel
def _bear(points: ti.template(), nodes: ti.template(), first: ti.i32, begin: ti.i32, n: ti.i32, times: ti.i32):
    for k in range(n):
        nodes.force[begin + k] += times * points.push[first + k]
