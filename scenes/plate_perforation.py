"""A hemispherical striker through a thin steel plate (T 2.4.5): petals when slow, a plug when fast.

Plate of 30 mm clamped on its three outer rows, striker of 22 mm and 154 g as one pinball, no friction. Johnson-Cook with
Lemaitre-Chaboche damage and delay, T table 2.8. The plug of T (of the finite elements of Rusinek et al. in brackets): none at 40 and 50
m/s, none (4.8 mm) at 75 m/s, which T lays to too few nodes, 8.5 mm (9.9) at 150 m/s, 13 mm (12) at 300 m/s; balance of energy of T
-3.76 to -0.2 %.

    python scenes/plate_perforation.py --quality paper --set velocity=150 --out DIR
"""

from taichi_sph.scene import (
    Ball,
    Delay,
    Disc,
    Numerics,
    Output,
    Outside,
    Pinball,
    PrescribedVelocity,
    Quality,
    Quantity,
    Rigid,
    Scene,
    Shell,
    Speed,
    material,
)

SPACING = {"draft": 1e-3, "standard": 0.5e-3, "paper": 0.25e-3}  # m; 13 161 nodes for paper, T has 12 892
RADIUS, THICKNESS, STRIKER = 15e-3, 0.8e-3, 11e-3  # m
PLUG = {40.0: 0.0, 50.0: 0.0, 75.0: 4.8e-3, 150.0: 9.9e-3, 300.0: 12e-3}  # m, Rusinek et al. by finite elements
FAST = 200.0  # m/s, from which on T takes a tenth of the delay


def scene(quality: Quality = "draft", velocity: Speed = 75.0) -> Scene:
    d = SPACING[quality]
    steel = material("steel, perforated plate")
    if velocity > FAST:
        steel = steel.model_copy(update={"delay": Delay(a=1, tau_c="0.001 us")})
    top = STRIKER + 0.5 * THICKNESS
    travel = 24e-3 if velocity < 100 else 30e-3  # m, of the striker: through, and well beyond
    rim = Outside(of=Ball(centre=(0, 0, 0), radius=RADIUS - 2.5 * d))
    plug = PLUG.get(velocity)
    return Scene(
        name="plate_perforation",
        title=f"Hemisphere through a plate, {velocity:g} m/s",
        source="T 2.4.5; experiments of Rusinek et al. 2009",
        shells=[
            Shell(name="plate", surface=Disc(radius=RADIUS), thickness=THICKNESS, material=steel, motion="free"),
        ],
        rigids=[
            Rigid(
                name="striker",
                mass=0.154,
                pinballs=[Pinball(centre=(0, 0, top + 1e-6), radius=STRIKER)],
                velocity=(0, 0, -velocity),
            )
        ],
        motions=[PrescribedVelocity(shell="plate", where=rim, velocity=(0, 0, 0), spin=(0, 0, 0))],
        duration=travel / velocity,
        numerics=Numerics(spacing=d),
        output=Output(frames=60, samples=600),
        quantities=[
            Quantity(name="time_to_rupture", unit="s"),
            Quantity(
                name="plug_diameter",
                unit="m",
                value=plug,
                tolerance=None if plug is None else 2e-3,
                source="Rusinek et al. 2009 in T table 2.9",
            ),
            Quantity(name="striker_energy_lost", unit="J"),
            Quantity(name="striker_speed", unit="m/s"),
            Quantity(name="peak_force", unit="N"),
            Quantity(name="petals"),
        ],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
