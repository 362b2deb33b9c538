"""A steel ogive of 15 g strikes a concrete slab: how deep does it go, how wide is the crater? (P 4.2, table 3; Zhang et al. 2005)

The slab is 300 x 170 x 150 mm, struck in the middle at right angles, free all round: no wave comes back before the ogive rests. Measured at
664 m/s: 31.75 mm deep, a crater of 63.5 mm; P computes 33 and 61.6 mm. The modified formula of the NDRC (Kennedy 1976) gives 31.7 mm.

Concrete: 19.3 MPa in tension, 115 in compression, delay 8 us (P); A = 1, B = 0.62 / eps_D, D_c = 0.99 and the strain of de Vree are ours,
for P does not give them. The ogive is rigid, of calibre 12.6 mm, CRH 2.5: a nose of 18.9 mm and the shank that 15 g of steel leave. It
slides without friction, for none is given; `friction` is another one. `compression` is another strength, and that in tension goes with it.

A cell whose damage is complete and that has opened by half ruptures; one under pressure stays, as rubble that rubs. Cells right before the
point would be pressed flat, where concrete flows aside: a hole of 0.6 mm along the line of flight lets them part (`pilot`, half of that).
A cell that is pressed to 0.15 of its length ruptures all the same. These are choices; docs/method.md says what others give. Nodes without
cells fly on, and the ogive meets them.

A quarter is computed, between two planes of symmetry, with cells that grow away from the impact. P couples elements and particles
(Arlequin); one graded solid does the same here.

    python scenes/slab_penetration.py --quality draft --out DIR
"""

from taichi_sph.scene import (
    Box,
    Brick,
    Bullet,
    Concrete,
    Delay,
    Dimensionless,
    Grading,
    Length,
    Material,
    Meeting,
    Numerics,
    Output,
    Pilot,
    PrescribedVelocity,
    Pressure,
    Quality,
    Quantity,
    Rigid,
    Scene,
    Solid,
    Speed,
    Time,
)

LENGTH, WIDTH, DEPTH = 300e-3, 170e-3, 150e-3  # m
CALIBRE, CRH, SHANK, MASS = 12.6e-3, 2.5, 5e-3, 15e-3  # m, -, m, kg
YOUNG, TENSION, COMPRESSION = 30e9, 19.3e6, 115e6  # Pa
MEASURED, MEASURED_DEPTH, MEASURED_CRATER = 664.0, 31.75e-3, 63.5e-3  # m/s, m, m
ACROSS = {"draft": 4, "standard": 6, "paper": 8}  # cells over the calibre
FINE, GROWTH, LARGEST = (42e-3, 42e-3, 48e-3), 1.2, 10e-3  # m from the point of impact, -, m
REACH = 14e-3  # m from the line of flight, within which cells are drawn towards the hole
GAP = 1e-5  # m


def ndrc(velocity: float, compression: float) -> float:
    """Depth [m] by the modified formula of the National Defense Research Committee, a sharp nose (Kennedy 1976, in SI units)."""
    g = 3.8e-5 * 1.14 * MASS / (CALIBRE * compression**0.5) * (velocity / CALIBRE) ** 1.8
    return CALIBRE * (g + 1.0 if g > 1.0 else 2.0 * g**0.5)


def scene(
    quality: Quality = "draft",
    velocity: Speed = MEASURED,
    compression: Pressure = COMPRESSION,
    tau_c: Time = 8e-6,
    friction: Dimensionless = 0.0,
    pilot: Length = 0.3e-3,
    flattest: Dimensionless = 0.15,
    loosest: Dimensionless = 1.5,
    spacing: Length | None = None,
    duration: Time = 150e-6,
) -> Scene:
    for name, value, unit in (("velocity", velocity, "m/s"), ("compression", compression, "Pa"), ("tau_c", tau_c, "s")):
        if not value > 0.0:
            raise ValueError(f"{name} = {value:g} {unit}: give more than 0")
    if not 0.0 <= pilot:
        raise ValueError(f"pilot = {pilot:g} m: give half the width of the hole, or 0 for none")
    d = CALIBRE / ACROSS[quality] if spacing is None else spacing
    if not d > 0.0:
        raise ValueError(f"spacing = {d:g} m: give more than 0, or leave it out for {1e3 * CALIBRE / ACROSS[quality]:.3g} mm")
    nose = Bullet(radius=0.5 * CALIBRE, length=SHANK, crh=CRH).nose
    tension = TENSION * compression / COMPRESSION
    concrete = Material(
        name="concrete",
        source="P table 3",
        young=YOUNG,
        poisson=0.22,
        density=2300,
        damage=Concrete(tension=tension, compression=compression, A=1.0, B=0.62 * YOUNG / tension, flattest=flattest, loosest=loosest),
        delay=Delay(a=1, tau_c=tau_c),
        critical_damage=0.99,
    )
    slab = Solid(
        name="slab",
        shape=Brick(
            size=(0.5 * LENGTH, 0.5 * WIDTH, DEPTH),
            origin=(0, 0, -DEPTH),
            graded=Grading(lo=(None, None, -FINE[2]), hi=(FINE[0], FINE[1], None), growth=GROWTH, largest=max(LARGEST, d)),
            pilot=Pilot(radius=pilot, reach=REACH) if pilot else None,
        ),
        material=concrete,
        viscous=True,
    )
    ogive = Rigid(
        name="ogive",
        surface=Bullet(radius=0.5 * CALIBRE, length=SHANK, crh=CRH, turned=True, origin=(0, 0, SHANK + nose + GAP)),
        spacing=1e-3,
        mass=0.25 * MASS,  # of a quarter
        velocity=(0, 0, -velocity),
        slides="z",
    )
    near = 1e-6
    planes = [
        ((None, near, None), (near, None, None), (0, None, None)),
        ((near, None, None), (None, near, None), (None, 0, None)),
        *([] if pilot else [((None, None, None), (near, near, None), (0, 0, None))]),
    ]
    measured = velocity == MEASURED and compression == COMPRESSION
    formula = f"modified NDRC (Kennedy 1976): {1e3 * ndrc(velocity, compression):.1f} mm"
    return Scene(
        name="slab_penetration",
        title=f"A steel ogive into a concrete slab, {velocity:g} m/s",
        source="P 4.2, table 3; Zhang, Shim, Lu and Chew 2005",
        quality=quality,
        solids=[slab],
        rigids=[ogive],
        meetings=[Meeting(between=("ogive", "slab"), friction=friction)] if friction else [],
        motions=[PrescribedVelocity(body="slab", where=Box(lo=lo, hi=hi), velocity=v) for lo, hi, v in planes],
        duration=duration,
        numerics=Numerics(spacing=d, contact={"tolerance": 1e-3}),
        output=Output(frames=30, samples=300),
        quantities=[
            Quantity(
                name="penetration_depth", unit="m", value=MEASURED_DEPTH if measured else None,
                tolerance=0.1 * MEASURED_DEPTH if measured else None,
                source=f"Zhang et al. 2005, measured; {formula}" if measured else formula,
            ),
            Quantity(
                name="crater_diameter", unit="m", value=MEASURED_CRATER if measured else None,
                tolerance=0.1 * MEASURED_CRATER if measured else None, source="Zhang et al. 2005, measured" if measured else "",
            ),
            Quantity(name="striker_speed", unit="m/s"),
        ],
    )  # fmt: skip


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
