"""Internal forces of finite elements: MITC4 and MITC3 shells, or plane stress where the shell stays in its plane. Total Lagrangian.

    slopes          u_,a = sum_k N_k,a u_k, d_,a alike              at each point of stress, along its own tangents (shapes.py)
    strains         E_ab, kappa_ab as in shell/stress.py;  gamma_a = sum_k tie_ak sigma_k, from the shears of the sides (MITC)
    stress          stress.answer: the laws know of no element
    corner force    f_k = -A (N_k,a n^a) + that of the sides,  n^a = N^ab x_,b + M^ab n_,b,  m^a = M^ab x_,b
    node force      the sum of its corners'

The forces are the exact derivatives of the energy. A quadrangle has four points or one; a triangle has one, for its slopes are constant.

**What one point leaves out** (shapes.py) is held by quadratic forms of six numbers q, the changes of the membrane strain, the curvature
and the shear over the element,

    E e (m_1^2 + m_2^2) A/2 + E e^3/12 (b_1^2 + b_2^2) A/2 + G_s (c_1^2 + c_2^2) A/2,    all times (1 - D_r),

which is what the material itself would store (physical stabilisation; Belytschko and Bindeman 1993 in the plane). No number is chosen.
In a metal q yields: the stress of its elastic part is kept within sqrt(3)/2 sigma_y, the value of a fully plastic hinge. A triangle holds
c_1 in the same way, which is exact for an elastic one.

A step computes each element once and gathers at the nodes; nothing is scattered.
"""

from typing import Any

import numpy as np

from ... import runtime
from ...numerics.reduce import Reducer
from ...pool import Pool
from ...runtime import ti
from ..shell.build import Model, bounded_shear, cell_widths, longest_diagonal, spread_over_cells, weighed
from ..shell.pool import sheet_of
from ..shell.stress import answer, of_sound_cells, shear_of
from .shapes import reference

HINGE = 0.5 * 3.0**0.5  # mean of sqrt(3) s over the stress sign(s) of a plastic hinge


