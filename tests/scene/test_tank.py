"""The options of the filled tank, together: each scene asks only for what it has, and what excludes each other says so."""

from itertools import product
from pathlib import Path

import pytest

from taichi_sph.errors import SceneError
from taichi_sph.output.measures import check_quantities
from taichi_sph.scene.script import load_scene

SCENES = Path(__file__).parents[2] / "scenes"


@pytest.mark.parametrize(
    "metal, halved, coupled, level", list(product(["none", "mild"], [0, 2], [False, True], [1.0, 0.7])), ids=lambda value: str(value)
)
def test_options_go_together(metal, halved, coupled, level):
    scene = load_scene(SCENES / "tank_leak.py", {"metal": metal, "halved": halved, "coupled": coupled, "level": level})
    check_quantities(scene)
    assert bool(scene.solids) == (metal != "none") and bool(scene.rigids) == (metal == "none")
    assert (scene.fluids[0].finer is not None) == (halved > 0)


@pytest.mark.parametrize(
    "options, said",
    [
        ({"halved": 3}, "halved = 3: the water along the path is halved 0, 1 or 2 times"),
        ({"halved": 1, "level": 0.4}, "the bullet flies at half the height, above a level of 0.4"),
        ({"drag": 0.35, "metal": "mild"}, "the law is of a rigid bullet"),
        ({"velocity": -730.0}, "the bullet would fly away from the tank"),
        ({"grows": True}, "set coupled = True as well"),
    ],
)
def test_options_that_exclude_each_other(options, said):
    with pytest.raises(SceneError, match=said):
        load_scene(SCENES / "tank_leak.py", options)


def test_a_speed_of_what_is_not_there_is_refused():
    scene = load_scene(SCENES / "tank_leak.py", {"metal": "mild"})
    rigid = load_scene(SCENES / "tank_leak.py", {})
    with pytest.raises(SceneError, match="quantity 'striker_speed' is of a rigid body, and the scene has none; leave it out"):
        check_quantities(scene.model_copy(update={"quantities": rigid.quantities}))
    with pytest.raises(SceneError, match="quantity 'body_speed' is of a solid that starts with a velocity, and the scene has none"):
        check_quantities(rigid.model_copy(update={"quantities": scene.quantities}))
