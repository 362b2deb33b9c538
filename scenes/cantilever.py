"""A cantilever with free edges: a small force at its tip against Timoshenko's beam, or an end moment that rolls it
up into a full circle.

nu = 0, so that the strip is a beam at any width. The force bends it by a thousandth of its thickness; the moment
2 pi E I / L makes of it a circle, whose tip is back at the clamp.

    python scenes/cantilever.py --quality paper --out DIR
    python scenes/cantilever.py --quality paper --set load=moment --set slenderness=3e-4 --out DIR
"""

import math
from typing import Literal

from taichi_sph.scene import (
    Box,
    Dimensionless,
    FiniteElements,
    Galerkin,
    Material,
    NodalForce,
    NodalMoment,
    Numerics,
    Output,
    Plate,
    PrescribedVelocity,
    Quality,
    Quantity,
    Ramp,
    Scene,
    Shell,
    Static,
    Study,
)
from taichi_sph.scene.supports import clamped, held

CELLS = {"draft": 12, "standard": 20, "paper": 39}  # along the length
TOLERANCE = {"draft": 0.06, "standard": 0.03, "paper": 0.02}
TURNS = {"draft": 0.25, "standard": 0.5, "paper": 1.0}  # at most some 10 degrees from cell to cell
LENGTH, YOUNG = 1.0, 210e9
FORMS = {"galerkin": Galerkin(), "elements": FiniteElements(), "elements_1": FiniteElements(points=1)}
SMALL = 1e-3  # deflection over thickness
ROWS = 4  # cells across the strip


def scene(
    quality: Quality = "draft",
    load: Literal["both", "force", "moment"] = "both",
    slenderness: Dimensionless = 0.02,
    turns: Dimensionless = 0.0,
    increments: int = 12,
    nodes: Literal["regular", "irregular"] = "regular",
    cells: Literal["quad", "triangle"] = "quad",
    formulation: Literal["galerkin", "elements", "elements_1"] = "galerkin",
) -> Scene | Study:
    """slenderness: e/L; turns (0: those of the quality) and increments: of the moment. load = "both" goes through
    thicknesses and sets of nodes."""
    turns = turns or TURNS[quality]
    if load != "both":
        return one(quality, load, slenderness, turns, increments, nodes, cells, formulation)
    cases = {}
    for kind in ("regular", "irregular"):
        for ratio in (1e-1, 1e-2, 1e-3, 1e-4):
            cases[f"force_{ratio:g}_{kind}"] = one(quality, "force", ratio, turns, increments, kind, cells, formulation)
        cases[f"circle_{kind}"] = one(quality, "moment", slenderness, turns, increments, kind, cells, formulation)
    return Study(
        name="cantilever",
        title="Cantilever with free edges",
        source="Timoshenko; large rotations of an elastic strip under an end moment",
        quality=quality,
        cases=cases,
    )


def one(quality: Quality, load: str, slenderness: float, turns: float, increments: int, nodes: str, cells: str, formulation: str) -> Scene:
    """One load on one strip."""
    d = LENGTH / CELLS[quality]
    e, width = slenderness * LENGTH, ROWS * d
    stiffness = YOUNG * width * e**3 / 12
    tip = Box(lo=(LENGTH - d / 4, None, None))
    free_end = {"x": LENGTH, "y": width / 2}
    grip = []
    if load == "force":
        deflection = SMALL * e
        compliance = LENGTH**3 / (3 * stiffness) + LENGTH / (5 / 6 * YOUNG / 2 * width * e)
        loads = {"forces": [NodalForce(shell="strip", where=tip, total=(0, 0, deflection / compliance))]}
        static = Static(residual=1e-6)
        wanted = Quantity(
            name="deflection_ratio",
            value=1.0,
            tolerance=TOLERANCE[quality],
            source="Timoshenko's beam",
            options={**free_end, "reference": deflection},
        )
    else:
        angle = 2 * math.pi * turns
        loads = {"moments": [NodalMoment(shell="strip", where=tip, total=(0, -stiffness * angle / LENGTH, 0), history=Ramp(rise=1.0))]}
        # what turns the end turns it about y only; moments alone, each on its node, would twist the corners
        grip = [PrescribedVelocity(shell="strip", where=tip, velocity=(None, None, None), spin=(0, None, 0))]
        static = Static(increments=increments, residual=1e-5)
        wanted = Quantity(
            name="place_error",
            value=0.0,
            tolerance=TOLERANCE[quality],
            source="arc of a circle",
            options={
                **free_end,
                "to_x": LENGTH * math.sin(angle) / angle,
                "to_y": width / 2,
                "to_z": LENGTH * (1 - math.cos(angle)) / angle,
                "over": LENGTH,
            },
        )
    how = f"rolled up, {turns:g} turn{'s' if turns != 1 else ''}" if load == "moment" else "small force"
    return Scene(
        name="cantilever",
        title=f"Cantilever, {how}, e/L = {slenderness:g}, {nodes} nodes",
        source="Timoshenko; large rotations of an elastic strip under an end moment",
        shells=[
            Shell(
                name="strip",
                surface=Plate(length=LENGTH, width=width),
                thickness=e,
                material=Material(name="steel, nu = 0", young=YOUNG, poisson=0.0, density=7800),
                motion="free",
            )
        ],
        motions=[*held("strip", d, [clamped("x", 0.0, "above")]), *grip],
        **loads,
        duration=1.0,
        static=static,
        numerics=Numerics(spacing=d, cells=cells, irregularity=0.25 if nodes == "irregular" else 0.0, formulation=FORMS[formulation]),
        output=Output(frames=static.increments, samples=static.increments, checkpoints=0),
        quantities=[wanted, Quantity(name="relaxation_residual", source="of the load")],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
