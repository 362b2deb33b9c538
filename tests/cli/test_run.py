"""The loop of a run, with a stand-in for the physics: what is written when, interrupts, stops, resumes."""

from __future__ import annotations

import json
import re
import signal

import numpy as np
import pytest

from taichi_sph.output.frames import FramesFile
from taichi_sph.output.histories import read_history
from taichi_sph.run.progress import Pace
from taichi_sph.run.session import Every

from ..scene.examples import GOOD
from .conftest import files

QUIET = ("--no-pictures",)


def results(folder):
    """What must be the same after an interrupt: histories, frames, final state."""
    with FramesFile(folder / "frames" / "plate.vtkhdf") as frames:
        shown = [(t, body.points) for t, body in zip(frames.times, frames)]
    return {
        "energies": (folder / "histories" / "energies.csv").read_text(),
        "progress": (folder / "histories" / "progress.csv").read_text(),
        "times": [t for t, _ in shown],
        "points": np.array([p for _, p in shown]).tobytes(),
        "hash": json.loads((folder / "record.json").read_text())["result_hash"],
    }


def test_a_whole_run(call, work, fake, scene_file):
    code, out, err = call("run", "small.json", "--out", "r", *QUIET)
    assert (code, err) == (0, "")
    assert "231 nodes" in out and "100 %" in out and "ruled by a rule" in out and "written: r" in out
    assert {p.name for p in (work / "r").iterdir()} == {
        "scene.json", "summary.json", "record.json", "log.txt", "frames", "histories", "checkpoints",
    }  # fmt: skip
    with FramesFile(work / "r/frames/plate.vtkhdf") as frames:
        assert frames.times == pytest.approx(np.linspace(0, 20e-6, 5))
    assert read_history(work / "r/histories/progress.csv").time == pytest.approx(np.linspace(0, 20e-6, 9))
    assert [p.name for p in sorted((work / "r/checkpoints").iterdir())] == [
        "step_000000020.checkpoint",
        "step_000000040.checkpoint",
    ]
    log = (work / "r/log.txt").read_text()
    assert "compiled and built" in log and "100 %" in log
    summary = json.loads((work / "r/summary.json").read_text())
    assert summary["command"] == "taichi-sph run small.json" and summary["steps"] == 40
    assert set(summary["seconds"]) == {"compile", "advance", "write"}


def test_the_default_folder_and_a_second_run_into_it(call, work, fake, scene_file):
    assert call("run", "small.json", *QUIET)[0] == 0
    stale = work / "runs/small-custom/pictures/old.png"
    stale.parent.mkdir()
    stale.touch()
    (work / "runs/small-custom/notes.txt").write_text("mine")
    before = files(work)
    code, _, err = call("run", "small.json", *QUIET)
    assert code == 2 and files(work) == before and len(fake.asked) == 1
    assert err == "taichi-sph: 'runs/small-custom' holds a finished run; replace it with --overwrite, or give another folder with --out\n"
    assert call("run", "small.json", "--overwrite", *QUIET)[0] == 0
    assert not stale.exists() and (work / "runs/small-custom/notes.txt").exists()


def test_an_interrupted_run_is_not_replaced_by_mistake(call, work, fake, scene_file):
    fake.on_step = lambda sim: sim.step == 11 and signal.raise_signal(signal.SIGINT)
    assert call("run", "small.json", "--out", "r", *QUIET)[0] == 130
    fake.on_step = None
    before = files(work)
    code, _, err = call("run", "small.json", "--out", "r", *QUIET)
    assert code == 2 and files(work) == before
    assert "holds an interrupted run; go on with: taichi-sph resume r, or replace it with --overwrite" in err
    assert call("run", "small.json", "--out", "r", "--overwrite", *QUIET)[0] == 0


@pytest.mark.parametrize("step", [1, 9, 10, 11, 25, 39])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupt_and_resume_is_the_same_run(call, work, fake, scene_file, step, number):
    assert call("run", "small.json", "--out", "whole", *QUIET)[0] == 0
    fake.on_step = lambda sim: sim.step == step and signal.raise_signal(number)
    code, _, err = call("run", "small.json", "--out", "parts", *QUIET)
    assert code == 130
    assert signal.Signals(number).name in err and "taichi-sph resume parts" in err and err.count("\n") == 1
    assert not (work / "parts/summary.json").exists()
    fake.on_step = None
    code, out, err = call("resume", "parts", *QUIET)
    assert (code, err) == (0, "") and int(re.search(r"resuming .* step (\d+)", out)[1]) >= step
    assert results(work / "parts") == results(work / "whole")


