"""Concrete that ruptures: rubble stays under pressure, what opens or is pressed flat dies, and what it held is booked."""

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.errors import SceneError
from taichi_sph.output.folder import RunFolder
from taichi_sph.run.plan import plan
from taichi_sph.run.session import run
from taichi_sph.scene import (
    Box,
    Brick,
    Bullet,
    Concrete,
    Delay,
    Grading,
    Material,
    Numerics,
    Output,
    Pilot,
    PrescribedVelocity,
    Quantity,
    Rigid,
    Scene,
    Solid,
    checked,
)

from ..exact import restarts_exactly, threads_change_nothing
from ..solids import group_of, solid_scene, start
from .point import Point

CONCRETE = {"young": 30e9, "poisson": 0.22, "density": 2300.0, "critical_damage": 0.99}
LAW = {"tension": 19.3e6, "compression": 115e6, "B": 965.0}


def point(viscous: bool = False, **more) -> Point:
    return Point({**CONCRETE, "damage": Concrete(**LAW, **more)}, viscous=viscous)


def sheared(one: Point, squeeze: float, steps: int = 200) -> float:
    """Under a pressure or at a larger volume (squeeze on each side), until all is broken; returns its damage."""
    for k in range(1, steps + 1):
        one.go(squeeze * np.array([[1, 4e-4 * k, 0], [0, 1, 0], [0, 0, 1]]), 1e-3)
    return one.read("delayed")


def test_rubble_under_pressure_stays_and_what_opens_dies():
    """The sign of the mean stress counts, not that of the strain's trace, which shear alone makes positive."""
    one = point()
    assert sheared(one, 0.995, 600) >= 0.99 and one.read("broken") == 0
    E = runtime.get(one.group.cells.strain, 1)[0]
    assert E[:3].sum() > 0 and np.linalg.det(one.F) < 1
    held = one.read("stored")
    one.go(one.F * (1.001 / np.cbrt(np.linalg.det(one.F))), 1e-3)
    assert one.read("broken") == 1 and held > 0 and np.abs(one.P).max() == 0
    assert one.kept == pytest.approx(one.work, rel=0.02)


def test_a_loose_cell_closes_again():
    """Opened by half of what it may, it bears no tension, and pressure as before once it is closed; opened by all of that it dies."""
    one = point(loosest=1.2)
    for k in range(1, 101):
        one.go((1 + 3e-4 * k) * np.eye(3), 1e-3)
    assert one.read("delayed") >= 0.99 and one.read("broken") == 0
    assert np.abs(one.P).max() < 1e-3 * 19.3e6
    for k in range(1, 101):
        sigma = one.go((1.03 - 3.5e-4 * k) * np.eye(3), 1e-3)
    J = np.linalg.det(one.F)
    assert sigma[0, 0] == pytest.approx(30e9 / 3 / 0.56 * np.log(J) / J, rel=1e-6) and J < 1
    one.go(1.08 * np.eye(3), 1e-3)
    assert one.read("broken") == 1


@pytest.mark.parametrize(("flattest", "viscous", "dt"), [(None, False, 1e-3), (0.5, False, 1e-3), (0.5, True, 1e-3), (0.5, True, 1e-7)])
def test_a_flat_cell_dies_where_that_is_said(flattest, viscous, dt):
    """Pressed to 0.45 along x, at a constant volume but for 1 %: what it held goes to `released`. Bulk viscosity changes nothing, slow or
    where the volume falls by 250 /s: it lowers the step, and a limit of the step is not one of the shape."""
    one = point(viscous, flattest=flattest)
    for k in range(1, 401):
        a = np.exp(-2e-3 * k)
        volume = 1.0 - 0.01 * k / 400
        one.go(np.diag([a, np.sqrt(volume / a), np.sqrt(volume / a)]), dt)
        if one.read("broken") == 1:
            break
    assert one.F[0, 0] == pytest.approx(np.exp(-0.8) if flattest is None else 0.5, rel=3e-3)
    assert one.read("broken") == (0 if flattest is None else 1)
    if flattest:
        assert one.read("released") > 0 and one.read("stored") == 0
    assert one.kept == pytest.approx(one.work, rel=5e-3)


