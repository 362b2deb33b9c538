"""A pulse in a strip of finite elements whose last third is of particles (T 4.5.1): it crosses the overlap and comes back.

The strip of scenes/wave.py: 33 columns of 4 elements of 1.25 mm, particles on 20 mm with one column in common, `particles` of them along
the side of an element. Pure elements and pure particles stand beside, and T's coupling (`multipliers = "volume"`, over `reach`).
Elements take the step of the particles, for central differences hide the dispersion of a lattice only near its own step.
Expected: returns within 0.4 % of L/c and 2 L/c, amplitude at least 0.998.

    python scenes/arlequin_wave.py --quality paper --out DIR
"""

import math
from typing import Annotated, Any, Literal

from pydantic import Field, StrictInt

from taichi_sph.scene import (
    Box,
    Dimensionless,
    FiniteElements,
    Galerkin,
    InitialVelocity,
    Material,
    Numerics,
    Output,
    Patch,
    Plate,
    Probe,
    Pulse,
    Quality,
    Quantity,
    Scene,
    Shell,
    Study,
)

LENGTH, WIDTH, THICKNESS, WIDTH_OF_PULSE = 60e-3, 5e-3, 1e-3, 10e-3  # m
YOUNG, DENSITY = 210e9, 7800.0
SIDE, COLUMNS = 1.25e-3, 33  # m and number of columns of elements
STEP = 1.0  # about, in spacings of the particles over the speed of sound: a history has velocities of half a step before
PARTICLES = {"draft": (3, 5), "standard": (3, 5, 10), "paper": (3, 5, 10, 20)}  # along the side of an element

REACHES = {"draft": (2.0,), "standard": (1.0, 2.0), "paper": (0.5, 1.0, 2.0, 3.0)}  # of T's moving least squares


def scene(
    quality: Quality = "draft",
    form: Literal["all", "coupled", "elements", "particles"] = "all",
    particles: Annotated[StrictInt, Field(ge=1)] = 5,
    weight: Literal["half", "linear", "cubic"] = "half",
    multipliers: Literal["gradient", "volume"] = "gradient",
    reach: Dimensionless = 2.0,
) -> Scene | Study:
    if form == "all" and (particles, weight, multipliers, reach) != (5, "half", "gradient", 2.0):
        raise ValueError("form = 'all' chooses particles, weight, multipliers and reach by itself: leave them out, or set form = coupled")
    if form in ("elements", "particles") and (weight, multipliers, reach) != ("half", "gradient", 2.0):
        raise ValueError(f"form = '{form}' ties nothing: leave weight, multipliers and reach out, or set form = coupled")
    if multipliers == "gradient" and reach != 2.0:
        raise ValueError(f"reach = {reach:g} is of T's coupling: leave it out, or set multipliers = volume")
    if form != "all":
        return one(quality, form, particles, weight=weight, multipliers=multipliers, reach=reach)
    cases = {f"half_{n}": one(quality, "coupled", n, weight="half") for n in PARTICLES[quality]}
    cases |= {f"{kind}_5": one(quality, "coupled", 5, weight=kind) for kind in ("linear", "cubic")}
    cases |= {f"thesis_{r:g}": one(quality, "coupled", 5, weight="linear", multipliers="volume", reach=r) for r in REACHES[quality]}
    cases |= {form: one(quality, form, 5) for form in ("elements", "particles")}
    return Study(name="arlequin_wave", title="A wave from elements to particles", source="T 4.5.1", quality=quality, cases=cases)


def one(quality: Quality, form: str, n: int, **patch: Any) -> Scene:
    """One form, with n particles along the side of an element."""
    sound = math.sqrt(YOUNG / DENSITY)
    period, lag = LENGTH / sound, 0.5 * STEP * SIDE / n / sound
    at_centre = {"history": "probe_centre", "column": "v_x"}
    quantities = []
    for number in (1, 2):
        time = number * period
        said = f"d'Alembert, {number} L/c"
        options = {**at_centre, "start": time - period / 4, "end": time + period / 4}
        quantities += [
            Quantity(name="history_peak", value=1.0, tolerance=0.002, source=said, options=options),
            Quantity(name="peak_time", unit="s", value=time + lag, tolerance=0.004 * time, source=said, options=options),
        ]
    strip = Shell(
        name="strip",
        surface=Plate(length=LENGTH, width=WIDTH),
        thickness=THICKNESS,
        material=Material(name="steel", source="T 4.5.1", young=YOUNG, poisson=0.0, density=DENSITY),
        formulation=Galerkin() if form == "particles" else FiniteElements(),
        spacing=SIDE / n if form == "particles" else SIDE,
        patch=Patch(where=[Box(lo=(COLUMNS * SIDE, None, None))], spacing=SIDE / n, **patch) if form == "coupled" else None,
    )
    whose = "of T" if patch.get("multipliers") == "volume" else patch.get("weight", "half")
    told = f"{n} a side, {whose}" if form == "coupled" else form
    return Scene(
        name="arlequin_wave",
        title=f"A wave from elements to particles, {told}",
        source="T 4.5.1",
        quality=quality,
        shells=[strip],
        initial=[InitialVelocity(body="strip", velocity=(1.0, 0, 0), pulse=Pulse(centre=LENGTH / 2, width=WIDTH_OF_PULSE))],
        duration=2.3 * period,
        numerics=Numerics(spacing=SIDE, time_step_safety=0.9 / n if form == "elements" else 0.9),
        output=Output(frames=45, samples=2000, probes=[Probe(name="centre", body="strip", point=(LENGTH / 2, WIDTH / 2, 0))]),
        quantities=quantities,
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
