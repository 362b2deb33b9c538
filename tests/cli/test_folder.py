"""The folder of a run as the program treats it: one process at a time, nothing through links, nothing lost by a kill."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from taichi_sph.output.lock import LOCK_FILE, locked

from ..scene.examples import GOOD
from .conftest import files

QUIET = ("--no-pictures",)
STUDY = {"name": "few", "title": "Few", "source": "tests", "cases": {"one": GOOD | {"name": "one"}, "two": GOOD | {"name": "two"}}}


@pytest.fixture
def stopped(call, work, fake, scene_file) -> Path:
    """A run that was interrupted at step 30 of 40."""
    fake.on_step = lambda sim: sim.step == 30 and signal.raise_signal(signal.SIGINT)
    assert call("run", "small.json", "--out", "r", *QUIET)[0] == 130
    fake.on_step = None
    return work / "r"


def test_a_run_and_another_in_one_folder(call, work, fake, scene_file):
    """What comes second gets one sentence and writes nothing, whatever it is; what only reads is not kept out."""
    second = {}

    def others(sim):
        if sim.step == 21 and not second:
            before = files(work / "r")
            for arguments in (
                ["run", "small.json", "--out", "r", "--overwrite"],
                ["resume", "r"],
                ["validate", "small.json", "--out", "r"],
            ):
                second[arguments[0]] = call(*arguments)
            assert files(work / "r") == before

    fake.on_step = others
    assert call("run", "small.json", "--out", "r", *QUIET)[0] == 0
    for command in ("run", "resume"):
        code, _, err = second[command]
        assert code == 2 and err.count("\n") == 1
        assert f"'r' is in use by process {os.getpid()} on " in err and "wait for its end, or give another folder with --out" in err
    assert second["validate"][0] == 0
    assert not (work / "r" / LOCK_FILE).exists()


def test_a_killed_run_leaves_its_folder_open(call, work, fake, scene_file):
    script = (
        "import os, sys, types\nfrom tests.cli.fake import FakeWorld\n"
        "module = types.ModuleType('taichi_sph.world.world')\nmodule.World = FakeWorld\nsys.modules[module.__name__] = module\n"
        "FakeWorld.on_step = staticmethod(lambda sim: sim.step == 33 and os.kill(os.getpid(), 9))\n"
        "from taichi_sph import cli\ncli.main(arguments=['run', 'small.json', '--out', 'r', '--no-pictures'])\n"
    )
    killed = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join((str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")))},
    )
    assert killed.returncode == -signal.SIGKILL, killed.stderr
    assert (work / "r" / LOCK_FILE).exists()
    code, out, err = call("resume", "r", *QUIET)
    assert (code, err) == (0, "") and "'r' was left locked by process" in out and "which is gone; going on" in out
    assert call("run", "small.json", "--out", "whole", *QUIET)[0] == 0
    hashes = {json.loads((work / d / "record.json").read_text())["result_hash"] for d in ("r", "whole")}
    assert len(hashes) == 1


def test_a_study_and_another_in_one_folder(call, work, fake):
    (work / "few.json").write_text(json.dumps(STUDY))
    second = []

    def others(sim):
        if sim.step == 5 and not second:
            second.append(call("run", "few.json", "--out", "s"))

    fake.on_step = others
    assert call("run", "few.json", "--out", "s", *QUIET)[0] == 0
    assert second[0][0] == 2 and "'s' is in use by process" in second[0][2]


def test_a_sweep_in_a_folder_in_use(call, work, fake, scene_file):
    with locked(work / "w"):
        code, _, err = call("sweep", "small.json", "--vary", "duration=1us,2us", "--out", "w")
    assert code == 2 and "'w' is in use by process" in err


@pytest.mark.parametrize(
    "name", ["checkpoints", "frames", "histories", "frames/plate.vtkhdf", "histories/energies.csv", "scene.json", "log.txt"]
)
@pytest.mark.parametrize("command", [["resume"], ["run", "small.json", "--overwrite", "--out"], ["render"], ["compare"]])
def test_symbolic_links_are_refused(call, work, stopped, name, command):
    """A link to the very thing that was there: still the folder does not hold it."""
    outside = work / "outside"
    (stopped / name).rename(outside)
    (stopped / name).symlink_to(outside)
    before = files(work)
    code, out, err = call(*command, "r")
    assert code == 2 and err.count("\n") == 1 and f"r/{name}' is a symbolic link" in err
    assert files(work) == before


def test_the_folder_itself_may_be_a_link(call, work, stopped):
    (work / "mine").symlink_to(stopped)
    assert call("resume", "mine", *QUIET)[0] == 0


@pytest.mark.parametrize(
    "name", ["summary.json", "record.json", "pictures", "histories/probe_tip.csv", "frames/plate.vtkhdf.tmp", "stopped"]
)
def test_links_that_wait_to_be_written_through(call, work, stopped, name):
    precious = work / "precious"
    precious.write_text("mine")
    (stopped / name).symlink_to(precious)
    for command in (["resume", "r", *QUIET], ["run", "small.json", "--overwrite", "--out", "r", *QUIET]):
        code, _, err = call(*command)
        assert code == 2 and "symbolic link" in err
    assert precious.read_text() == "mine"


def test_cases_of_a_study_that_are_links(call, work, fake):
    (work / "few.json").write_text(json.dumps(STUDY))
    assert call("run", "few.json", "--out", "s", *QUIET)[0] == 0
    (work / "s/two").rename(work / "elsewhere")
    (work / "s/two").symlink_to(work / "elsewhere")
    for command in (["resume", "s"], ["run", "few.json", "--overwrite", "--out", "s"], ["render", "s"]):
        code, _, err = call(*command)
        assert code == 2 and "s/two' is a symbolic link" in err


@pytest.mark.parametrize("name", ["r/evil.py", "r/evil", "../evil", "evil.py"])
def test_a_recorded_name_is_no_path_to_a_program(call, work, fake, scene_file, name):
    """Of a summary from a stranger no script is run but one of the folder's own scenes."""
    assert call("run", "small.json", "--out", "r", *QUIET)[0] == 0
    for place in ("r/evil.py", "evil.py", "../evil.py"):
        (work / place).write_text("raise SystemExit(7)")
    summary = json.loads((work / "r/summary.json").read_text())
    (work / "r/summary.json").write_text(json.dumps(summary | {"scene": name}))
    code, _, err = call("results", "r")
    assert code == 0 and f"there is no scene '{name}'" in err and "ended the program" not in err


def test_what_a_kill_at_the_very_start_leaves_is_no_hindrance(call, work, fake, scene_file):
    (work / "r").mkdir()
    (work / "r/scene.json.tmp").write_text("{")
    (work / "r" / LOCK_FILE).write_text("")
    assert call("run", "small.json", "--out", "r", *QUIET)[0] == 0
    (work / "q/checkpoints").mkdir(parents=True)
    (work / "q/scene.json").write_text((work / "r/scene.json").read_text())
    (work / "q/checkpoints/step_000000020.checkpoint.tmp").write_text("half")
    assert call("run", "small.json", "--out", "q", *QUIET)[0] == 0
