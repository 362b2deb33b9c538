"""Pressure of water on shells and rigid bodies: closed forms, exact power, no loss in a blow."""

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.bodies.fluid.columns import STIFFNESS
from taichi_sph.bodies.rigid.surface import _of_pinballs
from taichi_sph.scene import (
    Box,
    Cylinder,
    Fluid,
    FluidBox,
    Hole,
    Material,
    Numerics,
    Pinball,
    Plate,
    PrescribedVelocity,
    Rigid,
    Scene,
    Shell,
    ShellFill,
    Wall,
    Water,
)

STEEL = Material(name="steel", young=210e9, poisson=0.3, density=7800.0)
D = 0.0125
BULLET = Rigid(name="bullet", mass=0.1, pinballs=[Pinball(centre=(0, 0, 0.05 + 0.01 * k), radius=0.015) for k in range(3)])


def can(level=None, rigids=(), **water) -> Scene:
    return Scene(
        name="can",
        title="a can",
        source="tests",
        shells=[Shell(name="can", surface=Cylinder(radius=0.06, length=0.15, ends="discs"), thickness=1e-3, material=STEEL, motion="free")],
        fluids=[Fluid(name="water", fill=ShellFill(shell="can", level=level), alpha=0.0, delta=0.0, **water)],
        rigids=rigids,
        duration=1e-3,
        numerics=Numerics(spacing=D),
    )


def plane(above: float) -> Scene:
    """A few particles `above` [m] a held plate."""
    box = FluidBox(lo=(-0.01, -0.01, above), hi=(0.01, 0.01, above + 0.02))
    return Scene(
        name="plane",
        title="particles on a plate",
        source="tests",
        shells=[
            Shell(
                name="plate", surface=Plate(length=0.3, width=0.3, origin=(-0.15, -0.15, 0)), thickness=1e-3, material=STEEL, motion="free"
            )
        ],
        motions=[PrescribedVelocity(shell="plate", where=Box(), velocity=(0, 0, 0), spin=(0, 0, 0))],
        fluids=[Fluid(name="water", fill=box, spacing=0.02, alpha=0.0, delta=0.0, velocity=(0, 0, -40.0), water=Water(tension=None))],
        duration=1e-3,
        numerics=Numerics(spacing=0.016),
    )


def start(scene):
    from taichi_sph.world.world import World

    return World(scene, threads=1)


def wetted(sim):
    """The points that water presses on."""
    return next(c.wetted for c in sim.couplings if hasattr(c, "wetted"))


def look(sim, before: float = 0.0) -> bool:
    """What the particles see now; True when they were put in another order."""
    worn = sim.fluid.follow(before)
    wetted(sim).see(worn)
    return worn


def rates(sim, before: float, dt: float) -> bool:
    """Forces of the fluid and of its pressure on all else."""
    worn = look(sim, before)
    sim.fluid.rates(before, dt)
    wetted(sim).bear()
    return worn


def powers(sim):
    """With water that is shaken: what its density stores [W], the power of its forces on particles, and those forces (N, 3). The caller
    adds what other bodies, whose velocities are set, feel."""
    f, p = sim.fluid, sim.fluid.p
    rng = np.random.default_rng(3)
    runtime.put(p.x, runtime.get(p.x, p.n) + 0.1 * p.finest * rng.uniform(-1, 1, (p.n, 3)))
    runtime.put(p.v, rng.normal(size=(p.n, 3)))
    runtime.put(p.s, rng.uniform(1e-4, 1e-3, p.n))
    f.sort()  # here, so that rates() leaves the order
    before, dt = runtime.get(p.s, p.n), 1e-5
    assert not rates(sim, dt, 1e-6)
    # s grows by dt (rate of the fluid - (1 + s) 2 w.v)
    div = -(runtime.get(p.s, p.n) - before) / dt / (1 + before)
    assert np.abs(div + runtime.get(p.rate, p.n) / (1 + before)).max() > 1  # surfaces do some of it
    pair, force = runtime.get(p.pair, p.n), runtime.get(p.force, p.n)
    return (np.abs(pair[:, 3]) ** 3 * pair[:, 7] * div).sum(), (force * runtime.get(p.v, p.n)).sum(), force


