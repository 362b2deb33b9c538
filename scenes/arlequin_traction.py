"""A plate pulled at its end: half of it finite elements, half particles (T 4.5.2).

3 x 1 m, 100 kN over a ramp of 2 ms, 7 columns of 4 elements of 0.25 m, particles on the held half with one column in common. T's cubic
weights with 10 particles a side diverge. Here nothing does, at 0.9 of the step of plain particles. nu = 0 (T: 0.2), so that the exact
series of a bar is the answer.

    python scenes/arlequin_traction.py --quality paper --out DIR
"""

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, StrictInt

from taichi_sph.scene import (
    Box,
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

LENGTH, WIDTH, THICKNESS, SIDE, HELD = 3.0, 1.0, 0.1, 0.25, 1.5  # m
FORCE, RISE, DURATION = 1e5, 2e-3, 10e-3  # N, s
YOUNG, DENSITY = 31.37e9, 2800.0
PARTICLES = {"draft": (5,), "standard": (5, 10), "paper": (5, 10, 20)}  # along the side of an element
WHEN = 9.2e-3  # s


def scene(
    quality: Quality = "draft",
    form: Literal["all", "coupled", "elements", "particles"] = "all",
    particles: Annotated[StrictInt, Field(ge=1)] = 5,
    weight: Literal["half", "linear", "cubic"] = "half",
    multipliers: Literal["gradient", "volume"] = "gradient",
) -> Scene | Study:
    if form == "all" and (particles, weight, multipliers) != (5, "half", "gradient"):
        raise ValueError("form = 'all' chooses particles, weight and multipliers by itself: leave them out, or set form = coupled")
    if form in ("elements", "particles") and (weight, multipliers) != ("half", "gradient"):
        raise ValueError(f"form = '{form}' ties nothing: leave weight and multipliers out, or set form = coupled")
    if form != "all":
        return one(quality, form, particles, weight=weight, multipliers=multipliers)
    cases = {f"{kind}_{n}": one(quality, "coupled", n, weight=kind) for n in PARTICLES[quality] for kind in ("half", "linear", "cubic")}
    cases |= {f"thesis_{PARTICLES[quality][-1]}": one(quality, "coupled", PARTICLES[quality][-1], weight="cubic", multipliers="volume")}
    cases |= {form: one(quality, form, 5) for form in ("elements", "particles")}
    return Study(name="arlequin_traction", title="Traction of elements and particles", source="T 4.5.2", quality=quality, cases=cases)


def elongation(time: float) -> float:
    """Of a bar that is held at one end and pulled at the other by a ramp, over F L / E A."""
    sound = (YOUNG / DENSITY) ** 0.5
    found = min(time, RISE) / RISE
    for k in range(400):
        w = (k + 0.5) * np.pi * sound / LENGTH
        swing = np.sin(w * time) - (np.sin(w * (time - RISE)) if time > RISE else 0.0)
        found -= 2.0 / ((k + 0.5) * np.pi) ** 2 * swing / (w * RISE)
    return float(found)


def one(quality: Quality, form: str, n: int, **patch: Any) -> Scene:
    """One form, with n particles along the side of an element."""
    whole = FORCE * LENGTH / (YOUNG * WIDTH * THICKNESS)
    told = f"{n} a side, {'of T' if patch.get('multipliers') == 'volume' else patch['weight']}" if patch else form
    spacing = SIDE if form != "particles" else SIDE / n
    at_end = {"history": "probe_end", "column": "u_x"}
    return Scene(
        name="arlequin_traction",
        title=f"Traction of elements and particles, {told}",
        source="T 4.5.2",
        quality=quality,
        shells=[
            Shell(
                name="plate",
                surface=Plate(length=LENGTH, width=WIDTH),
                thickness=THICKNESS,
                material=Material(name="concrete", source="T 4.5.2, nu = 0", young=YOUNG, poisson=0.0, density=DENSITY),
                formulation=Galerkin() if form == "particles" else FiniteElements(),
                spacing=spacing,
                patch=Patch(where=[Box(hi=(HELD - 1e-6, None, None))], spacing=SIDE / n, **patch) if form == "coupled" else None,
            )
        ],
        motions=[PrescribedVelocity(body="plate", where=Box(hi=(1e-6, None, None)), velocity=(0, 0, None))],
        forces=[NodalForce(body="plate", where=Box(lo=(LENGTH - 1e-6, None, None)), total=(FORCE, 0, 0), history=Ramp(rise=RISE))],
        duration=DURATION,
        numerics=Numerics(spacing=SIDE, time_step_safety=0.9 / n if form == "elements" else 0.9),
        output=Output(frames=30, samples=1000, probes=[Probe(name="end", body="plate", point=(LENGTH, WIDTH / 2, 0))]),
        quantities=[
            Quantity(
                name="history_value", value=elongation(WHEN) * whole, tolerance=0.007 * whole, source="exact series of a bar",
                options={**at_end, "time": WHEN},
            ),
            Quantity(
                name="history_mean", value=mean() * whole, tolerance=0.007 * whole, source="exact series of a bar",
                options={**at_end, "start": RISE, "end": DURATION},
            ),
        ],
    )  # fmt: skip


def mean() -> float:
    """Of the elongation after the ramp, over F L / E A."""
    times = np.linspace(RISE, DURATION, 400)
    return float(np.trapezoid([elongation(t) for t in times], times) / (DURATION - RISE))


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
