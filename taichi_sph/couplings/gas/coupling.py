"""A gas at one pressure in a closed shell.

    p = p_0 (V_0 / V)^k        f_i = (p - p_out) a_i        V = 1/3 sum x_i . a_i - V_water

a_i is the vector area of node i, as water sees it (bodies/wettable.py). The work of the gas is taken from its energy,

    U = p_0 V_0 / (k - 1) ((V_0 / V)^(k-1) - 1) + p_out (V - V_0)        (k = 1: p_0 V_0 ln(V_0 / V) + ...)

so the ledger shows what the areas are worth. U is shown above its least value, which the gas has when its pressure is that outside; what it
holds at t = 0 counts as given (`given`). All nodes move the one volume: a gas is one spring on them,
of omega2 = k p / V sum |a_i|2 / m_i.
Uniform pressure moves no water: the water in the shell keeps its volume, and its own pressure is that above the gas. Waves in the gas are
left out: they cross it while the shell hardly moves.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ... import runtime
from ...bodies.body import Entries, Group, Now, holding
from ...bodies.wettable import SurfacePoints
from ...errors import SceneError
from ...numerics.reduce import BLOCK
from ...pool import Pool
from ...runtime import ti
from ..coupling import Coupling
from .said import Gas


def couplings(scene: Any, groups: Sequence[Group], own: Sequence[Gas]) -> "list[InnerGas]":
    """One for each gas."""
    return [InnerGas(scene, groups, gas, f"gas_{k}") for k, gas in enumerate(own, start=1)]


class InnerGas(Coupling, Pool):
    """pressure [Pa] and volume [m3] now."""

    kept = ("first", "volume")

    def __init__(self, scene: Any, groups: Sequence[Group], gas: Gas, name: str):
        Pool.__init__(self, name)
        self.gas, self.safety = gas, scene.numerics.time_step_safety
        group, _ = holding(groups, gas.body or "")
        self.group = group
        (self.surface,) = group.wettables(f"{name}.surface", 0.0, lambda body: body == gas.body)
        n = self.surface.n
        self.points = SurfacePoints(f"{name}.points", n, np.zeros(3))
        self.blocks = -(-n // BLOCK)
        self.partial = self.field("partial", self.blocks, dtype="f64", unit="m3", doc="scratch")
        inside = {fluid.name for fluid in scene.fluids if getattr(fluid.fill, "shell", None) == gas.body}
        frames = [frame for one in groups for frame in one.frames() if frame.name in inside]
        self.water = sum(float((frame.point_data["diameter"] ** 3).sum()) for frame in frames)  # m3
        self.volume = self.first = self._now()
        if self.first <= 0.0:
            raise SceneError(f"gases: there is no room for gas in shell '{gas.body}'")

    def _now(self) -> float:
        """The volume of the gas [m3]."""
        self.surface.lay(self.points, 0, 0.0)
        _volume(self.partial, self.points, self.points.n, self.blocks)
        return float(runtime.get(self.partial, self.blocks).sum()) - self.water

    @property
    def pressure(self) -> float:
        """Absolute [Pa]."""
        return self.gas.pressure * (self.first / max(self.volume, 1e-9 * self.first)) ** self.gas.exponent

    def add(self, now: Now) -> None:
        if not now.due(self.group):
            return
        self.volume = self._now()
        _push(self.points, self.points.n, self.pressure - self.gas.outside)
        self.surface.bear(self.points, 0, self.group.every)

    def longest_step(self) -> dict[str, float]:
        """Of that spring now, |a_i| / m_i being at most one over the least mass per area; central differences [s]."""
        if not math.isfinite(self.surface.lightest):
            return {}
        area = float(np.linalg.norm(runtime.get(self.points.record, self.points.n)[:, 3:6], axis=1).sum())
        frequency = math.sqrt(self.gas.exponent * self.pressure * area / (self.volume * self.surface.lightest))
        return {"gas": self.safety * 2.0 / frequency / self.group.every}

    def _stored(self, volume: float) -> float:
        """U at a volume [m3] in J, above that at t = 0."""
        gas, ratio = self.gas, self.first / max(volume, 1e-9 * self.first)
        grown = math.log(ratio) if gas.exponent == 1.0 else (ratio ** (gas.exponent - 1.0) - 1.0) / (gas.exponent - 1.0)
        return gas.pressure * self.first * grown + gas.outside * (volume - self.first)

    def given(self) -> float:
        """What the gas can give until its pressure is that outside [J]; into a vacuum, to e^10 times its volume at most."""
        gas = self.gas
        wider = 10.0 if gas.outside == 0.0 else min(10.0, math.log(gas.pressure / gas.outside) / gas.exponent)
        return -self._stored(self.first * math.exp(wider))

    def entries(self) -> Entries:
        return Entries(internal={"elastic": self.given() + self._stored(self.volume)})

    def pools(self) -> list[Pool]:
        return [self, self.points, *self.surface.pools()]


@ti.kernel
def _volume(partial: ti.template(), points: ti.template(), n: ti.i32, blocks: ti.i32):
    for b in range(blocks):
        total = ti.cast(0.0, ti.f64)
        for k in range(b * BLOCK, ti.min(n, (b + 1) * BLOCK)):
            total += points.x[k].dot(ti.cast(points.area(k), ti.f64)) / 3.0
        partial[b] = total


@ti.kernel
def _push(points: ti.template(), n: ti.i32, pressure: ti.f64):
    for k in range(n):
        points.push[k] = ti.cast(pressure, float) * points.area(k)
