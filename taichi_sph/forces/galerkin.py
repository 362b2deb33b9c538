"""Internal forces of the shell, galerkin form: the exact transpose of the strain operator.

    edge mean       u_e   = sum_j Phi_ej u_j              Phi_e: mean of order-2 MLS over the edge (2 Gauss points)
    cell gradient   u_,a  = 1/A sum_e nl_a u_e            nl: outward normal times length of the cell's side
    stress          n^a   = stress.resultants(u_,a)
    edge force      f_e   = -sum_s nl_a n^a               over the one or two cells s that the edge bounds
    node force      f_i   = sum_e Phi_ei f_e

Neighbouring cells share their edge means, so the internal forces of a constant stress cancel to rounding
wherever the nodes are (patch test), forces and moments sum to zero, and free edges are natural.

What the cells cannot see is held by one residual per node, against its own order-2 fit:

    r_i = u_i - sum_j Phi_j(X_i) u_j,     energy 1/2 k_i |r_i|^2,     k_i = gamma K e A_i / D_i^2 (1 - D_r around i)

K = E / (1 - nu^2). Quadratic fields feel nothing, and it too derives from an energy. Edges and residuals are
rows of the same sparse operator, so the step gathers twice over the nodes and never scatters.
"""

import numpy as np

from .. import runtime
from ..model.links import Links
from ..model.mesh import SurfaceMesh, tangent_frames
from ..model.pools import Cells, MaterialPool, Nodes
from ..runtime import ti
from .stress import resultants

GAUSS = 0.5 / np.sqrt(3.0)


@ti.data_oriented
class Galerkin:
    """The term. `force` overwrites nodes.force; `links` are touched by rupture."""

    def __init__(self, mesh: SurfaceMesh, nodes: Nodes, cells: Cells, material: MaterialPool, settings):
        self.nodes, self.cells, self.material = nodes, cells, material
        edges = mesh.edges
        self.n_edges = len(edges.nodes)
        a, b = mesh.points[edges.nodes[:, 0]], mesh.points[edges.nodes[:, 1]]
        middle, half = 0.5 * (a + b), GAUSS * (b - a)
        points = np.concatenate(
            [np.stack([middle - half, middle + half], axis=1), np.repeat(mesh.points[:, None], 2, axis=1)]
        )
        normals = np.concatenate(
            [mesh.node_normals[edges.nodes[:, 0]] + mesh.node_normals[edges.nodes[:, 1]], mesh.node_normals]
        )
        n = nodes.n
        local = mesh.node_spacing
        spacing = np.concatenate([0.5 * (local[edges.nodes[:, 0]] + local[edges.nodes[:, 1]]), local])
        self.rows = Links(
            "galerkin",
            sources=nodes.X,
            n_sources=n,
            dead_source=nodes.fragment,
            points=points,
            n_points=np.r_[np.full(self.n_edges, 2), np.full(n, 1)],
            frames=tangent_frames(normals / np.linalg.norm(normals, axis=1)[:, None]),
            h=settings.support * spacing,
            order=np.full(self.n_edges + n, 2),
            residual_of=np.r_[np.full(self.n_edges, -1), np.arange(n)],
            transposed=True,
        )
        self.links = (self.rows,)
        self.edge_u = runtime.new("edges.u", self.n_edges, nodes.dim)  # m, mean displacement
        self.row_force = runtime.new("galerkin.row_force", self.n_edges + n, nodes.dim)  # N
        self.side_force = runtime.new("cells.side_force", 4 * cells.n, nodes.dim)  # N
        self.side = runtime.new("cells.side", 4 * cells.n, 2)  # m, nl in the cell's frame
        runtime.put(self.side, _sides(mesh))
        self.stiffness = runtime.new("galerkin.k", n)  # N/m, k_i of sound material
        self.integrity = runtime.new("galerkin.integrity", n)  # 1 - D_r around the node
        self.residual = runtime.new("galerkin.residual", n)  # J, energy of the residuals
        self.residual_lost = runtime.new("galerkin.residual_lost", n)  # J, taken from it by damage
        K = material.young[0] / (1.0 - material.poisson[0] ** 2)
        runtime.put(
            self.stiffness, settings.stabilisation * K * material.thickness[0] * mesh.node_areas / local**2
        )
        runtime.put(self.integrity, np.ones(n))
        self.rows.renew_all()

    def strain(self, dt: float, intact: int = 0) -> None:
        """Edge means, residual forces, stresses and side forces; advances damage over dt."""
        _row_values(self, self.n_edges, self.rows.n, intact)
        _cell_forces(self, self.cells.n, dt, intact)

    def force(self) -> None:
        """Node forces of what `strain` found."""
        _edge_forces(self, self.n_edges)
        _node_forces(self, self.nodes.n)

    def restrain(self, links: Links, n_touched: int) -> None:
        """After the touched rows were renewed: their values, and the stress of the cells they bound."""
        _row_values_touched(self, self.n_edges, n_touched)
        _break_blind(self.rows, self.cells, self.n_edges, n_touched)
        _cell_forces_touched(self, n_touched, self.n_edges)

    def drop(self, n_new: int) -> None:
        """The cells on the list `new` pull no more."""
        _drop(self, n_new)

    def stored(self, reducer) -> float:
        """Energy in the residuals [J]."""
        return reducer.total(self.residual, self.nodes.n)

    def lost(self, reducer) -> float:
        """What damage took from the residuals [J]."""
        return reducer.total(self.residual_lost, self.nodes.n) if self.material.damages else 0.0

    def state(self) -> dict[str, np.ndarray]:
        n = self.nodes.n
        return {
            "galerkin.integrity": runtime.get(self.integrity, n),
            "galerkin.residual_lost": runtime.get(self.residual_lost, n),
            **self.rows.state(),
        }

    def restore(self, state: dict[str, np.ndarray]) -> None:
        runtime.put(self.integrity, state["galerkin.integrity"])
        runtime.put(self.residual_lost, state["galerkin.residual_lost"])
        self.rows.restore(state)