def shake(nodes) -> None:
    """Velocities at random for nodes of a shell or a solid, and no force yet."""
    runtime.put(nodes.v, np.random.default_rng(4).normal(size=(nodes.n, 3)))
    runtime.put(nodes.force, np.zeros((nodes.n, 3)))


def integral(d: float, h: float) -> float:
    """W2 over a plane at the distance d [1/m]."""
    r = np.linspace(0, 2 * h, 20001)
    q = np.sqrt(r * r + d * d) / h
    w = np.where(q < 2, 21 / (16 * np.pi * h**3) * (1 - q / 2) ** 4 * (1 + 2 * q), 0.0)
    return float(np.trapezoid(2 * np.pi * r * w, r))


@pytest.mark.parametrize("above", [0.4, 0.5, 0.8, 1.2])
def test_facets_of_a_plane_give_its_integral(above):
    d = 0.02
    sim = start(plane(0.5e-3 + (above - 0.5) * d))
    f = sim.fluid
    look(sim)
    side = runtime.get(f.surroundings.side, f.p.n)
    assert side[0, :3] == pytest.approx([0, 0, 1], abs=5e-3)
    # stress 1 on every particle: what the nodes get is V w
    runtime.put(f.surroundings.stress, np.ones(f.p.n))
    runtime.put(sim.shell.nodes.force, np.zeros((sim.shell.nodes.n, 3)))
    wetted(sim).bear()
    assert wetted(sim).n == sim.shell.nodes.n and f.p.n == 1
    assert -runtime.get(sim.shell.nodes.force, sim.shell.nodes.n).sum(axis=0)[2] == pytest.approx(
        integral(above * d, f.support * d), rel=0.01
    )


@pytest.mark.long
@pytest.mark.parametrize("above", [0.5, 1.0, 1.5])
def test_an_even_wall_is_covered_whole(above):
    d = 0.02
    sim = start(plane(0.5e-3 + (above - 0.5) * d))
    look(sim)
    assert runtime.get(sim.fluid.surroundings.cover, 1)[0] == pytest.approx(1.0, abs=0.015)


def divided(low: float, high: float):
    """Forces (N, 3) [N] on water from z = low to high [m] about a held plate, at random velocities and pressures, by their places, and the
    rates of their densities."""
    d, half = 0.02, 0.5e-3
    scene = plane(half)
    pieces = [np.arange(-0.06, 0.06 - 1e-9, d) + 0.5 * d] * 2
    z = np.array([half + (k + 0.5) * d for k in range(4)])
    z = np.concatenate([-z[::-1], z])
    z = z[(z > low) & (z < high)]
    points = np.stack(np.meshgrid(*pieces, z, indexing="ij"), axis=-1).reshape(-1, 3)
    sim = start(
        scene.model_copy(
            update={
                "fluids": (
                    scene.fluids[0].model_copy(update={"fill": FluidBox(lo=(-0.06, -0.06, half), hi=(0.06, 0.06, half + d * len(z)))}),
                )
            }
        )
    )
    f = sim.fluid
    assert f.p.n == len(points)
    # of each place its own numbers, whatever else is there
    key = np.round(points / d * 2).astype(int) @ [1, 40, 1600]
    noise = np.array([np.random.default_rng(abs(k) + 10**6 * (k < 0)).uniform(-1, 1, 4) for k in key])
    runtime.put(f.p.x, points)
    runtime.put(f.p.v, noise[:, :3])
    runtime.put(f.p.s, 1e-3 * (2 + noise[:, 3]))
    runtime.put(f.p.id, np.arange(len(points), dtype=np.int32))
    f.sort()
    wetted(sim).relist()
    rates(sim, 0.0, 1e-6)
    back = np.argsort(runtime.get(f.p.id, f.p.n))
    return points, runtime.get(f.p.force, f.p.n)[back], runtime.get(f.p.rate, f.p.n)[back]


