"""Water runs out through a round hole in the bottom of a tank: Torricelli's sqrt(2 g H) on the axis of the jet, and the contraction of a
sharp edge.

Square tank of rigid planes, twice as wide as the hole, filled to `head` widths of the tank. The closed form: discharge coefficient 0.61
of a sharp edge in a wide tank (Kirchhoff's pi / (pi + 2) of a slot is 0.611; measured 0.60 to 0.62). Viscosity is the question: the
artificial one that keeps the particles calm is that of a fluid, nu = alpha c h / 10, and Re = v d / nu with the speed v of the jet and
the diameter d of the hole. At alpha = 0.02 and 14 spacings Re is about 600, at alpha = 0.1 about 120. `sound` is that of the water over
the speed of the jet: with viscosity Re falls as it rises, with `dissipation` "riemann" it does not. `quarter`: two planes mirror a quarter.
`halved`: the water about the hole has half the spacing.

    python scenes/torricelli.py --quality draft --set head=2 --out DIR
"""

import math
from typing import Literal

from taichi_sph.scene import Ball, Dimensionless, Finer, Fluid, FluidBox, Hole, Numerics, Output, Quality, Quantity, Scene, Wall, Water

ACROSS = {"draft": 8, "standard": 10, "paper": 14}  # spacings over the hole
HOLE, G = 0.05, 9.81  # m, diameter; m/s2
WIDTH = 2 * HOLE


def scene(
    quality: Quality = "draft",
    head: Dimensionless = 1.0,
    alpha: Dimensionless = 0.02,
    sound: Dimensionless = 10.0,
    dissipation: Literal["viscosity", "riemann"] = "viscosity",
    quarter: bool = False,
    halved: bool = False,
) -> Scene:
    if not 0.2 <= head <= 20:
        raise ValueError(f"head = {head:g} widths of the tank: give a number from 0.2 to 20")
    d = HOLE / ACROSS[quality]
    half, depth = 0.5 * WIDTH, head * WIDTH
    fall = math.sqrt(2 * depth / G)
    low = 0.0 if quarter else -half  # two planes mirror the rest
    normals = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0))
    sides = [Wall(point=[low * n if sum(normal) > 0 else -half * n for n in normal], normal=normal) for normal in normals]
    floor = Wall(point=(0, 0, 0), normal=(0, 0, 1), hole=Hole(centre=(0, 0, 0), radius=0.5 * HOLE))
    part = 0.25 if quarter else 1.0
    when = {"bottom": 0.0, "area": part * WIDTH**2, "start": 0.55 * fall, "end": fall}
    jet, opening = {**when, "radius": 0.5 * HOLE}, {**when, "radius": 0.5 * HOLE * math.sqrt(part)}  # a circle of the open area
    return Scene(
        name="torricelli",
        title=f"Outflow under a head of {head:g} widths",
        source="Torricelli; Kirchhoff",
        fluids=[
            Fluid(
                name="water",
                fill=FluidBox(lo=(low, low, 0), hi=(half, half, depth)),
                water=Water(sound=sound * math.sqrt(2 * G * depth)),
                finer=(Finer(within=Ball(centre=(0, 0, 0), radius=1.25 * HOLE)),) if halved else None,
                **({"alpha": alpha} if dissipation == "viscosity" else {"dissipation": dissipation}),
            )
        ],
        walls=[*sides, floor],
        gravity=(0, 0, -G),
        duration=fall,
        numerics=Numerics(spacing=d),
        output=Output(frames=50, samples=200),
        quantities=[
            Quantity(name="core_speed", value=1.0, tolerance=0.05, source="Torricelli", options=jet),
            Quantity(name="outflow", value=0.61, tolerance=0.03, source="sharp edge", options=opening),
        ],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