def test_killed_and_resumed_from_an_older_checkpoint(call, work, fake, scene_file):
    """What was written after the checkpoint is dropped and made again."""
    assert call("run", "small.json", "--out", "whole", *QUIET)[0] == 0

    class Killed(BaseException):
        pass

    def kill(sim):
        if sim.step == 33:
            raise Killed

    fake.on_step = kill
    with pytest.raises(Killed):
        call("run", "small.json", "--out", "parts", *QUIET)
    fake.on_step = None
    assert call("resume", "parts", *QUIET)[0] == 0
    assert results(work / "parts") == results(work / "whole")


def test_interrupted_twice(call, work, fake, scene_file):
    assert call("run", "small.json", "--out", "whole", *QUIET)[0] == 0
    fake.on_step = lambda sim: sim.step in (7, 22) and signal.raise_signal(signal.SIGINT)
    assert call("run", "small.json", "--out", "parts", *QUIET)[0] == 130
    assert call("resume", "parts", *QUIET)[0] == 130
    assert call("resume", "parts", *QUIET)[0] == 0
    assert results(work / "parts") == results(work / "whole")
    finished = "taichi-sph: the run in 'parts' is finished: there is nothing to resume; it goes on with a later end than 20 us: "
    finished += "--set duration=...\n"
    assert call("resume", "parts", *QUIET)[2] == finished


def test_a_finished_run_goes_on_to_a_later_end(call, work, fake, scene_file):
    """As if it had been started with that end; a kill on the way leaves a run that is resumed as any other."""
    fake.long = 0.5e-6
    longer = [part for one in ("duration=40us", "output.frames=8", "output.samples=16", "output.checkpoints=4") for part in ("--set", one)]
    assert call("run", "small.json", *longer, "--out", "whole", *QUIET)[0] == 0
    assert call("run", "small.json", "--out", "parts", *QUIET)[0] == 0
    for key, value in (("duration", "10us"), ("numerics.spacing", 0.1), ("durations", 1)):
        code, _, err = call("resume", "parts", "--set", f"{key}={value}", *QUIET)
        assert code == 2 and key in err and err.count("\n") == 1
    last = sorted((work / "parts/checkpoints").iterdir())[-1].name
    half = int(last.removeprefix("step_").partition(".")[0])
    fake.on_step = lambda sim: sim.step == half + 3 and signal.raise_signal(signal.SIGINT)
    assert call("resume", "parts", *longer, *QUIET)[0] == 130
    fake.on_step = None
    assert not (work / "parts/summary.json").exists()
    assert call("resume", "parts", *QUIET)[0] == 0
    assert results(work / "parts") == results(work / "whole")


def test_a_kill_while_a_finished_run_gets_its_later_end(call, work, fake, scene_file, monkeypatch):
    """The last checkpoint is of the scene to come by then; before it is written, the run is as it was."""
    import taichi_sph.run.session as session

    longer = ("--set", "duration=40us")
    assert call("run", "small.json", *longer, "--set", "output.checkpoints=1", "--out", "whole", *QUIET)[0] == 0
    assert call("run", "small.json", "--set", "output.checkpoints=1", "--out", "parts", *QUIET)[0] == 0
    before = files(work / "parts")

    def killed(*_):
        raise MemoryError

    for name, whole in (("_Session.keep", False), ("_switch", True)):
        with monkeypatch.context() as patched:
            patched.setattr(f"taichi_sph.run.session.{name}", killed)
            with pytest.raises(MemoryError):
                session.resume(work / "parts", settings={"duration": "40us"}, simulation=fake)
        assert (work / "parts/scene.next.json").exists()
        if not whole:
            assert "finished" in call("resume", "parts", *QUIET)[2]
            assert not (work / "parts/scene.next.json").exists() and files(work / "parts").keys() == before.keys()
    assert call("resume", "parts", *QUIET)[0] == 0
    assert (work / "parts/scene.json").read_text() != before["scene.json"] and not (work / "parts/scene.next.json").exists()


@pytest.mark.parametrize("setting", ["output.frames=8", "duration=20us"])
def test_a_finished_run_asks_for_a_later_end(call, work, scene_file, fake, setting):
    assert call("run", "small.json", "--out", "r", *QUIET)[0] == 0
    code, _, err = call("resume", "r", "--set", setting, *QUIET)
    assert code == 2 and "finished" in err and "a later end than 20 us" in err and (work / "r/summary.json").exists()


def test_a_run_that_stops_itself(call, work, fake, scene_file):
    fake.stop_at = 23
    code, out, err = call("run", "small.json", "--out", "r", *QUIET)
    assert code == 3
    assert err.startswith("taichi-sph: body 'plate', node 3") and err.count("\n") == 1
    assert "the state was saved in r/stopped" in out
    assert [p.name for p in (work / "r/stopped").iterdir()] == ["step_000000023.checkpoint"]
    assert sorted(p.name for p in (work / "r/checkpoints").iterdir())[-1] == "step_000000020.checkpoint"
    assert not (work / "r/summary.json").exists()


