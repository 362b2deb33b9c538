"""What the user says: a strict, frozen, validated description of a run. No Taichi here.

Physics (bodies, what couples them, loads, motions, duration) stands apart from `Numerics` (how it is computed) and
`Output` (what is kept). Every number is SI once validated; strings with units ("4 mm", "32 GPa",
"15 us") are accepted wherever a dimensional type of `units` stands. Unknown keys are refused, and so
are values that no body of this world has (`plausible`): they are wrong units more often than intentions.

What a kind of body or coupling says, and what it checks against the rest of a scene, stands in its own said.py.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from itertools import combinations_with_replacement
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, SerializeAsAny, StrictBool, StrictInt, ValidationError, model_validator

from .. import bodies as body_folder
from .. import couplings as coupling_folder
from ..bodies.fluid.said import Fluid, Wall
from ..bodies.rigid.said import Rigid
from ..bodies.shell.said import PARTICLES, Shell
from ..bodies.solid.said import Solid
from ..couplings.contact.said import Meeting, Met, meeting, met
from ..couplings.gas.said import Gas
from ..couplings.springs.said import Spring
from ..couplings.welds.said import Weld
from ..errors import nearest
from . import plausible
from .base import Body, Frozen, Name
from .check import sentence
from .instead import Modes, Static, StepLimit
from .kept import Output, Quantity
from .kinds import Kinds
from .loads import InitialVelocity, NodalForce, NodalMoment, PrescribedVelocity, SurfacePressure
from .numerics import Numerics
from .units import Acceleration, Time
from .until import LeakKnown

LOADS = ("forces", "moments", "pressures", "gases", "motions", "initial")
OWN = ("spacing", "cells", "irregularity", "seed", "formulation", "raised_inertia")  # of the numerics, that a body may say for itself


def _of(kinds: Kinds, key: str) -> BeforeValidator:
    """A table with a `kind`, as the class of the kind of that name; the kinds are looked up when a scene is made."""

    def choose(value: Any) -> Any:
        known: dict[Any, type[Frozen]] = {kind.name: kind.said for kind in kinds(key) if kind.said is not None}
        if not isinstance(value, Mapping):
            if type(value) in known.values():
                return value
            raise ValueError(f"is none of the kinds that are known{nearest(type(value).__name__, known) if known else '; there are none'}")
        if value.get("kind") not in known:
            raise ValueError(f"needs a 'kind'; there is no '{value.get('kind')}'{nearest(str(value.get('kind')), known)}")
        try:
            return known[value["kind"]].model_validate(value)
        except ValidationError as error:
            raise ValueError(sentence(error, known[value["kind"]])) from None

    return BeforeValidator(choose)


class Scene(Frozen):
    """A whole run. `quality` and `parameters` say how the script was called (for the record).

    `others` and `interactions`: bodies and couplings of kinds that have no key of their own, by their `kind`.
    """

    name: Name
    title: str
    source: str
    quality: Literal["draft", "standard", "paper", "custom"] = "custom"
    parameters: dict[str, StrictBool | StrictInt | float | str] = {}
    shells: tuple[Shell, ...] = ()
    rigids: tuple[Rigid, ...] = ()
    fluids: tuple[Fluid, ...] = ()
    solids: tuple[Solid, ...] = ()
    others: tuple[Annotated[SerializeAsAny[Body], _of(body_folder.kinds, "others")], ...] = ()
    walls: Annotated[tuple[Wall, ...], Field(max_length=200)] = ()  # of the fluids
    meetings: Annotated[tuple[Meeting, ...], Field(max_length=2000)] = ()  # who meets whom, where that is not all
    springs: Annotated[tuple[Spring, ...], Field(max_length=2000)] = ()
    welds: Annotated[tuple[Weld, ...], Field(max_length=2000)] = ()
    interactions: tuple[Annotated[SerializeAsAny[Frozen], _of(coupling_folder.kinds, "interactions")], ...] = ()
    forces: tuple[NodalForce, ...] = ()
    moments: tuple[NodalMoment, ...] = ()
    pressures: tuple[SurfacePressure, ...] = ()
    gases: tuple[Gas, ...] = ()
    gravity: tuple[Acceleration, Acceleration, Acceleration] | None = None
    motions: tuple[PrescribedVelocity, ...] = ()
    initial: tuple[InitialVelocity, ...] = ()
    duration: Annotated[Time, Field(gt=0)]
    until: LeakKnown | None = None
    static: Static | None = None
    modes: Modes | None = None
    limit: StepLimit | None = None
    numerics: Numerics
    output: Output = Output()
    quantities: tuple[Quantity, ...] = ()

    @model_validator(mode="after")
    def _believable(self) -> Scene:
        plausible.names(self)
        self._name_the_only_one()
        for said in (*self.bodies, *self.couplings):
            if hasattr(said, "check"):
                said.check(self)
        if self.until is not None:
            self.until.check(self)
        plausible.scene(self)
        return self

    def _name_the_only_one(self) -> None:
        """Entries that name no body take the only one that can bear them: from here on all of them name theirs."""
        for key in LOADS:
            self.__dict__[key] = tuple(self._named(entry, key, f"{key}[{n}]") for n, entry in enumerate(getattr(self, key)))
        for key in ("probes", "gauges"):
            before = getattr(self.output, key)
            named = tuple(self._named(entry, key, f"output.{key}[{n}]") for n, entry in enumerate(before))
            if named != before:
                self.__dict__["output"] = self.output.model_copy(update={key: named})

    def _named(self, entry: Any, key: str, where: str) -> Any:
        able = [body.name for body in self.bodies if key in body.bears]
        if entry.body is None:
            if len(able) != 1:
                which = f"name one of {', '.join(able)}" if able else "the scene has none that it could be"
                raise ValueError(f"{where}.body is missing: {which}")
            return entry.model_copy(update={"body": able[0]})
        names = [body.name for body in self.bodies]
        if entry.body not in names:
            raise ValueError(f"{where}.body: there is no body '{entry.body}'{nearest(entry.body, able or names)}")
        if entry.body not in able:
            raise ValueError(f"{where}.body: '{entry.body}' is a {self.body(entry.body).what}; {key} of it are not possible yet")
        return entry

    # --- what stands in it ---

    @property
    def bodies(self) -> tuple[Any, ...]:
        """All bodies: shells, fluids, rigid bodies, solids, then the others."""
        return (*self.shells, *self.fluids, *self.rigids, *self.solids, *self.others)

    @property
    def couplings(self) -> tuple[Any, ...]:
        """What was said of pairs of bodies, and of gases in them: meetings, springs, welds, gases, then the other interactions."""
        return (*self.meetings, *self.springs, *self.welds, *self.gases, *self.interactions)

    def body(self, name: str) -> Any:
        """The body of that name, or the one whose part has it."""
        found = next((body for body in self.bodies if body.name == name), None)
        return found or next(body for body in self.bodies if body.name == name.removesuffix(PARTICLES))

    def key_of(self, said: Any) -> str:
        """Where something stands: "fluids[1]"."""
        key, number = self._place(said)
        return f"{key}[{number}]"

    def before(self, said: Any) -> tuple[Any, ...]:
        """What stands before it under the same key."""
        key, number = self._place(said)
        return getattr(self, key)[:number]

    def _place(self, said: Any) -> tuple[str, int]:
        keys = ("shells", "fluids", "rigids", "solids", "others", "meetings", "springs", "welds", "gases", "interactions")
        return next((key, n) for key in keys for n, entry in enumerate(getattr(self, key)) if entry is said)

    def loads_of(self, key: str, body: str) -> tuple[Any, ...]:
        """The entries of `forces`, `moments`, `pressures`, `gases`, `motions` or `initial` that name that body, in their order."""
        return tuple(load for load in getattr(self, key) if load.body == body)

    def numerics_of(self, body: Any) -> Numerics:
        """The numerics that hold for a body: those of the scene, with what the body says for itself."""
        own = {key: value for key in OWN if (value := getattr(body, key, None)) is not None}
        return self.numerics.model_copy(update=own) if own else self.numerics

    @property
    def formulations(self) -> str:
        """In which forms its shells and solids are computed, in words."""
        forms = [self.numerics_of(body).formulation for body in (*self.shells, *self.solids)] or [self.numerics.formulation]
        return ", ".join(dict.fromkeys(form.label for form in forms))

    def met(self, one: str, other: str) -> Met:
        """What holds between two bodies, by name: may they meet, with which restitution."""
        return met(self, one, other)

    def meets(self) -> Callable[[str, str], bool]:
        """Whether two bodies may meet, by name; to be asked of many."""
        return meeting(self)

    def thrown(self) -> tuple[str, float]:
        """The body that starts fastest, in words, and its speed [m/s]."""
        speeds = {body.name: math.hypot(*getattr(body, "velocity", (0.0,))) for body in self.bodies}
        for start in self.initial:
            own = math.hypot(*(start.velocity or (0.0,))) + (abs(start.radial.speed) if start.radial is not None else 0.0)
            speeds[start.body or ""] = max(own, speeds.get(start.body or "", 0.0))
        name = max(speeds, key=speeds.__getitem__)
        return f"{self.body(name).what} '{name}'", speeds[name]

    def pairs(self) -> list[tuple[str, str]]:
        """Names of the bodies that may meet, a body with itself where it has self-contact."""
        meets = self.meets()
        return [(a, b) for a, b in combinations_with_replacement([body.name for body in self.bodies], 2) if meets(a, b)]

    @property
    def increments(self) -> int | None:
        """Pseudo-time steps of a scene that asks for equilibrium, modes or a limit; None where time is time."""
        if self.static is not None:
            return self.static.increments
        if self.modes is not None:
            return self.modes.count
        return 1 if self.limit is not None else None

    def in_time(self, what: str, cause: str) -> None:
        """ValueError where the scene asks for no motion, though it holds something that only moves in time."""
        for key in plausible.TIMELESS:
            if getattr(self, key) is not None:
                raise ValueError(f"{key}: {what} in time; leave out {key} or {cause}")

    def derive(self, **changes: Any) -> Scene:
        """A new scene with some keys changed: scene.derive(**{"numerics.spacing": "1 mm"})."""
        from .script import derive

        return derive(self, **changes)
