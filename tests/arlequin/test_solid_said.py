"""What is refused of a patch of a solid, in a sentence; and the parts of a mesh."""

import numpy as np
import pytest

from taichi_sph.bodies.solid.parts import split_of
from taichi_sph.errors import SceneError
from taichi_sph.geometry.solids import mesh_of, subdivided
from taichi_sph.output.measures import check_quantities
from taichi_sph.run.plan import plan
from taichi_sph.scene import Ball, Box, Brick, InitialVelocity, Outside, Pinball, PrescribedVelocity, Quantity, Rigid, Spring

from ..solids import shaken
from .scenes import start
from .solids import patched, skew


def refused(scene) -> str:
    with pytest.raises(SceneError) as found:
        plan(scene)
    return str(found.value)


def motion(where) -> dict:
    return {"motions": [PrescribedVelocity(body="body", where=where, velocity=(0, 0, 0))]}


@pytest.mark.parametrize(
    "scene, words",
    [
        (
            patched(where=(Ball(centre=(30, 0, 0), radius=0.1),)),
            "solids[0].patch.where[0] lies off the mesh: it holds the middle of no element",
        ),
        (patched(where=(Box(),)), "leaves no elements of solid 'body' beyond the overlap"),
        (patched(where=(Box(lo=(1, None, None)),)), "leaves no elements of solid 'body' beyond the overlap"),
        (
            patched(where=(Box(hi=(2, None, None)), Box(lo=(4, None, None), hi=(6, None, None)))),
            "the overlaps of two patches touch at (3 m",
        ),
        (patched(n=25), "spacing 40 mm: the elements there are 1 m wide, and may be at most 20 times as wide; refine the mesh"),
        (patched(patch={"spacing": 2.5}), "must be at least as wide; lower the patch's spacing"),
        (patched(shaken((8, 3, 3), (8, 3, 3), 0.0, True)), "is a tetrahedron, and only hexahedra can be divided"),
        (patched(**motion(Box(hi=(None, 1e-6, None)))), "nodes of the overlap around a patch of solid 'body'"),
        (patched(**motion(Outside(of=Box(lo=(0.5, None, None), hi=(7.5, None, None))))), "say it twice"),
    ],
)
def test_a_patch_that_does_not_fit_its_mesh(scene, words):
    said = refused(scene)
    assert words in said and said.count(". ") == 0


BALL = Rigid(name="ball", mass=1.0, pinballs=[Pinball(centre=(20, 0, 0), radius=0.5)])
SPRING = Spring(name="s", between=("body", None), points=((0, 0, 0), (0, 0, -1)), stiffness=1.0)


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"solids.body.formulation": "particles"}, "patch: particles in a solid of elements, and 'body' is of particles; leave it out"),
        ({"solids.body.material.critical_damage": 0.9}, "critical_damage"),
        ({"solids.body.patch.wher": []}, "where"),
        ({"solids.body.patch.where": []}, "where"),
        ({"solids.body.patch.spacing": -1.0}, "spacing"),
        (
            {"rigids": [BALL.model_dump(mode="json")]},
            "solids\\[0\\].patch: rigid body 'ball' does not choose between elements and particles of 'body' yet",
        ),
        (
            {"springs": [SPRING.model_dump(mode="json")]},
            "solids\\[0\\].patch: springs do not choose between elements and particles of 'body'",
        ),
    ],
)
def test_a_patch_that_does_not_fit_its_scene(changes, words):
    with pytest.raises(Exception, match=words):
        patched().derive(**changes)


def test_a_support_among_what_is_tied():
    """Particles beside the overlap are seen by its constraints."""
    with pytest.raises(SceneError, match="a prescribed motion holds 49 nodes that the overlap ties; move the patch three of its spacings"):
        start(patched(**motion(Box(lo=(5.4, None, None), hi=(5.6, None, None)))))


def test_one_particle_an_element_is_for_straight_overlaps():
    """Where the overlap bends it would be held by more constraints than it has motions: a skew block was stiffer by a half."""
    with pytest.raises(SceneError, match="has one particle along the edge of an element.* give the patch half the spacing"):
        start(patched(skew((6, 3, 3)), (Ball(centre=(6.5, 1.5, 1.4), radius=1.4),), 1))
    assert start(patched(n=1)).couplings[-1].factor.implied == 0


def test_what_is_measured_of_a_whole_solid():
    given = [InitialVelocity(body="body", velocity=(0, 0, 1.0))]
    for name, unit in (("body_length", "m"), ("body_speed", "m/s")):
        with pytest.raises(SceneError, match=f"quantity '{name}': solid 'body' has a patch"):
            check_quantities(patched(initial=given, quantities=[Quantity(name=name, unit=unit)]))


def test_parts():
    """Volumes and areas add up; the overlap is one element wide; an element between elements of the patch becomes one of them."""
    scene = patched(skew((6, 4, 4)), (Ball(centre=(4.2, 2.2, 1.8), radius=0.8),), 3)
    split = split_of(scene.solids[0], scene)
    whole = split.whole
    assert split.volumes_of_elements.sum() + split.volumes_of_particles.sum() == pytest.approx(whole.volumes.sum(), rel=1e-12)
    assert split.areas_of_elements.sum() + split.areas_of_particles.sum() == pytest.approx(whole.node_areas.sum(), rel=1e-12)
    assert len(split.fine.mesh.cells) == 27 * (split.patched | split.overlap).sum() and split.fine.mesh.straightness.min() > 0.2
    hollow = patched(Brick(size=(9, 3, 3)), (Box(lo=(3, None, None), hi=(5, None, None)), Box(lo=(6, None, None), hi=(7, None, None))))
    assert split_of(hollow.solids[0], hollow).patched.sum() == 4 * 9


def test_hexahedra_divided():
    """The points of a divided mesh lie where trilinear functions put them, and none stands there twice."""
    scene = patched(skew((3, 2, 2)))
    mesh = mesh_of(scene.solids[0], scene)
    fine = subdivided(mesh, np.arange(len(mesh.cells)), 4)
    assert len(fine.mesh.points) == 13 * 9 * 9 and len(np.unique(np.round(fine.mesh.points, 9), axis=0)) == 13 * 9 * 9
    assert fine.mesh.volumes.sum() == pytest.approx(mesh.volumes.sum(), rel=1e-13)
    own = fine.parent == 7
    middle = fine.mesh.points[fine.mesh.cells[own]].mean(axis=1).mean(axis=0)
    assert middle == pytest.approx(mesh.centres[7], rel=1e-12)
