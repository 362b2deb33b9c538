"""The critical time step: 2/omega_max of the operator against the step at which random motion begins to grow.

e/D from 1e-3 to 10, nu from 0 to 0.49, nodes moved at random by up to a quarter of the spacing. Expected: the
predicted step is never above the measured limit, and at most 10 % below. Beside it T 2.51, which has no raised
rotary inertia and is for another operator.

    python scenes/critical_step.py --quality paper --out DIR
"""

from typing import Literal

from taichi_sph.scene import (
    Dimensionless,
    FiniteElements,
    Galerkin,
    Material,
    Numerics,
    Output,
    Plate,
    Quality,
    Quantity,
    Scene,
    Shell,
    StepLimit,
    Study,
)

CELLS = {"draft": 10, "standard": 16, "paper": 24}  # a side
THICKNESSES = {"draft": (1e-3, 0.3, 10.0), "standard": (1e-3, 0.1, 1.0, 10.0), "paper": (1e-3, 1e-2, 0.1, 0.3, 1.0, 3.0, 10.0)}
RATIOS = {"draft": (0.3,), "standard": (0.0, 0.49), "paper": (0.0, 0.3, 0.49)}
FORMS = {"galerkin": Galerkin(), "elements": FiniteElements(), "elements_1": FiniteElements(points=1)}
SIDE, YOUNG, DENSITY = 1.0, 210e9, 7800.0


def scene(
    quality: Quality = "draft",
    thickness: Dimensionless = 0.0,
    poisson: Dimensionless = 0.3,
    cells: Literal["quad", "triangle"] = "quad",
    raised_inertia: bool = True,
    formulation: Literal["galerkin", "elements", "elements_1"] = "galerkin",
) -> Scene | Study:
    """thickness: e/D, 0 for a series of them and of Poisson's ratios."""
    if thickness:
        return one(quality, thickness, poisson, cells, raised_inertia, formulation)
    return Study(
        name="critical_step",
        title="Critical time step",
        source="T 2.2.5",
        quality=quality,
        cases={
            f"{e:g}_nu{nu:g}": one(quality, e, nu, cells, raised_inertia, formulation)
            for e in THICKNESSES[quality]
            for nu in RATIOS[quality]
        },
    )


def one(quality: Quality, thickness: float, poisson: float, cells: str, raised_inertia: bool, formulation: str) -> Scene:
    """One thickness e/D and one Poisson's ratio."""
    d = SIDE / CELLS[quality]
    return Scene(
        name="critical_step",
        title=f"Critical time step, e/D = {thickness:g}, nu = {poisson:g}",
        source="T 2.2.5",
        shells=[
            Shell(
                name="plate",
                surface=Plate(length=SIDE, width=SIDE),
                thickness=thickness * d,
                material=Material(name="steel", young=YOUNG, poisson=poisson, density=DENSITY),
                motion="free",
            )
        ],
        duration=1.0,
        limit=StepLimit(),
        numerics=Numerics(spacing=d, cells=cells, irregularity=0.25, formulation=FORMS[formulation], raised_inertia=raised_inertia),
        output=Output(frames=1, samples=1, checkpoints=0),
        quantities=[
            Quantity(
                name="step_ratio",
                value=0.95,
                tolerance=0.05,
                source="predicted over measured: 0.9 to 1",
                options={"rule": "predicted"},
            ),
            Quantity(name="step_ratio", source="T 2.51 over measured", options={"rule": "thesis"}),
        ],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
