"""A cylinder on rigid diaphragms, pinched by two opposite forces: 1.8248e-5 under each of them.

An eighth is computed, up to 40 nodes along the arc. 1.8248e-5 is Flügge's series for a thin shell under a true point
force. A shell with transverse shear has no finite deflection there, it grows like F / (2 pi G_s) ln(R / D), and
sooner with bounded shear: on a single node it comes out too large. So the force is also spread over a disc of
R / 10, for which the series of the shell with shear converges (tests/world/ritz.py); that is what must be met.

    python scenes/pinched_cylinder.py --quality paper --out DIR
"""

import math
from typing import Literal

from taichi_sph.scene import (
    Ball,
    Collocation,
    Cylinder,
    Dimensionless,
    FiniteElements,
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
TOLERANCE = {"draft": 0.15, "standard": 0.03, "paper": 0.02}
RADIUS, HALF_LENGTH, THICKNESS, FORCE = 300.0, 300.0, 3.0, 1.0
THIN_POINT = 1.8248e-5
SPREAD = RADIUS / 10  # radius of the disc
MINDLIN_SPREAD = 1.50363e-5


def scene(
    quality: Quality = "draft",
    nodes: Literal["both", "regular", "irregular"] = "both",
    cells: Literal["both", "quad", "triangle"] = "both",
    load: Literal["both", "spread", "point"] = "both",
    formulation: Literal["galerkin", "collocation", "elements", "elements_1"] = "galerkin",
    shear_bound: Dimensionless = 0.1,
) -> Scene | Study:
    """shear_bound: alpha of the galerkin form and of the elements."""
    loads = ("spread", "point") if load == "both" else (load,)
    # the strong form finds no equilibrium on triangles
    shapes = (("quad",) if formulation == "collocation" else ("quad", "triangle")) if cells == "both" else (cells,)
    kinds = ("regular", "irregular") if nodes == "both" else (nodes,)
    form = {
        "galerkin": Galerkin(shear_bound=shear_bound),
        "collocation": Collocation(),
        "elements": FiniteElements(shear_bound=shear_bound),
        "elements_1": FiniteElements(points=1, shear_bound=shear_bound),
    }[formulation]
    cases = {f"{how}_{shape}_{kind}": one(quality, how, kind, shape, form) for how in loads for shape in shapes for kind in kinds}
    if len(cases) == 1:
        return next(iter(cases.values()))
    return Study(name="pinched_cylinder", title="Pinched cylinder", source="MacNeal and Harder 1985", quality=quality, cases=cases)


def one(quality: Quality, load: str, nodes: str, cells: str, formulation: Galerkin | Collocation | FiniteElements) -> Scene:
    """One load on one set of nodes."""
    d = RADIUS * math.pi / 2 / (NODES[quality] - 1)
    # x = R, z = 0 under the force; symmetry at y = 0, x = 0 and z = 0, the diaphragm at the end of the axis
    ends = [symmetry("y", 0.0, "above"), symmetry("x", 0.0, "above")]
    if load == "spread":
        reach, reference, source = SPREAD, MINDLIN_SPREAD, "1.5036e-5, series of the shell with shear"
    else:
        reach, reference, source = d / 4, THIN_POINT, "1.8248e-5, thin shell, MacNeal and Harder 1985"
    rims = [symmetry("z", 0.0, "above"), Edge("z", HALF_LENGTH, "below", (0, 0, None), (None, None, 0))]
    return Scene(
        name="pinched_cylinder",
        title=f"Pinched cylinder, {load} force, {nodes} {cells}s",
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
        forces=[NodalForce(shell="wall", where=Ball(centre=(RADIUS, 0, 0), radius=reach), total=(-FORCE / 4, 0, 0))],
        duration=1.0,
        static=Static(residual=1e-5) if formulation.kind != "collocation" else Static(residual=1e-4, max_steps=60_000),
        numerics=Numerics(
            spacing=d,
            cells=cells,
            irregularity=0.25 if nodes == "irregular" else 0.0,
            formulation=formulation,
        ),
        output=Output(frames=1, samples=1, checkpoints=0),
        quantities=[
            Quantity(
                name="deflection_ratio",
                value=1.0,
                tolerance=TOLERANCE[quality],
                source=source,
                options={"x": RADIUS, "y": 0.0, "z": 0.0, "axis": "x", "reference": -reference},
            ),
            Quantity(name="relaxation_residual", source="of the load"),
        ],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