def test_a_cell_turned_inside_out_dies():
    one = point(flattest=0.01)
    one.go(np.diag([-0.5, 1.0, 1.0]), 1e-3)
    assert one.read("broken") == 1


def struck(threads: int = 1, whole: bool = False):
    return start(struck_scene(whole), threads)


def struck_scene(whole: bool = False) -> Scene:
    """An ogive of 100 m/s on a block of weak concrete that is held below: a quarter between its planes, or all of it."""
    material = Material(
        name="concrete",
        young=10e9,
        poisson=0.2,
        density=2300.0,
        damage=Concrete(tension=2e6, compression=12e6, B=3100.0, flattest=0.5, loosest=1.1),
        delay=Delay(a=1, tau_c=2e-6),
        critical_damage=0.9,
    )
    half, near = 24e-3, 1e-6
    side, low = (2 * half, -half) if whole else (half, 0.0)
    block = Solid(name="block", shape=Brick(size=(side, side, half), origin=(low, low, -half)), material=material, viscous=True)
    nose = Bullet(radius=6e-3, length=6e-3, crh=1.5).nose
    ogive = Rigid(
        name="ogive", surface=Bullet(radius=6e-3, length=6e-3, crh=1.5, turned=True, origin=(0, 0, 6e-3 + nose + 1e-5)), spacing=1.5e-3,
        mass=20e-3 if whole else 5e-3, velocity=(0, 0, -400), slides="z",
    )  # fmt: skip
    bottom = Box(hi=(None, None, -half + near))
    motions = [PrescribedVelocity(body="block", where=bottom, velocity=(0, 0, 0))]
    if not whole:
        up = -half + near
        motions += [
            PrescribedVelocity(body="block", where=Box(lo=(None, near, up), hi=(near, None, None)), velocity=(0, None, None)),
            PrescribedVelocity(body="block", where=Box(lo=(near, None, up), hi=(None, near, None)), velocity=(None, 0, None)),
            PrescribedVelocity(body="block", where=Box(lo=(None, None, up), hi=(near, near, None)), velocity=(0, 0, None)),
        ]
    return Scene(
        name="struck", title="Struck", source="tests", duration=6e-5, solids=[block], rigids=[ogive], motions=motions,
        numerics=Numerics(spacing=6e-3), output=Output(frames=4, samples=20),
        quantities=[Quantity(name="penetration_depth", unit="m", value=0.02, tolerance=0.01), Quantity(name="crater_diameter", unit="m")],
    )  # fmt: skip


def test_an_ogive_pierces_a_block():
    """Cells die, their nodes fly on and are met; all energy is somewhere."""
    world = struck()
    world.advance_to(4e-5)
    group = group_of(world)
    broken = runtime.get(group.cells.broken, group.cells.n) == 1
    found = world.energies()
    assert 0 < broken.sum() < group.cells.n and found["released"] > 0 and found["contact"] > 0
    assert abs(found["closed_residual_percent"]) < 0.5, found
    v = runtime.get(world.rigids.v, 1)[0]
    assert v[0] == v[1] == 0 and -400 < v[2] < -50
    assert world.frame().body("block").point_data["fragment"].sum() > 0


@pytest.mark.long
def test_a_quarter_is_a_quarter():
    """The ogive is slowed as by the whole block."""
    found = []
    for whole in (False, True):
        world = struck(whole=whole)
        world.advance_to(2e-5)
        found.append(float(runtime.get(world.rigids.v, 1)[0, 2]))
    assert found[0] == pytest.approx(found[1], rel=0.03) and found[0] > -380


@pytest.mark.long
def test_a_run_measures_and_draws_its_crater(tmp_path):
    """The depth is the way of the ogive at most; the section is drawn."""
    pytest.importorskip("matplotlib")
    run(struck_scene(), tmp_path / "run", pictures=True)
    with RunFolder(tmp_path / "run") as folder:
        path = folder.history("rigid_ogive")["z"]
        assert folder.summary["quantities"]["penetration_depth"]["value"] == pytest.approx(path[0] - path.min(), rel=1e-12)
        assert 5e-3 < path[0] - path.min() < 24e-3
        assert (folder.pictures / "crater.png").is_file()


