"""Internal forces of the shell, galerkin form: the exact transpose of the strain operator.

    edge mean       u_e   = sum_j Phi_ej u_j              Phi_e: mean of order-2 MLS over the edge (2 Gauss points)
    cell gradient   u_,a  = sum_e g_ea u_e                Green's formula over the sides: g = normal x length / area
    cell mean       d_s   = sum_e w_e d_e                 w: share of the side's triangle with the centroid
    stress          stress.resultants -> n^a, m^a, q
    edge force      f_e   = -A sum_s g_ea n^a             over the one or two cells s that the edge bounds;
                            on the director -A sum_s (g_ea m^a + w_e q)
    node force      f_i   = sum_e Phi_ei f_e

Neighbouring cells share their edge means. Therefore the internal forces of a constant stress cancel to rounding wherever the nodes
are (patch test), forces and moments sum to zero, and free edges are natural.

**Residuals.** The cells do not see all modes of the nodes. A residual at each node holds the rest: the distance of the node from its
own order-2 fit in its tangent plane,

    r_i = u_i - sum_j Phi_j u_j - c_i d_i,    energy 1/2 (k_t |r|^2 + (k_n - k_t) (r . n)^2),
    k_t = gamma E e/(1-nu^2) A_i/D_i^2,  k_n = gamma G_s A_i/D_i^2,  both times (1 - D_r) around i.

The director d has a residual of the same form, with the bending stiffness. The fit does not meet a curved reference surface: c_i is
the part of the surface along N_i that the fit misses, and is zero where the surface is flat. The term c_i d_i turns with the director,
so a rigid motion has no residual. Near a corner between two walls the fit of the directors also misses a part t_i across N_i. This part
is written as a sum over nodes, t_i = sum_j b_ij X_j, and turns with the nodes: the residual of the director loses sum_j b_ij u_j.
Quadratic fields have no residual either. Edges and residuals are rows of one sparse operator: a step gathers twice and never scatters.

**Slip.** Around a metal the residual yields too. With q^2 = 2 x energy, force and energy are those of q = |r|_k - rho, 0 <= q <= q_y.
The slip rho grows while q stays at q_y = sqrt(k_t) D sigma_y (1 - nu^2) / E, the pull of a residual of one yield strain over one
spacing; rho follows |r|_k down when r shrinks. An elastic residual would store far more than the cells do wherever they have flowed.
The force stays along r, so momenta are kept. The work q_y d rho is booked as plastic.

**Shear.** The transverse shear of a thin shell is bounded, G_s = k G e / (1 + alpha (D/e)^2) with k = 5/6. The error is O(D^2), of the
order of the discretisation itself, and nothing changes where e > D (docs/method.md).
"""

from typing import Any

import numpy as np

from ... import runtime
from ...geometry.mesh import SurfaceMesh, tangent_frames
from ...numerics.reduce import Reducer
from ...pool import Pool
from ...runtime import ti
from ..shell.build import (
    Model,
    bounded_shear,
    by_node,
    cell_widths,
    longest_diagonal,
    quarters,
    spread_over_cells,
    spread_over_nodes,
    weighed,
)
from ..shell.stress import of_sound_cells, resultants
from .bearing import bearing
from .galerkin_reference import references, references_touched, shares, sides, turns, turns_touched
from .links import Links, Rows, Sources
from .slits import slits
from .spread import Spread, narrow
from .voids import voids

GAUSS = 0.5 / np.sqrt(3.0)
LOOK, STEP, JUMP = 0, 1, 2  # why residuals are evaluated: to see the forces, to go on in time, after a rupture


