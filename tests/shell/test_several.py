"""Several shells in one scene: each moves as if it were alone, and a second one compiles nothing."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph.runtime import ti
from taichi_sph.scene import (
    Box,
    Collocation,
    Cut,
    Delay,
    InitialVelocity,
    Material,
    Mazars,
    Meeting,
    NodalForce,
    NodalMoment,
    Numerics,
    Plate,
    Power,
    PrescribedVelocity,
    Scene,
    Shell,
    SurfacePressure,
)
from taichi_sph.world.world import World

D = 1e-3  # m
SIDE = 10 * D
CONCRETE = {"name": "concrete", "young": 32e9, "poisson": 0.2, "density": 2450.0}
BRITTLE = {"damage": Mazars(threshold=8.5e-5, A=1, B=7300), "delay": Delay(a=10, tau_c=1e-6), "critical_damage": 0.99}
METAL = {"name": "steel", "young": 210e9, "poisson": 0.3, "density": 7800.0, "strength": Power(A=2e8, B=4e8, n=0.4)}
NEAR = (0.0, SIDE + 0.5 * D, 0.0)  # half a spacing beside the first plate


def shell(name: str, origin: tuple[float, float, float], **more) -> Shell:
    given = {"thickness": 2e-3, "material": CONCRETE, "motion": "in_plane"} | more
    material = Material(**given.pop("material"))
    surface = Plate(length=SIDE, width=SIDE, origin=origin)
    return Shell(name=name, surface=surface, material=material, **given)


def scene(shells: list[Shell], numerics: dict | None = None, **more) -> Scene:
    if len(shells) > 1 and any(one.motion == "free" for one in shells):
        names = [one.name for one in shells]
        pairs = [(a, b) for k, a in enumerate(names) for b in names[k + 1 :]]
        more = {"meetings": [Meeting(between=pair, meet=False) for pair in pairs]} | more
    settings = {"spacing": D, "irregularity": 0.15, "time_step_safety": 0.5} | (numerics or {})
    given = {"duration": 1e-4} | more
    return Scene(name="several", title="Several plates", source="tests", shells=shells, numerics=Numerics(**settings), **given)


def end(axis: int, at: float, beyond: bool) -> Box:
    lo, hi = [None] * 3, [None] * 3
    (lo if beyond else hi)[axis] = at
    return Box(lo=tuple(lo), hi=tuple(hi))


def torn(name: str, origin: tuple[float, float, float], formulation: str) -> tuple[Shell, dict]:
    """A cracked brittle plate that is pulled apart along y."""
    x, y, _ = origin
    cut = Cut(start=(x, y + 0.5 * SIDE, 0.0), end=(x + 0.3 * SIDE, y + 0.5 * SIDE, 0.0))
    pull = 2.6e4 * SIDE  # N
    loads = {
        "forces": [
            NodalForce(body=name, where=end(1, y + SIDE - 1e-6, True), total=(0.0, pull, 0.0)),
            NodalForce(body=name, where=end(1, y + 1e-6, False), total=(0.0, -pull, 0.0)),
        ]
    }
    return shell(name, origin, material=CONCRETE | BRITTLE, cuts=[cut]), loads


def hit(name: str, origin: tuple[float, float, float]) -> tuple[Shell, dict]:
    """A metal plate, held along one side, whose other side starts to move across it: it yields."""
    x = origin[0]
    loads = {
        "motions": [PrescribedVelocity(body=name, where=end(0, x + 1e-6, False), velocity=(0, 0, 0), spin=(0, 0, 0))],
        "initial": [InitialVelocity(body=name, where=end(0, x + 0.7 * SIDE, True), velocity=(40.0, 0.0, -60.0))],
    }
    return shell(name, origin, material=METAL, motion="free"), loads


def pressed(name: str, origin: tuple[float, float, float]) -> tuple[Shell, dict]:
    """A brittle plate, clamped along one side, under a pressure that breaks it, and a moment on the other side."""
    x = origin[0]
    loads = {
        "motions": [PrescribedVelocity(body=name, where=end(0, x + 1e-6, False), velocity=(0, 0, 0), spin=(0, 0, 0))],
        "pressures": [SurfacePressure(body=name, value=1.5e6)],
        "moments": [NodalMoment(body=name, where=end(0, x + SIDE - 1e-6, True), total=(0.0, 0.05, 0.0))],
    }
    return shell(name, origin, material=CONCRETE | BRITTLE, motion="free"), loads


def together(*parts: tuple[Shell, dict], **more) -> Scene:
    loads: dict[str, list] = {}
    for _, own in parts:
        for key, entries in own.items():
            loads.setdefault(key, []).extend(entries)
    return scene([one for one, _ in parts], **(loads | more))


def stepped(sim: World, steps: int, dt: float | None = None) -> World:
    """That many steps of dt, whatever the stable step says."""
    dt = sim.dt if dt is None else dt
    for _ in range(steps):
        sim.dt = dt
        sim.advance(1)
    return sim


def arrays(sim: World, name: str) -> dict[str, np.ndarray]:
    """All that a frame knows of a body."""
    body = sim.frame().body(name)
    return {"points": body.points, "cells": body.cells, **body.point_data, **body.cell_data}


def differing(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> list[str]:
    assert set(a) == set(b)
    return [name for name in a if a[name].tobytes() != b[name].tobytes()]


PAIRS = {
    "brittle": (lambda name, origin: torn(name, origin, "galerkin"), {}, 150),
    "collocation": (lambda name, origin: torn(name, origin, "collocation"), {"formulation": Collocation()}, 150),
    "metal": (hit, {}, 60),
    "pressed": (pressed, {}, 120),
}


@pytest.mark.parametrize("kind", PAIRS)
def test_each_of_two_plates_moves_as_if_it_were_alone(kind):
    """Bit for bit, though the second stands half a spacing beside the first; and with the same kernels."""
    make, numerics, steps = PAIRS[kind]
    one, two = make("one", (0.0, 0.0, 0.0)), make("two", NEAR)
    pair = World(together(one, two, numerics=numerics))
    dt = pair.dt
    stepped(pair, steps)
    compiled, found = instances(), {name: arrays(pair, name) for name in ("one", "two")}
    assert len(pair.groups) == 1
    assert (pair.status()["broken"] > 0) == (kind != "metal")
    assert kind != "metal" or found["one"]["plastic"].max() > 1e-4
    for part in (one, two):
        alone = stepped(World(together(part, numerics=numerics)), steps, dt)
        assert instances() == compiled, "a second shell compiles nothing"
        assert differing(found[part[0].name], arrays(alone, part[0].name)) == []


def instances() -> dict[str, int]:
    """How often each kernel of the package has been compiled since the start."""
    made = [k for k in ti.lang.impl.get_runtime().kernels if k.compiled_kernels and k.func.__module__.startswith("taichi_sph.")]
    return {f"{k.func.__module__}.{k.func.__qualname__}": len(k.compiled_kernels) for k in made}
