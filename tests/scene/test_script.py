"""Scene scripts: parameters as options, derivation, JSON and back."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from taichi_sph.errors import SceneError
from taichi_sph.output.measures import check_quantities
from taichi_sph.run.plan import plan
from taichi_sph.scene import Scene, Study, derive, dump, load, load_scene, parameters_of

from .examples import GOOD, spoiled

SCENES = sorted((Path(__file__).parents[2] / "scenes").glob("[!_]*.py"))

HEADER = """
from typing import Literal
from taichi_sph.scene import *
def scene(quality: Quality = "draft", size: Length = "40 mm", n: int = 3, on: bool = True, cells: Literal["quad", "triangle"] = "quad",
          word: str = "x"):
    return Scene(name="made", title=f"{size} {n} {on} {word}", source="", duration="20 us", numerics=Numerics(spacing="2 mm", cells=cells),
        shells=[Shell(name="p", surface=Plate(length=size, width=size), thickness="1 mm",
            material=Material(name="m", young="1 GPa", poisson=0.3, density=1000))])
"""


def script(folder: Path, text: str = HEADER) -> Path:
    path = folder / "made.py"
    path.write_text(text)
    return path


@pytest.mark.parametrize("path", SCENES, ids=lambda p: p.stem)
@pytest.mark.parametrize("quality", ["draft", "standard", "paper"])
def test_every_scene_loads_and_comes_back_from_json(path, quality, tmp_path):
    found = load(path, {"quality": quality})
    assert found.quality == quality and found.name == path.stem and found.source
    assert parameters_of(path)["quality"].default == "draft"
    (tmp_path / "s.json").write_text(dump(found))
    assert load(tmp_path / "s.json") == found
    for scene in found.cases.values() if isinstance(found, Study) else [found]:
        assert scene.quantities, "a scene says what it is to show"
        check_quantities(scene)
        if quality == "draft":
            plan(scene)  # regions, cuts and meshes are tried: what `validate` does


@pytest.mark.long
@pytest.mark.parametrize("path", SCENES, ids=lambda p: p.stem)
@pytest.mark.parametrize("quality", ["standard", "paper"])
def test_finer_scenes_can_be_planned(path, quality):
    found = load(path, {"quality": quality})
    for scene in found.cases.values() if isinstance(found, Study) else [found]:
        plan(scene)


def test_options_are_typed(tmp_path):
    path = script(tmp_path)
    scene = load_scene(path, {"size": "20 mm", "n": "5", "on": "no", "cells": "triangle", "word": "1e3"})
    assert scene.title == "0.02 5 False 1e3"
    assert scene.parameters == {"size": 0.02, "n": 5, "on": False, "cells": "triangle", "word": "1e3"}
    assert load_scene(path, {"size": "0.03"}).shells[0].surface.length == 0.03


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("sise", "1", "unknown option 'sise' of made.py; did you mean 'size'?"),
        ("size", "1 kg", "option size = '1 kg' is not a length"),
        ("n", "1.5", "option n = 1.5 is not a whole number"),
        ("n", "many", "option n = 'many' is not a whole number"),
        ("on", "maybe", "option on = 'maybe' is neither true nor false"),
        ("cells", "quads", "option cells = 'quads' is not allowed; did you mean 'quad'?"),
        ("quality", "best", "option quality = 'best' is not allowed"),
        ("size", "1 um", "made.py line "),
        ("numerics.spacng", "1", "unknown key 'spacng' in numerics; did you mean 'spacing'?"),
        ("shells.q.thickness", "1", "there is no entry 'q' in shells"),
        ("duration.x", "1", "'duration' is a single value"),
        ("numerics.spacing", "1 kg", "numerics.spacing = '1 kg' is not a length"),
    ],
)
def test_bad_options(tmp_path, key, value, said):
    with pytest.raises(SceneError) as caught:
        load_scene(script(tmp_path), {key: value})
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "made.py has no function 'scene'"),
        ("scene = 3", "made.py has no function 'scene'"),
        ("def scene(:", "made.py line 1: it is not valid Python"),
        ("import nonexistent_module_x", "made.py line 1: ModuleNotFoundError"),
        ("x = 1\ndef scene():\n    return 1 / 0", "made.py line 3: ZeroDivisionError"),
        ("def scene():\n    return 3", "returned int, not a Scene"),
        ("def scene(a):\n    return 3", "option 'a' of made.py has no default"),
        ("from taichi_sph.scene import *\ndef scene():\n    return Mazars(threshold=2, A=1, B=1)", "line 3: Mazars: threshold = 2 must"),
        ("from taichi_sph.scene import *\nMazars(treshold=1e-4, A=1, B=1)", "line 2: Mazars: unknown key 'treshold'; did you mean"),
        ("raise SystemExit(0)", "made.py line 1: it ended the program"),
    ],
)
def test_bad_scripts(tmp_path, text, said):
    with pytest.raises(SceneError) as caught:
        load_scene(script(tmp_path, text))
    assert said in str(caught.value)


def test_missing_files(tmp_path):
    with pytest.raises(SceneError, match="there is no scene file"):
        load_scene(tmp_path / "no.py")
    (tmp_path / "x.toml").write_text("")
    with pytest.raises(SceneError, match="a scene is a .py script or a .json file"):
        load_scene(tmp_path / "x.toml")


def test_derive():
    scene = Scene.model_validate(spoiled("quality", "paper"))
    finer = scene.derive(**{"numerics.spacing": "1 mm", "shells.plate.thickness": 0.002, "numerics.formulation": "collocation"})
    assert (finer.numerics.spacing, finer.shells[0].thickness, finer.numerics.formulation.kind) == (1e-3, 2e-3, "collocation")
    assert finer.quality == "custom" and finer.parameters["numerics.spacing"] == "1 mm"
    assert derive(scene, duration="30 us").quality == "paper"
    assert scene.numerics.spacing == 2e-3


def test_mesh_paths_are_meant_from_the_scene(tmp_path):
    path = tmp_path / "s.json"
    path.write_text(json.dumps(spoiled("shells.0.surface", {"kind": "mesh", "path": "plate.msh"})))
    assert load_scene(path).shells[0].surface.path == tmp_path / "plate.msh"


positive = st.floats(1e-3, 1e3)


@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    length=st.floats(0.03, 10), width=st.floats(0.02, 10), nu=st.floats(-0.99, 0.49), rho=st.floats(2e3, 2e4),
    young=st.floats(2e10, 1e12), a=positive, seed=st.integers(0, 2**32 - 1), kind=st.sampled_from(["galerkin", "collocation"]),
    open_side=st.sampled_from([None, 0.0, -3.5]), text=st.text(max_size=20).filter(str.isprintable),
)  # fmt: skip
def test_json_round_trip(tmp_path, length, width, nu, rho, young, a, seed, kind, open_side, text):
    data = json.loads(json.dumps(GOOD))
    shell = data["shells"][0]
    shell["surface"].update(length=length, width=width)
    shell["material"].update(poisson=nu, density=rho, young=young)
    shell["material"]["delay"]["a"] = a
    data["title"] = text
    data["numerics"].update(spacing=0.01, seed=seed, formulation=kind)
    data["forces"][0]["where"]["lo"][0] = open_side
    scene = Scene.model_validate(data)
    path = tmp_path / "s.json"
    path.write_text(dump(scene), encoding="utf-8")
    assert load_scene(path) == scene
    assert dump(load_scene(path)) == dump(scene)


SENSELESS = [
    ("crack_branching", "numerics.spacing", 1e-308, "is below 1 nm"),
    ("crack_branching", "shells.0.thickness", 1e-300, "shells[0].thickness 1e-300 m is below 1 nm"),
    ("exploding_cylinder", "solids.0.spacing", 1e-300, "solids[0].spacing 1e-300 m is below 1 nm"),
    ("crack_branching", "shells.0.surface.length", 10**400, "is larger than any length"),
    ("crack_branching", "shells.0.surface.length", 1e200, "is beyond 1e+12 m"),
    ("dam_break", "fluids.0.fill.hi", [1e200] * 3, "is beyond 1e+12 m"),
    ("dam_break", "fluids.0.water.sound", 1e300, "is faster than light"),
    ("plate_perforation", "rigids.0.velocity", [0, 0, -4e8], "is faster than light"),
    ("plate_perforation", "shells.0.material.poisson", -0.9999999999, "at most 20 million are allowed"),
    ("plate_perforation", "numerics.time_step_safety", 1e-300, "at most 20 million are allowed"),
    ("plate_perforation", "shells.0.surface.origin", [1e300, 0, 0], "is beyond 1e+12 m"),
    ("plate_perforation", "numerics.spacing\nx", 1, "unknown key 'spacing\\nx' in numerics"),
    ("plate_perforation", "title", "a\nb", "holds a line break"),
]


@pytest.mark.parametrize(("name", "key", "value", "said"), SENSELESS, ids=lambda v: str(v)[:30])
def test_numbers_without_sense(name, key, value, said):
    with pytest.raises(SceneError) as caught:
        plan(load_scene(Path(__file__).parents[2] / "scenes" / f"{name}.py", {key: value}))
    assert said in str(caught.value) and "\n" not in str(caught.value) and len(str(caught.value)) < 400


def test_brackets_without_end(tmp_path):
    for text in ("[" * 200_000 + "]" * 200_000, '{"a":' * 200_000):
        (tmp_path / "deep.json").write_text(text)
        with pytest.raises(SceneError, match="nested too deeply"):
            load_scene(tmp_path / "deep.json")
