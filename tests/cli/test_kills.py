"""Real runs killed (SIGKILL) at random moments and resumed: what comes out is what an undisturbed run gives, bit for bit.

Each kind of scene is killed TAICHI_SPH_KILLS times, ten by default, in one run or, where that ends too soon, in a
second: once in its first samples, then at random rows of the history of progress, so that the moments do not depend on the machine. A
third of the kills come while a process starts, as it reads the checkpoint, builds, and drops what lies behind. Each kill costs one start.
The moments follow from the kind and the number of kills.

The second test takes what a kill leaves from one run: it copies the folder while the process is stopped (SIGSTOP), which is what a SIGKILL
at that moment would leave, and all copies are gone on with in one process.
"""

from __future__ import annotations

import json
import math
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from taichi_sph.output.folder import RunFolder

from ..scene.examples import everything, more

ROOT = Path(__file__).parents[2]
KILLS = int(os.environ.get("TAICHI_SPH_KILLS", "10"))
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
    "grows": ("empty_tank", ["coupled=true", "grows=true", "duration=100us"]),  # a patch that grows
    "stirred": ("fuel_over_water", ["heavy=above", "duration=600ms"]),  # fluids that mix in their pool
    "explosive": ("exploding_cylinder", ["over_radius=6", "duration=20us"]),
    "newton": ("slit_ring", []),
    "arc": ("hinged_roof", []),
}
WHOLE = {"water", "stirred", "everything", "more", "newton", "arc"}  # nothing is damaged there


def start(arguments: list[str]) -> subprocess.Popen[str]:
    program = [sys.executable, "-m", "taichi_sph", *arguments, "--no-pictures", "--threads", "2"]
    return subprocess.Popen(
        program, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env=os.environ | {"PYTHONPATH": str(ROOT)}
    )


def rows_of(folder: Path) -> int:
    """Lines of the history of progress that stand in its file."""
    path = folder / "histories/progress.csv"
    return path.read_bytes().count(b"\n") if path.exists() else 0


def wait_for_rows(folder: Path, more: int, process: subprocess.Popen[str]) -> None:
    """Until more rows than that stand there, or the process has ended."""
    while rows_of(folder) <= more and process.poll() is None:
        time.sleep(0.0005)


def wait_until_built(folder: Path, began: float, process: subprocess.Popen[str]) -> None:
    """Until the log says that a process that began then computes, or the process has ended."""
    log = folder / "log.txt"
    ends = len(log.read_bytes()) if log.exists() and any((folder / "checkpoints").glob("*.checkpoint")) else 0
    while process.poll() is None and not (log.exists() and log.stat().st_mtime > began and b"built in" in log.read_bytes()[ends:]):
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
    copies = []
    rests = kind in ("newton", "arc")  # fewer samples, and longer ones
    for number, row in enumerate(sorted(moment.choices(range(10 if rests else 55), k=KILLS))):  # so many samples are written
        wait_for_rows(work / "whole", row, process)
        time.sleep((0.3 if rests else 0.03) * moment.random() ** 2)
        process.send_signal(signal.SIGSTOP)
        if process.poll() is None and not (work / "whole/summary.json").exists():
            copies.append(shutil.copytree(work / "whole", work / f"parts{number}"))
        process.send_signal(signal.SIGCONT)
    assert process.wait() == 0, process.stderr and process.stderr.read()
    whole = results(work / "whole")
    assert any(np.frombuffer(v[2], v[0]).any() for k, v in whole.items() if " c damage" in k) or kind in WHOLE
    assert len(copies) >= KILLS // 2  # some moments come after the end
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
    assert process.wait() == 0, process.stderr and process.stderr.read()
    whole, samples, folder = results(work / "whole"), rows_of(work / "whole"), work / "parts"
    assert any(np.frombuffer(v[2], v[0]).any() for k, v in whole.items() if " c damage" in k) or kind in WHOLE
    seconds = json.loads((work / "whole/summary.json").read_text(encoding="utf-8"))["seconds"]["advance"] / samples  # of a row

    moment, starts, kills = random.Random(f"{kind} {KILLS}"), list[float](), Counter[str]()
    for number in range(5):
        folder = work / f"parts{number}"
        rows = [0, *sorted(moment.choices(range(1, samples - 2), k=KILLS - kills.total() - 1))]
        for row in [*rows, math.inf]:
            there = any((folder / "checkpoints").glob("*.checkpoint"))
            began, when = time.time(), "computing"
            process = start(["resume", folder.name] if there else [*run, "--out", folder.name])
            if row < math.inf:
                if starts and moment.random() < 1 / 3:
                    when = "starting"
                    time.sleep(moment.uniform(0.5, 1.1) * min(starts))
                else:
                    wait_until_built(folder, began, process)
                    starts.append(time.time() - began)
                    wait_for_rows(folder, row, process)
                    time.sleep(moment.random() * seconds)
                process.kill()
            code, error = process.wait(), process.stderr.read() if process.stderr else ""
            if code == 0 or (folder / "summary.json").exists():  # it had just ended
                break
            assert code == -signal.SIGKILL and error == "", f"exit {code}: {error}"
            kills[when + ("" if any((folder / "checkpoints").glob("*.checkpoint")) else ", no checkpoint yet")] += 1
        found = results(folder)
        different = [key for key in whole.keys() | found.keys() if whole.get(key) != found.get(key)]
        assert not different, f"after {dict(kills)}: {sorted(different)}"
        if kills.total() >= KILLS:
            break
    print(f"{kind}: {kills.total()} kills of {number + 1} runs, {dict(kills)}, and the same; a start took {min(starts):.1f} s", flush=True)
    assert kills.total() >= KILLS