@pytest.mark.long
def test_past_the_rim_of_a_plate_one_pressure_pushes_nothing():
    """Water on both sides of a plate and beyond its rim, where some of each kernel sees past it: at one pressure what is left is the
    noise of a lattice beside facets."""
    d, half = 0.02, 0.5e-3
    x = (np.arange(10) - 4.5) * d
    z = half + (np.arange(5) + 0.5) * d
    points = np.stack(np.meshgrid(x, x, np.concatenate([-z[::-1], z]), indexing="ij"), axis=-1).reshape(-1, 3)
    scene = plane(half)
    shell = scene.shells[0].model_copy(update={"surface": Plate(length=0.3, width=0.3, origin=(-0.3, -0.15, 0))})  # rim at x = 0
    fill = FluidBox(lo=(-0.1, -0.1, half), hi=(0.1, 0.1, half + 10 * d))
    sim = start(
        scene.model_copy(update={"shells": (shell,), "fluids": (scene.fluids[0].model_copy(update={"fill": fill, "velocity": (0, 0, 0)}),)})
    )
    f = sim.fluid
    assert f.p.n == len(points)
    runtime.put(f.p.x, points)
    runtime.put(f.p.s, np.full(f.p.n, 1e-3))
    f.sort()
    wetted(sim).relist()
    rates(sim, 0.0, 1e-9)
    now, force = runtime.get(f.p.x, f.p.n), runtime.get(f.p.force, f.p.n)
    inner = (np.abs(now) < 0.05).all(axis=1)  # the piece of water ends at 0.1 m
    push = np.abs(force[inner]).max() / (f.constants[0, STIFFNESS] * 1e-3 * d**2)
    print(f"{push:.3f} of p D^2")
    assert push < 0.1


@pytest.mark.long
def test_water_does_not_see_through_a_wall():
    """What is behind a plate changes nothing before it."""
    points, force, rate = divided(-1.0, 1.0)
    upper, alone, rate_alone = divided(0.0, 1.0)
    above = points[:, 2] > 0
    assert above.sum() == len(upper) == len(points) // 2 and np.allclose(points[above], upper)
    middle = (np.abs(upper[:, :2]) < 0.03).all(axis=1)  # the pieces end at 0.06 m, the plate at 0.15
    print(
        np.abs(force[above] - alone)[middle].max() / np.abs(alone).max(),
        np.abs(rate[above] - rate_alone)[middle].max() / np.abs(rate_alone).max(),
    )
    assert np.abs(force[above] - alone)[middle].max() < 0.01 * np.abs(alone).max()
    assert np.abs(rate[above] - rate_alone)[middle].max() < 0.01 * np.abs(rate_alone).max()


@pytest.mark.parametrize("thickness", [1e-3, pytest.param(2e-4, marks=pytest.mark.long)])
def test_a_plate_between_two_waters_swings_and_nothing_comes_through(thickness):
    """Light between two heavy layers: the step of the fluid holds (fluid_body.SWING), the balance closes, no particle changes its side."""
    d, half = 0.02, 0.08
    edges = [
        Box(hi=(-half + 4e-3, None, None)),
        Box(lo=(half - 4e-3, None, None)),
        Box(hi=(None, -half + 4e-3, None)),
        Box(lo=(None, half - 4e-3, None)),
    ]
    scene = plane(0.5e-3)
    shell = scene.shells[0].model_copy(
        update={"surface": Plate(length=2 * half, width=2 * half, origin=(-half, -half, 0)), "thickness": thickness}
    )
    box = FluidBox(lo=(-half, -half, 0.5 * thickness), hi=(half, half, 0.5 * thickness + 8 * d))
    water = scene.fluids[0].model_copy(update={"fill": box, "alpha": 0.02, "velocity": (0, 0, 0)})
    walls = tuple(Wall(point=[-half * n for n in normal], normal=normal) for normal in ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)))
    motions = tuple(PrescribedVelocity(shell="plate", where=where, velocity=(0, 0, 0), spin=(0, 0, 0)) for where in edges)
    sim = start(scene.model_copy(update={"shells": (shell,), "fluids": (water,), "walls": walls, "motions": motions, "duration": 1.0}))
    f = sim.fluid
    x = runtime.get(f.p.x, f.p.n)
    below = x[:, 2] > 0.5 * thickness + 4 * d
    x[below, 2] = 4 * d - x[below, 2]  # the upper half of the box, mirrored
    runtime.put(f.p.x, x)
    start_z = x[np.argsort(runtime.get(f.p.id, f.p.n)), 2]
    runtime.put(f.p.s, np.random.default_rng(0).uniform(0, 1e-4, f.p.n))
    f.sort()
    wetted(sim).relist()
    f.injected = f.compressed = f.stored()
    sim.advance(1000)
    e = sim.energies()
    print(e["closed_residual_percent"], e["kinetic"], f.injected)
    assert abs(e["closed_residual_percent"]) < 0.5 and e["kinetic"] < f.injected
    back = np.argsort(runtime.get(f.p.id, f.p.n))
    assert ((runtime.get(f.p.x, f.p.n)[back, 2] > 0) == (start_z > 0)).all()  # each on its side


