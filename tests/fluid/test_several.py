"""Fluids of different density that meet: at rest, turned over, pushed by a ball; each as itself alone where they do not meet."""

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.errors import SceneError
from taichi_sph.scene import (
    Box,
    Cylinder,
    Fluid,
    FluidBox,
    Material,
    Meeting,
    Numerics,
    Pinball,
    PrescribedVelocity,
    Rigid,
    Scene,
    Shell,
    ShellFill,
    Wall,
    Water,
)

from ..exact import restarts_exactly

STEEL = Material(name="steel", young=210e9, poisson=0.3, density=7800.0)
D, G = 0.01, 9.81
STIRRED = 300  # steps


def planes(x: float, y: float) -> list[Wall]:
    """An open box [0, x] x [0, y] above z = 0."""
    at = {(1, 0, 0): 0.0, (-1, 0, 0): x, (0, 1, 0): 0.0, (0, -1, 0): y, (0, 0, 1): 0.0}
    return [Wall(point=[a * abs(n) for n in normal], normal=normal) for normal, a in at.items()]


def layers(low: float, high: float, across=(0.08, 0.08), deep: float = 0.08, sound: float = 20.0, **more) -> Scene:
    """Two layers of those densities [kg/m3], each `deep` [m]."""
    x, y = across
    fluids = [
        Fluid(
            name=name,
            fill=FluidBox(lo=(0, 0, k * deep), hi=(x, y, (k + 1) * deep)),
            water=Water(density=density, sound=sound, tension=None),
            **more,
        )
        for k, (name, density) in enumerate({"below": low, "above": high}.items())
    ]
    return Scene(
        name="layers", title="layers", source="tests", fluids=fluids, walls=planes(x, y), gravity=(0, 0, -G), duration=10.0,
        numerics=Numerics(spacing=D),
    )  # fmt: skip


def start(scene: Scene, threads: int | None = 1):
    from taichi_sph.world.world import World

    return World(scene, threads=threads)


def closed(sim) -> float:
    return abs(sim.energies()["closed_residual_percent"])


def test_fuel_over_water_at_rest_stays_at_rest():
    """800 over 1000 kg/m3: the pressure is that of what stands above, and one across the interface."""
    sim = start(layers(1000.0, 800.0))
    assert closed(sim) == 0.0  # before the first step
    sim.advance_to(0.4)
    below, above = (sim.frame().body(name) for name in ("below", "above"))
    speed = max(np.linalg.norm(body.point_data["velocity"], axis=1).max() for body in (below, above))
    fits = {}
    for body, density in ((below, 1000.0), (above, 800.0)):
        z, p = body.points[:, 2], body.point_data["pressure"]
        inner = (z % 0.08 > 2 * D) & (z % 0.08 < 0.08 - 2 * D)
        slope, at = np.polyfit(z[inner] - 0.08, p[inner], 1)
        fits[density] = (-slope / (density * G), at)
    jump = abs(fits[1000.0][1] - fits[800.0][1]) / (800.0 * G * 0.08)
    print(f"speed {speed / np.sqrt(G * 0.16):.4f} of sqrt(g h), slopes {fits[1000.0][0]:.4f} {fits[800.0][0]:.4f}, jump {jump:.4f}")
    assert speed < 1e-3 * np.sqrt(G * 0.16)
    assert all(slope == pytest.approx(1.0, abs=0.03) for slope, _ in fits.values())
    assert jump < 2e-3 and fits[800.0][1] == pytest.approx(800.0 * G * 0.08, rel=0.03)
    assert below.points[:, 2].max() < above.points[:, 2].min() and closed(sim) < 1.0


def test_two_fluids_of_one_density_are_one():
    """To rounding."""
    scene = layers(1000.0, 1000.0, alpha=0.05, delta=0.0)
    fill = FluidBox(lo=(0, 0, 0), hi=(0.08, 0.08, 0.16))
    whole = scene.fluids[0].model_copy(update={"name": "whole", "fill": fill})
    places = []
    for fluids in (scene.fluids, (whole,)):
        sim = start(scene.model_copy(update={"fluids": fluids}))
        f = sim.fluid
        v = 0.5 * np.sin(40 * f.points[:, [1, 2, 0]])
        runtime.put(f.p.v, v[runtime.get(f.p.id, f.p.n)])
        sim.advance(100)
        places.append(runtime.get(f.p.x, f.p.n)[f.numbered()])
        moved = np.abs(places[-1] - f.points).max()
    print(f"{np.abs(places[0] - places[1]).max():.1e} m of {moved:.1e} m")
    assert moved > 1e-3 and np.abs(places[0] - places[1]).max() < 1e-11


