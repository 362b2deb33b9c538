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
    """What holds between two bodies: whether they can touch, Newton's restitution (None: that of the bodies themselves), what the
    scene says in so many words of their touching (None: nothing), and Coulomb's coefficient of friction."""

    meet: bool
    restitution: float | None
    asked: bool | None
    friction: float = 0.0


class Meeting(Frozen):
    """Whether two bodies meet, and how. Pairs that no meeting names meet; a shell meets itself by its `self_contact` alone.

    `restitution`: Newton's, of each pair of points that meet. None: of two rigid bodies the larger of their own, of others 0; what is
    deformable bounces by itself. `friction`: Coulomb's coefficient, one for sticking and sliding; 0: they slide freely. A shell with
    `self_contact` may rub on itself: its name twice in `between`.
    """

    between: tuple[str, str]
    meet: StrictBool = True
    restitution: Annotated[Dimensionless, Field(ge=0, le=1)] | None = None
    friction: Annotated[Dimensionless, Field(ge=0, le=2)] = 0.0

    def check(self, scene: Any) -> None:
        """Against the rest of the scene."""
        where = scene.key_of(self)
        names = [body.name for body in scene.bodies]
        for name in self.between:
            if name not in names:
                raise ValueError(f"{where}.between: there is no body '{name}'{nearest(name, names)}")
        one, other = (scene.body(name) for name in self.between)
        if one is other:
            self._of_one(where, one)
        for before in scene.before(self):
            if before.between in (self.between, self.between[::-1]):
                raise ValueError(f"{where}: '{one.name}' and '{other.name}' have a meeting already; a pair has one")
        if self.meet and not (one.meets and other.meets):
            flat = other if one.meets else one
            raise ValueError(f"{where}: {flat.what} '{flat.name}' moves in its plane and cannot be met; give it motion = 'free'")
        soft = next((body for body in (one, other) if not body.bounces), None)
        if self.restitution is not None and soft is not None:
            raise ValueError(f"{where}.restitution is of solids; {soft.what} '{soft.name}' bounces by its pressure: leave it out")
        if self.friction and soft is not None:
            raise ValueError(f"{where}.friction is of solids; {soft.what} '{soft.name}' slides freely on what it wets: leave it out")
        if self.friction and not self.meet:
            raise ValueError(f"{where}.friction: '{one.name}' and '{other.name}' do not meet; leave friction out, or set meet to True")

    def _of_one(self, where: str, body: Any) -> None:
        """A body with itself: its friction alone may be said."""
        if not getattr(body, "self_contact", False):
            raise ValueError(f"{where}.between: '{body.name}' twice; a shell meets itself by its own self_contact")
        if not self.meet or self.restitution is not None:
            key = "restitution" if self.meet else "meet"
            raise ValueError(f"{where}.{key}: '{body.name}' meets itself by its own self_contact; only friction is said of it here")


def _parted(scene: Any) -> list[set[str]]:
    """Pairs of bodies that something else than contact stands between: a weld, a law."""
    return [{*said.between} for said in (*scene.welds, *(one for one in scene.interactions if getattr(one, "parts", False)))]


def met(scene: Any, one: str, other: str) -> Met:
    """What holds between two bodies of a scene, or parts of them, by name; parts of one body do not meet."""
    parts = one != other
    one, other = scene.body(one).name, scene.body(other).name
    if parts and one == other:
        return Met(False, None, None)
    said = next((m for m in scene.meetings if set(m.between) == {one, other}), None)
    if one == other:
        return Met(bool(getattr(scene.body(one), "self_contact", False)), None, None, 0.0 if said is None else said.friction)
    possible = scene.body(one).meets and scene.body(other).meets and {one, other} not in _parted(scene)
    if said is None:
        return Met(possible, None, None)
    return Met(said.meet and possible, said.restitution, said.meet, said.friction)


def meeting(scene: Any) -> Callable[[str, str], bool]:
    """Whether two bodies of a scene may meet, by name: `met` for scenes of thousands of them."""
    itself = {body.name: bool(getattr(body, "self_contact", False)) for body in scene.bodies}
    able = {body.name for body in scene.bodies if body.meets}
    apart = {frozenset(m.between) for m in scene.meetings if not m.meet} | {frozenset(pair) for pair in _parted(scene)}

    def meets(one: str, other: str) -> bool:
        if one == other:
            return itself[one]
        return one in able and other in able and not (apart and frozenset((one, other)) in apart)

    return meets


KIND = Kind("meeting", "meetings", Meeting, "taichi_sph.couplings.contact.coupling:couplings", rank=8)  # sees all other forces
