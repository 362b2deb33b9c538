"""Springs and dampers between points of bodies, or of a body and the ground.

With l the distance of the two points, n the direction from the first to the second one, and s = l - length,

    T = preload + k s          F = T + c dl/dt        "pull": no F below 0; "push": no F above 0; T likewise
    F n on the first body, -F n on the second

A point of a shell is the mean of the nodes that the spring holds; each of them bears the same part. A point of a rigid body turns with it.

Energy: the spring stores T^2 / 2k (preload l where k = 0), so a spring that hangs loose stores nothing. F - T is the damping. Its work is
trapezoidal over the change of l, like that of all forces (world/step.py).

The longest step. Let an end have the mobility a = sum over its movers of (1/m + r^2 / I) / N^2, r the arm and I the least moment of a body
that turns, N their number. A spring alone swings with omega^2 = k (a_1 + a_2). With springs together, from (x - y)^2 <= (1 + a_2/a_1) x^2 +
(1 + a_1/a_2) y^2 for each of them,

    omega^2 <= max over movers of   sum over the springs that hold it of   k (a_1 + a_2),      k at least |T| / l, its stiffness across

and likewise for c. The omega^2 of a body and of the springs that hold it add up (World).
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ... import runtime
from ...bodies.body import Entries, Group, Now, holding
from ...bodies.surface import Surface
from ...errors import SceneError
from ...numerics.turns import turned
from ...pool import Pool
from ...runtime import ti
from ..coupling import Coupling
from ..places import Places
from .said import Spring, longest_of

BOTH, PULL, PUSH = 0, 1, 2


def couplings(scene: Any, groups: Sequence[Group], own: Sequence[Spring]) -> "list[Springs]":
    """All springs of the scene are one coupling."""
    return [Springs(scene, groups)] if own else []


class Springs(Coupling):
    """ends: the movers that springs hold; bonds: the springs."""

    def __init__(self, scene: Any, groups: Sequence[Group]):
        springs: tuple[Spring, ...] = scene.springs
        self.safety = scene.numerics.time_step_safety
        self._of: dict[Group, Surface] = {}  # of a group that springs hold
        held = [[self._held(groups, name, point, spring) for name, point in zip(spring.between, spring.points)] for spring in springs]
        self.surfaces = sorted(self._of.values(), key=lambda s: s.turns)
        movers = [sorted({int(i) for e in held for g in e if g is not None and g[0] is s for i in g[1]}) for s in self.surfaces]
        self.bounds = np.r_[0, np.cumsum([len(m) for m in movers])]
        turning = next((int(b) for s, b in zip(self.surfaces, self.bounds) if s.turns), int(self.bounds[-1]))
        self.ends = Places("springs.ends", int(self.bounds[-1]), turning)
        who = np.concatenate([np.array(m, np.int32) for m in movers])
        runtime.put(self.ends.who, who)
        runtime.put(self.ends.pushed, np.ones(1, np.int32))
        place = {(id(s), i): int(b) + k for s, b, m in zip(self.surfaces, self.bounds, movers) for k, i in enumerate(m)}
        self.bonds = Bonds(springs, held, place, len(who))

    def _held(self, groups: Sequence[Group], name: str | None, point: Any, spring: Spring) -> tuple[Surface, np.ndarray, np.ndarray] | None:
        """(surface, numbers of the movers in the group, arm of the point) of one end; None on the ground."""
        if name is None:
            return None
        group, span = holding(groups, name)
        if group not in self._of:
            surface = group.surface()
            if surface is None:
                raise SceneError(f"springs: body '{name}' shows no surface that a spring could hold; leave the spring out")
            self._of[group] = surface
        movers, arm = self._of[group].grip(span, np.asarray(point, float), spring.radius)
        return self._of[group], movers, arm

    def start(self) -> None:
        """Lengths at t = 0, where a spring names none."""
        self._offer(Now())
        _measure(self.bonds, self.ends, self.bonds.n, self.ends.turning)
        lengths = runtime.get(self.bonds.length, self.bonds.n)
        now = runtime.get(self.bonds.l, self.bonds.n)
        runtime.put(self.bonds.length, np.where(np.isnan(lengths), now, lengths))
        runtime.put(self.bonds.l_before, now)
        self.frequency, self.rate = self.bonds.fastest(self.ends)

    def _offer(self, now: Now) -> None:
        for s, first, last in zip(self.surfaces, self.bounds[:-1], self.bounds[1:]):
            s.offer(self.ends, int(first), int(last), now)

    def add(self, now: Now) -> None:
        self._offer(now)
        _pull(self.bonds, self.ends, self.bonds.n, self.ends.turning)
        _gather(self.bonds, self.ends, self.ends.n, self.ends.turning, now.kick)
        for s, first, last in zip(self.surfaces, self.bounds[:-1], self.bounds[1:]):
            s.take(self.ends, int(first), int(last), now)

    def longest_step(self) -> dict[str, float]:
        """Of an oscillator with that stiffness and damping, central differences with the velocity of the half step before [s]."""
        if self.frequency == 0.0 and self.rate == 0.0:
            return {}
        return {"springs": self.safety * longest_of(self.frequency, self.rate)}

    def entries(self) -> Entries:
        stored, taken = (float(runtime.get(f, self.bonds.n).sum()) for f in (self.bonds.stored, self.bonds.taken))
        return Entries(internal={"elastic": stored, "damped": taken})

    def given(self) -> float:
        """What the springs hold at t = 0 [J]."""
        return float(runtime.get(self.bonds.stored, self.bonds.n).sum())

    def pools(self) -> list[Pool]:
        return [self.ends, self.bonds]


class Bonds(Pool):
    """The springs: constants, the movers of their ends, length and force now."""

    def __init__(self, springs: Sequence[Spring], held: list[list[Any]], place: dict[tuple[int, int], int], movers: int):
        super().__init__("springs")
        self.n = n = len(springs)
        field = self.field
        self.stiffness = field("stiffness", n, dtype="f64", unit="N/m")
        self.length = field("length", n, dtype="f64", unit="m", keeps=True, doc="without stretch")
        self.preload = field("preload", n, dtype="f64", unit="N")
        self.damping = field("damping", n, dtype="f64", unit="N s/m")
        self.only = field("only", n, dtype="i32", doc="0 both ways, 1 pull, 2 push")
        self.ground = field("ground", 2 * n, 3, "f64", unit="m", doc="place of an end on the ground")
        self.arm = field("arm", 2 * n, 3, "f64", unit="m", doc="of an end from the place of a mover that turns, at t = 0")
        self.l = field("l", n, dtype="f64", unit="m", doc="length now", keeps=True)
        self.l_before = field("l_before", n, dtype="f64", unit="m", doc="length at the step before", keeps=True)
        self.direction = field("direction", n, 3, "f64", doc="from the first end to the second")
        self.pace = field("pace", n, dtype="f64", unit="m/s", doc="dl/dt at the half step before")
        self.force = field("force", n, dtype="f64", unit="N", doc="F, positive in tension", keeps=True)
        self.viscous = field("viscous", n, dtype="f64", unit="N", doc="F - T", keeps=True)
        self.stored = field("stored", n, dtype="f64", unit="J", keeps=True)
        self.taken = field("taken", n, dtype="f64", unit="J", doc="by damping so far", keeps=True)
        # movers of an end, and ends of a mover
        sizes = [0 if grip is None else len(grip[1]) for ends in held for grip in ends]
        self.start = field("start", 2 * n + 1, dtype="i32", doc="first of the movers of an end")
        self.mover = field("mover", sum(sizes), dtype="i32", doc="place on the list")
        self.start_of = field("start_of", movers + 1, dtype="i32", doc="first of the ends of a mover")
        self.end_of = field("end_of", sum(sizes), dtype="i32", doc="2 spring + (0 first, 1 second end)")
        self.numbers = [
            np.array([place[id(grip[0]), int(i)] for i in grip[1]], np.int32) if grip is not None else np.zeros(0, np.int32)
            for ends in held
            for grip in ends
        ]
        put = runtime.put
        put(self.stiffness, np.array([s.stiffness for s in springs], float))
        put(self.length, np.array([np.nan if s.length is None else s.length for s in springs]))
        put(self.preload, np.array([s.preload for s in springs], float))
        put(self.damping, np.array([s.damping for s in springs], float))
        put(self.only, np.array([{None: BOTH, "pull": PULL, "push": PUSH}[s.only] for s in springs], np.int32))
        put(self.ground, np.array([point for s in springs for point in s.points], float))
        put(self.arm, np.array([np.zeros(3) if grip is None else grip[2] for ends in held for grip in ends]))
        put(self.start, np.r_[0, np.cumsum(sizes)].astype(np.int32))
        mover = np.concatenate(self.numbers)
        end = np.repeat(np.arange(2 * n), sizes)
        order = np.argsort(mover, kind="stable")
        put(self.mover, mover)
        put(self.start_of, np.r_[0, np.cumsum(np.bincount(mover, minlength=movers))].astype(np.int32))
        put(self.end_of, end[order].astype(np.int32))

    def fastest(self, ends: Places) -> tuple[float, float]:
        """Bounds of omega [rad/s] and of the rate of damping [1/s], as the springs lie at t = 0."""
        ease, arm = runtime.get(ends.ease, ends.n).max(axis=1), runtime.get(self.arm, 2 * self.n)
        lever = np.zeros(ends.n)  # 1 / I of movers that turn
        if ends.n > ends.turning:
            turning = ends.n - ends.turning
            lever[ends.turning :] = runtime.get(ends.loose_turn, turning) / runtime.get(ends.moments, turning).min(axis=1)
        mobility = np.array(
            [
                (ease[movers] + lever[movers] * (arm[e] ** 2).sum()).sum() / len(movers) ** 2 if len(movers) else 0.0
                for e, movers in enumerate(self.numbers)
            ]
        )
        mobility = mobility[::2] + mobility[1::2]
        k, c, l, length, preload = (runtime.get(f, self.n) for f in (self.stiffness, self.damping, self.l, self.length, self.preload))
        across = np.abs(preload + k * (l - length)) / np.maximum(l, 1e-30)
        totals = []
        for stiff in (np.maximum(k, across), c):
            total = np.zeros(ends.n)
            for e, movers in enumerate(self.numbers):
                total[movers] += stiff[e // 2] * mobility[e // 2]
            totals.append(float(total.max(initial=0.0)))
        return math.sqrt(totals[0]), totals[1]


@ti.func
def _end(bonds: ti.template(), ends: ti.template(), e, turning):
    """Place and velocity (at the half step before) of end e."""
    x, v = bonds.ground[e], ti.Vector([0.0, 0.0, 0.0], ti.f64)
    first, last = bonds.start[e], bonds.start[e + 1]
    if last > first:
        x *= 0.0
        for k in range(first, last):
            m = bonds.mover[k]
            point, moves = ends.x[m], ends.before[m]
            if m >= turning:
                arm = turned(ends.q[m - turning], bonds.arm[e])
                point += arm
                moves += ends.spin_before[m - turning].cross(arm)
            x += point / (last - first)
            v += moves / (last - first)
    return x, v


@ti.func
def _stretch(bonds: ti.template(), ends: ti.template(), b, turning):
    x, v = _end(bonds, ends, 2 * b, turning)
    y, w = _end(bonds, ends, 2 * b + 1, turning)
    l = (y - x).norm()
    bonds.l[b] = l
    if l > 1e-12:  # two ends in one place keep the direction that they had
        bonds.direction[b] = (y - x) / l
    bonds.pace[b] = (w - v).dot(bonds.direction[b])


@ti.kernel
def _measure(bonds: ti.template(), ends: ti.template(), n: ti.i32, turning: ti.i32):
    for b in range(n):
        _stretch(bonds, ends, b, turning)


@ti.func
def _allowed(only, f):
    result = f
    if only == PULL:
        result = ti.max(f, 0.0)
    elif only == PUSH:
        result = ti.min(f, 0.0)
    return result


@ti.kernel
def _pull(bonds: ti.template(), ends: ti.template(), n: ti.i32, turning: ti.i32):
    """Forces, and what is stored and taken."""
    for b in range(n):
        _stretch(bonds, ends, b, turning)
        l, k = bonds.l[b], bonds.stiffness[b]
        whole = bonds.preload[b] + k * (l - bonds.length[b])
        T = _allowed(bonds.only[b], whole)
        F = _allowed(bonds.only[b], whole + bonds.damping[b] * bonds.pace[b])
        bonds.taken[b] += 0.5 * (F - T + bonds.viscous[b]) * (l - bonds.l_before[b])
        bonds.stored[b] = T * T / (2.0 * k) if k > 0.0 else T * l
        bonds.force[b], bonds.viscous[b], bonds.l_before[b] = F, F - T, l


@ti.kernel
def _gather(bonds: ti.template(), ends: ti.template(), movers: ti.i32, turning: ti.i32, kick: ti.f64):
    """Impulses of the springs on each mover over the kick to come."""
    for m in range(movers):
        J = ti.Vector([0.0, 0.0, 0.0], ti.f64)
        L = J
        for k in range(bonds.start_of[m], bonds.start_of[m + 1]):
            e = bonds.end_of[k]
            b = e // 2
            part = kick * bonds.force[b] / (bonds.start[e + 1] - bonds.start[e]) * bonds.direction[b]
            if e % 2 == 1:
                part = -part
            J += part
            if m >= turning:
                L += turned(ends.q[m - turning], bonds.arm[e]).cross(part)
        ends.impulse[m] = J
        if m >= turning:
            ends.twist[m - turning] = L
