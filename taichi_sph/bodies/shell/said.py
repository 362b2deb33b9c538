"""Shells as the user says them, and the forms in which they are computed. No Taichi here."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, StrictBool, StrictInt, field_validator, model_validator

from ...errors import nearest
from ...scene.base import Body, Choice, Frozen, Point
from ...scene.laws import Material
from ...scene.regions import Region
from ...scene.surfaces import Disc, Given, Plate, Surface
from ...scene.units import Dimensionless, Length, show


class Cut(Frozen):
    """Straight cut through the thickness from `start` to `end`: pre-crack or notch."""

    start: Point
    end: Point

    @model_validator(mode="after")
    def _has_length(self) -> Cut:
        if self.start == self.end:
            raise ValueError("start and end are the same point: a cut needs a length")
        return self


class Viscosity(Frozen):
    """Artificial viscosity between node pairs (T 2.35 to 2.38); gamma acts across a shell that bends."""

    alpha: Annotated[Dimensionless, Field(ge=0, le=10)] = 0.05
    beta: Annotated[Dimensionless, Field(ge=0, le=10)] = 0.1
    gamma: Annotated[Dimensionless, Field(ge=0, le=10)] = 0.05


class Galerkin(Frozen):
    """Nodal force = exact transpose of the strain operator (docs/method.md)."""

    body: ClassVar[str] = "shell_sph"
    label: ClassVar[str] = "galerkin"
    kind: Literal["galerkin"] = "galerkin"
    support: Annotated[Dimensionless, Field(ge=1.0, le=2.0)] = 1.2  # h / D
    stabilisation: Annotated[Dimensionless, Field(ge=0, le=1)] = 0.2  # gamma
    shear_bound: Annotated[Dimensionless, Field(ge=0, le=1)] = 0.1  # alpha: kGe / (1 + alpha (D/e)^2)


class Collocation(Frozen):
    """The thesis's strong form (T 2.2), with its viscosity and its filters on spins (T 2.39) and on crack edges
    (T 2.3.6.5)."""

    body: ClassVar[str] = "shell_sph"
    label: ClassVar[str] = "collocation"
    kind: Literal["collocation"] = "collocation"
    support: Annotated[Dimensionless, Field(ge=1.0, le=2.0)] = 1.2
    viscosity: Viscosity = Viscosity()
    edge_filter: Annotated[Dimensionless, Field(ge=0, le=1)] = 0.01
    spin_filter: Annotated[Dimensionless, Field(ge=0, le=1)] = 0.1  # eta
    shear_bound: Annotated[Dimensionless, Field(ge=0, le=1)] = 0.0  # alpha, as in Galerkin; the thesis has none
    selective_shear: StrictBool = False  # T 2.55: shear at the nodes, stabilised by a little of the cells'


class FiniteElements(Frozen):
    """Finite elements on the cells of the mesh: quadrangles MITC4, triangles MITC3 (docs/method.md). They yield and are damaged, and do not
    rupture.

    `points` of stress in a quadrangle: 4, or 1 with the bending and shear that it does not see held by a physical stabilisation.
    """

    body: ClassVar[str] = "shell_fe"
    kind: Literal["elements"] = "elements"
    points: Literal[1, 4] = 4
    shear_bound: Annotated[Dimensionless, Field(ge=0, le=1)] = 0.1  # alpha, as in Galerkin

    @property
    def label(self) -> str:
        """In one word."""
        return self.kind if self.points == 4 else "elements_1"


Formulation = Annotated[Galerkin | Collocation | FiniteElements, *Choice]

PARTICLES = ".particles"  # end of the name of the particles of a shell of elements
THIRD = 3  # particles along the side of an element, where nothing else is said
AUTO = "auto"  # a patch that begins with no element


class Patch(Frozen):
    """Particles in a shell of finite elements, where rupture is expected (T chapter 4, docs/method.md).

    `where`: regions; elements whose middle is in one of them become particles, `spacing` apart. The elements around them, one wide, are
    both: there the energies of both are weighed and their velocities tied (Arlequin).
    `weight` of the particles there: "half", or growing from 0 to 1 as "linear" or "cubic". `multipliers`: on the gradient of the weight, or
    as T has them on the "volume", from the Gauss points of the elements with moving least squares over `reach` times the distance of those
    from the middle. `directors`: they are tied too. `irregularity`: particles inside are moved at random by up to so many spacings.
    `grows`: where damage comes near the border of the patch, or a fast striker near an element, more elements become particles during the
    run; it may begin with no region, all elements ("auto" says that). `spacing` None: a third of the elements' width. `cells`: elements, by
    their numbers in the mesh, that are particles beside those in the regions; a patch that has grown holds them.
    """

    where: Annotated[tuple[Region, ...], Field(max_length=200)] = ()
    spacing: Annotated[Length, Field(gt=0)] | None = None
    weight: Literal["half", "linear", "cubic"] = "half"
    multipliers: Literal["gradient", "volume"] = "gradient"
    reach: Annotated[Dimensionless, Field(ge=0.5, le=3)] = 2.0
    directors: StrictBool = True
    irregularity: Annotated[Dimensionless, Field(ge=0, le=0.4)] = 0.0
    grows: StrictBool = False
    cells: tuple[Annotated[StrictInt, Field(ge=0)], ...] = ()
    formulation: Galerkin = Galerkin()

    @property
    def there(self) -> bool:
        """Whether it holds any element; all elements of a patch that may grow can still be elements."""
        return bool(self.where or self.cells)

    def apart(self, width: float) -> float:
        """Spacing of the particles [m] where the elements are `width` [m] wide."""
        return width / THIRD if self.spacing is None else self.spacing

    @model_validator(mode="after")
    def _begins(self) -> Patch:
        if not self.there and not self.grows:
            raise ValueError(
                "where is empty, and no element would become particles: give regions, or patch = 'auto', which begins where damage comes"
            )
        return self

    @model_validator(mode="after")
    def _may_grow(self) -> Patch:
        if self.grows and self.irregularity > 0:
            raise ValueError(f"irregularity = {self.irregularity:g}: a patch that grows has its particles in rows; leave it out, or grows")
        if self.grows and (self.weight, self.multipliers) != ("half", "gradient"):
            raise ValueError("grows: possible with weight 'half' and multipliers 'gradient'; leave the other ones out, or grows")
        return self


class Section(Frozen):
    """What differs from the rest of a shell in a region, or in a group of its mesh: thickness, material, or both. Of a material the
    numbers may differ, not which laws it has."""

    where: Region
    thickness: Annotated[Length, Field(gt=0)] | None = None
    material: Material | None = None

    @model_validator(mode="after")
    def _differs(self) -> Section:
        if self.thickness is None and self.material is None:
            raise ValueError("thickness and material are missing: give what differs there")
        return self


class Shell(Body):
    """A thin body: mid-surface, thickness, material, cuts present at t = 0. `sections`: where thickness or material are others; the last
    one that holds the middle of a cell counts.

    `motion` = "in_plane": the mid-surface stays in its plane (plane stress, two degrees of freedom);
    "free": it bends and turns as it likes (Mindlin-Reissner, five degrees of freedom). `spacing` to `raised_inertia`: as in the numerics of
    the scene, for this shell alone; None: what stands there. `every`: steps of the clock between two of the shell's own; None: 1.
    """

    bears: ClassVar[frozenset[str]] = frozenset({"forces", "moments", "pressures", "gases", "motions", "initial", "probes", "gauges"})
    what: ClassVar[str] = "shell"
    holds_springs: ClassVar[bool] = True
    has_nodes: ClassVar[bool] = True

    surface: Surface
    thickness: Annotated[Length, Field(gt=0)]
    material: Material
    sections: Annotated[tuple[Section, ...], Field(max_length=1000)] = ()
    motion: Literal["in_plane", "free"] = "in_plane"
    cuts: Annotated[tuple[Cut, ...], Field(max_length=2000)] = ()
    self_contact: StrictBool | None = None  # True: its parts meet each other too (T 3.3), which costs a search over all nodes
    sound: tuple[Region, ...] = ()  # no damage here: where a support's rubber, not modelled, spreads its load
    spacing: Annotated[Length, Field(gt=0)] | None = None
    cells: Literal["quad", "triangle"] | None = None
    irregularity: Annotated[Dimensionless, Field(ge=0, le=0.4)] | None = None
    seed: Annotated[StrictInt, Field(ge=0, lt=2**32)] | None = None
    formulation: Formulation | None = None
    raised_inertia: StrictBool | None = None
    every: Annotated[StrictInt, Field(ge=1, le=20)] | None = None
    patch: Patch | None = None  # particles in a shell of elements; "auto": of those near damage, as it comes

    @field_validator("patch", mode="before")
    @classmethod
    def _in_a_word(cls, value: Any) -> Any:
        if not isinstance(value, str):
            return value
        if value != AUTO:
            raise ValueError(f"'{value}' is no patch: it is 'auto', or has regions (where) and a spacing{nearest(value, [AUTO])}")
        return {"grows": True}

    @model_validator(mode="after")
    def _believable(self) -> Shell:
        if not isinstance(self.surface, Plate | Disc | Given) and self.motion == "in_plane":
            raise ValueError(
                f"motion = 'in_plane' is for flat bodies, and shell '{self.name}' is a {self.surface.kind}; set motion = 'free'"
            )
        if isinstance(self.surface, Plate | Disc) and not self.surface.level and self.motion == "in_plane":
            raise ValueError(
                f"motion = 'in_plane' is for bodies parallel to z = 0, and shell '{self.name}' has another normal; set motion = 'free'"
            )
        if self.material.burns is not None:
            raise ValueError(f"material.burns: an explosive is a solid, and '{self.name}' is a shell")
        for key, law in (("damage", self.material.damage), ("strength.heat", getattr(self.material.strength, "heat", None))):
            if law is not None and getattr(law, "kind", "heat") in ("concrete", "heat"):
                raise ValueError(f"material.{key}: '{getattr(law, 'kind', 'heat')}' is a law of solids, and '{self.name}' is a shell")
        if self.motion == "in_plane" and self.material.strength is not None and self.material.strength.layers is not None:
            raise ValueError(f"material.strength.layers: shell '{self.name}' has motion = 'in_plane' and is not bent; leave them out")
        for number, section in enumerate(self.sections):
            if section.material is not None and section.material.laws != self.material.laws:
                raise ValueError(
                    f"sections[{number}].material has other laws than the shell's own (strength, layers, damage, delay, rupture), which is "
                    "not possible yet within one shell; let the numbers alone differ: a yield stress that is not reached, or the like"
                )
        thickest = max([self.thickness, *(s.thickness for s in self.sections if s.thickness is not None)])
        if isinstance(self.surface, Plate):
            _fits_a_plate(self, self.surface, thickest)
        elif not isinstance(self.surface, Given) and thickest > self.surface.thickest:
            what = "half the smallest width" if self.surface.kind == "box" else "the radius"
            raise ValueError(
                f"thickness {show(thickest, 'm')} of shell '{self.name}' is larger than {what} of its "
                f"{self.surface.kind} ({show(self.surface.thickest, 'm')})"
            )
        return self

    @property
    def varied(self) -> bool:
        """Whether its cells may differ in thickness or material."""
        return bool(self.sections or getattr(self.surface, "thicknesses", False))

    @property
    def meets(self) -> bool:
        """Whether something can touch it: a body that stays in its plane has no side that is met."""
        return self.motion == "free"

    def check(self, scene: Any) -> None:
        """Against the rest of the scene."""
        where = scene.key_of(self)
        if self.motion == "in_plane":
            self._in_plane(scene, where)
        numerics = scene.numerics_of(self)
        form, own = numerics.formulation, f"{where}." if self.formulation is not None else "numerics."
        if form.kind == "elements":
            self._of_elements(f"{own}formulation", where)
        if self.patch is not None:
            self._patched(scene, where, form)
            if self.varied:
                raise ValueError(f"{where}.sections: not possible yet beside a patch; leave out sections or patch")
        if form.kind == "collocation" and self.varied:
            raise ValueError(f"{where}.sections: not possible yet with {own}formulation '{form.kind}'; use 'galerkin' or 'elements'")
        if getattr(self.material.damage, "spread", None):
            self._spreads(f"{where}.material.damage.spread", form, f"{own}formulation")
        if scene.limit is not None and self.varied:
            raise ValueError(f"{where}.sections: limit is sought of one thickness and one material; leave out limit or sections")
        if form.kind == "collocation" and any(pressure.body == self.name for pressure in scene.pressures):
            raise ValueError(f"pressures: {own}formulation '{form.kind}' has no surface pressure; use 'galerkin', or forces")
        if getattr(form, "selective_shear", False) and (self.material.damage or self.material.strength):
            raise ValueError(f"{own}formulation.selective_shear knows no damage and no strength of the nodes' shear; leave one of them out")
        if self.every not in (None, 1) and len(scene.bodies) == 1:
            raise ValueError(f"{where}.every = {self.every}: steps of a faster body, and the scene has no other one; leave it out")
        if scene.static is not None and self.material.damage is not None:
            raise ValueError("static: a material with damage needs time to be damaged; leave out static or damage")
        if scene.static is not None and self.material.strength is not None:
            raise ValueError("static: a material with strength yields in time; leave out static or strength")
        spacing, surface = numerics.spacing, self.surface
        if not isinstance(surface, Given) and spacing > surface.smallest * (1 + 1e-9):
            key = f"{where}.spacing" if self.spacing is not None else "numerics.spacing"
            why = f"is {show(surface.smallest, 'm')} wide" if surface.kind == "plate" else f"takes at most {show(surface.smallest, 'm')}"
            raise ValueError(f"{key} {show(spacing, 'm')} is larger than the body: {surface.kind} '{self.name}' {why}")

    def _spreads(self, key: str, form: Any, own: str) -> None:
        """What cannot spread its damage yet."""
        if self.patch is not None:
            raise ValueError(f"{key}: not possible yet beside a patch; leave out spread or patch")
        if form.kind != "galerkin":
            raise ValueError(f"{key}: not possible yet with {own} '{form.kind}'; use 'galerkin', or leave it out")
        if layers := getattr(self.material.strength, "layers", None):
            raise ValueError(f"{key}: not possible yet with strength.layers = {layers}; leave one of them out")

    def _patched(self, scene: Any, where: str, form: Any) -> None:
        """What a shell of elements with particles in it cannot be yet."""
        patch = self.patch
        assert patch is not None
        if form.kind != "elements":
            raise ValueError(f"{where}.patch: particles in a shell of elements, and shell '{self.name}' is '{form.kind}'; leave it out")
        if form.points == 1 and patch.weight != "half":
            raise ValueError(
                f"{where}.patch.weight '{patch.weight}' varies over an element, which a single point does not see; use 'half', or 4 points"
            )
        if form.shear_bound != patch.formulation.shear_bound:
            raise ValueError(
                f"{where}.patch.formulation.shear_bound is {patch.formulation.shear_bound:g} and must be that of the elements, "
                f"{form.shear_bound:g}"
            )
        scene.in_time("particles and elements are tied", f"{where}.patch")
        if patch.grows and self.material.critical_damage is None:
            what, hint = "patch.grows", "leave it out"
            if not patch.where:
                what, hint = "patch = 'auto'", "leave the patch out, or say when it breaks"
            raise ValueError(f"{where}.{what}: nothing of shell '{self.name}' breaks (no critical_damage); {hint}")
        if self.every not in (None, 1):
            raise ValueError(f"{where}.every: elements and particles of shell '{self.name}' take the same steps; leave it out")
        if self.self_contact:
            raise ValueError(f"{where}.self_contact: elements and particles of one shell do not meet; leave self_contact or the patch out")
        for fluid in scene.fluids:
            if fluid.contact is not None and scene.met(self.name, fluid.name).meet:
                raise ValueError(
                    f"{where}.patch: fluid '{fluid.name}' has contact '{fluid.contact}', which would strike elements and particles; that "
                    "is not possible yet; leave its contact out, and its pressure carries it"
                )
        if any(self.name in spring.between for spring in scene.springs):
            raise ValueError(f"{where}.patch: springs do not choose between elements and particles of '{self.name}' yet; leave one out")
        if any(self.name in weld.between for weld in scene.welds):
            raise ValueError(f"{where}.patch: welds do not choose between elements and particles of '{self.name}' yet; leave one out")
        if any(gas.body == self.name for gas in scene.gases):
            raise ValueError(
                f"{where}.patch: the gas in shell '{self.name}' would press on elements and particles both, which is not possible yet; "
                "leave one of them out"
            )
        taken = [body.name for body in scene.bodies if body.name.lower() == f"{self.name}{PARTICLES}".lower()]
        if taken:
            raise ValueError(f"{scene.key_of(scene.body(taken[0]))}.name: '{taken[0]}' is that of the particles of shell '{self.name}'")

    def _of_elements(self, key: str, where: str) -> None:
        """What finite elements cannot do: they do not come apart."""
        what = "finite elements do not rupture"
        if self.material.critical_damage is not None and self.patch is None:
            raise ValueError(
                f"{where}.material.critical_damage: {what}; leave it out, and damage grows without a crack, or set {key} to 'galerkin'"
            )
        if self.cuts:
            raise ValueError(f"{where}.cuts: {what}; leave the cuts out, or set {key} to 'galerkin'")

    def _in_plane(self, scene: Any, where: str) -> None:
        """What a shell that stays in its plane cannot feel or meet."""
        if self.self_contact:
            raise ValueError(f"{where}.self_contact: shell '{self.name}' moves in its plane; give it motion = 'free'")
        for other in scene.bodies:
            if other is not self and other.meets and scene.met(self.name, other.name).asked is not False:
                verb = f"hold a {other.what}" if other.soft else "be hit"
                raise ValueError(
                    f"{scene.key_of(other).partition('[')[0]}: shell '{self.name}' moves in its plane and cannot {verb}; "
                    "give it motion = 'free'"
                )
        if scene.gravity is not None and scene.gravity[2]:
            raise ValueError(f"gravity: z must be 0, for shell '{self.name}' moves in its plane (motion = 'in_plane')")
        for key in ("forces", "moments", "pressures", "motions", "initial"):
            for number, load in enumerate(getattr(scene, key)):
                if load.body == self.name:
                    _stays_in_plane(f"{key}[{number}]", key, load)


def _fits_a_plate(shell: Shell, surface: Plate, thickest: float) -> None:
    """Thickness and cuts against the size of a plate."""
    size = max(surface.length, surface.width)
    if thickest > size:
        raise ValueError(
            f"thickness {show(thickest, 'm')} of shell '{shell.name}' is larger than the plate itself "
            f"({show(surface.length, 'm')} x {show(surface.width, 'm')})"
        )
    low = surface.origin if not surface.turned else (0.0, 0.0, 0.0)
    high = (low[0] + surface.length, low[1] + surface.width, low[2])
    margin = 0.05 * size  # a cut may start a little outside: it is the edge that it must open
    for number, cut in enumerate(shell.cuts):
        for end, point in (("start", cut.start), ("end", cut.end)):
            place: tuple[float, ...] = point
            names: Sequence[str] = "xyz"
            if surface.turned:
                place, names = surface.within(point), ("along its length", "along its width", "off its plane")
            for axis in range(3):
                if not low[axis] - margin <= place[axis] <= high[axis] + margin:
                    raise ValueError(
                        f"cuts[{number}].{end}: {names[axis]} = {show(place[axis], 'm')} is outside the plate "
                        f"'{shell.name}' ({show(low[axis], 'm')} to {show(high[axis], 'm')})"
                    )


def _stays_in_plane(where: str, key: str, load: Any) -> None:
    """Loads and motions that a shell of motion 'in_plane' cannot feel."""
    if key in ("moments", "pressures"):
        raise ValueError(f"{where}: shell '{load.body}' moves in its plane and does not bend; give it motion = 'free'")
    across = "total" if key == "forces" else "velocity"
    given = getattr(load, across)
    if given is not None and given[2]:
        raise ValueError(f"{where}.{across}: z must be 0, for shell '{load.body}' moves in its plane (motion = 'in_plane')")
    for field in ("radial", "rotation"):
        of_it = getattr(load, field, None)
        if of_it is not None and (of_it.axis is None or any(of_it.axis[:2])):
            raise ValueError(f"{where}.{field}.axis must be (0, 0, 1), for shell '{load.body}' moves in its plane (motion = 'in_plane')")
    if any(w is not None for w in getattr(load, "spin", ())):
        raise ValueError(f"{where}.spin: shell '{load.body}' has motion = 'in_plane', its directors do not turn")
