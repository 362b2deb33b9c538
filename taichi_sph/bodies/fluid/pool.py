"""The pool of fluid particles: data only. Particles stand in the order of their cells. The order changes; `id` tells who is who."""

from typing import Any

import numpy as np

from ... import runtime
from ...pool import Pool
from ...runtime import ti
from . import columns

# D leaves D_0 by no more than this: beyond, water is a spray and its density no measure of distances
NARROWEST, WIDEST = 0.90, 1.03


class FluidParticles(Pool):
    """n particles of one or several fluids. `of` (N,): number of each particle's fluid in the group, `parts` (N,): into how many along
    each axis the particle was split that it comes from, both by number at the start. `sized`: some were split; `finest` [m]: the least
    D_0."""

    def __init__(
        self, name: str, x: np.ndarray, of: np.ndarray, masses: np.ndarray, spacing: float, constants: np.ndarray, parts: np.ndarray
    ):
        """x (N, 3) [m]; masses (B,) [kg] of one whole particle of each fluid; spacing D_0 [m] of whole ones; constants
        (B, columns.COUNT)."""
        super().__init__(name)
        self.n, self.spacing, self.of, self.masses, self.parts = len(x), spacing, of.astype(np.int32), masses, parts
        self.sized, self.finest = bool((parts > 1).any()), spacing / int(parts.max())
        n, new = self.n, self._new
        # what goes along when a particle changes its place: fields, their components (0: a scalar) and first columns in scratch
        self.moving: list[Any] = []
        self.components: list[int] = []
        self.column: list[int] = []
        self.constants = new("constants", len(masses), columns.COUNT, "f64", doc="of each fluid: STIFFNESS to ORIGIN")
        self.body = new("body", n, dtype="i32", keeps=True, doc="number of its fluid in the group", moves=True)
        # f64 always, or a step would be lost in its rounding
        self.x = new("x", n, 3, "f64", unit="m", keeps=True, doc="place", moves=True)
        self.v = new("v", n, 3, unit="m/s", keeps=True, doc="velocity at the half step before", moves=True)
        self.mass = new("mass", n, unit="kg", doc="mass of the particle", moves=True)
        if self.sized:
            self.size = new("size", n, doc="D_0 of the particle over that of a whole one", moves=True)
        self.s = new("s", n, keeps=True, doc="rho / rho_0 - 1", moves=True)
        self.rate = new("rate", n, unit="1/s", keeps=True, doc="of s, over the step before", moves=True)
        self.rate_before = new("rate_before", n, unit="1/s", keeps=True, doc="of s, over the step before that one", moves=True)
        self.missed = new("missed", n, unit="Pa", keeps=True, doc="pressure that the density gives, less the one that acted", moves=True)
        self.force = new("force", n, 3, unit="N", doc="pressure, viscosity, gravity")
        self.push = new("push", n, 3, unit="N", doc="contact; whoever writes it writes every particle")
        self.id = new("id", n, dtype="i32", keeps=True, doc="number at the start", moves=True)
        self.pair = new("pair", n, 8, doc="x y z D | v p: what a neighbour needs, one line of the cache in f64")
        # energies so far belong to places in the pool, not to particles: only their sums mean something
        self.viscous = new("viscous", n, dtype="f64", unit="J", keeps=True, doc="taken by viscosity")
        self.diffused = new("diffused", n, dtype="f64", unit="J", keeps=True, doc="taken by the diffusion of density")
        self.lag = new("lag", n, dtype="f64", unit="J", keeps=True, doc="taken because pressure acts with an extrapolated density")
        self.work = new("work", n, dtype="f64", unit="J", keeps=True, doc="done by walls, up to time n")
        self.ahead = new("ahead", n, dtype="f64", unit="J", keeps=True, doc="what walls do on the way to n + 1")
        self.kinetic = new("kinetic", n, unit="J", keeps=True, doc="of the last step", moves=True)
        wide = max(16, sum(max(size, 1) for size in self.components))  # 16: two lines of the cache
        self.scratch = new("scratch", n, wide, "f64", doc="while the particles change their order")
        runtime.put(self.constants, constants)
        self.place(x)

    def _new(self, name: str, n: int, vector: int = 0, dtype: str = "real", moves: bool = False, **said: Any) -> Any:
        """A field. moves: its rows belong to the particles and change places with them."""
        made = self.field(name, n, vector, dtype, **said)
        if moves:
            self.column.append(sum(max(size, 1) for size in self.components))
            self.moving.append(made)
            self.components.append(vector)
        return made

    def renew(self) -> None:
        """Masses and sizes where the particles lie by now."""
        self._weigh(runtime.get(self.id, self.n))

    def _weigh(self, numbers: np.ndarray) -> None:
        """numbers (N,): which particle lies where."""
        runtime.put(self.mass, self.weights[numbers])
        if self.sized:
            runtime.put(self.size, 1.0 / self.parts[numbers])

    @property
    def weights(self) -> np.ndarray:
        """(N,) masses of the particles [kg], by number at the start."""
        return self.masses[self.of] / self.parts**3

    @property
    def own(self) -> np.ndarray:
        """(N,) D_0 of the particles [m], by number at the start."""
        return runtime.get(self.constants, len(self.masses))[self.of, columns.OWN] / self.parts

    @property
    def one(self) -> float:
        """Mass of one particle [kg], where all are alike."""
        (mass,) = self.masses
        return float(mass)

    def place(self, x: np.ndarray) -> None:
        """The particles in the order of their numbers, at x (N, 3) [m]."""
        runtime.put(self.x, x)
        self._weigh(np.arange(self.n))
        runtime.put(self.id, np.arange(self.n, dtype=np.int32))
        runtime.put(self.body, self.of)

    def reorder(self, source: Any) -> None:
        """Move the particles: the one at place k comes from source[k]."""
        _reorder(self, source, self.n)


@ti.kernel
def _reorder(f: ti.template(), source: ti.template(), n: ti.i32):
    """scratch is f64: whole numbers and single precision pass through it unchanged."""
    for k in range(n):
        i = source[k]
        for m in ti.static(range(len(f.moving))):
            if ti.static(f.components[m] > 0):
                for c in ti.static(range(f.components[m])):
                    f.scratch[k][f.column[m] + c] = f.moving[m][i][c]
            else:
                f.scratch[k][f.column[m]] = f.moving[m][i]
    for k in range(n):
        for m in ti.static(range(len(f.moving))):
            if ti.static(f.components[m] > 0):
                for c in ti.static(range(f.components[m])):
                    f.moving[m][k][c] = ti.cast(f.scratch[k][f.column[m] + c], f.moving[m].dtype)
            else:
                f.moving[m][k] = ti.cast(f.scratch[k][f.column[m]], f.moving[m].dtype)