class Galerkin(Pool):
    """The term. `force` overwrites nodes.force (and nodes.couple); `links` are touched by rupture."""

    look_every = 100  # steps between two looks at the largest frequency while things break: ruptures barely raise it

    def __init__(self, model: Model, suffix: str = ""):
        name = f"galerkin{suffix}"
        super().__init__(name)
        mesh, bodies = model.mesh, model.bodies
        self.nodes, self.cells, self.material = nodes, cells, material = model.nodes, model.cells, model.material
        self.bends = nodes.bends
        self.answer = _cell  # of a cell to its strains
        edges = mesh.edges
        self.n_edges = len(edges.nodes)
        a, b = mesh.points[edges.nodes[:, 0]], mesh.points[edges.nodes[:, 1]]
        middle, half = 0.5 * (a + b), GAUSS * (b - a)
        points = np.concatenate([np.stack([middle - half, middle + half], axis=1), np.repeat(mesh.points[:, None], 2, axis=1)])
        normals = np.concatenate([mesh.node_normals[edges.nodes[:, 0]] + mesh.node_normals[edges.nodes[:, 1]], mesh.node_normals])
        n = nodes.n
        local = mesh.node_spacing
        spacing = np.concatenate([0.5 * (local[edges.nodes[:, 0]] + local[edges.nodes[:, 1]]), local])
        forms: list[Any] = [body.numerics.formulation for body in bodies]
        self.reach = 4.0 * forms[0].support * float(mesh.node_spacing.max()) + longest_diagonal(mesh)
        support = by_node(bodies, [form.support for form in forms])
        body_of_row = by_node(bodies, np.arange(len(bodies)))
        first_ends = edges.nodes[:, 0]
        self.rows = Links(
            f"{name}.rows",
            Sources(nodes.X, n, nodes.fragment, nodes.body if nodes.several else None),
            Rows(
                points=points,
                n_points=np.r_[np.full(self.n_edges, 2), np.full(n, 1)],
                frames=tangent_frames(normals / np.linalg.norm(normals, axis=1)[:, None]),
                h=np.concatenate([support[first_ends], support]) * spacing,
                order=2,
                body=np.concatenate([body_of_row[first_ends], body_of_row]),
                residual_of=np.r_[np.full(self.n_edges, -1), np.arange(n)],
            ),
            transposed=True,
        )
        self.links = (self.rows,)
        self.edge_u = self.field("edge_u", self.n_edges, nodes.dim, unit="m", doc="mean displacement of an edge")
        self.row_force = self.field("row_force", self.n_edges + n, nodes.dim, unit="N", doc="force of an edge, or of a residual")
        self.side_force = self.field("side_force", 4 * cells.n, nodes.dim, unit="N", doc="what a cell pulls its sides with")
        self.side = self.field("side", 4 * cells.n, 2, unit="1/m", doc="g: gradient coefficients of the sides")
        self.stiffness = self.field("stiffness", n, unit="N/m", doc="k_t of sound material")
        self.integrity = self.field("integrity", n, doc="1 - D_r around the node", keeps=True)
        self.residual = self.field("residual", n, unit="J", doc="energy of the residuals", keeps=True)
        self.residual_lost = self.field("residual_lost", n, unit="J", doc="taken from the residuals by damage", keeps=True)
        constants = list(zip(*(material.numbers(key) for key in ("thickness", "young", "poisson"))))
        membrane = spread_over_nodes(bodies, [young * e / (1.0 - nu**2) for e, young, nu in constants])
        scale = by_node(bodies, [form.stabilisation for form in forms]) * quarters(bodies) / local**2
        runtime.put(self.stiffness, membrane * scale)
        runtime.put(self.integrity, np.ones(n))
        if material.yields:
            self.slip = self.field("slip", n, 4, doc="sqrt(J) for u and for d: q now, and the slip rho", keeps=True)
            self.slipped = self.field("slipped", n, dtype="f64", unit="J", doc="taken from the residuals by slip", keeps=True)
            self.reach = self.field("reach", n, doc="sqrt(J)/Pa, q_y over sigma_y")
            across = spread_over_nodes(bodies, [1.0 - nu**2 for _, _, nu in constants])
            runtime.put(
                self.reach, np.sqrt(membrane * scale) * local * across / spread_over_nodes(bodies, [young for _, young, _ in constants])
            )
        if self.bends:
            self.edge_d = self.field("edge_d", self.n_edges, 3, doc="mean director change of an edge")
            self.row_couple = self.field("row_couple", self.n_edges + n, 3, unit="N m", doc="as row_force, on directors")
            self.side_couple = self.field("side_couple", 4 * cells.n, 3, unit="N m", doc="as side_force, on directors")
            self.share = self.field("share", 4 * cells.n, doc="w: weights of the sides in the cell's mean")
            self.bears = self.field("bears", 4 * cells.n, doc="b: shares of the sides in pressure and mass")
            self.own_couple = self.field("own_couple", n, 3, unit="N m", doc="of a residual on its own director")
            self.stiffness_n = self.field("stiffness_n", n, unit="N/m", doc="k_n of sound material")
            self.stiffness_d = self.field("stiffness_d", n, unit="N m", doc="that of directors")
            self.left = self.field("left", n, unit="m", doc="c_i: what the fit leaves of the surface")
            self.left_d = self.field("left_d", n, doc="the same of the field of directors")
            self.across = self.field("across", n, dtype="f64", doc="|t_i|")
            self.side0 = self.field("side0", 4 * cells.n, 2, unit="1/m", doc="g before it is made orthonormal")
            self.area0 = self.field("area0", cells.n, unit="m2", doc="area before the tangents are made orthonormal")
            runtime.put(cells.shear, bounded_shear(bodies, spread_over_cells, constants, cell_widths(bodies, mesh)))
            runtime.put(self.stiffness_n, bounded_shear(bodies, spread_over_nodes, constants, local, scale))
            runtime.put(self.stiffness_d, scale * membrane * spread_over_nodes(bodies, [e**2 for e, _, _ in constants]) / 12.0)
        of_nodes = runtime.get(nodes.body, n) if nodes.several else None
        longest = float((2.0 * support * local).max())
        lips = slits(mesh, of_nodes)
        for hiding in (lips, voids(mesh, longest, of_nodes)):
            if hiding is not None:
                seen = np.concatenate([points[: self.n_edges] + hiding.edge_moves[:, None], np.repeat(hiding.nodes[:, None], 2, axis=1)])
                hiding.hide(self.rows, seen, hiding.nodes)
        self.rows.renew_all()
        self._reference(mesh, weighed(bodies, mesh.areas))
        self.spread: Spread | None = None
        if narrow(model).any():
            material.spreads = True
            cells.spread()
            self.spread = Spread(f"spread{suffix}", model, lips)

    def _reference(self, mesh: SurfaceMesh, areas: np.ndarray) -> None:
        """Tangents, areas, directors and side coefficients of the reference, by the operator itself. areas (M,): of the cells, weighed."""
        gradients, _ = sides(mesh)
        runtime.put(self.side, gradients.reshape(-1, 2))
        runtime.put(self.cells.area, areas)
        self.turns = False
        if not self.bends:
            runtime.put(self.cells.a1, np.ascontiguousarray(mesh.frames[:, 0, :2]))
            runtime.put(self.cells.a2, np.ascontiguousarray(mesh.frames[:, 1, :2]))
            return
        runtime.put(self.side0, gradients.reshape(-1, 2))
        runtime.put(self.area0, areas)
        runtime.put(self.share, shares(mesh).reshape(-1))
        runtime.put(self.bears, bearing(mesh).reshape(-1))
        references(self, self.n_edges, self.cells.n, self.nodes.n)
        # only where two walls meet, or on surfaces of no simple shape, do the directors leave something across
        rounding = 1e-10 if runtime.current().real == ti.f64 else 1e-5
        if runtime.get(self.across, self.nodes.n).max() > rounding:
            self.turns = True
            self.turn = self.field("turn", self.rows.pairs, unit="1/m", doc="b_ij")
            self.t_turn = self.field("t_turn", self.rows.pairs, unit="1/m", doc="b_ij of the transposed pairs")
            turns(self, self.n_edges, self.nodes.n)

    def areas(self, mesh: SurfaceMesh, of_cells: np.ndarray | None = None, dead: np.ndarray | None = None) -> np.ndarray:
        """(N,) what a pressure of one, or of of_cells (M,), on all cells gives each node [m2] (bearing.py). Total and centre of each cell
        are kept, for the rows reproduce linear fields. dead (M,) bool: cells that are cut, and bear nothing."""
        import scipy.sparse

        there = mesh.edges.cell_edges >= 0
        areas = mesh.areas if of_cells is None else mesh.areas * of_cells
        areas = areas if dead is None else np.where(dead, 0.0, areas)
        of_sides = (areas[:, None] * bearing(mesh, dead))[there]
        of_edges = np.bincount(mesh.edges.cell_edges[there], of_sides, minlength=self.n_edges)
        coef, source = (runtime.get(field, self.rows.pairs) for field in (self.rows.coef, self.rows.source))
        start = runtime.get(self.rows.start, self.rows.n + 1)
        rows = scipy.sparse.csr_array((coef.astype(np.float64), source, start), shape=(self.rows.n, self.nodes.n))
        return rows[: self.n_edges].T @ of_edges

    def strain(self, dt: float, intact: int = 0) -> None:
        """Edge means, residual forces, stresses and side forces; advances history over dt, and leaves it as it is if dt = 0."""
        _row_values(self, self.n_edges, self.rows.n, intact, STEP if dt > 0.0 else LOOK)
        if self.spread is not None and dt > 0.0:
            self.spread.gather()
        of_sound_cells(self, self.cells.n, dt, intact)

    def force(self) -> None:
        """Node forces of what `strain` found."""
        _edge_forces(self, self.n_edges)
        _node_forces(self, self.nodes.n)

    def drop(self, n_new: int) -> None:
        """The cells on the list `new` pull no more, and no neck sees through them."""
        _drop(self, n_new)
        if self.spread is not None:
            self.spread.open(n_new)

    def restrain(self, links: Links, n_touched: int) -> None:
        """After the touched rows were renewed: their reference, their values, the stress of the cells they bound."""
        if self.bends:
            references_touched(self, n_touched, self.n_edges)
            if self.turns:
                turns_touched(self, n_touched, self.n_edges)
        _row_values_touched(self, self.n_edges, n_touched)
        _break_blind(self.rows, self.cells, self.n_edges, n_touched)
        _cell_forces_touched(self, n_touched, self.n_edges)

    def stored(self, reducer: Reducer) -> float:
        """Energy in the residuals [J]."""
        return reducer.total(self.residual, self.nodes.n)

    def lost(self, reducer: Reducer) -> float:
        """What damage took from the residuals [J]."""
        return reducer.total(self.residual_lost, self.nodes.n) if self.material.damages else 0.0

    def dissipated(self, reducer: Reducer) -> float:
        """What plastic flow took from the residuals [J]."""
        return reducer.total(self.slipped, self.nodes.n) if self.material.yields else 0.0

    def pools(self) -> tuple[Pool, ...]:
        """All that has fields, rows first: the reference follows from them."""
        return (self.rows, self) if self.spread is None else (self.rows, self, self.spread.rows, self.spread)

    def renew(self) -> None:
        """The reference follows from the rows."""
        if self.bends:
            references(self, self.n_edges, self.cells.n, self.nodes.n)
            if self.turns:
                turns(self, self.n_edges, self.nodes.n)


