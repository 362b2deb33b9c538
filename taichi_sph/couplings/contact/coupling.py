"""Contact as a coupling of the world: the surfaces of all bodies (T 3.3)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...bodies.body import Entries, Group, Now, common_schedule
from ...bodies.surface import Surface
from ...pool import Pool
from ...scene.schema import Scene
from ..carried import carried
from ..coupling import Coupling
from ..ports import Port
from .multipliers import Contact
from .pairs import Meetings, Table
from .said import Meeting, PinballContact


def couplings(scene: Scene, groups: Sequence[Group], own: Sequence[Meeting]) -> list[ContactCoupling]:
    """Contact, where something can meet something."""
    surfaces = [surface for group in groups if (surface := group.surface()) is not None]
    table = meetings(scene, surfaces)
    return [ContactCoupling(scene, groups, surfaces, table)] if table.meets.any() else []


def meetings(scene: Scene, surfaces: list[Surface]) -> Meetings:
    """Who meets whom by contact, and how, in the order of the surfaces."""
    bodies = [
        (s, span.name, e, led) for s in surfaces for span, e, led in zip(s.bodies, s.bounce, s.led or [False] * len(s.bodies), strict=True)
    ]
    meets = np.zeros((len(bodies), len(bodies)), bool)
    restitution, friction = np.zeros(meets.shape), np.zeros(meets.shape)
    for j, (one, name, e, led) in enumerate(bodies):
        for k, (two, other, f, led_too) in enumerate(bodies):
            said = scene.met(name, other)
            meets[j, k] = said.meet and not (led and led_too) and (one.reaches(two) or two.reaches(one))
            own = 0.0 if e is None or f is None else max(e, f)
            restitution[j, k] = own if said.restitution is None else said.restitution
            friction[j, k] = said.friction
    return Meetings(meets, restitution, friction)


class ContactCoupling(Coupling):
    """contact: the solver."""

    def __init__(self, scene: Scene, groups: Sequence[Group], surfaces: list[Surface], meetings: Meetings) -> None:
        self.common = common_schedule(groups)
        # ties and welds change what contact made of velocities
        self.late = bool(scene.welds) or any(shell.patch is not None for shell in scene.shells)
        flat, faced = (
            np.array([element is not None for element, s in zip(elements, surfaces) for _ in s.bodies])
            for elements in zip(*((s.discs, s.faces) for s in surfaces))
        )
        skinned = np.concatenate([s.skinned for s in surfaces])
        walls = bool(meetings.meets[faced][:, skinned].any())
        needed = ~skinned | meetings.meets[:, ~faced].any(axis=1)  # what shells alone meet needs no balls
        first = 0
        for s in surfaces:
            s.balls = None if s.balls is None else s.balls.of(needed[first : first + len(s.bodies)])
            first += len(s.bodies)
        port = Port(surfaces, thin=walls or bool(meetings.meets[flat][:, flat].any()), walled=walls)
        order = [port.names.index(span.name) for s in surfaces for span in s.bodies]  # the port has those that turn last
        place = np.argsort(order)
        table = Table(Meetings(*(said[place][:, place] for said in meetings)))
        close = 0.5 * min(s.length for s in surfaces)
        # the few balls of strikers are small and fast: pairs that are kept ready farther out are searched for less often
        skin = 0.5 * min((s.length for s in surfaces if not s.few), default=2.0 * close)
        hidden = carried(scene, groups, "contact.carried", port.names)
        self.contact = Contact(port, table, scene.numerics.contact or PinballContact(), skin, close, hidden)
        for s in surfaces:
            s.meets()

    def start(self) -> None:
        """SceneError when bodies lie in each other at t = 0."""
        self.contact.check_start()

    def correct(self, now: Now) -> None:
        self.contact.add(now, self.common, not self.late)

    def book(self, now: Now) -> None:
        if self.late:
            self.contact.book(now, True)

    def entries(self) -> Entries:
        return Entries(internal=self.contact.taken())

    def given(self) -> float:
        return sum(self.contact.taken().values())

    def report(self) -> dict[str, float]:
        return self.contact.report()

    def status(self) -> dict[str, int]:
        return {"contacts": self.contact.touching, "iterations": self.contact.iterations}

    def pools(self) -> list[Pool]:
        return self.contact.pools()
