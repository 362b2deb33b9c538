"""Any generated surface: its patches, finished and put where they stand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...scene import Numerics
from ...scene.surfaces import BoxTank, Bullet, CappedTank, Cylinder, Disc, Frustum, Generated, Plate, Roof, Sphere, SpherePatch, frame_of
from ..holes import Cutter
from ..mesh import SurfaceMesh, plate
from .box import box
from .finish import finish
from .flat import sheet
from .patch import Finish, along, put, stood, then
from .round import cap, cone, eights_of, quarter, rim_of, wall
from .sphere import sphere
from .tank import closed, head, nose


def generate(surface: Generated, numerics: Numerics) -> SurfaceMesh:
    """The mesh of any generated surface with the spacing, cells and irregularity of `numerics`."""
    d, cells, irregularity, seed = numerics.spacing, numerics.cells, numerics.irregularity, numerics.seed
    if isinstance(surface, Plate) and not surface.holes:
        if not surface.turned:
            return plate(surface.length, surface.width, d, cells, irregularity, seed, surface.origin)
        return put(plate(surface.length, surface.width, d, cells, irregularity, seed), stood(surface.frame, surface.origin))
    rng, cutter = np.random.default_rng(seed), Cutter(surface.holes, d)
    mesh = _generated(surface, d, lambda patch, place: finish(patch, cells, irregularity, rng, cutter, place))
    cutter.check()
    return mesh


def _generated(surface: Generated, d: float, finish: Finish) -> SurfaceMesh:
    """Its patches, finished and put where they stand in the scene."""
    if isinstance(surface, BoxTank):
        return box(surface, d, finish)
    there = along(getattr(surface, "axis", "z"), surface.origin)
    match surface:
        case Plate():
            there = stood(surface.frame, surface.origin)
            patch = sheet(surface.length, surface.width, d)
        case Disc():
            there = there if surface.normal is None else stood(frame_of(surface.normal), surface.origin)
            if surface.quarter:
                patch = replace(cap(eights_of(surface.radius, d), surface.radius, 0.0), planes=True)
                if not any(surface.about(hole) for hole in surface.holes):  # such a hole wants inner nodes round it
                    patch = replace(patch, inner=patch.inner & (np.abs(patch.chart) > 1e-9 * surface.radius).all(axis=1))
                return put(quarter(finish(patch, there)), there)
            patch = cap(rim_of(surface.radius, d), surface.radius, 0.0)
        case SpherePatch():
            radius = surface.radius * np.sin(surface.half_angle)
            there = then(along("z", (0.0, 0.0, surface.radius * np.cos(surface.half_angle))), there)
            patch = cap(rim_of(radius, d), radius, surface.half_angle)
        case Roof():
            # the axis along x has local x along y and local y along z: the crown stands at 90 deg
            start, angle = np.pi / 2 - surface.half_angle, surface.half_angle - surface.start
            there = along("x", surface.origin)
            patch = wall(surface.radius, surface.length, start, angle, d)
        case Sphere():
            return put(sphere(surface, d, finish, there), there)
        case Cylinder() if surface.ends == "open":
            patch = wall(surface.radius, surface.length, surface.start_angle, None if surface.whole else surface.angle, d)
        case Frustum() if surface.ends == "open":
            patch = cone(surface, None if surface.whole else surface.angle, d)
        case Cylinder():
            caps = [cap(rim_of(surface.radius, d), surface.radius, 0.0)] * 2
            side = wall(surface.radius, surface.length, surface.start_angle, None, d)
            return put(closed(side, surface.length, surface.start_angle, caps, finish, there), there)
        case Frustum():
            rim = rim_of((surface.radius + surface.end_radius) / 2, d)
            caps = [cap(rim, radius, 0.0) for radius in (surface.radius, surface.end_radius)]
            return put(closed(cone(surface, None, d), surface.length, surface.start_angle, caps, finish, there), there)
        case Bullet():
            rim = eights_of(surface.radius, d)
            side = wall(surface.radius, surface.length, 0.0, None, d, rim)
            if surface.turned:
                there = then(lambda x, n: (x * [1, -1, -1], n * [1, -1, -1]), there)
            return put(closed(side, surface.length, 0.0, [cap(rim, surface.radius, 0.0), nose(surface, rim)], finish, there), there)
        case CappedTank():
            # a cone has a node at its tip, which eights of columns have
            rim = eights_of(surface.radius, d) if surface.cap == "conical" else rim_of(surface.radius, d)
            caps = [head(surface, rim)] * 2
            side = wall(surface.radius, surface.length, 0.0, None, d, rim)
            return put(closed(side, surface.length, 0.0, caps, finish, there), there)
    return put(finish(patch, there), there)
