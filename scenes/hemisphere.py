"""A hemisphere with a hole of 18 degrees at its pole, pinched: pulled and pushed by four forces on its free equator.

It bends almost without stretching, and much of it turns like a rigid body, so it tells whether elements lock. Expected: 0.0940
along each force (MacNeal and Harder 1985). A quarter is computed. The thin shell answers a load on a single node too softly where its
shear is bounded (docs/method.md), so the value falls to the reference from above as the nodes come closer.

    python scenes/hemisphere.py --quality paper --out DIR
    python scenes/hemisphere.py --quality paper --set formulation=elements --out DIR
"""

import math
from typing import Literal

from taichi_sph.scene import (
    Ball,
    Box,
    FiniteElements,
    Galerkin,
    Material,
    NodalForce,
    Numerics,
    Output,
    PrescribedVelocity,
    Quality,
    Quantity,
    Scene,
    Shell,
    Sphere,
    Static,
    Study,
)

CELLS = {"draft": 16, "standard": 24, "paper": 40}  # along a quarter of the equator
TOLERANCE = {"draft": 0.15, "standard": 0.06, "paper": 0.02}
RADIUS, THICKNESS, FORCE, REFERENCE = 10.0, 0.04, 1.0, 0.0940  # force: on a quarter, half of the 2 that act
SMALL = 1e-3  # part of the load that is put on: the reference is linear
FORMS = {"galerkin": Galerkin(), "elements": FiniteElements(), "elements_1": FiniteElements(points=1)}


def scene(
    quality: Quality = "draft",
    nodes: Literal["both", "regular", "irregular"] = "both",
    cells: Literal["quad", "triangle"] = "quad",
    formulation: Literal["galerkin", "elements", "elements_1"] = "galerkin",
) -> Scene | Study:
    if nodes == "both":
        cases = {kind: one(quality, kind, cells, formulation) for kind in ("regular", "irregular")}
        return Study(name="hemisphere", title="Pinched hemisphere", source="MacNeal and Harder 1985", quality=quality, cases=cases)
    return one(quality, nodes, cells, formulation)


def one(quality: Quality, nodes: str, cells: str, formulation: str) -> Scene:
    """One set of nodes."""
    d = RADIUS * math.pi / 2 / CELLS[quality]
    near = 0.25 * d

    def plane(axis: int, low: float | None, high: float | None, rises: float | None) -> PrescribedVelocity:
        """Symmetry about axis = 0 between two heights; rises: the velocity along z."""
        lo, hi = [None, None, low], [None, None, high]
        lo[axis], hi[axis] = -near, near
        velocity, spin = [None, None, rises], [0, 0, 0]
        velocity[axis], spin[axis] = 0, None
        return PrescribedVelocity(shell="dome", where=Box(lo=lo, hi=hi), velocity=velocity, spin=spin)

    return Scene(
        name="hemisphere",
        title=f"Pinched hemisphere, {nodes} {cells}s, {formulation}",
        source="MacNeal and Harder 1985",
        shells=[
            Shell(
                name="dome",
                surface=Sphere(radius=RADIUS, top="18 deg", bottom="90 deg", angle="90 deg"),
                thickness=THICKNESS,
                material=Material(name="dome", young=6.825e7, poisson=0.3, density=1000),
                motion="free",
            )
        ],
        # one node is held along z, which no force points along
        motions=[plane(1, near, None, None), plane(1, None, near, 0), plane(0, None, None, None)],
        forces=[
            NodalForce(shell="dome", where=Ball(centre=(RADIUS, 0, 0), radius=near), total=(SMALL * FORCE, 0, 0)),
            NodalForce(shell="dome", where=Ball(centre=(0, RADIUS, 0), radius=near), total=(0, -SMALL * FORCE, 0)),
        ],
        duration=1.0,
        static=Static(residual=1e-5, max_steps=60_000),
        numerics=Numerics(spacing=d, cells=cells, irregularity=0.25 if nodes == "irregular" else 0.0, formulation=FORMS[formulation]),
        output=Output(frames=1, samples=1, checkpoints=0),
        quantities=[
            Quantity(
                name="deflection_ratio",
                value=1.0,
                tolerance=TOLERANCE[quality],
                source="0.0940, MacNeal and Harder 1985",
                options={"x": RADIUS, "y": 0.0, "z": 0.0, "axis": "x", "reference": SMALL * REFERENCE},
            ),
            Quantity(name="relaxation_residual", source="of the load"),
        ],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
