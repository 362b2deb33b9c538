"""The longest stable step of a fluid, before any safety. No Taichi here: the plan of a run asks as well."""

from __future__ import annotations

import math

LIMIT = 0.515  # h / c: the step that is stable with alpha up to 1.5 (docs/method.md)
ALONG = 1.22  # 1 / gamma of a layer at D/2 (couplings/wetted/wetted.py): so much faster it swings along the wall
STIFF = 1.41  # (2 D w)^2 of a layer at D/4, where pinballs stop it (couplings/wetted/wetted.py)
SWING = 0.64  # omega dt, some room below 0.70


def stable_step(pace: float, support: float, layer: float, lightest: float | None) -> float:
    """[s] of particles that sound and their own speed pass in `pace` [s]: LIMIT h / (c + |v|), shorter where a light shell swings against
    its water. layer = rho D [kg/m2]; lightest [kg/m2]: mass per area of the lightest body that the fluid presses on, None: on nothing.

    A body of mass m per area between two layers of water swings with omega = c/D sqrt(STIFF (1 + 2 rho D / m)); the one pass of
    fluid_pairs is stable up to omega dt = 0.70 (docs/method.md, 11)."""
    found = LIMIT * support * pace
    if lightest is not None:
        found = min(found / ALONG, SWING * pace / math.sqrt(STIFF * (1.0 + 2.0 * layer / lightest)))
    return found
