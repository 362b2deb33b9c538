"""The pools of shells: stress points and constants of the materials. Every field says its unit and meaning."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ... import runtime
from ...errors import SceneError
from ...geometry.mesh import SurfaceMesh
from ...laws.necking import rupture_strain
from ...pool import Pool
from ...runtime import ti
from ...scene.laws import Material
from ..nodal.nodes import Nodes
from .sections import Sheet


class StressPoints(Pool):
    """Stress points: geometry (constant), damage, plasticity and energy (history).

    Tangents, area and director of the reference are filled by the formulation, from its own operator: then a
    rigid motion strains nothing, to rounding.
    """

    def __init__(
        self,
        n: int,
        nodes: Nodes,
        material: "MaterialPool",
        sound: np.ndarray | None = None,
        body: np.ndarray | None = None,
        sheet: np.ndarray | None = None,
        name: str = "points",
    ):
        """sound (n,) bool: points that are never damaged; None where there is none. body (n,): number of the body; None where there
        is one. sheet (n,): row of the material; None where it is that of the body."""
        super().__init__(name)
        self.n = n
        self.varied = nodes.several or sheet is not None
        body = np.zeros(n, np.int32) if body is None else body.astype(np.int32)
        self.body = self.field("body", n, dtype="i32", doc="number of its body in the group")
        runtime.put(self.body, body)
        self.sheet = self.body
        if sheet is not None:
            self.sheet = self.field("sheet", n, dtype="i32", doc="row of its material")
            runtime.put(self.sheet, sheet.astype(np.int32))
        self.area = self.field("area", n, unit="m2", doc="reference area")
        self.a1 = self.field("a1", n, nodes.dim, doc="X_,1 of the reference; a1 and a2 are orthonormal")
        self.a2 = self.field("a2", n, nodes.dim, doc="X_,2 of the reference")
        self.broken = self.field("broken", n, dtype="i32", doc="1: carries nothing any more", keeps=True, shown="broken")
        self.rupture_time = self.field(
            "rupture_time", n, dtype="f64", unit="s", doc="nan while sound", keeps=True, shown="rupture_time", unset=True
        )
        self.damage = self.field("damage", n, doc="D, as the law alone would have it", keeps=True)
        self.delayed = self.field("delayed", n, doc="D_r <= D, what the stress feels (T 2.73)", keeps=True, shown="damage")
        self.strain = self.field(
            "strain",
            n,
            8 if nodes.bends else 3,
            doc="E11, E22, 2 E12 (kappa11, kappa22, 2 kappa12 [1/m], gamma1, gamma2) in the frame of the cell",
            keeps=True,
            shown="strain",
        )
        if nodes.bends:
            self.director = self.field("director", n, 3, doc="mean of N over the cell")
            self.director_1 = self.field("director_1", n, 3, unit="1/m", doc="N_,1")
            self.director_2 = self.field("director_2", n, 3, unit="1/m", doc="N_,2")
            self.shear = self.field("shear", n, unit="N/m", doc="G_s: transverse shear stiffness")
        self.lost = self.field("lost", n, dtype="f64", unit="J", doc="taken by damage so far: a sum of many small parts", keeps=True)
        self.spares = sound is not None
        if sound is not None:
            self.sound = self.field("sound", n, dtype="i32", doc="1: never damaged")
            runtime.put(self.sound, sound.astype(np.int32))
        if material.yields:
            self._metal(material, nodes.bends, body if sheet is None else sheet)
        self.new = self.field("new", n, dtype="i32", doc="cells that break in this step")
        self.n_new = self.field("n_new", 1, dtype="i32", doc="how many they are")
        runtime.put(self.rupture_time, np.full(n, np.nan))

    def scatter(self, tough: np.ndarray) -> None:
        """tough (n,): share of the plastic strains of damage that each point has."""
        self.tough = self.field("tough", self.n, doc="over the mean of the material, the plastic strains of damage of this point")
        runtime.put(self.tough, tough)

    def spread(self) -> None:
        """What drives damage where it goes by the mean plastic strain over a neck (shell_sph/spread.py)."""
        self.neck = self.field("neck", self.n, doc="mean of p over the width of a neck, which drives damage", keeps=True)
        self.neck_step = self.field("neck_step", self.n, doc="its growth in this step")

    def _metal(self, material: "MaterialPool", bends: bool, sheet: np.ndarray) -> None:
        """History of a metal (bodies/shell/metal.py); of a bent shell in layers, at every layer as well."""
        first = material.first[sheet]
        n = self.n
        size = 8 if bends else 3
        self.stress = self.field("stress", n, size, unit="Pa", doc="m, b, s: effective, or summed over layers", keeps=True)
        self.plastic = self.field("plastic", n, doc="p, cumulated plastic strain", keeps=True, shown="plastic")
        self.flow = self.field("flow", n, unit="Pa", doc="yield stress now, at rates that do not count", keeps=True)
        self.dissipated = self.field("dissipated", n, dtype="f64", unit="J", doc="taken by plastic flow so far", keeps=True)
        runtime.put(self.flow, first)
        self.limit = self.flow  # Pa, yield stress at the rate of the last yielding; mean over the layers
        if material.rated:
            self.limit = self.field("limit", n, unit="Pa", doc="yield stress at the rate of the last yielding", keeps=True)
            runtime.put(self.limit, first)
        if material.layers:
            layers = n * material.layers
            self.layer_stress = self.field("layer_stress", layers, 3, unit="Pa", doc="effective stress of a layer", keeps=True)
            self.layer = self.field("layer", layers, 7, doc="p, lambda, flow [Pa], rate [1/s], D, D_r, limit [Pa] of a layer", keeps=True)
            self.shear_stress = self.field("shear_stress", n, 2, unit="Pa", doc="effective transverse shear stress", keeps=True)
            start = np.zeros((layers, 7))
            start[:, [2, 6]] = np.repeat(first, material.layers)[:, None]
            runtime.put(self.layer, start)
        else:
            if material.damages:
                self.hardening = self.field("hardening", n, doc="lambda <= p (T 2.78)", keeps=True)
            if material.rated:
                self.rate = self.field("rate", n, unit="1/s", doc="equivalent strain rate of the last step", keeps=True)


class Joined(Pool):
    """Cells of a mesh and what they join."""

    n: int
    broken: Any

    def join(self, mesh: SurfaceMesh, nodes: Nodes) -> None:
        """Corners, edges and neighbours of the cells of a mesh."""
        n = self.n
        self.nodes_X = nodes.X
        self.n_corners = self.field("n_corners", n, dtype="i32", doc="number of corners, 3 or 4")
        self.corner = self.field("corner", n, 4, "i32", doc="node numbers, -1 where there is none")
        self.edge = self.field("edge", n, 4, "i32", doc="edge numbers, -1 where there is none")
        self.sides = self.field("sides", len(mesh.edges.nodes), 2, "i32", doc="of an edge: 4 * cell + side, -1 where there is none")
        self.centre = self.field("centre", n, 3, "f64", unit="m", doc="mean of the corners, reference")
        self.t1 = self.field("t1", n, 3, "f64", doc="tangent frame, reference")
        self.t2 = self.field("t2", n, 3, "f64", doc="tangent frame, reference")
        self.radius = self.field("radius", n, dtype="f64", unit="m", doc="farthest corner from the centre")
        self.start_of_node = self.field("start_of_node", nodes.n + 1, dtype="i32", doc="where the cells of a node begin in of_node")
        self.of_node = self.field("of_node", int(mesh.corners.sum()), dtype="i32", doc="cells around each node")

        runtime.put(self.n_corners, mesh.corners)
        runtime.put(self.corner, mesh.cells.astype(np.int32))
        runtime.put(self.edge, mesh.edges.cell_edges)
        runtime.put(self.sides, mesh.edges.sides)
        runtime.put(self.centre, mesh.centres)
        runtime.put(self.t1, np.ascontiguousarray(mesh.frames[:, 0]))
        runtime.put(self.t2, np.ascontiguousarray(mesh.frames[:, 1]))
        spokes = np.linalg.norm(mesh.points[np.where(mesh.cells < 0, mesh.cells[:, :1], mesh.cells)] - mesh.centres[:, None], axis=2)
        runtime.put(self.radius, spokes.max(axis=1))
        node = mesh.cells.ravel()
        cell = np.repeat(np.arange(n), 4)[node >= 0]
        node = node[node >= 0]
        order = np.argsort(node, kind="stable")
        runtime.put(self.of_node, cell[order].astype(np.int32))
        runtime.put(self.start_of_node, np.r_[0, np.cumsum(np.bincount(node, minlength=nodes.n))].astype(np.int32))


class Topology(Joined):
    """Cells of a mesh and what they join. Of a form whose cells hold several stress points each; a Cells is both."""

    def __init__(self, mesh: SurfaceMesh, nodes: Nodes, name: str = "cells"):
        super().__init__(name)
        self.n = n = len(mesh.cells)
        self.broken = self.field("broken", n, dtype="i32", doc="1: carries nothing any more", keeps=True)
        self.join(mesh, nodes)


class Cells(StressPoints, Joined):
    """Stress points, one per cell: geometry (constant), damage and energy (history), and the topology of the cells."""

    def __init__(
        self,
        mesh: SurfaceMesh,
        nodes: Nodes,
        material: "MaterialPool",
        sound: np.ndarray | None = None,
        body: np.ndarray | None = None,
        sheet: np.ndarray | None = None,
        name: str = "cells",
    ):
        """sound (M,) bool: cells that are never damaged; None where there is none. body, sheet (M,): as of StressPoints."""
        super().__init__(len(mesh.cells), nodes, material, sound, body, sheet, name)
        self.join(mesh, nodes)

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


@ti.func
def sheet_of(points: ti.template(), s):
    """Row of the material of stress point s; nothing is read where there is one."""
    b = 0
    if ti.static(points.varied):
        b = points.sheet[s]
    return b


CONSTANTS = {  # of a material: unit and meaning
    "young": ("Pa", "E"),
    "poisson": ("", "nu"),
    "thickness": ("m", "of the sheet"),
    "threshold": ("", "Mazars: strain at which damage begins"),
    "A": ("", "Mazars"),
    "B": ("", "Mazars"),
    "eps_d": ("", "plastic strain at which ductile damage begins"),
    "eps_r": ("", "plastic strain at which ductile damage is complete"),
    "D_c": ("", "ductile damage that is complete"),
    "a": ("", "delay of damage"),
    "tau_c": ("s", "delay of damage: its rate never exceeds 1 / tau_c"),
    "critical": ("", "D_c, delayed damage of rupture"),
    "alpha": ("", "share of bending in the yield function"),
    "kappa": ("", "share of transverse shear in the yield function"),
    "hardening": ("Pa", "B of the hardening"),
    "exponent": ("", "n of the hardening"),
    "yield_stress": ("Pa", "before any plastic strain"),
    "C": ("", "Johnson-Cook: sensitivity to the rate"),
    "rate0": ("1/s", "Johnson-Cook: reference rate"),
}


class MaterialPool(Pool):
    """Constants of the materials, one row a sheet (sections.py), as fields so that changing a number recompiles nothing.

    Which laws there are (`yields`, `damages`, `scatters`, `delays`, `breaks`; `remembers`: any history) is a constant of the run: what
    a scene does not ask for is not compiled. All bodies of a pool have the same laws (build.laws).
    """

    constants = CONSTANTS

    def __init__(self, sheets: Sequence[Sheet], bends: bool, name: str = "material"):
        super().__init__(name)
        self.sheets, self.bends = sheets, bends
        one = sheets[0].material
        self.yields = one.strength is not None
        self.damages = one.damage is not None
        self.scatters = getattr(one.damage, "scatter", None) is not None
        self.spreads = False  # set where cells are narrower than a neck, and damage.spread asks for it (shell_sph/spread.py)
        self.delays = one.delay is not None
        self.remembers = self.yields or self.damages
        self.breaks = one.critical_damage is not None
        rows = [self._constants(sheet) for sheet in sheets]
        for key in rows[0]:
            unit, doc = self.constants[key]
            setattr(self, key, self.field(key, len(rows), unit=unit, doc=doc))
            runtime.put(getattr(self, key), np.array([row[key] for row in rows]))
        if self.yields:
            self._strengths([sheet.material.strength for sheet in sheets])

    def numbers(self, key: str) -> list[float]:
        """A constant of each sheet, as the kernels read it."""
        return runtime.get(getattr(self, key), len(self.sheets)).astype(np.float64).tolist()

    def _constants(self, sheet: Sheet) -> dict[str, float]:
        material, thickness, width = sheet
        damage: Any = material.damage
        values: dict[str, Any] = {"young": material.young, "poisson": material.poisson, "thickness": thickness}
        if self.damages and not self.yields:
            values |= {"threshold": damage.threshold, "A": damage.A, "B": damage.B}
        if self.damages and self.yields:
            values |= {
                "eps_d": damage.threshold,
                "eps_r": _rupture(material, width, thickness),
                "D_c": damage.critical,
            }
        if material.delay is not None:
            values |= {"a": material.delay.a, "tau_c": material.delay.tau_c}
        if self.breaks:
            values |= {"critical": material.critical_damage}
        if self.yields:
            values |= _strength(material.strength)
        return values

    def _strengths(self, strengths: Sequence[Any]) -> None:
        """What strengths have beside numbers; `first` (B,) [Pa] is the yield stress before any plastic strain."""
        one = strengths[0]
        self.tabulated = one.kind == "table"
        self.rated = one.kind == "johnson_cook"
        self.layers = one.layers or 0
        self.exact = runtime.current().real == ti.f64
        self.first = np.array([_strength(strength)["yield_stress"] for strength in strengths])
        if self.tabulated:
            counts = [len(strength.points) for strength in strengths]
            self.points = self.field("points", sum(counts), 2, doc="plastic strain, yield stress [Pa]")
            self.first_point = self.field("first_point", len(counts), dtype="i32", doc="where the points of a body begin")
            self.n_points = self.field("n_points", len(counts), dtype="i32", doc="how many points a body has")
            runtime.put(self.points, np.concatenate([np.array(strength.points) for strength in strengths]))
            runtime.put(self.first_point, np.cumsum([0, *counts[:-1]]).astype(np.int32))
            runtime.put(self.n_points, np.array(counts, np.int32))
        if self.layers:
            zeta, weight = np.polynomial.legendre.leggauss(self.layers)
            self.zeta = self.field("zeta", self.layers, doc="place of a layer in the thickness, -1 to 1")
            self.weight = self.field("weight", self.layers, doc="share of a layer in the thickness")
            runtime.put(self.zeta, zeta)
            runtime.put(self.weight, 0.5 * weight)


def _strength(strength: Any) -> dict[str, float]:
    """The numbers of a strength."""
    values = {"alpha": strength.alpha, "kappa": strength.kappa}
    if strength.kind == "table":
        return values | {"yield_stress": strength.points[0][1]}
    if strength.kind == "perfect":
        return values | {"hardening": 0.0, "exponent": 1.0, "yield_stress": strength.yield_stress}
    values |= {"hardening": strength.B, "exponent": strength.n, "yield_stress": strength.A}
    if strength.kind == "johnson_cook":
        values |= {"C": strength.C, "rate0": strength.rate0}
    return values


def _rupture(material: Material, width: float, thickness: float) -> float:
    """Plastic strain of a cell at which its ductile damage is complete."""
    rupture = rupture_strain(material, width, thickness)
    damage: Any = material.damage
    if rupture <= damage.threshold:
        raise SceneError(
            f"material '{material.name}': a cell of {1e3 * width:.3g} mm in a sheet of {1e3 * thickness:.3g} mm breaks at a mean strain of"
            f" {rupture:.3g}, before its damage starts at {damage.threshold:g}; lower the spacing, or set damage.necks to false"
        )
    return rupture
