"""A clamped square plate under pressure, from thick to very thin: does the shell lock? (T 2.2.6, figs 2.4 and 2.6)

The deflection at the middle over that of Mindlin's theory, for e/L from 1e-1 to 1e-4, on regular nodes and on nodes
moved at random by up to a quarter of the spacing; and the order of convergence, at 1e-3. The thesis locks beyond
L/e of 100 to 1000, even stabilised. Its own form (formulation = collocation) is loaded by forces on the nodes: a
pressure is one of the other forms. Thinner than e/L = 1e-3 it finds no equilibrium. Finite elements on the same nodes,
with four stress points or with one: formulation = elements, elements_1.

    python scenes/clamped_plate.py --quality paper --out DIR
    python scenes/clamped_plate.py --quality paper --set slenderness=1e-4 --set nodes=irregular --out DIR
"""

from typing import Literal

from taichi_sph.scene import (
    Box,
    Collocation,
    Convergence,
    Dimensionless,
    FiniteElements,
    Galerkin,
    Material,
    NodalForce,
    Numerics,
    Output,
    Plate,
    Quality,
    Quantity,
    Scene,
    Shell,
    Static,
    Study,
    SurfacePressure,
)
from taichi_sph.scene.supports import clamped, held

NODES = {"draft": 12, "standard": 20, "paper": 40}  # a side
SERIES = {"draft": (6, 8, 12), "standard": (8, 12, 20), "paper": (10, 20, 40)}  # for the order of convergence
TOLERANCE = {"draft": 0.06, "standard": 0.03, "paper": 0.02}
SIDE, YOUNG, NU = 1.0, 210e9, 0.3
# w D / (q L^4) at the middle, nu 0.3, shear factor 5/6: Ritz, 20 x 20 Legendre polynomials (tests/world/ritz.py)
MINDLIN = {1e-1: 1.504626e-3, 1e-2: 1.267857e-3, 1e-3: 1.265345e-3, 1e-4: 1.265319e-3}
FORMS = {"galerkin": Galerkin(), "collocation": Collocation(), "elements": FiniteElements(), "elements_1": FiniteElements(points=1)}
SMALL = 1e-3  # deflection over thickness: the plate stays linear


def scene(
    quality: Quality = "draft",
    slenderness: Dimensionless = 0.0,
    nodes: Literal["regular", "irregular"] = "regular",
    cells: Literal["quad", "triangle"] = "quad",
    formulation: Literal["galerkin", "collocation", "elements", "elements_1"] = "galerkin",
) -> Scene | Study:
    """slenderness: e/L, 0 for all of them on both sets of nodes."""
    if slenderness:
        return one(quality, slenderness, nodes, cells, formulation, NODES[quality])
    cases, orders = {}, []
    for kind in ("regular", "irregular"):
        for ratio in MINDLIN:
            cases[f"{ratio:g}_{kind}"] = one(quality, ratio, kind, cells, formulation, NODES[quality])
        series = []
        for number in SERIES[quality]:
            name = f"0.001_{kind}" if number == NODES[quality] else f"0.001_{kind}_{number}"
            cases.setdefault(name, one(quality, 1e-3, kind, cells, formulation, number))
            series.append(name)
        orders.append(Convergence(name=kind, quantity="deflection_ratio", cases=series, least=1.8, source="e/L = 1e-3"))
    return Study(
        name="clamped_plate",
        title="Clamped plate under pressure",
        source="T 2.2.6",
        quality=quality,
        cases=cases,
        orders=orders,
    )


def one(quality: Quality, slenderness: float, nodes: str, cells: str, formulation: str, number: int) -> Scene:
    """One thickness on one set of nodes, `number` of them a side."""
    known = min(MINDLIN, key=lambda s: abs(s / slenderness - 1))
    if abs(known / slenderness - 1) > 1e-6:
        raise ValueError(f"slenderness {slenderness:g}: theory is known for {', '.join(f'{s:g}' for s in MINDLIN)}")
    d = SIDE / (number - 1)
    e = slenderness * SIDE
    deflection = SMALL * e
    rigidity = YOUNG * e**3 / 12 / (1 - NU**2)
    pressure = deflection * rigidity / (MINDLIN[known] * SIDE**4)
    edges = [[clamped(axis, 0.0, "above"), clamped(axis, SIDE, "below")] for axis in ("x", "y")]
    middle = {"x": SIDE / 2, "y": SIDE / 2}
    if formulation != "collocation":
        load = {"pressures": [SurfacePressure(shell="plate", value=pressure, kind="dead")]}
        static = Static(residual=1e-6)
    else:
        load = {"forces": [NodalForce(shell="plate", where=Box(), total=(0, 0, pressure * SIDE**2))]}
        static = Static(residual=1e-4, max_steps=60_000)  # what settles at all settles within half of these
    return Scene(
        name="clamped_plate",
        title=f"Clamped plate under pressure, e/L = {slenderness:g}, {number} {nodes} nodes a side",
        source="T 2.2.6",
        shells=[
            Shell(
                name="plate",
                surface=Plate(length=SIDE, width=SIDE),
                thickness=e,
                material=Material(name="steel", young=YOUNG, poisson=NU, density=7800),
                motion="free",
            )
        ],
        motions=held("plate", d, *edges),
        **load,
        duration=1.0,
        static=static,
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
                tolerance=TOLERANCE[quality] if number == NODES[quality] else None,
                source="Mindlin's theory",
                options={**middle, "reference": deflection},
            ),
            Quantity(name="relaxation_residual", source="of the load"),
        ],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