@ti.func
def _row_sums(term: ti.template(), r):
    """sum_j coef_rj u_j, and the same of d where there are directors."""
    u = term.nodes.u[0] * 0.0
    d = u
    for k in range(term.rows.start[r], term.rows.start[r + 1]):
        c = term.rows.coef[k]
        j = term.rows.source[k]
        u += c * term.nodes.u[j]
        if ti.static(term.bends):
            d += c * term.nodes.d[j]
    return u, d


@ti.func
def _slip(term: ti.template(), i, norm, norm_d, why):
    """(force over elastic force, the same of the director, energy [J]) of the residual of node i, whose elastic energy
    would be 1/2 (norm^2 + norm_d^2). After a rupture it jumps, and the force is kept."""
    limit, alive = norm * 0.0, 0
    for m in range(term.cells.start_of_node[i], term.cells.start_of_node[i + 1]):
        s = term.cells.of_node[m]
        if term.cells.broken[s] == 0:
            limit += term.cells.limit[s]
            alive += 1
    limit *= term.reach[i] / ti.max(alive, 1)
    before = term.slip[i]
    after = before
    factor = ti.Vector([0.0 * norm, 0.0 * norm])
    norms = ti.Vector([norm, norm_d])
    energy = norm * 0.0
    taken = norm * 0.0
    for c in ti.static(range(2)):
        q = ti.min(ti.max(norms[c] - before[2 + c], 0.0), limit)
        if why == JUMP:
            q = ti.min(before[c], norms[c])
        after[c], after[2 + c] = q, norms[c] - q
        energy += 0.5 * q * q
        taken += 0.5 * (before[c] + q) * (after[2 + c] - before[2 + c])
        if norms[c] > 0.0:
            factor[c] = q / norms[c]
    if why == STEP:
        term.slipped[i] += term.integrity[i] * taken
    if why != LOOK:
        term.slip[i] = after
    return factor[0], factor[1], energy


