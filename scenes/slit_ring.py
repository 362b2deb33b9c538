"""A flat ring with a slit, clamped along one lip and lifted by a line force along the other, until it stands up like a spring.

Sze, Liu and Lo (2004), 3.3: E = 21e6, nu = 0, radii 6 and 10, thickness 0.03, 0.8 per length. The corners of the lifted lip rise
by 13.891 (inside, A) and 17.528 (outside, B) at the whole force. The slit has no width: its lips are nodes in one place.

    python scenes/slit_ring.py --quality standard --out DIR
"""

import math

import numpy as np

from taichi_sph.scene import (
    Ball,
    Box,
    Material,
    Net,
    NodalForce,
    Numerics,
    Output,
    PrescribedVelocity,
    Quality,
    Quantity,
    Scene,
    Shell,
    Static,
)
from taichi_sph.scene.kept import Probe

CELLS = {"draft": (40, 5), "standard": (64, 8), "paper": (96, 12)}  # around, across
TOLERANCE = {"draft": 0.06, "standard": 0.03, "paper": 0.015}
INNER, OUTER, THICKNESS, YOUNG, FORCE = 6.0, 10.0, 0.03, 21e6, 0.8  # FORCE: per length of the lip
GAP = 2e-5  # rad between the lips, so that regions tell them apart; nothing sees it
RISE = {"A": (INNER, 13.891), "B": (OUTER, 17.528)}


def scene(quality: Quality = "draft", increments: int = 10) -> Scene:
    around, across = CELLS[quality]
    angle, radius = np.linspace(0.0, 2 * math.pi - GAP, around + 1), np.linspace(INNER, OUTER, across + 1)
    points = np.stack([np.outer(np.cos(angle), radius), np.outer(np.sin(angle), radius)], axis=-1).reshape(-1, 2)
    k = np.arange(len(points)).reshape(around + 1, across + 1)
    cells = np.stack([k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]], axis=-1).reshape(-1, 4)
    d = (OUTER - INNER) / across
    lip = [(*points[i], 0.0) for i in k[-1]]
    share = [FORCE * d * (0.5 if i in (0, across) else 1.0) for i in range(across + 1)]
    corner = {name: (r * math.cos(GAP), -r * math.sin(GAP), 0.0) for name, (r, _) in RISE.items()}
    return Scene(
        name="slit_ring",
        title="Slit ring, lifted along one lip",
        source="Sze, Liu and Lo 2004",
        shells=[
            Shell(
                name="ring",
                surface=Net(points=points, cells=cells, merge=False),
                thickness=THICKNESS,
                material=Material(name="E = 21e6, nu = 0", young=YOUNG, poisson=0.0, density=1000),
                motion="free",
            )
        ],
        motions=[
            PrescribedVelocity(body="ring", where=Box(lo=(0.0, -1e-9, None), hi=(None, 1e-9, None)), velocity=(0, 0, 0), spin=(0, 0, 0))
        ],
        forces=[
            NodalForce(body="ring", where=Ball(centre=point, radius=1e-4), total=(0.0, 0.0, force)) for point, force in zip(lip, share)
        ],
        duration=1.0,
        static=Static(increments=increments, residual=1e-5),
        numerics=Numerics(spacing=d),
        output=Output(
            frames=increments, samples=increments, checkpoints=0, probes=[Probe(name=name, point=point) for name, point in corner.items()]
        ),
        quantities=[
            *(
                Quantity(
                    name="deflection_ratio",
                    value=1.0,
                    tolerance=TOLERANCE[quality],
                    source=f"corner {name}: {rise}, Sze, Liu and Lo 2004",
                    options={"x": corner[name][0], "y": corner[name][1], "reference": rise},
                )
                for name, (_, rise) in RISE.items()
            ),
            Quantity(name="relaxation_residual", source="of the load"),
        ],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
