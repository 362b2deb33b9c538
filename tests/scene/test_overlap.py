"""Bodies that lie in each other at the start get one sentence before anything is compiled; the plan's meshes are those of the run."""

from __future__ import annotations

import pytest

from taichi_sph.bodies.fluid.fill import fill_fluid
from taichi_sph.errors import SceneError
from taichi_sph.geometry.surfaces import mesh_of
from taichi_sph.run.plan import plan
from taichi_sph.scene import Cylinder, Fluid, FluidBox, Meeting, Pinball, Plate, Rigid, Scene, Shell, ShellFill, Spring, material

D, E, R = 10e-3, 2e-3, 15e-3


def sheet(name: str, z: float, x: float = 0.0) -> Shell:
    surface = Plate(length=0.2, width=0.2, origin=(x, 0, z))
    return Shell(name=name, surface=surface, thickness=E, material=material("APX"), motion="free")


def rib(name: str, z: float) -> Shell:
    """A sheet that stands on its edge."""
    surface = Plate(length=0.1, width=0.1, origin=(0.1, 0.05, z), normal=(1, 0, 0))
    return Shell(name=name, surface=surface, thickness=E, material=material("APX"), motion="free")


def can(name: str, x: float) -> Shell:
    surface = Cylinder(radius=0.05, length=0.2, ends="discs", origin=(x, 0.1, 0))
    return Shell(name=name, surface=surface, thickness=E, material=material("APX"), motion="free")


def ball(name: str, z: float) -> Rigid:
    return Rigid(name=name, mass=0.1, pinballs=[Pinball(centre=(0.1, 0.1, z), radius=R)])


def box(name: str, z: float, **more) -> Fluid:
    return Fluid(name=name, fill=FluidBox(lo=(0, 0, z), hi=(0.2, 0.2, z + 0.1)), hydrostatic=False, **more)


def planned(**bodies):
    return plan(Scene(name="x", title="x", source="x", duration=1e-4, numerics={"spacing": D}, **bodies))


TOUCH = 0.5 * E + R  # of a ball and a sheet
OVERLAPS = [
    ({"shells": [sheet("s", 0.0)], "rigids": [ball("b", TOUCH - 1e-4)]}, "rigid body 'b' starts 0.1 mm inside shell 's'"),
    ({"rigids": [ball("a", 0.0), ball("b", 2 * R - 1e-3)]}, "rigid body 'a' starts 1 mm inside rigid body 'b'"),
    (
        {"shells": [sheet("a", 0.0), sheet("b", 0.9 * E)]},
        "shells 'a' and 'b' start 1.8 mm apart, nearer than the mean of their thicknesses, 2 mm",
    ),
    ({"shells": [sheet("a", 0.0), rib("b", 0.8 * E)]}, "shells 'a' and 'b' start 1.6 mm apart"),
    ({"shells": [sheet("a", 0.0, x=0.1), can("b", 0.25)]}, "shell 'a' starts across shell 'b'"),
    ({"fluids": [box("oil", 0.0), box("water", 0.05)]}, "fluids 'oil' and 'water' both fill the place of"),
    ({"shells": [sheet("s", 0.055)], "fluids": [box("w", 0.0)]}, "mm inside shell 's'"),
    ({"fluids": [box("w", 0.0)], "rigids": [ball("b", 0.1)]}, "fluid 'w' starts"),
]
APART = [
    {"shells": [sheet("s", 0.0)], "rigids": [ball("b", TOUCH + 1e-6)]},
    {"rigids": [ball("a", 0.0), ball("b", 2 * R + 1e-6)]},
    {"shells": [sheet("a", 0.0), sheet("b", 1.01 * E)]},
    {"shells": [sheet("a", 0.0), can("b", 0.3)]},
    {"shells": [sheet("a", 0.0), rib("b", 1.01 * E)]},
    {"fluids": [box("oil", 0.1), box("water", 0.0)]},
    {"shells": [can("c", 0.0)], "fluids": [Fluid(name="w", fill=ShellFill(shell="c"))]},
    {"shells": [can("c", 0.0)], "fluids": [Fluid(name="w", fill=ShellFill(shell="c"), contact="pinballs")]},
    {"fluids": [box("w", 0.0)], "rigids": [ball("b", 0.1 + R)]},
]


@pytest.mark.parametrize(("bodies", "said"), OVERLAPS, ids=lambda v: str(v)[-30:])
def test_an_overlap_is_found_by_the_plan(bodies, said):
    with pytest.raises(SceneError) as caught:
        planned(**bodies)
    assert said in str(caught.value) and len(str(caught.value)) < 250


@pytest.mark.parametrize("bodies", APART, ids=lambda v: "-".join(b.name for bodies in v.values() for b in bodies))
def test_bodies_may_touch(bodies):
    planned(**bodies)


def test_what_cannot_meet_may_overlap():
    bodies = dict(OVERLAPS[0][0]) | {"meetings": [Meeting(between=("s", "b"), meet=False)]}
    planned(**bodies)


def test_an_end_of_a_spring_lies_on_its_body():
    far = Spring(name="far", between=("s", None), points=((0.1, 0.1, 0.021), (0.1, 0.1, 1.0)), stiffness=1e3)
    with pytest.raises(SceneError, match=r"springs\[0\].points\[0\] is 21 mm from the nearest node of 's', beyond 2 node spacings, 20 mm"):
        planned(shells=[sheet("s", 0.0)], springs=[far])
    planned(shells=[sheet("s", 0.0)], springs=[far.model_copy(update={"radius": 0.022})])


def test_what_the_plan_made_is_not_made_again():
    scene = Scene(
        name="x", title="x", source="x", duration=1e-4, numerics={"spacing": D},
        shells=[can("c", 0.0), can("d", 0.2).model_copy(update={"spacing": 5e-3})], fluids=[Fluid(name="w", fill=ShellFill(shell="c"))],
    )  # fmt: skip
    planned = plan(scene)
    made = planned.made
    assert mesh_of(scene.shells[0], scene) is made.meshes["c"] and mesh_of(scene.shells[1], scene) is made.meshes["d"]
    assert fill_fluid(scene.fluids[0], scene, made.meshes) is made.fillings["w"]
    assert len(made.meshes["d"].points) > 3 * len(made.meshes["c"].points)
    assert mesh_of(scene.shells[0].model_copy(update={"seed": 1}), scene) is not made.meshes["c"]
    assert [body.name for body in planned.bodies] == ["c", "d", "w"] and planned.bodies[1].dt < planned.bodies[0].dt


def test_bodies_with_steps_of_their_own_cost_less():
    slow = sheet("slow", 0.1).model_copy(update={"every": 2})
    both, alone = planned(shells=[sheet("s", 0.0), slow]), planned(shells=[sheet("s", 0.0), sheet("slow", 0.1)])
    assert both.dt == alone.dt / 2 and both.nodes == alone.nodes and both.seconds < 2 * alone.seconds
