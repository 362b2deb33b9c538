"""A cylinder on rigid diaphragms, pinched by two opposite forces: 1.8248e-5 under each of them.

An eighth is computed, up to 40 nodes along the arc. Flügge's series for a thin shell is the reference; a shell with
transverse shear has no finite deflection under a true point force, it grows like F / (2 pi G_s) ln(R / D).

    python scenes/pinched_cylinder.py --quality paper --out DIR
"""

import math
from typing import Literal

from taichi_sph.scene import (
    Ball,
    Cylinder,
    Dimensionless,
    Galerkin,
    Material,
    NodalForce,
    Numerics,
    Output,
    Quality,
    Quantity,
    Scene,
    Shell,
    Static,
    Study,
)
from taichi_sph.scene.supports import Edge, held, symmetry

NODES = {"draft": 16, "standard": 24, "paper": 40}  # along the arc of the eighth, its longer side
TOLERANCE = {"draft": 0.3, "standard": 0.15, "paper": 0.02}
RADIUS, HALF_LENGTH, THICKNESS, FORCE = 300.0, 300.0, 3.0, 1.0
REFERENCE = 1.8248e-5


def scene(
    quality: Quality = "draft",
    nodes: Literal["both", "regular", "irregular"] = "both",
    cells: Literal["quad", "triangle"] = "quad",
    shear_bound: Dimensionless = 0.1,
) -> Scene | Study:
    """shear_bound: alpha of the galerkin form."""
    if nodes != "both":
        return one(quality, nodes, cells, shear_bound)
    cases = {
        "regular": one(quality, "regular", cells, shear_bound),
        "irregular": one(quality, "irregular", cells, shear_bound),
        "triangle_regular": one(quality, "regular", "triangle", shear_bound),
        "triangle_irregular": one(quality, "irregular", "triangle", shear_bound),
    }
    return Study(name="pinched_cylinder", title="Pinched cylinder", source="MacNeal and Harder 1985", quality=quality, cases=cases)


def one(quality: Quality, nodes: str, cells: str, shear_bound: float) -> Scene:
    """One set of nodes."""
    d = RADIUS * math.pi / 2 / (NODES[quality] - 1)
    # x = R, z = 0 under the force; symmetry at y = 0, x = 0 and z = 0, the diaphragm at the end of the axis
    ends = [symmetry("y", 0.0, "above"), symmetry("x", 0.0, "above")]
    rims = [symmetry("z", 0.0, "above"), Edge("z", HALF_LENGTH, "below", (0, 0, None), (None, None, 0))]
    return Scene(
        name="pinched_cylinder",
        title=f"Pinched cylinder, {nodes} {cells}s",
        source="MacNeal and Harder 1985",
        shells=[
            Shell(
                name="wall",
                surface=Cylinder(radius=RADIUS, length=HALF_LENGTH, axis="z", angle=math.pi / 2),
                thickness=THICKNESS,
                material=Material(name="wall", young=3e6, poisson=0.3, density=1000),
                motion="free",
            )
        ],
        motions=held("wall", d, ends, rims),
        forces=[NodalForce(shell="wall", where=Ball(centre=(RADIUS, 0, 0), radius=d / 4), total=(-FORCE / 4, 0, 0))],
        duration=1.0,
        static=Static(residual=1e-5),
        numerics=Numerics(
            spacing=d,
            cells=cells,
            irregularity=0.25 if nodes == "irregular" else 0.0,
            formulation=Galerkin(shear_bound=shear_bound),
        ),
        output=Output(frames=1, samples=1, checkpoints=0),
        quantities=[
            Quantity(
                name="deflection_ratio",
                value=1.0,
                tolerance=TOLERANCE[quality],
                source="1.8248e-5, MacNeal and Harder 1985",
                options={"x": RADIUS, "y": 0.0, "z": 0.0, "axis": "x", "reference": -REFERENCE},
            ),
            Quantity(name="relaxation_residual", source="of the load"),
        ],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
