"""Meridians of the heads of tanks and bullets: points and normals by a parameter, arc length, the chart that keeps angles. NumPy only.

The chart of a surface of revolution keeps angles where its radius R grows as dR / R = ds / r; a sphere's is then the stereographic one.
The parameter of a chart's radius is looked up in a table: an error of the table moves a node along the surface, never off it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..scene.surfaces import Bullet, CappedTank

ROWS = 20_001  # of the tables


@dataclass(frozen=True)
class Meridian:
    """t (K,) parameter from the pole to the rim, arc (K,) length from the pole [m], chart (K,) radius there [m], the rim's being `radius`;
    at: t -> distance from the axis, height over the rim [m], and both parts of the unit normal, outward and along the axis."""

    radius: float
    t: np.ndarray
    arc: np.ndarray
    chart: np.ndarray
    at: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]

    def laid_out(self, xy: np.ndarray) -> np.ndarray:
        """Points (N, 2) in arc length, 1 at the rim -> chart [m]."""
        far = np.linalg.norm(xy, axis=1)
        radius = np.interp(far * self.arc[-1], self.arc, self.chart)
        return xy * np.where(far > 0, radius / np.where(far > 0, far, 1.0), 0.0)[:, None]

    def width(self, part: np.ndarray) -> np.ndarray:
        """Distance from the axis over that of the rim, by the part of the arc length from the pole."""
        return self.at(np.interp(part * self.arc[-1], self.arc, self.t))[0] / self.radius

    def bend(self, chart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Chart (N, 2) -> points (N, 3) over the plane z = 0 of the rim, unit normals (N, 3)."""
        far = np.linalg.norm(chart, axis=1)
        r, z, outward, up = self.at(np.interp(far, self.chart, self.t))
        direction = chart / np.where(far > 0, far, 1.0)[:, None]
        return np.column_stack([r[:, None] * direction, z]), np.column_stack([outward[:, None] * direction, up])


def meridian(tank: CappedTank) -> Meridian:
    """Of a head that is elliptical, torispherical or conical."""
    a, b = tank.radius, tank.height
    if tank.cap == "elliptical":
        t = np.linspace(0, np.pi / 2, ROWS)
        # ds / (r dt) = 1 / sin t + what stays finite at the pole
        bulge = ((b / a) ** 2 - 1) * np.sin(t) / (np.sqrt(1 + ((b / a) ** 2 - 1) * np.sin(t) ** 2) + 1)
        speed = np.hypot(a * np.cos(t), b * np.sin(t))
        return _made(a, t, _summed(speed, t), np.tan(t / 2) * np.exp(_summed(bulge, t)), lambda t: _ellipse(a, b, t))
    if tank.cap == "conical":
        t = np.linspace(0, 1, ROWS)
        slant = np.hypot(a, b)
        return _made(a, t, slant * t, t ** (slant / a), lambda t: _cone(a, b, t))
    (crown, knuckle), phi = tank.radii, tank.crown_angle
    t = np.unique(np.append(np.linspace(0, np.pi / 2, ROWS), phi))
    ring = np.maximum(t, phi)  # beyond phi the chart grows by ds / r = knuckle dt / (a - knuckle + knuckle sin t)
    chart = np.tan(np.minimum(t, phi) / 2) * np.exp(_summed(knuckle / (a - knuckle + knuckle * np.sin(ring)), ring))
    arc = crown * np.minimum(t, phi) + knuckle * (ring - phi)
    return _made(a, t, arc, chart, lambda t: _torisphere(a, crown, knuckle, phi, t))


def ogive(bullet: Bullet) -> Meridian:
    """Of the nose of a bullet. With the angle u round the centre of its arc, 0 at the shank, r = s (cos u - k); ds / r is a closed form."""
    s, k, sharp = bullet.arc, 1.0 - 0.5 / bullet.crh, bullet.sharp
    t = np.linspace(0.0, sharp, ROWS)  # from the tip
    a, b, tangent = np.sqrt(1.0 - k), np.sqrt(1.0 + k), np.tan(0.5 * (sharp - t))
    chart = (np.maximum(a - b * tangent, 0.0) / (a + b * tangent)) ** (1.0 / np.sqrt(1.0 - k * k))
    chart[0] = 0.0
    return _made(bullet.radius, t, s * t, chart, lambda t: _ogive(s, k, sharp, t))


def _ogive(s: float, k: float, sharp: float, t: np.ndarray) -> tuple[np.ndarray, ...]:
    """At the tip the normal is the axis, the mean of those around it."""
    u, tip = sharp - t, t <= 0
    r = np.where(tip, 0.0, s * (np.cos(u) - k))
    return r, s * np.sin(u), np.where(tip, 0.0, np.cos(u)), np.where(tip, 1.0, np.sin(u))


def _made(radius: float, t: np.ndarray, arc: np.ndarray, chart: np.ndarray, at: Callable) -> Meridian:
    return Meridian(radius, t, arc, chart * (radius / chart[-1]), at)


def _summed(rate: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Integral of a rate from the first t on, by trapezoids."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))])


def _ellipse(a: float, b: float, t: np.ndarray) -> tuple[np.ndarray, ...]:
    long = np.hypot(b * np.sin(t), a * np.cos(t))
    return a * np.sin(t), b * np.cos(t), b * np.sin(t) / long, a * np.cos(t) / long


def _cone(a: float, b: float, t: np.ndarray) -> tuple[np.ndarray, ...]:
    """At the tip the normal is the axis, the mean of those around it."""
    slant, tip = np.hypot(a, b), t <= 0
    return a * t, b * (1 - t), np.where(tip, 0.0, b / slant), np.where(tip, 1.0, a / slant)


def _torisphere(a: float, crown: float, knuckle: float, phi: float, t: np.ndarray) -> tuple[np.ndarray, ...]:
    inner, outward, up = t <= phi, np.sin(t), np.cos(t)
    r = np.where(inner, crown * outward, a - knuckle + knuckle * outward)
    z = np.where(inner, crown * up - (crown - knuckle) * np.cos(phi), knuckle * up)
    return r, z, outward, up
