"""Scenes of several bodies: what they may say, and one sentence for what they may not."""

from __future__ import annotations

import copy
import json
from typing import Any, ClassVar, Literal

import pytest

from taichi_sph import bodies, couplings
from taichi_sph.errors import SceneError
from taichi_sph.output.record import scene_hash
from taichi_sph.scene import (
    Body,
    Box,
    Kind,
    Meeting,
    NodalForce,
    Scene,
    Shell,
    dump,
    load_scene,
    material,
)
from taichi_sph.scene.base import Frozen

STEEL = {"name": "steel", "young": "210 GPa", "poisson": 0.3, "density": 7800}


def can(name: str, x: float, **more: Any) -> dict[str, Any]:
    surface = {"kind": "cylinder", "radius": 0.1, "length": 0.3, "ends": "discs", "origin": [x, 0, 0]}
    return {"name": name, "surface": surface, "thickness": "1 mm", "motion": "free", "material": STEEL} | more


def ball(name: str, x: float, **more: Any) -> dict[str, Any]:
    return {"name": name, "mass": "30 g", "pinballs": [{"centre": [x, 0, 0.15], "radius": "9 mm"}]} | more


GOOD: dict[str, Any] = {
    "name": "two",
    "title": "Two tanks",
    "source": "tests",
    "shells": [can("left", 0.0), can("right", 0.5)],
    "rigids": [ball("first", 0.13), ball("second", 0.63)],
    "fluids": [{"name": f"water_{side}", "fill": {"kind": "shell", "shell": side}} for side in ("left", "right")],
    "forces": [{"body": "left", "where": "box", "total": [1, 0, 0]}],
    "meetings": [{"between": ["first", "second"], "restitution": 0.5}],
    "springs": [{"name": "tie", "between": ["left", None], "points": [[0.1, 0, 0.15], [0.3, 0, 0.15]], "stiffness": "3 kN/m"}],
    "output": {"probes": [{"name": "p", "body": "right", "point": [0.6, 0, 0.15]}]},
    "duration": "1 ms",
    "numerics": {"spacing": "20 mm"},
}


def made(changes: dict[str, Any], tmp_path) -> Scene:
    data = copy.deepcopy(GOOD)
    for key, value in changes.items():
        *parents, last = [int(part) if part.isdigit() else part for part in key.split(".")]
        at: Any = data
        for part in parents:
            at = at[part]
        if isinstance(at, list) and last == len(at):
            at.append(value)
        else:
            at[last] = value
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(data))
    return load_scene(path)


