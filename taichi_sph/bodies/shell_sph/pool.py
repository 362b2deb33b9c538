"""The pools: what exists during a run, one data-only class per kind. Shapes and units beside each field.

`dim` is the number of displacement components: 2 for a shell that stays in its plane, 3 for one that bends
(`bends`), which also has a director at each node. Both are constants of the run, so the same kernels serve both
and a flat scene allocates and compiles nothing of bending.
"""

import numpy as np

from ... import runtime
from ...errors import SceneError
from ...geometry.mesh import SurfaceMesh
from ...runtime import ti
from ...scene.necking import rupture_strain


@ti.data_oriented
class Nodes:
    """Shell nodes: mass and motion. State: u, v (half step), d, omega (half step); constant: the rest."""

    def __init__(self, mesh: SurfaceMesh, mass: np.ndarray, inertia: np.ndarray | None = None):
        """mass (N,) [kg]; inertia (N,) [kg m2] of the director, None for a shell that stays in its plane."""
        self.n = n = len(mesh.points)
        self.bends = inertia is not None
        self.dim = dim = 3 if self.bends else 2
        self.X = runtime.new("nodes.X", n, 3, "f64")  # m, reference position
        self.mass = runtime.new("nodes.mass", n)  # kg
        self.u = runtime.new("nodes.u", n, dim)  # m, displacement
        self.v = runtime.new("nodes.v", n, dim)  # m/s, velocity at the half step before (T 2.31)
        self.force = runtime.new("nodes.force", n, dim)  # N, sum of the terms
        self.kinetic = runtime.new("nodes.kinetic", n)  # J, of the last step
        self.fragment = runtime.new("nodes.fragment", n, dtype="i32")  # 1: no live cell around it
        self.fixed = runtime.new("nodes.fixed", n, dtype="i32")  # prescribed motion + 1, 0 = free
        runtime.put(self.X, mesh.points)
        runtime.put(self.mass, mass)
        if self.bends:
            self.N = runtime.new("nodes.N", n, 3)  # reference director, unit
            self.d = runtime.new("nodes.d", n, 3)  # director now minus N
            self.omega = runtime.new("nodes.omega", n, 3)  # rad/s, across the director, at the half step before
            self.couple = runtime.new("nodes.couple", n, 3)  # N m, force on the director
            self.inertia = runtime.new("nodes.inertia", n)  # kg m2
            runtime.put(self.N, mesh.node_normals)
            runtime.put(self.inertia, inertia)


