"""The ONERA piston (T 5.1, 5.2): a falling mass drives a piston into a cylinder full of water, and the water out of a hole in its base.

A chariot of 245 kg falls on the stem of a piston at `velocity`; the stem is a spring that only pushes, the piston a rigid disc. Their mass
and stiffness are not in T: 3 kg and 2.7e8 N/m follow from the measured 1600 Hz (docs/piston.md). The base of `specimen` E14 and E20 is
rigid, 25 mm thick, with a hole of 14 and 20 mm whose rim is sharp and whose bore is full of water at the start: the tape opens at once.
`wall` "elastic": sound in the column is slowed as the steel of the cylinder gives way (Korteweg; thick wall); "rigid": it is that of water.
The pressure is the mean over a disc of 6 mm on the wall, 25 mm above the base. Two planes mirror a quarter; `whole` = True does without.

Thin bases of AU4G 2024, clamped at the inner wall of the cylinder: F14 (2 mm, hole of 14 mm), TF14 (1 mm, the same hole) and TF (1 mm, no
hole), FU (2 mm, three sides of a flap of 20 x 20 mm cut; half of it is computed) and X (2 mm, two cuts of 30 mm that cross at 45 degrees to
the planes). Cuts are slits of zero width. Thin bases yield, tear and may be torn off along their rim (T 5.3, table 5.6; transverse shear
counts, kappa = 1). T's hardening curve is a picture: the points are those of a plate of 2024-T351.

Expected: the flap of FU opens to about 50 degrees at 5 m/s and 20 at 2 m/s, with 2.0 and 1.8 % at its hinge (set against the size
of the computed strain, which is a compression: docs/piston.md) and 1300 Hz (T 5.2.4.2); the bottom of TF14 is torn off along its rim at
about 1.5 ms (T 5.3.1); the cracks of X turn, and do not branch (T 5.3.2).

`dissipation` "viscosity" with `alpha` = 1 is what the handbook of T's code recommends (T 1.3.3): its viscosity in the hole doubles the
pressure.

    python scenes/piston.py --quality draft --set specimen=E20 --set velocity=5 --out DIR
"""

import math
from typing import Annotated, Literal

import numpy as np
from _slit_disc import above, disc, parted, square
from pydantic import Field

from taichi_sph.scene import (
    Ball,
    Box,
    Dimensionless,
    Disc,
    DiscFace,
    Fluid,
    FluidRound,
    Length,
    Mass,
    Meeting,
    Net,
    Numerics,
    Output,
    Outside,
    Pinball,
    PrescribedVelocity,
    Probe,
    Quality,
    Quantity,
    Rigid,
    Scene,
    Shell,
    Speed,
    Spring,
    Stiffness,
    StrainGauge,
    Table,
    Time,
    TubeFace,
    Wall,
    Water,
    material,
)

Specimen = Literal["E14", "E20", "F14", "TF14", "TF", "FU", "X"]

SPACING = {"draft": 2.9e-3, "standard": 2.05e-3, "paper": 1.45e-3}  # m; standard: T's
CELLS = {"draft": 2e-3, "standard": 1.4e-3, "paper": 1e-3}  # m, of a thin base
HOLES = {"E14": 0.014, "E20": 0.020, "F14": 0.014, "TF14": 0.014, "TF": 0.0, "FU": 0.0, "X": 0.0}  # m
THIN = {"F14": 2e-3, "TF14": 1e-3, "TF": 1e-3, "FU": 2e-3, "X": 2e-3}  # m, thickness
DURATION = {"F14": 6e-3, "TF14": 2.2e-3, "TF": 2.2e-3, "FU": 3.5e-3, "X": 2.1e-3}  # s; T's of FU and X
FLAP = 10e-3  # m: half the side of the flap of FU; its hinge stands at x = FLAP
TIP = 15e-3 / math.sqrt(2)  # m: x and y of the tips of the cuts of X
REACHES = {"FU": FLAP, "X": TIP}  # m: of the slits, from the axis along x and y
COARSEST, WIDEST = 10e-3, 5e-3  # m: spacing of the water and cells of a thin base that still make sense
APART = 1e-7  # m: where two petals end on the axis, so that each is held by the plane that mirrors it
HARDENS = [(0.0, 325e6), (0.02, 385e6), (0.05, 440e6), (0.1, 500e6), (0.15, 540e6), (0.2, 565e6)]  # plastic strain, Pa
BASE, HIGH, RADIUS = 0.025, 0.205, 0.040  # m: thickness of the base, height with it, inner radius
CHARIOT, G = 245.0, 9.81
TRAVEL = 0.05  # m, of the piston at most
SENSOR, ABOVE = 3e-3, 25e-3  # m: radius, height over the base
SOUND, STEEL, POISSON, OUTER = 1450.0, 211e9, 0.3, 0.055


