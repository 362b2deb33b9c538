"""Particles as couplings see them: movers that do not turn, a ball each."""

from typing import Any

import numpy as np

from ...runtime import ti
from ..body import Now
from ..surface import BALL, BODY, FIRST, MOVER, Balls, Surface
from .fill import CONTACT, PINBALL


class FluidSurface(Surface):
    """A particle's ball is larger where contact alone carries the fluid (T 3.3): against a sound shell it then makes up for the
    neighbours that a particle lacks there (docs/method.md). At a lip it is as small as anywhere, so that an opening is as wide as it is."""

    loose = True

    def __init__(self, group: Any) -> None:
        self.group, self.p = group, group.body.p
        self.bodies, self.n = group.bodies, self.p.n
        self.length = self.p.finest
        self.bounce = [None] * len(self.bodies)
        said = group.contact
        self.radii = radii = (PINBALL, PINBALL) if said is None else (0.5, CONTACT[said])
        body = np.repeat(np.arange(len(self.bodies)), [span.n for span in self.bodies])
        self.balls = Balls(np.arange(self.n), body, np.outer(self.p.spacing / self.p.parts, radii))

    @property
    def period(self) -> int:
        return self.group.every

    @property
    def renumbered(self) -> bool:
        return self.group.renumbered

    @property
    def source(self) -> Any:
        return self.group.body.near.source

    def meets(self) -> None:
        self.group.pushed = True

    def look(self, port: Any, places: bool) -> None:
        _look(port, self.p, self.n, len(self.bodies), self.first, int(places))
        if places and self.p.sized:
            _resize(port, self.p, self.n, self.first, self.p.spacing * self.radii[0], self.p.spacing * self.radii[1])

    def offer(self, port: Any, first: int, last: int, now: Now) -> None:
        times = self.period if now.due(self.group) else 0
        _offer(port, self.p, first, last, self.first.mover, now.kick, times)

    def take(self, port: Any, first: int, last: int, now: Now) -> None:
        if now.due(self.group):
            _take(port, self.p, first, last, self.first.mover, 1.0 / now.kick, self.period)


@ti.kernel
def _look(port: ti.template(), p: ti.template(), n: ti.i32, bodies: ti.i32, first: FIRST, places: ti.i32):
    """The push of the step before is forgotten as well."""
    for b in range(first[BODY], first[BODY] + bodies):
        port.speed[b] = 0.0
    for j in range(n):
        p.push[j] *= 0.0
        speed, b = ti.cast(p.v[j].norm(), ti.f64), first[BODY] + p.body[j]
        port.body[first[MOVER] + j], port.ball_body[first[BALL] + j] = b, b  # a place in the pool is not always of the same fluid
        if speed > port.speed[b]:
            ti.atomic_max(port.speed[b], speed)
        if places == 1:
            port.ball_x[first[BALL] + j] = ti.cast(p.x[j], ti.f64)


@ti.kernel
def _resize(port: ti.template(), p: ti.template(), n: ti.i32, first: FIRST, plain: ti.f64, sound: ti.f64):
    """A place in the pool is not always of the same particle."""
    for j in range(n):
        size = ti.cast(p.size[j], ti.f64)
        port.ball_radius[first[BALL] + j] = ti.Vector([plain * size, sound * size])


@ti.kernel
def _offer(port: ti.template(), p: ti.template(), first: ti.i32, last: ti.i32, base: ti.i32, kick: ti.f64, times: ti.i32):
    for m in range(first, last):
        j = port.who[m] - base
        port.x[m] = ti.cast(p.x[j], ti.f64)
        port.before[m] = ti.cast(p.v[j], ti.f64)
        port.free[m] = ti.cast(p.v[j] + times * kick / p.mass[j] * (p.force[j] + p.push[j]), ti.f64)  # push: of this step, or none yet
        w = ti.Vector([0.0, 0.0, 0.0], ti.f64)
        w += 1.0 / ti.cast(p.mass[j], ti.f64)
        port.ease[m] = w


@ti.kernel
def _take(port: ti.template(), p: ti.template(), first: ti.i32, last: ti.i32, base: ti.i32, per_kick: ti.f64, times: ti.i32):
    for m in range(first, last):
        if port.pushed[port.whose[m]] == 1:
            force = per_kick * port.impulse[m]
            p.push[port.who[m] - base] = ti.cast(force / times, float)