@ti.data_oriented
class Cells:
    """Stress points, one per cell: geometry (constant), damage and energy (state).

    Tangents, area and director of the reference are filled by the formulation, from its own operator: then a
    rigid motion strains nothing, to rounding.
    """

    def __init__(self, mesh: SurfaceMesh, nodes: Nodes, material: "MaterialPool", sound: np.ndarray | None = None):
        """sound (M,) bool: cells that are never damaged; None where there is none."""
        self.n = n = len(mesh.cells)
        self.nodes_X = nodes.X
        self.n_corners = runtime.new("cells.n_corners", n, dtype="i32")
        self.corner = runtime.new("cells.corner", n, 4, "i32")  # node numbers, -1 where there is none
        self.edge = runtime.new("cells.edge", n, 4, "i32")  # edge numbers, -1 where there is none
        self.sides = runtime.new("edges.sides", len(mesh.edges.nodes), 2, "i32")  # 4 * cell + side, -1
        self.centre = runtime.new("cells.centre", n, 3, "f64")  # m, reference
        self.t1 = runtime.new("cells.t1", n, 3, "f64")  # tangent frame, reference
        self.t2 = runtime.new("cells.t2", n, 3, "f64")
        self.history: dict[str, tuple] = {}  # fields of the history of a metal, with their lengths
        self.radius = runtime.new("cells.radius", n, dtype="f64")  # m, farthest corner from the centre
        self.area = runtime.new("cells.area", n)  # m2
        self.a1 = runtime.new("cells.a1", n, nodes.dim)  # X_,1 and X_,2 of the reference, orthonormal
        self.a2 = runtime.new("cells.a2", n, nodes.dim)
        self.broken = runtime.new("cells.broken", n, dtype="i32")
        self.rupture_time = runtime.new("cells.rupture_time", n, dtype="f64")  # s
        self.damage = runtime.new("cells.damage", n)  # D, as the law alone would have it
        self.delayed = runtime.new("cells.delayed", n)  # D_r <= D, what the stress feels (T 2.73)
        # E11, E22, 2 E12 (kappa11, kappa22, 2 kappa12, gamma1, gamma2) in the frame of the cell
        self.strain = runtime.new("cells.strain", n, 8 if nodes.bends else 3)
        if nodes.bends:
            self.director = runtime.new("cells.director", n, 3)  # mean of N over the cell
            self.director_1 = runtime.new("cells.director_1", n, 3)  # 1/m, N_,1 and N_,2
            self.director_2 = runtime.new("cells.director_2", n, 3)
            self.shear = runtime.new("cells.shear", n)  # N/m, G_s: transverse shear stiffness
        self.lost = runtime.new("cells.lost", n, dtype="f64")  # J, taken by damage so far: a sum of many small parts
        self.spares = sound is not None
        if self.spares:
            self.sound = runtime.new("cells.sound", n, dtype="i32")  # 1: never damaged
            runtime.put(self.sound, sound.astype(np.int32))
        if material.yields:
            self._metal(material, nodes.bends)
        self.new = runtime.new("cells.new", n, dtype="i32")  # cells that break in this step
        self.n_new = runtime.new("cells.n_new", 1, dtype="i32")
        self.start_of_node = runtime.new("nodes.cell_start", nodes.n + 1, dtype="i32")
        self.of_node = runtime.new("nodes.cell", int(mesh.corners.sum()), dtype="i32")

        runtime.put(self.n_corners, mesh.corners)
        runtime.put(self.corner, mesh.cells.astype(np.int32))
        runtime.put(self.edge, mesh.edges.cell_edges)
        runtime.put(self.sides, mesh.edges.sides)
        runtime.put(self.centre, mesh.centres)
        runtime.put(self.t1, np.ascontiguousarray(mesh.frames[:, 0]))
        runtime.put(self.t2, np.ascontiguousarray(mesh.frames[:, 1]))
        spokes = np.linalg.norm(mesh.points[np.where(mesh.cells < 0, mesh.cells[:, :1], mesh.cells)] - mesh.centres[:, None], axis=2)
        runtime.put(self.radius, spokes.max(axis=1))
        runtime.put(self.rupture_time, np.full(n, np.nan))
        node = mesh.cells.ravel()
        cell = np.repeat(np.arange(n), 4)[node >= 0]
        node = node[node >= 0]
        order = np.argsort(node, kind="stable")
        runtime.put(self.of_node, cell[order].astype(np.int32))
        runtime.put(self.start_of_node, np.r_[0, np.cumsum(np.bincount(node, minlength=nodes.n))].astype(np.int32))

    def _metal(self, material: "MaterialPool", bends: bool) -> None:
        """History of a metal (bodies/shell_sph/metal.py); of a bent shell in layers, at every layer as well."""
        n = self.n
        self.stress = runtime.new("cells.stress", n, 8 if bends else 3)  # Pa, m, b, s: effective, or summed over layers
        self.plastic = runtime.new("cells.plastic", n)  # p, cumulated plastic strain
        self.flow = runtime.new("cells.flow", n)  # Pa, yield stress now, at rates that do not count
        self.dissipated = runtime.new("cells.dissipated", n, dtype="f64")  # J, taken by plastic flow so far
        runtime.put(self.flow, np.full(n, material.first))
        names = ["stress", "plastic", "flow", "dissipated"]
        self.limit = self.flow  # Pa, yield stress at the rate of the last yielding; mean over the layers
        if material.rated:
            self.limit = runtime.new("cells.limit", n)
            runtime.put(self.limit, np.full(n, material.first))
            names.append("limit")
        if material.layers:
            self.layer_stress = runtime.new("cells.layer_stress", n * material.layers, 3)  # Pa, effective
            # p, lambda, flow, rate, D, D_r, limit: as of a section
            self.layer = runtime.new("cells.layer", n * material.layers, 7)
            self.shear_stress = runtime.new("cells.shear_stress", n, 2)  # Pa, effective
            start = np.zeros((n * material.layers, 7))
            start[:, [2, 6]] = material.first
            runtime.put(self.layer, start)
            names += ["layer_stress", "layer", "shear_stress"]
        else:
            if material.damages:
                self.hardening = runtime.new("cells.hardening", n)  # lambda <= p (T 2.78)
                names.append("hardening")
            if material.rated:
                self.rate = runtime.new("cells.rate", n)  # 1/s, equivalent strain rate of the last step
                names.append("rate")
        size = {"layer_stress": n * material.layers, "layer": n * material.layers}
        self.history = {f"cells.{name}": (getattr(self, name), size.get(name, n)) for name in names}

    @ti.func
    def nothing_across(self, edge, s):
        """1 when no live cell lies across `edge` from cell s: a broken one, or the border of the shell."""
        result = 1
        for k in ti.static(range(2)):
            side = self.sides[edge][k]
            if side >= 0:
                other = side // 4
                if other != s and self.broken[other] == 0:
                    result = 0
        return result