def test_restart_with_dead_cells():
    restarts_exactly(struck, 60, 20)
    world = struck()
    world.advance(60)
    group = group_of(world)
    assert runtime.get(group.cells.broken, group.cells.n).sum() > 0


@pytest.mark.long
def test_threads_with_dead_cells():
    threads_change_nothing(struck, 60)


def test_a_graded_brick():
    """Even where it is said, growing beyond by the factor at most, ending where the brick does."""
    from taichi_sph.geometry.solids.made import brick, count

    shape = Brick(
        size=(0.1, 0.2, 0.1), origin=(0, -0.1, 1), graded=Grading(lo=(None, -0.02, 1.06), hi=(0.03, 0.02, None), growth=1.3, largest=0.02)
    )
    mesh = brick(shape, 0.005)
    assert count(shape, 0.005) == len(mesh.points)
    assert mesh.volumes.sum() == pytest.approx(0.1 * 0.2 * 0.1, rel=1e-12) and mesh.straightness.min() == pytest.approx(1.0)
    for k, (lo, hi, a, b) in enumerate(((0, 0.1, 0, 0.03), (-0.1, 0.1, -0.02, 0.02), (1, 1.1, 1.06, 1.1))):
        at = np.unique(np.round(mesh.points[:, k], 12))
        cells = np.diff(at)
        assert at[0] == pytest.approx(lo, abs=1e-12) and at[-1] == pytest.approx(hi)
        fine = (at[:-1] > a - 1e-9) & (at[1:] < b + 1e-9)
        assert cells[fine] == pytest.approx(np.full(fine.sum(), 0.005), rel=1e-6) and fine.sum() == round((b - a) / 0.005)
        ratio = np.maximum(cells[1:] / cells[:-1], cells[:-1] / cells[1:])
        assert 1.1 < ratio.max() < 1.3 + 1e-9 and cells.max() < 0.02


@pytest.mark.parametrize("room", [1e-9, 1e-6, 1e-4, 1.9e-3, 2.1e-3, 4e-3, 4.7e-3, 4.9e-3, 8e-3, 1e-2])
@pytest.mark.parametrize("low", [False, True])
def test_a_graded_brick_has_no_slivers(room, low):
    """Whatever is left beyond the fine stretch, no cell is shorter than half of a fine one, and none grows by more than is said."""
    from taichi_sph.geometry.solids.made import brick

    graded = Grading(lo=(room, None, None)) if low else Grading(hi=(0.04, None, None))
    mesh = brick(Brick(size=(0.04 + room, 0.04, 0.04), graded=graded), 4e-3)
    at = np.unique(np.round(mesh.points[:, 0], 12))
    cells = np.diff(at)
    assert at[0] == 0 and at[-1] == pytest.approx(0.04 + room, rel=1e-9) and mesh.straightness.min() == pytest.approx(1.0)
    assert cells.min() > 0.4999 * 4e-3 and (cells[:: -1 if low else 1][1:] / cells[:: -1 if low else 1][:-1]).max() < 1.2 + 1e-9
    assert (len(cells) > 10) == (room > 2e-3)


@pytest.mark.parametrize(
    ("shape", "said"),
    [
        ({"graded": {"largest": 0.05}}, "graded: largest 50 mm must be at least the spacing, 100 mm, from which cells grow"),
        (
            {"size": (1e6, 1, 1), "graded": {"hi": (1.0, None, None), "largest": 0.1}},
            "graded: 1e+06 m beyond the fine stretch would be more than 10000 cells, which start at 100 mm and grow by 1.2",
        ),
        ({"size": (1.0, 1.04, 1), "layers": (10, 10, 10), "pilot": {"radius": 0.01, "reach": 0.5}},
         "solid 'body': pilot: the first cells of the brick must be squares across z; they are 100 mm along x and 104 mm along y"),
    ],
)  # fmt: skip
def test_bricks_that_cannot_be_made_are_refused(shape, said):
    with pytest.raises(SceneError) as error:
        plan(checked(Scene, lambda: solid_scene(Brick(**{"size": (1, 1, 1), **shape}))))
    assert said in str(error.value)


