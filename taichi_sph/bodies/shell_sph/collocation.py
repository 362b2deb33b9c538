"""Internal forces of the shell, collocation form: the strong form of the thesis (T 2.2.2.1).

    cell gradient   u_,a  = sum_j Phi_j,a(x_s) u_j            order-1 MLS from the nodes     (T 2.25)
    director        d_s   = sum_j Phi_j(x_s) d_j              order-2 MLS from the nodes     (T 2.2.2.1)
    stress          stress.resultants -> n^a, m^a, q
    node force      f_i   = A_i sum_s n^a_s (a_a . grad Phi_s)(X_i)          order-1 MLS from the cells (T 2.27)
    on the director g_i   = A_i sum_s [ m^a_s (a_a . grad Phi_s) - Phi_s q_s ]                          (T 2.28)

Free edges (T 2.2.3.2): the nodes of the border, and those of broken cells (T 2.3.6.1), join their own neighbourhood with zero stress.
The divergence is not the transpose of the strain. Therefore the form does not conserve energy by construction: B(%) shows what that
costs, and viscosity and filters keep the motion calm.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from ... import runtime
from ...geometry.mesh import SurfaceMesh, tangent_frames
from ...numerics.reduce import Reducer
from ...pool import Pool
from ...runtime import ti
from ..shell.build import Model, bounded_shear, by_cell, by_node, cell_spacing, centred, longest_diagonal, spread_over_cells
from ..shell.stress import of_sound_cells, resultants
from .links import Links, Rows, Sources
from .selective import SelectiveShear, node_shears, shear_at, shear_dead, take_shear
from .slits import slits
from .voids import voids


class Collocation(Pool):
    """The term. `force` overwrites nodes.force (and nodes.couple); `links` are touched by rupture."""

    look_every = 25  # steps between two looks at the largest frequency while things break: ruptures raise it by half within tens of steps

    def __init__(self, model: Model, suffix: str = ""):
        name = f"collocation{suffix}"
        super().__init__(name)
        mesh, bodies = model.mesh, model.bodies
        self.bodies = bodies
        self.nodes, self.cells, self.material = nodes, cells, material = model.nodes, model.cells, model.material
        self.bends = nodes.bends
        self.answer = _stress  # of a cell to its strains
        local = mesh.node_spacing
        forms: list[Any] = [body.numerics.formulation for body in bodies]
        self.reach = 4.0 * forms[0].support * float(mesh.node_spacing.max()) + longest_diagonal(mesh)
        supports, numbers = [form.support for form in forms], np.arange(len(bodies))
        frames = tangent_frames(mesh.node_normals)
        of_nodes = Sources(nodes.X, nodes.n, nodes.fragment, nodes.body if nodes.several else None)
        of_cells = Sources(cells.centre, cells.n, cells.broken, cells.body if nodes.several else None)
        at_cells = Rows.at(mesh.centres, mesh.frames, by_cell(bodies, supports) * cell_spacing(mesh), 1, by_cell(bodies, numbers))
        at_nodes = Rows.at(mesh.points, frames, by_node(bodies, supports) * local, 1, by_node(bodies, numbers))
        self.strains = Links(f"{name}.strains", of_nodes, at_cells, gradient=True)
        self.divergence = Links(f"{name}.divergence", of_cells, at_nodes, gradient=True, values=self.bends)
        self.pairs = Links(f"{name}.pairs", of_nodes, replace(at_nodes, order=0))
        self.links: tuple[Links, ...] = (self.strains, self.divergence, self.pairs)
        self.area = self.field("area", nodes.n, unit="m2", doc="that a node owns")
        self.n1 = self.field("n1", cells.n, nodes.dim, unit="N/m", doc="n^1 of the cells")
        self.n2 = self.field("n2", cells.n, nodes.dim, unit="N/m", doc="n^2 of the cells")
        runtime.put(self.area, mesh.node_areas)
        edge = np.zeros(nodes.n, np.int32)
        edge[mesh.edges.nodes[mesh.edges.sides[:, 1] < 0]] = 1
        runtime.put(self.divergence.own, edge)
        if self.bends:
            self.directors = Links(f"{name}.directors", of_nodes, replace(at_cells, order=2))
            self.links += (self.directors,)
            self.m1 = self.field("m1", cells.n, 3, unit="N", doc="m^1 of the cells")
            self.m2 = self.field("m2", cells.n, 3, unit="N", doc="m^2 of the cells")
            self.q = self.field("q", cells.n, 3, unit="N/m", doc="q of the cells")
            self.t1 = self.field("t1", nodes.n, 3, doc="tangent of a node, in the precision of the state")
            self.t2 = self.field("t2", nodes.n, 3, doc="the other tangent")
            self.root = self.field("root", cells.n, 3, doc="r11, r12, r22: makes the tangents of a cell orthonormal")
            runtime.put(self.t1, np.ascontiguousarray(frames[:, 0]))
            runtime.put(self.t2, np.ascontiguousarray(frames[:, 1]))
            constants = list(zip(*(material.numbers(key) for key in ("thickness", "young", "poisson"))))
            runtime.put(cells.shear, bounded_shear(bodies, spread_over_cells, constants, cell_spacing(mesh)))
        self.selects = self.bends and forms[0].selective_shear
        if self.selects:
            self.shear = SelectiveShear(model, at_nodes, self.divergence.own, f"selective{suffix}")
            self.links += self.shear.links
        numbers_of_nodes = runtime.get(nodes.body, nodes.n) if nodes.several else None
        longest = float((2.0 * by_node(bodies, supports) * local).max())
        strained = (self.strains, self.directors) if self.bends else (self.strains,)
        for hiding in (slits(mesh, numbers_of_nodes), voids(mesh, longest, numbers_of_nodes)):
            if hiding is None:
                continue
            both = np.concatenate([hiding.nodes, hiding.centres])
            for links in self.links:
                rows = hiding.centres if links in strained else hiding.nodes
                seen = hiding.centres if links is self.divergence else both if links.n_sources == len(both) else hiding.nodes
                hiding.hide(links, np.repeat(rows[:, None], 2, axis=1), seen)
        for links in self.links:
            links.renew_all()
        self._reference(mesh)
        if self.selects:
            self.shear.begin()

    def _reference(self, mesh: SurfaceMesh) -> None:
        """Tangents and directors of the reference, by the operator itself: a rigid motion then strains nothing."""
        dim = self.nodes.dim
        runtime.put(self.cells.area, mesh.areas)
        if not self.bends:
            runtime.put(self.cells.a1, np.ascontiguousarray(mesh.frames[:, 0, :dim]))
            runtime.put(self.cells.a2, np.ascontiguousarray(mesh.frames[:, 1, :dim]))
            return
        raw = self._gradients(centred(self.bodies))
        values, vectors = np.linalg.eigh(np.einsum("mai,mbi->mab", raw, raw))
        root = np.einsum("mak,mk,mbk->mab", vectors, values**-0.5, vectors)
        tangents = np.einsum("mab,mbi->mai", root, raw)
        slopes = np.einsum("mab,mbi->mai", root, self._gradients(mesh.node_normals))
        runtime.put(self.root, np.stack([root[:, 0, 0], root[:, 0, 1], root[:, 1, 1]], axis=1))
        runtime.put(self.cells.a1, np.ascontiguousarray(tangents[:, 0]))
        runtime.put(self.cells.a2, np.ascontiguousarray(tangents[:, 1]))
        runtime.put(self.cells.director_1, np.ascontiguousarray(slopes[:, 0]))
        runtime.put(self.cells.director_2, np.ascontiguousarray(slopes[:, 1]))
        runtime.put(self.cells.director, self.directors.apply(mesh.node_normals))

    def _gradients(self, of_node: np.ndarray) -> np.ndarray:
        """(N, 3) -> (M, 2, 3) by the strain links."""
        return np.stack([self.strains.apply(of_node, a) for a in (0, 1)], axis=1)

    def strain(self, dt: float, intact: int = 0) -> None:
        """Strains and stresses of the cells; advances damage over dt."""
        of_sound_cells(self, self.cells.n, dt, intact)

    def force(self) -> None:
        """Divergence of what `strain` found."""
        if self.selects:
            node_shears(self.shear, self.nodes.n)
        _divergence(self, self.nodes.n)

    def drop(self, n_new: int) -> None:
        """The cells on the list `new` carry nothing more, and their nodes are edge nodes from now on."""
        _drop(self, n_new)
        if self.selects:
            shear_dead(self.shear, self.cells.new, n_new)

    def restrain(self, links: Links, n_touched: int) -> None:
        """After the touched rows were renewed: the stress of the cells that see other nodes now."""
        if links is self.strains:
            _stresses_touched(self, n_touched)

    def stored(self, reducer: Reducer) -> float:
        """Nothing beside the cells stores energy."""
        return 0.0

    def lost(self, reducer: Reducer) -> float:
        """Nothing beside the cells is damaged."""
        return 0.0

    def dissipated(self, reducer: Reducer) -> float:
        """Nothing beside the cells yields."""
        return 0.0

    def pools(self) -> tuple[Pool, ...]:
        """All that has fields."""
        return (*self.links, self, *((self.shear,) if self.selects else ()))


@ti.func
def _stress(term: ti.template(), s, dt, intact, tally):
    u1 = term.n1[0] * 0.0
    u2, d1, d2, d = u1, u1, u1, u1
    for k in range(term.strains.start[s], term.strains.start[s + 1]):
        j = term.strains.source[k]
        c = term.strains.coef[k]
        u = term.nodes.u[j]
        u1 += c[0] * u
        u2 += c[1] * u
        if ti.static(term.bends):
            turn = term.nodes.d[j]
            d1 += c[0] * turn
            d2 += c[1] * turn
    if ti.static(term.bends):
        for k in range(term.directors.start[s], term.directors.start[s + 1]):
            d += term.directors.coef[k] * term.nodes.d[term.directors.source[k]]
        r = term.root[s]
        u1, u2 = r[0] * u1 + r[1] * u2, r[1] * u1 + r[2] * u2
        d1, d2 = r[0] * d1 + r[1] * d2, r[1] * d1 + r[2] * d2
    n1, n2, m1, m2, q = resultants(term.cells, term.material, s, (u1, u2, d1, d2, d), dt, intact, tally)
    if ti.static(term.selects):
        kept = 1.0
        if intact == 0:
            kept -= term.cells.delayed[s]
        s1, s2, sq = take_shear(term.shear, term.cells, s, u1, u2, d, kept)
        n1 -= s1
        n2 -= s2
        q -= sq
    term.n1[s] = n1
    term.n2[s] = n2
    if ti.static(term.bends):
        term.m1[s] = m1
        term.m2[s] = m2
        term.q[s] = q


@ti.kernel
def _stresses_touched(term: ti.template(), n_touched: ti.i32):
    for m in range(n_touched):
        s = term.strains.touched[m]
        if term.cells.broken[s] == 0:
            if term.strains.alive[s] == 1:
                _stress(term, s, 0.0, 0, 0)
            elif ti.atomic_max(term.cells.broken[s], 1) == 0:
                term.cells.new[ti.atomic_add(term.cells.n_new[0], 1)] = s


@ti.kernel
def _divergence(term: ti.template(), n: ti.i32):
    for i in range(n):
        force = term.nodes.force[i] * 0.0
        couple = force
        if term.nodes.fragment[i] == 0:
            for k in range(term.divergence.start[i], term.divergence.start[i + 1]):
                s = term.divergence.source[k]
                c = term.divergence.coef[k]
                g1, g2 = c[0], c[1]
                if ti.static(term.bends):
                    # the cell's tangents seen from the node's tangent plane
                    slope = c[0] * term.t1[i] + c[1] * term.t2[i]
                    g1, g2 = term.cells.a1[s].dot(slope), term.cells.a2[s].dot(slope)
                    couple += g1 * term.m1[s] + g2 * term.m2[s] - c[2] * term.q[s]
                force += g1 * term.n1[s] + g2 * term.n2[s]
            if ti.static(term.selects):
                sheared, turned = shear_at(term.shear, i)
                force += sheared
                couple += turned
        term.nodes.force[i] = term.area[i] * force
        if ti.static(term.bends):
            term.nodes.couple[i] = term.area[i] * couple


@ti.kernel
def _drop(term: ti.template(), n_new: ti.i32):
    for m in range(n_new):
        s = term.cells.new[m]
        term.n1[s] *= 0.0
        term.n2[s] *= 0.0
        if ti.static(term.bends):
            term.m1[s] *= 0.0
            term.m2[s] *= 0.0
            term.q[s] *= 0.0
        for k in range(term.cells.n_corners[s]):
            term.divergence.own[term.cells.corner[s][k]] = 1
