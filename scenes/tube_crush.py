"""A round aluminium tube crushed between two platens: rings fold outward one after the other, and each comes to lie on the next.

Mean radius 20 mm, thickness 2 mm, length 80 mm, perfectly plastic with 200 MPa; the platens close at 20 m/s, by 45 mm of the 80. Tubes of
2R/e = 20 fold in rings (concertina). With M = sigma e^2 / (2 3^1/2), hinges that do not move (Alexander 1960) give the mean force
M (20.73 (2R/e)^1/2 + 6.28) = 22.9 kN. Abramowicz and Jones 1986 bend the walls between the hinges and let a fold be crushed to
0.86 - 0.568 (e/2R)^1/2 = 0.733 of its length, for the sheet has a thickness: M (20.79 (2R/e)^1/2 + 11.90) / 0.733 = 33.0 kN. So the force
shows how near to each other folds may come: the shell meets itself.

    python scenes/tube_crush.py --quality standard --out DIR
"""

from taichi_sph.scene import (
    Cylinder,
    Dimensionless,
    Driven,
    Length,
    Material,
    Meeting,
    Numerics,
    Output,
    Perfect,
    Pinball,
    Quality,
    Quantity,
    Rigid,
    Scene,
    Shell,
    Speed,
)

RADIUS, THICKNESS, LENGTH = 20e-3, 2e-3, 80e-3  # m
SPACING = {"draft": 2.0, "standard": 4 / 3, "paper": 1.0}  # thicknesses
FLAT = 20.0  # m, radius of a platen's ball: over the tube it is flat within 0.01 mm
FIRST = 5e-3  # m, of the way: the peak, before folds follow each other


def scene(quality: Quality = "draft", speed: Speed = 20.0, way: Length = 45e-3, friction: Dimensionless = 0.0) -> Scene:
    d = SPACING[quality] * THICKNESS
    off = FLAT + 0.5 * THICKNESS + 0.51 * d  # the discs of the rims reach half a spacing beyond their nodes
    aluminium = Material(name="aluminium", young=70e9, poisson=0.3, density=2700.0, strength=Perfect(yield_stress=200e6))
    return Scene(
        name="tube_crush",
        title="Round tube crushed between platens",
        source="Alexander 1960; Abramowicz and Jones 1986",
        quality=quality,
        shells=[
            Shell(
                name="tube",
                surface=Cylinder(radius=RADIUS, length=LENGTH),
                thickness=THICKNESS,
                material=aluminium,
                motion="free",
                self_contact=True,
            )
        ],
        rigids=[
            Rigid(name="floor", mass=1.0, pinballs=[Pinball(centre=(0, 0, -off), radius=FLAT)], held=True),
            Rigid(
                name="platen",
                mass=1.0,
                pinballs=[Pinball(centre=(0, 0, LENGTH + off), radius=FLAT)],
                driven=Driven(velocity=(0, 0, -speed)),
            ),
        ],
        meetings=[Meeting(between=(name, "tube"), friction=friction) for name in ("floor", "platen")],
        duration=way / speed,
        numerics=Numerics(spacing=d),
        output=Output(frames=45, samples=2000),
        quantities=[
            Quantity(
                name="history_mean",
                unit="N",
                value=28e3,
                tolerance=5e3,
                source="between Alexander 1960 and Abramowicz and Jones 1986",
                options={"history": "rigid_platen", "column": "fz", "start": FIRST / speed},
            ),
        ],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
