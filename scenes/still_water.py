"""Water at rest: the pressure is rho g times the depth, and stays.

`held` by rigid planes, which show the water its images, or by a held can, whose surface presses on it (docs/method.md, 11). Sound is
slowed to ten times the speed of a fall through the depth, as is usual for water that moves slowly.

    python scenes/still_water.py --quality draft --set held=shell --out DIR
"""

import math
from typing import Literal

from taichi_sph.scene import (
    Box,
    Cylinder,
    Fluid,
    FluidBox,
    Material,
    Numerics,
    Output,
    PrescribedVelocity,
    Quality,
    Quantity,
    Scene,
    Shell,
    ShellFill,
    Wall,
    Water,
)

WIDE = {"draft": 8, "standard": 12, "paper": 16}  # spacings over the width
WIDTH, DEPTH, WALL = 0.1, 0.2, 1e-3  # m
G = 9.81  # m/s2


def scene(quality: Quality = "draft", held: Literal["planes", "shell"] = "planes") -> Scene:
    d = WIDTH / WIDE[quality]
    water = Water(sound=10 * math.sqrt(2 * G * DEPTH))
    duration = 6 * math.sqrt(2 * DEPTH / G)
    level = DEPTH
    if held == "planes":
        normals = {(1, 0, 0): 0.0, (-1, 0, 0): WIDTH, (0, 1, 0): 0.0, (0, -1, 0): WIDTH, (0, 0, 1): 0.0}
        bodies = {
            "fluids": [Fluid(name="water", fill=FluidBox(lo=(0, 0, 0), hi=(WIDTH, WIDTH, DEPTH)), water=water)],
            "walls": [Wall(point=[at * abs(n) for n in normal], normal=normal) for normal, at in normals.items()],
        }
    else:
        # soft, so that the step of the held shell does not rule that of the water
        soft = Material(name="held", source="any: it does not move", young=1e6, poisson=0.3, density=1000)
        level += 0.5 * WALL
        bodies = {
            "shells": [
                Shell(
                    name="can",
                    surface=Cylinder(radius=0.5 * (WIDTH + WALL), length=DEPTH + 0.3 * WIDTH, ends="discs"),
                    thickness=WALL,
                    material=soft,
                    motion="free",
                )
            ],
            "motions": [PrescribedVelocity(shell="can", where=Box(), velocity=(0, 0, 0), spin=(0, 0, 0))],
            "fluids": [Fluid(name="water", fill=ShellFill(shell="can", level=level), water=water)],
        }
    late = {"start": 0.6 * duration}
    return Scene(
        name="still_water",
        title=f"Water at rest, held by {'rigid planes' if held == 'planes' else 'a can'}",
        source="hydrostatics",
        gravity=(0, 0, -G),
        duration=duration,
        numerics=Numerics(spacing=d),
        output=Output(frames=60, samples=200),
        quantities=[
            Quantity(name="pressure_slope", value=1.0, tolerance=0.03, source="rho g", options=late),
            Quantity(name="bottom_pressure", value=1.0, tolerance=0.03, source="rho g H", options={**late, "level": level}),
            Quantity(name="restlessness", value=0.0, tolerance=0.01, source="at rest", options=late),
        ],
        **bodies,
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
