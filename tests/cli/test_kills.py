"""Real runs killed (SIGKILL) at random moments and resumed: what comes out is what an undisturbed run gives, bit for bit.

TAICHI_SPH_KILLS runs of each kind of scene, three by default; "6-9" are the runs of those numbers, so that many can be done in pieces. The
moments follow from the kind and the number of the run. Most of the time goes into starting processes, so the second test, of four times as
many moments, takes what a kill leaves from one run: it copies the folder while the process is stopped (SIGSTOP), which is what a SIGKILL
at that moment would leave, and all copies are gone on with in one process.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from taichi_sph.output.folder import RunFolder

from ..scene.examples import everything, more

ROOT = Path(__file__).parents[2]
FIRST, _, LAST = os.environ.get("TAICHI_SPH_KILLS", "3").rpartition("-")
KILLS = range(int(FIRST or 0), int(LAST))
OUTPUT = ["output.frames=8", "output.samples=60", "output.checkpoints=25"]
SCENES: dict[str, tuple[Any, list[str]]] = {
    "brittle": ("crack_branching", ["numerics.spacing=1.5mm"]),
    "single": ("crack_branching", ["numerics.spacing=1.5mm", "numerics.precision=f32"]),
    "striker": ("plate_perforation", ["duration=150us"]),
    "water": ("dam_break", ["duration=100ms"]),
    "tank": ("tank_leak", ["numerics.spacing=16mm", "fluids.0.spacing=24mm", "duration=1.2ms"]),
    "bodies": ("two_tanks", ["duration=600us"]),  # two shells, two fluids, two strikers
    "everything": (everything, []),  # elements, holes, springs, a driven body, steps of bodies' own
    "more": (more, []),  # a patch, a solid, welds, sections, gas, a rigid surface
    "newton": ("slit_ring", []),
    "arc": ("hinged_roof", []),
}
WHOLE = {"water", "everything", "more", "newton", "arc"}  # nothing is damaged there


def start(arguments: list[str]) -> subprocess.Popen[str]:
    program = [sys.executable, "-m", "taichi_sph", *arguments, "--no-pictures", "--threads", "2"]
    return subprocess.Popen(
        program, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env=os.environ | {"PYTHONPATH": str(ROOT)}
    )


def size(path: Path) -> int:
    return path.stat().st_size if path.exists() else -1


def wait_for(path: Path, longer: int, process: subprocess.Popen[str]) -> None:
    """Until a file is longer: the first that is written once all is compiled."""
    while size(path) <= longer and process.poll() is None:
        time.sleep(0.002)


def wait_for_checkpoint(folder: Path, process: subprocess.Popen[str]) -> None:
    while process.poll() is None and not any((folder / "checkpoints").glob("*.checkpoint")):
        time.sleep(0.002)


def results(folder: Path) -> dict[str, Any]:
    """All that must be the same."""
    found: dict[str, Any] = {}
    with RunFolder(folder) as run:
        for name in run.bodies():
            file = run.frames(name)
            found[f"times of {name}"] = file.times.tobytes() + file.steps.tobytes()
            for index, body in enumerate(file):
                for kind, arrays in (("points", {"": body.points}), ("p", body.point_data), ("c", body.cell_data)):
                    found |= {f"{name} {index} {kind} {k}": (a.dtype.str, a.shape, a.tobytes()) for k, a in arrays.items()}
        found |= {f"history {name}": (folder / "histories" / f"{name}.csv").read_bytes() for name in run.histories()}
        found["state"] = run.record["result_hash"]
        told = (
            "scene",
            "title",
            "quality",
            "settings",
            "nodes",
            "stress_points",
            "steps",
            "B_percent",
            "closed_residual_percent",
            "quantities",
        )
        found |= {key: json.dumps(run.summary[key]) for key in told}
    return found


def command_of(kind: str, work: Path) -> list[str]:
    scene, settings = SCENES[kind]
    if isinstance(scene, str):
        run = ["run", str(ROOT / "scenes" / f"{scene}.py"), "--quality", "draft"]
    else:
        (work / "scene.json").write_text(json.dumps(scene()), encoding="utf-8")
        run = ["run", "scene.json"]
    return run + [word for pair in (*settings, *OUTPUT) for word in ("--set", pair)]


GO_ON = """
import sys
from pathlib import Path
from taichi_sph.run import session
from taichi_sph.run.progress import Progress
from taichi_sph.scene import load_scene
from taichi_sph.world.world import World
world = None
def built(scene, **how):  # once: whatever it did before, what is restored is all of its state
    global world, first
    if world is None:
        world = World(scene, **how)
        first = world.state()
    world.restore(first)
    return world
