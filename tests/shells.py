"""Small bent shells for the tests: a flat plate, a piece of a cylinder, a strip; and hands to drive them."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from taichi_sph import runtime
from taichi_sph.bodies.shell.instead.freedom import Freedom
from taichi_sph.scene import Cylinder, Galerkin, Material, Numerics, Output, Plate, Scene, Shell

STEEL = {"name": "steel", "young": 210e9, "poisson": 0.3, "density": 7800.0}
RADIUS = 0.7
SURFACES = {
    "flat": Plate(length=1.0, width=1.0),
    "curved": Cylinder(radius=RADIUS, length=1.0, axis="y", angle=1.4),
}


def shell_scene(
    surface="flat",
    *,
    cells: str = "quad",
    n: int = 8,
    thickness: float = 0.05,
    irregularity: float = 0.25,
    material: dict | None = None,
    precision: str = "f64",
    duration: float = 1e-3,
    safety: float = 0.9,
    galerkin: dict | None = None,
    **more,
) -> Scene:
    """A free shell with `n` cells over 1 m; `more` goes to the Scene."""
    return Scene(
        name="shell",
        title="a small shell",
        source="tests",
        shells=[
            Shell(
                name="shell",
                surface=SURFACES.get(surface, surface) if isinstance(surface, str) else surface,
                thickness=thickness,
                material=Material(**STEEL | (material or {})),
                motion="free",
            )
        ],
        duration=duration,
        numerics=Numerics(
            spacing=1.0 / n,
            cells=cells,
            irregularity=irregularity,
            precision=precision,
            time_step_safety=safety,
            formulation=Galerkin(**(galerkin or {})),
        ),
        output=more.pop("output", Output()),
        **more,
    )


def start(scene: Scene, **options):
    """A World; Taichi is imported here and not before."""
    from taichi_sph.world.world import World

    return World(scene, **options)


def of_nodes(sim, name: str) -> np.ndarray:
    """(N, 3) values of a field of the nodes."""
    return runtime.get(getattr(sim.shell.nodes, name), sim.shell.nodes.n).astype(float)


def pose(sim, u: np.ndarray, d: np.ndarray) -> None:
    """Set displacements and director changes."""
    real = runtime.get(sim.shell.nodes.u, sim.shell.nodes.n).dtype
    runtime.put(sim.shell.nodes.u, np.ascontiguousarray(u, real))
    runtime.put(sim.shell.nodes.d, np.ascontiguousarray(d, real))


def forces(sim, u: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Forces [N], couples [N m] on the nodes and the stored energy [J] at (u, d)."""
    pose(sim, u, d)
    sim.shell.internal.strain(0.0)
    energy = sim.shell.stored()
    sim.shell.internal.force()
    return of_nodes(sim, "force"), of_nodes(sim, "couple"), energy


def turned(sim, rotation: Rotation, shift=(0.0, 0.0, 0.0)) -> tuple[np.ndarray, np.ndarray]:
    """(u, d) of a rigid motion."""
    X, N = sim.shell.mesh.points, of_nodes(sim, "N")
    return rotation.apply(X) - X + np.asarray(shift), rotation.apply(N) - N


def spin(sim, omega: np.ndarray, velocity=(0.0, 0.0, 0.0)) -> None:
    """Set every node to turn about the centre of mass with `omega` [rad/s] and to travel with `velocity` [m/s]."""
    X, N = sim.shell.mesh.points, of_nodes(sim, "N")
    mass = runtime.get(sim.shell.nodes.mass, sim.shell.nodes.n).astype(float)
    centre = mass @ X / mass.sum()
    real = runtime.get(sim.shell.nodes.v, sim.shell.nodes.n).dtype
    runtime.put(sim.shell.nodes.v, (np.cross(omega, X - centre) + np.asarray(velocity)).astype(real))
    runtime.put(sim.shell.nodes.omega, (omega - (N @ omega)[:, None] * N).astype(real))


def along(step, felt, free, u, d, N, h: float = 1e-6) -> np.ndarray:
    """(size,) what K step should be, by central differences of the forces that the unknowns feel, `felt(u, d, free)`. A turn about an
    axis is taken where the director is by then."""

    def moved(step):
        parts = free.spread(step)
        turn = np.einsum("nia,na->ni", free.axes, parts[:, 3:])
        basis, tiny = free.basis.copy(), 1e-5
        for k in range(2):
            way = [Rotation.from_rotvec(turn + s * tiny * free.axes[:, :, k]).apply(N + d) for s in (1, -1)]
            basis[:, 3:, 3 + k] = (way[0] - way[1]) / (2 * tiny)
        du = np.einsum("nij,nj->ni", free.basis[:, :3, :3], parts[:, :3])
        return felt(u + du, Rotation.from_rotvec(turn).apply(N + d) - N, Freedom(basis, free.axes, free.number))

    return -(moved(h * step) - moved(-h * step)) / (2 * h)