class Elements(Pool):
    """Internal forces of finite elements: `strain` fills the forces of the corners, `force` overwrites nodes.force (and nodes.couple)."""

    look_every = 100  # steps between two looks at the largest frequency

    def __init__(self, model: Model, points: int, suffix: str = ""):
        super().__init__(f"elements{suffix}")
        mesh, bodies = model.mesh, model.bodies
        self.nodes, self.cells, self.points, self.material = model.nodes, model.cells, model.points, model.material
        self.bends, self.per_cell, self.reach = self.nodes.bends, points, longest_diagonal(mesh)
        self.answer = _element  # of an element to its strains
        m = self.cells.n
        at = reference(mesh, points)
        self.holds = bool(at.held.any())  # whether any element has a part that its points do not see
        dim = self.nodes.dim
        real = np.float64 if runtime.current().real == ti.f64 else np.float32
        corner = np.where(mesh.cells < 0, mesh.cells[:, :1], mesh.cells)
        X = mesh.points[corner][:, :, :dim]
        self.corner = self.field("corner", m, 4, "i32", doc="node numbers; of a triangle its first one again")
        self.slope_1 = self.field("slope_1", len(at.areas), 4, unit="1/m", doc="N_k,1 of the corners at a point")
        self.slope_2 = self.field("slope_2", len(at.areas), 4, unit="1/m", doc="N_k,2 of the corners at a point")
        self.corner_force = self.field("corner_force", 4 * m, dim, unit="N", doc="of an element on its corners")
        flat = mesh.cells.ravel()
        slot = np.flatnonzero(flat >= 0)
        self.slot = self.field("slot", len(slot), dtype="i32", doc="4 * element + corner of those around each node, as cells.of_node")
        runtime.put(self.corner, corner.astype(np.int32))
        runtime.put(self.slot, slot[np.argsort(flat[slot], kind="stable")].astype(np.int32))
        slopes = at.slopes.astype(real)
        runtime.put(self.slope_1, np.ascontiguousarray(slopes[:, 0]))
        runtime.put(self.slope_2, np.ascontiguousarray(slopes[:, 1]))
        runtime.put(self.points.area, weighed(bodies, at.areas))
        # of the rounded slopes, so that a rigid motion strains nothing
        each = np.repeat(X, points, axis=0)
        tangents = np.einsum("sak,ski->sai", slopes.astype(np.float64), each)
        runtime.put(self.points.a1, np.ascontiguousarray(tangents[:, 0]))
        runtime.put(self.points.a2, np.ascontiguousarray(tangents[:, 1]))
        if self.bends:
            self.tie_1 = self.field("tie_1", len(at.areas), 4, unit="1/m", doc="gamma_1 at a point over the shears of the sides")
            self.tie_2 = self.field("tie_2", len(at.areas), 4, unit="1/m", doc="gamma_2 at a point over the shears of the sides")
            self.corner_couple = self.field("corner_couple", 4 * m, 3, unit="N m", doc="of an element on the directors of its corners")
            runtime.put(self.tie_1, np.ascontiguousarray(at.ties[:, 0]))
            runtime.put(self.tie_2, np.ascontiguousarray(at.ties[:, 1]))
            N = mesh.node_normals[corner]
            directors = np.einsum("sak,ski->sai", slopes.astype(np.float64), np.repeat(N, points, axis=0))
            runtime.put(self.points.director, np.repeat(N.mean(axis=1), points, axis=0))
            runtime.put(self.points.director_1, np.ascontiguousarray(directors[:, 0]))
            runtime.put(self.points.director_2, np.ascontiguousarray(directors[:, 1]))
            constants = list(zip(*(self.material.numbers(key) for key in ("thickness", "young", "poisson"))))
            shear = bounded_shear(bodies, spread_over_cells, constants, cell_widths(bodies, mesh))
            runtime.put(self.points.shear, np.repeat(shear, points))
        if self.holds:
            at.held *= weighed(bodies, at.areas).reshape(m, -1).sum(axis=1) / at.areas.reshape(m, -1).sum(axis=1)
            self._hold(at, X, mesh.node_normals[corner], real)

    def _hold(self, at: Any, X: np.ndarray, N: np.ndarray, real: type) -> None:
        m, q = self.cells.n, 6 if self.bends else 2
        self.held = self.field("held", m, unit="m2", doc="area of an element that its points do not see whole, else 0")
        self.hourglass = self.field("hourglass", m, 4, doc="gamma_k: 1/4 of the signs, freed of linear fields")
        self.along = self.field("along", m, 4, unit="1/m", doc="rho_11, rho_12, rho_21, rho_22")
        self.held_energy = self.field("held_energy", m, unit="J", doc="of what the points do not see", keeps=True)
        hourglass = at.hourglass.astype(real)
        runtime.put(self.held, at.held)
        runtime.put(self.hourglass, hourglass)
        runtime.put(self.along, at.along.reshape(-1, 4))
        if self.bends:
            self.twist_1 = self.field("twist_1", m, 4, unit="1/m", doc="c_1 over the shears of the sides")
            self.twist_2 = self.field("twist_2", m, 4, unit="1/m", doc="c_2 over the shears of the sides")
            self.skew = self.field("skew", m, 3, unit="m", doc="sum gamma_k X_k: how far a quadrangle is warped")
            self.skew_N = self.field("skew_N", m, 3, doc="sum gamma_k N_k")
            runtime.put(self.twist_1, np.ascontiguousarray(at.twists[:, 0]))
            runtime.put(self.twist_2, np.ascontiguousarray(at.twists[:, 1]))
            runtime.put(self.skew, np.einsum("mk,mki->mi", hourglass.astype(np.float64), X))
            runtime.put(self.skew_N, np.einsum("mk,mki->mi", hourglass.astype(np.float64), N))
        if self.material.remembers:
            self.change = self.field("change", m, q, doc="q: changes of strain, curvature [1/m] and shear over the element", keeps=True)
            self.elastic = self.field("elastic", m, q, doc="the elastic part of q", keeps=True)
            self.intact = self.field("intact", m, doc="1 - D_r that q feels", keeps=True)
            self.held_lost = self.field("held_lost", m, dtype="f64", unit="J", doc="taken from it by damage", keeps=True)
            self.held_flow = self.field("held_flow", m, dtype="f64", unit="J", doc="taken from it by plastic flow", keeps=True)
            runtime.put(self.intact, np.ones(m))

    def strain(self, dt: float, intact: int = 0) -> None:
        """Strains, stresses and the forces of the corners; advances history over dt, and leaves it as it is if dt = 0. intact = 1 leaves
        damage and plastic flow out."""
        of_sound_cells(self, self.cells.n, dt, intact)

    def force(self) -> None:
        """Node forces of what `strain` found."""
        _gather(self, self.nodes.n)

    def stored(self, reducer: Reducer) -> float:
        """Energy that the points do not see [J]."""
        return reducer.total(self.held_energy, self.cells.n) if self.holds else 0.0

    def lost(self, reducer: Reducer) -> float:
        """What damage took of it [J]."""
        return reducer.total(self.held_lost, self.cells.n) if self.holds and self.material.damages else 0.0

    def dissipated(self, reducer: Reducer) -> float:
        """What plastic flow took of it [J]."""
        return reducer.total(self.held_flow, self.cells.n) if self.holds and self.material.yields else 0.0

    def pools(self) -> tuple[Pool, ...]:
        """All that has fields."""
        return (self,)


