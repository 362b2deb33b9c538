"""What every kind of body offers the world: a group of bodies in one pool, and how it takes part in a step.

A body is what the user says, under one name. Taichi compiles a kernel once for each pool object. So a group holds all bodies of one kind
with the same laws in one set of pools. A body is a span of its rows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

if TYPE_CHECKING:
    from ..frame import BodyFrame
    from ..pool import Pool
    from .surface import Surface
    from .wettable import Wettable


@dataclass(frozen=True)
class Span:
    """A body in its group: its points are first .. first + n - 1 of the pool."""

    name: str
    first: int
    n: int

    @property
    def rows(self) -> slice:
        """Its rows of an array of the pool."""
        return slice(self.first, self.first + self.n)


@dataclass
class Now:
    """The step that is being taken: `time` [s] and `step` number of its beginning, the steps that led here and that lead on [s].

    due(group): the group takes its own step now. That step is `every` steps of the clock long.
    """

    time: float = 0.0
    step: int = 0
    dt_before: float = 0.0
    dt: float = 0.0

    @property
    def half_time(self) -> float:
        """Time of the velocities to come, v_n+1/2 [s]."""
        return self.time + 0.5 * self.dt

    @property
    def kick(self) -> float:
        """Time over which a force at n changes velocities [s]."""
        return 0.5 * (self.dt_before + self.dt)

    def due(self, group: Group) -> bool:
        return self.step % group.every == 0


@dataclass
class Entries:
    """Energies [J] of a group or a coupling at the time of the last force evaluation.

    internal: stored, or taken by what bodies are made of and by contact; numerical: taken by what keeps the computation calm;
    external: work of loads, supports and gravity.
    """

    kinetic: float = 0.0
    external: float = 0.0
    internal: dict[str, float] = field(default_factory=dict)
    numerical: dict[str, float] = field(default_factory=dict)

    def add(self, other: Entries) -> None:
        self.kinetic += other.kinetic
        self.external += other.external
        for mine, theirs in ((self.internal, other.internal), (self.numerical, other.numerical)):
            for name, value in theirs.items():
                mine[name] = mine.get(name, 0.0) + value


class Clocked(Protocol):
    """What stands in place of motion sees of a world: `time` [s] and `step` of its clock; `take`, one step of the bodies."""

    time: float
    step: int

    def take(self, dt_before: float, dt: float) -> None: ...


class Tips(NamedTuple):
    """What may strike a shell: places (K, 3) [m], radii (K,) [m], velocities (K, 3) [m/s]; turning (K,): what a spin may add [m/s]."""

    places: np.ndarray
    radii: np.ndarray
    velocities: np.ndarray
    turning: np.ndarray


class InPlace(Protocol):
    """What is done in place of motion. work: of the loads so far [J]; rule: what sets its steps, in words."""

    units: dict[str, str]  # of entries of the status

    @property
    def work(self) -> float: ...

    @property
    def rule(self) -> str: ...

    def pools(self) -> Sequence[Pool]: ...

    def settle(self, time: float) -> None:
        """One step of it, to the pseudo-time `time` [s]."""
        ...

    def status(self) -> dict[str, float]: ...


class Group(Protocol):
    """A kind of body at work. A step calls strain, events, force and move, in this order, couplings in between (world/step.py)."""

    kind: str
    every: int  # steps of the clock between two of its own

    @property
    def bodies(self) -> Sequence[Span]:
        """In the order of their points in the pools."""
        ...

    def pools(self) -> Sequence[Pool]:
        """All that has fields or history, in the order in which a restart renews it."""
        ...

    @property
    def n_nodes(self) -> int:
        """Nodes or particles; none where a body moves as one."""
        ...

    @property
    def stress_points(self) -> int:
        """How many the group has."""
        ...

    def start(self) -> None:
        """All bodies are there: velocities, what follows from others."""
        ...

    def strain(self, now: Now) -> None:
        """Stresses from the places at n; history advances."""
        ...

    def events(self, now: Now) -> None:
        """Rupture, renumbering, lists that are worn out."""
        ...

    def force(self, now: Now) -> None:
        """Forces at n: they overwrite those of the step before."""
        ...

    def move(self, now: Now) -> None:
        """Kick and drift; the energies at n."""
        ...

    def longest_step(self) -> dict[str, float]:
        """The longest step of the group's own [s], by what rules it; empty where the group follows any other."""
        ...

    def alone(self) -> dict[str, float]:
        """The longest step [s] of a group that follows any other, by what rules it, where no group has one of its own."""
        ...

    def hastens(self, now: Now) -> bool:
        """Whether the group needs a shorter step from now on."""
        ...

    def entries(self) -> Entries:
        """Energies at the time of the last force evaluation."""
        ...

    def given(self) -> float:
        """Energy that the group held at t = 0 beside the kinetic one [J]."""
        ...

    def pressed(self) -> float:
        """Work of the pressures that the scene prescribes [J]."""
        ...

    def look(self, now: Now) -> None:
        """RunStopped, with a sentence, when something cannot be true any more."""
        ...

    def negligible(self, dt: float) -> float:
        """The energy [J] that rounding alone makes: that of strains of its size, or of ways of its size in a step dt [s]. The energy
        balance of a run that holds no more than this, of all groups together, says nothing."""
        ...

    def status(self) -> dict[str, int]:
        """Small numbers for the progress line."""
        ...

    def frames(self) -> list[BodyFrame]:
        """Each body now."""
        ...

    def probed(self, point: tuple[float, float, float], name: str | None = None) -> int:
        """Number in the group of what a probe at a reference point [m] follows, of the body of that name."""
        ...

    def probe(self, i: int) -> dict[str, float]:
        """What a probe reads there: displacement u_x, u_y, u_z [m] and velocity v_x, v_y, v_z [m/s]."""
        ...

    track_units: dict[str, str]  # of the columns of `tracks`

    def tracks(self, look: bool = True) -> dict[str, dict[str, float]]:
        """What is followed of the bodies all the time, by the name of its history. look: it is a sample, not a second look at one."""
        ...

    def surface(self) -> Surface | None:
        """What couplings see of the group; None where nothing can touch it."""
        ...

    def wettables(self, name: str, spacing: float, meets: Callable[[str], bool]) -> Sequence[Wettable]:
        """The points that water presses on, about `spacing` [m] apart where the group is free to choose; name: of the pools that they
        need; meets: whether a body of that name is met at all. Points of bodies that are not met stay out: how far they go would tell when
        lists are made."""
        ...

    def tips(self, meets: Callable[[str], bool]) -> Tips:
        """What may strike a shell, of bodies that `meets` names."""
        ...

    def instead(self, world: Clocked, alike: Sequence[Any]) -> InPlace | None:
        """What the scene asks of all groups of this kind, `alike`, in place of motion; None where they move."""
        ...