def _sides(mesh: SurfaceMesh) -> np.ndarray:
    """(4 M, 2) outward normal times length of every side, in the frame of its cell; 0 where there is none."""
    last = mesh.corners[:, None] - 1
    k = np.arange(4)[None, :]
    following = np.take_along_axis(mesh.cells, np.where(k == last, 0, np.minimum(k + 1, 3)), axis=1)
    along = mesh.points[following] - mesh.points[mesh.cells]
    t1, t2 = mesh.frames[:, 0], mesh.frames[:, 1]
    normal = np.stack([np.einsum("mki,mi->mk", along, t2), -np.einsum("mki,mi->mk", along, t1)], axis=2)
    return np.where((k <= last)[:, :, None], normal, 0.0).reshape(-1, 2)


@ti.func
def _row_sum(rows: ti.template(), u: ti.template(), r):
    """sum_j coef_rj u_j."""
    total = u[0] * 0.0
    for k in range(rows.start[r], rows.start[r + 1]):
        total += rows.coef[k] * u[rows.source[k]]
    return total


@ti.func
def _residual(term: ti.template(), i, r, intact, charge):
    """Residual force of node i, whose stiffness follows the damage of the cells around it."""
    rest = _row_sum(term.rows, term.nodes.u, r)
    k = term.stiffness[i]
    kept = k
    if ti.static(term.material.damages):
        if intact == 0:
            before = term.integrity[i]
            first, end = term.cells.start_of_node[i], term.cells.start_of_node[i + 1]
            after = before * 0.0
            for m in range(first, end):
                s = term.cells.of_node[m]
                if term.cells.broken[s] == 0:
                    after += 1.0 - term.cells.delayed[s]
            after /= ti.max(end - first, 1)
            if after < before:
                term.integrity[i] = after
                if charge == 1:
                    term.residual_lost[i] += 0.5 * k * (before - after) * rest.dot(rest)
            kept = k * after
    if intact == 0:
        term.residual[i] = 0.5 * kept * rest.dot(rest)
    term.row_force[r] = -kept * rest