@ti.func
def _corners(values: ti.template(), corner: ti.template(), dim: ti.template()):
    """(4, dim) values at the corners."""
    return ti.Matrix([[values[corner[k]][c] for c in range(dim)] for k in range(4)])


@ti.func
def _sum(matrix: ti.template(), weights: ti.template()):
    """sum_k weights_k row_k."""
    return matrix.transpose() @ weights


@ti.func
def _side_shears(term: ti.template(), corner: ti.template(), U: ti.template(), D: ti.template()):
    """(4,) sigma of the sides [m]."""
    shears = ti.Vector([U[0, 0] * 0.0, 0.0, 0.0, 0.0])
    for k in ti.static(range(4)):
        i, j = corner[k], corner[(k + 1) % 4]
        across = ti.cast(term.nodes.X[j] - term.nodes.X[i], float)
        for c in ti.static(range(3)):
            turned = 0.5 * (D[k, c] + D[(k + 1) % 4, c])
            moved = U[(k + 1) % 4, c] - U[k, c]
            shears[k] += across[c] * turned + moved * (0.5 * (term.nodes.N[i][c] + term.nodes.N[j][c]) + turned)
    return shears


@ti.func
def _element(term: ti.template(), e, dt, intact, tally):
    """Forces of element e on its corners; its history after a step of dt (stress.answer)."""
    corner = term.corner[e]
    U = _corners(term.nodes.u, corner, ti.static(term.nodes.dim))
    F = U * 0.0
    D = F
    C = F
    shears = ti.Vector([U[0, 0] * 0.0, 0.0, 0.0, 0.0])
    pull = shears  # of the sides
    if ti.static(term.bends):
        D = _corners(term.nodes.d, corner, 3)
        shears = _side_shears(term, corner, U, D)
    for p in range(term.per_cell):
        s = term.per_cell * e + p
        area = term.points.area[s]
        if area > 0.0:
            h1, h2 = term.slope_1[s], term.slope_2[s]
            u1, u2 = _sum(U, h1), _sum(U, h2)
            a1, a2 = term.points.a1[s], term.points.a2[s]
            x1, x2 = a1 + u1, a2 + u2
            g = term.points.strain[s] * 0.0
            g[0] = a1.dot(u1) + 0.5 * u1.dot(u1)
            g[1] = a2.dot(u2) + 0.5 * u2.dot(u2)
            g[2] = a1.dot(u2) + a2.dot(u1) + u1.dot(u2)
            n_1, n_2 = u1, u2
            if ti.static(term.bends):
                d1, d2 = _sum(D, h1), _sum(D, h2)
                n_1, n_2 = term.points.director_1[s] + d1, term.points.director_2[s] + d2
                g[3] = a1.dot(d1) + u1.dot(n_1)
                g[4] = a2.dot(d2) + u2.dot(n_2)
                g[5] = a1.dot(d2) + u1.dot(n_2) + a2.dot(d1) + u2.dot(n_1)
                g[6] = term.tie_1[s].dot(shears)
                g[7] = term.tie_2[s].dot(shears)
            r = area * answer(term.points, term.material, s, g, dt, intact, tally)
            n1 = r[0] * x1 + r[2] * x2
            n2 = r[2] * x1 + r[1] * x2
            if ti.static(term.bends):
                n1 += r[3] * n_1 + r[5] * n_2
                n2 += r[5] * n_1 + r[4] * n_2
                C -= h1.outer_product(r[3] * x1 + r[5] * x2) + h2.outer_product(r[5] * x1 + r[4] * x2)
                pull += r[6] * term.tie_1[s] + r[7] * term.tie_2[s]
            F -= h1.outer_product(n1) + h2.outer_product(n2)
    if ti.static(term.holds):
        area = term.held[e]
        if area > 0.0:
            s = term.per_cell * e
            g4, rho = term.hourglass[e], term.along[e]
            h1, h2 = term.slope_1[s], term.slope_2[s]
            u1, u2, u = _sum(U, h1), _sum(U, h2), _sum(U, g4)
            a1, a2 = term.points.a1[s], term.points.a2[s]
            x = u
            if ti.static(term.bends):
                x = term.skew[e] + u
            first, second = a1.dot(u) + u1.dot(x), a2.dot(u) + u2.dot(x)
            q = term.points.strain[s] * 0.0
            if ti.static(term.bends):
                d1, d2, d = _sum(D, h1), _sum(D, h2), _sum(D, g4)
                n_1, n_2, n = term.points.director_1[s] + d1, term.points.director_2[s] + d2, term.skew_N[e] + d
                bent_1 = a1.dot(d) + u1.dot(n) + term.skew[e].dot(d1) + u.dot(n_1)
                bent_2 = a2.dot(d) + u2.dot(n) + term.skew[e].dot(d2) + u.dot(n_2)
                q[0], q[1] = rho[0] * first + rho[1] * second, rho[2] * first + rho[3] * second
                q[2], q[3] = rho[0] * bent_1 + rho[1] * bent_2, rho[2] * bent_1 + rho[3] * bent_2
                q[4], q[5] = term.twist_1[e].dot(shears), term.twist_2[e].dot(shears)
                f = _held(term, e, s, q, dt, intact)
                m1, m2 = f[0] * rho[0] + f[1] * rho[2], f[0] * rho[1] + f[1] * rho[3]
                b1, b2 = f[2] * rho[0] + f[3] * rho[2], f[2] * rho[1] + f[3] * rho[3]
                x1, x2 = a1 + u1, a2 + u2
                F -= g4.outer_product(m1 * x1 + m2 * x2 + b1 * n_1 + b2 * n_2)
                F -= h1.outer_product(m1 * x + b1 * n) + h2.outer_product(m2 * x + b2 * n)
                C -= g4.outer_product(b1 * x1 + b2 * x2) + h1.outer_product(b1 * x) + h2.outer_product(b2 * x)
                pull += f[4] * term.twist_1[e] + f[5] * term.twist_2[e]
            else:
                q[0], q[1] = rho[0] * first + rho[1] * second, rho[2] * first + rho[3] * second
                f = _held(term, e, s, q, dt, intact)
                m1, m2 = f[0] * rho[0] + f[1] * rho[2], f[0] * rho[1] + f[1] * rho[3]
                F -= g4.outer_product(m1 * (a1 + u1) + m2 * (a2 + u2)) + h1.outer_product(m1 * x) + h2.outer_product(m2 * x)
    if ti.static(term.bends):
        for k in ti.static(range(4)):
            i, j = corner[k], corner[(k + 1) % 4]
            across = ti.cast(term.nodes.X[j] - term.nodes.X[i], float)
            for c in ti.static(range(3)):
                n = 0.5 * (term.nodes.N[i][c] + term.nodes.N[j][c] + D[k, c] + D[(k + 1) % 4, c])
                lever = 0.5 * pull[k] * (across[c] + U[(k + 1) % 4, c] - U[k, c])
                F[k, c] += pull[k] * n
                F[(k + 1) % 4, c] -= pull[k] * n
                C[k, c] -= lever
                C[(k + 1) % 4, c] -= lever
    if term.cells.n_corners[e] == 3:  # the fourth corner is the first one
        for c in ti.static(range(term.nodes.dim)):
            F[0, c] += F[3, c]
            if ti.static(term.bends):
                C[0, c] += C[3, c]
    for k in ti.static(range(4)):
        for c in ti.static(range(term.nodes.dim)):
            term.corner_force[4 * e + k][c] = F[k, c]
            if ti.static(term.bends):
                term.corner_couple[4 * e + k][c] = C[k, c]