BAD = [
    ({"rigids.0.name": "left"}, "rigids[0].name: 'left' is taken"),
    ({"fluids.1.name": "water_left"}, "fluids[1].name: 'water_left' is taken"),
    ({"rigids.1.name": "Right"}, "rigids[1].name: 'Right' is taken, like 'right'"),
    ({"forces.0.body": "lft"}, "forces[0].body: there is no body 'lft'; did you mean 'left'?"),
    ({"forces.0.body": None}, "forces[0].body is missing: name one of left, right"),
    ({"forces.0.body": "first"}, "forces[0].body: 'first' is a rigid body; forces of it are not possible yet"),
    ({"output.probes.0.body": None}, "output.probes[0].body is missing: name one of left, right"),
    ({"output.probes.0.body": "water_left"}, "output.probes[0].body: 'water_left' is a fluid; probes of it are not possible yet"),
    ({"meetings.0.between": ["first", "secnd"]}, "meetings[0].between: there is no body 'secnd'; did you mean 'second'?"),
    ({"meetings.0.between": ["first", "first"]}, "meetings[0].between: 'first' twice"),
    ({"meetings.0.between": ["first", "water_left"]}, "meetings[0].restitution is of solids; fluid 'water_left' bounces by its pressure"),
    ({"meetings.0.friction": 3}, "meetings[0].friction = 3 must be at most 2"),
    ({"meetings.0.friction": -0.1}, "meetings[0].friction = -0.1 must be at least 0"),
    (
        {"meetings.1": {"between": ["first", "water_right"], "friction": 0.3}},
        "meetings[1].friction is of solids; fluid 'water_right' slides freely on what it wets: leave it out",
    ),
    (
        {"meetings.1": {"between": ["left", "right"], "meet": False, "friction": 0.3}},
        "meetings[1].friction: 'left' and 'right' do not meet; leave friction out, or set meet to True",
    ),
    ({"meetings.1": {"between": ["left", "left"], "friction": 0.3}}, "meetings[1].between: 'left' twice; a shell meets itself by its own"),
    (
        {"shells.0.self_contact": True, "meetings.1": {"between": ["left", "left"], "meet": False}},
        "meetings[1].meet: 'left' meets itself by its own self_contact; only friction is said of it here",
    ),
    ({"meetings.1": {"between": ["second", "first"]}}, "meetings[1]: 'second' and 'first' have a meeting already"),
    ({"springs.0.between": [None, None]}, "springs[0].between names no body"),
    ({"springs.0.between": ["left", "water_left"]}, "springs[0].between: 'water_left' is a fluid, which holds no spring"),
    ({"springs.0.between": ["lefft", None]}, "springs[0].between: there is no body 'lefft'; did you mean 'left'?"),
    ({"springs.0.stiffness": "3 kN"}, "is not a stiffness such as '3 kN/m'"),
    ({"springs.0.stiffness": 0}, "springs[0].stiffness, preload and damping of spring 'tie' are 0"),
    ({"springs.0.only": "tear"}, "springs[0].only = 'tear' is not allowed"),
    ({"springs.0.points": [[0, 0, 0], [0, 0, 0]]}, "springs[0].points: both ends of spring 'tie' are at one place"),
    ({"springs.1": GOOD["springs"][0]}, "springs[1].name: 'tie' is taken"),
    (
        {"fluids.1.spacing": "15 mm"},
        "fluids[1].spacing 15 mm is not that of 'water_left', 20 mm; not possible yet for fluids that can meet",
    ),
    ({"fluids.1.every": 2}, "fluids[1].every = 2 is not that of 'water_left', 1"),
    (
        {"shells.0.every": 2, "shells.1.every": 5},
        "shells[1].every = 5 is no multiple of that of 'left', 2: the steps of bodies are multiples of each other; take 4",
    ),
    (
        {"meetings.1": {"between": ["first", "water_right"], "meet": False}},
        "meetings: 'first' meets one of the fluids 'water_left' and 'water_right' alone; not possible yet for fluids that can meet",
    ),
    ({"shells.1.spacing": "0.2 m"}, "shells[1].spacing 200 mm is larger than the body: cylinder 'right' takes at most 100 mm"),
    ({"shells.0.every": 0}, "shells[0].every = 0 must be at least 1"),
    ({"others": [{"kind": "dumbbell", "name": "d"}]}, "needs a 'kind'; there is no 'dumbbell'"),
    ({"modes": {}, "rigids": [], "fluids": [], "springs": [], "meetings": []}, "modes: the scene has 2 shells"),
    (
        {"static": {}, "rigids": [], "fluids": [], "springs": [], "meetings": []},
        "static: shells 'left' and 'right' could meet, and contact moves in time; part them by Meeting",
    ),
    ({"static": {}, "rigids": [], "fluids": []}, "meetings[0].between: there is no body 'first'"),
]


def test_two_of_each_kind_are_a_scene(tmp_path):
    scene = made({}, tmp_path)
    assert [body.name for body in scene.bodies] == ["left", "right", "water_left", "water_right", "first", "second"]
    assert scene.met("first", "second").restitution == 0.5 and scene.met("left", "right").meet and not scene.met("left", "left").meet


@pytest.mark.parametrize(("changes", "said"), BAD, ids=lambda v: str(v)[:40])
def test_what_does_not_fit_gets_a_sentence(tmp_path, changes, said):
    with pytest.raises(SceneError) as caught:
        made(changes, tmp_path)
    message = str(caught.value)
    assert said in message and "\n" not in message and len(message) < 400