@ti.func
def _residual(term: ti.template(), i, r, intact, why):
    """Residual forces of node i, whose stiffness follows the damage of the cells around it."""
    rest, rest_d = _row_sums(term, r)
    k = term.stiffness[i]
    pull = k * rest
    pull_d = rest_d
    own, own_d = rest_d * 0.0, rest_d * 0.0
    if ti.static(term.bends):
        d = term.nodes.d[i]
        n = term.nodes.N[i] + d
        c, c_d = term.left[i], term.left_d[i]
        rest -= c * d
        rest_d -= c_d * d
        if ti.static(term.turns):
            for p in range(term.rows.start[r], term.rows.start[r + 1]):
                rest_d -= term.turn[p] * term.nodes.u[term.rows.source[p]]
        across = (term.stiffness_n[i] - k) * rest.dot(n)
        pull = k * rest + across * n
        pull_d = term.stiffness_d[i] * rest_d
        own, own_d = c * pull - across * rest, c_d * pull_d
    twice, twice_d = rest.dot(pull), k * 0.0
    if ti.static(term.bends):
        twice_d = rest_d.dot(pull_d)
    energy = 0.5 * (twice + twice_d)
    if ti.static(term.material.yields):
        if intact == 0:
            f, f_d, left = _slip(term, i, ti.sqrt(twice), ti.sqrt(twice_d), why)
            energy = left
            pull *= f
            own *= f
            pull_d *= f_d
            own_d *= f_d
    kept = energy * 0.0 + 1.0
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
            if after < before and why != LOOK:
                term.integrity[i] = after
                if why == STEP:
                    term.residual_lost[i] += (before - after) * energy
            kept = after
    if intact == 0:
        if ti.static(term.material.remembers):
            if why != LOOK:
                term.residual[i] = kept * energy
        else:
            term.residual[i] = kept * energy
    term.row_force[r] = -kept * pull
    if ti.static(term.bends):
        term.row_couple[r] = -kept * pull_d
        term.own_couple[i] = kept * (own + own_d)


