"""A bullet through an empty steel tank (T 3.4): two holes of the bullet's size, no long crack.

The tank and the bullet of scenes/_tank.py, the bullet at 730 m/s. Cells wider than the sheet is thick spread its neck (`necks`; T: none).
Measured (Timm 2003): about 688 m/s after the front wall,
640 m/s after the back by equal loss of energy; T: 673 and 621 m/s, B -6.1 %.
`coupled`: finite elements with one point, and particles within 80 mm of the two holes (T 4.6.1: 584 m/s, 4.65 times cheaper); with
`grows` fewer at first, and more where damage comes near.

    python scenes/empty_tank.py --quality paper --out DIR
"""

from _tank import bullet, supports, tank, tank_of_elements

from taichi_sph.scene import Numerics, Output, Quality, Quantity, Scene, Speed

SPACING = {"draft": 10e-3, "standard": 6e-3, "paper": 4.18e-3}  # m; 41 666 nodes for paper, T has 43 006


def scene(quality: Quality = "draft", velocity: Speed = 730.0, necks: bool = True, coupled: bool = False, grows: bool = False) -> Scene:
    if grows and not coupled:
        raise ValueError("grows = True: it is the patch of elements and particles that grows; set coupled = True as well")
    d = SPACING[quality]
    return Scene(
        name="empty_tank",
        title=f"Bullet through an empty tank, {velocity:g} m/s{', elements and particles' if coupled else ''}",
        source="T 3.4; experiments of Timm 2003",
        shells=[tank_of_elements(necks, d, grows) if coupled else tank(necks)],
        rigids=[bullet(velocity)],
        motions=supports(d),
        duration="600 us",
        numerics=Numerics(spacing=d),
        output=Output(frames=60, samples=600),
        quantities=[
            Quantity(
                name="striker_speed", unit="m/s", value=688, tolerance=15, source="measured, Timm 2003",
                options={"axis": "x", "beyond": 0.0},
            ),
            Quantity(name="striker_speed", unit="m/s", value=640, tolerance=15, source="derived from it, Timm 2003"),
            Quantity(name="hole_diameter", unit="m", value=18e-3, tolerance=5e-3, source="about the bullet's, Timm 2003"),
            Quantity(name="time_to_rupture", unit="s"),
            Quantity(name="peak_force", unit="N"),
        ],
    )  # fmt: skip


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
