"""A study of small scenes, with the stand-in: folders, what is kept, what fails, what is summed."""

from __future__ import annotations

import json

import pytest

from taichi_sph.errors import SceneError
from taichi_sph.scene import Study, dump, load, load_scene

from ..scene.examples import GOOD
from .conftest import files

SCRIPT = """
from pathlib import Path
from taichi_sph.scene import Quality, Study, load_scene

def scene(quality: Quality = "draft", third: bool = True) -> Study:
    plate = load_scene(Path(__file__).parents[1] / "small.json")
    wanted = [{"name": "crack_width", "unit": "m"}, {"name": "crack_count", "value": 0, "tolerance": 0}]
    cases = {
        f"e{mm}mm": plate.derive(title=f"{plate.title}, {mm} mm", quantities=wanted, **{"shells.plate.thickness": f"{mm} mm"})
        for mm in (2, 3, 4) if third or mm < 4
    }
    return Study(name="some", title="Some plates", source="tests", cases=cases)
"""
CASES = ["e2mm", "e3mm", "e4mm"]


@pytest.fixture
def study(work, fake, scene_file):
    (work / "scenes").mkdir()
    (work / "scenes/some.py").write_text(SCRIPT)
    return fake


def ran(fake) -> list[float]:
    return [round(1e3 * a["scene"].shells[0].thickness) for a in fake.asked]


def test_a_whole_study(call, work, study):
    code, out, err = call("run", "some", "--out", "s")
    assert (code, err) == (0, "")
    assert {p.name for p in (work / "s").iterdir()} == {"study.json", "summary.json", "pictures", *CASES}
    for case in CASES:
        assert (work / "s" / case / "summary.json").is_file() and not (work / "s" / case / "pictures").exists()
        assert f"{case}: crack width none, crack count 0" in out
    assert "Three of three runs finished; 3 of 3 numbers came out as expected." in out
    assert (work / "s/pictures/comparison.png").stat().st_size > 1000 and "picture: s/pictures/comparison.png" in out
    summary = json.loads((work / "s/summary.json").read_text())
    single = json.loads((work / "s/e2mm/summary.json").read_text())
    assert (summary["scene"], summary["quality"], summary["cases"], summary["failed"]) == ("some", "draft", CASES, {})
    assert summary["command"] == "taichi-sph run some" and summary["settings"]["third"] is True
    assert summary["node_steps"] == 3 * single["node_steps"] and summary["steps"] == 120
    assert summary["B_percent"] == 0.1 and summary["closed_residual_percent"] == 0.01
    assert set(summary["quantities"]) == {f"{q}_{c}" for q in ("crack_width", "crack_count") for c in CASES}
    assert summary["quantities"]["crack_count_e3mm"]["met"] is True


def test_what_is_finished_is_kept(call, work, study):
    assert call("run", "some", "--out", "s", "--no-pictures")[0] == 0
    made = (work / "s/e2mm/record.json").stat().st_mtime_ns
    code, out, _ = call("run", "some", "--out", "s", "--no-pictures")
    assert code == 0 and out.count("finished already and kept") == 3 and ran(study) == [2, 3, 4]
    assert (work / "s/e2mm/record.json").stat().st_mtime_ns == made
    # another scene under the same name is another run
    assert call("run", "some", "--out", "s", "--no-pictures", "--set", "duration=30us")[0] == 0
    assert ran(study) == [2, 3, 4, 2, 3, 4] and load_scene(work / "s/e2mm/scene.json").duration == pytest.approx(30e-6)
    # all anew where that is said
    assert call("run", "some", "--out", "s", "--no-pictures", "--set", "duration=30us", "--overwrite")[0] == 0
    assert ran(study) == [2, 3, 4] * 3


def test_a_failed_case_does_not_end_the_study(call, work, study):
    study.on_step = lambda sim: setattr(type(sim), "stop_at", 23 if sim.scene.shells[0].thickness == 3e-3 else None)
    code, out, err = call("run", "some", "--out", "s", "--no-pictures")
    assert code == 3 and ran(study) == [2, 3, 4]
    assert err.startswith("taichi-sph: 1 of 3 cases of 'some' failed (e3mm)") and err.count("\n") == 1
    assert "e3mm stopped: body 'plate', node 3" in out and "Two of three runs finished; 2 of 3 numbers" in out
    summary = json.loads((work / "s/summary.json").read_text())
    assert "node 3" in summary["failed"]["e3mm"] and summary["quantities"]["crack_count_e3mm"]["met"] is False
    study.on_step, study.stop_at = None, None
    assert call("resume", "s", "--no-pictures")[0] == 0
    assert ran(study) == [2, 3, 4, 3]
    assert json.loads((work / "s/summary.json").read_text())["failed"] == {}


