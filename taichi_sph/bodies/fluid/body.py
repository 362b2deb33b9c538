"""Fluids in the leap-frog of the shell (world/step.py): v at half steps, x and density at full ones.

    follow()           lists, where they are worn out; records of the particles at x_n
    (wetting)          writes what the particles find beyond the fluid
    rates()            pressure, force f_n, density rate at x_n
    (contact)          writes push_n
    kick_and_drift()   v_n+1/2 = v_n-1/2 + dt_n (f_n + push_n) / m, walls, x_n+1 = x_n + dt v_n+1/2

A plane acts as contact of pinballs does: the normal velocity at the half step may close the gap to D/2 and no more (T 3.8 with a gap).
Energies belong to time n as in step.py; gravity's work is that of a potential, exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ... import runtime
from ...laws import eos_acoustic, eos_tait
from ...numerics.neighbours import Neighbours, Sizes
from ...numerics.reduce import Reducer
from ...pool import Pool
from ..body import Span
from . import columns
from .fill import Filling
from .motion import drift, stored_energy
from .packing import even_out, settle_jumps
from .pairs import FluidPairs
from .pool import FluidParticles
from .said import Fluid, FluidBox, ShellFill, Wall
from .step import stable_step
from .surroundings import Surroundings
from .walls import Walls

FAST = 0.4  # spacings of finer water: its list's skin, for that is where it moves fast
LIMITER = 3.0  # of Zhang, Hu and Adams 2017
ANY = -1e301  # Pa, the least pressure of a fluid that bears any tension


def constants(fluid: Fluid, own: float, spacing: float, gravity: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """(columns.COUNT,) what the pass has to know of a fluid of D_0 = own [m] in a group of that spacing [m]."""
    water, h, whole = fluid.water, fluid.support * own, fluid.support * spacing
    found = np.zeros(columns.COUNT)
    found[columns.STIFFNESS] = water.density * water.sound**2
    found[columns.GAMMA] = getattr(water.law, "gamma", 0.0)
    found[columns.LEAST] = ANY if water.tension is None else -water.tension
    found[columns.DENSITY], found[columns.SOUND2] = water.density, water.sound**2
    found[columns.SPACING], found[columns.INVERSE], found[columns.EPS2], found[columns.OWN] = (
        spacing,
        0.5 / whole,
        0.01 * whole * whole,
        own,
    )
    if fluid.dissipation == "riemann":
        found[columns.LINEAR], found[columns.QUADRATIC] = water.density * water.sound, LIMITER * water.density
    else:
        found[columns.LINEAR] = fluid.alpha * water.density * water.sound * h
        found[columns.QUADRATIC] = fluid.beta * water.density * h * h
    found[columns.DIFFUSION] = 2.0 * fluid.delta * h / (water.density * water.sound)
    found[columns.GRAVITY : columns.GRAVITY + 3], found[columns.ORIGIN : columns.ORIGIN + 3] = gravity, origin
    return found


class FluidBody(Pool):
    """Fluids of one lattice and one law at work. `p` the pool (x, v, mass, force, push, id), `near` cells and lists, `surroundings` what
    they wet, None where there is nothing; `points` (N, 3) [m] and `spans` of the fluids, by number at the start."""

    kept = ("dt", "injected", "fallen_from", "compressed", "sorts")

    def __init__(
        self,
        fluids: Sequence[tuple[Fluid, Filling]],
        gravity: Sequence[float] = (0.0, 0.0, 0.0),
        walls: Sequence[Wall] = (),
        skin: float = 0.15,
        name: str = "fluid",
    ):
        """gravity [m/s2]; skin of the lists in spacings. `start` is to be called once what they wet is there."""
        super().__init__(f"{name}.sums")
        self.fluids = [fluid for fluid, _ in fluids]
        self.fillings = fillings = [filling for _, filling in fluids]
        first = np.cumsum([0, *(len(filling.points) for filling in fillings)]).tolist()
        self.spans = [Span(fluid.name, k, n - k) for fluid, k, n in zip(self.fluids, first, first[1:])]
        spacing, masses = max(filling.spacing for filling in fillings), np.array([filling.mass for filling in fillings])
        parts = np.concatenate([filling.parts for filling in fillings])
        self.gravity = np.asarray(gravity, float)
        self.points = points = np.concatenate([filling.points for filling in fillings])
        self.origin = points.mean(axis=0)
        self.constants = np.array([constants(fluid, filling.spacing, spacing, self.gravity, self.origin) for fluid, filling in fluids])
        self.gamma = float(self.constants[:, columns.GAMMA].max())
        self.stiffens = self.gamma > 0.0
        self.law = eos_tait if self.stiffens else eos_acoustic
        self.support, self.sound = self.fluids[0].support, max(fluid.water.sound for fluid in self.fluids)
        self.sorts = 0
        of = np.repeat(np.arange(len(fluids)), np.diff(first))
        self.sizes = np.unique(parts).tolist()  # how many times smaller than D particles are
        self.p = p = FluidParticles(name, points, of, masses, spacing, self.constants, parts)
        self.skin = (max(skin, FAST) if p.sized else skin) * p.finest
        # 1e-3: supports grow by that at s = -0.3 %; of water torn further apart the lists may miss pairs at the very rim,
        # where W' is below 3e-5 of its largest value, on both sides alike
        reach = 2.0 * self.support * spacing * (1.0 + 1e-3) + self.skin
        box = np.array([points.min(axis=0), points.max(axis=0)])
        sizes = Sizes(p.size, tuple(1.0 / np.unique(parts)), self.skin) if p.sized else None
        self.near = Neighbours(f"{name}.lists", p.x, p.n, reach, spacing, box, sizes)
        self.walls = Walls(f"{name}.walls", walls)
        self.surroundings: Surroundings | None = None
        cut = bool((self.constants[:, columns.LEAST] > ANY).any())
        riemann, mean = self.fluids[0].dissipation == "riemann", self.fluids[0].divergence == "mean"
        self.pairs = FluidPairs(p, self.near, self.walls, self.support, self.stiffens, cut, riemann, mean)
        self.reducer = Reducer(p.n, f"{name}.reduce")
        self.compressed = self.injected = self.fallen_from = self.dt = 0.0

    def surround(self, surroundings: Surroundings) -> None:
        """What the particles find beyond the fluid, given before the first step."""
        self.surroundings = surroundings
        self.pairs.wet = surroundings
        self.pairs.wets = True

    def start(self) -> None:
        """The particles as they are at t = 0: even, moving as the scene says, under the pressure of what stands above them."""
        p = self.p
        tank = next((fluid.fill for fluid in self.fluids if isinstance(fluid.fill, ShellFill)), None)
        if self.surroundings is not None and tank is not None:
            self.sort()
            axes = [getattr(fluid.fill, "axis", tank.axis) for fluid in self.fluids]
            levels = [self._level(fluid, axis) for fluid, axis in zip(self.fluids, axes)]
            even = np.split(even_out(self, axes, levels), [span.first for span in self.spans[1:]])
            self.points = np.concatenate([filling.kept_off(points) for filling, points in zip(self.fillings, even)])
            p.place(self.points)
        elif p.sized:
            self.sort()
            self.points = settle_jumps(self)
            p.place(self.points)
        v = np.concatenate([np.tile(np.asarray(fluid.velocity, float), (span.n, 1)) for fluid, span in zip(self.fluids, self.spans)])
        runtime.put(p.v, v)
        if self.gravity.any() or any(fluid.pressure for fluid in self.fluids):
            runtime.put(p.s, self._hydrostatic() if self.gravity.any() else self._pressed())
        self.compressed = self.stored()  # J, at t = 0
        self.injected = self.compressed
        for b, mass in enumerate(p.masses):
            own = p.of == b
            self.injected += 0.5 * float(mass) * float((v[own] ** 2 / p.parts[own, None] ** 3).sum())
        self.fallen_from = self._potential(0.0)
        self.sort()
        if self.surroundings is not None:
            self.pairs.pack(0.0)
            self.surroundings.see(True, 0.0)

    def _level(self, fluid: Fluid, axis: str) -> float | None:
        """The level along an axis [m] of what stands where a fluid does: the highest of those that fill one tank; None where one of them
        reaches its top."""
        tank = getattr(fluid.fill, "shell", None)
        beside = [one.fill for one in self.fluids if getattr(one.fill, "shell", None) == tank]
        tops = [fill.hi["xyz".index(axis)] if isinstance(fill, FluidBox) else fill.level for fill in beside]
        known = [top for top in tops if top is not None]
        return max(known) if len(known) == len(tops) else None

    def _pressed(self) -> np.ndarray:
        """(N,) s of fluids at the pressures of their own, without gravity, by number at the start."""
        constants, pressures = self.constants[self.p.of], np.array([fluid.pressure or 0.0 for fluid in self.fluids])[self.p.of]
        return self.law.compressions(constants[:, columns.STIFFNESS], constants[:, columns.GAMMA], pressures)

    def _hydrostatic(self) -> np.ndarray:
        """(N,) s of fluids at rest, by number at the start: each layer bears the one that stands right above it."""
        g = float(np.linalg.norm(self.gravity))
        depth = self.points @ (self.gravity / g)
        across = np.arange(3) != np.abs(self.gravity).argmax()
        s = np.zeros(self.p.n)
        layers: list[Any] = []  # so far: box across, depths of top and bottom [m], pressure at the top [Pa], density
        for b in np.argsort([depth[self.p.of == b].min() for b in range(len(self.fluids))], kind="stable"):
            own, c, fluid = self.p.of == b, self.constants[b], self.fluids[b]
            d = c[columns.OWN] / self.p.parts[own]
            beside, half = self.points[own][:, across], 0.5 * d[:, None]
            low, high = (beside - half).min(axis=0), (beside + half).max(axis=0)
            highest = int((depth[own] - 0.5 * d).argmin())
            top, bottom = depth[own][highest] - 0.5 * d[highest], (depth[own] + 0.5 * d).max()
            pressure = fluid.water.density * g * (depth[own] - depth[own][highest] + 0.5 * d[highest])
            d = d.max()
            borne = fluid.pressure or 0.0
            for low_a, high_a, top_a, bottom_a, borne_a, density in layers:
                if (low < high_a).all() and (low_a < high).all() and bottom_a > top - d:
                    borne = borne_a + density * g * (top - top_a)
            if not fluid.hydrostatic:
                pressure = 0.0 * pressure
            if fluid.hydrostatic or fluid.pressure:
                s[own] = self.law.compressions(c[columns.STIFFNESS], c[columns.GAMMA], pressure + borne)
            layers.append((low, high, top, bottom, borne, fluid.water.density))
        return s

    @property
    def inverse(self) -> float:
        """1 / 2h at rest [1/m]."""
        return 0.5 / (self.support * self.p.spacing)

    def pressure(self) -> np.ndarray:
        """(N,) p [Pa] that the density gives, in the order of the pool."""
        s, body = runtime.get(self.p.s, self.p.n).astype(float), runtime.get(self.p.body, self.p.n)
        found = np.zeros(self.p.n)
        for b, c in enumerate(self.constants):
            own = body == b
            found[own] = np.maximum(self.law.pressures(c[columns.STIFFNESS], c[columns.GAMMA], s[own]), c[columns.LEAST])
        return found

    def sort(self) -> None:
        """The particles in the order of their cells, and their lists."""
        self.near.order()
        self.p.reorder(self.near.source)
        self.near.list()
        self.sorts += 1

    def follow(self, dt_before: float) -> bool:
        """Lists that still hold, and records of the particles where they are now; True when they were put in another order. dt_before led
        here [s], 0 at the start."""
        worn = self.near.moved() >= self.skin
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
        """Largest stable step [s] (before any safety), of the particles of that size which rules (step.py)."""
        squeezed, own = self.squeezed(), float(self.constants[:, columns.OWN].min())
        # sound in Tait's water goes by (rho / rho_0)^((gamma - 1) / 2) faster, and the particles lie nearer
        sound, nearer, fastest = self.sound * squeezed ** (0.5 * (self.gamma - 1.0)), squeezed ** (-1.0 / 3.0), self.fastest()
        layer, lightest = float(self.constants[:, columns.DENSITY].max()) * self.p.spacing, getattr(self.surroundings, "lightest", None)
        return min(stable_step(own / part * nearer, sound, fastest, self.support, layer / part, lightest) for part in self.sizes)

    def squeezed(self) -> float:
        """rho / rho_0 of the densest particle, 1 at least; of the acoustic law, whose sound is the same everywhere, 1."""
        return 1.0 + self.reducer.top(self.p.s, self.p.n) if self.stiffens else 1.0

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
        x, body = runtime.get(p.x, p.n) - dt * runtime.get(p.v, p.n), runtime.get(p.body, p.n)
        if p.sized:
            return float(runtime.get(p.mass, p.n).astype(float) @ (x @ self.gravity))
        return sum(float(mass * (x[body == b] @ self.gravity).sum()) for b, mass in enumerate(p.masses))

    def pools(self) -> list[Pool]:
        """All that is kept, in the order in which a restart renews it."""
        return [self.p, self.near, self.walls, self]

    def numbered(self) -> np.ndarray:
        """(N,) places in the pool, by number at the start."""
        return np.argsort(runtime.get(self.p.id, self.p.n))

    def frame(self, span: Span | None = None) -> dict[str, np.ndarray]:
        """Of one fluid, or of all: points (N, 3) [m], velocity [m/s], pressure [Pa], density [kg/m3], by number at the start."""
        p, own = self.p, slice(0, self.p.n) if span is None else slice(span.first, span.first + span.n)
        back = self.numbered()[own]
        return {
            "points": runtime.get(p.x, p.n)[back],
            "velocity": runtime.get(p.v, p.n)[back].astype(np.float64),
            "pressure": self.pressure()[back],
            "density": self.constants[p.of[own], columns.DENSITY] * (1.0 + runtime.get(p.s, p.n)[back].astype(np.float64)),
        }
