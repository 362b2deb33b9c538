"""Fuel over water in one tank of rigid planes: at rest it stays at rest; heavy over light turns over.

Two fluids of one lattice and one law that differ in their density. `heavy` says where the heavy one lies: below, pressures are those of the
two columns and nothing moves; above, the surface between them is unstable (Taylor 1950), and the heavy fluid falls through the light one.
Sound is slowed to ten times the speed of a fall through the depth.

    python scenes/fuel_over_water.py --quality draft --set heavy=above --out DIR
"""

import math
from typing import Literal

from taichi_sph.scene import Density, Fluid, FluidBox, Numerics, Output, Quality, Quantity, Scene, Wall, Water

WIDE = {"draft": 8, "standard": 12, "paper": 16}  # spacings over the width
WIDTH, DEPTH = 0.1, 0.1  # m, of the tank, of each layer
G = 9.81  # m/s2
FALLS = {"below": 6, "above": 12}  # the duration, in times of a fall through both layers
TILT = 0.05  # of gravity, sideways, where the heavy fluid is above: an even lattice has nothing from which a wave could grow


def scene(quality: Quality = "draft", heavy: Literal["below", "above"] = "below", fuel: Density = 800.0, water: Density = 1000.0) -> Scene:
    d = WIDTH / WIDE[quality]
    sound = 10 * math.sqrt(2 * G * 2 * DEPTH)
    layers = {"below": (0.0, DEPTH), "above": (DEPTH, 2 * DEPTH)}
    other = "above" if heavy == "below" else "below"
    densities = {heavy: max(fuel, water), other: min(fuel, water)}
    fluids = [
        Fluid(
            name="water" if densities[layer] == water else "fuel",
            fill=FluidBox(lo=(0, 0, low), hi=(WIDTH, WIDTH, high)),
            water=Water(density=densities[layer], sound=sound),
        )
        for layer, (low, high) in layers.items()
    ]
    normals = {(1, 0, 0): 0.0, (-1, 0, 0): WIDTH, (0, 1, 0): 0.0, (0, -1, 0): WIDTH, (0, 0, 1): 0.0}
    duration = FALLS[heavy] * math.sqrt(4 * DEPTH / G)
    late = {"start": 0.6 * duration}
    rest = [
        *(Quantity(name="pressure_slope", value=1.0, tolerance=0.05, source="rho g", options={**late, "fluid": f.name}) for f in fluids),
        *(Quantity(name="restlessness", value=0.0, tolerance=0.02, source="at rest", options={**late, "fluid": f.name}) for f in fluids),
    ]
    return Scene(
        name="fuel_over_water",
        title="Fuel over water at rest" if heavy == "below" else "Water over fuel turns over",
        source="hydrostatics" if heavy == "below" else "Taylor 1950",
        fluids=fluids,
        walls=[Wall(point=[at * abs(n) for n in normal], normal=normal) for normal, at in normals.items()],
        gravity=(0, 0, -G) if heavy == "below" else (TILT * G, 0, -G),
        duration=duration,
        numerics=Numerics(spacing=d),
        output=Output(frames=60, samples=200),
        quantities=rest if heavy == "below" else [Quantity(name="mean_height", unit="m", options={"fluid": f.name}) for f in fluids],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
