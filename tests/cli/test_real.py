"""The program as a user starts it, with the real physics on a small plate, in processes of their own."""

from __future__ import annotations

import json
import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from taichi_sph.output import checkpoint
from taichi_sph.output.histories import read_history
from taichi_sph.run.plan import plan
from taichi_sph.scene.script import load_scene

from ..scene.examples import spoiled

ROOT = Path(__file__).parents[2]
PROGRAM = [sys.executable, "-m", "taichi_sph"]


@pytest.fixture
def scene(work):
    """2 mm, about 4000 steps: some seconds, and cracks on the way."""
    data = spoiled("duration", "1 ms")
    data["forces"][0]["total"] = [0, 200, 0]
    data["output"] = {"frames": 10, "samples": 40, "checkpoints": 4}
    path = work / "small.json"
    path.write_text(json.dumps(data))
    return path


def program(*arguments: str, **options) -> subprocess.CompletedProcess:
    return subprocess.run([*PROGRAM, *arguments], capture_output=True, text=True, timeout=200, **options)


def final(folder: Path) -> tuple[str, str, dict[str, np.ndarray]]:
    record = json.loads((folder / "record.json").read_text())
    return (
        record["result_hash"],
        (folder / "histories/energies.csv").read_text(),
        checkpoint.load(checkpoint.latest(folder / "checkpoints")).state,
    )


def test_killed_by_sigterm_and_resumed_is_the_same_run_at_one_and_two_threads(scene, work):
    whole = program("run", "small.json", "--out", "whole", "--no-pictures", "--threads", "2")
    assert whole.returncode == 0, whole.stderr
    process = subprocess.Popen(
        [*PROGRAM, "run", "small.json", "--out", "parts", "--no-pictures", "--threads", "1"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    rows = work / "parts/histories/progress.csv"
    deadline = time.monotonic() + 100
    while time.monotonic() < deadline and process.poll() is None:
        if rows.exists() and rows.read_text().count("\n") > 6:
            break
        time.sleep(0.005)
    process.send_signal(signal.SIGTERM)
    _, err = process.communicate(timeout=100)
    assert process.returncode == 130, err
    assert "SIGTERM" in err and err.count("\n") == 1
    resumed = program("resume", "parts", "--no-pictures", "--threads", "1")
    assert resumed.returncode == 0, resumed.stderr
    one, two = final(work / "whole"), final(work / "parts")
    assert one[1] == two[1]
    assert one[0] == two[0]
    assert set(one[2]) == set(two[2]) and all(np.array_equal(one[2][k], two[2][k], equal_nan=True) for k in one[2])


def test_a_scene_script_by_itself(work):
    arguments = ["--quality", "draft", "--set", "a=8", "--set", "duration=4us", "--set", "output.frames=2", "--out", "o"]
    done = subprocess.run(
        [sys.executable, str(ROOT / "scenes/crack_branching.py"), *arguments], capture_output=True, text=True, timeout=200
    )
    assert done.returncode == 0, done.stderr
    scene = json.loads((work / "o/scene.json").read_text())
    assert scene["parameters"]["a"] == 8 and scene["duration"] == 4e-6
    assert "Cracked: no" in done.stdout
    pictures = [line.split(": ")[1] for line in done.stdout.splitlines() if line.startswith("picture: ")]
    assert pictures and all(Path(p).stat().st_size > 1000 for p in pictures)


def test_the_command_in_the_record_runs_the_same_again(work):
    (work / "scenes").symlink_to(ROOT / "scenes")
    settings = ["--set", "a=9", "--set", "duration=2us", "--set", "numerics.spacing=2mm"]
    assert program("run", "crack_branching", *settings, "--out", "one", "--no-pictures").returncode == 0
    command = json.loads((work / "one/record.json").read_text())["command"]
    assert command.startswith("taichi-sph run crack_branching ")
    assert program(*shlex.split(command)[1:], "--out", "two", "--no-pictures").returncode == 0
    hashes = [json.loads((work / d / "record.json").read_text())["result_hash"] for d in ("one", "two")]
    assert hashes[0] == hashes[1]


def test_doctor(work):
    done = program("doctor", env={**os.environ})
    assert done.returncode == 0, done.stdout
    for word in ("Python", "packages", "Taichi on cpu", "threads", "pictures", "cache", "disk", "all is well"):
        assert word in done.stdout


def test_doctor_names_a_mend(work):
    done = program("doctor", "--arch", "cuda")
    if done.returncode:
        assert "BAD  Taichi on cuda" in done.stdout and "mend: install the driver of the device" in done.stdout


def test_what_moves_at_the_start_has_its_energy_in_the_first_row(work):
    """A plate that flies as a whole: m v^2 / 2 from the first row on."""
    data = spoiled("duration", "4 us")
    data |= {"forces": [], "motions": [], "initial": [{"body": "plate", "velocity": [0, 10, 0]}]}
    data["output"] = {"frames": 1, "samples": 4, "checkpoints": 1}
    (work / "small.json").write_text(json.dumps(data))
    done = program("run", "small.json", "--out", "whole", "--no-pictures")
    assert done.returncode == 0, done.stderr
    found = read_history(work / "whole/histories/energies.csv")
    energy = 0.5 * plan(load_scene(work / "small.json")).bodies[0].mass * 10**2
    assert len(found) == 5 and found["kinetic"] == pytest.approx(energy) and found["injected"] == pytest.approx(energy)
    assert found["B_percent"][0] == 0.0
    told = done.stdout.split("estimated")[1].splitlines()[0]
    assert "stepping" in told and "compiling" in told and "pictures" not in told