@pytest.mark.parametrize(
    ("shape", "said"),
    [
        ({"size": (1, 1, 1), "layers": (2, 2, 2), "graded": {}}, "layers and graded are both given: leave one out"),
        ({"size": (1, 1, 1), "graded": {"lo": (0.5, None, None), "hi": (0.2, None, None)}}, "lo 0.5 m and hi 0.2 m along x are no stretch"),
        ({"size": (1, 1, 1), "graded": {"hi": (None, None, 2.0)}}, "along z are no stretch of the brick, from 0 to 1 m"),
        ({"size": (1, 1, 1), "graded": {"growth": 3.0}}, "growth"),
    ],
)
def test_gradings_that_are_none_are_refused(shape, said):
    with pytest.raises(SceneError) as error:
        checked(Scene, lambda: solid_scene(Brick(**shape)))
    assert said in str(error.value)


@pytest.mark.parametrize("flattest", [None, 0.15])
def test_the_plan_says_that_the_step_falls(flattest):
    """It knows cells at rest alone; the slab takes ten times as many steps."""
    law = {"damage": Concrete(**LAW, flattest=flattest)}
    note = plan(checked(Scene, lambda: solid_scene(Brick(size=(1, 1, 1)), {**CONCRETE, **law}, solid={"viscous": True}))).bodies[0].note
    said = "; a cell may be pressed to 0.15 of its length: the step may fall to that share of the estimate, lower still by bulk viscosity"
    assert note == "1000 cells" + (said if flattest else "")


@pytest.mark.parametrize("key", ["flattest", "loosest"])
def test_limits_of_rupture_want_rupture(key):
    law = {"damage": Concrete(**LAW, **{key: 0.3 if key == "flattest" else 1.5}), "critical_damage": None}
    with pytest.raises(SceneError, match=f"damage.{key} says when a cell ruptures, which none does without critical_damage"):
        plan(checked(Scene, lambda: solid_scene(Brick(size=(1, 1, 1)), {**CONCRETE, **law})))


def test_a_pilot_hole():
    """A square as wide as it is said, straight cells about it that keep the planes of symmetry, nothing else moved, the true volume."""
    from taichi_sph.geometry.solids.made import brick

    pilot = Pilot(radius=0.001, reach=0.03)
    shape = Brick(size=(0.05, 0.04, 0.02), origin=(1, 2, 3), pilot=pilot)
    mesh, before = brick(shape, 0.005), brick(Brick(size=shape.size, origin=shape.origin), 0.005)
    assert len(mesh.cells) == len(before.cells) - 4 and len(mesh.points) == len(before.points) - 5
    assert mesh.volumes.sum() == pytest.approx(shape.volume, rel=1e-12) and shape.volume == pytest.approx(0.05 * 0.04 * 0.02 - 1e-6 * 0.02)
    wide = (mesh.points[:, :2] - [1, 2]).max(axis=1)
    assert wide.min() == pytest.approx(0.001) and mesh.straightness.min() > 0.2
    faces = mesh.faces.nodes[mesh.skin]
    for axis, low in ((0, 1.0), (1, 2.0)):
        assert (mesh.points[faces, axis] == low).all(axis=1).sum() == 4 * (7, 9)[axis]
    outside = (before.points[:, :2] - [1, 2]).max(axis=1) >= 0.03
    assert {tuple(p) for p in before.points[outside]} <= {tuple(p) for p in mesh.points}


@pytest.mark.parametrize(
    ("pilot", "said"),
    [
        ({"radius": 0.2, "reach": 0.1}, "pilot.reach 0.1 m must be above its radius, 0.2 m, and at most the width of the brick, 1 m"),
        ({"radius": 0.2, "reach": 2.0}, "at most the width of the brick, 1 m"),
        ({"radius": 0.2, "reach": 0.5}, "pilot: its radius 200 mm must be below the first cell of the brick, 100 mm, and its reach 500 mm"),
    ],
)
def test_pilot_holes_that_are_none_are_refused(pilot, said):
    with pytest.raises(SceneError) as error:
        plan(checked(Scene, lambda: solid_scene(Brick(size=(1, 1, 1), pilot=pilot))))
    assert said in str(error.value)
