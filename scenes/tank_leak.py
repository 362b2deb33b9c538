"""A filled steel tank is hit by a bullet: does it rupture, and how fast does it leak? (T 3.4)

The tank and the bullet of scenes/_tank.py, filled with water (density 1000, sound 1450 m/s, T table 3.2) up to `level` of
its height: 0 empty, 1 full. Cells wider than the sheet is thick spread its neck (`necks`, taichi_sph/laws/necking.py): with the rupture
strain of a point (T) no crack starts at these spacings. Full, the pressure wave of the impact, reflected from the walls, tears the
front face along its height (measured by Timm 2003, computed by T with 19 346 shell nodes and 103 402 particles in 55 hours: wave near
200 bar, bullet at 88 m/s after 2.1 ms, B +3.94 %); empty, there are two holes and no more.

The water is as coarse as the bullet, at every quality. By itself (`drag` 0) it resists by more the coarser it is, and the bullet is
stopped where it is coarse. So it resists by a measured coefficient (Drag; docs/method.md, 11), and the bullet is as fast at every quality:
that of a flat nose, 0.82, by itself, for the bullet of the experiment was flattened (T fig. 3.11) and ours is rigid; a sphere has 0.35. T's
88 m/s come out of plastic blows of balls and were never measured. With `halved` 1 or 2 the water is so many times halved along the bullet's
path (Finer), and resists by itself: what it does so comes nearer to the measured drag. `metal` as in empty_tank: the bullet is a solid of
mild or hard steel that yields, and the water resists by itself.

How far the sheet tears follows from its own spacing and from the viscosity of the water, and hardly from the spacing of the water, which
has most of the nodes. So the coarser qualities coarsen the water first, and its artificial viscosity is that of the finest at all of them.
And the water takes one step in two of the shell's, where it is as coarse as that allows and the structure is one.

`coupled`: finite elements with one point, and particles over the height of the front face, 80 mm to both sides, and within 80 mm of where
the bullet leaves (T 4.6.2: one long crack). They end two elements before the ends of the tank, whose edges no particles can follow. With
`grows` particles stand within 80 mm of both holes at first, and more where damage comes near; with "auto" none before the bullet or damage
comes near.

    python scenes/tank_leak.py --quality draft --out DIR
"""

from typing import Literal

from _tank import HEIGHT, RADIUS, bullet, drags, metal_bullet, supports, tank, tank_of_elements

from taichi_sph.scene import Box, Dimensionless, Finer, Fluid, Numerics, Output, Quality, Quantity, Scene, ShellFill, Speed

SPACING = {"draft": 8.5e-3, "standard": 7e-3, "paper": 6.25e-3}  # m, of the shell; T: 6.25 mm
WATER = {"draft": 14.3e-3, "standard": 10.2e-3, "paper": 7.44e-3}  # m, of the water; T: 1.19 times that of the shell
ALPHA = {"draft": 0.052, "standard": 0.073, "paper": 0.1}  # the same kinematic viscosity alpha c h / 10 of the water
FLAT = 0.82  # drag coefficient of a flat nose in an open cavity (scenes/sphere_entry.py)
ACROSS = {"draft": 3, "standard": 4, "paper": 5}  # cells over the radius of a bullet of metal
EVERY = 2  # steps of the shell in one of the water
OF_METAL = 16  # the same beside a bullet of metal, whose own steps are so much shorter
PATH = 20e-3  # m, half the width of the finest water along the bullet's path, and of what is around it


