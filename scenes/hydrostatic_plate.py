"""An elastic plate as the bottom of a column of water bends under rho g h and its own weight (Kirchhoff, clamped square).

The plate lies still and bare when the water is set upon it, so it swings; water and plate are left to ring and the mean over the last
swings is compared. Sides are rigid planes without friction, so the plate carries all of the weight, by contact.

    python scenes/hydrostatic_plate.py --quality draft --out DIR
"""

import math

from taichi_sph.scene import (
    Box,
    Fluid,
    FluidBox,
    Material,
    Numerics,
    Output,
    Outside,
    Plate,
    PrescribedVelocity,
    Probe,
    Quality,
    Quantity,
    Scene,
    Shell,
    Wall,
    Water,
)

WIDE = {"draft": 10, "standard": 16, "paper": 20}  # spacings over the side
SIDE, DEPTH, THICKNESS, G = 0.2, 0.1, 5e-3, 9.81  # m, m/s2
YOUNG, POISSON, DENSITY = 400e6, 0.3, 4000.0  # Pa, kg/m3, of a soft and heavy plastic
STIFFNESS = YOUNG * THICKNESS**3 / (12 * (1 - POISSON**2))  # N m
PRESSURE = G * (1000 * DEPTH + DENSITY * THICKNESS)  # Pa, water and plate
DEFLECTION = 0.00126532 * PRESSURE * SIDE**4 / STIFFNESS  # m, thin clamped square under an even pressure; 0.1 of the thickness


def scene(quality: Quality = "draft") -> Scene:
    d = SIDE / WIDE[quality]
    half = 0.5 * SIDE
    within = Box(lo=(-half + 0.01 * d, -half + 0.01 * d, None), hi=(half - 0.01 * d, half - 0.01 * d, None))
    swing = 2 * math.pi * math.sqrt(DEFLECTION / G)
    duration = 6 * swing
    normals = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0))
    return Scene(
        name="hydrostatic_plate",
        title="Elastic plate under a column of water",
        source="Timoshenko and Woinowsky-Krieger, table 35",
        shells=[
            Shell(
                name="plate",
                surface=Plate(length=SIDE, width=SIDE, origin=(-half, -half, 0)),
                thickness=THICKNESS,
                material=Material(name="plastic", source="any soft one", young=YOUNG, poisson=POISSON, density=DENSITY),
                motion="free",
            )
        ],
        fluids=[
            Fluid(
                name="water",
                fill=FluidBox(lo=(-half, -half, 0.5 * THICKNESS), hi=(half, half, 0.5 * THICKNESS + DEPTH)),
                water=Water(sound=10 * math.sqrt(2 * G * DEPTH)),
            )
        ],
        walls=[Wall(point=[-half * n for n in normal], normal=normal) for normal in normals],
        motions=[PrescribedVelocity(shell="plate", where=Outside(of=within), velocity=(0, 0, 0), spin=(0, 0, 0))],
        gravity=(0, 0, -G),
        duration=duration,
        numerics=Numerics(spacing=d),
        output=Output(frames=40, samples=800, probes=[Probe(name="centre", shell="plate", point=(0, 0, 0))]),
        quantities=[
            Quantity(
                name="history_mean", unit="m", value=-DEFLECTION, tolerance=0.03 * DEFLECTION, source="Kirchhoff, clamped square",
                options={"history": "probe_centre", "column": "u_z", "start": 0.5 * duration},
            ),
        ],
    )  # fmt: skip


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
