"""The longest stable step of a fluid, before any safety. No Taichi here: the plan of a run asks as well."""

from __future__ import annotations

import math

LIMIT = 0.515  # h / c: the step that is stable with alpha up to 1.5 (docs/method.md)
ALONG = 1.22  # 1 / gamma of a layer at D/2 (couplings/wetted/wetted.py): so much faster it swings along the wall
STIFF = 1.41  # (2 D w)^2 of a layer at D/4, where pinballs stop it (couplings/wetted/wetted.py)
SWING = 1.0  # omega dt: half of what a leap-frog bears; the error of the energy grows as its square (docs/method.md, 11)


def stable_step(size: float, sound: float, fastest: float, support: float, layer: float, lightest: float | None) -> float:
    """[s] of particles of D = size [m] in which sound runs at `sound` [m/s] and which move at `fastest` [m/s] at most: LIMIT h / (c + |v|),
    shorter where a light shell swings against its water. layer = rho D [kg/m2]; lightest [kg/m2]: mass per area of the lightest body that
    the fluid presses on, None: on nothing.

    A body of mass m per area between two layers of water swings with omega = c/D sqrt(STIFF (1 + 2 rho D / m)), however fast the water
    flows past. What it does to the density acts at once, so this motion bears the step of a leap-frog."""
    found = LIMIT * support * size / (sound + fastest)
    if lightest is not None:
        found = min(found / ALONG, SWING * size / sound / math.sqrt(STIFF * (1.0 + 2.0 * layer / lightest)))
    return found