@ti.func
def _held(term: ti.template(), e, s, q: ti.template(), dt, intact):
    """Forces [N m] of element e that work on its changes q, and its books."""
    b = sheet_of(term.points, s)
    young, thickness = term.material.young[b], term.material.thickness[b]
    K = q * 0.0
    for k in ti.static(range(2)):
        K[k] = young * thickness
        if ti.static(term.bends):
            K[2 + k] = young * thickness**3 / 12.0
            K[4 + k] = shear_of(term.points, term.material, s)
    K *= term.held[e]
    elastic = q
    kept = young * 0.0 + 1.0
    if ti.static(term.material.remembers):
        if intact == 0:
            elastic = q * 0.0
            before = q * 0.0
            size = young * 0.0  # square of the elastic stress
            for k in ti.static(range(term.change.n)):
                before[k] = term.elastic[e][k]
                elastic[k] = before[k] + (q[k] - term.change[e][k])
            flow = q * 0.0
            if ti.static(term.material.yields):
                for k in ti.static(range(term.change.n)):
                    size += K[k] * elastic[k] * elastic[k]
                size *= young / (term.held[e] * thickness)
                limit = HINGE * term.points.limit[s]
                if size > limit * limit:
                    for k in ti.static(range(term.change.n)):
                        flow[k] = (1.0 - limit / ti.sqrt(size)) * elastic[k]
                    elastic -= flow
            was = term.intact[e]
            kept = was
            if ti.static(term.material.damages):
                kept = 1.0 - term.points.delayed[s]
            if dt > 0.0:
                for k in ti.static(range(term.change.n)):
                    term.change[e][k] = q[k]
                    term.elastic[e][k] = elastic[k]
                term.intact[e] = kept
                lost, taken = young * 0.0, young * 0.0
                for k in ti.static(range(term.change.n)):
                    lost += 0.5 * (was - kept) * K[k] * before[k] * elastic[k]
                    taken += 0.5 * K[k] * (was * before[k] + kept * elastic[k]) * flow[k]
                term.held_lost[e] += lost
                term.held_flow[e] += taken
    if intact == 0:
        if ti.static(term.material.remembers):
            if dt > 0.0:
                term.held_energy[e] = 0.5 * kept * (K * elastic).dot(elastic)
        else:
            term.held_energy[e] = 0.5 * (K * elastic).dot(elastic)
    return kept * K * elastic


@ti.kernel
def _gather(term: ti.template(), n: ti.i32):
    for i in range(n):
        force = term.nodes.force[i] * 0.0
        couple = force
        for m in range(term.cells.start_of_node[i], term.cells.start_of_node[i + 1]):
            force += term.corner_force[term.slot[m]]
            if ti.static(term.bends):
                couple += term.corner_couple[term.slot[m]]
        term.nodes.force[i] = force
        if ti.static(term.bends):
            term.nodes.couple[i] = couple
