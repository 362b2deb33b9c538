"""What is refused of a patch, in a sentence; and the parts of a mesh."""

import numpy as np
import pytest

from taichi_sph.bodies.shell.parts import split_of
from taichi_sph.errors import SceneError
from taichi_sph.run.plan import plan
from taichi_sph.scene import Ball, Box, BoxTank, Outside, PrescribedVelocity, Static

from .scenes import patched


def refused(scene) -> str:
    with pytest.raises(SceneError) as found:
        plan(scene() if callable(scene) else scene)
    return str(found.value)


def motion(where) -> dict:
    return {"motions": [PrescribedVelocity(body="shell", where=where, velocity=(0, 0, 0))]}


@pytest.mark.parametrize(
    "scene, words",
    [
        (patched(where=(Ball(centre=(3, 0, 0), radius=0.1),)), "lies off the mesh"),
        (patched(where=(Box(),)), "takes all elements"),
        (patched(where=(Box(hi=(0.3, None, None)), Box(lo=(0.5, None, None)))), "the overlaps of two patches touch at (400 mm"),
        (patched(n=25), "may be at most 20 times as wide; refine the mesh"),
        (patched(n=1), "must be at least 2 times as wide"),
        (patched().derive(**{"numerics.cells": "triangle"}), "is a triangle, and only quadrangles can be divided"),
        (patched(**motion(Box(hi=(None, 1e-6, None)))), "nodes of the overlap around a patch"),
        (patched(**motion(Outside(of=Box(lo=(0.05, None, None), hi=(0.95, None, None))))), "say it twice"),
        (patched(BoxTank(size=(1.0, 1.0, 1.0)), (Ball(centre=(1.0, 1.0, 1.0), radius=0.3),)), "turns by more than 25 degrees"),
    ],
)
def test_a_patch_that_does_not_fit_its_mesh(scene, words):
    said = refused(scene)
    assert words in said and said.count(". ") == 0


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"shells.shell.formulation": "galerkin"}, "particles in a shell of elements"),
        ({"shells.shell.formulation.points": 1, "shells.shell.patch.weight": "linear"}, "which a single point does not see"),
        ({"static": Static(method="relaxation")}, "tied in time"),
        ({"shells.shell.every": 2}, "take the same steps"),
        ({"shells.shell.self_contact": True}, "do not meet"),
        ({"shells.shell.patch.reech": 2.0}, "reach"),
        ({"shells.shell.patch.where": []}, "where"),
    ],
)
def test_a_patch_that_does_not_fit_its_scene(changes, words):
    with pytest.raises(Exception, match=words):
        patched().derive(**changes)


def test_parts():
    """Areas add up; the overlap is one element wide; an element between elements of the patch becomes one of them."""
    scene = patched(where=(Box(lo=(0.4, 0.1, None), hi=(0.7, 0.3, None)),), n=4)
    split = split_of(scene.shells[0], scene)
    assert split.patched.sum() == 6 and split.overlap.sum() == 14
    assert split.areas_of_elements.sum() + split.areas_of_particles.sum() == pytest.approx(0.4)
    assert set(np.unique(split.of_particles)) == {0.5, 1.0} and len(split.fine.mesh.cells) == 20 * 16
    both = split.fine.mesh.points
    assert np.ptp(both[:, 0]) == pytest.approx(0.5) and split.spacing == pytest.approx(0.025)
    hollow = (Box(lo=(0.2, None, None), hi=(0.5, None, None)), Box(lo=(0.6, None, None), hi=(0.8, None, None)))
    assert split_of((said := patched(where=hollow)).shells[0], said).patched.sum() == 24


@pytest.mark.parametrize(
    "key, said, words",
    [
        ("welds", {"between": ("shell", "rib")}, "patch: welds do not choose between elements and particles of 'shell' yet"),
        ("gases", {"body": "shell", "pressure": 2e5}, "patch: the gas in shell 'shell' would press on elements and particles both"),
    ],
)
def test_a_patch_beside_what_chooses_among_nodes(key, said, words):
    shell = patched().shells[0]
    rib = shell.model_copy(update={"name": "rib", "patch": None})
    shells = [one.model_dump(mode="json") for one in (shell, rib)]
    with pytest.raises(SceneError, match=words):
        patched().derive(**{"shells": shells, key: [said]})
