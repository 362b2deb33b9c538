"""Rigid bodies with a surface: mass and inertia by the volume, a shaken tank, a platen and a wall that shells meet."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.bodies.rigid.solid import solid_of
from taichi_sph.errors import SceneError
from taichi_sph.run.plan import plan
from taichi_sph.scene import (
    BoxTank,
    Bullet,
    Driven,
    Fluid,
    InitialVelocity,
    Material,
    MeshFile,
    Net,
    Numerics,
    Pinball,
    Plate,
    Rigid,
    Scene,
    Shell,
    ShellFill,
    Sphere,
    TimeTable,
    Water,
    checked,
)
from taichi_sph.scene.histories import factor

from ..geometry.writers import box, halves
from ..shells import STEEL, start

A = 0.4


def cube() -> tuple[np.ndarray, np.ndarray]:
    return box((4, 4, 4), A / 4)


def alone(*rigids: Rigid, spacing: float = 0.1, **more) -> Scene:
    options = {"duration": 1.0, "numerics": Numerics(spacing=spacing)} | more
    return Scene(name="solids", title="", source="tests", rigids=rigids, **options)


@pytest.mark.parametrize("cells", ["quads", "triangles"])
def test_a_cube_from_a_mesh(tmp_path, cells):
    """m = rho a3, its centre, and m a2 / 6 about any axis; from a file as from arrays."""
    points, quads = cube()
    points = points + [1.0, 2.0, 3.0]
    mesh = Net(points=points, cells=quads if cells == "quads" else halves(quads))
    solid = solid_of(one := Rigid(name="cube", surface=mesh, density=500.0), alone(one))
    assert solid.mass == pytest.approx(500 * A**3, rel=1e-12)
    assert solid.centre == pytest.approx(np.array([1.0, 2.0, 3.0]) + A / 2)
    assert solid.moments == pytest.approx(solid.mass * A**2 / 6 * np.eye(3), rel=1e-9, abs=1e-12)
    path = tmp_path / "cube.off"
    rows = [f"{len(p)} {' '.join(map(str, p))}" for p in np.asarray(mesh.cells).tolist()]
    path.write_text("\n".join(["OFF", f"{len(points)} {len(rows)} 0", *(" ".join(map(str, p)) for p in points.tolist()), *rows]))
    again = solid_of(one := Rigid(name="cube", surface=MeshFile(path=path), mass=7.0), alone(one))
    assert again.moments == pytest.approx(7 * A**2 / 6 * np.eye(3), rel=1e-9, abs=1e-12)


def test_other_shapes_and_their_balls():
    """A sphere has 2/5 m R2 about; a box three moments; the balls stand behind the surface and touch it."""
    ball = solid_of(one := Rigid(name="ball", surface=Sphere(radius=0.5), density=1000.0), alone(one, spacing=0.05))
    assert ball.mass == pytest.approx(1000 * 4 / 3 * np.pi * 0.125, rel=0.006)
    assert np.diag(ball.moments) == pytest.approx(np.full(3, 0.4 * ball.mass * 0.25), rel=0.01)
    assert np.linalg.norm(ball.places, axis=1) + ball.radii == pytest.approx(np.full(len(ball.radii), 0.5), rel=0.01)
    sides = np.array([0.3, 0.4, 0.6])
    block = solid_of(one := Rigid(name="block", surface=BoxTank(size=tuple(sides)), mass=5.0), alone(one, spacing=0.05))
    assert np.diag(block.moments) == pytest.approx(5 / 12 * ((sides**2).sum() - sides**2), rel=1e-9)
    far = np.minimum(block.places - np.min(block.places, axis=0), np.max(block.places, axis=0) - block.places).min(axis=1)
    assert far == pytest.approx(np.zeros(len(far)), abs=1e-9)  # all at one depth, on a box
    assert np.ptp(block.places, axis=0) == pytest.approx(sides - 2 * block.radii[0])


def test_an_ogive_and_its_balls():
    """15 g of steel, calibre 12.6 mm, CRH 2.5: centre and moments by integrals over its discs; balls fill it but for the point."""
    bullet = Bullet(radius=6.3e-3, length=5e-3, crh=2.5)
    solid = solid_of(one := Rigid(name="ogive", surface=bullet, density=7850.0), alone(one, spacing=0.5e-3))
    z = np.linspace(0, bullet.length + bullet.nose, 20_001)
    r = np.sqrt(bullet.arc**2 - np.maximum(z - bullet.length, 0) ** 2) - bullet.arc + bullet.radius
    mass = 7850 * np.pi * np.trapezoid(r**2, z)
    centre = 7850 * np.pi * np.trapezoid(r**2 * z, z) / mass
    along = 7850 * np.pi / 2 * np.trapezoid(r**4, z)
    across = 7850 * np.pi * np.trapezoid(r**4 / 4 + r**2 * (z - centre) ** 2, z)
    assert solid.mass == pytest.approx(mass, rel=3e-3) and mass == pytest.approx(15e-3, rel=0.01)
    assert solid.centre == pytest.approx([0, 0, centre], rel=1e-3, abs=1e-9)
    assert np.diag(solid.moments) == pytest.approx([across, across, along], rel=5e-3)
    tip = bullet.length + bullet.nose
    assert tip - 2.0 * solid.radii[0] < (solid.places[:, 2] + solid.radii).max() < tip


def test_a_body_on_a_rail_keeps_to_it():
    """Struck from the side it moves along its axis alone and does not turn; the rail does no work."""
    ball = Pinball(centre=(0.0, 0.0, 0.0), radius=0.1)
    one = Rigid(name="one", mass=1.0, pinballs=[ball], slides="x", restitution=1.0)
    two = Rigid(name="two", mass=1.0, pinballs=[Pinball(centre=(-0.16, -0.16, 0.05), radius=0.1)], velocity=(5, 5, 0), restitution=1.0)
    sim = start(alone(one, two, duration=0.05))
    sim.advance_to(0.05)
    v = runtime.get(sim.rigids.v, 2)
    assert v[0, 0] > 1.0 and (v[0, 1:] == 0).all() and (runtime.get(sim.rigids.L, 2)[0] == 0).all()
    assert (runtime.get(sim.rigids.x, 2)[0, 1:] == 0).all()
    assert v[0, 0] + v[1, 0] == pytest.approx(5.0, rel=1e-12)
    assert 0.5 * (v**2).sum() == pytest.approx(25.0, rel=1e-4)


@pytest.mark.long
def test_a_shaken_tank_feels_the_water():
    """Driven along x at one acceleration, a full tank is pushed by - m a of its water, and moves as it is told."""
    pace = TimeTable(points=((0, 0.0), (10.0, 10.0)))
    tank = Rigid(name="tank", surface=BoxTank(size=(0.2, 0.1, 0.1)), side="inside", driven=Driven(velocity=(2.0, 0, 0), history=pace))
    water = Fluid(name="water", fill=ShellFill(shell="tank"), water=Water(sound=30.0, tension=None))
    scene = alone(tank, spacing=0.0125, fluids=[water], duration=0.2)
    plan(scene)
    sim = start(scene)
    sim.advance(1)
    before = sim.rigids.x[0][0]
    impulse, begin, x = 0.0, sim.time, runtime.get(sim.fluid.p.mass, sim.fluid.p.n).sum()
    while sim.time < 0.12:  # nine sound transits
        sim.advance(1)
        impulse += sim.rigids.force[0][0] * sim.dt
    assert impulse == pytest.approx(-x * 2.0 * (sim.time - begin), rel=0.03)
    assert sim.rigids.x[0][0] - before == pytest.approx((sim.time**2 - begin**2), rel=0.01)
    assert factor(pace.points, 0.5) == 0.5


@pytest.mark.long
def test_a_platen_at_constant_speed_and_a_wall():
    """A light sheet between a platen that comes and a wall that stands: it takes the speed of the platen, and stops at the wall."""
    L, D, e = 0.1, 0.0125, 1e-3
    sheet = Shell(name="sheet", surface=Plate(length=L, width=L), thickness=e, material=Material(**STEEL | {"young": 2e9}), motion="free")
    low = BoxTank(size=(0.16, 0.16, 0.05), origin=(-0.03, -0.03, -0.052))
    platen = Rigid(name="platen", surface=low, driven=Driven(velocity=(0, 0, 5.0)))
    wall = Rigid(
        name="wall", surface=Plate(length=0.16, width=0.16, origin=(-0.03, 0.13, 0.03), normal=(0, 0, -1), along=(1, 0, 0)), held=True
    )
    scene = alone(platen, wall, spacing=D, shells=[sheet], duration=2e-3, initial=[InitialVelocity(velocity=(0, 0, -5.0))])
    plan(scene)
    sim = start(scene)
    sim.advance_to(1.5e-3)
    z = sim.shell.mesh.points[:, 2] + runtime.get(sim.shell.nodes.u, sim.shell.nodes.n)[:, 2]
    top = sim.rigids.x[0][2] + 0.025
    assert (z > top + 0.5 * e - 1e-5).all()  # nothing went through the platen
    v = runtime.get(sim.shell.nodes.v, sim.shell.nodes.n)[:, 2].mean()
    assert v > 4.0


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"pinballs": [Pinball(centre=(0, 0, 0), radius=0.1)], "surface": Sphere(radius=1)}, "are both given: leave one out"),
        ({"mass": 1.0}, "pinballs and surface of rigid 'r' are missing: give one of them"),
        ({"surface": Sphere(radius=1)}, "mass is missing (or density): rigid 'r' is neither held nor driven"),
        ({"surface": Sphere(radius=1), "mass": 1, "density": 1}, "mass and density of rigid 'r' are both given: leave one out"),
        ({"surface": Sphere(radius=1), "density": 1, "side": "inside"}, "side = 'inside': rigid 'r' is a tank without walls of its own"),
        ({"pinballs": [Pinball(centre=(0, 0, 0), radius=0.1)], "mass": 20, "side": "inside"}, "side is of a body with a surface"),
        ({"surface": Plate(length=1, width=1), "mass": 1.0}, "rigids[0].surface is open, so it has no volume; close it"),
        ({"surface": Sphere(radius=1), "mass": 1, "slides": "z", "velocity": (1, 0, 2)}, "slides = 'z': rigid 'r' moves along z alone"),
        ({"surface": Sphere(radius=1), "mass": 1, "slides": "z", "spin": (0, 0, 2)}, "and spin [0.0, 0.0, 2.0] rad/s say otherwise"),
        ({"surface": Sphere(radius=1), "mass": 1, "slides": "z", "held": True}, "slides: rigid 'r' is held and takes no rail"),
        ({"surface": BoxTank(size=(1, 1, 0.01)), "mass": 1.0}, "is larger than the body: the box of rigid 'r' takes at most 10 mm"),
    ],
)  # fmt: skip
def test_refusals(keys, said):
    with pytest.raises(SceneError) as error:
        plan(checked(Scene, lambda: alone(Rigid(name="r", **keys), Rigid(name="s", surface=Sphere(radius=0.2), mass=1))))
    assert said in str(error.value)
