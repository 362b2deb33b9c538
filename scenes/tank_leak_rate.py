"""How fast does it leak? The filled tank of scenes/tank_leak.py, hit, and watched for all of 20 ms.

By 2.1 ms the crack is open and hardly any water has left: the wave has gone, the walls still move apart. What leaves then is what the blow
set in motion, and then what gravity drives, which is on here: at 2.4 m/s under half the height. T ran its coupled tank as long, for 260
hours.

With `known` the run ends as soon as the rate is known within that share of it (0.2: 20 %), or when nothing is open after the blow; `drag`
and `coupled` as in tank_leak (T 4.6.2).

    python scenes/tank_leak_rate.py --quality draft --set known=0.2 --out DIR
"""

from pathlib import Path
from typing import Literal

from taichi_sph.scene import Dimensionless, LeakKnown, Output, Quality, Quantity, Scene, Speed, load_scene


def scene(
    quality: Quality = "draft",
    velocity: Speed = 730.0,
    drag: Dimensionless | None = None,
    known: Dimensionless = 0.0,
    coupled: bool | Literal["auto"] = False,
) -> Scene:
    said = {"quality": quality, "velocity": velocity, "drag": drag, "coupled": coupled}
    tank = load_scene(Path(__file__).with_name("tank_leak.py"), said)
    return tank.derive(
        name="tank_leak_rate",
        title=f"Tank filled to 100 %, hit at {velocity:g} m/s: 20 ms of its leak" + (", coupled" if coupled else ""),
        duration="20 ms",
        until=LeakKnown(share=known, after="2.1 ms") if known else None,
        gravity=(0, 0, -9.81),
        output=Output(frames=100, samples=400),
        quantities=[
            Quantity(name="leak_rate", unit="l/s"),
            Quantity(name="leaked_litres", unit="l"),
            Quantity(
                name="crack_length", unit="m", options={"how": "longest"}, value=0.6, source="over the height of the front face, Timm 2003"
            ),
        ],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
