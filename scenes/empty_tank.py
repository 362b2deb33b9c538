"""A bullet through an empty steel tank (T 3.4): two holes of the bullet's size, no long crack.

The tank and the bullet of scenes/_tank.py, the bullet at 730 m/s. Cells wider than the sheet is thick spread its neck (`necks`; T: none).
Measured (Timm 2003): about 688 m/s after the front wall,
640 m/s after the back by equal loss of energy; T: 673 and 621 m/s, B -6.1 %.
`coupled`: finite elements with one point, and particles within 80 mm of the two holes (T 4.6.1: 584 m/s, 4.65 times cheaper); with
`grows` fewer at first, and more where damage comes near; "auto": none before the bullet or damage comes near. `metal`: the bullet is a
solid that yields (T fig. 3.11: it was much deformed; T has it rigid), of mild or of hard steel. `across`, `up`: the bullet flies so many
spacings beside the middle, which shows what the place on the lattice decides.

    python scenes/empty_tank.py --quality paper --out DIR
"""

from typing import Literal

from _tank import bullet, metal_bullet, supports, tank, tank_of_elements

from taichi_sph.scene import Dimensionless, Numerics, Output, Quality, Quantity, Scene, Speed

SPACING = {"draft": 10e-3, "standard": 6e-3, "paper": 4.18e-3}  # m; 41 666 nodes for paper, T has 43 006
ACROSS = {"draft": 3, "standard": 5, "paper": 6}  # cells over the radius of a bullet of metal


def scene(
    quality: Quality = "draft",
    velocity: Speed = 730.0,
    necks: bool = True,
    coupled: bool | Literal["auto"] = False,
    grows: bool = False,
    metal: Literal["none", "mild", "hard"] = "none",
    across: Dimensionless = 0.0,
    up: Dimensionless = 0.0,
) -> Scene:
    if not max(abs(across), abs(up)) <= 1.0:
        raise ValueError(f"across = {across:g}, up = {up:g}: spacings from the middle, each from -1 to 1")
    if metal != "none" and (across or up):
        raise ValueError(f"across = {across:g}, up = {up:g}: the bullet of metal flies along the middle; leave them or metal out")
    if grows and coupled is not True:
        raise ValueError("grows = True: it is the patch of elements and particles that grows; set coupled = True as well, or 'auto' alone")
    d = SPACING[quality]
    solid, thrown = metal_bullet(metal, velocity, ACROSS[quality]) if metal != "none" else (None, None)
    speed, by = ("striker_speed", {}) if solid is None else ("body_speed", {"body": "bullet"})
    shape = [Quantity(name=name, unit="m", options={"axis": "x"}) for name in ("body_length", "body_diameter") if solid]
    return Scene(
        name="empty_tank",
        title=f"Bullet through an empty tank, {velocity:g} m/s{', elements and particles' if coupled else ''}",
        source="T 3.4; experiments of Timm 2003",
        shells=[tank_of_elements(necks, d, grows, auto=coupled == "auto") if coupled else tank(necks)],
        rigids=[] if solid else [bullet(velocity, y=across * d, up=up * d)],
        solids=[solid] if solid else [],
        initial=[thrown] if thrown else [],
        motions=supports(d),
        duration="600 us",
        numerics=Numerics(spacing=d),
        output=Output(frames=60, samples=600),
        quantities=[
            Quantity(
                name=speed, unit="m/s", value=688, tolerance=15, source="measured, Timm 2003",
                options={"axis": "x", "beyond": 0.0, **by},
            ),
            Quantity(name=speed, unit="m/s", value=640, tolerance=15, source="derived from it, Timm 2003", options=by),
            Quantity(name="hole_diameter", unit="m", value=18e-3, tolerance=5e-3, source="about the bullet's, Timm 2003"),
            Quantity(name="time_to_rupture", unit="s"),
            *(shape or [Quantity(name="peak_force", unit="N")]),
        ],
    )  # fmt: skip


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
