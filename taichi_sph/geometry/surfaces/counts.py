"""How many nodes a generated surface has, before any of them exists."""

from __future__ import annotations

import math

from ...scene import Numerics
from ...scene.surfaces import BoxTank, Bullet, CappedTank, Cylinder, Disc, Frustum, Generated, Plate, Roof, Sphere, SpherePatch
from ..ogrid import of_sphere, proportions
from .round import eights_of, rim_of

COUNTED = 10**18  # more nodes than this are not told apart


def count(surface: Generated, numerics: Numerics) -> int:
    """Nodes of a generated surface, known before any of them exists; of round ends above a thousand columns to a hundredth, of other
    ends, tapering walls, spheres and boxes by their area."""
    d = numerics.spacing

    def along(length: float) -> float:
        ratio = length / d
        return max(1, round(ratio)) if ratio < COUNTED else float(COUNTED)

    def cap(radius: float, half_angle: float, quarter: bool = False) -> float:
        """Nodes of a round end, its rim included."""
        around = 2 * math.pi * radius / d
        rim = COUNTED if around >= COUNTED else eights_of(radius, d) if quarter else rim_of(radius, d)
        some = min(rim, 1000)  # rings are as many for each column of the rim, whatever their number
        rings, side = proportions(some, *of_sphere(half_angle))[0] * (rim / some), rim // 4
        return (side // 2 + 1) ** 2 + rings * (side + 1) if quarter else (side + 1) ** 2 + rings * rim

    match surface:
        case Plate():
            nodes = (along(surface.length) + 1) * (along(surface.width) + 1)
        case Disc():
            nodes = cap(surface.radius, 0.0, bool(surface.quarter))
        case SpherePatch():
            nodes = cap(surface.radius * math.sin(surface.half_angle), surface.half_angle)
        case Roof():
            nodes = (along(surface.radius * (surface.half_angle - surface.start)) + 1) * (along(surface.length) + 1)
        case Cylinder() if surface.ends == "open" and not surface.whole:
            nodes = (along(surface.radius * surface.angle) + 1) * (along(surface.length) + 1)
        case Frustum() | Sphere() | BoxTank() | Bullet():
            nodes = surface.gross / d / d
        case CappedTank() if surface.cap not in ("flat", "dome"):
            nodes = surface.gross / d / d
        case Cylinder() | CappedTank():
            rim = rim_of(surface.radius, d) if 2 * math.pi * surface.radius / d < COUNTED else COUNTED
            nodes = rim * (along(surface.length) + 1)
            if isinstance(surface, CappedTank):
                nodes += 2 * (cap(surface.radius, surface.half_angle) - rim)
            elif surface.ends == "discs":
                nodes += 2 * (cap(surface.radius, 0.0) - rim)
    return int(min(nodes, COUNTED))
