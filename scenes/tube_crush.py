"""A round aluminium tube crushed between two flat platens: rings fold outward one after the other, and each comes to lie on the next.

Mean radius 20 mm, thickness 2 mm, length 80 mm, perfectly plastic with 200 MPa; the platens close at 20 m/s, by 45 mm of the 80. Tubes of
2R/e = 20 fold in rings (concertina). With M = sigma e^2 / (2 3^1/2), hinges that do not move (Alexander 1960) give the mean force
M (20.73 (2R/e)^1/2 + 6.28) = 22.9 kN and folds of 1.905 (2R e)^1/2 = 17.0 mm. Abramowicz and Jones 1986 bend the walls between the
hinges and let a fold be crushed to 0.86 - 0.568 (e/2R)^1/2 = 0.733 of its length, for the sheet has a thickness:
M (20.79 (2R/e)^1/2 + 11.90) / 0.733 = 33.0 kN, and folds of 1.76 (2R e)^1/2 = 15.7 mm. So the force shows how near to each other
folds may come: the shell meets itself.

The rims stand in grooves: they turn, but do not slide. Rims that slide freely on the platens (`slide = true`) flare and curl outward, and
the tube is turned inside out from both ends instead of folding.

    python scenes/tube_crush.py --quality standard --out DIR
"""

from taichi_sph.scene import (
    Box,
    Cylinder,
    Dimensionless,
    Driven,
    Length,
    Material,
    Meeting,
    Numerics,
    Output,
    Perfect,
    Plate,
    PrescribedVelocity,
    Quality,
    Quantity,
    Rigid,
    Scene,
    Shell,
    Speed,
)

RADIUS, THICKNESS, LENGTH = 20e-3, 2e-3, 80e-3  # m
SPACING = {"draft": 2.0, "standard": 4 / 3, "paper": 1.0}  # thicknesses
SIDE = 0.1  # m, of a platen
FIRST = 5e-3  # m, of the way: the peak, before folds follow each other


def scene(
    quality: Quality = "draft", speed: Speed = 20.0, way: Length = 45e-3, slide: bool = False, friction: Dimensionless = 0.0
) -> Scene:
    d = SPACING[quality] * THICKNESS
    low, high = -0.5 * THICKNESS, LENGTH + 0.5 * THICKNESS  # the rims are rounded by half the thickness
    floor = Plate(length=SIDE, width=SIDE, origin=(-0.5 * SIDE, -0.5 * SIDE, low))
    platen = Plate(length=SIDE, width=SIDE, origin=(-0.5 * SIDE, 0.5 * SIDE, high), normal=(0, 0, -1))
    rims = [Box(hi=(None, None, 0.1 * d)), Box(lo=(None, None, LENGTH - 0.1 * d))]
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
            Rigid(name="floor", surface=floor, held=True),
            Rigid(name="platen", surface=platen, driven=Driven(velocity=(0, 0, -speed))),
        ],
        motions=[] if slide else [PrescribedVelocity(body="tube", where=rim, velocity=(0, 0, None)) for rim in rims],
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
            Quantity(
                name="fold_length",
                unit="m",
                value=16.4e-3,
                tolerance=0.65e-3,
                source="between Abramowicz and Jones 1986 and Alexander 1960",
            ),
        ],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
