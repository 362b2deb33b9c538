"""What the user says: a strict, frozen, validated description of a run. No Taichi here.

Physics (bodies, loads, motions, duration) stands apart from `Numerics` (how it is computed) and
`Output` (what is kept). Every number is SI once validated; strings with units ("4 mm", "32 GPa",
"15 us") are accepted wherever a dimensional type of `units` stands. Unknown keys are refused, and so
are values that no body of this world has (`plausible`): they are wrong units more often than intentions.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, StrictBool, StrictInt, model_validator

from ..bodies.fluid.said import Fluid, Wall
from ..bodies.rigid.said import PinballContact, Rigid
from . import plausible
from .base import Choice, Frozen, Point
from .materials import Delay, JohnsonCook, LemaitreChaboche, Material, Mazars, Perfect, Power, Table  # noqa: F401  (part of the vocabulary)
from .surfaces import Disc, MeshFile, Plate, Surface
from .units import Acceleration, Dimensionless, Force, Length, Moment, Pressure, Speed, Spin, Time

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=64)]  # names become file names
Quality = Literal["draft", "standard", "paper"]


# --- where ---------------------------------------------------------------------------------------


class Box(Frozen):
    """Reference points with lo <= X <= hi; None leaves a side open."""

    kind: Literal["box"] = "box"
    lo: tuple[Length | None, Length | None, Length | None] = (None, None, None)
    hi: tuple[Length | None, Length | None, Length | None] = (None, None, None)

    @model_validator(mode="after")
    def _has_inside(self) -> Box:
        for axis, lo, hi in zip("xyz", self.lo, self.hi):
            if lo is not None and hi is not None and lo > hi:
                raise ValueError(f"lo is above hi along {axis} ({lo:g} m > {hi:g} m): the box holds nothing")
        return self


class Ball(Frozen):
    """Reference points within `radius` of `centre`."""

    kind: Literal["ball"] = "ball"
    centre: Point
    radius: Annotated[Length, Field(gt=0)]


class Outside(Frozen):
    """Reference points that are not strictly inside `of`: the rim of a disc, the far side of a box."""

    kind: Literal["outside"] = "outside"
    of: Annotated[Box | Ball, *Choice]


Region = Annotated[Box | Ball | Outside, *Choice]


# --- bodies -------------------------------------------------------------------------------------


class Cut(Frozen):
    """Straight cut through the thickness from `start` to `end`: pre-crack or notch."""

    start: Point
    end: Point

    @model_validator(mode="after")
    def _has_length(self) -> Cut:
        if self.start == self.end:
            raise ValueError("start and end are the same point: a cut needs a length")
        return self


class Shell(Frozen):
    """A thin body: mid-surface, thickness, material, cuts present at t = 0.

    `motion` = "in_plane": the mid-surface stays in its plane (plane stress, two degrees of freedom);
    "free": it bends and turns as it likes (Mindlin-Reissner, five degrees of freedom).
    """

    name: Name
    surface: Surface
    thickness: Annotated[Length, Field(gt=0)]
    material: Material
    motion: Literal["in_plane", "free"] = "in_plane"
    cuts: tuple[Cut, ...] = ()
    self_contact: StrictBool | None = None  # True: its parts meet each other too (T 3.3), which costs a search over all nodes
    sound: tuple[Region, ...] = ()  # no damage here: where a support's rubber, not modelled, spreads its load

    @model_validator(mode="after")
    def _believable(self) -> Shell:
        if not isinstance(self.surface, Plate | Disc | MeshFile) and self.motion == "in_plane":
            raise ValueError(
                f"motion = 'in_plane' is for flat bodies, and shell '{self.name}' is a {self.surface.kind}; set motion = 'free'"
            )
        if self.motion == "in_plane" and self.material.strength is not None and self.material.strength.layers is not None:
            raise ValueError(f"material.strength.layers: shell '{self.name}' has motion = 'in_plane' and is not bent; leave them out")
        if isinstance(self.surface, Plate):
            plausible.plate(self)
        elif not isinstance(self.surface, MeshFile):
            plausible.rounded(self)
        return self


# --- how a load varies ----------------------------------------------------------------------------


class Step(Frozen):
    """Full value from t = 0 on."""

    kind: Literal["step"] = "step"


class Ramp(Frozen):
    """Grows linearly from 0 to the full value at `rise`, then stays (T 2.111)."""

    kind: Literal["ramp"] = "ramp"
    rise: Annotated[Time, Field(gt=0)]


History = Annotated[Step | Ramp, *Choice]


class NodalForce(Frozen):
    """Dead force `total`, shared by the nodes of `where` in proportion to their area."""

    shell: str
    where: Region
    total: tuple[Force, Force, Force]
    history: History = Step()


class NodalMoment(Frozen):
    """Dead moment `total` [N m] on the directors of the nodes of `where`, shared like a NodalForce. Only what acts
    across a director turns it: a shell has no drilling stiffness."""

    shell: str
    where: Region
    total: tuple[Moment, Moment, Moment]
    history: History = Step()


class SurfacePressure(Frozen):
    """Pressure on a shell that bends, positive along its normals. "follower" turns and grows with the surface,
    "dead" keeps the direction and area of the reference."""

    shell: str
    value: Pressure
    kind: Literal["follower", "dead"] = "follower"
    history: History = Step()


class PrescribedVelocity(Frozen):
    """Velocity, and the spin of the directors of a shell that bends, imposed on the nodes of `where`, component
    by component; None leaves one free."""

    shell: str
    where: Region
    velocity: tuple[Speed | None, Speed | None, Speed | None]
    spin: tuple[Spin | None, Spin | None, Spin | None] = (None, None, None)
    history: History = Step()

    @model_validator(mode="after")
    def _holds_something(self) -> PrescribedVelocity:
        if all(v is None for v in (*self.velocity, *self.spin)):
            raise ValueError("velocity leaves all three components free: give at least one, 0 to hold it")
        return self


class Pulse(Frozen):
    """exp(-((x - centre) / width)**2)."""

    centre: Length
    width: Annotated[Length, Field(gt=0)]


class InitialVelocity(Frozen):
    """Velocity at t = 0 of the nodes of `where`: a uniform `velocity`, or a Gaussian pulse along x
    (T 4.5.1) velocity * exp(-((x - centre) / width)**2) when `pulse` is given."""

    shell: str
    where: Region = Box()
    velocity: tuple[Speed, Speed, Speed]
    pulse: Pulse | None = None


# --- numerics ------------------------------------------------------------------------------------


class Viscosity(Frozen):
    """Artificial viscosity between node pairs (T 2.35 to 2.38); gamma acts across a shell that bends."""

    alpha: Annotated[Dimensionless, Field(ge=0, le=10)] = 0.05
    beta: Annotated[Dimensionless, Field(ge=0, le=10)] = 0.1
    gamma: Annotated[Dimensionless, Field(ge=0, le=10)] = 0.05


class Galerkin(Frozen):
    """Nodal force = exact transpose of the strain operator (docs/method.md)."""

    kind: Literal["galerkin"] = "galerkin"
    support: Annotated[Dimensionless, Field(ge=1.0, le=2.0)] = 1.2  # h / D
    stabilisation: Annotated[Dimensionless, Field(ge=0, le=1)] = 0.2  # gamma
    shear_bound: Annotated[Dimensionless, Field(ge=0, le=1)] = 0.1  # alpha: kGe / (1 + alpha (D/e)^2)


class Collocation(Frozen):
    """The thesis's strong form (T 2.2), with its viscosity and its filters on spins (T 2.39) and on crack edges
    (T 2.3.6.5)."""

    kind: Literal["collocation"] = "collocation"
    support: Annotated[Dimensionless, Field(ge=1.0, le=2.0)] = 1.2
    viscosity: Viscosity = Viscosity()
    edge_filter: Annotated[Dimensionless, Field(ge=0, le=1)] = 0.01
    spin_filter: Annotated[Dimensionless, Field(ge=0, le=1)] = 0.1  # eta
    shear_bound: Annotated[Dimensionless, Field(ge=0, le=1)] = 0.0  # alpha, as in Galerkin; the thesis has none
    selective_shear: StrictBool = False  # T 2.55: shear at the nodes, stabilised by a little of the cells'


Formulation = Annotated[Galerkin | Collocation, *Choice]


class Numerics(Frozen):
    """How it is computed. `spacing` D is the node spacing of generated surfaces."""

    spacing: Annotated[Length, Field(gt=0)]
    cells: Literal["quad", "triangle"] = "quad"
    irregularity: Annotated[Dimensionless, Field(ge=0, le=0.4)] = 0.0  # random moves, in spacings
    seed: Annotated[StrictInt, Field(ge=0, lt=2**32)] = 0
    formulation: Formulation = Galerkin()
    precision: Literal["f32", "f64"] = "f64"
    time_step_safety: Annotated[Dimensionless, Field(gt=0, le=1)] = 0.9
    raised_inertia: StrictBool = True  # rotary inertia raised so that turning does not rule the step (T 2.52)
    contact: PinballContact | None = None  # of scenes with several bodies; None: its defaults


class Static(Frozen):
    """Equilibrium instead of motion: the loads grow with the pseudo-time in `increments` equal steps, and each is
    relaxed until the unbalanced force is below `residual` of the load."""

    increments: Annotated[StrictInt, Field(ge=1, le=100_000)] = 1
    residual: Annotated[Dimensionless, Field(gt=0, lt=1)] = 1e-6
    max_steps: Annotated[StrictInt, Field(ge=1)] = 1_000_000  # of relaxation, per increment


class Modes(Frozen):
    """The lowest natural modes about the reference instead of motion, loads left out: one pseudo-time step each,
    `count` of them after the rigid ones. Held components of motions are held at 0."""

    count: Annotated[StrictInt, Field(ge=1, le=200)] = 6


class StepLimit(Frozen):
    """The stability limit of the time step instead of motion: that of the operator beside the one at which random
    motion begins to grow within `steps` steps, found by bisection to `resolution` of it."""

    steps: Annotated[StrictInt, Field(ge=50, le=100_000)] = 600
    resolution: Annotated[Dimensionless, Field(gt=0, lt=0.1)] = 1e-3


class Probe(Frozen):
    """Displacement and velocity of the node nearest to a reference point, in histories/probe_<name>.csv."""

    name: Name
    shell: str
    point: Point


class Output(Frozen):
    """What is kept: `frames` pictures over the run, `samples` points in each history."""

    frames: Annotated[StrictInt, Field(ge=1, le=10_000)] = 40
    samples: Annotated[StrictInt, Field(ge=1, le=1_000_000)] = 400
    checkpoints: Annotated[StrictInt, Field(ge=0, le=1000)] = 4
    keep_checkpoints: Annotated[StrictInt, Field(ge=1, le=1000)] = 2
    probes: tuple[Probe, ...] = ()


# --- what the run is to show ---------------------------------------------------------------------


class Quantity(Frozen):
    """A number the run must produce: `name` is a measure of `taichi_sph.output.measures`, `options`
    its arguments; `value` +- `tolerance` the target in `unit`, None where none is stated."""

    name: str
    unit: str = ""
    value: float | None = None
    tolerance: Annotated[float, Field(ge=0)] | None = None
    source: str = ""
    options: dict[str, float | str] = {}


class Scene(Frozen):
    """A whole run. `quality` and `parameters` say how the script was called (for the record)."""

    name: Name
    title: str
    source: str
    quality: Literal["draft", "standard", "paper", "custom"] = "custom"
    parameters: dict[str, StrictBool | StrictInt | float | str] = {}
    shells: tuple[Shell, ...] = ()
    rigids: tuple[Rigid, ...] = ()
    fluids: tuple[Fluid, ...] = ()
    walls: tuple[Wall, ...] = ()  # of the fluids
    forces: tuple[NodalForce, ...] = ()
    moments: tuple[NodalMoment, ...] = ()
    pressures: tuple[SurfacePressure, ...] = ()
    gravity: tuple[Acceleration, Acceleration, Acceleration] | None = None
    motions: tuple[PrescribedVelocity, ...] = ()
    initial: tuple[InitialVelocity, ...] = ()
    duration: Annotated[Time, Field(gt=0)]
    static: Static | None = None
    modes: Modes | None = None
    limit: StepLimit | None = None
    numerics: Numerics
    output: Output = Output()
    quantities: tuple[Quantity, ...] = ()

    @model_validator(mode="after")
    def _believable(self) -> Scene:
        plausible.scene(self)
        return self

    @property
    def increments(self) -> int | None:
        """Pseudo-time steps of a scene that asks for equilibrium, modes or a limit; None where time is time."""
        if self.static is not None:
            return self.static.increments
        if self.modes is not None:
            return self.modes.count
        return 1 if self.limit is not None else None

    def derive(self, **changes: Any) -> Scene:
        """A new scene with some keys changed: scene.derive(**{"numerics.spacing": "1 mm"})."""
        from .script import derive

        return derive(self, **changes)
