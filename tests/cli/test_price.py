"""The price of accuracy: which knobs a scene has, references, errors, the front, qualities, words, and what validate says."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from taichi_sph.errors import SceneError
from taichi_sph.scene import load_scene
from taichi_sph.studies import sweep
from taichi_sph.studies.price import command, judge, words
from taichi_sph.studies.price.knobs import BASE, PAPER, THESIS, knobs, together

from ..scene.examples import GOOD

SCRIPT = """
from pathlib import Path
from taichi_sph.scene import Quality, Scene, load_scene
SPACING = {"draft": 2e-3, "standard": 1e-3, "paper": 5e-4}

def scene(quality: Quality = "draft") -> Scene:
    wanted = [{"name": "crack_width", "unit": "m", "value": 1.0, "tolerance": 0.1}, {"name": "crack_count", "value": 1, "tolerance": 0}]
    plate = load_scene(Path(__file__).with_name("small.json"), {"numerics.spacing": SPACING[quality]})
    return plate.derive(quantities=wanted)
"""


def entry(value, target=None, tolerance=None, unit="m"):
    met = None if target is None or tolerance is None else value is not None and abs(value - target) <= tolerance
    return {"value": value, "unit": unit, "target": target, "tolerance": tolerance, "source": "theory", "met": met}


def of_small(**changes):
    """Knobs of the small scene with other keys."""
    return knobs(load_scene_of(changes), ["quality"])


def load_scene_of(changes):
    from taichi_sph.scene import Scene

    return Scene.model_validate(GOOD).derive(quality="draft", **changes)


@pytest.mark.long
def test_knobs_come_from_the_scene():
    flat = of_small()
    assert flat[BASE] == {} and flat["spacing x 2"] == {"numerics.spacing": 4e-3}
    assert flat["quality paper"] == {"quality": "paper"}
    assert flat[THESIS] == {"quality": "paper", "numerics.formulation": "collocation"}
    assert flat["delay x 3"] == {"shells.plate.material.delay.tau_c": pytest.approx(3e-6)}
    assert not [name for name in flat if name.startswith(("shear_bound", "raised", "layers", "contact", "residual", "viscosity"))]
    assert not any("quality" in settings for settings in knobs(load_scene_of({})).values())  # a scene without that option
    bent = of_small(**{"shells.plate.motion": "free"})
    assert {"shear_bound 0", "raised_inertia off"} <= bent.keys() and "layers 3" not in bent
    viscous = of_small(**{"numerics.formulation": "collocation"})
    assert {"viscosity alpha 0", "no filters", "galerkin"} <= viscous.keys() and "stabilisation 0.05" not in viscous
    sound = {f"shells.plate.material.{key}": None for key in ("critical_damage", "delay", "damage")}
    static = of_small(**{"shells.plate.motion": "free", "static": {}, "shells.plate.cuts": [], **sound})
    assert "residual x 10" in static and not [n for n in static if n.startswith(("time_step", "raised", "delay"))]


@pytest.mark.long
def test_every_knob_of_a_struck_metal_plate():
    from pathlib import Path

    scene = load_scene(Path(__file__).parents[2] / "scenes" / "plate_perforation.py")
    found = knobs(scene, ["quality", "velocity"])
    assert {"layers 3", "contact tolerance 0.01", "shear_bound 0", "delay x 3", "quality paper"} <= found.keys()
    assert not {"collocation", THESIS} & found.keys()  # the strong form has no plasticity here
    for name, settings in found.items():
        if "quality" not in settings:
            scene.derive(**settings), name  # every one is a valid scene


def test_every_knob_of_a_tank_of_water():
    from pathlib import Path

    scene = load_scene(Path(__file__).parents[2] / "scenes" / "tank_leak.py")
    found = knobs(scene, ["quality", "level", "drag"])
    assert {
        "water every 1",
        "water every 4",
        f"water alpha {3 * scene.fluids[0].alpha:.3g}",
        "water delta 0.1",
        "water contact pinballs",
        "water support 1.3",
        "contact tolerance 0.01",
    } <= found.keys()
    assert found[THESIS]["fluids.water.contact"] == "pinballs" and found[THESIS]["drag"] == 0
    coarse = found["spacing x 2"]
    assert coarse["fluids.water.spacing"] == pytest.approx(2 * scene.fluids[0].spacing)  # together
    assert coarse["numerics.spacing"] == pytest.approx(2 * scene.numerics.spacing)
    alone = [name for name, settings in found.items() if judge.only_spacing(settings)]
    assert alone == [BASE, "quality standard", "quality paper", "spacing x 2", "spacing x 1.5", "spacing x 0.667"]
    assert not judge.only_spacing(found["water spacing x 0.8"]) and not judge.only_spacing({"quality": "paper", "cells": "triangle"})
    for name, settings in found.items():
        if "quality" not in settings:
            scene.derive(**settings), name


def test_every_knob_of_two_tanks_says_whose_it_is():
    from pathlib import Path

    scene = load_scene(Path(__file__).parents[2] / "scenes" / "two_tanks.py")
    found = knobs(scene, ["quality", "velocity"])
    both = {"spacing x 2", "water_left, water_right alpha 0.3", "water_left, water_right spacing x 0.8", "support 1"}
    each = {f"{knob} of {name}" for knob in ("layers 3", "delay x 3", "spacing x 1.5", "every 2") for name in ("left", "right")}
    assert both | each <= found.keys()
    assert found["water_left, water_right spacing x 0.8"].keys() == {"fluids.water_left.spacing", "fluids.water_right.spacing"}
    assert found["spacing x 1.5 of left"] == {"shells.left.spacing": pytest.approx(1.5 * scene.numerics.spacing)}
    assert len(found["spacing x 2"]) == 3
    for name, settings in found.items():
        if "quality" not in settings:
            scene.derive(**settings), name


def test_water_alone_has_no_knobs_of_a_shell():
    from pathlib import Path

    scene = load_scene(Path(__file__).parents[2] / "scenes" / "torricelli.py")
    found = knobs(scene, ["quality", "head"])
    assert {"quality paper", "precision f32", "water alpha 0.06", "water delta 0", "time_step_safety 0.5"} <= found.keys()
    assert not [name for name in found if name.startswith(("support", "stabil", "cells", "contact", "shear")) or "every" in name]


def test_knobs_turned_together():
    from pathlib import Path

    path = Path(__file__).parents[2] / "scenes" / "plate_perforation.py"
    scene = load_scene(path)
    found = together(path, scene, ["quality=standard, spacing=0.4mm", "support=1"])
    assert list(found.values()) == [{"quality": "standard", "numerics.spacing": "0.4mm"}, {"numerics.formulation.support": "1"}]
    assert list(found) == ["quality standard, spacing 0.4mm", "support 1"]
    with pytest.raises(SceneError, match="--also 'support' is not of the form key=value,key=value"):
        together(path, scene, ["support"])


@pytest.mark.parametrize("order", [1.0, 1.7, 3.0])
@pytest.mark.long
def test_richardson_finds_the_limit_and_the_order(order):
    spacings = (1.0, 1.5, 2.0)
    values = [3.0 - 0.2 * d**order for d in spacings]
    limit, found = judge.richardson(spacings, values)
    assert limit == pytest.approx(3.0, rel=1e-9) and found == pytest.approx(order, rel=1e-9)


@pytest.mark.parametrize("values", [(1.0, 1.1, 1.05), (1.0, 1.0, 1.1), (1.0, 1.1, 1.1), (1.0, 1.1, 1.1001)])
@pytest.mark.long
def test_richardson_says_where_there_is_none(values):
    assert judge.richardson((1.0, 1.5, 2.0), values) is None


@pytest.mark.long
def test_what_is_judged():
    entries = {"count": entry(2, 2, 0), "width": entry(1.1, 1.0, 0.1), "skew": entry(0.0, 0, 0.05), "speed": entry(3.0)}
    assert judge.judged(entries) == (["width"], ["count"])
    assert judge.judged(entries, ["speed"]) == (["speed"], ["count"])
    assert judge.judged({"speed": entry(3.0), "force": entry(1.0)}) == (["speed"], [])


def test_a_quantity_that_the_scene_has_not_is_refused_before_a_point_runs(tmp_path):
    with pytest.raises(
        SceneError, match="--quantity time_to_rupture: the scene has no such quantity; did you mean 'time_to_rupture.body=left"
    ):
        command.main(Path(__file__).parents[2] / "scenes" / "two_tanks.py", {}, tmp_path / "price", quantities=["time_to_rupture"])
    assert not list((tmp_path / "price").glob("points/*"))


def point(name, value, processor, met=True, spacing=1.0, status="done"):
    return {
        "name": name, "settings": {}, "scene_hash": name, "status": status, "sentence": "it broke", "command": "", "spacing": spacing,
        "nodes": 1, "steps": 1, "node_steps": 1e6 * processor, "bytes": 1e6, "seconds": processor, "processor": processor,
        "cost": processor, "values": {"w": value, "count": 1.0 if met else 2.0},
        "met": {"count": met}, "B_percent": 0.0,
    }  # fmt: skip


@pytest.mark.long
def test_references():
    series = [point("a", 1.0 + 0.1 * d**2, 1, spacing=d) for d in (1.0, 2.0, 4.0)]
    found = judge.references(series[0], ["w"], series, {"w": entry(1.1)})["w"]
    assert found["kind"] == "richardson" and found["value"] == pytest.approx(1.0) and "order 2" in found["words"]
    found = judge.references(series[0], ["w"], series, {"w": entry(1.1, 1.2, 0.1)})["w"]
    assert (found["kind"], found["value"], found["limit"]) == ("target", 1.2, pytest.approx(1.0))
    series[1]["values"]["w"] = 1.0
    found = judge.references(series[0], ["w"], series, {"w": entry(1.1)})["w"]
    assert (found["kind"], found["value"]) == ("finest", 1.1) and "do not converge monotonically" in found["words"]


def record(*points):
    refs = {"w": {"value": 1.0, "unit": "m", "kind": "target", "words": "theory"}}
    for p in points:
        p["error"] = judge.error_of(p, refs, ["count"])
    points = list(points)
    return {
        "scene": "small", "title": "A plate", "quality": "draft", "references": refs, "counts": ["count"],
        "points": points, "front": judge.front(points),
        "qualities": judge.qualities(points), "command": "taichi-sph price small", "left_out": {}, "thesis": THESIS,
    }  # fmt: skip


def several():
    return [
        point(BASE, 1.02, 10), point("quick", 1.028, 4), point("rough", 1.2, 1), point("fine", 1.004, 40), point("fool", 1.03, 50),
        point("lucky", 1.0, 2, met=False), point("gone", None, 0.1, status="failed"),
        point(THESIS, 1.05, 30) | {"settings": {"formulation": "collocation"}},
    ]  # fmt: skip


@pytest.mark.long
def test_errors_front_and_qualities():
    found = record(*several())
    errors = {p["name"]: p["error"] for p in found["points"]}
    assert errors["rough"] == pytest.approx(0.2) and errors["lucky"] is None and errors["gone"] is None
    assert judge.front([*found["points"], {**found["points"][0], "name": "delay x 3", "error": 0.0}]) == found["front"]
    assert found["front"] == ["rough", "quick", BASE, "fine"]
    assert found["qualities"] == {"draft": "quick", "standard": "quick", "paper": "fine"}
    assert judge.qualities([p for p in found["points"] if p["error"] is None]) == {}
    steep = record(
        point("useless", 13.0, 0.2), point("bad", 1.15, 0.3), point("rough", 1.08, 1), point("good", 1.0014, 9), point("best", 1.0007, 69)
    )
    assert steep["qualities"] == {"draft": "rough", "standard": "good", "paper": "best"}  # standard is no worse than draft


@pytest.mark.long
def test_words():
    said = " ".join(words.sentences(record(*several())))
    assert "As it is (draft): error 2 % of w for 10 processor seconds, 10 M node-steps." in said
    assert "Twice as fast (quick, 2.5 times) costs 0.8 % of w." in said
    assert "Five times as fast (rough, 10 times) costs 18 % of w." in said and "Twenty times as fast: none" in said
    assert "The least error, 0.4 %, takes 4 times the cost (fine)." in said
    assert "settings (collocation, its spacing): error 5 % for 30" in said
    assert "With no more error: as it is, error 2 %, 3 times as fast." in said
    noisy = several()
    noisy[0]["spread"], noisy[0]["runs"] = [0.0, 0.05], 4
    assert "costs 0.8 % of w, which is within the spread of 5 %." in " ".join(words.sentences(record(*noisy)))
    thesis = several()
    thesis[-1] = point(THESIS, 1.001, 1.5)
    assert "No point is twice as fast as they are with no more error." in words.sentences(record(*thesis))
    thesis[-1] = point(THESIS, 1.015, 30) | {"spread": [0.01, 0.025], "runs": 3}  # 2 % is within its spread
    assert "With no more error: as it is, error 2 %, 3 times as fast." in words.sentences(record(*thesis))
    metal = record(*several()[:-1], point(PAPER, 1.05, 30)) | {"thesis": PAPER}  # the strong form has no metal
    assert "The thesis's own settings (its spacing, in galerkin): error 5 % for 30" in " ".join(words.sentences(metal))
    text = words.table(record(*several()))
    assert "| gone | failed: it broke |" in text and "another answer: count 2" in text and "| **fine** | 0.4 % | 1.004 | 40.00 |" in text


@pytest.fixture
def runs(work, scene_file, monkeypatch):
    """plate.py, whose runs find a width that goes with the square of the spacing and is scattered where nodes are moved."""
    (work / "plate.py").write_text(SCRIPT)
    asked = []

    def answer(task):
        asked.append(task["settings"])
        if task["scene"] is None:
            return sweep._result(task, None, task["sentence"])
        n = json.loads(task["scene"])["numerics"]
        d = n["spacing"] / 2e-3
        width = 1.0 + 0.04 * d**2 + (0.03 * (n["seed"] - 1.5) if n["irregularity"] else 0.0) + (0.5 if n["precision"] == "f32" else 0.0)
        summary = {
            "seconds": {"compile": 1.0, "advance": d**-3, "write": 0.0}, "processor_seconds": d**-3, "node_steps": 1000 * d**-3,
            "bytes": 5000, "nodes": 5, "steps": 7, "settings": {"spacing": n["spacing"]}, "B_percent": 0.1,
            "quantities": {"crack_width": entry(width, 1.0, 0.1), "crack_count": entry(1 if d < 1.9 else 3, 1, 0, "")}, "commit": "abc",
        }  # fmt: skip
        return sweep._result(task, summary, "")

    monkeypatch.setitem(sweep.run_points.__kwdefaults__, "worker", answer)
    return asked


@pytest.mark.long
def test_the_command(call, work, runs):
    code, out, err = call("price", "plate.py", "--seeds", "2", "--most", "100", "--out", "p", "--record")
    assert (code, err) == (0, "")
    found = json.loads((work / "p/price.json").read_text())
    points = {p["name"]: p for p in found["points"]}
    assert found["references"]["crack_width"]["kind"] == "target" and found["references"]["crack_width"]["limit"] == pytest.approx(1.0)
    assert points["quality paper"]["error"] == pytest.approx((0.0025 + 0.0125 + 0.0175) / 3)  # mean over three runs
    assert points["spacing x 2"]["error"] is None  # three cracks instead of one
    assert points[BASE]["runs"] == 3 and points[BASE]["spread"] == pytest.approx([0.025, 0.055])
    assert "spread" not in points["precision f32"] and points["precision f32"]["error"] == pytest.approx(0.54)
    assert (
        found["command"] == "taichi-sph price plate.py --seeds 2 --most 100"
        and found["cost"] == "node_steps"
        and found["quality_rule"] == judge.QUALITY_RULE
    )
    assert {s.get("numerics.seed") for s in runs} == {None, 1, 2}
    text = (work / "p/price.md").read_text()
    assert "another answer: crack_count 3" in text and "Qualities by the rule (draft: the cheapest" in text
    for picture in (work / "p/price.png", work / "renders/price_small.png"):
        assert 5_000 < picture.stat().st_size < 300_000
    assert json.loads((work / "benchmarks/price/small.json").read_text()) == found
    # what is done is not run again
    runs.clear()
    assert call("price", "plate.py", "--seeds", "2", "--most", "100", "--out", "p")[0] == 0 and runs == []
    # and validate tells it, of a scene that was measured and of one that was not
    said = call("validate", "plate.py")[1]
    assert "measured: error 4 % (2.5 % to 5.5 % over 3 runs) of crack_width, 1 processor seconds, 0.001 M node-steps, 5 kB" in said
    assert re.search(r"by the rule [a-z, ]*paper (is|are): .*error .* --set ", said)
    assert "measured: not with these settings" in call("validate", "plate.py", "--set", "numerics.spacing=1.7mm")[1]


@pytest.mark.long
def test_what_costs_too_much_is_left_out_by_name(call, work, runs):
    code, out, _ = call("price", "plate.py", "--seeds", "0", "--most", "10", "--out", "p")
    assert code == 0 and "left out: quality paper, estimated at" in out
    assert "quality paper" not in [p["name"] for p in json.loads((work / "p/price.json").read_text())["points"]]


@pytest.mark.long
def test_a_scene_that_has_no_number(call, work, runs, scene_file):
    code, _, err = call("price", "small.json", "--out", "p")
    assert code == 2 and "has no quantities, so there is no error to measure" in err and not (work / "p").exists()


@pytest.mark.long
def test_a_scene_that_gives_no_answer(call, work, runs, monkeypatch):
    fails = lambda task: sweep._result(task, None, "it broke")  # noqa: E731
    monkeypatch.setitem(sweep.run_points.__kwdefaults__, "worker", fails)
    code, _, err = call("price", "plate.py", "--out", "p")
    assert code == 3 and "the scene as it is gives no answer: it broke" in err


@pytest.mark.long
def test_what_a_scene_takes(call, work, scene_file):
    """The real simulation: fields add up to its bytes, and a plate in its plane has no kernel of contact."""
    from taichi_sph import runtime

    code, out, err = call("doctor", "--scene", "small.json")
    lines = out.splitlines()
    assert code == 0 and lines[0].startswith("A small plate (small, custom): 231 nodes")
    run = runtime.current()
    assert lines[1].startswith(f"{len(run.fields)} fields, ") and sum(run.fields.values()) == run.bytes
    counts = [int(line.rpartition(": ")[2].split(",")[0]) for line in lines[2:] if line.startswith("  ")]
    assert sum(counts) == len(run.fields) + len(runtime.kernels())
    assert "  bodies.shell_sph.galerkin: " in out and "contact" not in out and "built and compiled in" in lines[-1]
