"""Small shells of elements with particles in them."""

from __future__ import annotations

import numpy as np

from taichi_sph import runtime
from taichi_sph.scene import Box, FiniteElements, Material, Numerics, Patch, Plate, Scene, Shell

STEEL = {"name": "steel", "source": "tests", "young": 210e9, "poisson": 0.3, "density": 7800.0}
HALF = (Box(lo=(0.5, None, None)),)


def patched(
    surface=None, where=HALF, side: float = 0.1, n: int = 3, *, points: int = 4, thickness: float = 0.03, motion="free", **more
) -> Scene:
    """Elements `side` wide, n particles along each; keys of Patch and of Scene."""
    own = {key: more.pop(key) for key in list(more) if key in Patch.model_fields}
    return Scene(
        name="patched",
        title="elements and particles",
        source="tests",
        shells=[
            Shell(
                name="shell",
                surface=Plate(length=1.0, width=0.4) if surface is None else surface,
                thickness=thickness,
                motion=motion,
                material=Material(**STEEL | more.pop("material", {})),
                formulation=FiniteElements(points=points),
                patch=Patch(where=where, spacing=side / n, **own),
            )
        ],
        duration=more.pop("duration", 1e-2),
        numerics=Numerics(spacing=side, precision=more.pop("precision", "f64")),
        **more,
    )


def start(scene: Scene, **options):
    """A World; Taichi is imported here and not before."""
    from taichi_sph.world.world import World

    return World(scene, **options)


def of_nodes(group, name: str) -> np.ndarray:
    """(N, ...) of a field of the nodes of a group, f64."""
    return runtime.get(getattr(group.nodes, name), group.nodes.n).astype(float)


def tied(sim):
    """The coupling of the only patched shell; its groups are the elements and the particles."""
    return sim.couplings[-1]
