"""Summary, answer, record and results of a finished run."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from taichi_sph.errors import SceneError
from taichi_sph.output import results
from taichi_sph.output.answer import answer, equilibrium, in_words, open_balance, quantity_text
from taichi_sph.output.folder import RunFolder
from taichi_sph.output.record import scene_hash, write_record
from taichi_sph.output.summary import judged
from taichi_sph.scene import Quantity

from .synthetic import plate_scene, write_run


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> RunFolder:
    return write_run(tmp_path_factory.mktemp("run"), count=2)


def test_summary(run: RunFolder) -> None:
    summary = run.summary
    assert summary["node_steps"] == 16281 * 600
    assert summary["node_steps_per_second"] == pytest.approx(16281 * 600 / 4)
    assert (summary["B_percent"], summary["closed_residual_percent"]) == (-0.13, 0.02)
    assert summary["quantities"]["branch_count"] == {
        "value": 2,
        "unit": "",
        "target": 2,
        "tolerance": 0,
        "source": "drawn",
        "met": True,
    }
    assert summary["quantities"]["tip_speed_plateau"]["met"] is None
    tip = run.history("crack_tip")
    assert tip.units == {"time": "s", "x_front": "m", "y_front": "m", "ahead": "m", "speed": "m/s"}
    assert np.all(np.diff(tip["x_front"]) >= 0)


@pytest.mark.parametrize("value, met", [(57e-6, True), (62e-6, True), (63e-6, False), (None, False)])
def test_judged(value: float | None, met: bool) -> None:
    quantity = Quantity(name="edge_arrival", unit="s", value=56e-6, tolerance=6e-6)
    assert judged(quantity, value)["met"] is met


def test_answer(run: RunFolder) -> None:
    text = "\n".join(answer(run))
    assert text.startswith("Cracked: yes, ")
    assert re.search(r"splits in two, 2\d(\.\d)? mm ahead of it at 2\d(\.\d)? us", text)
    assert "reaches the far edge at 54.2 us" in text
    assert "edge arrival: 54.2 us (expected 55 us ± 1 us: met)" in text
    assert "balance B = -0.13 %, closed residual = +0.02 %" in text
    assert "2.44 M node-steps/s" in text
    assert "do not trust" not in text


@pytest.mark.parametrize("residual, warned", [(4.9, False), (-4.9, False), (5.1, True), (-86.0, True), (None, False)])
def test_a_balance_that_does_not_close_is_warned_of(run: RunFolder, residual: float | None, warned: bool) -> None:
    text = "\n".join(answer(run, run.summary | {"closed_residual_percent": residual}))
    assert ("do not trust these numbers yet, take a finer spacing" in text) == warned
    assert ("55 us ± 1 us: met, but do not trust it yet)" in text) == warned and "55 us ± 1 us: met" in text
    static = open_balance(residual, True)  # the work of a search is summed from one equilibrium to the next
    assert "not trust" not in static and ("the error of the work" in static) == warned


@pytest.mark.parametrize(
    "name, text",
    [
        ("crack_count", "crack count"),
        ("peak_force_finer", "peak force finer"),
        ("striker_speed()", "striker speed"),
        ("striker_speed()_delay-x0.1", "striker speed, delay-x0.1"),
        ("striker_speed(axis=x, beyond=0.0)_kappa-0", "striker speed where x = 0, kappa-0"),
        ("history_value(history=rigid_block, column=vz, time=0.0003448275862068965)", "history value of vz in block at 345 us"),
        (
            "peak_time(history=probe_centre, column=v_x, start=2.02e-05, end=2.6e-05)_galerkin",
            "peak time of v x in centre from 20.2 us to 26 us, galerkin",
        ),
        ("frequency_ratio(mode=1.0, reference=33.52946148)_free_regular", "frequency ratio of mode 1 over 33.53, free regular"),
        ("surge_speed(axis=x, start=1.43, end=2.96)", "surge speed from 1.43 to 2.96, axis x"),
    ],
)
def test_names_of_quantities_in_words(name: str, text: str) -> None:
    assert in_words(name) == text


def test_answer_without_crack(tmp_path: Path) -> None:
    assert answer(write_run(tmp_path, count=1))[0].startswith("Cracked: no. The largest damage is 0.")


@pytest.mark.parametrize(
    "value, unit, text",
    [
        (5.62e-5, "s", "56.2 us"),
        (7.5e-3, "m", "7.5 mm"),
        (1450.0, "m/s", "1450 m/s"),
        (2.0, "", "2"),
        (None, "s", "none"),
        (0.0, "s", "0 s"),
        (1.5, "s", "1.5 s"),
    ],
)
def test_quantities_in_words(value: float | None, unit: str, text: str) -> None:
    assert quantity_text(value, unit) == text


def test_record(run: RunFolder) -> None:
    state = {"u": np.arange(5.0)}
    options = {"command": "x", "arch": "cpu", "threads": 2, "steps": 600, "seconds": {"advance": 4.0}}
    record = write_record(run.path, run.scene, state=state, **options)
    again = write_record(run.path, run.scene, state={"u": np.arange(5.0)}, **options)
    other = write_record(run.path, run.scene, state={"u": np.arange(5.0) + 1e-15}, **options)
    assert record["result_hash"] == again["result_hash"] != other["result_hash"]
    assert record["scene_hash"] == run.summary["scene_hash"]
    assert run.scene == type(run.scene).model_validate(run.record["scene"])
    assert {"python", "numpy", "h5py"} <= record["versions"].keys()


def test_hash_of_a_scene_ignores_what_is_only_shown() -> None:
    scene = plate_scene()
    assert scene_hash(scene) == scene_hash(plate_scene(title="Other", **{"output.frames": 3}))
    assert scene_hash(scene) != scene_hash(plate_scene(duration=7e-5))


def test_results(run: RunFolder, tmp_path: Path) -> None:
    path = results.record_summary(run, tmp_path)
    assert path.name == "drawn_plate-draft-galerkin.json"
    summaries = results.read_summaries(tmp_path)
    text = results.markdown(summaries.values())
    assert "| edge arrival | 54.2 us | 55 us ± 1 us | yes | drawn |" in text
    assert "taichi-sph run drawn_plate" in text
    assert results.stale(summaries, lambda s: plate_scene()) == {}
    changed = results.stale(summaries, lambda s: plate_scene(duration=7e-5))
    assert "its scene changed" in changed[path.stem]

    def gone(_: dict) -> None:
        raise SceneError("there is no scene 'drawn_plate'")

    assert "cannot be built" in results.stale(summaries, gone)[path.stem]


@pytest.mark.parametrize(
    "content, sentence", [("{", "not valid JSON"), ("[]", "not the summary"), (json.dumps({"scene": "x"}), "title is missing")]
)
def test_spoiled_summaries(tmp_path: Path, content: str, sentence: str) -> None:
    (tmp_path / "x.json").write_text(content)
    with pytest.raises(SceneError, match=sentence):
        results.read_summaries(tmp_path)


def test_folders_that_are_no_runs(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="no run folder"):
        RunFolder(tmp_path / "none")
    with pytest.raises(SceneError, match="not a run folder"):
        _ = RunFolder(tmp_path).scene


@pytest.mark.parametrize(
    ("method", "last", "said", "doubted"),
    [
        (None, {"newton_steps": 46}, ["Equilibrium by Newton's method (46 factorisations)."], False),
        ("arc", {"newton_steps": 1}, ["Equilibrium by the path of the load (1 factorisation)."], False),
        (
            None,
            {"newton_steps": 40, "path_points": 7, "relaxation_steps": 900},
            ["Newton's method (40 factorisations), then the length of the path (7 points), where no step of load was short enough"],
            False,
        ),
        (None, {"newton_steps": 9, "unstable": 1}, ["Do not trust this equilibrium yet: it is unstable, the least push"], True),
        ("arc", {"newton_steps": 9, "unstable": 1}, ["The last point of the path is unstable"], False),
        ("arc", {"newton_steps": 9, "load": 0.25}, ["Not all of the load is borne: 25 % at the end, 50 % at the most."], False),
        (None, {"newton_steps": 9, "turn_per_cell": 1.05}, ["neighbours have turned apart by 60 degrees: take a finer spacing"], True),
    ],
)
def test_an_equilibrium_says_how_it_was_found_and_when_it_is_none(method, last, said, doubted) -> None:
    end = {"newton_steps": 0, "path_points": 0, "relaxation_steps": 0, "load": 1.0, "unstable": 0, "turn_per_cell": 0.1} | last

    class Progress(dict):
        columns = list(end)

        def __len__(self) -> int:
            return 2

    progress = Progress({name: np.array([0.5 if name == "load" else 0.0, value], float) for name, value in end.items()})
    run = SimpleNamespace(history=lambda _: progress, scene=SimpleNamespace(static=SimpleNamespace(method=method)))
    lines, found = equilibrium(run)
    assert found == doubted and all(any(part in line for line in lines) for part in said), lines
