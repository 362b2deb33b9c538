"""Two filled tanks side by side, each hit by its own bullet: what each of several bodies does, in one scene.

The tanks of scenes/_tank.py, each with its own water and its own bullet; the second one is hit at `other` m/s, so that the two differ. What
happens in a tank is what happens in it alone: the tanks stand farther apart than their waters can spray in so short a time.

    python scenes/two_tanks.py --quality draft --out DIR
"""

from _tank import HEIGHT, bullet, supports, tank

from taichi_sph.scene import Fluid, Length, Numerics, Output, Quality, Quantity, Scene, ShellFill, Speed

SPACING = {"draft": 20e-3, "standard": 12e-3, "paper": 8.5e-3}  # m, of the shells
PARTICLES = 1.19  # spacing of the waters over that of the shells
APART = 0.4  # m, between the axes
DURATION = {"draft": 5e-4, "standard": 1e-3, "paper": 2.1e-3}  # s


def scene(
    quality: Quality = "draft",
    velocity: Speed = 730.0,
    other: Speed = 500.0,
    spacing: Length | None = None,
    particles: Length | None = None,
) -> Scene:
    d = spacing or SPACING[quality]
    places = {"left": 0.0, "right": APART}
    speeds = {"left": velocity, "right": other}
    wet = {"spacing": particles or PARTICLES * d, "delta": 0.0}
    names = list(places)
    return Scene(
        name="two_tanks",
        title=f"Two filled tanks, hit at {velocity:g} and {other:g} m/s",
        source="T 3.4, twice",
        shells=[tank(True, name, y) for name, y in places.items()],
        rigids=[bullet(speeds[name], f"bullet_{name}", y) for name, y in places.items()],
        fluids=[Fluid(name=f"water_{name}", fill=ShellFill(shell=name), **wet) for name in names],
        motions=[motion for name, y in places.items() for motion in supports(d, name, y)],
        duration=DURATION[quality],
        numerics=Numerics(spacing=d, time_step_safety=0.75),
        output=Output(frames=20, samples=100),
        quantities=[
            *(Quantity(name="time_to_rupture", unit="s", options={"body": name}) for name in names),
            *(Quantity(name="striker_speed", unit="m/s", options={"striker": f"bullet_{name}"}) for name in names),
            *(Quantity(name="leaked_litres", unit="l", options={"fluid": f"water_{name}"}) for name in names),
            *(
                Quantity(name="peak_pressure", unit="Pa", options={"body": f"water_{name}", "x": 0.0, "y": y, "z": 0.5 * HEIGHT})
                for name, y in places.items()
            ),
        ],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
