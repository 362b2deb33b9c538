"""A copper bar strikes a rigid anvil (Taylor 1948): its length, the foot of its mushroom, its width above the foot.

25.4 mm x 7.62 mm of OFHC copper at 130, 146 or 190 m/s, against recovered cylinders (Johnson and Cook 1983, Zerilli and Armstrong 1987, as
digitised by Banerjee, HighRateExptData): length, diameter of the foot, diameter a fifth of the length above it. "fitted" has the constants
that Johnson and Holmquist (1988) took from such cylinders, without rate and heat; "ofhc" those of Johnson and Cook (1983), from tension and
torsion, with rate and heat, which leave the bar too long. "wilkins": 32.4 mm x 6.4 mm at 227 m/s with the linear hardening on
which codes are compared, 400 MPa + 100 MPa x strain: these end at 21.4 to 21.5 mm with a foot of 7.0 to 7.3 mm radius.

The anvil is smooth. "plane": the foot stays in its plane and slides. "ball": the bar meets a ball so large that it is a plane, and leaves.

    python scenes/taylor_bar.py --quality draft --out DIR
"""

from typing import Literal

from taichi_sph.scene import (
    Box,
    Heat,
    InitialVelocity,
    JohnsonCook,
    Material,
    Numerics,
    Output,
    Pinball,
    Power,
    PrescribedVelocity,
    Quality,
    Quantity,
    Rigid,
    Rod,
    Scene,
    Solid,
    Table,
)

OVER_RADIUS = {"draft": 6, "standard": 9, "paper": 14}  # spacings
OFHC = Material(
    name="OFHC copper",
    source="Johnson and Cook 1983",
    young=124e9,
    poisson=0.34,
    density=8960,
    strength=JohnsonCook(A=90e6, B=292e6, n=0.31, C=0.025, rate0=1.0, heat=Heat(m=1.09, melting=1356, room=294, capacity=383)),
)
LINEAR = Material(
    name="copper, linear hardening",
    source="the case of code comparisons",
    young=117e9,
    poisson=0.35,
    density=8930,
    strength=Table(points=((0.0, 400e6), (10.0, 1400e6))),
)
FITTED = Material(
    name="OFHC copper, fitted to cylinders",
    source="Johnson and Holmquist 1988, as the OpenMPM3D example has it",
    young=117e9,
    poisson=0.35,
    density=8930,
    strength=Power(A=118e6, B=484e6, n=0.74),
)
MEASURED = {130: (19.56, 9.91, 8.92), 146: (18.69, 10.67, 9.30), 190: (16.21, 13.56, 10.10)}  # m/s: mm
CASES = {  # length, diameter [m], duration [s], material
    "ofhc": (25.4e-3, 7.62e-3, 90e-6, OFHC),
    "fitted": (25.4e-3, 7.62e-3, 90e-6, FITTED),
    "wilkins": (32.4e-3, 6.4e-3, 80e-6, LINEAR),
}


def scene(
    quality: Quality = "draft",
    case: Literal["fitted", "ofhc", "wilkins"] = "fitted",
    speed: Literal[130, 146, 190] = 190,
    anvil: Literal["plane", "ball"] = "plane",
) -> Scene:
    length, diameter, duration, material = CASES[case]
    d = 0.5 * diameter / OVER_RADIUS[quality]
    large = 1e3 * diameter  # the bar sees 2e-3 mm of the ball's height
    ball = Rigid(name="anvil", mass=1.0, pinballs=[Pinball(centre=(0, 0, -large - 1e-6), radius=large)], held=True)
    plane = PrescribedVelocity(where=Box(hi=(None, None, 1e-6)), velocity=(None, None, 0))
    v = 227.0 if case == "wilkins" else float(speed)
    if case == "wilkins":
        source, tolerance = "codes: 21.4 to 21.5 mm, radius 7.0 to 7.3 mm", 0.02
        wanted = [("body_length", 21.45e-3, {}), ("body_diameter", 14.3e-3, {})]
    else:
        source, tolerance = "Johnson and Cook 1983, Zerilli and Armstrong 1987, measured", 0.04
        long, foot, above = (1e-3 * x for x in MEASURED[speed])
        wanted = [("body_length", long, {}), ("body_diameter", foot, {}), ("body_diameter", above, {"at": 0.2 * length})]
    return Scene(
        name="taylor_bar",
        title=f"Copper bar on a rigid anvil, {v:g} m/s",
        source="Johnson and Cook 1983; Zerilli and Armstrong 1987; Johnson and Holmquist 1988",
        solids=[Solid(name="bar", shape=Rod(radius=0.5 * diameter, length=length), material=material, viscous=True)],
        rigids=[ball] if anvil == "ball" else [],
        motions=[plane] if anvil == "plane" else [],
        initial=[InitialVelocity(body="bar", velocity=(0, 0, -v))],
        duration=duration,
        numerics=Numerics(spacing=d),
        output=Output(frames=30, samples=200),
        quantities=[
            Quantity(name=name, unit="m", value=value, tolerance=tolerance * value, source=source, options=options)
            for name, value, options in wanted
        ],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
