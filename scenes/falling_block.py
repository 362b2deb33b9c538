"""A flat block strikes a pool of water at rest: the momentum of both, and what the block loses.

The pool floats free, without gravity and walls, so that block and water keep their momentum together, whatever happens. In unbounded
water that pulls as well as it pushes the block would keep m / (m + m_a) of its speed, m_a = 1/2 x 0.579 pi/4 rho a^3 (von Karman 1929,
Blevins 1979); here the relief that comes in from the rim of the face pulls no block back, so it loses more. Contact is by pinballs
alone (T 3.3): its face is rows of balls.

    python scenes/falling_block.py --quality draft --out DIR
"""

from taichi_sph.scene import Fluid, FluidBox, Numerics, Output, Pinball, Quality, Quantity, Rigid, Scene, Speed, Water

ACROSS = {"draft": 6, "standard": 8, "paper": 12}  # spacings over the face
SIDE, SOUND, DENSITY = 0.1, 100.0, 1000.0  # m, m/s, kg/m3
MASS = 4 * DENSITY * SIDE**3  # kg


def scene(quality: Quality = "draft", velocity: Speed = 1.0) -> Scene:
    n = ACROSS[quality]
    d = SIDE / n
    places = [-0.5 * SIDE + (k + 0.5) * d for k in range(n)]
    block = [Pinball(centre=(x, y, 0.5 * d), radius=0.5 * d) for x in places for y in places]
    wide, deep = 2.0 * SIDE, 2.0 * SIDE
    duration = 6 * SIDE / SOUND
    return Scene(
        name="falling_block",
        title="Flat block on a pool",
        source="von Karman 1929; Blevins 1979",
        rigids=[Rigid(name="block", mass=MASS, pinballs=block, velocity=(0, 0, -velocity))],
        fluids=[
            Fluid(
                name="pool",
                fill=FluidBox(lo=(-wide, -wide, -deep), hi=(wide, wide, 0)),
                water=Water(sound=SOUND),
                hydrostatic=False,
                contact="pinballs",
            )
        ],
        duration=duration,
        numerics=Numerics(spacing=d),
        output=Output(frames=30, samples=150),
        quantities=[
            Quantity(name="momentum_drift", value=0.0, tolerance=1e-5, source="Newton"),
            Quantity(name="striker_speed", unit="m/s", options={"striker": "block"}),
        ],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