@ti.kernel
def _row_values(term: ti.template(), n_edges: ti.i32, n_rows: ti.i32, intact: ti.i32):
    for r in range(n_rows):
        if r < n_edges:
            term.edge_u[r] = _row_sum(term.rows, term.nodes.u, r)
        else:
            _residual(term, r - n_edges, r, intact, 1)


@ti.func
def _cell(term: ti.template(), s, dt, intact, tally):
    """Gradient, stress and side forces of cell s."""
    u1 = term.edge_u[0] * 0.0
    u2 = u1
    n = term.cells.n_corners[s]
    area = term.cells.volume[s] / term.material.thickness[0]
    for k in range(n):
        mean = term.edge_u[term.cells.edge[s][k]]
        nl = term.side[4 * s + k]
        u1 += nl[0] * mean
        u2 += nl[1] * mean
    n1, n2 = resultants(term.cells, term.material, s, u1 / area, u2 / area, dt, intact, tally)
    for k in range(n):
        nl = term.side[4 * s + k]
        term.side_force[4 * s + k] = -(nl[0] * n1 + nl[1] * n2)


@ti.kernel
def _cell_forces(term: ti.template(), n: ti.i32, dt: float, intact: ti.i32):
    for s in range(n):
        if term.cells.broken[s] == 0:
            _cell(term, s, dt, intact, 1)


@ti.kernel
def _edge_forces(term: ti.template(), n_edges: ti.i32):
    for r in range(n_edges):
        total = term.row_force[r] * 0.0
        for k in ti.static(range(2)):
            side = term.cells.sides[r][k]
            if side >= 0:
                total += term.side_force[side]
        term.row_force[r] = total


@ti.kernel
def _node_forces(term: ti.template(), n: ti.i32):
    for i in range(n):
        total = term.nodes.force[i] * 0.0
        for k in range(term.rows.t_start[i], term.rows.t_start[i + 1]):
            total += term.rows.t_coef[k] * term.row_force[term.rows.t_row[k]]
        term.nodes.force[i] = total


@ti.kernel
def _row_values_touched(term: ti.template(), n_edges: ti.i32, n_touched: ti.i32):
    for m in range(n_touched):
        r = term.rows.touched[m]
        if r < n_edges:
            term.edge_u[r] = _row_sum(term.rows, term.nodes.u, r)
        else:
            _residual(term, r - n_edges, r, 0, 0)


@ti.kernel
def _cell_forces_touched(term: ti.template(), n_touched: ti.i32, n_edges: ti.i32):
    # a cell with several touched sides is computed once for each, with the same result
    for m in range(n_touched):
        r = term.rows.touched[m]
        if r < n_edges:
            for k in range(2):
                side = term.cells.sides[r][k]
                if side >= 0:
                    s = side // 4
                    if term.cells.broken[s] == 0:
                        _cell(term, s, 0.0, 0, 0)


@ti.kernel
def _drop(term: ti.template(), n_new: ti.i32):
    for m in range(n_new):
        for k in range(4):
            term.side_force[4 * term.cells.new[m] + k] *= 0.0


@ti.kernel
def _break_blind(rows: ti.template(), cells: ti.template(), n_edges: ti.i32, n_touched: ti.i32):
    """A cell one of whose edges sees no node any more breaks too (T 2.3.6.3)."""
    for m in range(n_touched):
        r = rows.touched[m]
        if r < n_edges and rows.alive[r] == 0:
            for k in range(2):
                side = cells.sides[r][k]
                if side >= 0 and cells.broken[side // 4] == 0:
                    if ti.atomic_max(cells.broken[side // 4], 1) == 0:
                        cells.new[ti.atomic_add(cells.n_new[0], 1)] = side // 4