class Rest:
    """What a kind that has nothing to say of something says. Kinds derive from it and write what they need."""

    kind = ""
    bodies: Sequence[Span] = ()
    every = 1
    track_units: dict[str, str] = {}

    @property
    def n_nodes(self) -> int:
        return sum(span.n for span in self.bodies)

    @property
    def stress_points(self) -> int:
        return 0

    def start(self) -> None:
        """All is there."""

    def pools(self) -> Sequence[Pool]:
        return ()

    def strain(self, now: Now) -> None:
        """Nothing to strain."""

    def events(self, now: Now) -> None:
        """Nothing happens."""

    def force(self, now: Now) -> None:
        """No forces of its own."""

    def longest_step(self) -> dict[str, float]:
        return {}

    def alone(self) -> dict[str, float]:
        return {}

    def hastens(self, now: Now) -> bool:
        return False

    def given(self) -> float:
        return 0.0

    def pressed(self) -> float:
        return 0.0

    def look(self, now: Now) -> None:
        """All is believed."""

    def negligible(self, dt: float) -> float:
        return 0.0

    def status(self) -> dict[str, int]:
        return {}

    def probed(self, point: tuple[float, float, float], name: str | None = None) -> int:
        raise NotImplementedError(f"bodies of the kind '{self.kind}' bear probes, and their group has no `probed` and no `probe`")

    def probe(self, i: int) -> dict[str, float]:
        raise NotImplementedError

    def tracks(self, look: bool = True) -> dict[str, dict[str, float]]:
        return {}

    def surface(self) -> Surface | None:
        return None

    def wettables(self, name: str, spacing: float, meets: Callable[[str], bool]) -> Sequence[Wettable]:
        return ()

    def tips(self, meets: Callable[[str], bool]) -> Tips:
        return Tips(np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3)), np.zeros(0))

    def instead(self, world: Clocked, alike: Sequence[Any]) -> InPlace | None:
        return None


def holding(groups: Sequence[Any], name: str) -> tuple[Any, Span]:
    """The group of the body of that name, and the body."""
    return next((group, span) for group in groups for span in group.bodies if span.name == name)


def common_schedule(groups: Sequence[Group]) -> int:
    """Steps of the clock after which all groups are due together."""
    return math.lcm(*(group.every for group in groups)) if groups else 1
