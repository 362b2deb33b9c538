"""Bad fluids and walls are answered with one sentence that names the key."""

import json

import pytest

from taichi_sph.errors import SceneError
from taichi_sph.run.plan import plan
from taichi_sph.scene import load_scene

from .examples import DELETE

GOOD = {
    "name": "pool",
    "title": "A pool",
    "source": "tests",
    "fluids": [{"name": "water", "fill": {"kind": "box", "lo": [0, 0, 0], "hi": [0.1, 0.1, 0.1]}}],
    "walls": [{"point": [0, 0, 0], "normal": [0, 0, 1]}, {"point": [0, 0, 0], "normal": [1, 0, 0]}],
    "gravity": [0, 0, -9.81],
    "duration": "1 ms",
    "numerics": {"spacing": "10 mm"},
}
SHELL = {
    "name": "can", "surface": {"kind": "cylinder", "radius": 0.1, "length": 0.2, "ends": "discs"}, "thickness": "1 mm", "motion": "free",
    "material": {"name": "steel", "young": "210 GPa", "poisson": 0.3, "density": 7800},
}  # fmt: skip
BAD = [
    ("fluids.0.alpah", 0.1, "did you mean 'alpha'?"),
    ("fluids.0.spacing", 0, "fluids[0].spacing = 0 m must be greater than 0 m"),
    ("fluids.0.spacing", "10 kg", "is not a length"),
    ("fluids.0.alpha", -0.1, "fluids[0].alpha = -0.1 must be"),
    ("fluids.0.alpha", 10, "fluids[0].alpha = 10 must be"),
    ("fluids.0.support", 0.5, "fluids[0].support = 0.5 must be"),
    ("fluids.0.finer", [], "fluids[0].finer"),
    ("fluids.0.finer", [{"within": {"kind": "box", "lo": [1, 0, 0]}}], "fluid 'water': finer[0].within holds none of its particles"),
    ("fluids.0.finer", [{"within": {"kind": "ball", "centre": [0, 0, 0]}}], "radius"),
    ("fluids.0.finer", [{"whithin": {"kind": "box"}}], "did you mean 'within'?"),
    ("fluids.0.finer", [{"within": {"kind": "group", "name": "a"}}], "'group' is not allowed; valid: box, ball"),
    (
        "fluids.0",
        {"name": "w", "fill": {"kind": "round", "columns": [[0.05, 0, 0.1]]}, "finer": [{"within": {"kind": "box"}}]},
        "finer: not possible yet in round columns, which 'w' fills",
    ),
    ("fluids.0.every", 0, "fluids[0].every = 0 must be"),
    ("fluids.0.every", 4, "the scene has none; leave it out"),
    ("fluids.0.contact", "pinball", "fluids[0].contact"),
    ("fluids.0.water", {"sound": 0}, "fluids[0].water.sound = 0 m/s must be"),
    ("fluids.0.water", {"density": -1}, "fluids[0].water.density = -1 kg/m^3 must be"),
    ("fluids.0.fill.hi", [0.1, 0.1, -0.1], "fluids[0].fill.lo is not below hi along z"),
    ("fluids.0.fill", {"kind": "shell", "shell": "can"}, "there is no shell 'can'"),
    (
        "fluids.1",
        GOOD["fluids"][0] | {"name": "oil", "spacing": 0.02},
        "fluids[1].spacing 20 mm is not that of 'water', 10 mm; not possible yet",
    ),
    ("fluids.1", GOOD["fluids"][0] | {"name": "oil", "water": {"law": "tait"}}, "fluids[1].water.law 'tait' is not that of 'water'"),
    ("fluids.1", GOOD["fluids"][0] | {"name": "oil", "support": 1.3}, "fluids[1].support 1.3 is not that of 'water', 1.165"),
    ("walls.0.fluids", ["oil"], "walls[0].fluids: there is no fluid 'oil'"),
    ("fluids", [], "shells, rigids, fluids and solids are empty"),
    ("walls.0.normal", [0, 0, 0], "normal is (0, 0, 0)"),
    ("walls.0.normal", [0.1, 0, 1], "neither parallel nor at right angles"),
    ("walls.0.hole", {"centre": [0, 0, 0], "radius": 0}, "walls[0].hole.radius = 0 m must be"),
    ("walls.2", {"point": [0, 0, 0.011], "normal": [0, 0, -2]}, "walls[2] and walls[0] face each other 11 mm apart"),
    ("walls.2", {"point": [1, 0, 0], "normal": [0, 0, 3]}, "walls[2] and walls[0] face the same way 0 m apart"),
    ("static", {}, "a fluid moves in time"),
]


def spoiled(key, value) -> dict:
    data = json.loads(json.dumps(GOOD))
    part, *rest = [int(k) if k.isdigit() else k for k in key.split(".")]
    at = data
    for following in rest:
        at, part = at[part], following
    if value is DELETE:
        del at[part]
    elif isinstance(at, list) and part == len(at):
        at.append(value)
    else:
        at[part] = value
    return data


def said_of(tmp_path, data) -> str:
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(data))
    with pytest.raises(SceneError) as caught:
        plan(load_scene(path))
    return str(caught.value)


def test_the_pool_is_valid(tmp_path):
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(GOOD))
    assert plan(load_scene(path)).nodes == 1000


@pytest.mark.parametrize(("key", "value", "said"), BAD, ids=lambda v: str(v)[:30])
def test_malformed(tmp_path, key, value, said):
    message = said_of(tmp_path, spoiled(key, value))
    assert said in message
    assert "\n" not in message and len(message) < 400


def test_a_fluid_beside_a_shell(tmp_path):
    named = spoiled("shells", [SHELL | {"name": "water"}])
    assert "'water' is taken" in said_of(tmp_path, named)
    flat = spoiled("shells", [{**SHELL, "surface": {"kind": "plate", "length": 0.2, "width": 0.2}, "motion": "in_plane"}])
    assert "moves in its plane and cannot hold a fluid" in said_of(tmp_path, flat)
    other = spoiled("shells", [SHELL])
    other["fluids"][0]["fill"] = {"kind": "shell", "shell": "cna"}
    assert "there is no shell 'cna'; did you mean 'can'?" in said_of(tmp_path, other)


def test_walls_need_a_fluid(tmp_path):
    dry = spoiled("fluids", [])
    dry["shells"] = [SHELL]
    assert "walls hold fluids, and the scene has none" in said_of(tmp_path, dry)
