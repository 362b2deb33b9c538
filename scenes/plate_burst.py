"""A brittle plate, clamped all round, bursts under a sudden pressure: cracks through the thickness of a bent shell.

Mazars' damage follows the most stretched skin, so bending cracks it. Expected: cracks along the clamped edges, where
bending is strongest, then a cross through the middle: four panels; the energy that the pressure gives is found again
to a percent.

    python scenes/plate_burst.py --quality standard --out DIR
"""

from taichi_sph.scene import (
    Delay,
    Material,
    Mazars,
    Numerics,
    Output,
    Plate,
    Pressure,
    Quality,
    Quantity,
    Ramp,
    Scene,
    Shell,
    SurfacePressure,
)
from taichi_sph.scene.supports import clamped, held

SPACING = {"draft": 10e-3, "standard": 5e-3, "paper": 2.5e-3}  # m
SIDE, THICKNESS = 0.4, 8e-3  # m


def scene(quality: Quality = "draft", pressure: Pressure = 35e3) -> Scene:
    d = SPACING[quality]
    edges = [[clamped(axis, 0.0, "above"), clamped(axis, SIDE, "below")] for axis in ("x", "y")]
    return Scene(
        name="plate_burst",
        title="Clamped concrete plate under a sudden pressure",
        source="no reference: shows that cracks run through a bent shell",
        shells=[
            Shell(
                name="plate",
                surface=Plate(length=SIDE, width=SIDE),
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
            )
        ],
        motions=held("plate", d, *edges),
        pressures=[SurfacePressure(shell="plate", value=pressure, kind="follower", history=Ramp(rise="0.2 ms"))],
        duration="2 ms",
        numerics=Numerics(spacing=d, irregularity=0.1),
        output=Output(frames=40, samples=400),
        quantities=[
            Quantity(name="fragments_count", value=4, tolerance=0, source="four panels", options={"nodes": (0.3 * SIDE / d) ** 2}),
            Quantity(name="displacement", unit="m", source="at the middle", options={"x": SIDE / 2, "y": SIDE / 2}),
            Quantity(
                name="history_peak",
                value=0.0,
                tolerance=1.0,
                source="energy that no entry of the ledger explains, in percent",
                options={"history": "energies", "column": "closed_residual_percent", "start": 0.2e-3},
            ),
        ],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
