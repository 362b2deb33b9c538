"""Each number of each shipped scene in turn made nothing, negative, no number, far too small and far too large: `validate` answers
within two seconds of the processor and 200 MB, by a plan or by one sentence.

A sample each time, all of them with `pytest -m long`.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from taichi_sph.run.plan import LARGE
from taichi_sph.scene import Study, dump, load

from .examples import at_rest, everything, more
from .test_fuzz import ROOT, at, judged, places

EXTREMES: list[float | int] = [0, -1, float("nan"), 1e-300, 1e-30, 1e-6, 1e6, 1e30, 1e300, 10**399]  # the last has 400 digits
TANK = {"numerics.spacing": 0.03, "fluids.0.spacing": 0.04}
COARSE = {
    "tank_leak": TANK,
    "tank_leak_rate": TANK,
    "two_tanks": {"numerics.spacing": 0.03, "fluids.0.spacing": 0.04, "fluids.1.spacing": 0.04},
}
SECONDS, BYTES = 2.0, 200e6
FEW, PARTS = 150, 16


def bases() -> dict[str, dict[str, Any]]:
    """The shipped scenes, tanks with fewer nodes, of a study its first case, and what those lack."""
    found: dict[str, dict[str, Any]] = {}
    for path in sorted((ROOT / "scenes").glob("[!_]*.py")):
        scene = load(path, {"quality": "draft"} | COARSE.get(path.stem, {}))
        found[path.stem] = json.loads(dump(next(iter(scene.cases.values())) if isinstance(scene, Study) else scene))
    return found | {scene["name"]: scene for scene in (everything(), more(), at_rest("newton"), at_rest("arc"))}


def cases() -> list[tuple[str, tuple[Any, ...], float | int]]:
    """(scene, place, number) of all, of long lists of three entries."""
    found = []
    for name, data in bases().items():
        for path in places(data):
            if isinstance(at(data, path), int | float) and not isinstance(at(data, path), bool) and not _among_many(data, path):
                found += [(name, path, number) for number in EXTREMES]
    return found


def _among_many(data: dict[str, Any], path: tuple[Any, ...]) -> bool:
    """Whether a place is in a long list, and neither in its first, its middle nor its last entry: those stand for hundreds of pinballs."""
    lists = [(at(data, path[:k]), key) for k, key in enumerate(path) if isinstance(key, int)]
    return any(len(one) > 12 and key not in (0, len(one) // 2, len(one) - 1) for one, key in lists)


def kilobytes(key: str) -> int:
    """VmRSS or VmHWM, its peak, of this process."""
    return next(int(line.split()[1]) for line in Path("/proc/self/status").read_text().splitlines() if line.startswith(key))


def main(folder: Path, first: int, step: int) -> None:
    """Counts outcomes of each step-th case, of FEW where step is 0; run in a process of its own, whose memory is only its own."""
    warnings.simplefilter("error", RuntimeWarning)  # they would be more lines on the screen
    known, path, outcomes = bases(), folder / "case.json", Counter[str]()
    chosen = cases()
    chosen = chosen[first :: step or len(chosen) // FEW]
    least, slowest, most = kilobytes("VmRSS"), 0.0, 0
    for name, place, number in chosen:
        data = known[name]
        before, owner = at(data, place), at(data, place[:-1])
        owner[place[-1]] = number
        path.write_text(json.dumps(data), encoding="utf-8")
        owner[place[-1]] = before
        Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
        began = time.process_time()
        outcome = judged(path, LARGE)
        took, grown = time.process_time() - began, kilobytes("VmHWM") - least
        if took > SECONDS:
            outcome = f"late: {took:.1f} s for a {outcome}"
        if grown * 1024 > BYTES:
            outcome = f"large: {grown / 1024:.0f} MB for a {outcome}"
        slowest, most = max(slowest, took), max(most, grown)
        if outcome not in ("valid", "sentence"):
            print(f"{name}.{'.'.join(map(str, place))} = {str(number)[:20]}: {outcome}", flush=True)
        outcomes[outcome.partition(":")[0]] += 1
    print(json.dumps({"outcomes": outcomes, "cases": len(chosen), "slowest": slowest, "megabytes": most / 1024}))


def check(folder: Path, first: int, step: int) -> None:
    done = subprocess.run(
        [sys.executable, "-c", "import sys\nfrom pathlib import Path\nfrom tests.scene.test_numbers import main\n"
         "main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))", str(folder), str(first), str(step)],
        capture_output=True, text=True, timeout=3000, cwd=ROOT,
    )  # fmt: skip
    assert done.returncode == 0, f"ended with {done.returncode}: {done.stdout[-3000:]} {done.stderr[-3000:]}"
    found = json.loads(done.stdout.strip().splitlines()[-1])
    print(found)
    assert set(found["outcomes"]) == {"sentence", "valid"}, done.stdout[-5000:]
    assert sum(found["outcomes"].values()) == found["cases"] and found["outcomes"]["sentence"] > found["cases"] / 4


linux = pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="Linux counts the memory")


@linux
def test_some_extreme_numbers(tmp_path: Path) -> None:
    check(tmp_path, 7, 0)


@linux
@pytest.mark.long
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("part", range(PARTS))
def test_every_number_made_extreme(part: int, tmp_path: Path) -> None:
    check(tmp_path, part, PARTS)
