"""Contact at the own step of a fluid: particles that step once in several steps of the clock push a wall as those of every step do."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.scene import Fluid, FluidBox, Material, Numerics, Plate, Scene, Shell
from taichi_sph.world.world import World

D, SPEED, THICKNESS, SIDE = 5e-3, 10.0, 1e-3, 8
STEEL = Material(name="steel", young=210e9, poisson=0.3, density=7800.0)


def fallen(every: int, safety: float = 0.9) -> tuple[np.ndarray, float, float, dict[str, float]]:
    """A block of water, thrown at a free plate that pinballs alone keep it from: times [s] and momentum of the plate [kg m/s] (2, N), the
    fluid's own step [s], the change of the momentum of both over its size, the ledger."""
    bottom = 0.5 * THICKNESS + 0.24 * D + 2e-5  # the lowest layer stands half a spacing above
    fill = FluidBox(lo=(D, D, bottom), hi=((SIDE - 1) * D, (SIDE - 1) * D, bottom + 8 * D))
    scene = Scene(
        name="fallen", title="t", source="tests", duration=1e-3,
        shells=[Shell(name="plate", surface=Plate(length=SIDE * D, width=SIDE * D), thickness=THICKNESS, material=STEEL, motion="free")],
        fluids=[Fluid(name="water", fill=fill, spacing=D, velocity=(0, 0, -SPEED), every=every, contact="pinballs")],
        numerics=Numerics(spacing=D, time_step_safety=safety),
    )  # fmt: skip
    world = World(scene)
    nodes, p = world.shell.nodes, world.fluid.p
    mass = runtime.get(nodes.mass, nodes.n).astype(float)

    def momenta() -> tuple[np.ndarray, np.ndarray]:
        return mass @ runtime.get(nodes.v, nodes.n), p.one * runtime.get(p.v, p.n).sum(axis=0)

    total, rows = sum(momenta()), []
    while world.time < 1.2e-4:
        world.advance(1)
        rows.append((world.time, -momenta()[0][2]))
    lost = float(np.linalg.norm(sum(momenta()) - total) / np.linalg.norm(total))
    return np.array(rows).T, every * world.dt, lost, world.energies()


@pytest.fixture(scope="module")
def blocks() -> dict[int, tuple[np.ndarray, float, float, dict[str, float]]]:
    """By `every`."""
    return {every: fallen(every) for every in (1, 2, 4)}


@pytest.mark.long
def test_a_fluid_of_its_own_step_pushes_a_wall_as_one_of_every_step(blocks):
    (_, p), _, lost, ledger = blocks[1]
    assert lost < 1e-13 and abs(ledger["closed_residual_percent"]) < 0.3
    assert ledger["contact"] > 0.05 * ledger["injected"], "contact has stopped the water"
    for every in (2, 4):
        (_, pushed), _, lost, entries = blocks[every]
        assert lost < 1e-13
        assert abs(entries["closed_residual_percent"]) < 0.3
        assert pushed[-1] == pytest.approx(p[-1], rel=0.015)
        assert entries["contact"] == pytest.approx(ledger["contact"], rel=0.02)


@pytest.mark.long
@pytest.mark.xfail(reason="2.4 % of the end value beside the band, where 2 % was asked (docs/method.md, 11)", strict=True)
def test_its_blows_come_within_an_own_step(blocks):
    """A blow comes when the particle has its step: the wall is pushed as much as at `every` = 1, an own step sooner or later."""
    t, p = blocks[1][0]
    for every in (2, 4):
        (times, pushed), own, _, _ = blocks[every]
        slack = 0.02 * p[-1]
        inner = (times > t[0] + own) & (times < t[-1] - own)
        assert (pushed[inner] > np.interp(times[inner] - own, t, p) - slack).all()
        assert (pushed[inner] < np.interp(times[inner] + own, t, p) + slack).all()
