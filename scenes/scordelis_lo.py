"""The Scordelis-Lo roof: a barrel vault on end diaphragms under its own weight, free along its sides.

Expected: 0.3024 downwards at the middle of the free edge. A quarter is computed, up to 40 nodes along its straight side.

    python scenes/scordelis_lo.py --quality paper --out DIR
"""

import math
from typing import Literal

from taichi_sph.scene import (
    Collocation,
    FiniteElements,
    Galerkin,
    Material,
    Numerics,
    Output,
    Quality,
    Quantity,
    Roof,
    Scene,
    Shell,
    Static,
    Study,
)
from taichi_sph.scene.supports import Edge, held, symmetry

NODES = {"draft": 14, "standard": 20, "paper": 40}  # along the longer side of the quarter, the straight one
TOLERANCE = {"draft": 0.06, "standard": 0.03, "paper": 0.02}
RADIUS, HALF_LENGTH, HALF_ANGLE, THICKNESS = 25.0, 25.0, math.radians(40), 0.25
LOAD, DENSITY = 90.0, 360.0  # weight per area; mass per volume, which does not matter
REFERENCE = 0.3024
FORMS = {"galerkin": Galerkin(), "collocation": Collocation(), "elements": FiniteElements(), "elements_1": FiniteElements(points=1)}
SMALL = 1e-3  # part of the load that is put on: the reference is linear, and 0.3024 is more than the thickness


def scene(
    quality: Quality = "draft",
    nodes: Literal["both", "regular", "irregular"] = "both",
    cells: Literal["quad", "triangle"] = "quad",
    formulation: Literal["galerkin", "collocation", "elements", "elements_1"] = "galerkin",
) -> Scene | Study:
    if nodes == "both":
        cases = {kind: one(quality, kind, cells, NODES[quality], formulation) for kind in ("regular", "irregular")}
        if formulation != "collocation":  # the strong form finds no equilibrium on triangles
            cases["triangle"] = one(quality, "irregular", "triangle", NODES[quality], formulation)
        return Study(
            name="scordelis_lo",
            title="Scordelis-Lo roof",
            source="Scordelis and Lo 1964; MacNeal and Harder 1985",
            quality=quality,
            cases=cases,
        )
    return one(quality, nodes, cells, NODES[quality], formulation)


def one(quality: Quality, nodes: str, cells: str, number: int, formulation: str) -> Scene:
    """One set of nodes, `number` of them along the straight side."""
    d = HALF_LENGTH / (number - 1)
    return Scene(
        name="scordelis_lo",
        title=f"Scordelis-Lo roof, {nodes} {cells}s",
        source="Scordelis and Lo 1964; MacNeal and Harder 1985",
        shells=[
            Shell(
                name="roof",
                surface=Roof(radius=RADIUS, length=HALF_LENGTH, half_angle=HALF_ANGLE, start_angle=0.0),
                thickness=THICKNESS,
                material=Material(name="roof", young=4.32e8, poisson=0.0, density=DENSITY),
                motion="free",
            )
        ],
        # the middle of the roof at x = 0, its crown at y = 0; the diaphragm keeps its shape
        motions=held(
            "roof",
            d,
            [symmetry("x", 0.0, "above"), Edge("x", HALF_LENGTH, "below", (None, 0, 0), (0, None, None))],
            [symmetry("y", 0.0, "above")],
        ),
        gravity=(0, 0, -SMALL * LOAD / (DENSITY * THICKNESS)),
        duration=1.0,
        # soft modes of the strong form settle slowly
        static=Static(residual=1e-5) if formulation != "collocation" else Static(residual=1e-3, max_steps=60_000),
        numerics=Numerics(
            spacing=d,
            cells=cells,
            irregularity=0.25 if nodes == "irregular" else 0.0,
            formulation=FORMS[formulation],
        ),
        output=Output(frames=1, samples=1, checkpoints=0),
        quantities=[
            Quantity(
                name="deflection_ratio",
                value=1.0,
                tolerance=TOLERANCE[quality],
                source="0.3024, MacNeal and Harder 1985",
                options={
                    "x": 0.0,
                    "y": RADIUS * math.sin(HALF_ANGLE),
                    "z": RADIUS * math.cos(HALF_ANGLE),
                    "reference": -SMALL * REFERENCE,
                },
            ),
            Quantity(name="relaxation_residual", source="of the load"),
        ],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