def test_static_of_shells_that_do_not_meet(tmp_path):
    apart = {"meetings": [{"between": ["left", "right"], "meet": False}], "static": {}, "rigids": [], "fluids": [], "springs": []}
    assert made(apart, tmp_path).pairs() == []


def test_a_shell_has_numerics_of_its_own(tmp_path):
    scene = made({"shells.1.spacing": "10 mm", "shells.1.formulation": "collocation"}, tmp_path)
    left, right = (scene.numerics_of(shell) for shell in scene.shells)
    assert left is scene.numerics and (right.spacing, right.formulation.kind, right.precision) == (0.01, "collocation", "f64")


def test_fluids_that_do_not_meet_may_differ(tmp_path):
    apart = {"between": ["water_left", "water_right"], "meet": False}
    scene = made({"fluids.1.spacing": "15 mm", "meetings.1": apart}, tmp_path)
    assert not scene.met("water_right", "water_left").meet


def plate(**more: Any) -> Scene:
    steel = material("APX")
    shell = Shell(name="sheet", surface={"kind": "plate", "length": 0.1, "width": 0.1}, thickness=1e-3, material=steel, motion="free")
    return Scene(name="x", title="x", source="x", shells=[shell], duration=1e-4, numerics={"spacing": 0.01}, **more)


def test_the_only_body_need_not_be_named_and_its_old_name_is_heard():
    force = {"where": Box(), "total": (0, 0, 1)}
    said = [plate(forces=[NodalForce(**force, **who)]) for who in ({}, {"shell": "sheet"}, {"body": "sheet"})]
    assert all(scene.forces[0].body == "sheet" for scene in said)
    assert len({scene_hash(scene) for scene in said}) == 1


def test_a_pair_that_does_not_meet_changes_the_record_and_no_pair_does_not():
    other = Shell(**{**plate().shells[0].model_dump(), "name": "other"})
    two = plate().model_copy(update={"shells": (*plate().shells, other)})
    apart = Scene(**{**two.model_dump(), "meetings": [Meeting(between=("sheet", "other"), meet=False)]})
    assert scene_hash(two) != scene_hash(apart) and apart.pairs() == []


class Toy(Body):
    kind: Literal["toy"] = "toy"
    what: ClassVar[str] = "toy"
    mass: float

    def check(self, scene: Scene) -> None:
        if self.mass <= 0:
            raise ValueError(f"{scene.key_of(self)}.mass must be above 0")


class Rope(Frozen):
    kind: Literal["rope"] = "rope"
    between: tuple[str, str]


@pytest.fixture
def toys():
    bodies.register(Kind("toy", "others", Toy, lambda scene, groups, own: list(own)))
    couplings.register(Kind("rope", "interactions", Rope, lambda scene, groups, own: []))
    yield
    bodies.kinds.registered.clear()
    couplings.kinds.registered.clear()


def test_a_kind_that_is_registered_can_be_said(toys, tmp_path):
    scene = plate(others=[Toy(name="t", mass=2.0)], interactions=[{"kind": "rope", "between": ["t", "sheet"]}])
    assert scene.bodies[-1] == scene.body("t") and scene.key_of(scene.body("t")) == "others[0]" and scene.couplings[0].between[1] == "sheet"
    assert bodies.kinds("others")[-1].make(scene, []) == [scene.body("t")]
    (tmp_path / "scene.json").write_text(dump(scene))
    assert load_scene(tmp_path / "scene.json") == scene
    with pytest.raises(ValueError, match=r"others\[0\].mass must be above 0"):
        plate(others=[Toy(name="t", mass=-1.0)])
    with pytest.raises(ValueError, match="mass is missing"):
        plate(others=[{"kind": "toy", "name": "t"}])


def test_the_kinds_are_found_in_their_folders():
    assert {kind.key for kind in bodies.kinds()} >= {"shells", "fluids", "rigids"} and {k.name for k in couplings.kinds()} >= {
        "spring",
        "meeting",
    }
    with pytest.raises(ValueError, match="is one of taichi_sph.bodies already"):
        bodies.register(Kind("rigid", "others", Toy, dict))
