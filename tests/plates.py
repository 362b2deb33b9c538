"""Small plates for the tests of the core, and hands to drive a World directly."""

from __future__ import annotations

import numpy as np

from taichi_sph import runtime
from taichi_sph.scene import (
    Box,
    Cut,
    Delay,
    InitialVelocity,
    Material,
    Mazars,
    NodalForce,
    Numerics,
    Plate,
    PrescribedVelocity,
    Ramp,
    Scene,
    Shell,
)

SIDE, CELLS = 12e-3, 12  # most tests share this size, so that they share compiled kernels
THICKNESS = 4e-3
CONCRETE = {"name": "concrete", "young": 32e9, "poisson": 0.2, "density": 2450.0}
BRITTLE = {"damage": Mazars(threshold=8.5e-5, A=1, B=7300), "delay": Delay(a=10, tau_c=1e-6), "critical_damage": 0.99}


def plate_scene(
    *,
    length: float = SIDE,
    width: float = SIDE,
    spacing: float = SIDE / CELLS,
    cells: str = "triangle",
    irregularity: float = 0.25,
    formulation="galerkin",
    precision: str = "f64",
    material: dict | None = None,
    brittle: bool = False,
    cuts: list[Cut] = (),
    velocity: tuple[float, float, float] | None = None,
    duration: float = 1e-4,
    safety: float = 0.9,
    motion: str = "in_plane",
    **more,
) -> Scene:
    """A free plate with its corner at the origin; `more` goes to the Scene."""
    constants = CONCRETE | (BRITTLE if brittle else {}) | (material or {})
    if velocity is not None:
        more["initial"] = [InitialVelocity(shell="plate", velocity=velocity)]
    return Scene(
        name="plate",
        title="a small plate",
        source="tests",
        shells=[
            Shell(
                name="plate",
                surface=Plate(length=length, width=width),
                thickness=THICKNESS,
                material=Material(**constants),
                motion=motion,
                cuts=list(cuts),
            )
        ],
        duration=duration,
        numerics=Numerics(
            spacing=spacing,
            cells=cells,
            irregularity=irregularity,
            formulation=formulation,
            precision=precision,
            time_step_safety=safety,
        ),
        **more,
    )


def start(scene: Scene, **options):
    """A World; Taichi is imported here and not before."""
    from taichi_sph.world.world import World

    return World(scene, **options)


def put(sim, name: str, values: np.ndarray) -> None:
    """Set the first components of a field of the nodes: u or v."""
    field = getattr(sim.shell.nodes, name)
    now = runtime.get(field, sim.shell.nodes.n)
    full = np.zeros_like(now)
    full[:, : values.shape[1]] = values
    runtime.put(field, full)


def plane(sim) -> np.ndarray:
    """(N, 2) reference positions [m]."""
    return sim.shell.mesh.points[:, :2]


def forces(sim, u: np.ndarray) -> np.ndarray:
    """(N, 2) internal forces [N] at the displacements u (N, 2)."""
    put(sim, "u", u)
    sim.shell.internal.strain(0.0)
    sim.shell.internal.force()
    return runtime.get(sim.shell.nodes.force, sim.shell.nodes.n)[:, :2].astype(float)


def stored(sim, u: np.ndarray) -> float:
    """Elastic energy [J] at the displacements u."""
    put(sim, "u", u)
    sim.shell.internal.strain(1e-30)  # a mere look, dt = 0, would leave the strains of a shell with damage as they are
    return sim.shell.stored()


def strains(sim) -> np.ndarray:
    """(M, 3) E11, E22, E12 of the last evaluation."""
    return runtime.get(sim.shell.cells.strain, sim.shell.cells.n)[:, :3].astype(float) * [1.0, 1.0, 0.5]


def linear(sim, gradient: np.ndarray) -> np.ndarray:
    """u = G X about the middle of the plate."""
    X = plane(sim)
    return (X - X.mean(axis=0)) @ np.asarray(gradient).T


def inner(sim, margin: float) -> np.ndarray:
    """(N,) nodes farther than `margin` [m] from the border of the rectangle."""
    X = plane(sim)
    lo, hi = X.min(axis=0), X.max(axis=0)
    return ((X > lo + margin) & (X < hi - margin)).all(axis=1)


def mass(sim) -> np.ndarray:
    """(N,) nodal masses [kg]."""
    return runtime.get(sim.shell.nodes.mass, sim.shell.nodes.n).astype(float)


def velocity(sim) -> np.ndarray:
    """(N, 2) half-step velocities."""
    return runtime.get(sim.shell.nodes.v, sim.shell.nodes.n)[:, :2].astype(float)


def displacement(sim) -> np.ndarray:
    """(N, 2) displacements."""
    return runtime.get(sim.shell.nodes.u, sim.shell.nodes.n)[:, :2].astype(float)


def crack() -> Cut:
    """Half of the side, at mid-height."""
    return Cut(start=(0, SIDE / 2, 0), end=(SIDE / 2, SIDE / 2, 0))


def tearing(formulation: str = "galerkin", **more) -> Scene:
    """A pre-cracked brittle plate whose halves fly apart; a ramp of force and a held corner take part too."""
    tenth = SIDE / 10
    return plate_scene(
        formulation=formulation,
        brittle=True,
        cuts=[crack()],
        duration=2e-5,
        initial=[
            InitialVelocity(shell="plate", where=Box(lo=(None, SIDE / 2, None)), velocity=(0, 1.5, 0)),
            InitialVelocity(shell="plate", where=Box(hi=(None, SIDE / 2, None)), velocity=(0, -1.5, 0)),
        ],
        forces=[
            NodalForce(shell="plate", where=Box(hi=(tenth, None, None)), total=(-20, 0, 0), history=Ramp(rise=1e-5)),
            NodalForce(shell="plate", where=Box(lo=(SIDE - tenth, None, None)), total=(20, 0, 0)),
        ],
        motions=[PrescribedVelocity(shell="plate", where=Box(lo=(None, SIDE - tenth, None)), velocity=(None, 1.5, None))],
        **more,
    )
