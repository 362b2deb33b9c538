"""The pool of fluid particles. Data only, in the order of their cells, which changes: `id` tells who is who."""

import numpy as np

from ... import runtime
from ...runtime import ti

# D leaves D_0 by no more than this: beyond, water is a spray and its density no measure of distances
NARROWEST, WIDEST = 0.90, 1.03


@ti.data_oriented
class FluidParticles:
    """n particles of one fluid, all of the same spacing D_0 and mass. State: x, v, s, rate, rate_before, missed, work, ahead."""

    def __init__(self, name: str, x: np.ndarray, mass: float, spacing: float):
        """x (N, 3) [m]; mass of one particle [kg]; spacing D_0 [m]."""
        self.name, self.n, self.spacing, self.one = name, len(x), spacing, mass
        n = self.n
        self.x = runtime.new(f"{name}.x", n, 3, "f64")  # m; f64 always, or a step would be lost in its rounding
        self.v = runtime.new(f"{name}.v", n, 3)  # m/s, at the half step before
        self.mass = runtime.new(f"{name}.mass", n)  # kg
        self.s = runtime.new(f"{name}.s", n)  # rho / rho_0 - 1
        self.rate = runtime.new(f"{name}.rate", n)  # 1/s, of s, over the step before
        self.rate_before = runtime.new(f"{name}.rate_before", n)  # 1/s, over the one before that
        self.missed = runtime.new(f"{name}.missed", n)  # Pa, pressure that the density gives minus the one that acted
        self.force = runtime.new(f"{name}.force", n, 3)  # N, pressure, viscosity, gravity
        self.push = runtime.new(f"{name}.push", n, 3)  # N, contact; whoever writes it writes every particle
        self.id = runtime.new(f"{name}.id", n, dtype="i32")  # number at the start
        # x y z D | v p: what a neighbour needs, one line of the cache (in f64)
        self.pair = runtime.new(f"{name}.pair", n, 8)
        # J so far, per place in the pool and not per particle: only the sums mean something
        self.viscous = runtime.new(f"{name}.viscous", n, dtype="f64")
        self.diffused = runtime.new(f"{name}.diffused", n, dtype="f64")
        self.lag = runtime.new(f"{name}.lag", n, dtype="f64")
        self.work = runtime.new(f"{name}.work", n, dtype="f64")  # by push and walls, up to time n
        self.ahead = runtime.new(f"{name}.ahead", n, dtype="f64")  # what they do on the way to n + 1
        self.kinetic = runtime.new(f"{name}.kinetic", n)  # J, of the last step
        self.scratch = runtime.new(f"{name}.scratch", n, 16, "f64")
        runtime.put(self.x, x)
        runtime.put(self.mass, np.full(n, mass))
        runtime.put(self.id, np.arange(n, dtype=np.int32))

    @property
    def history(self) -> dict[str, object]:
        """Every field that a restart needs, by name."""
        names = ("x", "v", "s", "rate", "rate_before", "missed", "id", "viscous", "diffused", "lag", "work", "ahead", "kinetic")
        return {name: getattr(self, name) for name in names}

    def reorder(self, source) -> None:
        """Move the particles: the one at place k comes from source[k]."""
        _take(self, source, self.n)
        _lay(self, self.n)


@ti.kernel
def _take(f: ti.template(), source: ti.template(), n: ti.i32):
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


@ti.kernel
def _lay(f: ti.template(), n: ti.i32):
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
