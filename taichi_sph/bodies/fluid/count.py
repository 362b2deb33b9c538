"""How many particles a fluid takes, before any of them exists."""

from __future__ import annotations

import math

import numpy as np

from ...geometry.mesh import SurfaceMesh
from ...scene.surfaces import CappedTank, Cylinder, Surface
from .fill import AXES, _revolved
from .said import Fluid, FluidBox, FluidRound

COUNTED = 10**18  # more particles than this are not told apart


def count(fluid: Fluid, spacing: float, surface: Surface | None = None, thickness: float = 0.0, mesh: SurfaceMesh | None = None) -> int:
    """Particles of a fluid: volume / D^3. surface, thickness [m]: of the shell that it fills; of one from a file also its
    mesh, without which nothing is counted (0)."""
    d = fluid.spacing or spacing
    if isinstance(fluid.fill, FluidBox):
        ratios = [(hi - lo) / d for lo, hi in zip(fluid.fill.lo, fluid.fill.hi)]
        return int(min(math.prod(max(1.0, r) for r in ratios), COUNTED))
    if isinstance(fluid.fill, FluidRound):
        return int(min(max(fluid.fill.volume / d / d / d, 1.0), COUNTED))
    volume: float | None = None
    if isinstance(surface, Cylinder | CappedTank):
        if fluid.fill.level is not None:
            volume = _revolved(surface, thickness, fluid.fill.axis, fluid.fill.level)
            if volume is not None and fluid.fill.above is not None:
                volume -= _revolved(surface, thickness, fluid.fill.axis, fluid.fill.above) or 0.0
        if volume is None:
            volume = surface.volume if isinstance(surface, CappedTank) else math.pi * surface.radius**2 * surface.length
    else:
        volume = getattr(surface, "volume", None)
    if volume is None and mesh is not None and not isinstance(surface, Cylinder | CappedTank):
        axis = AXES[fluid.fill.axis]
        low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
        if fluid.fill.level is not None:
            high[axis] = min(high[axis], fluid.fill.level)
        volume = min(abs(mesh.volume), float(np.prod(np.maximum(high - low, 0.0))))
    return 0 if volume is None else int(min(max(volume, 0.0) / d / d / d, COUNTED))
