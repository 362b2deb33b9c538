"""Scenes of two bodies through the command line: validate, run, resume, compare, sweep and price say whose a number is."""

from __future__ import annotations

import copy
import json
from pathlib import Path

import pytest

from ..scene.examples import GOOD


@pytest.fixture
def two(work: Path) -> Path:
    """The small plate and another beside it, coarser and in another form, each held and pulled."""
    data = copy.deepcopy(GOOD)
    (plate,) = data["shells"]
    other = copy.deepcopy(plate) | {"name": "other", "spacing": 0.004, "formulation": "collocation"}
    other["surface"]["origin"] = [0.1, 0, 0]
    for cut in other["cuts"]:
        for end in ("start", "end"):
            cut[end][0] += 0.1
    data["shells"].append(other)
    for key in ("forces", "motions"):
        data[key].append(copy.deepcopy(data[key][0]) | {"shell": "other"})
    data["quantities"] = [
        {"name": "displacement", "unit": "m", "value": 1e-3, "tolerance": 1, "options": {"x": 0.02 * k, "y": 0.0, "body": body}}
        for k, body in enumerate(("plate", "other"))
    ]
    path = work / "two.json"
    path.write_text(json.dumps(data))
    return path


def test_validate_tells_of_each(call, two) -> None:
    code, out, err = call("validate", "two.json")
    assert code == 0, err
    assert "plate: 231 nodes" in out and "other: 66 nodes" in out and "galerkin, collocation, f64" in out


def test_a_run_of_two_and_its_pictures(call, work, two, fake) -> None:
    code, out, err = call("run", "two.json", "--out", "a")
    assert code == 0, err
    assert {p.name for p in (work / "a/frames").iterdir()} == {"plate.vtkhdf", "other.vtkhdf"}
    assert "plate cracked: no" in out and "other cracked: no" in out
    assert "displacement where" not in out and "of other" in out
    summary = json.loads((work / "a/summary.json").read_text())
    assert summary["settings"]["formulation"] == "galerkin, collocation"
    assert len(summary["quantities"]) == 2 and all(entry["value"] is not None for entry in summary["quantities"].values())
    assert call("run", "two.json", "--out", "b", "--set", "shells.other.thickness=2mm")[0] == 0
    code, out, err = call("compare", "a", "b", "--out", "both.png")
    assert code == 0 and (work / "both.png").is_file(), err


def test_a_measure_that_names_no_body_gets_a_sentence(call, work, two, fake) -> None:
    data = json.loads(two.read_text())
    del data["quantities"][1]
    data["quantities"][0]["options"].pop("body")
    two.write_text(json.dumps(data))
    code, _, err = call("run", "two.json", "--out", "a")
    assert code == 2 and "quantity 'displacement' is of one body: give the option 'body', one of plate, other" in err
    data["quantities"][0]["options"]["body"] = "othr"
    two.write_text(json.dumps(data))
    code, _, err = call("validate", "two.json")
    assert code == 2 and "its body 'othr' is not in the scene; did you mean 'other'?" in err


def test_a_sweep_turns_keys_of_a_body(call, work, two, monkeypatch) -> None:
    from taichi_sph.studies import sweep

    asked = []

    def points(tasks, out, **how):
        asked.extend(task["settings"] for task in tasks)
        return [{"id": "x", "settings": t["settings"], "scene_hash": "", "status": "done", "sentence": "", "summary": None} for t in tasks]

    monkeypatch.setattr(sweep, "run_points", points)
    code, _, err = call("sweep", "two.json", "--vary", "shells.other.spacing=4mm,5mm", "--out", "s")
    assert code == 0, err
    assert [point["shells.other.spacing"] for point in asked] == ["4mm", "5mm"]
