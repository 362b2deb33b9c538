"""Sweeps: designs, points that fail, going on, the table, and a real Dask cluster that loses a worker."""

from __future__ import annotations

import csv
import json
import os
import signal
import time
from collections import Counter

import pytest

from taichi_sph.errors import SceneError
from taichi_sph.studies import sweep

from .conftest import files

SCRIPT = """
from pathlib import Path
from taichi_sph.scene import Quality, Scene, load_scene

def scene(quality: Quality = "draft", rows: int = 10) -> Scene:
    return load_scene(Path(__file__).with_name("small.json"), {"numerics.spacing": 0.02 / rows})
"""


@pytest.fixture
def script(work, scene_file):
    path = work / "plate.py"
    path.write_text(SCRIPT)
    return path


@pytest.fixture
def done(monkeypatch):
    """Points are answered at once; the settings that were asked for are listed."""
    asked = []

    def answer(point):
        asked.append(point["settings"])
        if point["scene"] is None:
            return sweep._result(point, None, point["sentence"])
        if point["settings"].get("rows") == "13":
            return sweep._result(point, None, "body 'plate', node 3: velocity is not finite")
        summary = {
            "seconds": {"compile": 1.0, "advance": 2.0, "write": 0.5},
            "node_steps": 100,
            "bytes": 5000,
            "quantities": {"crack_count": {"value": float(len(asked))}},
            "commit": "abc",
        }
        return sweep._result(point, summary, "")

    monkeypatch.setattr(sweep, "compute", answer)
    monkeypatch.setitem(sweep.run_points.__kwdefaults__, "worker", answer)
    return asked