@ti.func
def _row(term: ti.template(), r, n_edges, intact, why):
    if r < n_edges:
        u, d = _row_sums(term, r)
        term.edge_u[r] = u
        if ti.static(term.bends):
            term.edge_d[r] = d
    else:
        _residual(term, r - n_edges, r, intact, why)


@ti.kernel
def _row_values(term: ti.template(), n_edges: ti.i32, n_rows: ti.i32, intact: ti.i32, why: ti.i32):
    for r in range(n_rows):
        _row(term, r, n_edges, intact, why)


@ti.func
def _cell(term: ti.template(), s, dt, intact, tally):
    """Gradients, stress and side forces of cell s."""
    u1 = term.edge_u[0] * 0.0
    u2, d1, d2, d = u1, u1, u1, u1
    n = term.cells.n_corners[s]
    for k in range(n):
        edge = term.cells.edge[s][k]
        g = term.side[4 * s + k]
        mean = term.edge_u[edge]
        u1 += g[0] * mean
        u2 += g[1] * mean
        if ti.static(term.bends):
            turn = term.edge_d[edge]
            d1 += g[0] * turn
            d2 += g[1] * turn
            d += term.share[4 * s + k] * turn
    n1, n2, m1, m2, q = resultants(term.cells, term.material, s, (u1, u2, d1, d2, d), dt, intact, tally)
    area = term.cells.area[s]
    for k in range(n):
        g = area * term.side[4 * s + k]
        term.side_force[4 * s + k] = -(g[0] * n1 + g[1] * n2)
        if ti.static(term.bends):
            w = area * term.share[4 * s + k]
            term.side_couple[4 * s + k] = -(g[0] * m1 + g[1] * m2 + w * q)