def test_momentum_and_energy_of_a_mixture_close():
    """A drop of two fluids, thrown together: what viscosity, diffusion and lag take is booked, and momentum stays."""
    scene = layers(1000.0, 500.0, across=(0.06, 0.06), deep=0.05, sound=50.0, alpha=0.2, beta=1.0)
    numerics = Numerics(spacing=D, time_step_safety=0.3)
    sim = start(scene.model_copy(update={"walls": (), "gravity": None, "numerics": numerics}))
    f = sim.fluid
    runtime.put(f.p.v, np.sin(40 * runtime.get(f.p.x, f.p.n)[:, [1, 2, 0]]))
    mass = runtime.get(f.p.mass, f.p.n)
    v = runtime.get(f.p.v, f.p.n)
    f.injected = f.compressed + 0.5 * float((mass[:, None] * v**2).sum())
    before = (mass[:, None] * v).sum(axis=0)
    sim.advance(200)
    after = (runtime.get(f.p.mass, f.p.n)[:, None] * runtime.get(f.p.v, f.p.n)).sum(axis=0)
    e = f.energies()
    left = e["kinetic"] + e["elastic"] + e["viscous"] + e["diffused"] + e["lag"] - e["injected"]
    print(np.abs(after - before).max() / np.abs(mass[:, None] * v).sum(), left / e["injected"])
    assert np.abs(after - before).max() < 1e-12 * np.abs(mass[:, None] * v).sum()
    assert abs(left) < 5e-3 * e["injected"]


def test_contact_knows_whose_each_particle_is():
    """Particles change places in the pool: a mover, its ball and its pushes go with them."""
    scene = layers(1000.0, 800.0, across=(0.08, 0.04), contact="pinballs", hydrostatic=False)
    fills = (FluidBox(lo=(x, 0, 0), hi=(x + 0.04, 0.04, 0.04)) for x in (0, 0.04))  # side by side
    fluids = tuple(fluid.model_copy(update={"fill": fill}) for fluid, fill in zip(scene.fluids, fills))
    ball = Rigid(name="ball", mass=0.01, pinballs=[Pinball(centre=(0.04, 0.02, 0.06), radius=0.01)], velocity=(0, 0, -4.0))
    scene = scene.model_copy(update={"fluids": fluids, "rigids": (ball,)})
    sim = start(scene)
    sim.advance_to(5e-3)
    port, p = sim.contact.port, sim.fluid.p
    (surface,) = (s for s in port.surfaces if s.loose)
    body, own = runtime.get(p.body, p.n), slice(surface.first.mover, surface.first.mover + p.n)
    assert (np.diff(body) < 0).any(), "they stand in the order of their cells, not of their fluids"
    assert (runtime.get(port.body, port.n)[own] == surface.first.body + body).all()
    assert (runtime.get(port.ball_body, port.n_balls)[surface.first.ball :][: p.n] == surface.first.body + body).all()
    assert sim.energies()["contact"] > 0.01 and closed(sim) < 1.0
    whose, half = runtime.get(port.body, port.n), sim.state()
    again = start(scene)
    again.restore(half)
    assert (runtime.get(again.contact.port.body, again.contact.port.n) == whose).all(), "a restart knows as well"


def test_restart_is_exact_once_the_fluids_have_mixed_in_their_pool():
    """A ball stirs them. Particles are put in order by where they are: a place in the pool is then of another fluid than in a new world."""
    ball = Rigid(name="ball", mass=0.2, pinballs=[Pinball(centre=(0.04, 0.04, 0.2), radius=0.02)], velocity=(0, 0, -8.0))
    scene = layers(400.0, 1000.0).derive(rigids=[ball])
    sim = start(scene)
    whose = runtime.get(sim.fluid.p.body, sim.fluid.p.n)
    sim.advance(STIRRED)
    assert (whose != runtime.get(sim.fluid.p.body, sim.fluid.p.n)).any()
    restarts_exactly(lambda: start(scene), STIRRED, 40)


