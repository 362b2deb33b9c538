"""A pressurised cylinder with an axial pre-crack: the crack runs along the axis, its lips bulge outwards.

The wall is open at both ends, which keep their shape; the follower pressure is applied as a ramp. Expected: the cut
opens under the hoop stress p R / e, and the crack runs in both directions, slower than Rayleigh waves. (A little later
the flaps beside it break off round the ends.)

    python scenes/pressurised_cylinder.py --quality standard --out DIR
"""

import math

from taichi_sph.scene import (
    Box,
    Cut,
    Cylinder,
    Delay,
    Material,
    Mazars,
    Numerics,
    Output,
    PrescribedVelocity,
    Pressure,
    Quality,
    Quantity,
    Ramp,
    Scene,
    Shell,
    SurfacePressure,
)

SPACING = {"draft": 6e-3, "standard": 4e-3, "paper": 2e-3}  # m
RADIUS, LENGTH, THICKNESS, CUT = 0.06, 0.3, 3e-3, 0.06  # m


def scene(quality: Quality = "draft", pressure: Pressure = 80e3) -> Scene:
    d = SPACING[quality]
    middle = LENGTH / 2
    beside = math.pi / round(2 * math.pi * RADIUS / d)  # half a spacing round the wall: through the middle of cells
    x, y = RADIUS * math.cos(beside), RADIUS * math.sin(beside)
    ends = {"low": Box(hi=(None, None, d / 4)), "high": Box(lo=(None, None, LENGTH - d / 4))}
    return Scene(
        name="pressurised_cylinder",
        title="Pressurised cylinder with an axial pre-crack",
        source="no reference: shows that cracks run through a bent shell",
        shells=[
            Shell(
                name="wall",
                surface=Cylinder(radius=RADIUS, length=LENGTH, axis="z"),
                thickness=THICKNESS,
                material=Material(
                    name="concrete",
                    source="T table 2.6",
                    young="32 GPa",
                    poisson=0.2,
                    density=2450,
                    damage=Mazars(threshold=8.5e-5, A=1, B=7300),
                    delay=Delay(a=10, tau_c="1 us"),
                    critical_damage=0.99,
                ),
                motion="free",
                cuts=[Cut(start=(x, y, middle - CUT / 2), end=(x, y, middle + CUT / 2))],
            )
        ],
        motions=[PrescribedVelocity(shell="wall", where=box, velocity=(0, 0, None)) for box in ends.values()],
        pressures=[SurfacePressure(shell="wall", value=pressure, kind="follower", history=Ramp(rise="0.1 ms"))],
        duration="0.24 ms",
        numerics=Numerics(spacing=d, irregularity=0.1),
        output=Output(frames=40, samples=400),
        quantities=[
            Quantity(name="edge_arrival", unit="s", source="at the end of the wall"),
            Quantity(name="tip_speed_plateau", unit="m/s", value=1050, tolerance=1050, source="below Rayleigh, 2100 m/s"),
            Quantity(
                name="history_peak",
                value=0.0,
                tolerance=1.0,
                source="energy that no entry of the ledger explains, in percent",
                options={"history": "energies", "column": "closed_residual_percent", "start": 0.1e-3},
            ),
        ],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