def slowed(sound: float = SOUND, density: float = 1000.0) -> float:
    """Speed of long waves in water in a thick tube [m/s]."""
    give = (OUTER**2 + RADIUS**2) / (OUTER**2 - RADIUS**2) + POISSON
    return sound / math.sqrt(1 + 2 * density * sound**2 * give / STEEL)


def scene(
    quality: Quality = "draft",
    specimen: Specimen = "E20",
    velocity: Annotated[Speed, Field(gt=0)] = 5.0,
    wall: Literal["elastic", "rigid"] = "elastic",
    piston: Mass = 3.0,
    stem: Stiffness = 2.7e8,
    spacing: Annotated[Length, Field(gt=0)] | None = None,
    cells: Annotated[Length, Field(gt=0)] | None = None,
    duration: Time | None = None,
    dissipation: Literal["viscosity", "riemann"] = "riemann",
    alpha: Dimensionless = 1.0,
    whole: bool = False,
) -> Scene:
    by_itself = 4e-3 if (specimen, quality) == ("FU", "draft") else SPACING[quality]  # a half is twice a quarter
    d = by_itself if spacing is None else spacing
    hole, thin = HOLES[specimen], THIN.get(specimen)
    if d > COARSEST:
        raise ValueError(f"spacing = {d:g} m of the water is too coarse: take at most {COARSEST:g}, a quarter of the cylinder's radius")
    if cells is not None and thin is None:
        raise ValueError(f"cells = {cells:g} m: the base of {specimen} is rigid; leave cells out, or take a thin one: {', '.join(THIN)}")
    if cells is not None and cells > WIDEST:
        raise ValueError(f"cells = {cells:g} m of the thin base are too wide: take at most {WIDEST:g}, two over half of the flap of FU")
    height = HIGH - (thin or BASE)
    quarters = 4 if whole else 2 if specimen == "FU" else 1
    r, share, reach = 0.5 * hole, 0.25 * quarters, 5 * d
    kept = {1: (Box(lo=(0, 0, None)),), 2: (Box(lo=(None, 0, None)),), 4: ()}[quarters]
    mirrors = [Wall(point=(0, 0, 0), normal=normal) for normal in ((0, 1, 0), (1, 0, 0))]
    at = RADIUS / math.sqrt(2)
    spot = Ball(centre=(at, at, ABOVE), radius=SENSOR)
    tube = {"start": (0, 0, 0), "end": (0, 0, height + reach), "radius": RADIUS}
    top, guide = height + 0.1, (1e3, 1e3, 1e3)

    def fixed(name: str, z: float, *faces: DiscFace | TubeFace, balls: list[Pinball] | None = None) -> Rigid:
        away = [Pinball(centre=(2 * RADIUS, 0, z), radius=5e-3)]  # a body has a ball, and water sees the faces
        return Rigid(name=name, mass=1.0, held=True, pinballs=balls or away, faces=faces)

    bases = (
        []
        if thin
        else [
            fixed(
                "base",
                -0.02,
                DiscFace(centre=(0, 0, 0), normal=(0, 0, 1), radius=RADIUS, hole=r, within=kept),
                TubeFace(start=(0, 0, -BASE), end=(0, 0, 0), radius=r, within=kept),
                DiscFace(centre=(0, 0, -BASE), normal=(0, 0, -1), radius=r + reach, hole=r, within=kept),
            )
        ]
    )
    fine = CELLS[quality] if cells is None else cells
    shells, motions = plate(specimen, thin, fine, quarters) if thin else ([], [])
    away = ("chariot", "cylinder", *(["plate"] if thin else []))
    return Scene(
        name="piston",
        title=f"ONERA piston, specimen {specimen}, {velocity:g} m/s ({specimen}A{velocity:g})",
        source="T 5.2.4.1",
        gravity=(0, 0, -G),
        fluids=[
            Fluid(
                name="water",
                fill=FluidRound(
                    columns=[(RADIUS, 0, height)] + ([] if thin else [(r, -BASE, 0)]), quarter=quarters == 1, half=quarters == 2 or None
                ),
                water=Water(sound=slowed() if wall == "elastic" else SOUND),
                every=max(1, min(20, int(1.4 * d / fine))) if thin else None,  # steps of the plate
                **({"alpha": alpha} if dissipation == "viscosity" else {"dissipation": dissipation}),
            )
        ],
        shells=shells,
        motions=motions,
        walls={1: mirrors[::-1], 2: mirrors[:1], 4: []}[quarters],
        rigids=[
            fixed("cylinder", 0.1, TubeFace(**tube, within=(*kept, Outside(of=spot))), balls=way(d, height, quarters)),
            fixed("sensor", 0.05, TubeFace(**tube, within=(*kept, spot))),
            *bases,
            Rigid(
                name="piston",
                mass=piston * share,
                inertia=guide,
                pinballs=[Pinball(centre=(0, 0, height + 0.04), radius=0.03), *seal(d, height, quarters)],
                faces=[
                    DiscFace(centre=(0, 0, height), normal=(0, 0, -1), radius=RADIUS, within=kept),
                    TubeFace(start=(0, 0, height), end=(0, 0, height + reach), radius=RADIUS, water="outside", within=kept),
                ],
            ),
            Rigid(
                name="chariot",
                mass=CHARIOT * share,
                inertia=guide,
                velocity=(0, 0, -velocity),
                pinballs=[Pinball(centre=(0, 0, top + 0.1), radius=0.1)],
            ),
        ],
        meetings=[Meeting(between=("piston", other), meet=False) for other in away]
        + [Meeting(between=("plate", other), meet=False) for other in ("cylinder", "sensor", "chariot") if thin],
        springs=[
            Spring(
                name="stem",
                between=("chariot", "piston"),
                points=((0, 0, top + 0.1), (0, 0, height + 0.04)),
                stiffness=stem * share,
                only="push",
            )
        ],
        duration=DURATION.get(specimen, 10e-3) if duration is None else duration,
        numerics=Numerics(spacing=d),
        output=Output(
            frames=100,
            samples=2000,
            probes=[Probe(name="rim", body="plate", point=(r, 0, -0.5 * thin))] if thin else [],
            gauges=gauges(specimen, 0.5 * thin) if thin else [],
        ),
        quantities=of_thin(specimen, velocity) if thin else quantities(specimen, velocity, piston, stem),
    )