def scene(
    quality: Quality = "draft",
    level: Dimensionless = 1.0,
    velocity: Speed = 730.0,
    necks: bool = True,
    drag: Dimensionless | None = None,
    halved: int = 0,
    metal: Literal["none", "mild", "hard"] = "none",
    coupled: bool | Literal["auto"] = False,
    grows: bool = False,
) -> Scene:
    if not 0.0 <= level <= 1.0:
        raise ValueError(f"level = {level:g} of the height: give a number from 0 (empty) to 1 (full)")
    if not 0 <= halved <= 2:
        raise ValueError(f"halved = {halved}: the water along the path is halved 0, 1 or 2 times")
    if drag and metal != "none":
        raise ValueError(f"drag = {drag:g}: the law is of a rigid bullet; leave drag or metal out")
    if drag is None:
        drag = 0.0 if halved or metal != "none" else FLAT
    solid, thrown = metal_bullet(metal, velocity, ACROSS[quality]) if metal != "none" else (None, None)
    speed, by = ("striker_speed", {}) if solid is None else ("body_speed", {"body": "bullet"})
    shape = [Quantity(name=name, unit="m", options={"axis": "x", **by}) for name in ("body_length", "body_diameter") if solid]
    if drag and level == 0:
        raise ValueError(f"drag = {drag:g}: the tank is empty; leave drag out, or level")
    if drag is not None and drag < 0:
        raise ValueError(f"drag = {drag:g}: give 0 (by the pressure of the water alone) or more")
    if halved and level <= 0.5:
        raise ValueError(f"halved = {halved}: the bullet flies at half the height, above a level of {level:g}; leave one out")
    if grows and coupled is not True:
        raise ValueError("grows = True: it is the patch of elements and particles that grows; set coupled = True as well, or 'auto' alone")
    d = SPACING[quality]
    sides = [PATH * (halved - k) for k in range(halved)]
    finer = [Finer(within=Box(lo=(None, -side, 0.5 * HEIGHT - side), hi=(None, side, 0.5 * HEIGHT + side))) for side in sides]
    water = Fluid(
        name="water",
        fill=ShellFill(shell="tank", level=level * HEIGHT if level < 1 else None),
        spacing=WATER[quality],
        finer=finer or None,
        every=OF_METAL if solid else None if halved or coupled else EVERY,  # coupled, B of 20 ms would be 0.57 %, and is 0.33
        alpha=ALPHA[quality],
        divergence="mean",  # else 0.3 to 0.6 % of the bullet's energy would come from nowhere, and more at the seams of a patch
        delta=0.0,  # as T: shocks need no diffusion of density, and it would be the largest loss of all
    )
    wet = level > 0
    deep = [Quantity(name=speed, unit="m/s", options={"axis": "x", "beyond": RADIUS - depth, **by}) for depth in (0.1, 0.2)]
    wave = Quantity(
        name="peak_pressure",
        unit="Pa",
        options={"x": 0.0, "z": 0.5 * HEIGHT},
        **({"value": 2e7, "source": "near 200 bar, T 3.4"} if level == 1 else {}),
    )
    return Scene(
        name="tank_leak",
        title=f"Tank {f'filled to {100 * level:g} %' if wet else 'empty'}, hit at {velocity:g} m/s" + (", coupled" if coupled else ""),
        source="T 3.4; experiments of Timm 2003",
        shells=[tank_of_elements(necks, d, grows, filled=wet, auto=coupled == "auto") if coupled else tank(necks)],
        rigids=[] if solid else [bullet(velocity)],
        solids=[solid] if solid else [],
        initial=[thrown] if thrown else [],
        fluids=[water] if wet else [],
        interactions=drags(drag, wet),
        motions=supports(d, reach=max(0.03, 3.01 * d)) if coupled else supports(d),  # one element at least
        duration="2.1 ms" if wet else "0.6 ms",
        # by its pressure, a bullet's entry into the water is what the energy balance misses, in proportion to the step
        numerics=Numerics(spacing=d, time_step_safety=0.75 if wet and not drag else 0.9),
        output=Output(frames=40, samples=210 if wet else 300),
        quantities=[
            Quantity(
                name="crack_length", unit="m", options={"how": "longest"},
                **({"value": 0.6, "source": "over the height of the front face, Timm 2003"} if level == 1 else {}),
            ),
            Quantity(name="time_to_rupture", unit="s"),
            *deep,
            Quantity(name=speed, unit="m/s", value=88.0 if level == 1 else None, source="T 3.4, not measured", options=by),
            *shape,
            *([Quantity(name="leak_rate", unit="l/s"), Quantity(name="leaked_litres", unit="l"), wave] if wet else []),
        ],
    )  # fmt: skip


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