@pytest.mark.parametrize(
    "rigids, walled", [*(pytest.param((), walled, marks=pytest.mark.long) for walled in (False, True)), ((BULLET,), False)]
)
def test_pressure_does_the_work_that_the_density_stores(rigids, walled):
    """sum f.v over particles, nodes and bodies = sum V p div v, at any positions and velocities, between planes too."""
    scene = can(rigids=rigids)
    if walled:
        hole = Hole(centre=(0, -0.045, 0.03), radius=0.01)
        walls = (Wall(point=(0.045, 0, 0), normal=(-1, 0, 0)), Wall(point=(0, -0.045, 0), normal=(0, 1, 0), hole=hole))
        scene = scene.model_copy(update={"walls": walls})
    if rigids:
        scene = scene.model_copy(update={"fluids": (scene.fluids[0].model_copy(update={"fill": ShellFill(shell="can", level=0.04)}),)})
    sim = start(scene)
    nodes, rng = sim.shell.nodes, np.random.default_rng(5)
    shake(nodes)
    if rigids:
        runtime.put(sim.rigids.x, np.array([[0.01, -0.01, 0.055]]))
        runtime.put(sim.rigids.v, rng.normal(size=(1, 3)))
        runtime.put(sim.rigids.L, 1e-5 * rng.normal(size=(1, 3)))
    stored, done, felt = powers(sim)
    push = runtime.get(nodes.force, nodes.n)
    done += (push * runtime.get(nodes.v, nodes.n)).sum()
    force = felt.sum(axis=0) + push.sum(axis=0)
    if rigids:
        from taichi_sph.bodies.rigid.pool import spins

        body, turn = runtime.get(sim.rigids.force, 1)[0], runtime.get(sim.rigids.torque, 1)[0]
        assert np.linalg.norm(body) > 0.1  # the body is wet
        done += body @ runtime.get(sim.rigids.v, 1)[0] + turn @ spins(sim.rigids)[0]
        force += body
    assert done == pytest.approx(stored, rel=1e-9)
    assert walled or np.abs(force).max() < 1e-9 * np.abs(felt).sum()


@pytest.mark.long
def test_even_water_under_pressure_stays_and_presses_on_its_can():
    """A full can at one pressure: the walls bear it, and nothing is driven by more than 0.12 p D^2 but in the corner of disc and wall."""
    sim = start(can())
    f, p = sim.fluid, sim.fluid.p
    runtime.put(p.s, np.full(p.n, 1e-3))
    runtime.put(sim.shell.nodes.force, np.zeros((sim.shell.nodes.n, 3)))
    rates(sim, 0.0, 1e-6)
    pressure = f.constants[0, STIFFNESS] * 1e-3
    driven = np.linalg.norm(runtime.get(p.force, p.n), axis=1) / (pressure * p.spacing**2)
    x = runtime.get(p.x, p.n)
    corner = (np.hypot(x[:, 0], x[:, 1]) > 0.06 - 1.5 * D) & (np.minimum(x[:, 2], 0.15 - x[:, 2]) < 1.5 * D)
    assert driven[~corner].max() < 0.12 and driven.mean() < 0.05 and driven.max() < 0.3, (driven[~corner].max(), driven.max())
    # sum F.x over the shell = 3 p V; the kernels of the layer along the wall carry a little less, 8 % here where the can is 9.5 D wide
    x, force = sim.shell.mesh.points, runtime.get(sim.shell.nodes.force, sim.shell.nodes.n)
    volume = np.pi * 0.0595**2 * 0.149
    assert (force * (x - [0, 0, 0.075])).sum() == pytest.approx(3 * pressure * volume, rel=0.1)


