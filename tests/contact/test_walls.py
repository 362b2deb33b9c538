"""Shells against the surface of rigid bodies: the triangles themselves, one for a node on a flat face, two in a corner."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.bodies.rigid.solid import solid_of
from taichi_sph.couplings.contact.pairs import FACE, WALL
from taichi_sph.errors import SceneError
from taichi_sph.run.plan import plan
from taichi_sph.scene import (
    BoxTank,
    Cylinder,
    Driven,
    InitialVelocity,
    Material,
    Meeting,
    Numerics,
    Plate,
    Rigid,
    Scene,
    Shell,
    Sphere,
)
from taichi_sph.world.world import World

from ..exact import restarts_exactly, threads_change_nothing
from ..shells import STEEL

D, N, E = 0.01, 4, 1e-3  # m, cells a side, m
SPEED, GAP = 10.0, 5e-5  # m/s, m
MASS = (N * D) ** 2 * E * STEEL["density"]


def scene(*rigids: Rigid, velocity=(0.0, 0.0, -SPEED), origin=(0.0, 0.0, 0.0), **more) -> Scene:
    sheet = Shell(
        name="sheet", surface=Plate(length=N * D, width=N * D, origin=origin), thickness=E, material=Material(**STEEL), motion="free"
    )
    start = [InitialVelocity(body="sheet", velocity=velocity)]
    options = {"shells": [sheet], "rigids": rigids, "initial": start, "duration": 1e-3, "numerics": Numerics(spacing=D)}
    return Scene(**{"name": "walls", "title": "a sheet and walls", "source": "tests"} | options | more)


def floor(**more) -> Rigid:
    """With nodes right below those of the sheet, so that each node is as near to several triangles."""
    low = Plate(length=(N + 2) * D, width=(N + 2) * D, origin=(-D, -D, -0.5 * E - GAP))
    return Rigid(name="floor", surface=low, **{"held": True} | more)


def sheet(sim) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    nodes = sim.shell.nodes
    u, v = (runtime.get(field, nodes.n).astype(float) for field in (nodes.u, nodes.v))
    return sim.shell.mesh.points + u, v, runtime.get(nodes.mass, nodes.n).astype(float)


@pytest.mark.parametrize("moving", [False, pytest.param(True, marks=pytest.mark.long)])
def test_a_sheet_on_a_flat_face(moving):
    """All nodes come to touch at once, by one wall each: the sheet takes the speed of the face and stays on it. The impulse on the face is
    what the sheet loses, and a plastic impact takes 1/2 m v2."""
    rigid, v = (floor(held=False, driven=Driven(velocity=(0, 0, SPEED))), 0.0) if moving else (floor(), -SPEED)
    sim = World(scene(rigid, velocity=(0, 0, v)) if v else scene(rigid, initial=[]))
    pairs, impulse = sim.contact.pairs, 0.0
    for _ in range(40):
        sim.advance(1)
        impulse += runtime.get(sim.rigids.force, 1)[0, 2] * sim.dt
        assert sim.contact.iterations <= 2
    x, u, mass = sheet(sim)
    face = runtime.get(sim.rigids.x, 1)[0, 2]
    assert x[:, 2] - face == pytest.approx(np.full(len(x), 0.5 * E), abs=1e-12)
    end = SPEED if moving else 0.0
    assert u[:, 2] == pytest.approx(np.full(len(u), end), abs=1e-9 * SPEED)
    assert mass @ u[:, 2] - MASS * v == pytest.approx(-impulse, rel=1e-9)
    sort, near = runtime.get(pairs.sort, pairs.n), runtime.get(pairs.near, pairs.n)
    assert near[sort == WALL].sum() == (N + 1) ** 2 and not near[sort != WALL].any()  # no tip, no ball: the face is flat
    assert sim.contact.penetration < 1e-12 and sim.contact.unsolved == 0
    found = sim.energies()
    assert found["contact"] == pytest.approx(0.5 * MASS * SPEED**2, rel=1e-9) and abs(found["closed_residual_percent"]) < 1e-6


@pytest.mark.long
def test_a_face_rubs():
    """By Coulomb's law a sheet that comes down aslant loses mu times the speed across as well."""
    sim = World(scene(floor(), velocity=(SPEED, 0, -SPEED), meetings=[Meeting(between=("floor", "sheet"), friction=0.3)]))
    sim.advance(40)
    v, mass = sheet(sim)[1:]
    assert mass @ v[:, 0] == pytest.approx(0.7 * SPEED * MASS, rel=1e-3)
    assert sim.energies()["friction"] > 0 and abs(sim.energies()["closed_residual_percent"]) < 1e-3


def cube(**more) -> Rigid:
    """Smaller than a cell, over the middle of one, on its corner: no node of the sheet is below it."""
    a = 0.3 * D
    box = BoxTank(size=(a, a, a), origin=(1.5 * D - 0.5 * a, 1.6 * D - 0.5 * a, 0.5 * E + GAP))
    return Rigid(name="cube", surface=box, density=7800.0, spacing=0.1 * D, velocity=(2.0, 1.0, -50.0), spin=(300.0, -200.0, 100.0), **more)


