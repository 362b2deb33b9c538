"""Internal forces of the shell, collocation form: the strong form of the thesis (T 2.2.2.1).

    cell gradient   u_,a  = sum_j Phi_j,a(x_s) u_j            order-1 MLS from the nodes     (T 2.25)
    stress          n^a   = stress.resultants(u_,a)
    node force      f_i   = A_i sum_s Phi_s,a(X_i) n^a_s      order-1 MLS from the cells     (T 2.27)

Free edges (T 2.2.3.2): the nodes of the border, and those of broken cells (T 2.3.6.1), join their own
neighbourhood with zero stress. Strain and divergence are not each other's transpose, so energy is not
conserved by construction: B(%) shows what that costs, and viscosity and filter keep it calm.
"""

import numpy as np

from .. import runtime
from ..model.links import Links
from ..model.mesh import SurfaceMesh, tangent_frames
from ..model.pools import Cells, MaterialPool, Nodes
from ..runtime import ti
from .stress import resultants


@ti.data_oriented
class Collocation:
    """The term. `force` overwrites nodes.force; `links` are touched by rupture."""

    def __init__(self, mesh: SurfaceMesh, nodes: Nodes, cells: Cells, material: MaterialPool, settings):
        self.nodes, self.cells, self.material = nodes, cells, material
        local = mesh.node_spacing
        corner = np.where(mesh.cells < 0, mesh.cells[:, :1], mesh.cells)
        frames = tangent_frames(mesh.node_normals)
        self.strains = Links(
            "strains",
            sources=nodes.X,
            n_sources=nodes.n,
            dead_source=nodes.fragment,
            points=np.repeat(mesh.centres[:, None], 2, axis=1),
            n_points=np.ones(cells.n),
            frames=mesh.frames,
            h=settings.support * local[corner].mean(axis=1),
            order=np.ones(cells.n),
            gradient=True,
        )
        self.divergence = Links(
            "divergence",
            sources=cells.centre,
            n_sources=cells.n,
            dead_source=cells.broken,
            points=np.repeat(mesh.points[:, None], 2, axis=1),
            n_points=np.ones(nodes.n),
            frames=frames,
            h=settings.support * local,
            order=np.ones(nodes.n),
            gradient=True,
        )
        self.pairs = Links(
            "pairs",
            sources=nodes.X,
            n_sources=nodes.n,
            dead_source=nodes.fragment,
            points=np.repeat(mesh.points[:, None], 2, axis=1),
            n_points=np.ones(nodes.n),
            frames=frames,
            h=settings.support * local,
            order=np.zeros(nodes.n),
        )
        self.links = (self.strains, self.divergence, self.pairs)
        self.area = runtime.new("nodes.area", nodes.n)  # m2
        self.n1 = runtime.new("cells.n1", cells.n, nodes.dim)  # N/m
        self.n2 = runtime.new("cells.n2", cells.n, nodes.dim)
        runtime.put(self.area, mesh.node_areas)
        runtime.put(cells.area, mesh.areas)
        runtime.put(cells.a1, np.ascontiguousarray(mesh.frames[:, 0, : nodes.dim]))
        runtime.put(cells.a2, np.ascontiguousarray(mesh.frames[:, 1, : nodes.dim]))
        edge = np.zeros(nodes.n, np.int32)
        edge[mesh.edges.nodes[mesh.edges.sides[:, 1] < 0]] = 1
        runtime.put(self.divergence.own, edge)
        for links in self.links:
            links.renew_all()

    def strain(self, dt: float, intact: int = 0) -> None:
        """Strains and stresses of the cells; advances damage over dt."""
        _stresses(self, self.cells.n, dt, intact)

    def force(self) -> None:
        """Divergence of what `strain` found."""
        _divergence(self, self.nodes.n)

    def drop(self, n_new: int) -> None:
        """The cells on the list `new` carry nothing more, and their nodes are edge nodes from now on."""
        _drop(self, n_new)

    def restrain(self, links: Links, n_touched: int) -> None:
        """After the touched rows were renewed: the stress of the cells that see other nodes now."""
        if links is self.strains:
            _stresses_touched(self, n_touched)

    def stored(self, reducer) -> float:
        """Nothing beside the cells stores energy."""
        return 0.0

    def lost(self, reducer) -> float:
        """Nothing beside the cells is damaged."""
        return 0.0

    def state(self) -> dict[str, np.ndarray]:
        return {name: value for links in self.links for name, value in links.state().items()}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        for links in self.links:
            links.restore(state)


@ti.func
def _stress(term: ti.template(), s, dt, intact, tally):
    u1 = term.n1[0] * 0.0
    u2 = u1
    for k in range(term.strains.start[s], term.strains.start[s + 1]):
        u = term.nodes.u[term.strains.source[k]]
        u1 += term.strains.coef[k][0] * u
        u2 += term.strains.coef[k][1] * u
    n1, n2, _m1, _m2, _q = resultants(term.cells, term.material, s, u1, u2, u1, u2, u1, dt, intact, tally)
    term.n1[s] = n1
    term.n2[s] = n2


@ti.kernel
def _stresses(term: ti.template(), n: ti.i32, dt: float, intact: ti.i32):
    for s in range(n):
        if term.cells.broken[s] == 0:
            _stress(term, s, dt, intact, 1)


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
        total = term.nodes.force[i] * 0.0
        if term.nodes.fragment[i] == 0:
            for k in range(term.divergence.start[i], term.divergence.start[i + 1]):
                s = term.divergence.source[k]
                total += term.divergence.coef[k][0] * term.n1[s] + term.divergence.coef[k][1] * term.n2[s]
        term.nodes.force[i] = term.area[i] * total


@ti.kernel
def _drop(term: ti.template(), n_new: ti.i32):
    for m in range(n_new):
        s = term.cells.new[m]
        term.n1[s] *= 0.0
        term.n2[s] *= 0.0
        for k in range(term.cells.n_corners[s]):
            term.divergence.own[term.cells.corner[s][k]] = 1
