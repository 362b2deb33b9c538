"""A pre-cracked plate under a step of traction: one crack runs, then branches (T 2.4.3, figs 2.20 to 2.22).

Half of the plate's length is cut at mid-height; 1 MPa pulls on the three outermost rows of nodes at the top
and bottom from t = 0 on. Expected: the crack sets off, its speed rises to a plateau near 20 us, it splits in
two branches that are symmetric about the mid-plane and reach the edge near 56 us, always slower than Rayleigh
waves (2100 m/s).

    python scenes/crack_branching.py --quality standard --set a=8 --out DIR
"""

from typing import Literal

from taichi_sph.scene import (
    Box,
    Cut,
    Delay,
    Dimensionless,
    Material,
    Mazars,
    NodalForce,
    Numerics,
    Plate,
    Quality,
    Quantity,
    Scene,
    Shell,
    Time,
)

# rows of cells over the height, an even number, so that one of nodes is cut; paper: 17 200 nodes. The crack does not
# branch below 64 rows, and only late below 74: the draft is as coarse as it may be
ROWS = {"draft": 74, "standard": 76, "paper": 80}
LENGTH, HEIGHT, THICKNESS = 0.100, 0.040, 0.004  # m
TRACTION = 1.0e6  # Pa


def scene(
    quality: Quality = "draft",
    a: Dimensionless = 10.0,
    tau_c: Time = 1e-6,
    formulation: Literal["galerkin", "collocation"] = "galerkin",
) -> Scene:
    d = HEIGHT / ROWS[quality]
    # A node stands for the material half a spacing around it: 200 x 86 nodes at 0.5 mm, the six rows that
    # carry the load lie outside the 40 mm.
    plate = Plate(
        length=LENGTH - d,
        width=HEIGHT + 5 * d,
        origin=(d / 2, -HEIGHT / 2 - 2.5 * d, 0),
    )
    concrete = Material(
        name="concrete",
        source="T table 2.6",
        young="32 GPa",
        poisson=0.2,
        density=2450,
        damage=Mazars(threshold=8.5e-5, A=1, B=7300),
        delay=Delay(a=a, tau_c=tau_c),
        critical_damage=0.99,
    )
    pull = TRACTION * LENGTH * THICKNESS
    return Scene(
        name="crack_branching",
        title="Crack branching in a pre-cracked plate",
        source="T 2.4.3",
        shells=[
            Shell(
                name="plate",
                surface=plate,
                thickness=THICKNESS,
                material=concrete,
                cuts=[Cut(start=(0, 0, 0), end=(LENGTH / 2, 0, 0))],
            )
        ],
        forces=[
            NodalForce(shell="plate", where=Box(lo=(None, HEIGHT / 2, None)), total=(0, pull, 0)),
            NodalForce(shell="plate", where=Box(hi=(None, -HEIGHT / 2, None)), total=(0, -pull, 0)),
        ],
        duration="80 us",
        numerics=Numerics(spacing=d, formulation=formulation),
        quantities=[
            Quantity(name="branch_count", value=2, tolerance=0, source="T fig. 2.21"),
            Quantity(name="edge_arrival", unit="s", value=56e-6, tolerance=6e-6, source="T fig. 2.22"),
            Quantity(name="tip_speed_plateau", unit="m/s", source="T fig. 2.22: below Rayleigh, 2100 m/s"),
            Quantity(name="asymmetry", value=0, tolerance=0.05, source="T fig. 2.21"),
        ],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
