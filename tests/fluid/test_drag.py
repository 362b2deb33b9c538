"""A striker that flies through water by a law of drag: what it loses is the law's, and the water gets all of it."""

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.scene import Drag, Fluid, FluidBox, Meeting, Numerics, Pinball, Plate, Rigid, Scene, Shell, material

R, MASS, SPEED, C_D = 9e-3, 0.031, 730.0, 0.35
D = 14.4e-3  # m: the sphere is hardly wider than a particle


def shot(fluid=None, **changes):
    """A sphere before a block of water."""
    said = {
        "name": "shot",
        "title": "a sphere into water",
        "source": "tests",
        "rigids": [Rigid(name="ball", mass=MASS, pinballs=[Pinball(centre=(R + 1e-4, 0, 0), radius=R)], velocity=(-SPEED, 0, 0))],
        "fluids": [Fluid(name="water", fill=FluidBox(lo=(-10 * D, -5 * D, -5 * D), hi=(0, 5 * D, 5 * D)), delta=0.0, **(fluid or {}))],
        "interactions": [Drag(between=("ball", "water"), coefficient=C_D)],
        "duration": 1.2e-4,
        "numerics": Numerics(spacing=D, time_step_safety=0.75),
    }
    return Scene(**(said | changes))


def sheet(x):
    """A steel sheet of 120 x 120 mm about (x, 0, 0)."""
    surface = Plate(length=0.12, width=0.12, origin=(x - 0.06, -0.06, 0))
    return Shell(name="sheet", surface=surface, thickness=1e-3, material=material("steel, tank"), motion="free")


@pytest.mark.parametrize("every", [1, pytest.param(2, marks=pytest.mark.long)])
def test_it_loses_what_the_law_says_and_the_water_gets_it(every):
    from taichi_sph.world.world import World

    sim = World(shot({"every": every}, shells=[sheet(0.5)]) if every > 1 else shot())
    p, rigids = sim.fluid.p, sim.rigids
    mass = float(p.masses[0])
    way, speed = [], []
    while sim.time < 1.2e-4 * (1 - 1e-9):
        sim.advance(every)
        way.append(R + 1e-4 - runtime.get(rigids.x, 1)[0][0])
        speed.append(-runtime.get(rigids.v, 1)[0][0])
    start, s, v = MASS * SPEED, np.array(way), np.array(speed)
    momentum = mass * runtime.get(p.v, p.n).sum(axis=0) + MASS * runtime.get(rigids.v, 1)[0]
    assert np.abs(momentum - [-start, 0, 0]).max() < 1e-9 * start
    deep = (s > 2 * R) & (s < 8 * R)
    found = -2 * MASS / (1000 * np.pi * R**2) * np.polyfit(s[deep], np.log(v[deep]), 1)[0]
    assert found == pytest.approx(C_D, rel=0.1)
    energies = sim.energies()
    lost = 0.5 * MASS * (SPEED**2 - v[-1] ** 2)
    assert abs(energies["closed_residual_percent"]) < 0.5 and abs(energies["drag"]) < 1e-9 * lost
    # a cavity is open behind it: no water where it flew, and the water around goes outward
    x, u = runtime.get(p.x, p.n), runtime.get(p.v, p.n)
    off = np.hypot(x[:, 1], x[:, 2])
    beside = (-s[-1] + 2 * R < x[:, 0]) & (x[:, 0] < -R) & (off < 3 * R)
    assert off[beside].min() > R
    assert ((x[beside, 1] * u[beside, 1] + x[beside, 2] * u[beside, 2]) > 0).all()


def test_nothing_is_felt_far_from_the_water():
    from taichi_sph.world.world import World

    ball = Rigid(name="ball", mass=MASS, pinballs=[Pinball(centre=(0.1, 0, 0), radius=R)], velocity=(-SPEED, 0, 0))
    sim = World(shot(rigids=[ball]))
    sim.advance(5)
    assert runtime.get(sim.rigids.v, 1)[0].tolist() == [-SPEED, 0.0, 0.0]


@pytest.mark.long
def test_what_a_striker_touches_is_hidden_from_the_water():
    from taichi_sph.world.world import World

    water = Fluid(name="water", fill=FluidBox(lo=(-0.06, -0.06, -0.07), hi=(0.06, 0.06, -0.01)), delta=0.0)
    ball = Rigid(name="ball", mass=MASS, pinballs=[Pinball(centre=(0, 0, R + 1e-3), radius=R)], velocity=(0, 0, -SPEED))
    sim = World(shot(shells=[sheet(0.0)], fluids=[water], rigids=[ball], numerics=Numerics(spacing=0.012)))
    wetted = next(c.wetted for c in sim.couplings if hasattr(c, "wetted"))
    wetted.see(False)
    record = runtime.get(wetted.points.record, wetted.n)
    place, area = runtime.get(wetted.points.x, wetted.n), np.linalg.norm(record[:, 3:6], axis=1)
    near = np.linalg.norm(place - [0, 0, R + 1e-3], axis=1)
    assert (area[near < R + 5e-3] == 0).all() and (area[near > R + 10e-3] > 0).all() and (area == 0).any()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"interactions": [Drag(between=("boll", "water"), coefficient=0.35)]}, r"interactions\[0\].between: there is no body 'boll'"),
        ({"interactions": [Drag(between=("water", "ball"), coefficient=0.35)]}, r"between: 'water' is a fluid; give a rigid body there"),
        ({"meetings": [Meeting(between=("ball", "water"))]}, r"'ball' and 'water' have a meeting or a drag already"),
        (
            {"interactions": [Drag(between=("ball", "water"), coefficient=c) for c in (0.3, 0.4)]},
            r"interactions\[1\].between: 'ball' and 'water' have a meeting or a drag already",
        ),
    ],
)
def test_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        shot(**changes)
