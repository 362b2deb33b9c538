"""The first six natural frequencies of a square plate, free all round or simply supported, against Mindlin's theory.

e/L = 0.01, nu = 0.3. The matrix of the operator is read off the running force kernels; its lowest modes are found by
Lanczos' iteration.

    python scenes/plate_modes.py --quality paper --out DIR
"""

import math
from typing import Literal

from taichi_sph.scene import FiniteElements, Galerkin, Material, Modes, Numerics, Output, Plate, Quality, Quantity, Scene, Shell, Study
from taichi_sph.scene.supports import Edge, held

CELLS = {"draft": 10, "standard": 20, "paper": 39}  # a side
TOLERANCE = {"draft": 0.08, "standard": 0.03, "paper": 0.02}
FORMS = {"galerkin": Galerkin(), "elements": FiniteElements(), "elements_1": FiniteElements(points=1)}
SIDE, THICKNESS, YOUNG, NU, DENSITY = 1.0, 0.01, 210e9, 0.3, 7800.0
# omega L^2 sqrt(rho e / D): Ritz with Legendre polynomials; Navier's solution, directors held along the edges
# (tests/world/ritz.py finds both)
MINDLIN = {
    "free": (13.4170, 19.5882, 24.2572, 34.6665, 34.6665, 61.0139),
    "supported": (19.7320, 49.3032, 49.3032, 78.8421, 98.5169, 98.5169),
}


def scene(
    quality: Quality = "draft",
    edges: Literal["both", "free", "supported"] = "both",
    nodes: Literal["both", "regular", "irregular"] = "both",
    cells: Literal["quad", "triangle"] = "quad",
    formulation: Literal["galerkin", "elements", "elements_1"] = "galerkin",
) -> Scene | Study:
    kinds = ("regular", "irregular") if nodes == "both" else (nodes,)
    holds = ("free", "supported") if edges == "both" else (edges,)
    cases = {f"{hold}_{kind}": one(quality, hold, kind, cells, formulation) for hold in holds for kind in kinds}
    if len(cases) == 1:
        return next(iter(cases.values()))
    return Study(name="plate_modes", title="Natural modes of a square plate", source="Leissa 1973; Mindlin", quality=quality, cases=cases)


def one(quality: Quality, edges: str, nodes: str, cells: str, formulation: str) -> Scene:
    """One kind of edge on one set of nodes."""
    d = SIDE / CELLS[quality]
    rigidity = YOUNG * THICKNESS**3 / 12 / (1 - NU**2)
    hertz = math.sqrt(rigidity / (DENSITY * THICKNESS)) / SIDE**2 / (2 * math.pi)
    count = len(MINDLIN[edges])
    # simply supported: no deflection, and directors that turn about the edge only
    x, y = (0, None, None), (None, 0, None)
    sides = [Edge("x", 0.0, "above", (None, None, 0), x), Edge("x", SIDE, "below", (None, None, 0), x)]
    ends = [Edge("y", 0.0, "above", (None, None, 0), y), Edge("y", SIDE, "below", (None, None, 0), y)]
    return Scene(
        name="plate_modes",
        title=f"Modes of a square plate, {'edges ' if edges == 'free' else 'simply '}{edges}, {nodes} nodes",
        source="Leissa 1973; Mindlin",
        shells=[
            Shell(
                name="plate",
                surface=Plate(length=SIDE, width=SIDE),
                thickness=THICKNESS,
                material=Material(name="steel", young=YOUNG, poisson=NU, density=DENSITY),
                motion="free",
            )
        ],
        motions=held("plate", d, sides, ends) if edges == "supported" else [],
        duration=float(count),
        modes=Modes(count=count),
        numerics=Numerics(spacing=d, cells=cells, irregularity=0.25 if nodes == "irregular" else 0.0, formulation=FORMS[formulation]),
        output=Output(frames=count, samples=count, checkpoints=0),
        quantities=[
            Quantity(
                name="frequency_ratio",
                value=1.0,
                tolerance=TOLERANCE[quality],
                source="Mindlin's theory",
                options={"mode": k + 1, "reference": factor * hertz},
            )
            for k, factor in enumerate(MINDLIN[edges])
        ],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
