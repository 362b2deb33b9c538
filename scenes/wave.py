"""A pulse in the plane of a long strip: it splits, meets the free ends and is whole again at the centre (T 4.5.1).

v_x = exp(-1e4 (x - L/2)^2) m/s at the start, nu = 0. Expected: amplitude 1 at the centre at L/c and 2 L/c.

    python scenes/wave.py --quality paper --out DIR
"""

import math
from typing import Literal

from taichi_sph.scene import (
    Collocation,
    FiniteElements,
    Galerkin,
    InitialVelocity,
    Material,
    Numerics,
    Output,
    Plate,
    Probe,
    Pulse,
    Quality,
    Quantity,
    Scene,
    Shell,
    Study,
    Viscosity,
)

SPACING = {"draft": 1.25e-3, "standard": 0.625e-3, "paper": 0.3125e-3}  # m
LENGTH, WIDTH, THICKNESS, WIDTH_OF_PULSE = 60e-3, 5e-3, 1e-3, 10e-3  # m
YOUNG, DENSITY = 210e9, 7800.0


def scene(
    quality: Quality = "draft",
    nodes: Literal["both", "regular", "irregular"] = "both",
    formulation: Literal["both", "galerkin", "collocation", "elements", "elements_1"] = "both",
) -> Scene | Study:
    kinds = ("regular", "irregular") if nodes == "both" else (nodes,)
    forms = ("galerkin", "collocation") if formulation == "both" else (formulation,)
    cases = {f"{form}_{kind}": one(quality, kind, form) for form in forms for kind in kinds}
    if len(cases) == 1:
        return next(iter(cases.values()))
    return Study(name="wave", title="In-plane wave in a strip", source="T 4.5.1", quality=quality, cases=cases)


def one(quality: Quality, nodes: str, formulation: str) -> Scene:
    """One formulation on one set of nodes."""
    # the strong form keeps its energy on a lattice; on moved nodes it makes some, and needs four times the viscosity
    strong = Collocation(viscosity=Viscosity(alpha=0.2)) if nodes == "irregular" else Collocation()
    forms = {"galerkin": Galerkin(), "collocation": strong, "elements": FiniteElements(), "elements_1": FiniteElements(points=1)}
    period = LENGTH / math.sqrt(YOUNG / DENSITY)
    at_centre = {"history": "probe_centre", "column": "v_x"}
    quantities = []
    for number in (1, 2):
        time = number * period
        quantities += [
            Quantity(
                name="pulse_return",
                value=1.0,
                tolerance=0.02,
                source=f"d'Alembert, {number} L/c",
                options={"time": time},
            ),
            Quantity(
                name="peak_time",
                unit="s",
                value=time,
                tolerance=0.01 * period,
                source=f"d'Alembert, {number} L/c",
                options={**at_centre, "start": time - period / 4, "end": time + period / 4},
            ),
        ]
    return Scene(
        name="wave",
        title=f"In-plane wave in a strip, {formulation}, {nodes} nodes",
        source="T 4.5.1",
        shells=[
            Shell(
                name="strip",
                surface=Plate(length=LENGTH, width=WIDTH),
                thickness=THICKNESS,
                material=Material(name="steel", source="T 4.5.1", young=YOUNG, poisson=0.0, density=DENSITY),
            )
        ],
        initial=[InitialVelocity(shell="strip", velocity=(1.0, 0, 0), pulse=Pulse(centre=LENGTH / 2, width=WIDTH_OF_PULSE))],
        duration=2.25 * period,
        numerics=Numerics(
            spacing=SPACING[quality],
            irregularity=0.25 if nodes == "irregular" else 0.0,
            formulation=forms[formulation],
        ),
        output=Output(frames=45, samples=450, probes=[Probe(name="centre", shell="strip", point=(LENGTH / 2, WIDTH / 2, 0))]),
        quantities=quantities,
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