@pytest.mark.long
def test_a_drop_bounces_off_a_plate_without_loss():
    sim = start(plane(0.01))
    sim.advance_to(8e-4)
    entries = sim.energies()
    assert runtime.get(sim.fluid.p.v, 1)[0, 2] > 0.98 * 40.0
    assert entries["contact"] < 1e-3 * entries["injected"] and abs(entries["closed_residual_percent"]) < 1.0


def test_a_rigid_surface_is_closed_and_has_its_area():
    one = Rigid(name="ball", mass=0.1, pinballs=[Pinball(centre=(1, 2, 3), radius=0.02)])
    x, a = _of_pinballs(one, 0.004)
    assert np.linalg.norm(a, axis=1).sum() == pytest.approx(4 * np.pi * 0.02**2)
    assert np.abs(a.sum(axis=0)).max() < 1e-3 * 4 * np.pi * 0.02**2
    assert (x * a).sum() == pytest.approx(4 * np.pi * 0.02**3, rel=1e-9)  # three times its volume
    x, a = _of_pinballs(BULLET, 0.002)
    volume = np.pi * 0.015**2 * 0.02 + 4 / 3 * np.pi * 0.015**3  # of a capsule; three balls bulge a little less
    assert 0.9 * volume < (x * a).sum() / 3 < volume


@pytest.mark.long
def test_a_light_film_swings_with_its_water_at_the_step_that_is_chosen():
    """A film of 0.25 kg/m2 and the 12.5 mm of water along it: the bare step of the water bursts it (docs/method.md, 11)."""
    film = Material(name="film", young=1e8, poisson=0.3, density=500.0)
    scene = can(velocity=(1.0, 0, 0))
    shell = scene.shells[0].model_copy(update={"material": film, "thickness": 5e-4})
    sim = start(scene.model_copy(update={"shells": (shell,)}))
    assert sim.dt < 0.25 * 0.9 * 0.515 * sim.fluid.support * sim.fluid.p.spacing / 1450.0
    sim.advance(300)
    entries = sim.energies()
    assert abs(entries["closed_residual_percent"]) < 0.02
    assert entries["kinetic"] + entries["elastic"] < 1.001 * entries["injected"]


@pytest.mark.long
def test_a_light_ball_on_water_does_not_swing_itself_to_death():
    ball = Rigid(name="ball", mass=1e-3, pinballs=[Pinball(centre=(0, 0, 0.0355), radius=0.025)])
    box = FluidBox(lo=(-0.05, -0.05, -0.04), hi=(0.05, 0.05, 0.0))
    scene = Scene(
        name="ball", title="a light ball", source="tests", rigids=(ball,), duration=2e-3, numerics=Numerics(spacing=0.02),
        fluids=[Fluid(name="water", fill=box, velocity=(0, 0, 20.0), alpha=0.0, delta=0.0)],
    )  # fmt: skip
    sim = start(scene)
    sim.advance_to(2e-3)
    entries = sim.energies()
    assert np.linalg.norm(sim.tracks()["rigid_ball"]["vz"]) > 10.0  # it was thrown up
    assert abs(entries["closed_residual_percent"]) < 1.0


@pytest.mark.long
def test_lists_by_points_are_the_same_in_numpy():
    """What a device without long loops of one thread takes (runtime.one_by_one)."""
    from .test_extremes import can, start

    sim = start(can())
    wetted = next(coupling.wetted for coupling in sim.couplings if hasattr(coupling, "wetted"))
    found = int(runtime.get(wetted.s.start, wetted.p.n + 1)[-1])
    kernel = [runtime.get(wetted.start_back, wetted.n + 1).copy(), runtime.get(wetted.particle, found).copy()]
    wetted._turned_round(found)
    assert found > 0 and np.array_equal(kernel[0], runtime.get(wetted.start_back, wetted.n + 1))
    assert np.array_equal(kernel[1], runtime.get(wetted.particle, found))
