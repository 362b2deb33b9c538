"""A copper bar strikes a rigid anvil (Taylor 1948): its length, the foot of its mushroom, the bulge above.

"ofhc": 25.4 mm x 7.62 mm at 190 m/s, Johnson and Cook's constants of OFHC copper (1983) with heat, against the measured cylinder (Johnson
and Holmquist 1988): 16.2 mm long, 13.5 mm at the foot, 10.1 mm at 5.08 mm, a fifth of the length, above it. "wilkins": 32.4 mm x 6.4 mm at
227 m/s (the test of Wilkins and Guinan 1973) with the linear hardening on which codes are compared, 400 MPa + 100 MPa x strain: these end
at 21.4 to 21.5 mm with a foot of 7.0 to 7.3 mm radius.

    python scenes/taylor_bar.py --quality draft --out DIR
"""

from typing import Literal

from taichi_sph.scene import (
    Heat,
    InitialVelocity,
    JohnsonCook,
    Material,
    Numerics,
    Output,
    Pinball,
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
CASES = {  # length, diameter [m], speed [m/s], duration [s], material
    "ofhc": (25.4e-3, 7.62e-3, 190.0, 90e-6, OFHC),
    "wilkins": (32.4e-3, 6.4e-3, 227.0, 80e-6, LINEAR),
}


def scene(quality: Quality = "draft", case: Literal["ofhc", "wilkins"] = "ofhc", viscous: bool = True) -> Scene:
    length, diameter, speed, duration, material = CASES[case]
    d = 0.5 * diameter / OVER_RADIUS[quality]
    anvil = 1e3 * diameter  # so large a ball is a plane: the bar sees 2e-3 mm of its height
    if case == "ofhc":
        source = "Johnson and Holmquist 1988, measured"
        wanted = [("body_length", 16.2e-3, {}), ("body_diameter", 13.5e-3, {}), ("body_diameter", 10.1e-3, {"at": 0.2 * length})]
        tolerance = 0.04
    else:
        source = "codes: 21.4 to 21.5 mm, radius 7.0 to 7.3 mm"
        wanted = [("body_length", 21.45e-3, {}), ("body_diameter", 14.3e-3, {})]
        tolerance = 0.02
    return Scene(
        name="taylor_bar",
        title=f"Copper bar on a rigid anvil, {speed:g} m/s",
        source="Johnson and Cook 1983; Johnson and Holmquist 1988; Wilkins and Guinan 1973",
        solids=[Solid(name="bar", shape=Rod(radius=0.5 * diameter, length=length), material=material, viscous=viscous)],
        rigids=[Rigid(name="anvil", mass=1.0, pinballs=[Pinball(centre=(0, 0, -anvil - 1e-6), radius=anvil)], held=True)],
        initial=[InitialVelocity(body="bar", velocity=(0, 0, -speed))],
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
