"""No silent nonsense: stop with one sentence that names body, point, place, time, field and likely cause."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..bodies.body import Group, Now
from ..errors import RunStopped


def look(groups: Sequence[Group], names: Sequence[str], entries: dict[str, float], now: Now, nothing: float) -> None:
    """Raise RunStopped when something cannot be true any more. nothing: an energy [J] below which a residual says nothing."""
    for group in groups:
        group.look(now)
    enough = not abs(entries["kinetic"]) + abs(entries["elastic"]) < nothing  # what is no number is enough as well
    residual = entries["closed_residual_percent"]
    if enough and (not np.isfinite(residual) or residual > 50.0):
        raise RunStopped(
            f"'{', '.join(names)}': energy appears from nowhere ({residual:.3g} % of what was given) at t = {now.time:.6g} s; "
            "likely an unstable step: lower numerics.time_step_safety"
        )
