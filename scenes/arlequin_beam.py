"""A square beam of hexahedra whose free third is of particles, under a sudden force at its end (P 4.1, table 2): large bending.

36 x 5 x 5 mm of concrete, elastic, clamped at x = 0, elements of 1 mm, particles beyond 24 mm, `particles` of them along the edge of an
element. 3000 N across the end at once, which keep their direction. P says neither where it is held nor of what it takes the displacement:
a clamped beam and its end fit the first time (166.6 us), not the second (489.4 us) nor the amplitudes (22.91 and 23.14 mm). So elements and
particles are held to our own elements alone (`form` = "elements"): times and amplitudes of the first two largest deflections within 0.5 %.
The first one has two tops, 11 us apart, which differ by 2e-5 of it: the first of them counts.
P, coupled to elements alone: 0.9 and 1.5 % of the times, 0.4 and 1.3 % of the amplitudes.

    python scenes/arlequin_beam.py --quality paper --out DIR
"""

from typing import Annotated, Literal

from pydantic import Field, StrictInt

from taichi_sph.scene import (
    Box,
    Brick,
    Material,
    NodalForce,
    Numerics,
    Output,
    Particles,
    PrescribedVelocity,
    Probe,
    Quality,
    Quantity,
    Scene,
    Solid,
    SolidPatch,
    Study,
    Trilinear,
)

LENGTH, WIDE, SIDE, FROM, FORCE = 36e-3, 5e-3, 1e-3, 24e-3, 3000.0  # m, N
END = 2e-3  # m, from both sides: a node of every form
YOUNG, POISSON, DENSITY = 30e9, 0.22, 2300.0
OURS = (
    (169.71e-6, 30.738e-3, 174e-6),
    (561.29e-6, 30.627e-3, 631e-6),
)  # s, m, s up to which it is looked for: taichi-sph run arlequin_beam --set form=elements
PARTICLES = {"draft": (2,), "standard": (2, 3), "paper": (2, 3, 4)}  # along the edge of an element


def scene(
    quality: Quality = "draft",
    form: Literal["all", "coupled", "elements", "particles"] = "all",
    particles: Annotated[StrictInt, Field(ge=1)] = 2,
) -> Scene | Study:
    if form == "elements" and particles != 2:
        raise ValueError(f"form = 'elements' has no particles: leave particles = {particles} out, or set form = coupled")
    if form != "all":
        return one(quality, form, particles)
    if particles != 2:
        raise ValueError("form = 'all' chooses particles by itself, many of them: leave them out, or set form = coupled")
    cases = {f"coupled_{n}": one(quality, "coupled", n) for n in PARTICLES[quality]} | {"elements": one(quality, "elements", 1)}
    return Study(name="arlequin_beam", title="A beam of elements and particles, bent", source="P 4.1", quality=quality, cases=cases)


def one(quality: Quality, form: str, n: int) -> Scene:
    """One form, with n particles along the edge of an element."""
    at_end = {"history": "probe_end", "column": "u_z"}
    quantities = []
    for time, high, end in OURS:
        options = {**at_end, "start": time - 70e-6, "end": end}
        said = "our elements alone"
        quantities += [
            Quantity(name="history_peak", unit="m", value=high, tolerance=0.005 * high, source=said, options=options),
            Quantity(name="peak_time", unit="s", value=time, tolerance=0.005 * time, source=said, options=options),
        ]
    beam = Solid(
        name="beam",
        shape=Brick(size=(LENGTH, WIDE, WIDE)),
        material=Material(name="concrete", source="P 4.2", young=YOUNG, poisson=POISSON, density=DENSITY),
        formulation=Particles() if form == "particles" else Trilinear(),
        spacing=SIDE / n if form == "particles" else SIDE,
        patch=SolidPatch(where=[Box(lo=(FROM, None, None))], spacing=SIDE / n) if form == "coupled" else None,
    )
    told = f"{n} a side" if form == "coupled" else f"{form} alone"
    return Scene(
        name="arlequin_beam",
        title=f"A beam, bent, {told}",
        source="P 4.1",
        quality=quality,
        solids=[beam],
        motions=[PrescribedVelocity(body="beam", where=Box(hi=(1e-6, None, None)), velocity=(0, 0, 0))],
        forces=[NodalForce(body="beam", where=Box(lo=(LENGTH - 1e-6, None, None)), total=(0, 0, FORCE))],
        duration=640e-6,
        numerics=Numerics(spacing=SIDE),
        output=Output(frames=30, samples=2000, probes=[Probe(name="end", body="beam", point=(LENGTH, END, END))]),
        quantities=quantities,
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