def test_checkpoints_can_be_left_out(call, work, fake, scene_file):
    assert call("run", "small.json", "--set", "output.checkpoints=0", "--out", "r", *QUIET)[0] == 0
    assert not (work / "r/checkpoints").exists()


def test_validate_writes_nothing(call, work, fake, scene_file):
    before = files(work)
    code, out, err = call("validate", "small.json")
    assert (code, err) == (0, "") and files(work) == before and fake.asked == []
    for word in ("231 nodes", "200 stress points", "mass", "analytic", "dt", "steps", "memory", "disk", "valid"):
        assert word in out


def test_a_record_can_be_run_again(call, work, fake, scene_file):
    assert call("run", "small.json", "--set", "numerics.spacing=1mm", "--out", "one", *QUIET)[0] == 0
    assert call("run", "one/scene.json", "--out", "two", *QUIET)[0] == 0
    assert (work / "one/scene.json").read_text() == (work / "two/scene.json").read_text()
    assert [a["scene"].numerics.spacing for a in fake.asked] == [1e-3, 1e-3]


def test_arch_and_threads_arrive(call, fake, scene_file):
    assert call("run", "small.json", "--threads", "1", *QUIET)[0] == 0
    assert (fake.asked[0]["arch"], fake.asked[0]["threads"]) == ("cpu", 1)


def test_a_scene_that_needs_more_memory_than_there_is(call, work, fake, scene_file, monkeypatch):
    monkeypatch.setattr("taichi_sph.output.files.memory", lambda: 1000)
    code, _, err = call("run", "small.json")
    assert code == 2 and "of memory; this machine has 1 kB" in err


def test_a_full_disk(call, work, fake, scene_file, monkeypatch):
    monkeypatch.setattr("shutil.disk_usage", lambda _: type("Usage", (), {"free": 1000}))
    code, _, err = call("run", "small.json")
    assert code == 2 and "the disk has 1 kB free" in err and not (work / "runs").exists()


def test_every():
    e = Every(4, 1.0)
    assert [t for t in np.linspace(0, 1, 101) if e.due(t)] == pytest.approx([0, 0.25, 0.5, 0.75, 1])
    e = Every(100, 1.0)
    assert [t for t in (0, 0.5, 1.0) if e.due(t)] == [0, 0.5, 1.0]
    e.skip(2.0)
    assert e.next_time == float("inf") and not Every(0, 1.0).due(1.0)


def test_the_first_steps_tell_nothing_about_the_rest(monkeypatch):
    """A minute for the first step, then a second for each hundredth: 90 s are left at 10 %."""
    now = [0.0]
    monkeypatch.setattr("taichi_sph.run.progress.time.monotonic", lambda: now[0])
    pace = Pace(1.0)
    now[0] = 60.0
    assert pace.left(1e-6) is None
    now[0] += 1.0
    assert pace.left(0.01) is None  # too early to say
    now[0] += 9.0
    assert pace.left(0.10) == pytest.approx(90.0, rel=1e-3)
    now[0] += 90.0
    assert pace.left(1.0) is None
    slow = Pace(1.0)
    slow.left(0.0)
    now[0] += 30.0
    assert slow.left(0.001) == pytest.approx(30 * 999)


def test_validate_tells_the_values_that_will_be_run_and_no_others(call, work, fake):
    (work / "some.py").write_text(
        "from taichi_sph.scene import load\n\n\ndef scene(quality='draft', width: float = 20.0, kind: str = 'plain'):\n"
        "    return load('small.json').model_copy(update={'name': 'some'})\n"
    )
    (work / "small.json").write_text(json.dumps(GOOD))
    code, out, err = call("validate", "some.py", "--set", "width=7")
    assert (code, err) == (0, "") and "width = 7, kind = plain" in out.splitlines()[0]
    assert "--set takes width, kind, any key such as numerics.spacing" in out and "20" not in out.partition("takes")[2]


@pytest.mark.parametrize(
    "options, said",
    [
        ({"history": "energie", "column": "kinetic"}, "this run writes no history 'energie'; did you mean 'energies'"),
        ({"history": "energies", "column": "kinetik"}, "the history 'energies' has no column 'kinetik'; did you mean 'kinetic'"),
    ],
)
def test_what_a_quantity_reads_is_known_before_the_first_step(call, work, fake, scene_file, options, said):
    scene = json.loads((work / "small.json").read_text())
    scene["quantities"] = [{"name": "history_mean", "options": options}]
    (work / "small.json").write_text(json.dumps(scene))
    code, _, err = call("run", "small.json", "--out", "r", *QUIET)
    assert code == 2 and said in err and err.count("\n") == 1 and not (work / "r/record.json").exists()
