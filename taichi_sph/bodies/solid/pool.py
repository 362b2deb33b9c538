"""The pools of solids: cells with their stress points and coefficients, and constants of the materials."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ... import runtime
from ...geometry.solids import SolidMesh
from ...pool import Pool
from ...scene.laws import Material
from ..nodal.nodes import Nodes
from ..shell.pool import CONSTANTS, MaterialPool
from ..shell.sections import Sheet
from .table import Table

LEAST = 0.02  # of the stiffness of the residual: below it the patterns that it holds would grow in what flows

OWN = {  # constants beside those of shells: unit and meaning
    "lame": ("Pa", "Lame's first constant"),
    "shear": ("Pa", "G"),
    "bulk": ("Pa", "K"),
    "least": ("", "of the stiffness of the residual, what yielding and damage leave at least"),
    "density": ("kg/m3", "of the reference"),
    "sound": ("m/s", "speed of pressure waves"),
    "viscous": ("", "1: bulk viscosity acts"),
    "compression": ("Pa", "concrete: strength in compression"),
    "ratio": ("", "concrete: compression over tension"),
    "share": ("", "concrete: of the squares of negative principal strains"),
    "flattest": ("", "concrete: least principal stretch of a cell"),
    "loosest": ("", "concrete: volume of a broken cell over that of the reference, up to which it stays"),
    "room": ("K", "temperature at the start"),
    "melting": ("K", "temperature"),
    "softening": ("", "m, exponent of heat"),
    "warms": ("K m3/J", "rise of temperature by plastic work"),
    "gas_A": ("Pa", "explosive: A of its gas"),
    "gas_B": ("Pa", "explosive: B of its gas"),
    "R1": ("", "explosive"),
    "R2": ("", "explosive"),
    "omega": ("", "explosive"),
    "front": ("m/s", "explosive: speed of the detonation"),
}


class SolidMaterial(MaterialPool):
    """Constants of the materials, one row a body. `brittle`: of concrete; `heats`: temperature is followed; `principal`, `rubs`: of
    concrete, its strain of damage and whether rubble rubs; `burns`: an explosive; `damps`: some body has bulk viscosity."""

    constants = CONSTANTS | OWN

    def __init__(self, materials: Sequence[Material], viscous: Sequence[bool], name: str = "material"):
        damage, strength = materials[0].damage, materials[0].strength
        self.viscous = viscous
        self.brittle = damage is not None and damage.kind == "concrete"
        self.heats = getattr(strength, "heat", None) is not None
        self.principal = self.brittle and getattr(damage, "strain", "") == "principal"
        self.rubs = self.brittle and bool(getattr(damage, "rubble", False))
        self.flattens = self.brittle and getattr(damage, "flattest", None) is not None
        self.burns = materials[0].burns is not None
        self.damps = any(viscous)
        self.rows = iter(range(len(materials)))
        super().__init__([Sheet(material, 0.0) for material in materials], False, name)
        self.remembers = self.remembers or self.burns

    def _constants(self, sheet: Sheet) -> dict[str, float]:
        m = sheet.material
        values = {} if self.brittle else super()._constants(sheet)
        values = {key: value for key, value in values.items() if key not in ("thickness", "alpha", "kappa")}
        damage: Any = m.damage
        if self.brittle:
            values = {"young": m.young, "poisson": m.poisson, "threshold": damage.tension / m.young, "A": damage.A, "B": damage.B}
            values |= {"compression": damage.compression, "ratio": damage.compression / damage.tension, "share": damage.share}
            values["loosest"] = damage.loosest or 1.0
            if self.flattens:
                values["flattest"] = damage.flattest
            if m.delay is not None:
                values |= {"a": m.delay.a, "tau_c": m.delay.tau_c}
            if m.critical_damage is not None:
                values["critical"] = m.critical_damage
        lame = m.young * m.poisson / ((1.0 + m.poisson) * (1.0 - 2.0 * m.poisson))
        shear = 0.5 * m.young / (1.0 + m.poisson)
        values |= {"lame": lame, "shear": shear, "bulk": lame + 2.0 / 3.0 * shear, "density": m.density, "least": LEAST}
        values |= {"sound": float(np.sqrt((lame + 2.0 * shear) / m.density)), "viscous": float(self.viscous[next(self.rows)])}
        if self.heats:
            strength: Any = m.strength
            heat = strength.heat
            values |= {"room": heat.room, "melting": heat.melting, "softening": heat.m, "warms": heat.share / (m.density * heat.capacity)}
        if (gas := m.burns) is not None:
            values |= {"gas_A": gas.A, "gas_B": gas.B, "R1": gas.R1, "R2": gas.R2, "omega": gas.omega, "front": gas.speed}
        return values


class SolidCells(Pool):
    """Cells, a stress point each: coefficients and faces (constant), history, energies, and the forces on the nodes of each entry."""

    def __init__(
        self, mesh: SolidMesh, table: Table, counts: np.ndarray, pull: np.ndarray, nodes: Nodes, material: SolidMaterial, body: np.ndarray,
        name: str = "cells",
    ):  # fmt: skip
        """counts (M,): what a cell counts, 1 where it is not one of two; pull (M,) [N/m]: stiffness of the residual at rest, of a cell that
        counts 1; body (M,): number of the body."""
        super().__init__(name)
        self.n = n = len(mesh.cells)
        self.several = nodes.several
        k = len(table.node)
        field, put = self.field, runtime.put
        self.body = field("body", n, dtype="i32", doc="number of its body in the group")
        self.first = field("first", n + 1, dtype="i32", doc="where the entries of a cell begin, its corners before all others")
        self.corners = field("corners", n, dtype="i32", doc="number of corners, 8 or 4")
        self.node = field("node", k, dtype="i32", doc="of an entry")
        self.B = field("B", k, 3, unit="1/m", doc="of an entry: mean gradient of the function of its node over the cell")
        self.push = field("push", k, 3, unit="N", doc="of an entry: force of the cell on its node")
        self.of_node = field("of_node", nodes.n + 1, dtype="i32", doc="where the entries of a node begin in entry")
        self.entry = field("entry", k, dtype="i32", doc="entries, by node")
        self.volume = field("volume", n, unit="m3", doc="of the reference, times what the cell counts")
        self.pull = field("pull", n, unit="N/m", doc="stiffness of the residual of the corners, while sound, times what the cell counts")
        self.size = field("size", n, unit="m", doc="width across which bulk viscosity acts")
        self.stored = field("stored", n, dtype="f64", unit="J", doc="elastic energy of the last step", keeps=True)
        self.stiffer = field("stiffer", n, doc="square of the frequency over that at rest, by the stretch")
        self.broken = field("broken", n, dtype="i32", doc="1: carries nothing any more", keeps=True, shown="broken")
        order = np.argsort(table.node, kind="stable")
        put(self.body, body.astype(np.int32))
        put(self.first, table.first)
        put(self.corners, mesh.corners)
        put(self.node, table.node)
        put(self.B, table.B)
        put(self.of_node, np.r_[0, np.cumsum(np.bincount(table.node, minlength=nodes.n))].astype(np.int32))
        put(self.entry, order.astype(np.int32))
        put(self.volume, counts * mesh.volumes)
        put(self.pull, counts * pull)
        put(self.size, np.cbrt(mesh.volumes))
        if material.damps:
            self.damped = field("damped", n, dtype="f64", unit="J", doc="taken by bulk viscosity so far", keeps=True)
            self.bulk = field("bulk", n, unit="Pa", doc="pressure of bulk viscosity of the last step", keeps=True)
            self.dilation = field("dilation", n, doc="J - 1, of the last step", keeps=True)
        if material.breaks:
            self.n_new = field("n_new", 1, dtype="i32", doc="cells that broke in this step")
            self.released = field("released", n, dtype="f64", unit="J", doc="what a cell stored when it broke", keeps=True)
            self.rupture_time = field(
                "rupture_time", n, dtype="f64", unit="s", doc="nan while sound", keeps=True, shown="rupture_time", unset=True
            )
            put(self.rupture_time, np.full(n, np.nan))
        if material.remembers:
            self._residual()
            (self._gas if material.burns else self._history)(material, body)

    def _residual(self) -> None:
        """What becomes of the stiffness of the residual."""
        n, field = self.n, self.field
        self.uneven = field("uneven", n, unit="m2", doc="sum of the squares of the residuals of the last step", keeps=True)
        self.softer = field("softer", n, doc="stiffness of the residual over that while sound", keeps=True)
        self.lost = field("lost", n, dtype="f64", unit="J", doc="taken by damage, or from the residual of a gas, so far", keeps=True)
        runtime.put(self.softer, np.ones(n))

    def _gas(self, material: SolidMaterial, body: np.ndarray) -> None:
        """What explosives keep (explosive.py); `start` writes when they are lit."""
        n, field = self.n, self.field
        self.lit = field("lit", n, dtype="f64", unit="s", doc="when the front reaches the middle of a cell")
        self.burnt = field("burnt", n, doc="share of the cell that is gas", keeps=True, shown="burnt")
        self.pressure = field("pressure", n, unit="Pa", doc="of the gas", keeps=True, shown="pressure")
        self.viscosity = field("viscosity", n, unit="Pa", doc="bulk viscosity of the gas", keeps=True)
        self.energy = field("energy", n, unit="J/m3", doc="of the gas, its chemical one with it, per volume of the reference", keeps=True)
        self.held = field("held", n, unit="J/m3", doc="elastic energy of what is not burnt", keeps=True)
        self.stress = field("stress", n, 9, unit="Pa", doc="P, first of Piola and Kirchhoff, of the last step, row by row", keeps=True)
        self.gradient = field("gradient", n, 9, doc="F of the last step, row by row", keeps=True)
        runtime.put(self.gradient, np.tile(np.eye(3).ravel(), (n, 1)))

    def _history(self, material: SolidMaterial, body: np.ndarray) -> None:
        """What laws that remember keep (metal.py, concrete.py)."""
        n, field = self.n, self.field
        self.strain = field("strain", n, 6, doc="E, Green-Lagrange", keeps=True, shown="strain")
        self.back = field("back", n, 6, doc="U^-1, inverse stretch", keeps=True)
        self.stress = field(
            "stress", n, 6, unit="Pa", doc="effective Kirchhoff stress, turned back; of concrete the deviator of the whole", keeps=True
        )
        runtime.put(self.back, np.tile([1.0, 1.0, 1.0, 0.0, 0.0, 0.0], (n, 1)))
        if material.damages:
            self.damage = field("damage", n, doc="D, as the law alone would have it", keeps=True)
            self.delayed = field("delayed", n, doc="D_r <= D, what the stress feels (T 2.73)", keeps=True, shown="damage")
        if material.brittle:
            self.shape = field("shape", n, 6, doc="deviator of the logarithmic strain so far", keeps=True)
            self.rubble = field("rubble", n, 6, unit="Pa", doc="deviator of what is broken", keeps=True)
        if material.yields:
            self.plastic = field("plastic", n, doc="p, cumulated plastic strain", keeps=True, shown="plastic")
            self.hardening = field("hardening", n, doc="lambda <= p (T 2.78)", keeps=True)
            self.flow = field("flow", n, unit="Pa", doc="yield stress now, at rates and temperatures that do not count", keeps=True)
            self.dissipated = field("dissipated", n, dtype="f64", unit="J", doc="taken by plastic flow so far", keeps=True)
            runtime.put(self.flow, material.first[body])
            if material.rated:
                self.rate = field("rate", n, unit="1/s", doc="equivalent strain rate of the last step", keeps=True)
            if material.heats:
                self.temperature = field("temperature", n, unit="K", doc="of the cell", keeps=True, shown="temperature")
                runtime.put(self.temperature, np.array(material.numbers("room"))[body])
