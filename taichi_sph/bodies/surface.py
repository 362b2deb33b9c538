"""What a group of bodies shows to couplings: movers, which have a velocity and take impulses, and the elements of its surface.

A mover is a shell node, a particle, a rigid body. An element is a ball or a disc that belongs to a mover. Couplings know of a body what
stands here, and nothing of its kind.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..runtime import ti
from .body import Now, Span


@dataclass(frozen=True)
class Balls:
    """Spheres: numbers of their movers and bodies in the group (k,), and `radius` (k, 2) [m].

    radius: the first one against balls and against discs at a lip or border, the second one against a sound disc. arm (k, 3) [m]:
    from the mover's place at t = 0, turning with it; None where each ball is a mover of its own.
    """

    mover: np.ndarray
    body: np.ndarray
    radius: np.ndarray
    arm: np.ndarray | None = None

    def of(self, bodies: np.ndarray) -> Balls | None:
        """Those of some bodies: a mask of the group's."""
        own = bodies[self.body]
        return Balls(self.mover[own], self.body[own], self.radius[own], None if self.arm is None else self.arm[own]) if own.any() else None


@dataclass(frozen=True)
class Discs:
    """Rounded discs across the director of their movers, one for each mover: bodies (n,) in the group, half the thickness (n,) [m].

    radius (n,) [m] of the flat disc at t = 0, written anew at each search (`look`), with whether the disc is sound; border (n,): 1 on the
    border of the reference; reference (n, 3) [m]: places at t = 0.
    """

    body: np.ndarray
    half: np.ndarray
    radius: np.ndarray
    border: np.ndarray
    reference: np.ndarray


@dataclass(frozen=True)
class Faces:
    """Cells between the movers of discs: corners (F, 4), numbers of movers in the group, the last one -1 in a triangle.

    Whether a cell is whole is written at each search (`look`).
    """

    corners: np.ndarray


@dataclass(frozen=True)
class Walls:
    """The skin of bodies that turn, met from outside: triangles between points that are fixed to a mover.

    mover and body (V,) in the group, of each point; arm (V, 3) [m]: from the mover's place at t = 0, turning with it; tip (V,): 1 where
    the skin is convex, so that a point can be the first to touch; corners (T, 3): points of each triangle, round its outer normal.
    """

    mover: np.ndarray
    body: np.ndarray
    arm: np.ndarray
    tip: np.ndarray
    corners: np.ndarray


class First(NamedTuple):
    """Where a group's numbers begin among those of all groups. Kernels take it as FIRST."""

    mover: int = 0
    body: int = 0
    ball: int = 0
    thin: int = 0
    disc: int = 0
    face: int = 0
    point: int = 0
    wall: int = 0


FIRST = ti.types.vector(len(First._fields), ti.i32)
MOVER, BODY, BALL, THIN, DISC, FACE, POINT, WALL = range(len(First._fields))  # its columns


class Surface:
    """A group as couplings see it. Each kind derives its own, with one kernel for each of `look`, `offer` and `take`.

    bodies: the group's; n: movers; turns: whether its movers turn (offers then fill the fields of what turns); few: so few balls that each
    is tried against everything; loose: a filling, which may touch its vessel at t = 0; length [m]: the shortest one that contact has to
    resolve; bounce: Newton's restitution of each body against another that has one, None of bodies that bounce by themselves; led: whether
    nothing pushes a body, for it is held or driven.

    balls, discs and faces: the elements. A group with discs has the faces between them as well, and a thin ball of half the thickness at
    each mover: by these two shells meet. walls: the skin of those bodies that have one. What has faces meets
    that, the rest the balls behind it.
    """

    group: Any  # of the kind that derives
    bodies: Sequence[Span] = ()
    n = 0
    turns = False
    few = False
    loose = False
    length = np.inf
    bounce: Sequence[float | None] = ()
    led: Sequence[bool] = ()
    balls: Balls | None = None
    discs: Discs | None = None
    faces: Faces | None = None
    walls: Walls | None = None
    first = First()

    @property
    def n_balls(self) -> int:
        return 0 if self.balls is None else len(self.balls.mover)

    @property
    def skinned(self) -> np.ndarray:
        """(bodies,) whether a body has walls."""
        return np.isin(np.arange(len(self.bodies)), [] if self.walls is None else self.walls.body)

    @property
    def period(self) -> int:
        """Steps of the clock for which an impulse on this group stands: it takes part in every so many of them."""
        return 1

    @property
    def renumbered(self) -> bool:
        """Whether the movers stand in another order than at the step before, or others can be met than then."""
        return False

    @property
    def source(self) -> Any:
        """Field of i32: where each mover stood at the step before, of a group with a ball for each; None where that does not tell what can
        be met now. Asked where the group is `renumbered`."""
        return None

    def reaches(self, other: Surface) -> bool:
        """Whether an element of this group can meet one of the other: two fillings cannot, their pair forces part them."""
        mine = self.balls is not None
        return (mine and self.few and other.balls is not None) or ((mine or self.discs is not None) and other.discs is not None)

    def meets(self) -> None:
        """Called once, when contact may push the group."""

    def grip(self, span: Span, point: np.ndarray, radius: float | None) -> tuple[np.ndarray, np.ndarray]:
        """What holds a point (3,) [m] of the reference: numbers of the movers in the group, and the (3,) arm of the point from them.

        radius [m]: all movers within that of the point instead of the nearest one, where a body has many. Written by kinds of body with
        `holds_springs`.
        """
        raise NotImplementedError(f"bodies of the kind '{self.group.kind}' hold springs, and their surface has no `grip`")

    def look(self, port: Any, places: bool) -> None:
        """Speed of the fastest point of each body; with `places` also where all elements are, which cells are whole, and the shape of the
        discs of those bodies that are due."""
        raise NotImplementedError

    def offer(self, port: Any, first: int, last: int, now: Now) -> None:
        """What the movers at the places first .. last - 1 of the port's list are and would do without contact, at n + 1/2."""
        raise NotImplementedError

    def take(self, port: Any, first: int, last: int, now: Now) -> None:
        """Impulses of those movers, as forces."""
        raise NotImplementedError