for folder in map(Path, sys.argv[1:]):
    there = any((folder / "checkpoints").glob("*.checkpoint"))
    how = {"threads": 2, "pictures": False, "simulation": built, "progress": Progress(terse=True)}
    session.resume(folder, **how) if there else session.run(load_scene(folder / "scene.json"), folder, **how)
    print("resumed" if there else "begun anew", folder, flush=True)
"""


@pytest.mark.long
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("kind", SCENES)
def test_what_a_kill_leaves_goes_on_as_the_same_run(kind: str, work: Path) -> None:
    moment = random.Random(f"{kind} {KILLS}")
    process = start([*command_of(kind, work), "--out", "whole"])
    rows = work / "whole/histories/progress.csv"
    copies = []
    rests = kind in ("newton", "arc")  # fewer samples, and longer ones
    for number, row in enumerate(sorted(moment.choices(range(10 if rests else 55), k=4 * len(KILLS)))):  # so many samples are written
        while process.poll() is None and (not rows.exists() or rows.read_bytes().count(b"\n") <= row):
            time.sleep(0.0005)
        time.sleep((0.3 if rests else 0.03) * moment.random() ** 2)
        process.send_signal(signal.SIGSTOP)
        if process.poll() is None and not (work / "whole/summary.json").exists():
            copies.append(shutil.copytree(work / "whole", work / f"parts{number}"))
        process.send_signal(signal.SIGCONT)
    assert process.wait() == 0, process.stderr and process.stderr.read()
    whole = results(work / "whole")
    assert any(np.frombuffer(v[2], v[0]).any() for k, v in whole.items() if " c damage" in k) or kind in WHOLE
    assert len(copies) >= 2 * len(KILLS)  # some moments come after the end
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", GO_ON, *map(str, copies)], capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    for folder in copies:
        found = results(folder)
        different = [key for key in whole.keys() | found.keys() if whole.get(key) != found.get(key)]
        assert not different, f"{folder.name}: {sorted(different)}"
    print(f"{kind}: {len(copies)} copies, {done.stdout.count('begun anew')} of them without a checkpoint, all the same")


@pytest.mark.long
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("kind", SCENES)
def test_kill_and_resume_is_the_same_run(kind: str, work: Path) -> None:
    run = command_of(kind, work)
    process = start([*run, "--out", "whole"])
    wait_for(work / "whole/log.txt", -1, process)
    began = time.monotonic()
    wait_for_checkpoint(work / "whole", process)
    first = time.monotonic()
    assert process.wait() == 0, process.stderr and process.stderr.read()
    lasts = [time.monotonic() - began, time.monotonic() - first]  # s, all of it, and from the first checkpoint on
    whole = results(work / "whole")
    assert any(np.frombuffer(v[2], v[0]).any() for k, v in whole.items() if " c damage" in k) or kind in WHOLE

    begun_anew = 0
    for number in KILLS:
        late = number % 3 > 0  # two of three after the first checkpoint: the first steps take their time
        for trial in range(5):  # a run may end before its moment comes
            folder, kills, anew = work / f"parts{number}_{trial}", 0, 0
            command, moment = [*run, "--out", folder.name], random.Random(f"{kind} {number} {trial}")
            for _ in range(20):
                before = size(folder / "log.txt")
                process = start(command)
                wait_for(folder / "log.txt", before if command[0] == "resume" else -1, process)
                began = time.monotonic()
                if kills < 1 + number % 2:  # every second run is killed twice
                    if late:
                        wait_for_checkpoint(folder, process)
                        began = time.monotonic()
                    time.sleep(lasts[late] * (moment.uniform(0, 0.95) if kills == 0 else 0.5 * moment.random() ** 2))
                    process.kill()
                code, error = process.wait(), process.stderr.read() if process.stderr else ""
                if code == 0 or (folder / "summary.json").exists():  # it had just ended
                    if not kills:  # the undisturbed run may have compiled, or had less of the machine
                        lasts[late] = min(lasts[late], time.monotonic() - began)
                    break
                assert code == -9 and error == "", f"exit {code}: {error}"
                kills += 1
                there = any((folder / "checkpoints").glob("*.checkpoint"))
                anew += not there
                command = ["resume", folder.name] if there else [*run, "--out", folder.name]
            if kills:
                break
        assert kills, f"run {number} was never killed"
        begun_anew += anew
        found = results(folder)
        different = [key for key in whole.keys() | found.keys() if whole.get(key) != found.get(key)]
        assert not different, f"{folder.name}, killed {kills} times: {sorted(different)}"
        shutil.rmtree(folder)
        print(f"{kind} {number}: killed {kills} times, {anew} of them before the first checkpoint, and the same", flush=True)
    print(f"{kind}: {len(KILLS)} runs killed, {begun_anew} kills before the first checkpoint; {lasts[0]:.1f} s undisturbed")