def read(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.long
def test_designs():
    design = {"a": ["1", "2"], "b": ["x", "y", "z"]}
    assert len(sweep.full(design)) == 6 and {"a": "2", "b": "z"} in sweep.full(design)
    assert sweep.one_at_a_time(design) == [{}, {"a": "1"}, {"a": "2"}, {"b": "x"}, {"b": "y"}, {"b": "z"}]


@pytest.mark.long
def test_settings_are_found_by_their_short_names(script):
    scene = sweep.load(script)
    for name, full in {
        "rows": "rows",
        "duration": "duration",
        "spacing": "numerics.spacing",
        "formulation": "numerics.formulation",
        "support": "numerics.formulation.support",
        "shells.plate.thickness": "shells.plate.thickness",
    }.items():
        assert sweep.setting_of(script, scene, name) == full
    pairs = ['numerics.contact={"tolerance":1e-2,"iterations":9},null', "rows=10, 12"]
    assert sweep.varied(script, scene, pairs) == {"numerics.contact": ['{"tolerance":1e-2,"iterations":9}', "null"], "rows": ["10", "12"]}


@pytest.mark.parametrize(
    ("pairs", "said"),
    [
        (["rowz=1"], "--vary rowz: there is no such setting; did you mean 'rows'?"),
        (["spacng=1mm"], "did you mean 'spacing'?"),
        (["numerics.spacng=1mm"], "unknown key 'spacng' in numerics; did you mean 'spacing'?"),
        (["shells.plat.thickness=1mm"], "there is no entry 'plat' in shells; did you mean 'plate'?"),
        (["rows"], "--vary 'rows' is not of the form key=value,value"),
        (["rows=1,,2"], "--vary 'rows=1,,2' is not of the form key=value,value"),
        (["rows=1,1"], "--vary rows: a value is given twice"),
        (["spacing=1mm", "numerics.spacing=2mm"], "--vary numerics.spacing is given twice"),
    ],
)
@pytest.mark.long
def test_bad_input_is_refused_before_anything_is_written(call, work, script, done, pairs, said):
    before = files(work)
    code, out, err = call("sweep", "plate.py", *(word for pair in pairs for word in ("--vary", pair)), "--out", "s")
    assert code == 2 and said in err and err.count("\n") == 1 and files(work) == before and done == []


@pytest.mark.long
def test_one_table_with_failed_points_in_it_and_going_on(call, work, script, done):
    command = ["sweep", "plate.py", "--vary", "rows=10,13,none", "--vary", "precision=f64,f32", "--out", "s"]
    code, out, err = call(*command)
    assert code == 3 and err.startswith("taichi-sph: 4 of 6 points failed") and err.count("\n") == 1
    table = read(work / "s/results.csv")
    assert [(r["rows"], r["numerics.precision"], r["status"]) for r in table] == [
        (rows, precision, "done" if rows == "10" else "failed") for rows in ("10", "13", "none") for precision in ("f64", "f32")
    ]
    assert table[0]["seconds_advance"] == "2.0" and table[0]["node_steps"] == "100" and table[0]["bytes"] == "5000"
    assert "node 3" in table[2]["sentence"] and table[2]["crack_count"] == "" and "rows" in table[4]["sentence"]
    pq = pytest.importorskip("pyarrow.parquet")
    columns = pq.read_table(work / "s/results.parquet").to_pydict()
    assert columns["status"] == [r["status"] for r in table]
    assert columns["crack_count"][0] == float(table[0]["crack_count"]) and columns["crack_count"][3] is None
    # what is done is not run again, what failed is, and a new value joins
    done.clear()
    command[3] = "rows=10,13,14"
    code, out, _ = call(*command)
    assert code == 3 and "2 of 6 points are done already" in out
    assert sorted(s["rows"] for s in done) == ["13", "13", "14", "14"]
    # another scene under the same settings is another point
    done.clear()
    script.write_text(SCRIPT.replace("0.02 / rows", "0.04 / rows"))
    call(*command)
    assert len(done) == 6


@pytest.mark.long
def test_a_half_written_result_counts_as_not_done(call, work, script, done):
    call("sweep", "plate.py", "--vary", "rows=10,12", "--out", "s")
    first = sorted((work / "s/points").glob("*.json"))[0]
    first.write_text(first.read_text()[:40])
    done.clear()
    assert call("sweep", "plate.py", "--vary", "rows=10,12", "--out", "s")[0] == 0 and len(done) == 1


@pytest.mark.long
def test_out_must_be_a_sweep(call, work, script, done):
    (work / "mine").mkdir()
    (work / "mine/x").touch()
    code, _, err = call("sweep", "plate.py", "--vary", "rows=10", "--out", "mine")
    assert code == 2 and "holds files that are not of a run" in err


@pytest.mark.long
def test_a_point_runs_in_a_process_of_its_own(work, script):
    """The real thing, once: a run, a run that takes too long, and one that is no scene."""
    base = {"duration": 1e-6}
    results = [
        sweep.compute(sweep.task(script, base, settings, threads=1, patience=patience))
        for settings, patience in (({"rows": "10"}, None), ({"rows": "10"}, 0.2), ({"rows": "0"}, None))
    ]
    assert [r["status"] for r in results] == ["done", "failed", "failed"], [r["sentence"] for r in results]
    summary = results[0]["summary"]
    assert (
        summary["bytes"] > 1000 and summary["processor_seconds"] > 0 and summary["command"].endswith("--set duration=1e-06 --set rows=10")
    )
    assert "it was not done after 0.2 s" in results[1]["sentence"] and "ZeroDivisionError" in results[2]["sentence"]


@pytest.mark.long
def test_a_process_that_crashes_is_a_sentence(monkeypatch, script):
    monkeypatch.setattr(sweep, "CHILD", "import os, signal; os.kill(os.getpid(), signal.SIGKILL)")
    assert sweep.compute(sweep.task(script, {}, {}))["sentence"] == "the process ended with signal 9"
    monkeypatch.setattr(sweep, "CHILD", "import sys; print('taichi-sph: it broke', file=sys.stderr); sys.exit(3)")
    assert sweep.compute(sweep.task(script, {}, {}))["sentence"] == "it broke"
    monkeypatch.setattr(sweep, "CHILD", "[][0]")
    assert (
        sweep.compute(sweep.task(script, {}, {}))["sentence"] == 'IndexError: list index out of range; File "<string>", line 1, in <module>'
    )


@pytest.mark.long
def test_a_process_ends_with_the_one_that_started_it(tmp_path):
    """Else the points of a killed worker would go on beside those that replace them."""
    import subprocess
    import sys

    watch = sweep.CHILD.replace(
        "from taichi_sph.cli import main\nmain()",
        f"import time\nopen({str(tmp_path / 'pid')!r}, 'w').write(str(os.getpid()))\ntime.sleep(60)",
    )
    parent = f"import subprocess, sys; subprocess.Popen([sys.executable, '-c', {watch!r}], stdin=subprocess.PIPE).wait()"
    started = subprocess.Popen([sys.executable, "-c", parent])
    until = time.monotonic() + 30
    while not (tmp_path / "pid").exists() or not (tmp_path / "pid").read_text():
        assert time.monotonic() < until
        time.sleep(0.02)
    started.kill()
    started.wait()
    child = int((tmp_path / "pid").read_text())
    while time.monotonic() < until:
        try:
            os.kill(child, 0)
        except ProcessLookupError:
            return
        time.sleep(0.02)
    raise AssertionError("the child outlived its parent")


def slow(point):
    """A point of the cluster: says who computes it, and takes its time."""
    with open(os.path.join(point["settings"]["where"], "began"), "a") as log:
        log.write(f"{point['id']} {os.getpid()}\n")
    time.sleep(0.3)
    return sweep._result(point, {"quantities": {}, "seconds": {"advance": 0.3}, "pid": os.getpid()}, "")


@pytest.mark.long
def test_a_cluster_that_loses_a_worker_loses_no_point(tmp_path):
    distributed = pytest.importorskip("distributed")
    tasks = [
        {"id": f"p{i}", "settings": {"i": i, "where": str(tmp_path)}, "scene": "{}", "scene_hash": "x", "sentence": ""} for i in range(8)
    ]
    began = tmp_path / "began"
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        pids = {w.pid for w in (nanny.process.process for nanny in cluster.workers.values())}
        assert len(pids) == 2

        class Killer:
            """Ends the worker of the third point that began, while it computes."""

            victim = None

            def say(self, text):
                if self.victim is None:
                    lines = began.read_text().splitlines()
                    self.victim = int(lines[-1].split()[1])
                    os.kill(self.victim, signal.SIGKILL)

        killer = Killer()
        results = sweep.run_points(tasks, tmp_path / "points", scheduler=cluster.scheduler_address, worker=slow, progress=killer)
    assert killer.victim in pids
    assert [r["id"] for r in results] == [t["id"] for t in tasks] and all(r["status"] == "done" for r in results)
    starts = Counter(line.split()[0] for line in began.read_text().splitlines())
    assert max(starts.values()) == 2, "the point of the killed worker must have begun again"
    stored = sorted(p.name for p in (tmp_path / "points").iterdir())
    assert stored == sorted(f"{t['id']}.json" for t in tasks)
    table = sweep.rows(results)
    assert len({row["point"] for row in table}) == len(table) == 8
    # and nothing of it is run again
    again = sweep.run_points(tasks, tmp_path / "points", worker=lambda point: pytest.fail("run again"))
    assert [json.dumps(r) for r in again] == [json.dumps(r) for r in results]


@pytest.mark.long
def test_a_scheduler_that_is_not_there(monkeypatch, tmp_path):
    distributed = pytest.importorskip("distributed")
    whole = distributed.Client
    monkeypatch.setattr(distributed, "Client", lambda address, timeout, **rest: whole(address, timeout=0.5, **rest))
    task = {"id": "p", "settings": {}, "scene": "{}", "scene_hash": "x"}
    with pytest.raises(SceneError, match="--scheduler 'tcp://127.0.0.1:1': no Dask scheduler answers there"):
        sweep.run_points([task], tmp_path, scheduler="tcp://127.0.0.1:1")


@pytest.mark.long
def test_without_dask_there_is_a_sentence(monkeypatch, tmp_path):
    import sys

    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(SceneError, match=r"pip install 'taichi-sph\[sweep\]'"):
        sweep.run_points([{"id": "p", "settings": {}, "scene_hash": "x"}], tmp_path, scheduler="tcp://h:1")