@ti.kernel
def _edge_forces(term: ti.template(), n_edges: ti.i32):
    for r in range(n_edges):
        force = term.row_force[r] * 0.0
        couple = force
        for k in ti.static(range(2)):
            side = term.cells.sides[r][k]
            if side >= 0:
                force += term.side_force[side]
                if ti.static(term.bends):
                    couple += term.side_couple[side]
        term.row_force[r] = force
        if ti.static(term.bends):
            term.row_couple[r] = couple


@ti.kernel
def _node_forces(term: ti.template(), n: ti.i32):
    for i in range(n):
        force = term.nodes.force[i] * 0.0
        couple = force
        if ti.static(term.bends):
            couple += term.own_couple[i]
        for k in range(term.rows.t_start[i], term.rows.t_start[i + 1]):
            c = term.rows.t_coef[k]
            r = term.rows.t_row[k]
            force += c * term.row_force[r]
            if ti.static(term.bends):
                couple += c * term.row_couple[r]
                if ti.static(term.turns):
                    force -= term.t_turn[k] * term.row_couple[r]
        term.nodes.force[i] = force
        if ti.static(term.bends):
            term.nodes.couple[i] = couple


@ti.kernel
def _row_values_touched(term: ti.template(), n_edges: ti.i32, n_touched: ti.i32):
    for m in range(n_touched):
        _row(term, term.rows.touched[m], n_edges, 0, JUMP)


@ti.kernel
def _cell_forces_touched(term: ti.template(), n_touched: ti.i32, n_edges: ti.i32):
    # a cell with several touched sides is computed once for each, with the same result: dt = 0 damages nothing
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
            side = 4 * term.cells.new[m] + k
            term.side_force[side] *= 0.0
            if ti.static(term.bends):
                term.side_couple[side] *= 0.0


@ti.kernel
def _break_blind(rows: ti.template(), cells: ti.template(), n_edges: ti.i32, n_touched: ti.i32):
    """A cell one of whose edges sees no node any more breaks too (T 2.3.6.3)."""
    for m in range(n_touched):
        r = rows.touched[m]
        if r < n_edges and rows.alive[r] == 0:
            for k in ti.static(range(2)):
                side = cells.sides[r][k]
                if side >= 0 and cells.broken[side // 4] == 0:
                    if ti.atomic_max(cells.broken[side // 4], 1) == 0:
                        cells.new[ti.atomic_add(cells.n_new[0], 1)] = side // 4
