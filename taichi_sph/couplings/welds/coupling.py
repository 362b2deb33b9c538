"""Welds: nodes of several shells that move as one.

With v*_i the velocities to come without the weld, those of a seam become

    v = sum m_i v*_i / sum m_i        J_i = m_i (v - v*_i)

component by component. A component that is prescribed on one of the nodes holds for all of them. The impulses J_i add up to nothing and do
no work, unless a component is prescribed: then the support works through the weld, and this work is booked. Nodes that stand in one place
at the start stay in one place, to rounding.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ... import runtime
from ...bodies.body import Entries, Group, Now, holding
from ...pool import Pool
from ...runtime import ti
from ..coupling import Coupling
from ..places import Places
from .places import welded
from .said import Weld


def couplings(scene: Any, groups: Sequence[Group], own: Sequence[Weld]) -> "list[Welds]":
    """All welds of the scene are one coupling."""
    return [Welds(groups, own)] if own else []


class Welds(Coupling):
    """ends: the nodes that are welded; seams: which of them move as one."""

    def __init__(self, groups: Sequence[Group], welds: Sequence[Weld]):
        names = list(dict.fromkeys(name for weld in welds for name in weld.between))
        of: dict[int, Any] = {}
        first, points, spacing = {}, {}, {}
        for name in names:
            group, span = holding(groups, name)
            surface = of.setdefault(id(group), group.surface())
            points[name], spacing[name] = surface.discs.reference[span.rows], surface.length
            first[name] = (surface, span.first)
        self.surfaces = list(of.values())
        number = {id(s): k for k, s in enumerate(self.surfaces)}  # an address is another one in each run, and sums over a seam go in order
        seams = [
            sorted((number[id(first[body][0])], first[body][1] + node) for body, node in seam) for seam in welded(welds, points, spacing)
        ]
        movers = [sorted(i for seam in seams for surface, i in seam if surface == k) for k in range(len(self.surfaces))]
        self.bounds = np.r_[0, np.cumsum([len(m) for m in movers])]
        n = int(self.bounds[-1])
        self.ends = Places("welds.ends", n, n)
        runtime.put(self.ends.who, np.concatenate([np.array(m, np.int32) for m in movers]))
        self.ends.pushed[0] = 1
        place = {(s, i): int(b) + k for s, (b, m) in enumerate(zip(self.bounds, movers)) for k, i in enumerate(m)}
        self.seams = Seams([[place[node] for node in seam] for seam in seams])

    def correct(self, now: Now) -> None:
        for s, first, last in zip(self.surfaces, self.bounds[:-1], self.bounds[1:]):
            s.offer(self.ends, int(first), int(last), now)
        _join(self.seams, self.ends, self.seams.n)
        for s, first, last in zip(self.surfaces, self.bounds[:-1], self.bounds[1:]):
            s.take(self.ends, int(first), int(last), now)

    def entries(self) -> Entries:
        return Entries(external=float(runtime.get(self.seams.work, self.seams.n).sum()))

    def status(self) -> dict[str, int]:
        return {"welded": self.ends.n}

    def pools(self) -> list[Pool]:
        return [self.ends, self.seams]


class Seams(Pool):
    """Places of the list that move as one."""

    def __init__(self, seams: list[list[int]]):
        super().__init__("welds.seams")
        self.n = n = len(seams)
        sizes = [len(seam) for seam in seams]
        self.start = self.field("start", n + 1, dtype="i32", doc="first of the places of a seam")
        self.place = self.field("place", sum(sizes), dtype="i32", doc="on the list")
        self.work = self.field("work", n, dtype="f64", unit="J", doc="of supports, through the weld, so far", keeps=True)
        runtime.put(self.start, np.r_[0, np.cumsum(sizes)].astype(np.int32))
        runtime.put(self.place, np.concatenate([np.array(seam, np.int32) for seam in seams]))


@ti.kernel
def _join(seams: ti.template(), ends: ti.template(), n: ti.i32):
    for s in range(n):
        for c in ti.static(range(3)):
            mass, momentum, led, held = ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64), 0
            for k in range(seams.start[s], seams.start[s + 1]):
                m = seams.place[k]
                if ends.ease[m][c] > 0.0:
                    mass += 1.0 / ends.ease[m][c]
                    momentum += ends.free[m][c] / ends.ease[m][c]
                else:
                    held += 1
                    led += ends.free[m][c]
            v = led / ti.max(held, 1)
            if held == 0:
                v = momentum / mass
            for k in range(seams.start[s], seams.start[s + 1]):
                m = seams.place[k]
                ends.impulse[m][c] = 0.0
                if ends.ease[m][c] > 0.0:
                    J = (v - ends.free[m][c]) / ends.ease[m][c]
                    ends.impulse[m][c] = J
                    seams.work[s] += 0.5 * J * (ends.before[m][c] + v)
