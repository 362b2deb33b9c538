"""Small bodies of water for the tests, and a hand to drive them."""

from __future__ import annotations

import numpy as np

from taichi_sph import runtime
from taichi_sph.bodies.fluid.said import Fluid, FluidBox, Wall, Water

SPACING = 0.01


def lattice(counts, shaken: float = 0.0) -> np.ndarray:
    """Points in the middle of cells of SPACING, the first cell at the origin, moved at random by up to `shaken` of it."""
    points = np.stack(np.meshgrid(*(np.arange(k) for k in counts), indexing="ij"), axis=-1).reshape(-1, 3) + 0.5
    return SPACING * (points + shaken * np.random.default_rng(0).uniform(-1, 1, points.shape))


def body(points, *, water=None, gravity=(0.0, 0.0, 0.0), walls=(), precision="f64", threads=None, skin=0.15, **settings):
    """A FluidBody of those points in a Taichi started afresh."""
    from taichi_sph.bodies.fluid.body import FluidBody
    from taichi_sph.bodies.fluid.fill import Filling

    runtime.start("cpu", precision, threads)
    fluid = Fluid(name="water", fill=FluidBox(lo=(0, 0, 0), hi=(1, 1, 1)), water=water or Water(tension=None), **settings)
    filling = Filling(np.asarray(points, float), len(points) * SPACING**3, SPACING, fluid.water.density)
    made = FluidBody([(fluid, filling)], gravity, walls, skin)
    made.start()
    return made


def rates(b, before: float, dt: float) -> bool:
    """Forces and density rates now; True when the particles were put in another order."""
    worn = b.follow(before)
    b.rates(before, dt)
    return worn


def box(x: float, y: float, z: float | None = None) -> list[Wall]:
    """Walls around [0, x] x [0, y] x [0, z]; z None: no lid."""
    walls = [Wall(point=(0, 0, 0), normal=n) for n in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
    walls += [Wall(point=(x, 0, 0), normal=(-1, 0, 0)), Wall(point=(0, y, 0), normal=(0, -1, 0))]
    return walls + ([Wall(point=(0, 0, z), normal=(0, 0, -1))] if z is not None else [])


def run(b, dt: float, steps: int, before: float = 0.0) -> None:
    """That many steps of dt; before: the step that led here."""
    for _ in range(steps):
        rates(b, before, dt)
        b.kick_and_drift(before, dt)
        before = dt


def by_id(b, name: str) -> np.ndarray:
    """A field of the pool in the order of the start."""
    return runtime.get(getattr(b.p, name), b.p.n)[np.argsort(runtime.get(b.p.id, b.p.n))]


def put(b, name: str, values: np.ndarray) -> None:
    """Set a field of the pool, given in the order of the start."""
    field = getattr(b.p, name)
    runtime.put(field, np.asarray(values, runtime.get(field, 1).dtype)[runtime.get(b.p.id, b.p.n)])


def unbalanced(b) -> float:
    """What the ledger leaves open, over what went through it."""
    e = b.energies()
    taken = e["viscous"] + e["diffused"] + e["lag"]
    return (e["kinetic"] + e["elastic"] + taken - e["external"] - e["injected"]) / (abs(e["external"]) + e["injected"] + taken)