def plate(specimen: Specimen, thickness: float, d: float, quarters: int) -> tuple[list[Shell], list[PrescribedVelocity]]:
    """A thin base with cells of d [m], and what holds it: the wall of the cylinder, and the planes of symmetry of a quarter or a half."""
    hole, middle = HOLES[specimen], (0, 0, -0.5 * thickness)
    hardens = Table(points=HARDENS, kappa=1.0)
    aluminium = material("AU4G 2024, tearing", strength=hardens, source="T tables 5.3 and 5.6; hardening of a plate of 2024-T351")
    surface: Disc | Net
    if specimen in ("FU", "X"):
        surface = slit(specimen, d, quarters, -0.5 * thickness)
    else:
        holes = [{"centre": middle, "radius": 0.5 * hole}] if hole else []
        surface = Disc(radius=RADIUS, origin=middle, holes=holes, quarter=quarters == 1 or None)
    shell = Shell(name="plate", surface=surface, thickness=thickness, material=aluminium, motion="free", spacing=d)
    near = 0.25 * min(d, square(REACHES[specimen], d)) if specimen in REACHES else 0.25 * d
    far = RADIUS - near
    held = [PrescribedVelocity(body="plate", where=Outside(of=Ball(centre=middle, radius=far)), velocity=(0, 0, 0), spin=(0, 0, 0))]
    if quarters == 1:
        least = 0.5 * APART if specimen == "X" else near
        along_y, along_x = Box(lo=(None, least, None), hi=(least, far, None)), Box(lo=(least, None, None), hi=(far, least, None))
        held.append(PrescribedVelocity(body="plate", where=along_y, velocity=(0, None, None), spin=(None, 0, 0)))
        held.append(PrescribedVelocity(body="plate", where=along_x, velocity=(None, 0, None), spin=(0, None, 0)))
        if not hole and specimen != "X":
            held.append(PrescribedVelocity(body="plate", where=Box(hi=(near, near, None)), velocity=(0, 0, None), spin=(0, 0, 0)))
    if quarters == 2:
        along_x = Box(lo=(-far, None, None), hi=(far, near, None))
        held.append(PrescribedVelocity(body="plate", where=along_x, velocity=(None, 0, None), spin=(0, None, 0)))
    return [shell], held


