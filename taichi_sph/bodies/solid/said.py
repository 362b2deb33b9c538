"""Solids as the user says them, and the forms in which they are computed. No Taichi here."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, StrictBool, model_validator

from ...scene.base import Body, Choice, Direction, Frozen, Point
from ...scene.kinds import Kind
from ...scene.laws import Material
from ...scene.regions import Region
from ...scene.solids import Made, Shape
from ...scene.units import Dimensionless, Length, Time, show


class Trilinear(Frozen):
    """Finite elements: the functions of a cell's own corners. `stabilisation`: gamma, which pulls corners back to the cell's own linear
    field; with 1/6 one cube bends as a beam does."""

    kind: Literal["trilinear"] = "trilinear"
    label: ClassVar[str] = "trilinear"
    stabilisation: Annotated[Dimensionless, Field(ge=0, le=1)] = 1.0 / 6.0


class Particles(Frozen):
    """Smoothed particles: moving least squares of order 1 on the faces of the cells. `support` = h / D."""

    kind: Literal["particles"] = "particles"
    label: ClassVar[str] = "particles"
    support: Annotated[Dimensionless, Field(ge=0.75, le=1.5)] = 0.85
    stabilisation: Annotated[Dimensionless, Field(ge=0, le=1)] = 1.0 / 6.0


class SolidPatch(Frozen):
    """Particles in a solid of finite elements (P, docs/method.md).

    `where`: regions; elements whose middle is in one of them become particles, `spacing` apart. The elements around them, one wide, are
    both: there the energies of both are weighed, one half each, and their velocities tied (Arlequin).
    """

    where: Annotated[tuple[Region, ...], Field(min_length=1, max_length=200)]
    spacing: Annotated[Length, Field(gt=0)]
    formulation: Particles = Particles()


class Detonation(Frozen):
    """Where and when an explosive is lit: a front that begins at a `point`, or, with a `normal`, at the plane through it, and runs to both
    sides."""

    point: Point
    normal: Direction | None = None
    time: Annotated[Time, Field(ge=0)] = 0.0

    @model_validator(mode="after")
    def _has_direction(self) -> Detonation:
        if self.normal is not None and not any(self.normal):
            raise ValueError("normal is (0, 0, 0): give the direction in which the front runs, or leave it out for a front from a point")
        return self


class Solid(Body):
    """A solid body: shape, material, form. `spacing` as in the numerics of the scene, for this body alone. `detonation`: of a body of
    explosive. `patch`: particles in a solid of elements."""

    bears: ClassVar[frozenset[str]] = frozenset({"forces", "motions", "initial", "probes"})
    what: ClassVar[str] = "solid"
    holds_springs: ClassVar[bool] = True
    has_nodes: ClassVar[bool] = True

    shape: Shape
    material: Material
    formulation: Annotated[Trilinear | Particles, *Choice] = Trilinear()
    spacing: Annotated[Length, Field(gt=0)] | None = None
    viscous: StrictBool = False  # bulk viscosity in compression, which takes the ringing behind a front
    detonation: Detonation | None = None
    patch: SolidPatch | None = None

    @model_validator(mode="after")
    def _believable(self) -> Solid:
        material = self.material
        if material.damage is not None and material.damage.kind == "mazars":
            raise ValueError(f"material.damage: 'mazars' is a law of shells, in plane stress; solid '{self.name}' takes 'concrete'")
        if getattr(material.damage, "scatter", None):
            raise ValueError(f"material.damage.scatter: not possible yet for solids, and '{self.name}' is one; leave it out")
        if getattr(material.damage, "necks", None):
            raise ValueError(f"material.damage.necks is of sheets, and '{self.name}' is a solid; leave it out")
        if getattr(material.damage, "spread", None):
            raise ValueError(f"material.damage.spread is of sheets, and '{self.name}' is a solid; leave it out")
        for key in ("alpha", "kappa", "layers"):  # a scene that was read back has all keys: what counts is another value
            if material.strength is not None and getattr(material.strength, key) != type(material.strength).model_fields[key].default:
                raise ValueError(f"material.strength.{key} is of the cross-section of a shell, and '{self.name}' is a solid; leave it out")
        if material.burns is None and self.detonation is not None:
            raise ValueError(f"detonation: '{self.name}' is no explosive; give its material `burns`, or leave it out")
        if material.burns is not None and self.detonation is None:
            raise ValueError(f"detonation is missing: '{self.name}' is an explosive; say where it is lit, Detonation(point=...)")
        if material.burns is not None and self.formulation.kind == "particles":
            raise ValueError(f"material.burns: not possible yet for particles; set the formulation of '{self.name}' to 'trilinear'")
        if material.burns is not None and self.viscous:
            raise ValueError(f"viscous: the gas of an explosive has its own bulk viscosity; leave it out of '{self.name}'")
        if self.formulation.kind == "particles" and material.critical_damage is not None:
            raise ValueError(
                f"material.critical_damage: particles of a solid do not part yet, and '{self.name}' is of them; leave it out, and damage "
                "grows without a crack, or set formulation to 'trilinear'"
            )
        if self.patch is not None:
            self._may_have_a_patch()
        return self

    def _may_have_a_patch(self) -> None:
        """Of elements, of a material that does not part."""
        if self.formulation.kind != "trilinear":
            raise ValueError(f"patch: particles in a solid of elements, and '{self.name}' is of particles; leave it out")
        if self.material.burns is not None:
            raise ValueError(f"patch: not possible yet for explosives, and '{self.name}' is one; leave it out")
        if self.material.critical_damage is not None:
            raise ValueError(
                f"patch: particles of a solid do not part yet, and '{self.name}' has material.critical_damage; leave one of them out"
            )

    def check(self, scene: Any) -> None:
        """Against the rest of the scene."""
        where = scene.key_of(self)
        scene.in_time("a solid moves", "solids")
        spacing = scene.numerics_of(self).spacing
        if isinstance(self.shape, Made) and spacing > self.shape.smallest * (1 + 1e-9):
            key = f"{where}.spacing" if self.spacing is not None else "numerics.spacing"
            raise ValueError(
                f"{key} {show(spacing, 'm')} is larger than the body: {self.shape.kind} '{self.name}' takes at most "
                f"{show(self.shape.smallest, 'm')}"
            )
        for other in scene.bodies if self.material.burns is not None else ():
            if other.soft and scene.met(self.name, other.name).meet:
                raise ValueError(
                    f"{scene.key_of(other)}: {other.what} '{other.name}' does not press on explosives yet, and '{self.name}' is one;"
                    f" part them by Meeting(between=('{self.name}', '{other.name}'), meet=False)"
                )
        if self.patch is not None:
            self._alone(scene, where)
        for number, motion in enumerate(scene.motions):
            if motion.body == self.name and any(w is not None for w in motion.spin):
                raise ValueError(f"motions[{number}].spin: the nodes of solid '{self.name}' do not turn; give velocities alone")

    def _alone(self, scene: Any, where: str) -> None:
        """What does not choose between elements and particles yet."""
        for other in scene.bodies:
            if other is not self and other.meets and scene.met(self.name, other.name).meet:
                raise ValueError(
                    f"{where}.patch: {other.what} '{other.name}' does not choose between elements and particles of '{self.name}' yet; part "
                    f"them by Meeting(between=('{self.name}', '{other.name}'), meet=False), or leave the patch out"
                )
        if any(self.name in spring.between for spring in scene.springs):
            raise ValueError(f"{where}.patch: springs do not choose between elements and particles of '{self.name}' yet; leave one out")


KIND = Kind("solid", "solids", Solid, "taichi_sph.bodies.solid.group:groups", rank=4)
