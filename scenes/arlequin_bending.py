"""A cantilever of finite elements and particles under a force at its end (T 4.5.3): translations and directors are tied, and nothing locks.

100 x 50 mm, 5 columns of 4 elements of 12.5 mm, particles on the held half with one column in common. nu = 0, so that Timoshenko's
beam is the answer at any width (T: 0.3, 1.25 N, and no thickness). The force rises within one period of the beam, which leaves it at rest:
the mean over the next period is the static deflection.

    python scenes/arlequin_bending.py --quality paper --out DIR
"""

import math
from typing import Annotated, Any, Literal

from pydantic import Field, StrictInt

from taichi_sph.scene import (
    Box,
    Dimensionless,
    FiniteElements,
    Galerkin,
    Material,
    NodalForce,
    Numerics,
    Output,
    Patch,
    Plate,
    PrescribedVelocity,
    Probe,
    Quality,
    Quantity,
    Ramp,
    Scene,
    Shell,
    Study,
)

LENGTH, WIDTH, SIDE, HELD = 0.1, 0.05, 12.5e-3, 0.05  # m
YOUNG, DENSITY = 210e9, 7800.0
SLENDER = {"draft": (1e-1,), "standard": (1e-1, 1e-2), "paper": (1e-1, 1e-2, 1e-3)}  # e/L
FIRST = 1.8751041**2  # of the frequency of a clamped beam


def scene(
    quality: Quality = "draft",
    form: Literal["all", "coupled", "elements", "particles"] = "all",
    slenderness: Dimensionless = 1e-1,
    particles: Annotated[StrictInt, Field(ge=1)] = 5,
    weight: Literal["half", "linear"] = "half",
    directors: bool = True,
) -> Scene | Study:
    if form == "all" and (slenderness, weight, directors) != (1e-1, "half", True):
        raise ValueError("form = 'all' chooses slenderness, weight and directors by itself: leave them out, or set form = coupled")
    if form in ("elements", "particles") and (weight, directors) != ("half", True):
        raise ValueError(f"form = '{form}' ties nothing: leave weight and directors out, or set form = coupled")
    if form == "elements" and particles != 5:
        raise ValueError(f"form = 'elements' has no particles: leave particles = {particles} out, or set form = coupled")
    if form != "all":
        return one(quality, form, slenderness, particles, weight=weight, directors=directors)
    cases = {}
    for ratio in SLENDER[quality]:
        cases |= {f"half_{ratio:g}": one(quality, "coupled", ratio, particles)}
        cases |= {f"linear_{ratio:g}": one(quality, "coupled", ratio, particles, weight="linear")}
        cases |= {f"{form}_{ratio:g}": one(quality, form, ratio, particles) for form in ("elements", "particles")}
    loose = SLENDER[quality][0]
    cases |= {f"loose_{loose:g}": one(quality, "coupled", loose, particles, weight="linear", directors=False)}
    return Study(name="arlequin_bending", title="Bending of elements and particles", source="T 4.5.3", quality=quality, cases=cases)


def one(quality: Quality, form: str, slenderness: float, n: int, **patch: Any) -> Scene:
    """One form, with n particles along the side of an element."""
    e = slenderness * LENGTH
    inertia = WIDTH * e**3 / 12
    period = 2 * math.pi / (FIRST / LENGTH**2 * math.sqrt(YOUNG * inertia / (DENSITY * WIDTH * e)))
    force = 1e-3 * LENGTH * 3 * YOUNG * inertia / LENGTH**3  # a thousandth of the length, whatever the thickness
    theory = force * (LENGTH**3 / (3 * YOUNG * inertia) + LENGTH / (5 / 6 * YOUNG / 2 * WIDTH * e))
    told = form if form != "coupled" else f"{patch.get('weight', 'half')}{'' if patch.get('directors', True) else ', translations only'}"
    return Scene(
        name="arlequin_bending",
        title=f"Bending of elements and particles, e/L {slenderness:g}, {told}",
        source="T 4.5.3",
        quality=quality,
        shells=[
            Shell(
                name="plate",
                surface=Plate(length=LENGTH, width=WIDTH),
                thickness=e,
                material=Material(name="steel", source="T 4.5.3, nu = 0", young=YOUNG, poisson=0.0, density=DENSITY),
                motion="free",
                formulation=Galerkin() if form == "particles" else FiniteElements(),
                spacing=SIDE if form != "particles" else SIDE / n,
                patch=Patch(where=[Box(hi=(HELD - 1e-6, None, None))], spacing=SIDE / n, **patch) if form == "coupled" else None,
            )
        ],
        motions=[PrescribedVelocity(body="plate", where=Box(hi=(1e-6, None, None)), velocity=(0, 0, 0), spin=(0, 0, 0))],
        forces=[NodalForce(body="plate", where=Box(lo=(LENGTH - 1e-6, None, None)), total=(0, 0, force), history=Ramp(rise=period))],
        duration=2 * period,
        numerics=Numerics(spacing=SIDE),
        output=Output(frames=20, samples=1000, probes=[Probe(name="tip", body="plate", point=(LENGTH, WIDTH / 2, 0))]),
        quantities=[
            Quantity(
                name="history_mean", value=theory, tolerance=0.005 * theory, source="Timoshenko's beam",
                options={"history": "probe_tip", "column": "u_z", "start": period, "end": 2 * period},
            ),
        ],
    )  # fmt: skip


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
