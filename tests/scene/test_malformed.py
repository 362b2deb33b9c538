"""Bad scenes are answered with one sentence that names the key, and nothing is built."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from taichi_sph.errors import SceneError
from taichi_sph.run.plan import plan
from taichi_sph.scene import load_scene

from .examples import spoiled
from .malformed import MALFORMED


def load(folder: Path, data: dict[str, Any]) -> Any:
    path = folder / "scene.json"
    path.write_text(json.dumps(data))
    return load_scene(path)


def test_the_example_is_valid(tmp_path):
    assert plan(load(tmp_path, spoiled())).nodes == 21 * 11


@pytest.mark.parametrize(("key", "value", "said"), MALFORMED, ids=lambda v: str(v)[:40])
def test_malformed(tmp_path, key, value, said):
    with pytest.raises(SceneError) as caught:
        plan(load(tmp_path, spoiled(key, value)))
    message = str(caught.value)
    assert said in message
    assert "\n" not in message and len(message) < 400


def test_a_cut_may_begin_outside_the_edge(tmp_path):
    plan(load(tmp_path, spoiled("shells.0.cuts.0.start", [-0.001, 0.01, 0])))


def test_several_errors_are_counted(tmp_path):
    data = spoiled("duration", -1)
    data["numerics"]["spacing"] = "2 kg"
    data["shells"][0]["thickness"] = 0
    with pytest.raises(SceneError, match=r"2 more errors, in duration, numerics.spacing"):
        load(tmp_path, data)


@pytest.mark.parametrize(
    ("text", "said"),
    [("", "is not valid JSON"), ("{", "is not valid JSON"), ("[]", "is not a Scene"), ('{"name": NaN}', "scene.json")],
)
def test_malformed_json(tmp_path, text, said):
    path = tmp_path / "scene.json"
    path.write_text(text)
    with pytest.raises(SceneError, match=said):
        load_scene(path)


def test_overlapping_motions_are_refused(tmp_path):
    data = spoiled()
    data["motions"].append({**data["motions"][0], "velocity": [0, None, None]})
    with pytest.raises(SceneError, match=r"motions\[0\] and motions\[1\] both hold 21 nodes"):
        plan(load(tmp_path, data))


def test_collocation_has_no_surface_pressure(tmp_path):
    data = spoiled("shells.0.motion", "free")
    data["numerics"]["formulation"] = "collocation"
    plan(load(tmp_path, data))
    data["pressures"] = [{"shell": data["shells"][0]["name"], "value": "1 kPa"}]
    with pytest.raises(SceneError, match="'collocation' has no surface pressure"):
        load(tmp_path, data)
