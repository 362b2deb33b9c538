"""John and Shah's notched concrete beam under a falling hammer: where does it crack? (T 2.4.1, figs 2.15 to 2.18)

Three-point bending of an 8 x 3 x 1 inch beam with a notch of 0.75 inch at a distance `notch` from the left
support. Expected: 4 in (a) one crack in mode I from the notch; 2 in (b) one inclined crack from the notch,
at 60 degrees measured and 65 in the thesis; 15/16 in (c) two cracks, from the notch and at the centre;
1/2 in (d) one crack at the centre, the notch stays as it is.

    python scenes/beam_impact.py --quality standard --set notch="2 in" --out DIR
"""

from typing import Literal

from taichi_sph.scene import (
    Ball,
    Cut,
    Delay,
    Length,
    Material,
    Mazars,
    Numerics,
    Plate,
    PrescribedVelocity,
    Quality,
    Quantity,
    Ramp,
    Scene,
    Shell,
)

INCH = 0.0254
SPACING = {"draft": 3.0e-3, "standard": 2.0e-3, "paper": 1.54e-3}  # m; paper: 6650 nodes
LENGTH, HEIGHT, THICKNESS, NOTCH_DEPTH = 8 * INCH, 3 * INCH, 1 * INCH, 0.75 * INCH
GRIP = 6.0e-3  # m, radius of the groups of nodes that supports and hammer hold (T 2.4.1.2)
SOUND = 12.0e-3  # m, radius around them that is not damaged: rubber spreads the load there, which is not modelled

# notch position [in] -> cracks expected
CRACKS = {4.0: 1, 2.0: 1, 15 / 16: 2, 0.5: 1}


def scene(
    quality: Quality = "draft",
    notch: Length = "2 in",
    formulation: Literal["galerkin", "collocation"] = "galerkin",
) -> Scene:
    d = SPACING[quality]
    concrete = Material(
        name="concrete",
        source="T table 2.2",
        young="31.37 GPa",
        poisson=0.2,
        density=2400,
        damage=Mazars(threshold=8.5e-5, A=1, B=7300),
        delay=Delay(a=1, tau_c="15 us"),
        critical_damage=0.99,
    )
    points = {"left": (0, 0, 0), "right": (LENGTH, 0, 0), "top": (LENGTH / 2, HEIGHT, 0)}
    held = {name: Ball(centre=point, radius=max(GRIP, 1.01 * d)) for name, point in points.items()}
    position = min(CRACKS, key=lambda inches: abs(inches * INCH - notch))
    known = abs(position * INCH - notch) < 1e-6
    quantities = [
        Quantity(
            name="crack_count",
            value=CRACKS[position] if known else None,
            tolerance=0 if known else None,
            source="T fig. 2.16, 2.18",
        )
    ]
    if known and position == 2.0:
        quantities += [
            Quantity(name="crack_angle", unit="deg", value=60, tolerance=6, source="measured, T 2.4.1.3 (T: 65)"),
            Quantity(name="crack_width", unit="m", source="at 800 us: beam_convergence"),
        ]
    return Scene(
        name="beam_impact",
        title=f"Notched concrete beam under impact, notch at {notch / INCH:g} in",
        source="T 2.4.1; John and Shah 1990",
        shells=[
            Shell(
                name="beam",
                surface=Plate(length=LENGTH, width=HEIGHT),
                thickness=THICKNESS,
                material=concrete,
                cuts=[Cut(start=(notch, 0, 0), end=(notch, NOTCH_DEPTH, 0))],
                sound=[Ball(centre=point, radius=SOUND) for point in points.values()],
            )
        ],
        motions=[
            PrescribedVelocity(shell="beam", where=held["left"], velocity=(None, 0, None)),
            PrescribedVelocity(shell="beam", where=held["right"], velocity=(None, 0, None)),
            PrescribedVelocity(shell="beam", where=held["top"], velocity=(None, -0.065, None), history=Ramp(rise="196 us")),
        ],
        duration="1.2 ms",
        numerics=Numerics(spacing=d, formulation=formulation),
        quantities=quantities,
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
