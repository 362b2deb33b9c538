"""A sphere, or a cylinder with a flat nose, is shot into a free block of water: its drag in the cavity that it makes.

The bullet of scenes/_tank.py as a sphere (18 mm, 31 g) at 100 to 900 m/s. Behind a cavity a sphere has C_d = 0.31 to 0.40 and a flat nose
0.80 to 0.85, whatever the speed (May 1975, of spheres of steel and of discs; Garabedian 1956: 0.827 of a disc at cavitation number 0).
`by` = "law": water as coarse as that of the tank, through which the striker flies by the law (Drag); what is measured is how much of it
is left, and whether the cavity has the energy that the striker lost. `by` = "pressure": finer water that resists by itself. `by` = "path":
the same, finer along the path alone, in steps of two.

The water is a column along the path only, its faces free. At 730 m/s the wave of the entry comes back from the bottom to the striker six
diameters deep, so the drag is read before; below some 500 m/s it comes back sooner, and C_d is then that of a finite block. The cavity
grows by the energy that the drag leaves in each length of the path, 1/2 rho C_d A V^2 = pi rho N (R dR/dt)^2: its radius is
R^2 = r^2 + r z sqrt(2 C_d / N), z behind the nose.

    python scenes/sphere_entry.py --quality draft --set nose=flat --out DIR
"""

import math
from typing import Literal

from taichi_sph.scene import Box, Drag, Finer, Fluid, FluidBox, Numerics, Output, Pinball, Quality, Quantity, Rigid, Scene, Speed

RADIUS, MASS = 9e-3, 0.031  # m, kg
ACROSS = {  # spacings over the diameter; those of the law are spacings of the tank's water
    "law": {"draft": 1.25, "standard": 1.75, "paper": 2.5},
    "pressure": {"draft": 4.0, "standard": 6.0, "paper": 8.0},
    "path": {"draft": 2.5, "standard": 2.5, "paper": 2.5},
}
HALVED = {"draft": 1, "standard": 2, "paper": 3}  # times, along the path
PATH, STEP = 1.0, 0.5  # half the width of the finest part and of each around it, over the diameter
HALF, DEEP = 4.0, 9.0  # of the column, over the diameter
START, END = 2.0, 5.0  # diameters of the way over which the drag is read
C_D = {"sphere": (0.35, 0.035, "0.31 to 0.40, May 1975"), "flat": (0.825, 0.0825, "0.80 to 0.85, May 1975; Garabedian 1956: 0.827")}


def flat_nosed(ball: float, front: float) -> list[Pinball]:
    """A cylinder as long as wide, along x from `front` [m] on: a disc of balls of that radius and its mantle."""
    rim = RADIUS - ball
    rings = math.ceil(rim / ball)
    places = [(0.0, 0.0, 0.0)]
    for ring in range(1, rings + 1):
        places += _circle(0.0, rim * ring / rings, ball)
    for layer in range(1, math.ceil(2 * rim / ball) + 1):
        places += _circle(layer * ball, rim, ball)
    return [Pinball(centre=(front + ball + x, y, z), radius=ball) for x, y, z in places]


def _circle(x: float, radius: float, apart: float) -> list[tuple[float, float, float]]:
    n = math.ceil(2 * math.pi * radius / apart)
    return [(x, radius * math.cos(2 * math.pi * k / n), radius * math.sin(2 * math.pi * k / n)) for k in range(n)]


def scene(
    quality: Quality = "draft",
    nose: Literal["sphere", "flat"] = "sphere",
    velocity: Speed = 730.0,
    by: Literal["law", "pressure", "path"] = "law",
) -> Scene:
    if not 100.0 <= velocity <= 900.0:
        raise ValueError(f"velocity = {velocity:g} m/s: give 100 to 900 m/s, where the striker is slower than sound in water")
    wide = 2 * RADIUS
    d = wide / ACROSS[by][quality]
    halved = HALVED[quality] if by == "path" else 0
    finest, gap = d / 2**halved, 0.1e-3
    sides = [(PATH + STEP * (halved - 1 - k)) * wide for k in range(halved)]
    finer = [Finer(within=Box(lo=(None, -side, -side), hi=(None, side, side))) for side in sides]
    balls = [Pinball(centre=(RADIUS + gap, 0, 0), radius=RADIUS)] if nose == "sphere" else flat_nosed(min(0.5 * finest, 1.5e-3), gap)
    half, deep = (round(n * wide / d) * d for n in (HALF, DEEP))
    water = FluidBox(lo=(-deep, -half, -half), hi=(0, half, half))
    value, tolerance, source = C_D[nose]
    # the time of the way with that drag, a tenth more of it
    slows = value * 1000.0 * math.pi * RADIUS**2 / (2 * MASS)
    duration = 1.1 * math.expm1(slows * END * wide) / (slows * velocity)
    return Scene(
        name="sphere_entry",
        title=f"{'Sphere' if nose == 'sphere' else 'Flat-nosed cylinder'} shot into water at {velocity:g} m/s",
        source="May 1975",
        rigids=[Rigid(name="striker", mass=MASS, pinballs=balls, velocity=(-velocity, 0, 0))],
        fluids=[Fluid(name="water", fill=water, finer=finer or None, alpha=0.02, delta=0.0)],
        interactions=[Drag(between=("striker", "water"), coefficient=value, radius=RADIUS)] if by == "law" else [],
        duration=duration,
        numerics=Numerics(spacing=d, time_step_safety=0.75),
        output=Output(frames=20, samples=400),
        quantities=[
            Quantity(
                name="drag_coefficient", value=value, tolerance=tolerance, source=source,
                options={"radius": RADIUS, "start": START * wide, "end": END * wide},
            ),
            Quantity(name="peak_force", unit="N"),
            Quantity(name="cavity_radius", unit="m", options={"depth": 2 * wide, "within": max(0.25 * wide, 0.5 * finest)}),
        ],
    )  # fmt: skip


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