@ti.data_oriented
class MaterialPool:
    """Constants of the material, as fields so that changing a number recompiles nothing.

    Which laws there are (`yields`, `damages`, `delays`, `breaks`; `remembers`: any history) is a constant of the run: what
    a scene does not ask for is not compiled.
    """

    def __init__(self, material, thickness: float, bends: bool, width: float = 0.0):
        """material: scene.Material; thickness [m]; width [m] of the cells, which a neck is spread over."""
        self.bends = bends
        self.yields = material.strength is not None
        self.damages = material.damage is not None
        self.delays = material.delay is not None
        self.remembers = self.yields or self.damages
        self.breaks = material.critical_damage is not None
        values = {"young": material.young, "poisson": material.poisson, "thickness": thickness}
        if self.damages and not self.yields:
            values |= {"threshold": material.damage.threshold, "A": material.damage.A, "B": material.damage.B}
        if self.damages and self.yields:
            rupture = rupture_strain(material, width, thickness)
            if rupture <= material.damage.threshold:
                raise SceneError(
                    f"material '{material.name}': a cell of {1e3 * width:.3g} mm in a sheet of {1e3 * thickness:.3g} mm breaks"
                    f" at a mean strain of {rupture:.3g}, before its damage starts at {material.damage.threshold:g}; lower the spacing,"
                    " or set damage.necks to false"
                )
            values |= {"eps_d": material.damage.threshold, "eps_r": rupture, "D_c": material.damage.critical}
        if self.delays:
            values |= {"a": material.delay.a, "tau_c": material.delay.tau_c}
        if self.breaks:
            values |= {"critical": material.critical_damage}
        if self.yields:
            values |= self._strength(material.strength)
        for name, value in values.items():
            field = runtime.new(f"material.{name}", 1)
            field[0] = value
            setattr(self, name, field)

    def _strength(self, strength) -> dict[str, float]:
        """The numbers of a strength; `first` [Pa] is its yield stress before any plastic strain."""
        self.tabulated = strength.kind == "table"
        self.rated = strength.kind == "johnson_cook"
        self.layers = strength.layers or 0
        self.exact = runtime.current().real == ti.f64
        values = {"alpha": strength.alpha, "kappa": strength.kappa}
        if self.tabulated:
            self.points = runtime.new("material.points", len(strength.points), 2)
            self.n_points = runtime.new("material.n_points", 1, dtype="i32")
            runtime.put(self.points, np.array(strength.points))
            self.n_points[0] = len(strength.points)
            self.first = strength.points[0][1]
        elif strength.kind == "perfect":
            self.first = strength.yield_stress
            values |= {"hardening": 0.0, "exponent": 1.0}
        else:
            self.first = strength.A
            values |= {"hardening": strength.B, "exponent": strength.n}
        values["yield_stress"] = self.first
        if self.rated:
            values |= {"C": strength.C, "rate0": strength.rate0}
        if self.layers:
            zeta, weight = np.polynomial.legendre.leggauss(self.layers)
            self.zeta = runtime.new("material.zeta", self.layers)  # place in the thickness, -1 to 1
            self.weight = runtime.new("material.weight", self.layers)  # share of the thickness
            runtime.put(self.zeta, zeta)
            runtime.put(self.weight, 0.5 * weight)
        return values
