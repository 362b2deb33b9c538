"""Transverse shear by stabilised selective collocation (T 2.2.6.3, 2.55), an option of the collocation form.

One stress point per cell locks in shear. Here the shear is evaluated at the nodes themselves,

    gamma_a(i) = x_,a(i) . n_i - a_a . N_i          gradients at node i by order-1 MLS from the nodes
    Q_a = G_s gamma_a,  zero on free edges (T 2.42)

The divergence of the shear is taken by order-1 MLS over the nodes and over the cells, whose weights are reduced to f_c w:

    f_c = k (e / R)^n,   k = 1e-2, n = 2, R = D / 2                                                     (T 2.55)

This share of the cells holds down the modes that the nodes alone do not see. The node's own Q_a x_,a acts on its director (the T_0 of
T 2.28). No damage acts on the share of the nodes: the option is for the comparison of elastic shells, and a scene with damage is
refused. Measured on a clamped square plate of 16 cells, e/L = 1e-3, h/D = 1: 0.75 of Kirchhoff's deflection without the option
(locked), 1.22 with it; at h/D >= 1.2 the nodes alone are too soft for the little that f_c leaves.
"""

from typing import Any

import numpy as np

from ... import runtime
from ...pool import Pool
from ...runtime import ti
from ..shell.build import Model, by_cell, by_node, centred
from .links import Links, Rows, Sources

K, EXPONENT = 1e-2, 2  # T 2.55


class SelectiveShear(Pool):
    """Owns the neighbourhoods of the shear; the collocation form calls it where it would use its own."""

    def __init__(self, model: Model, at_nodes: Rows, own: Any, name: str):
        super().__init__(name)
        mesh, bodies = model.mesh, model.bodies
        self.bodies = bodies
        self.nodes, self.cells = nodes, cells = model.nodes, model.cells
        self.own = own  # field (N,): 1 on free edges
        n, m = nodes.n, cells.n
        self.X = self.field("X", n + m, 3, "f64", unit="m", doc="nodes, then cells")
        self.dead = self.field("dead", n + m, dtype="i32", doc="1: takes part in nothing any more")
        self.factor = self.field("factor", n + m, doc="1 for nodes, f_c for cells")
        runtime.put(self.X, np.concatenate([mesh.points, mesh.centres]))
        f_c = [min(1.0, K * (e / (0.5 * body.mesh.spacing)) ** EXPONENT) for body, e in zip(bodies, model.material.numbers("thickness"))]
        runtime.put(self.factor, np.r_[np.ones(n), by_cell(bodies, f_c)])
        both = None
        if nodes.several:
            both = self.field("body", n + m, dtype="i32", doc="number of the body, of nodes, then cells")
            runtime.put(both, np.r_[runtime.get(nodes.body, n), runtime.get(cells.body, m)])
        of_nodes = Sources(nodes.X, n, nodes.fragment, nodes.body if nodes.several else None)
        self.strains = Links(f"{name}.strains", of_nodes, at_nodes, gradient=True)
        self.divergence = Links(f"{name}.divergence", Sources(self.X, n + m, self.dead, both, self.factor), at_nodes, gradient=True)
        self.links = (self.strains, self.divergence)
        self.a1 = self.field("a1", n, 3, doc="X_,1 at the nodes, by the operator itself")
        self.a2 = self.field("a2", n, 3, doc="X_,2 at the nodes")
        self.stiffness = self.field("stiffness", n, unit="N/m", doc="G_s at the nodes")
        self.s1 = self.field("s1", n + m, 3, unit="N/m", doc="Q_1 n")
        self.s2 = self.field("s2", n + m, 3, unit="N/m", doc="Q_2 n")
        self.q = self.field("q", n + m, 3, unit="N/m", doc="Q_a x_,a")

    def begin(self) -> None:
        """Reference of the nodes, once the links are made."""
        X = centred(self.bodies)
        runtime.put(self.a1, self.strains.apply(X, 0))
        runtime.put(self.a2, self.strains.apply(X, 1))
        shear = runtime.get(self.cells.shear, self.cells.n)
        means = [shear[body.cells.rows].mean() for body in self.bodies]
        runtime.put(self.stiffness, by_node(self.bodies, means))


@ti.func
def take_shear(term: ti.template(), cells: ti.template(), s, u1, u2, d, kept):
    """Shear of cell s apart: books Q_a n and Q_a x_,a, and returns them [N/m]."""
    x1, x2, n = cells.a1[s] + u1, cells.a2[s] + u2, cells.director[s] + d
    Q1 = kept * cells.shear[s] * (cells.a1[s].dot(d) + u1.dot(n))
    Q2 = kept * cells.shear[s] * (cells.a2[s].dot(d) + u2.dot(n))
    i = term.nodes.n + s
    term.s1[i] = Q1 * n
    term.s2[i] = Q2 * n
    term.q[i] = Q1 * x1 + Q2 * x2
    return Q1 * n, Q2 * n, Q1 * x1 + Q2 * x2


@ti.kernel
def node_shears(term: ti.template(), n: ti.i32):
    """Q_a n and Q_a x_,a of the nodes."""
    for i in range(n):
        u1 = term.s1[i] * 0.0
        u2 = u1
        for k in range(term.strains.start[i], term.strains.start[i + 1]):
            c = term.strains.coef[k]
            u = term.nodes.u[term.strains.source[k]]
            u1 += c[0] * u
            u2 += c[1] * u
        d = term.nodes.d[i]
        m = term.nodes.N[i] + d
        G = term.stiffness[i]
        if term.own[i] == 1 or term.nodes.fragment[i] == 1:
            G *= 0.0
        Q1 = G * (term.a1[i].dot(d) + u1.dot(m))
        Q2 = G * (term.a2[i].dot(d) + u2.dot(m))
        term.s1[i] = Q1 * m
        term.s2[i] = Q2 * m
        term.q[i] = Q1 * (term.a1[i] + u1) + Q2 * (term.a2[i] + u2)


@ti.func
def shear_at(term: ti.template(), i):
    """Divergence of the shear at node i, and its force on the director, per unit area [N/m2, N/m]."""
    force = term.s1[i] * 0.0
    for k in range(term.divergence.start[i], term.divergence.start[i + 1]):
        j = term.divergence.source[k]
        c = term.divergence.coef[k]
        force += c[0] * term.s1[j] + c[1] * term.s2[j]
    return force, -term.q[i]


@ti.kernel
def shear_dead(term: ti.template(), new_cells: ti.template(), n_new: ti.i32):
    """The broken cells on the list, and the fragments they leave, take part in nothing any more."""
    for m in range(n_new):
        s = new_cells[m]
        i = term.nodes.n + s
        term.dead[i] = 1
        term.s1[i] *= 0.0
        term.s2[i] *= 0.0
        term.q[i] *= 0.0
        for k in range(term.cells.n_corners[s]):
            j = term.cells.corner[s][k]
            if term.nodes.fragment[j] == 1:
                term.dead[j] = 1
