"""One fluid in the leap-frog of the shell (world/step.py): v at half steps, x and density at full ones.

    follow()           lists, where they are worn out; records of the particles at x_n
    (wetting)          writes what the particles find beyond the fluid
    rates()            pressure, force f_n, density rate at x_n
    (contact)          writes push_n
    kick_and_drift()   v_n+1/2 = v_n-1/2 + dt_n (f_n + push_n) / m, walls, x_n+1 = x_n + dt v_n+1/2

A wall is a pinball's: the normal velocity at the half step may close the gap to D/2 and no more (T 3.8 with a gap).
Energies belong to time n as in step.py; gravity's work is that of a potential, exactly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ... import runtime
from ...numerics.neighbours import Neighbours
from ...numerics.reduce import Reducer
from ...pool import Pool
from .motion import drift, stored_energy
from .packing import even_out
from .pairs import FluidPairs
from .pool import FluidParticles
from .said import Fluid, ShellFill, Wall
from .surroundings import Surroundings
from .walls import Walls

LIMIT = 0.515  # h / c: the step that is stable with alpha up to 1.5 (docs/method.md)
ALONG = 1.22  # 1 / gamma of a layer at D/2 (couplings/wetted/wetted.py): so much faster it swings along the wall
STIFF, SWING = (
    1.41,
    0.64,
)  # (2 D w)^2 of a layer at D/4, where pinballs stop it (couplings/wetted/wetted.py); omega dt, some room below 0.70


@dataclass(frozen=True)
class Constants:
    """What the pass has to know of a fluid."""

    density: float  # kg/m3
    sound: float  # m/s
    gamma: float  # Tait's; 0: acoustic
    least: float  # Pa
    support: float  # h / D
    alpha: float
    beta: float
    delta: float

    @property
    def stiffness(self) -> float:
        """rho_0 c^2 [Pa]."""
        return self.density * self.sound**2


class FluidBody(Pool):
    """A Fluid of the scene at work. `p` the pool (x, v, mass, force, push, id), `near` cells and lists, `surroundings` what it wets, None
    where there is nothing."""

    kept = ("dt", "injected", "fallen_from", "compressed", "sorts")

    def __init__(
        self,
        fluid: Fluid,
        points: np.ndarray,
        spacing: float,
        mass: float,
        gravity: Sequence[float] = (0.0, 0.0, 0.0),
        walls: Sequence[Wall] = (),
        skin: float = 0.15,
        name: str = "fluid",
    ):
        """points (N, 3) [m], spacing D_0 [m] and mass [kg] of one particle: bodies.fluid.fill.Filling; gravity [m/s2]; skin of the lists
        in spacings. `start` is to be called once what it wets is there."""
        super().__init__(f"{name}.sums")
        water = fluid.water
        self.fluid = fluid
        self.water = Constants(
            water.density, water.sound, getattr(water.law, "gamma", 0.0), -1e301 if water.tension is None else -water.tension,
            fluid.support, fluid.alpha, fluid.beta, fluid.delta,
        )  # fmt: skip
        self.gravity = np.asarray(gravity, float)
        self.sorts = 0
        self.p = p = FluidParticles(name, points, mass, spacing)
        self.skin = skin * spacing
        # 1e-3: supports grow by that at s = -0.3 %; of water torn further apart the lists may miss pairs at the very rim,
        # where W' is below 3e-5 of its largest value, on both sides alike
        reach = 2.0 * fluid.support * spacing * (1.0 + 1e-3) + self.skin
        self.near = Neighbours(f"{name}.lists", p.x, p.n, reach, spacing, np.array([points.min(axis=0), points.max(axis=0)]))
        self.walls = Walls(f"{name}.walls", walls)
        self.origin = points.mean(axis=0)
        self.points = points  # (N, 3) m, at t = 0
        self.surroundings: Surroundings | None = None
        self.pairs = FluidPairs(p, self.near, self.water, self.walls, self.gravity, self.origin)
        self.reducer = Reducer(p.n)
        self.compressed = self.injected = self.fallen_from = self.dt = 0.0

    def surround(self, surroundings: Surroundings) -> None:
        """What the particles find beyond the fluid, given before the first step."""
        self.surroundings = self.pairs.wet = surroundings
        self.pairs.wets = True

    def start(self) -> None:
        """The particles as they are at t = 0: even, moving as the scene says, under the pressure of what stands above them."""
        fluid, water, p = self.fluid, self.water, self.p
        if self.surroundings is not None and isinstance(fluid.fill, ShellFill):
            self.sort()
            self.points = even_out(self, fluid.fill.axis, fluid.fill.level)
            runtime.put(p.x, self.points)
            runtime.put(p.id, np.arange(p.n, dtype=np.int32))
        v = np.tile(np.asarray(fluid.velocity, float), (p.n, 1))
        runtime.put(p.v, v)
        if fluid.hydrostatic and self.gravity.any():
            depth = self.points @ (self.gravity / np.linalg.norm(self.gravity))
            pressure = water.density * np.linalg.norm(self.gravity) * (depth - depth.min() + 0.5 * p.spacing)
            runtime.put(p.s, self.compression(pressure))
        self.compressed = self.stored()  # J, at t = 0
        self.injected = 0.5 * p.one * float((v**2).sum()) + self.compressed  # J
        self.fallen_from = self._potential(0.0)
        self.sort()
        if self.surroundings is not None:
            self.pairs.pack(0.0)
            self.surroundings.see(True, 0.0)

    @property
    def inverse(self) -> float:
        """1 / 2h at rest [1/m]."""
        return 0.5 / (self.water.support * self.p.spacing)

    def compression(self, pressure: np.ndarray) -> np.ndarray:
        """s of a pressure [Pa] (NumPy; the law itself is in laws/)."""
        w = self.water
        if w.gamma == 0.0:
            return pressure / w.stiffness
        return np.expm1(np.log1p(w.gamma * pressure / w.stiffness) / w.gamma)

    def pressure(self) -> np.ndarray:
        """(N,) p [Pa] that the density gives."""
        w, s = self.water, runtime.get(self.p.s, self.p.n).astype(float)
        p = w.stiffness * s if w.gamma == 0.0 else w.stiffness / w.gamma * np.expm1(w.gamma * np.log1p(s))
        return np.maximum(p, w.least)

    def sort(self) -> None:
        """The particles in the order of their cells, and their lists."""
        self.near.order()
        self.p.reorder(self.near.source)
        self.near.list()
        self.sorts += 1

    def follow(self, dt_before: float) -> bool:
        """Lists that still hold, and records of the particles where they are now; True when they were put in another order. dt_before led
        here [s], 0 at the start."""
        moved, _ = self.near.moved()
        worn = moved >= self.skin
        if worn:
            self.sort()
        self.pairs.pack(dt_before)
        return worn

    def rates(self, dt_before: float, dt: float) -> None:
        """Forces and density rates at the positions now, once all around are known; dt [s] will lead on."""
        self.pairs.act(dt_before, dt)

    def kick_and_drift(self, dt_before: float, dt: float, pushed: bool = False) -> None:
        """v to the next half step, x to the next full one. pushed: contact has written p.push."""
        drift(self.p, self.walls, self.p.n, dt_before, dt, self.p.spacing, int(pushed))
        self.dt = dt

    def stable_dt(self) -> float:
        """Largest stable step [s] (before any safety): LIMIT h / (c + |v|), shorter where a light shell swings against its water.

        A body of mass m per area between two layers of water swings with omega = c/D sqrt(STIFF (1 + 2 rho D / m)); the one pass of
        fluid_pairs is stable up to omega dt = 0.70 (docs/method.md, 11)."""
        pace = self.p.spacing / (self.water.sound + self.fastest())
        longest = LIMIT * self.water.support * pace
        if self.surroundings is not None:
            swings = STIFF * (1.0 + 2.0 * self.water.density * self.p.spacing / self.surroundings.lightest)
            longest = min(longest / ALONG, SWING * pace / math.sqrt(swings))
        return longest

    def fastest(self) -> float:
        """Largest speed [m/s]; inf when a velocity is not finite."""
        return self.reducer.largest(self.p.v, self.p.n)

    def stored(self) -> float:
        """Energy of compression [J]."""
        return stored_energy(self.pairs, self.reducer)

    def energies(self) -> dict[str, float]:
        """Ledger [J] at the time of the last rates(), as in world/ledger.py. Their sum is kept:
        kinetic + elastic + viscous + diffused + lag = external + injected."""
        total, p = self.reducer.total, self.p
        external = total(p.work, p.n) + self._potential(self.dt) - self.fallen_from
        return {
            "kinetic": total(p.kinetic, p.n),
            "elastic": self.stored(),
            "viscous": total(p.viscous, p.n),
            "diffused": total(p.diffused, p.n),
            "lag": total(p.lag, p.n),
            "external": external,
            "injected": self.injected,
        }

    def _potential(self, dt: float) -> float:
        """Work that gravity has done since x = 0 [J], dt before the positions now."""
        if not self.gravity.any():
            return 0.0
        p = self.p
        x = runtime.get(p.x, p.n) - dt * runtime.get(p.v, p.n)
        return float(p.one * (x @ self.gravity).sum())

    def pools(self) -> list[Pool]:
        """All that is kept, in the order in which a restart renews it."""
        return [self.p, self.near, self.walls, self]

    def frame(self) -> dict[str, np.ndarray]:
        """points (N, 3) [m], velocity [m/s], pressure [Pa], density [kg/m3], in the order of the start."""
        p = self.p
        back = np.argsort(runtime.get(p.id, p.n))
        return {
            "points": runtime.get(p.x, p.n)[back],
            "velocity": runtime.get(p.v, p.n)[back].astype(np.float64),
            "pressure": self.pressure()[back],
            "density": self.water.density * (1.0 + runtime.get(p.s, p.n)[back].astype(np.float64)),
        }