def slit(specimen: Specimen, d: float, quarters: int, z: float) -> Net:
    """A base with slits of zero width, at height z [m]: three sides of a flap (FU), or two that cross (X)."""
    low = {1: (0.0, 0.0), 2: (None, 0.0), 4: (None, None)}[quarters]
    if specimen == "FU":
        lines = [((-FLAP, -FLAP), (-FLAP, FLAP)), ((-FLAP, FLAP), (FLAP, FLAP)), ((-FLAP, -FLAP), (FLAP, -FLAP))]
        points, cells = parted(*above(*disc(RADIUS, FLAP, d), low), lines)
    else:
        points, cells = parted(*above(*disc(RADIUS, TIP, d, diagonals=True), low), [((-TIP, -TIP), (TIP, TIP)), ((-TIP, TIP), (TIP, -TIP))])
        if quarters == 1:  # two petals end on the axis; the one along x keeps to the plane y = 0, the other one to x = 0
            for node in np.flatnonzero(np.hypot(*points.T) < APART):
                along = points[cells[(cells == node).any(axis=1)]].mean(axis=(0, 1))
                points[node] = (APART, 0.0) if along[0] > along[1] else (0.0, APART)
    return Net(points=np.column_stack([points, np.full(len(points), z)]), cells=cells, merge=False)


def gauges(specimen: Specimen, z: float) -> list[StrainGauge]:
    """Radial ones of 3 mm, glued below: on the hinge of a flap, else half way from hole to wall (T 5.2.1)."""
    at = FLAP if specimen == "FU" else 0.5 * (RADIUS + 0.5 * HOLES[specimen])
    return [StrainGauge(name="plate", body="plate", point=(at, 0, -z), along=(1, 0, 0), side="inner", length=3e-3)]


def ring(d: float, quarters: int) -> list[tuple[float, float]]:
    """Directions around the axis, about d apart on the wall."""
    n = math.ceil(0.5 * math.pi * RADIUS / d)
    turns = [0.5 * math.pi * (k + 0.5) / n for k in range(quarters * n)]
    return [(math.cos(turn), math.sin(turn)) for turn in turns]


def seal(d: float, height: float, quarters: int) -> list[Pinball]:
    """Balls that touch the rim of the piston's face from above: pressure alone does not keep the gap to the cylinder tight."""
    ball = 1.2 * d
    return [Pinball(centre=(RADIUS * x, RADIUS * y, height + ball), radius=ball) for x, y in ring(0.5 * d, quarters)]


def way(d: float, height: float, quarters: int) -> list[Pinball]:
    """Balls behind the wall where the piston goes: it ploughs water along, which would press itself into the wall."""
    ball = 4 * d
    rows = math.ceil(TRAVEL / (1.5 * d))
    heights = [height + 2 * d - 1.5 * d * k for k in range(rows + 1)]
    return [Pinball(centre=((RADIUS + ball) * x, (RADIUS + ball) * y, z), radius=ball) for x, y in ring(1.5 * d, quarters) for z in heights]


def quantities(specimen: str, velocity: float, piston: float, stem: float) -> list[Quantity]:
    r, bar = 0.5 * HOLES[specimen], 1e5
    measured: dict[str, dict[str, float | str]] = {}
    if velocity in (2.0, 5.0):
        slow = velocity == 2.0
        if specimen == "E14":
            low, high = (58, 83) if slow else (210, 277)
            measured["peak"] = {"value": 0.5 * (low + high) * bar, "tolerance": 0.5 * (high - low) * bar, "source": "T 5.2.1, measured"}
        else:
            low, high, jet = (8, 12, 45) if slow else (40, 65, 92)
            measured["late"] = {
                "value": 0.5 * (low + high) * bar,
                "tolerance": 0.5 * (high - low) * bar,
                "source": "1/2 rho of the measured jet, column model",
            }
            measured["jet"] = {"value": jet, "tolerance": 0.05 * jet, "source": "T 5.2.4.1, measured from films"}
        measured["frequency"] = {"value": 1600.0, "tolerance": 160.0, "source": "T table 5.2, measured"}
    late = {"start": 2e-3, "end": 4e-3}
    exit_ = {"top": -BASE, "bottom": -BASE - 2 * r, "radius": 0.8 * r}
    column: dict[str, float | str] = {
        "face": "sensor",
        "speed": velocity,
        "falling": CHARIOT,
        "mass": piston,
        "stiffness": stem,
        "radius": RADIUS,
        "height": HIGH - BASE,
        "hole": r,
        "slug": BASE,
        "contraction": 0.65,
    }
    sensor = {"face": "sensor"}
    return [
        Quantity(name="face_pressure_peak", unit="Pa", options={**sensor, "start": 0.0, "end": 2e-3}, **measured.get("peak", {})),
        Quantity(name="face_pressure", unit="Pa", options={**sensor, **late}, **measured.get("late", {})),
        Quantity(name="column_ratio", value=1.0, tolerance=0.15, source="column model", options={**column, **late}),
        Quantity(name="axial_speed", unit="m/s", options={**exit_, "start": 0.6e-3, "end": 1.2e-3}),
        Quantity(name="axial_speed", unit="m/s", options={**exit_, **late}, **measured.get("jet", {})),
        Quantity(name="front_speed", unit="m/s", options={"start": 1e-3, "end": 2.5e-3}),
        Quantity(name="face_frequency", unit="Hz", options={**sensor, "start": 0.5e-3, "low": 1000.0}, **measured.get("frequency", {})),
    ]


