"""Fluids as the user says them: water, where it stands at the start, and rigid walls. No Taichi here."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, StrictBool, StrictInt, model_validator

from ...errors import nearest
from ...scene.base import Body, Choice, Direction, Frozen, Point
from ...scene.kinds import Kind
from ...scene.regions import Ball, Box
from ...scene.units import Density, Dimensionless, Length, Pressure, Speed, show


class Acoustic(Frozen):
    """p = c^2 (rho - rho_0) (T 1.19)."""

    kind: Literal["acoustic"] = "acoustic"


class Tait(Frozen):
    """p = rho_0 c^2 / gamma ((rho / rho_0)^gamma - 1)."""

    kind: Literal["tait"] = "tait"
    gamma: Annotated[Dimensionless, Field(gt=1, le=20)] = 7.15


class Water(Frozen):
    """A weakly compressible fluid (T 1.3). `tension` is the most that it bears before it cavitates,
    above the pressure of its surroundings; None: any."""

    density: Annotated[Density, Field(ge=0.01, le=1e5)] = 1000.0
    sound: Annotated[Speed, Field(ge=0.01, le=1e5)] = 1450.0
    law: Annotated[Acoustic | Tait, *Choice] = Acoustic()
    tension: Annotated[Pressure, Field(ge=0)] | None = 0.0


class FluidBox(Frozen):
    """The box lo <= x <= hi, filled."""

    kind: Literal["box"] = "box"
    lo: Point
    hi: Point

    @model_validator(mode="after")
    def _has_inside(self) -> FluidBox:
        for axis, lo, hi in zip("xyz", self.lo, self.hi):
            if lo >= hi:
                raise ValueError(f"lo is not below hi along {axis} ({lo:g} m, {hi:g} m): the box holds nothing")
        return self

    @property
    def volume(self) -> float:
        return math.prod(hi - lo for lo, hi in zip(self.lo, self.hi))


ON_AXIS = 1e-9  # m: nearer than this to the axis a plane goes through it


class FluidRound(Frozen):
    """Upright round columns of one fluid about the axis `at` (x, y), each (radius, from z, to z); rings of particles follow the walls.
    `quarter`: only what lies beyond x and y of the axis, where two planes mirror it; `half`: what lies beyond y, where one does."""

    kind: Literal["round"] = "round"
    at: tuple[Length, Length] = (0.0, 0.0)
    columns: Annotated[tuple[tuple[Length, Length, Length], ...], Field(min_length=1, max_length=100)]
    quarter: StrictBool = False
    half: StrictBool | None = None

    @property
    def quarters(self) -> int:
        """How many quarters of the columns there are."""
        return 1 if self.quarter else 2 if self.half else 4

    @model_validator(mode="after")
    def _has_inside(self) -> FluidRound:
        if self.quarter and self.half:
            raise ValueError("quarter and half are both set: columns are one of them; leave one out")
        for radius, low, high in self.columns:
            if radius <= 0 or low >= high:
                raise ValueError(f"columns: radius {radius:g} m from {low:g} to {high:g} m holds nothing")
        return self

    @property
    def level(self) -> float:
        """Height of the free surface [m]."""
        return max(high for _, _, high in self.columns)

    @property
    def volume(self) -> float:
        return 0.25 * self.quarters * sum(math.pi * radius**2 * (high - low) for radius, low, high in self.columns)


class ShellFill(Frozen):
    """The inside of the closed shell, or rigid body met on its inside, of that name along `axis`: from `above` (None: its bottom) up to
    `level` (None: its top). Plane openings count as closed. Two fluids in one shell lie one above the other: `above` of the upper one is
    the level of the lower one."""

    kind: Literal["shell"] = "shell"
    shell: str
    axis: Literal["x", "y", "z"] = "z"
    level: Length | None = None
    above: Length | None = None

    @model_validator(mode="after")
    def _has_inside(self) -> ShellFill:
        if self.above is not None and self.level is not None and self.above >= self.level:
            raise ValueError(f"above {self.above:g} m is not below level {self.level:g} m: nothing is filled")
        return self


class Finer(Frozen):
    """Where water is finer: a particle that starts `within` a box or ball is split into eight of half the spacing. Of several in a list
    each splits what those before it have left, so one within the other makes it finer still."""

    within: Annotated[Box | Ball, *Choice]


def _touch(one: Box | Ball, other: Box | Ball) -> bool:
    """Whether two regions have a place in common."""
    if isinstance(one, Ball) and isinstance(other, Ball):
        return math.dist(one.centre, other.centre) <= one.radius + other.radius
    if isinstance(one, Ball):
        one, other = other, one
    assert isinstance(one, Box)
    low = [-math.inf if x is None else x for x in one.lo]
    high = [math.inf if x is None else x for x in one.hi]
    if isinstance(other, Ball):
        return math.hypot(*(max(a - x, x - b, 0.0) for a, x, b in zip(low, other.centre, high))) <= other.radius
    return all((b is None or a <= b) and (c is None or c <= d) for a, b, c, d in zip(low, other.hi, other.lo, high))


class Fluid(Body):
    """A body of fluid particles. `spacing` None: that of the numerics. `finer`: where it is finer than that; None: nowhere. `support` h / D
    (T 1.27). `dissipation`: None, the artificial viscosity with `alpha` and `beta` (T 1.24), or "riemann", for flows far slower than
    sound (bodies/fluid/pairs.py). `delta` the diffusion of density (docs/method.md). `hydrostatic`: at rest under the gravity of the scene
    from the start, the highest particle without pressure; with `pressure` all of it has so much more. `contact` with shells and rigid
    bodies: None by its pressure, with pinballs behind it (couplings/wetted/wetted.py), or by pinballs alone (T 3.3), whose plastic blows
    take energy. `every`: steps of the clock between two of the fluid. Other bodies feel its pressure as one blow for all of them
    (docs/method.md); None: 1. `divergence`: None, densities follow the divergence at the end of each step; "mean", that of both ends, so
    that pressure does the work that is stored where bodies go fast through water (bodies/fluid/pairs.py)."""

    what: ClassVar[str] = "fluid"
    bounces: ClassVar[bool] = False
    soft: ClassVar[bool] = True

    fill: Annotated[FluidBox | FluidRound | ShellFill, Field(discriminator="kind")]
    water: Water = Water()
    velocity: tuple[Speed, Speed, Speed] = (0.0, 0.0, 0.0)
    hydrostatic: bool = True
    pressure: Annotated[Pressure, Field(ge=0)] | None = None
    contact: Literal["pinballs"] | None = None
    every: Annotated[StrictInt, Field(ge=1, le=20)] | None = None
    spacing: Annotated[Length, Field(gt=0)] | None = None
    finer: Annotated[tuple[Finer, ...], Field(min_length=1, max_length=3)] | None = None
    support: Annotated[Dimensionless, Field(ge=1.0, le=2.0)] = 1.165
    dissipation: Literal["riemann"] | None = None
    divergence: Literal["mean"] | None = None
    alpha: Annotated[Dimensionless, Field(ge=0, le=3)] = 0.1
    beta: Annotated[Dimensionless, Field(ge=0, le=10)] = 0.0
    delta: Annotated[Dimensionless, Field(ge=0, le=0.5)] = 0.1

    @property
    def halvings(self) -> int:
        """How often the finest of it is halved, at most: as many regions as may hold one particle."""
        regions = [one.within for one in self.finer or ()]
        pairs = [(a, b) for k, a in enumerate(regions) for b in regions[:k] if _touch(a, b)]
        return min(len(regions), 1) if not pairs else 3 if len(pairs) == 3 else 2

    def spacing_at(self, spacing: float, point: tuple[float, float, float]) -> float:
        """D [m] at a place, of a fluid whose whole particles have that spacing [m]."""
        return spacing / 2 ** sum(_touch(one.within, Ball(centre=point, radius=1e-9 * spacing)) for one in self.finer or ())

    @model_validator(mode="after")
    def _splits(self) -> Fluid:
        if self.finer and isinstance(self.fill, FluidRound):
            raise ValueError(f"finer: not possible yet in round columns, which '{self.name}' fills; take a box or a shell, or leave it out")
        return self

    @model_validator(mode="after")
    def _one_dissipation(self) -> Fluid:
        for key in ("alpha", "beta"):
            said = key in self.model_fields_set and getattr(self, key) != Fluid.model_fields[key].default
            if said and self.dissipation == "riemann":
                raise ValueError(f"{key} is of artificial viscosity, and fluid '{self.name}' has dissipation 'riemann'; leave one out")
        return self

    def check(self, scene: Any) -> None:
        """Against the rest of the scene."""
        where = scene.key_of(self)
        shells = [shell.name for shell in scene.shells] + [rigid.name for rigid in scene.rigids if rigid.side == "inside"]
        inside = getattr(self.fill, "shell", None)
        if inside is not None and inside not in shells:
            if inside in [rigid.name for rigid in scene.rigids]:
                raise ValueError(
                    f"{where}.fill.shell: rigid body '{inside}' is not met on its inside; give it a surface and side = 'inside'"
                )
            raise ValueError(f"{where}.fill.shell: there is no shell '{inside}'{nearest(inside, shells)}")
        if self.every not in (None, 1) and not any(body.what not in ("fluid", "rigid body") for body in scene.bodies):
            raise ValueError(f"{where}.every = {self.every}: steps of a shell, and the scene has none; leave it out")
        if self is scene.fluids[-1]:  # all of them, once
            meets, others = scene.meets(), [body for body in scene.bodies if body.what != self.what]
            kinds = [fluid._stands_with(scene, meets, others) for fluid in scene.fluids]
            for n, fluid in enumerate(scene.fluids if len(set(kinds)) > 1 else ()):
                for other, kind in zip(scene.fluids[:n], kinds):
                    if kind != kinds[n] and meets(fluid.name, other.name):
                        fluid._beside(scene, meets, others, f"fluids[{n}]", other)
        _walls(self, scene)
        _mirrored(self, scene)
        scene.in_time("a fluid moves", "fluids")

    def _stands_with(self, scene: Any, meets: Callable[[str, str], bool], others: list[Any]) -> tuple[Any, ...]:
        """What two fluids that meet have in common; others: the bodies that are no fluids."""
        touched = frozenset(body.name for body in others if meets(self.name, body.name))
        return (
            self.spacing or scene.numerics.spacing,
            self.dissipation,
            self.divergence,
            self.support,
            self.water.law.kind,
            self.every or 1,
            touched,
        )

    def _beside(self, scene: Any, meets: Callable[[str, str], bool], others: list[Any], where: str, other: Fluid) -> None:
        """Two fluids that meet are one lattice of one law, of different density at most; others: the bodies that are no fluids."""
        apart = (
            "; not possible yet for fluids that can meet: make them equal, or part them by "
            f"Meeting(between=('{other.name}', '{self.name}'), meet=False)"
        )
        mine, theirs = (fluid.spacing or scene.numerics.spacing for fluid in (self, other))
        if mine != theirs:
            raise ValueError(f"{where}.spacing {show(mine, 'm')} is not that of '{other.name}', {show(theirs, 'm')}{apart}")
        for body in others:
            if meets(self.name, body.name) != meets(other.name, body.name):
                raise ValueError(f"meetings: '{body.name}' meets one of the fluids '{other.name}' and '{self.name}' alone{apart}")
        if self.dissipation != other.dissipation:
            raise ValueError(f"{where}.dissipation is not that of '{other.name}'{apart}")
        if self.divergence != other.divergence:
            raise ValueError(f"{where}.divergence is not that of '{other.name}'{apart}")
        if self.support != other.support:
            raise ValueError(f"{where}.support {self.support:g} is not that of '{other.name}', {other.support:g}{apart}")
        if self.water.law.kind != other.water.law.kind:
            raise ValueError(f"{where}.water.law '{self.water.law.kind}' is not that of '{other.name}', '{other.water.law.kind}'{apart}")
        if (self.every or 1) != (other.every or 1):
            raise ValueError(f"{where}.every = {self.every or 1} is not that of '{other.name}', {other.every or 1}{apart}")


class Hole(Frozen):
    """A round opening in a wall."""

    centre: Point
    radius: Annotated[Length, Field(gt=0)]


class Wall(Frozen):
    """A rigid plane that fluid does not cross: through `point`, `normal` (any length) towards the fluid; for the `fluids` of these
    names, None: for all."""

    point: Point
    normal: Direction
    hole: Hole | None = None
    fluids: Annotated[tuple[str, ...], Field(min_length=1)] | None = None

    def holds(self, fluid: str) -> bool:
        """Whether the plane stands in the way of that fluid."""
        return self.fluids is None or fluid in self.fluids

    @model_validator(mode="after")
    def _has_direction(self) -> Wall:
        if not any(self.normal):
            raise ValueError("normal is (0, 0, 0): give the direction from the wall to the fluid")
        return self


def _mirrored(fluid: Fluid, scene: Any) -> None:
    """A part of round columns has the planes that mirror it: walls through the axis."""
    fill = fluid.fill
    if not isinstance(fill, FluidRound) or fill.quarters == 4:
        return
    for axis in (0, 1) if fill.quarter else (1,):
        for wall in scene.walls:
            length = math.hypot(*wall.normal)
            if wall.holds(fluid.name) and wall.normal[axis] > (1 - 1e-6) * length and abs(wall.point[axis] - fill.at[axis]) < ON_AXIS:
                break
        else:
            part, letter = "quarter" if fill.quarter else "half", "xy"[axis]
            place = tuple(fill.at[k] if k == axis else 0.0 for k in range(3))
            normal = tuple(int(k == axis) for k in range(3))
            raise ValueError(
                f"{scene.key_of(fluid)}.fill.{part}: no wall stands at {letter} = {show(fill.at[axis], 'm')} to mirror it, and the water "
                f"would run out there; add Wall(point={place}, normal={normal}), or leave {part} out"
            )


def _walls(fluid: Fluid, scene: Any) -> None:
    """The walls of a fluid against each other, and the names of their fluids."""
    names = [f.name for f in scene.fluids]
    for number, wall in enumerate(scene.walls):
        for name in wall.fluids or ():
            if name not in names:
                raise ValueError(f"walls[{number}].fluids: there is no fluid '{name}'{nearest(name, names)}")
    own = [(number, wall) for number, wall in enumerate(scene.walls) if wall.holds(fluid.name)]
    least = 1.03 * fluid.support * scene.numerics_of(fluid).spacing
    for place, (number, wall) in enumerate(own):
        for other, before in own[:place]:
            cosine = sum(a * b for a, b in zip(wall.normal, before.normal)) / (math.hypot(*wall.normal) * math.hypot(*before.normal))
            if 1e-6 < abs(cosine) < 1 - 1e-6:
                raise ValueError(
                    f"walls[{number}]: neither parallel nor at right angles to walls[{other}], and their images could not meet; "
                    "turn one of them"
                )
            apart = sum((b - a) * n for a, b, n in zip(wall.point, before.point, wall.normal)) / math.hypot(*wall.normal)
            if cosine > 0 and abs(apart) < 2.0 * least:
                raise ValueError(
                    f"walls[{number}] and walls[{other}] face the same way {show(abs(apart), 'm')} apart, and a particle would see "
                    "itself in both: leave one of them out"
                )
            if cosine < 0 < apart < least:
                raise ValueError(
                    f"walls[{number}] and walls[{other}] face each other {show(apart, 'm')} apart, and images of images, which begin "
                    f"below {show(least, 'm')}, are not computed: move them apart, or take a finer spacing"
                )


KIND = Kind("fluid", "fluids", Fluid, "taichi_sph.bodies.fluid.group:groups", rank=3)
