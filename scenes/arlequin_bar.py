"""A pulse in a square bar of hexahedra whose last third is of particles (P 4.1, table 1): it crosses the overlap and comes back.

36 x 5 x 5 mm of concrete, elements of 1 mm, particles beyond 24 mm, `particles` of them along the edge of an element. nu = 0, so that
d'Alembert's solution holds. P does not give its pulse. With exp(-3e4 x^2), at a step below half an element over c, elements alone have P's
own row; a wider pulse, exp(-1e4 x^2), stands beside. `form` = "elements" and "particles": the bar of one of them.
Expected: returns within 0.6 % of L/c and 2 L/c, amplitude at least 0.997. P has 1.022 to 1.042 and 1.019 to 1.061 of the times, 0.894 to
0.985 and 0.914 to 0.979 of the amplitude.

    python scenes/arlequin_bar.py --quality paper --out DIR
"""

import math
from typing import Annotated, Any, Literal

from pydantic import Field, StrictInt

from taichi_sph.scene import (
    Box,
    Brick,
    InitialVelocity,
    Length,
    Material,
    Numerics,
    Output,
    Particles,
    Probe,
    Pulse,
    Quality,
    Quantity,
    Scene,
    Solid,
    SolidPatch,
    Study,
    Trilinear,
)

LENGTH, WIDE, SIDE, FROM = 36e-3, 5e-3, 1e-3, 24e-3  # m
YOUNG, DENSITY = 30e9, 2300.0
P_ELEMENTS = ((10.03 / 9.97, 0.999), (20.06 / 19.94, 0.997))  # times over L/c and 2 L/c, amplitudes
PULSES = {"short": 1 / math.sqrt(3e4), "long": 1 / math.sqrt(1e4)}  # m
PARTICLES = {"draft": (1, 2, 3), "standard": (1, 2, 3, 4), "paper": (1, 2, 3, 4, 5)}  # along the edge of an element


def scene(
    quality: Quality = "draft",
    form: Literal["all", "coupled", "elements", "particles"] = "all",
    particles: Annotated[StrictInt, Field(ge=1)] = 3,
    width: Length = PULSES["short"],
) -> Scene | Study:
    if form != "all":
        return one(quality, form, particles, width)
    if (particles, width) != (3, PULSES["short"]):
        raise ValueError("form = 'all' chooses particles and width by itself, many of them: leave them out, or set form = coupled")
    cases = {f"{pulse}_{n}": one(quality, "coupled", n, wide) for pulse, wide in PULSES.items() for n in PARTICLES[quality]}
    cases |= {"elements": one(quality, "elements", 3, PULSES["short"])}
    cases |= {f"particles_{n}": one(quality, "particles", n, PULSES["short"]) for n in PARTICLES[quality][:2]}
    return Study(name="arlequin_bar", title="A pulse in a bar of elements and particles", source="P 4.1", quality=quality, cases=cases)


def step(form: str, n: int) -> float:
    """About, of the clock [s]: what 0.9 of the stable one is for cubes of that size. Elements alone take that of particles, for central
    differences hide the dispersion of a lattice near its own step."""
    return (0.9 if form != "particles" and n == 1 else 1.14 / n) * SIDE / math.sqrt(YOUNG / DENSITY)


def one(quality: Quality, form: str, n: int, width: float) -> Scene:
    """One form, with n particles along the edge of an element."""
    period = LENGTH / math.sqrt(YOUNG / DENSITY)
    lag = 0.5 * step(form, n)  # a history has velocities of half a step before
    at_centre = {"history": "probe_centre", "column": "v_x"}
    quantities = []
    for number, (late, high) in enumerate(P_ELEMENTS, start=1):
        time = number * period
        options = {**at_centre, "start": time - period / 4, "end": time + period / 4}
        said: dict[str, Any] = {"source": f"d'Alembert, {number} L/c", "options": options}
        near = 0.006 * time
        if form == "elements":
            said["source"], near = "P table 1, elements", 0.001 * time
        else:
            late, high = 1.0, 1.0
        quantities += [
            Quantity(name="history_peak", value=high, tolerance=0.003, **said),
            Quantity(name="peak_time", unit="s", value=late * time + lag, tolerance=near, **said),
        ]
    bar = Solid(
        name="bar",
        shape=Brick(size=(LENGTH, WIDE, WIDE)),
        material=Material(name="concrete", source="P 4.2, nu = 0", young=YOUNG, poisson=0.0, density=DENSITY),
        formulation=Particles() if form == "particles" else Trilinear(),
        spacing=SIDE / n if form == "particles" else SIDE,
        patch=SolidPatch(where=[Box(lo=(FROM, None, None))], spacing=SIDE / n) if form == "coupled" else None,
    )
    told = f"{n} a side" if form == "coupled" else form if form == "elements" else f"{form} alone, {n} a side"
    return Scene(
        name="arlequin_bar",
        title=f"A pulse of {1e3 * width:.3g} mm in a bar, {told}",
        source="P 4.1",
        quality=quality,
        solids=[bar],
        initial=[InitialVelocity(body="bar", velocity=(1.0, 0, 0), pulse=Pulse(centre=LENGTH / 2, width=width))],
        duration=2.3 * period,
        numerics=Numerics(spacing=SIDE, time_step_safety=1.14 / n if form == "elements" and n > 1 else 0.9),
        output=Output(frames=45, samples=2000, probes=[Probe(name="centre", body="bar", point=(LENGTH / 2, WIDE / 2, WIDE / 2))]),
        quantities=quantities,
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
