"""The pool of fluid particles. Data only, in the order of their cells, which changes: `id` tells who is who."""

from typing import Any

import numpy as np

from ... import runtime
from ...pool import Pool
from ...runtime import ti
from . import columns

# D leaves D_0 by no more than this: beyond, water is a spray and its density no measure of distances
NARROWEST, WIDEST = 0.90, 1.03


class FluidParticles(Pool):
    """n particles of one or several fluids. `of` (N,): number of each particle's fluid in the group, by number at the start."""

    def __init__(self, name: str, x: np.ndarray, of: np.ndarray, masses: np.ndarray, spacing: float, constants: np.ndarray):
        """x (N, 3) [m]; masses (B,) of one particle of each fluid [kg]; spacing D_0 [m]; constants (B, columns.COUNT)."""
        super().__init__(name)
        self.n, self.spacing, self.of, self.masses = len(x), spacing, of.astype(np.int32), masses
        n, new = self.n, self.field
        self.constants = new("constants", len(masses), columns.COUNT, "f64", doc="of each fluid: STIFFNESS to OWN")
        self.body = new("body", n, dtype="i32", keeps=True, doc="number of its fluid in the group")
        # f64 always, or a step would be lost in its rounding
        self.x = new("x", n, 3, "f64", unit="m", keeps=True, doc="place")
        self.v = new("v", n, 3, unit="m/s", keeps=True, doc="velocity at the half step before")
        self.mass = new("mass", n, unit="kg", doc="mass of the particle")
        self.s = new("s", n, keeps=True, doc="rho / rho_0 - 1")
        self.rate = new("rate", n, unit="1/s", keeps=True, doc="of s, over the step before")
        self.rate_before = new("rate_before", n, unit="1/s", keeps=True, doc="of s, over the step before that one")
        self.missed = new("missed", n, unit="Pa", keeps=True, doc="pressure that the density gives, less the one that acted")
        self.force = new("force", n, 3, unit="N", doc="pressure, viscosity, gravity")
        self.push = new("push", n, 3, unit="N", doc="contact; whoever writes it writes every particle")
        self.id = new("id", n, dtype="i32", keeps=True, doc="number at the start")
        self.pair = new("pair", n, 8, doc="x y z D | v p: what a neighbour needs, one line of the cache in f64")
        # energies so far belong to places in the pool, not to particles: only their sums mean something
        self.viscous = new("viscous", n, dtype="f64", unit="J", keeps=True, doc="taken by viscosity")
        self.diffused = new("diffused", n, dtype="f64", unit="J", keeps=True, doc="taken by the diffusion of density")
        self.lag = new("lag", n, dtype="f64", unit="J", keeps=True, doc="taken because pressure acts with an extrapolated density")
        self.work = new("work", n, dtype="f64", unit="J", keeps=True, doc="done by walls, up to time n")
        self.ahead = new("ahead", n, dtype="f64", unit="J", keeps=True, doc="what walls do on the way to n + 1")
        self.kinetic = new("kinetic", n, unit="J", keeps=True, doc="of the last step")
        self.scratch = new("scratch", n, 16, "f64", doc="while the particles change their order")
        runtime.put(self.constants, constants)
        self.place(x)

    @property
    def one(self) -> float:
        """Mass of one particle [kg], where all are of one fluid."""
        (mass,) = self.masses
        return float(mass)

    def place(self, x: np.ndarray) -> None:
        """The particles in the order of their numbers, at x (N, 3) [m]."""
        runtime.put(self.x, x)
        runtime.put(self.mass, self.masses[self.of])
        runtime.put(self.id, np.arange(self.n, dtype=np.int32))
        runtime.put(self.body, self.of)

    def reorder(self, source: Any) -> None:
        """Move the particles: the one at place k comes from source[k]."""
        _reorder(self, source, self.n)


@ti.kernel
def _reorder(f: ti.template(), source: ti.template(), n: ti.i32):
    for k in range(n):
        i = source[k]
        for c in ti.static(range(3)):
            f.scratch[k][c] = f.x[i][c]
            f.scratch[k][3 + c] = f.v[i][c]
        f.scratch[k][6] = f.s[i]
        f.scratch[k][7] = f.rate[i]
        f.scratch[k][8] = f.rate_before[i]
        f.scratch[k][9] = f.missed[i]
        f.scratch[k][10] = f.id[i]
        f.scratch[k][11] = f.mass[i]
        f.scratch[k][12] = f.kinetic[i]
        f.scratch[k][13] = f.body[i]
    for k in range(n):
        for c in ti.static(range(3)):
            f.x[k][c] = f.scratch[k][c]
            f.v[k][c] = ti.cast(f.scratch[k][3 + c], float)
        f.s[k] = ti.cast(f.scratch[k][6], float)
        f.rate[k] = ti.cast(f.scratch[k][7], float)
        f.rate_before[k] = ti.cast(f.scratch[k][8], float)
        f.missed[k] = ti.cast(f.scratch[k][9], float)
        f.id[k] = ti.cast(f.scratch[k][10], ti.i32)
        f.mass[k] = ti.cast(f.scratch[k][11], float)
        f.kinetic[k] = ti.cast(f.scratch[k][12], float)
        f.body[k] = ti.cast(f.scratch[k][13], ti.i32)
