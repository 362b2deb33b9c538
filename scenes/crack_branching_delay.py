"""Does crack branching depend on the parameters of the damage delay? Nine runs of crack_branching (T 2.4.4, table 2.7)

The delay's a and tau_c are changed by 10 and 20 %, one at a time. Expected: propagation and bifurcation do not change, the
shape of the branches does slightly; a larger tau_c acts like a smaller a: both lengthen the damaged zone, and then more
breaks between the branches, in the thesis too.

    python scenes/crack_branching_delay.py --quality standard --out DIR
"""

from pathlib import Path
from typing import Literal

from taichi_sph.scene import Quality, Quantity, Study, load_scene

DELAYS = [(10, 0.8), (10, 0.9), (10, 1.0), (10, 1.1), (10, 1.2), (8, 1.0), (9, 1.0), (11, 1.0), (12, 1.0)]  # a, tau_c [us]
EXTREMES = [(10, 0.8), (10, 1.2), (8, 1.0), (12, 1.0)]
QUANTITIES = [
    Quantity(name="branch_count", value=2, tolerance=0, source="T fig. 2.23"),
    Quantity(name="bifurcation_length", unit="m", source="T fig. 2.23: unchanged"),
    Quantity(name="tip_speed_plateau", unit="m/s", source="T fig. 2.23: unchanged"),
    Quantity(name="asymmetry", value=0, tolerance=0.05, source="T fig. 2.23"),
]


def scene(quality: Quality = "draft", formulation: Literal["galerkin", "collocation"] = "galerkin") -> Study:
    cases = {}
    for a, tau_c in EXTREMES if quality == "draft" else DELAYS:
        case = load_scene(
            Path(__file__).with_name("crack_branching.py"),
            {"quality": quality, "a": a, "tau_c": f"{tau_c} us", "formulation": formulation},
        )
        cases[f"a{a}-tau{tau_c:.1f}us"] = case.derive(
            title=f"{case.title}, a = {a}, τ = {tau_c:g} µs", quantities=[q.model_dump() for q in QUANTITIES]
        )
    return Study(
        name="crack_branching_delay",
        title="Crack branching under other delays of damage",
        source="T 2.4.4, table 2.7",
        quality=quality,
        cases=cases,
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