def of_thin(specimen: Specimen, velocity: float) -> list[Quantity]:
    """What T says of thin bases. Runs of F14 and FU alone are long enough for a frequency."""

    def expected(tests: dict[tuple[str, float], tuple[float, float]], source: str) -> dict[str, float | str]:
        """The target of this test, value and tolerance, where it has one."""
        found = tests.get((specimen, velocity))
        return {} if found is None else {"value": found[0], "tolerance": found[1], "source": source}

    sensor, plate, rim = {"face": "sensor"}, {"body": "plate"}, {"body": "plate", "radius": RADIUS}
    late = {**sensor, "start": 2e-3, "end": 4e-3}
    torn = expected({("TF14", 5.0): (1.5e-3, 0.2e-3)}, "T 5.3.1, fig. 5.37, measured")
    swung = expected({("F14", 2.0): (1100.0, 100.0), ("FU", 2.0): (1300.0, 130.0), ("FU", 5.0): (1300.0, 130.0)}, "T table 5.2, measured")
    found = [
        Quantity(name="face_pressure_peak", unit="Pa", options={**sensor, "start": 0.0, "end": 2e-3}),
        Quantity(name="time_to_rupture", unit="s", options=plate),
        Quantity(name="rim_severed", options=rim),
        Quantity(name="rim_severed_at", unit="s", options={**rim, "share": 0.5}),
        Quantity(name="rim_severed_at", unit="s", options=rim, **torn),
    ]
    if specimen in ("F14", "FU"):
        low = {"F14": 500.0, "FU": 700.0}[specimen]
        found.append(Quantity(name="face_frequency", unit="Hz", options={**sensor, "start": 0.5e-3, "low": low}, **swung))
    if specimen == "FU":
        angle = expected({("FU", 5.0): (50.0, 5.0), ("FU", 2.0): (20.0, 5.0)}, "T 5.2.4.2, figs 5.30 and 5.34, measured")
        strain = expected({("FU", 5.0): (0.020, 0.003), ("FU", 2.0): (0.018, 0.003)}, "T 5.2.1, measured")
        flap = {**plate, "x": -0.4 * FLAP, "y": 0.0, "z": -0.5 * THIN["FU"], "radius": 0.5 * FLAP}
        found += [
            Quantity(name="face_pressure", unit="Pa", options=late),
            Quantity(name="turn_angle", unit="deg", options=flap, **angle),
            Quantity(name="history_peak", options={"history": "gauge_plate", "column": "strain"}, **strain),
        ]
    if specimen == "X":
        tip = {**plate, "x": TIP, "y": TIP, "z": -0.5 * THIN["X"]}
        petal = {**plate, "z": -0.5 * THIN["X"], "radius": 0.3 * TIP}
        unbranched = expected({("X", 5.0): (1.0, 0.0)}, "T 5.3.2, measured: no branch")
        found += [
            Quantity(name="tip_crack_length", unit="m", options=tip),
            Quantity(name="petals", options=tip, **unbranched),
            Quantity(name="turn_angle", unit="deg", options={**petal, "x": 0.5 * TIP, "y": 0.0, "axis": "y"}),
            Quantity(name="turn_angle", unit="deg", options={**petal, "x": 0.0, "y": 0.5 * TIP, "axis": "x"}),
        ]
    return found


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
