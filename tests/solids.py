"""Scenes of one solid, and worlds of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from taichi_sph import runtime
from taichi_sph.scene import Brick, Cells, Material, Numerics, Scene, Solid
from taichi_sph.world.world import World

STEEL: dict[str, Any] = {"name": "steel", "young": 210e9, "poisson": 0.3, "density": 7800.0}


def solid_scene(shape: Any, material: Any = None, spacing: float = 0.1, duration: float = 1.0, **more: Any) -> Scene:
    """One solid called "body"; `solid`: more of its keys."""
    body = Solid(name="body", shape=shape, material=Material(**{**STEEL, **(material or {})}), **more.pop("solid", {}))
    numerics = more.pop("numerics", {})
    return Scene(
        name="solid",
        title="Solid",
        source="tests",
        duration=duration,
        solids=[body],
        numerics=Numerics(spacing=spacing, **numerics),
        **more,
    )


def start(scene: Scene, threads: int = 1) -> World:
    return World(scene, threads=threads)


def group_of(world: World) -> Any:
    return next(group for group in world.groups if group.kind == "solid")


def forces(world: World, u: np.ndarray) -> np.ndarray:
    """(N, 3) internal forces [N] at displacements u (N, 3) [m]; the history stays."""
    from taichi_sph.bodies.solid.forces import gather, strain

    group = group_of(world)
    before = runtime.get(group.nodes.u, group.nodes.n)
    runtime.put(group.nodes.u, u.astype(before.dtype))
    strain(group.cells, group.nodes, group.material, group.cells.n, 0.0, 0.0)
    gather(group.cells, group.nodes, group.nodes.n)
    found = runtime.get(group.nodes.force, group.nodes.n)
    runtime.put(group.nodes.u, before)
    return found


def shaken(n: tuple[int, int, int], size: tuple[float, float, float], by: float, tetrahedra: bool = False, seed: int = 0) -> Cells:
    """A brick whose inner nodes are moved at random by up to `by` spacings; tetrahedra: five to a hexahedron."""
    from taichi_sph.geometry.solids.made import brick

    mesh = brick(Brick(size=size, layers=n), 1.0)
    points = mesh.points.copy()
    inner = ((points > 1e-9) & (points < np.array(size) - 1e-9)).all(axis=1)
    points[inner] += by * np.random.default_rng(seed).uniform(-1, 1, (int(inner.sum()), 3)) * np.array(size) / np.array(n)
    cells = mesh.cells
    if tetrahedra:
        k, j, i = np.meshgrid(np.arange(n[2]), np.arange(n[1]), np.arange(n[0]), indexing="ij")
        even = ((i + j + k) % 2 == 0).ravel()
        one = [(0, 1, 3, 4), (1, 2, 3, 6), (1, 4, 5, 6), (3, 4, 6, 7), (1, 3, 4, 6)]
        two = [(0, 1, 2, 5), (0, 2, 3, 7), (0, 4, 5, 7), (2, 5, 6, 7), (0, 2, 5, 7)]
        cells = np.concatenate([mesh.cells[even][:, list(t)] for t in one] + [mesh.cells[~even][:, list(t)] for t in two])
    return Cells(points=points, cells=cells.tolist())


def bends(n: int, poisson: float, gamma: float, form: str = "trilinear", cells: int | None = None) -> float:
    """Tip over Timoshenko of a cantilever 36 x 5 x 5, n cubes through the depth, by conjugate gradients on the kernels' forces."""
    from scipy.sparse.linalg import LinearOperator, cg

    long, deep = 36.0, 5.0
    along = cells or round(long / deep * n)
    size = (along * deep / n, deep, deep)
    material = {"young": 1e9, "poisson": poisson, "density": 1000.0}
    world = start(
        solid_scene(
            Brick(size=size, layers=(along, n, n)),
            material,
            deep / n,
            duration=100.0,
            solid={"formulation": {"kind": form, "stabilisation": gamma}},
        )
    )
    X = group_of(world).mesh.points
    free = X[:, 0] > 1e-9
    tip = np.abs(X[:, 0] - size[0]) < 1e-9
    inside = (np.abs(X[tip, 1] - deep / 2) < deep / 2 - 1e-9).astype(float), (np.abs(X[tip, 2] - deep / 2) < deep / 2 - 1e-9).astype(float)
    share = (0.5 + 0.5 * inside[0]) * (0.5 + 0.5 * inside[1])
    load = np.zeros_like(X)
    load[tip, 2] = share / share.sum()

    def stiffness(y):
        u = np.zeros_like(X)
        u[free] = y.reshape(-1, 3)
        scale = 1e-6 / max(np.abs(u).max(), 1e-300)
        return -forces(world, scale * u)[free].ravel() / scale

    m = 3 * int(free.sum())
    found, failed = cg(LinearOperator((m, m), stiffness), load[free].ravel(), rtol=1e-7, maxiter=5000)
    assert not failed
    u = np.zeros_like(X)
    u[free] = found.reshape(-1, 3)
    young, length = 1e9, size[0]
    exact = length**3 / (3 * young * deep**4 / 12) + length / (5 / 6 * young / (2 * (1 + poisson)) * deep**2)
    return float((load[:, 2] * u[:, 2]).sum() / exact)