def test_interrupt_and_resume(call, work, study):
    import signal

    study.on_step = lambda sim: sim.step == 25 and sim.scene.shells[0].thickness == 3e-3 and signal.raise_signal(signal.SIGINT)
    code, _, err = call("run", "some", "--out", "s", "--no-pictures")
    assert code == 130 and "taichi-sph resume s" in err and err.count("\n") == 1
    assert not (work / "s/summary.json").exists()
    study.on_step = None
    code, out, err = call("resume", "s", "--no-pictures")
    assert (code, err) == (0, "") and "e3mm goes on from its checkpoint" in out and "e2mm is finished already" in out
    whole = call("run", "some", "--out", "w", "--no-pictures")
    assert whole[0] == 0
    hashes = [json.loads((work / d / "e3mm/record.json").read_text())["result_hash"] for d in ("s", "w")]
    assert hashes[0] == hashes[1]


def test_validate_render_and_results(call, work, study):
    before = files(work)
    code, out, err = call("validate", "some")
    assert (code, err) == (0, "") and files(work) == before and study.asked == []
    assert "3 cases" in out and "231 nodes" in out and "valid" in out
    assert call("run", "some", "--out", "s", "--no-pictures")[0] == 0
    assert call("render", "s")[1] == "s/pictures/comparison.png\n"
    assert call("compare", "s/e2mm", "s/e3mm", "--out", "two.png")[:2] == (0, "two.png\n") and (work / "two.png").is_file()
    code, out, err = call("results", "s")
    assert (code, err) == (0, "") and "| crack count e3mm | 0 | 0 | yes |" in out
    assert "![Some plates, third = True](renders/some-draft-third=True.png)" in out
    (work / "README.md").write_text("before\n<!-- results -->\nold\n<!-- /results -->\nafter\n")
    assert call("results", "--out", "README.md")[0] == call("results", "--out", "RESULTS.md")[0] == 0
    readme = (work / "README.md").read_text()
    assert "before\n" in readme and "after\n" in readme and "old" not in readme and "| 3 of 3 |" in readme
    assert (work / "RESULTS.md").read_text() == out.split("\n", 2)[2].removesuffix("\n")
    (work / "scenes/some.py").write_text(SCRIPT.replace("(2, 3, 4)", "(2, 3)"))
    assert "some-draft-third=True is out of date: its scene changed" in call("results")[2]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["run", "some", "--set", "thrid=no"], "unknown option 'thrid' of some.py; did you mean 'third'?"),
        (["run", "some", "--set", "numerics.spacng=1"], "did you mean 'spacing'?"),
        (["run", "some", "--set", "numerics.spacing=1m"], "is larger than the body"),
        (["run", "some", "--out", "scenes"], "holds files that are not of a run"),
        (["spectrum", "some"], "'some' is a study of 3 scenes; a single scene is needed here"),
        (["run", "bad.json"], "bad.json: cases.b.numerics.spacing is missing"),
        (["run", "none.json"], "bad.json: cases"),
        (["run", "twice.json"], "'A' and another case differ in upper and lower case only"),
        (["resume", "old"], "is not valid JSON"),
    ],
    ids=lambda v: " ".join(v) if isinstance(v, list) else "",
)
def test_bad_studies(call, work, study, arguments, said):
    spoiled = {"name": "x", "title": "x", "source": "x", "cases": {"a": GOOD, "b": {**GOOD, "numerics": {}}}}
    (work / "bad.json").write_text(json.dumps(spoiled))
    (work / "none.json").write_text(json.dumps({**spoiled, "cases": {}}))
    (work / "twice.json").write_text(json.dumps({**spoiled, "cases": {"A": GOOD, "a": GOOD}}))
    (work / "old").mkdir()
    (work / "old/study.json").write_text("{")
    before = files(work)
    code, out, err = call(*arguments)
    assert code == 2 and files(work) == before and study.asked == []
    assert err.startswith("taichi-sph: ") and err.count("\n") == 1 and said.replace("bad.json: cases", "cases") in err


def test_json_round_trip(work, study):
    found = load(work / "scenes/some.py", {"third": "no"})
    assert isinstance(found, Study) and list(found.cases) == CASES[:2] and found.parameters == {"third": False}
    (work / "s.json").write_text(dump(found))
    assert load(work / "s.json") == found
    with pytest.raises(SceneError, match="is a study of 2 scenes"):
        load_scene(work / "s.json")
