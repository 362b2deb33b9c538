"""Academic tests of water against what is rigid (Maurel 2008, named in T 3.4), each with its closed form.

`case` = "hammer": a column of water hits a rigid wall at `velocity`: p = rho c v behind the shock.
`case` = "piston": a rigid block stands on a column in a rigid tube and is let go under its weight, an acoustic oscillator: its
    frequency solves k L tan(k L) = rho A L / m with k = omega / c, and the water under it bears twice its weight at most.
`case` = "indenter": a block is pushed into the column by a blow: while sound has not come back from the bottom it slows down as
    v = v_0 exp(-rho c A t / m).
`case` = "shock": a column hits the wall so fast that `pressure` stands behind the shock: water that stiffens (Tait, gamma 7.15). Its jump
    p = rho_0 U u, u = U (1 - rho_0 / rho) has U within 0.4 % of the measured 1450 m/s + 1.99 u, up to 1 GPa (Nagayama et al. 2002).

Walls and blocks press by contact of pinballs alone, as in T 3.3: the faces of the block are rows of balls. `velocity` (10 m/s where it is
left out) is of the hammer and the indenter, `pressure` (1 GPa) of the shock.

    python scenes/water_column.py --quality draft --set case=piston --out DIR
"""

import math
from typing import Literal

from taichi_sph.scene import (
    Fluid,
    FluidBox,
    Numerics,
    Output,
    Pinball,
    Pressure,
    Quality,
    Quantity,
    Rigid,
    Scene,
    Speed,
    Tait,
    Wall,
    Water,
)  # fmt: skip

HIGH = {"draft": 24, "standard": 40, "paper": 80}  # spacings over the length
LENGTH, SOUND, DENSITY, G = 1.0, 1450.0, 1000.0, 9.81  # m, m/s, kg/m3, m/s2
ACROSS = 4  # spacings over the side


def scene(
    quality: Quality = "draft",
    case: Literal["hammer", "piston", "indenter", "shock"] = "hammer",
    velocity: Speed | None = None,
    pressure: Pressure | None = None,
) -> Scene:
    if pressure is not None and case != "shock":
        raise ValueError(f"pressure = {pressure:g} Pa: of case = shock alone; leave it out")
    if velocity is not None and case in ("piston", "shock"):
        raise ValueError(f"velocity = {velocity:g} m/s: of case = hammer and indenter alone; leave it out")
    velocity, pressure = 10.0 if velocity is None else velocity, 1e9 if pressure is None else pressure
    d = LENGTH / HIGH[quality]
    side = ACROSS * d
    half, area = 0.5 * side, side**2
    transit = LENGTH / SOUND
    law = Tait()
    if case == "shock":
        if not 1e6 <= pressure <= 1e9:
            raise ValueError(
                f"pressure = {pressure:g} Pa behind the shock: give 1e6 to 1e9, for which the jump was compared with measured ones"
            )
        front, velocity = jump(pressure, law.gamma)
    mass = DENSITY * area * LENGTH * (4.0 if case == "piston" else 0.5)
    centres = [-half + (k + 0.5) * d for k in range(ACROSS)]
    top = LENGTH + 0.5 * d
    block = Rigid(
        name="block",
        mass=mass,
        pinballs=[Pinball(centre=(x, y, top), radius=0.5 * d) for x in centres for y in centres],
        velocity=(0, 0, -velocity if case == "indenter" else 0.0),
    )
    water = Fluid(
        name="water",
        fill=FluidBox(lo=(-half, -half, 0), hi=(half, half, LENGTH)),
        velocity=(0, 0, -velocity if case in ("hammer", "shock") else 0.0),
        water=Water(density=DENSITY, sound=SOUND, tension=None if case == "piston" else 0.0, **({"law": law} if case == "shock" else {})),
        hydrostatic=False,
        contact="pinballs",
        **({"alpha": 0.5, "beta": 1.0} if case in ("hammer", "shock") else {"alpha": 0.02}),
    )
    normals = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0))
    walls = [Wall(point=[-half * n for n in normal], normal=normal) for normal in normals] + [Wall(point=(0, 0, 0), normal=(0, 0, 1))]
    if case == "hammer":
        pressure = DENSITY * SOUND * velocity
        duration = 0.8 * transit
        quantities = [
            Quantity(
                name="layer_pressure", unit="Pa", value=pressure, tolerance=0.03 * pressure, source="rho c v",
                options={"axis": "z", "low": 0.0, "high": 0.2 * LENGTH, "start": 0.5 * transit, "end": 0.8 * transit},
            )
        ]  # fmt: skip
    elif case == "shock":
        duration = 0.8 * LENGTH / front
        quantities = [
            Quantity(
                name="layer_pressure", unit="Pa", value=pressure, tolerance=0.01 * pressure, source="jump of Tait's water",
                options={"axis": "z", "low": 0.1 * LENGTH, "high": 0.3 * LENGTH, "start": 0.7 * duration, "end": duration},
            )
        ]  # fmt: skip
    elif case == "piston":
        kL = _root(DENSITY * area * LENGTH / mass)
        period = 2 * math.pi * transit / kL
        duration = 3.2 * period
        of_block = {"history": "rigid_block", "column": "z"}
        quantities = [
            Quantity(
                name="history_period",
                unit="s",
                value=period,
                tolerance=0.03 * period,
                source="k L tan(k L) = rho A L / m",
                options=of_block,
            ),
        ]
    else:
        duration = 1.6 * transit
        times = (0.5 * transit, 1.5 * transit)
        v = [velocity * math.exp(-DENSITY * SOUND * area * t / mass) for t in times]
        quantities = [
            Quantity(
                name="history_value", unit="m/s", value=-speed, tolerance=0.05 * velocity, source="v_0 exp(-rho c A t / m), 5 % of v_0",
                options={"history": "rigid_block", "column": "vz", "time": t},
            )
            for t, speed in zip(times, v)
        ]  # fmt: skip
    return Scene(
        name="water_column",
        title={
            "shock": f"Shock of {1e-6 * pressure:g} MPa in water",
            "hammer": "Water hammer",
            "piston": "Block on a column of water",
            "indenter": "Block driven into water",
        }[case],
        source="Maurel 2008 in T 3.4; Joukowsky",
        fluids=[water],
        rigids=[] if case in ("hammer", "shock") else [block],
        walls=walls,
        gravity=(0, 0, -G) if case == "piston" else None,
        duration=duration,
        numerics=Numerics(spacing=d),
        output=Output(frames=40, samples=400),
        quantities=quantities,
    )


def jump(pressure: float, gamma: float) -> tuple[float, float]:
    """Speeds [m/s] of a shock into water at rest and of the water behind it: p = rho_0 U u and u = U (1 - rho_0 / rho)."""
    thinner = (1.0 + gamma * pressure / (DENSITY * SOUND**2)) ** (-1.0 / gamma)
    front = math.sqrt(pressure / (DENSITY * (1.0 - thinner)))
    return front, pressure / (DENSITY * front)


def _root(ratio: float) -> float:
    """x tan x = ratio, 0 < x < pi/2."""
    low, high = 0.0, 0.5 * math.pi
    for _ in range(60):
        x = 0.5 * (low + high)
        low, high = (x, high) if x * math.tan(x) < ratio else (low, x)
    return x


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