@pytest.mark.long
def test_heavy_over_light_turns_over():
    """A slab of two waves: a sine of the interface grows like cosh(sigma t), sigma^2 = A g k tanh(k h), within what eight
    particles to a quarter wave resolve; then the heavy fluid falls and its potential energy with it."""
    length, deep = 0.32, 0.16
    scene = layers(500.0, 1000.0, across=(length, 3 * D), deep=deep, alpha=0.02, hydrostatic=True)
    sim = start(scene)
    f = sim.fluid
    k = 2 * np.pi / length
    rate = np.sqrt(G * k * np.tanh(k * deep) / 3.0)  # Atwood number 1/3
    p = f.points
    bump = 0.05 * np.cos(k * p[:, 0]) * np.exp(-k * np.abs(p[:, 2] - deep)) * np.sqrt(G * deep)
    v = np.zeros((f.p.n, 3))
    v[:, 2] = bump
    runtime.put(f.p.v, v[runtime.get(f.p.id, f.p.n)])

    def swing() -> float:
        x = runtime.get(f.p.x, f.p.n)[f.numbered()]
        near = np.abs(p[:, 2] - deep) < 2 * D
        return float(2 * ((x[near, 2] - p[near, 2]) * np.cos(k * p[near, 0])).mean())

    mass = f.p.masses[f.p.of]
    height = float(mass @ p[:, 2])
    times, sizes = [], []
    for t in np.linspace(0.02, 1.6 / rate, 9):
        sim.advance_to(t)
        times.append(sim.time)
        sizes.append(swing())
    # bump / sigma sinh(sigma t): the ratio of two times gives sigma
    from scipy.optimize import brentq

    found = brentq(lambda s: np.sinh(s * times[-1]) / np.sinh(s * times[2]) - sizes[-1] / sizes[2], 0.05 * rate, 5 * rate)
    sim.advance_to(7.0 / rate)
    x = runtime.get(f.p.x, f.p.n)[f.numbered()]
    heavy = f.p.of == 1
    print(f"growth {found / rate:.3f} of the inviscid; heavy sank {x[heavy, 2].mean() - p[heavy, 2].mean():.4f} m; {closed(sim):.3f} %")
    assert 0.6 < found / rate < 1.4
    assert float(mass @ x[:, 2]) < height and x[heavy, 2].mean() < p[heavy, 2].mean() - 0.03
    assert closed(sim) < 4.0


def tank(name: str, x: float) -> tuple[Shell, Fluid, PrescribedVelocity]:
    surface = Cylinder(radius=0.03, length=0.06, ends="discs", origin=(x, 0, 0))
    shell = Shell(name=name, surface=surface, thickness=1e-3, material=STEEL, motion="free")
    water = Fluid(name=f"water_{name}", fill=ShellFill(shell=name), velocity=(1.0 + x, 0, 0))
    held = PrescribedVelocity(body=name, where=Box(), velocity=(0, 0, 0), spin=(0, 0, 0))
    return shell, water, held


def tanks(*which: int, apart: bool = True) -> Scene:
    made = [tank(*(("left", 0.0), ("right", 0.2))[k]) for k in which]
    meetings = [Meeting(between=("water_left", "water_right"), meet=False)] if apart and len(which) == 2 else []
    return Scene(
        name="tanks", title="tanks", source="tests", shells=[m[0] for m in made], fluids=[m[1] for m in made], motions=[m[2] for m in made],
        meetings=meetings, duration=1e-3, numerics=Numerics(spacing=D, time_step_safety=0.5),
    )  # fmt: skip


@pytest.mark.long
def test_two_tanks_apart_are_each_as_alone():
    """Their waters do not meet, so that each has its own lists: bit for bit at the same step."""
    both = start(tanks(0, 1))
    dt = both.dt
    frames = {}
    both.advance(30)
    frames = {body.name: body for body in both.frame().bodies}
    rows = both.tracks()
    assert set(rows) == {"leak_water_left", "leak_water_right"} and all(row["escaped_count"] == 0 for row in rows.values())
    for k, name in enumerate(("left", "right")):
        alone = start(tanks(k))
        alone.dt = dt
        alone.advance(30)
        for body in alone.frame().bodies:
            assert np.array_equal(body.points, frames[body.name].points), name
            assert np.array_equal(body.point_data["velocity"], frames[body.name].point_data["velocity"]), name


@pytest.mark.long
def test_tanks_of_other_levels_are_each_evened_out_as_alone():
    """Their waters stand in one pool; the free level of each is its own. The rounds go on until both are even."""

    def level(scene: Scene, levels: tuple[float, ...]) -> Scene:
        fills = (f.model_copy(update={"fill": f.fill.model_copy(update={"level": z})}) for f, z in zip(scene.fluids, levels))
        return scene.model_copy(update={"fluids": tuple(fills)})

    both = start(level(tanks(0, 1, apart=False), (0.03, 0.05)))
    assert len([group for group in both.groups if group.kind == "fluid"]) == 1
    parts = np.split(both.fluid.points, [both.fluid.spans[1].first])
    for k, z in enumerate((0.03, 0.05)):
        alone = start(level(tanks(k), (z,))).fluid.points
        assert parts[k] == pytest.approx(alone, abs=0.03 * D)


def test_what_cannot_stand_in_one_pool_is_said():
    scene = layers(1000.0, 800.0)
    pinballs = scene.fluids[0].model_copy(update={"contact": "pinballs"})
    with pytest.raises(SceneError, match="can meet, but not with one `contact` each"):
        start(scene.model_copy(update={"fluids": (pinballs, scene.fluids[1])}))
    walls = (*scene.walls[:4], scene.walls[4].model_copy(update={"fluids": ("below",)}))
    with pytest.raises(SceneError, match="but not between walls that hold one and not the other"):
        start(scene.model_copy(update={"walls": walls}))
