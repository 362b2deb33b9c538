"""Contact as the user says it: how it is solved, and who meets whom. No Taichi here."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, NamedTuple

from pydantic import Field, StrictBool

from ...errors import nearest
from ...scene.base import Frozen
from ...scene.kinds import Kind
from ...scene.units import Dimensionless


class PinballContact(Frozen):
    """How contact is solved. `tolerance`: largest approach speed left, over the largest that was found (or a hundredth of
    the fastest speed of all, where that is more); also the complementarity error allowed. `iterations`: when the solver
    gives up, which it reports."""

    tolerance: Annotated[Dimensionless, Field(gt=0, le=0.1)] = 1e-4
    iterations: Annotated[int, Field(ge=1, le=100_000)] = 1000


class Met(NamedTuple):
    """What holds between two bodies: whether they can touch, Newton's restitution (None: that of the bodies themselves), and what the
    scene says in so many words of their touching (None: nothing)."""

    meet: bool
    restitution: float | None
    asked: bool | None


class Meeting(Frozen):
    """Whether two bodies meet, and how. Pairs that no meeting names meet; a shell meets itself by its `self_contact` alone.

    `restitution`: Newton's, of each pair of points that meet. None: of two rigid bodies the larger of their own, of others 0; what is
    deformable bounces by itself.
    """

    between: tuple[str, str]
    meet: StrictBool = True
    restitution: Annotated[Dimensionless, Field(ge=0, le=1)] | None = None

    def check(self, scene: Any) -> None:
        """Against the rest of the scene."""
        where = scene.key_of(self)
        names = [body.name for body in scene.bodies]
        for name in self.between:
            if name not in names:
                raise ValueError(f"{where}.between: there is no body '{name}'{nearest(name, names)}")
        one, other = (scene.body(name) for name in self.between)
        if one is other:
            raise ValueError(f"{where}.between: '{one.name}' twice; a shell meets itself by its own self_contact")
        for before in scene.before(self):
            if before.between in (self.between, self.between[::-1]):
                raise ValueError(f"{where}: '{one.name}' and '{other.name}' have a meeting already; a pair has one")
        if self.meet and not (one.meets and other.meets):
            flat = other if one.meets else one
            raise ValueError(f"{where}: {flat.what} '{flat.name}' moves in its plane and cannot be met; give it motion = 'free'")
        soft = next((body for body in (one, other) if not body.bounces), None)
        if self.restitution is not None and soft is not None:
            raise ValueError(f"{where}.restitution is of solids; {soft.what} '{soft.name}' bounces by its pressure: leave it out")


def met(scene: Any, one: str, other: str) -> Met:
    """What holds between two bodies of a scene, by name."""
    if one == other:
        return Met(bool(getattr(scene.body(one), "self_contact", False)), None, None)
    said = next((m for m in scene.meetings if set(m.between) == {one, other}), None)
    possible = scene.body(one).meets and scene.body(other).meets and not any({*weld.between} == {one, other} for weld in scene.welds)
    if said is None:
        return Met(possible, None, None)
    return Met(said.meet and possible, said.restitution, said.meet)


def meeting(scene: Any) -> Callable[[str, str], bool]:
    """Whether two bodies of a scene may meet, by name: `met` for scenes of thousands of them."""
    itself = {body.name: bool(getattr(body, "self_contact", False)) for body in scene.bodies}
    able = {body.name for body in scene.bodies if body.meets}
    apart = {frozenset(m.between) for m in scene.meetings if not m.meet} | {frozenset(weld.between) for weld in scene.welds}

    def meets(one: str, other: str) -> bool:
        if one == other:
            return itself[one]
        return one in able and other in able and not (apart and frozenset((one, other)) in apart)

    return meets


KIND = Kind("meeting", "meetings", Meeting, "taichi_sph.couplings.contact.coupling:couplings", rank=8)  # sees all other forces
