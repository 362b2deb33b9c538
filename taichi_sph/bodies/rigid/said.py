"""Rigid bodies: strikers, blocks, anvils, tanks, made of pinballs (T 3.3) or of a surface. No Taichi here."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, StrictBool, model_validator

from ...scene.base import Body, Choice, Direction, Frozen, Point
from ...scene.histories import History, Step, factor
from ...scene.kinds import Kind
from ...scene.regions import Region
from ...scene.surfaces import Surface
from ...scene.units import Density, Dimensionless, Inertia, Length, Mass, Speed, Spin

LIKE = 1.0  # kg, of a body whose mass does not count


class Pinball(Frozen):
    """A sphere that makes contact: `centre` at t = 0, `radius`."""

    centre: Point
    radius: Annotated[Length, Field(gt=0)]


class DiscFace(Frozen):
    """A flat round face about `centre` that faces water along `normal` (any length), with a round `hole` of that radius in its middle.
    `within`: of its points at t = 0, those that lie in all these regions."""

    kind: Literal["disc"] = "disc"
    centre: Point
    normal: Direction
    radius: Annotated[Length, Field(gt=0)]
    hole: Annotated[Length, Field(ge=0)] = 0.0
    within: tuple[Region, ...] = ()

    @model_validator(mode="after")
    def _believable(self) -> DiscFace:
        if not any(self.normal):
            raise ValueError("normal is (0, 0, 0): give the direction from the face to the water")
        if self.hole >= self.radius:
            raise ValueError(f"hole {self.hole:g} m is not smaller than the radius {self.radius:g} m: nothing is left of the face")
        return self


class TubeFace(Frozen):
    """A round tube from `start` to `end` on its axis, with `water` inside or outside; `within` as of a disc."""

    kind: Literal["tube"] = "tube"
    start: Point
    end: Point
    radius: Annotated[Length, Field(gt=0)]
    water: Literal["inside", "outside"] = "inside"
    within: tuple[Region, ...] = ()

    @model_validator(mode="after")
    def _believable(self) -> TubeFace:
        if self.start == self.end:
            raise ValueError("start and end are one point: the tube has no length")
        return self


class Driven(Frozen):
    """The motion of a rigid body that goes its way whatever pushes it (a platen, a shaken anvil): the velocity of its centre of mass and
    its spin about that, each times the factor of the history."""

    velocity: tuple[Speed, Speed, Speed] = (0.0, 0.0, 0.0)
    spin: tuple[Spin, Spin, Spin] = (0.0, 0.0, 0.0)
    history: History = Step()

    @model_validator(mode="after")
    def _goes(self) -> Driven:
        if not any((*self.velocity, *self.spin)):
            raise ValueError("velocity and spin are all 0: a body that stays is held = true")
        return self

    def at(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """(3,) velocity [m/s] and (3,) spin [rad/s]."""
        now = factor(self.history.points, time)
        return now * np.array(self.velocity), now * np.array(self.spin)

    @property
    def fastest(self) -> float:
        """Largest factor of the history, by size."""
        return max(abs(value) for _, value in self.history.points)


class Rigid(Body):
    """A rigid body of one or many pinballs or of a `surface`, free to move and turn, held in place, or driven.

    `surface`: a closed one is the skin of a solid; its mass or `density` gives mass, centre and inertia by the volume. What is met lies on
    its `side`: "outside", or "inside" as in a tank, which is held or driven; so is what has an open surface, met on the side of its
    normals. `spacing`: of its nodes and pinballs, None: that of the numerics. Mass and inertia of a body that is held or driven do not
    count and may be left out.

    `inertia`: principal moments about the scene's axes [kg m2]; without it that of solid balls which share the mass
    by their volumes. `restitution` is Newton's, between this body and another rigid one (the larger of the two
    counts, and what `meetings` say of the pair before both): 0 is plastic, 1 elastic; what is deformable bounces by itself. It has no step
    of its own: a rigid body moves with the fastest of the others. `slides`: it moves along that axis alone and does not turn, as on a rail
    without friction; so a striker stays on the line where two planes of symmetry meet. Its `mass` is then a quarter of the whole one.

    `faces`: what water presses on, in place of the pinballs. Together they close what is solid as far as the water's kernel reaches:
    w of couplings/wetted is a closed integral.
    """

    what: ClassVar[str] = "rigid body"
    holds_springs: ClassVar[bool] = True

    pinballs: Annotated[tuple[Pinball, ...], Field(max_length=100_000)] = ()
    surface: Surface | None = None
    side: Literal["outside", "inside"] | None = None
    spacing: Annotated[Length, Field(gt=0)] | None = None
    mass: Annotated[Mass, Field(gt=0)] | None = None
    density: Annotated[Density, Field(gt=0)] | None = None
    inertia: tuple[Inertia, Inertia, Inertia] | None = None
    velocity: tuple[Speed, Speed, Speed] = (0.0, 0.0, 0.0)
    spin: tuple[Spin, Spin, Spin] = (0.0, 0.0, 0.0)
    restitution: Annotated[Dimensionless, Field(ge=0, le=1)] = 0.0
    held: StrictBool = False
    driven: Driven | None = None
    slides: Literal["x", "y", "z"] | None = None
    faces: tuple[Annotated[DiscFace | TubeFace, *Choice], ...] = ()

    @model_validator(mode="after")
    def _believable(self) -> Rigid:
        if self.inertia is not None:
            a, b, c = sorted(self.inertia)
            if a <= 0:
                raise ValueError(f"inertia {list(self.inertia)} kg m2: all three principal moments must be above 0")
            if a + b < c * (1 - 1e-9):
                raise ValueError(f"inertia {list(self.inertia)} kg m2: no body has one moment above the sum of the two others")
        if self.held and any((*self.velocity, *self.spin)):
            raise ValueError(f"held: rigid '{self.name}' is held in place and cannot have a velocity or spin; leave one out")
        if self.driven is not None and (self.held or any((*self.velocity, *self.spin))):
            other = "is held in place" if self.held else "has a velocity or spin of its own"
            raise ValueError(f"driven: rigid '{self.name}' {other} as well; leave one out")
        if self.slides is not None:
            if not self.free:
                raise ValueError(f"slides: rigid '{self.name}' is {'held' if self.held else 'driven'} and takes no rail; leave one out")
            if any(v for axis, v in zip("xyz", self.velocity) if axis != self.slides) or any(self.spin):
                raise ValueError(
                    f"slides = '{self.slides}': rigid '{self.name}' moves along {self.slides} alone and does not turn; its velocity "
                    f"{list(self.velocity)} m/s and spin {list(self.spin)} rad/s say otherwise"
                )
        if bool(self.pinballs) == (self.surface is not None):
            what = "both given: leave one out" if self.pinballs else "missing: give one of them"
            raise ValueError(f"pinballs and surface of rigid '{self.name}' are {what}")
        if self.faces and self.surface is not None:
            raise ValueError(f"faces of rigid '{self.name}': water presses on its surface already; leave one out")
        if self.mass is not None and self.density is not None:
            raise ValueError(f"mass and density of rigid '{self.name}' are both given: leave one out")
        if self.mass is None and (self.density is None or self.pinballs) and self.free:
            raise ValueError(f"mass is missing{'' if self.pinballs else ' (or density)'}: rigid '{self.name}' is neither held nor driven")
        if self.pinballs:
            for key in ("density", "side", "spacing"):
                if getattr(self, key) is not None:
                    raise ValueError(f"{key} is of a body with a surface, and rigid '{self.name}' is made of pinballs; leave it out")
            self._of_pinballs()
        elif self.side == "inside" and self.free:
            raise ValueError(f"side = 'inside': rigid '{self.name}' is a tank without walls of its own; set held or driven")
        return self

    def _of_pinballs(self) -> None:
        """Mass over volume is that of something."""
        if self.mass is None:
            return
        volume = sum(4.0 / 3.0 * math.pi * min(p.radius, 1e50) ** 3 for p in self.pinballs)
        density = self.mass / volume if volume > 0 else math.inf  # the cube of a radius may be no number
        if not 1.0 <= density <= 1e6 and not self.held and self.driven is None:
            raise ValueError(
                f"mass {self.mass:g} kg of rigid '{self.name}' over the volume of its pinballs is {density:.3g} kg/m^3, which no "
                "body has; check the units of mass and radius"
            )

    motion: ClassVar[str] = "free"  # of its surface, as of a shell's

    @property
    def free(self) -> bool:
        """Whether it moves by itself."""
        return not self.held and self.driven is None

    @property
    def shares(self) -> np.ndarray:
        """(P,) parts of the mass that the pinballs carry, by volume. These and what follows are of a body of pinballs; of any: solid.py."""
        volume = np.array([p.radius for p in self.pinballs]) ** 3
        return volume / volume.sum()

    @property
    def centre(self) -> np.ndarray:
        """(3,) centre of mass at t = 0 [m]."""
        return self.shares @ np.array([p.centre for p in self.pinballs])

    @property
    def moments(self) -> np.ndarray:
        """(3, 3) inertia about the centre of mass at t = 0 [kg m2]."""
        if self.inertia is not None:
            return np.diag(self.inertia).astype(float)
        m, r = self.shares * (self.mass or LIKE), np.array([p.centre for p in self.pinballs]) - self.centre
        size = np.array([p.radius for p in self.pinballs])
        with np.errstate(over="ignore", invalid="ignore"):  # of balls beyond all measure
            far = (r[:, None, :] @ r[:, :, None])[:, 0, 0]
            each = m[:, None, None] * ((0.4 * size**2 + far)[:, None, None] * np.eye(3) - r[:, :, None] * r[:, None, :])
            return np.cumsum(each, axis=0)[-1]  # one after the other: no other order of so many gives these bits

    def check(self, scene: Any) -> None:
        """Against the rest of the scene."""
        if all(getattr(body, "held", False) for body in scene.bodies):
            raise ValueError("rigids: all bodies are held and there is no other one: nothing can move")
        scene.in_time("rigid bodies move", "rigids")


KIND = Kind("rigid", "rigids", Rigid, "taichi_sph.bodies.rigid.group:groups", rank=2)