def test_a_cube_that_falls_between_nodes():
    """Its corners meet the faces of the sheet. Linear and angular momentum stay what they are."""
    sim = World(scene(cube(), initial=[]))
    solid = sim.rigids

    def momenta() -> tuple[np.ndarray, np.ndarray]:
        x, v, mass = sheet(sim)
        X, V, L, m = (runtime.get(f, 1)[0] for f in (solid.x, solid.v, solid.L, solid.mass))
        back = sim.dt * v  # v stands half a step before x
        p = mass @ v + m * V
        return p, (mass[:, None] * np.cross(x - 0.5 * back, v)).sum(axis=0) + m * np.cross(X - 0.5 * sim.dt * V, V) + L

    sim.advance(1)
    p, L = momenta()
    for _ in range(60):
        sim.advance(1)
    after, turned = momenta()
    sort = runtime.get(sim.contact.pairs.sort, sim.contact.pairs.n)
    assert (sort == FACE).any() and not (sort < FACE).any()
    assert sheet(sim)[1][:, 2].min() < -0.1  # it was hit
    assert after == pytest.approx(p, rel=1e-10, abs=1e-12 * np.abs(p).max())
    assert turned == pytest.approx(L, abs=2e-3 * np.abs(L).max())
    assert sim.contact.penetration < 0.01 * E and sim.contact.unsolved == 0
    assert abs(sim.energies()["closed_residual_percent"]) < 0.01


@pytest.mark.long
def test_two_walls_in_a_corner_of_a_tank():
    """A sheet that flies into an edge of a tank stops in both directions, a wall for each."""
    box = BoxTank(size=(0.1, 0.1, 0.1), origin=(-GAP, -0.03, -0.5 * E - GAP))
    low = BoxTank(size=(0.1, 0.1, 0.1), origin=(-0.5 * E - GAP, -0.03, -0.5 * E - GAP))
    with pytest.raises(SceneError, match="sheet"):
        plan(scene(Rigid(name="tank", surface=box, side="inside", held=True)))
    made = scene(Rigid(name="tank", surface=low, side="inside", held=True), velocity=(-SPEED, 0.0, -SPEED))
    plan(made)
    sim = World(made)
    most = 0
    for _ in range(20):
        sim.advance(1)
        pairs = sim.contact.pairs
        most = max(most, int(runtime.get(pairs.near, pairs.n).sum()))
    x, v, _ = sheet(sim)
    assert most == (N + 1) ** 2 + N + 1  # the rim meets two
    assert x[:, 0].min() > -GAP - 1e-9 and x[:, 2] == pytest.approx(np.full(len(x), -GAP), abs=1e-9)
    assert v[:, 0].mean() > -0.9 * SPEED and np.abs(v[:, 2]).max() < 1e-3 * SPEED
    assert sim.contact.penetration < 1e-4 * SPEED * sim.time  # the tolerance of the solver


def test_restart_is_exact():
    restarts_exactly(lambda: World(scene(cube(), floor(), meetings=[Meeting(between=("sheet", "cube"), friction=0.2)])), 40, 40)


@pytest.mark.long
def test_the_number_of_threads_changes_nothing():
    threads_change_nothing(lambda threads: World(scene(cube(), floor()), threads=threads), 60)


def tips(surface, side=None, spacing=0.1) -> tuple[np.ndarray, np.ndarray]:
    """Points of a surface, and which of them may touch first."""
    body = Rigid(name="r", surface=surface, side=side, driven=Driven(velocity=(1.0, 0, 0)))
    alone = Scene(name="s", title="", source="tests", rigids=[body], duration=1.0, numerics=Numerics(spacing=spacing))
    solid = solid_of(body, alone)
    corners, tip = solid.walls()
    assert sorted(np.unique(corners)) == list(range(len(tip)))
    return solid.mesh.points, tip


def test_what_can_touch_first():
    """The border of a plate, the edges of a box, all of a sphere; nothing of what is hollow, but its border."""
    x, tip = tips(Plate(length=1.0, width=0.5))
    assert (tip == ((x[:, 0] % 1.0 == 0) | (x[:, 1] % 0.5 == 0))).all()
    x, tip = tips(BoxTank(size=(0.5, 0.5, 0.5)))
    assert (tip == (((x == x.min(axis=0)) | (x == x.max(axis=0))).sum(axis=1) > 1)).all()
    assert not tips(BoxTank(size=(0.5, 0.5, 0.5)), side="inside")[1].any()
    assert tips(Sphere(radius=0.5))[1].all()
    x, tip = tips(Cylinder(radius=0.5, length=1.0), side="inside")
    assert (tip == ((x[:, 2] == 0) | (x[:, 2] == 1.0))).all()


def test_an_overlap_is_found_by_the_plan():
    plan(scene(floor()))
    low = Plate(length=0.1, width=0.1, origin=(-D, -D, -0.2e-3))
    with pytest.raises(SceneError, match="rigid body 'floor' starts 0.3 mm inside shell 'sheet'"):
        plan(scene(Rigid(name="floor", surface=low, held=True)))
    block = BoxTank(size=(0.1, 0.1, 0.05), origin=(-D, -D, -0.04))  # the sheet lies in it
    with pytest.raises(SceneError, match="inside shell 'sheet'"):
        plan(scene(Rigid(name="block", surface=block, held=True)))
