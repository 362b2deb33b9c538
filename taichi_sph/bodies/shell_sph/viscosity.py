"""Artificial viscosity between pairs of shell nodes (T 2.35 to 2.38).

    mu_ij = (v_i - v_j) . r_ij / (|x_i - x_j| + eps)          r_ij = (x_i - x_j) / |x_i - x_j|,  eps = 0.1 h
    Pi_ij = rho (-alpha c h mu_ij + beta h^2 mu_ij^2)         while they approach (mu < 0), else 0
    f_i   = -e A_i sum_j A_j Pi_ij dW/dr(|X_i - X_j|) r_ij

and, where the shell bends, with the mean director s_ij of the pair,

    psi_ij = (v_i - v_j) . s_ij / (|x_i - x_j| + eps),   tau_ij = -rho gamma c h psi_ij,   f_i += ... tau_ij ... s_ij

tau acts for both signs of psi: as printed (only psi <= 0) the two nodes of a pair would not feel opposite forces.

The kernel is that of the reference configuration (total Lagrangian). Where the spacing is even, the forces of a pair are equal and
opposite along its line, so momentum and moment of momentum are kept; on irregular sets each node uses its own h.
"""

import math
from typing import Any

from ...numerics.kernel import CONSTANT, b3_slope
from ...runtime import ti
from ..nodal.nodes import body_of
from ..shell.build import Model
from .damper import Damper
from .links import Links


class PairViscosity(Damper):
    """The term."""

    entry = "viscous"

    def __init__(self, model: Model, pairs: Links, area: Any, name: str = "viscosity"):
        super().__init__(name, model.nodes)
        self.material, self.pairs, self.area = model.material, pairs, area
        materials = [body.said.material for body in model.bodies]
        forms: list[Any] = [body.numerics.formulation for body in model.bodies]
        settings = [form.viscosity for form in forms]
        self.density = self.number("density", [m.density for m in materials], unit="kg/m3", doc="rho")
        self.sound = self.number("sound", [math.sqrt(m.young / m.density) for m in materials], unit="m/s", doc="c")
        for key in ("alpha", "beta", "gamma"):
            setattr(self, key, self.number(key, [getattr(s, key) for s in settings], unit="", doc=key))
        self.bends = model.nodes.bends

    def add(self, dt: float) -> None:
        """Add the forces; book what they take over dt."""
        _add(self, self.nodes.n, dt)


@ti.kernel
def _add(term: ti.template(), n: ti.i32, dt: float):
    for i in range(n):
        b = body_of(term.nodes, i)
        rho, c, alpha, beta, gamma = term.density[b], term.sound[b], term.alpha[b], term.beta[b], term.gamma[b]
        total = term.nodes.force[i] * 0.0
        h = ti.cast(term.pairs.h[i], float)
        scale = ti.static(CONSTANT[2]) / (h * h * h)
        vi = term.nodes.v[i]
        for k in range(term.pairs.start[i], term.pairs.start[i + 1]):
            j = term.pairs.source[k]
            if j != i and term.pairs.cut[k] == 0:
                vij = vi - term.nodes.v[j]
                X = term.nodes.X[i] - term.nodes.X[j]
                x = term.nodes.u[i] - term.nodes.u[j]
                for a in ti.static(range(term.nodes.dim)):
                    x[a] += ti.cast(X[a], float)
                slope = scale * b3_slope(ti.cast(X.norm(), float) / h)
                r = x.norm()
                if ti.static(term.bends):
                    across = (term.nodes.N[i] + term.nodes.d[i] + term.nodes.N[j] + term.nodes.d[j]).normalized()
                    tau = -rho * gamma * c * h * vij.dot(across) / (r + 0.1 * h)
                    total -= term.area[j] * tau * slope * across
                approach = vij.dot(x)
                if approach < 0.0:
                    mu = approach / r / (r + 0.1 * h)
                    Pi = rho * (-alpha * c * h * mu + beta * h * h * mu * mu)
                    total -= term.area[j] * Pi * slope / r * x
        total *= term.material.thickness[b] * term.area[i]
        term.nodes.force[i] += total
        term.work[i] -= dt * total.dot(vi)
