"""The surface of bodies that are a mass and a ball each: what a kind of points needs to be touched and held by springs."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..pool import Pool
from ..runtime import ti
from .body import Now, Span
from .surface import Balls, Surface


class MassSurface(Surface):
    """Movers that do not turn, one for each body, each with one ball.

    masses: a pool with x [m], v [m/s] at n - 1/2, f [N] at n (all (n, 3) f64) and mass (n,) [kg]; the forces of couplings are added to f.
    radius (n,) [m]; bounce: Newton's restitution of each.
    """

    few = True

    def __init__(self, group: Any, masses: Pool, bodies: Sequence[Span], radius: np.ndarray, bounce: float = 0.0):
        """group: whose bodies they are."""
        self.group, self.masses = group, masses
        self.bodies, self.n, self.bounce = bodies, len(bodies), [bounce] * len(bodies)
        self.length, one = 0.5 * float(np.min(radius)), np.arange(self.n)
        self.balls = Balls(one, one, np.column_stack([radius, radius]))

    def grip(self, span: Span, point: np.ndarray, radius: float | None) -> tuple[np.ndarray, np.ndarray]:
        """The body itself: a mass has no arm."""
        return np.array([span.first]), np.zeros(3)

    def look(self, port: Any, places: bool) -> None:
        _look(port, self.masses, self.n, self.first.body, self.first.ball)

    def offer(self, port: Any, first: int, last: int, now: Now) -> None:
        _offer(port, self.masses, first, last, self.first.mover, now.kick)

    def take(self, port: Any, first: int, last: int, now: Now) -> None:
        _take(port, self.masses, first, last, self.first.mover, 1.0 / now.kick)


@ti.kernel
def _look(port: ti.template(), m: ti.template(), n: ti.i32, body: ti.i32, ball: ti.i32):
    for k in range(n):
        port.speed[body + k], port.ball_x[ball + k] = m.v[k].norm(), m.x[k]


@ti.kernel
def _offer(port: ti.template(), m: ti.template(), first: ti.i32, last: ti.i32, base: ti.i32, kick: ti.f64):
    for place in range(first, last):
        k = port.who[place] - base
        port.x[place], port.before[place], port.free[place] = m.x[k], m.v[k], m.v[k] + kick / m.mass[k] * m.f[k]
        port.ease[place] = ti.Vector([1.0, 1.0, 1.0], ti.f64) / m.mass[k]


@ti.kernel
def _take(port: ti.template(), m: ti.template(), first: ti.i32, last: ti.i32, base: ti.i32, per_kick: ti.f64):
    for place in range(first, last):
        if port.pushed[port.whose[place]] == 1:
            m.f[port.who[place] - base] += per_kick * port.impulse[place]
