"""A shallow cylindrical roof, hinged along its straight edges and free along its arcs, is pushed in by a force in its middle: it snaps.

Sze, Liu and Lo (2004), 3.6: 508 x 508 mm, radius 2540 mm, E = 3102.75 MPa, nu = 0.3, a force up to 3 kN. The load turns back at 2226 N
where the roof is 12.7 mm thick, and at 586 N where it is 6.35 mm thick; the thin one then snaps back as well, to forces below zero.
The path is followed by its length. A quarter is computed, so the roof stays symmetric.

    python scenes/hinged_roof.py --set thickness="6.35 mm" --out DIR
"""

import math

from taichi_sph.scene import Ball, Length, Material, NodalForce, Numerics, Output, Quality, Quantity, Roof, Scene, Shell, Static
from taichi_sph.scene.kept import Probe
from taichi_sph.scene.supports import Edge, held, symmetry

CELLS = {"draft": 8, "standard": 12, "paper": 20}  # along a side of the quarter
TOLERANCE = {"draft": 0.03, "standard": 0.02, "paper": 0.01}
RADIUS, HALF, HALF_ANGLE, FORCE = 2.54, 0.254, 0.1, 3000.0
LIMIT = {12.7e-3: 0.7421, 6.35e-3: 0.1953}  # of FORCE, by thickness: tables 9a and 9d


def scene(quality: Quality = "draft", thickness: Length = 12.7e-3, increments: int = 60) -> Scene:
    known = min(LIMIT, key=lambda e: abs(e / thickness - 1))
    if abs(known / thickness - 1) > 1e-6:
        raise ValueError(f"thickness {1e3 * thickness:g} mm: limits are known for {', '.join(f'{1e3 * e:g}' for e in LIMIT)} mm")
    d = HALF / CELLS[quality]
    middle = (0.0, 0.0, RADIUS)
    # x along the straight edges; the hinge holds places and lets the directors turn about it
    hinge = Edge("y", RADIUS * math.sin(HALF_ANGLE), "below", (0, 0, 0), (None, 0, 0))
    return Scene(
        name="hinged_roof",
        title=f"Hinged roof of {1e3 * thickness:g} mm, pushed through",
        source="Sze, Liu and Lo 2004",
        shells=[
            Shell(
                name="roof",
                surface=Roof(radius=RADIUS, length=HALF, half_angle=HALF_ANGLE, start_angle=0.0),
                thickness=thickness,
                material=Material(name="E = 3.1 GPa", young=3.10275e9, poisson=0.3, density=1000),
                motion="free",
            )
        ],
        motions=held("roof", d, [symmetry("x", 0.0, "above")], [symmetry("y", 0.0, "above"), hinge]),
        forces=[NodalForce(body="roof", where=Ball(centre=middle, radius=d / 4), total=(0, 0, -FORCE / 4))],
        duration=1.0,
        static=Static(method="arc", increments=increments, residual=1e-5),
        numerics=Numerics(spacing=d),
        output=Output(frames=increments, samples=increments, checkpoints=0, probes=[Probe(name="middle", point=middle)]),
        quantities=[
            Quantity(
                name="limit_load", value=LIMIT[known], tolerance=TOLERANCE[quality] * LIMIT[known], source="of 3 kN, Sze, Liu and Lo 2004"
            ),
            Quantity(name="displacement", unit="m", source="of the middle, at the whole force", options={"x": 0.0, "y": 0.0, "z": RADIUS}),
            Quantity(name="relaxation_residual", source="of the load"),
        ],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
