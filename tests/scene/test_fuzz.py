"""Scenes spoiled at random: each is valid or refused in one sentence, soon, and never by a traceback.

The shipped scenes as JSON, with values, types, keys, sizes and depths changed. Some hundred cases each time, 10 000 with `pytest -m long`.
A case is made from its number, so that one can be made again.
"""

from __future__ import annotations

import json
import math
import random
import resource
import signal
import subprocess
import sys
import time
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from taichi_sph.errors import SceneError
from taichi_sph.run import counts
from taichi_sph.run.progress import Progress
from taichi_sph.run.session import checked_plan, tell_plan
from taichi_sph.scene import Study, dump, load

from .examples import at_rest, everything, more

ROOT = Path(__file__).parents[2]
FEW, MANY = 150, 10_000
SECONDS = 20  # of processor time for one case: far above two, as some valid scenes are large
BYTES = 4_000_000_000  # of address space: what asks for more fails
LEFT_OUT = {"critical_step", "beam_convergence", "perforation_dependence"}  # studies of many large scenes: seconds each

NUMBERS: list[Any] = [
    0, 1, -1, 2,
    1e-300, 1e-308, 5e-324, 1e300, 1e308, -1e300, 1e200, 1e-12, 1e12, 0.5, -0.9999999999, 0.4999999999, 10**18, 10**400, 3e8, 7,
    float("nan"), float("inf"), -float("inf"), 1e-9, 1e9, 1e6, 2**31, 2**63, True, False, None,
]  # fmt: skip
TEXTS: list[Any] = [
    "", " ", "x", "1 mm", "1e400 m", "-1 mm", "5 kg", "nan", "inf m", "1 m m m", "m", "1e3", "line\nbreak", "a\tb", "\0", "ä", "\ud800",
    "😀",
    "a $\\frac{$ b", "x" * 10_000, "../../x", "/etc/passwd", "con", "galerkin", "free", "plate", "water", "1 mm" * 500, "0x10", "1_000",
    "٣ mm",
    "1 mm ** 1000000", "(" * 500, "mm/0", "1e-999999999 m", "9" * 5000 + " m",
]  # fmt: skip
OTHERS: list[Any] = [
    [],
    {},
    [[]],
    [1, 2, 3],
    [0, 0, 0],
    {"kind": "plate"},
    {"kind": "x"},
    {"kind": []},
    {"name": "x"},
    [None],
    [{}],
    [1e300] * 3,
]


def places(data: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """All keys and entries of a scene."""
    found = [path] if path else []
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        found += places(value, (*path, key))
    return found


def at(data: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        data = data[key]
    return data


def changed(data: dict[str, Any], chance: random.Random) -> dict[str, Any]:
    """One change."""
    path = chance.choice(places(data))
    owner, key = at(data, path[:-1]), path[-1]
    value = owner[key]
    kind = chance.randrange(14)
    if kind <= 3 and isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e300:
        owner[key] = value * 10.0 ** chance.choice([-300, -12, -6, -3, -2, -1, 1, 2, 3, 6, 12, 300]) * chance.choice([1, 1, 1, -1])
    elif kind == 4:
        owner[key] = chance.choice(TEXTS)
    elif kind == 5:
        owner[key] = chance.choice(OTHERS)
    elif kind == 6:
        del owner[key]
    elif kind == 7 and isinstance(owner, dict):
        owner[chance.choice([str(key) + "s", str(key)[:-1], str(key).upper(), "new\nkey", "", "\ud800", "k" * 5000, "__class__"])] = (
            owner.pop(key)
        )
    elif kind == 8 and isinstance(value, list) and value:
        owner[key] = value * chance.choice([2, 3, 100, 5000])
    elif kind == 9:
        owner[key] = json.loads(json.dumps(at(data, chance.choice(places(data)))))
    elif kind == 10 and isinstance(value, dict):
        value[chance.choice(["extra", "kind", "name", "spacing", "every"])] = chance.choice(NUMBERS + TEXTS)
    elif kind == 11:
        for _ in range(chance.choice([1, 5, 60, 200])):
            value = [value] if chance.random() < 0.5 else {"a": value}
        owner[key] = value
    else:
        owner[key] = chance.choice(NUMBERS)
    return data


def text_of(data: dict[str, Any], chance: random.Random) -> bytes:
    """As JSON, now and then damaged as a text."""
    text = json.dumps(data).encode()
    kind = chance.randrange(40)
    if kind == 0:
        return text[: chance.randrange(len(text))]
    if kind == 1:
        place = chance.randrange(len(text))
        return text[:place] + bytes([chance.randrange(256)]) + text[place + 1 :]
    if kind == 2:
        place = text.find(b":", chance.randrange(len(text))) + 1
        return text[:place] + chance.choice([b"[", b'{"a":']) * 200_000 + text[place:]
    return text


def bases() -> list[tuple[str, str]]:
    """The shipped scenes as JSON, and some with what those lack."""
    found = []
    for path in sorted((ROOT / "scenes").glob("*.py")):
        if path.stem not in LEFT_OUT and not path.stem.startswith("_"):
            found.append((path.stem, dump(load(path, {"quality": "draft"}))))
    others = [everything(), more(), at_rest("newton"), at_rest("arc")]  # a quarter of all cases
    return found + [(scene["name"], json.dumps(scene)) for scene in others for _ in range(3)]


def judged(path: Path, large: float = math.inf) -> str:
    """What becomes of a scene on disk, as `validate` would have it; large: as in `plan`."""
    try:
        found = load(path)
        scenes = list(found.cases.values())[:2] if isinstance(found, Study) else [found]
        for scene in scenes:
            p = checked_plan(scene, "cpu", large)
            tell_plan(scene, p, Progress(terse=True))
            numbers = [p.dt, float(p.steps), float(p.memory), float(p.disk), p.seconds]
            numbers += [x for body in p.bodies for x in (float(body.nodes), body.mass)]
            if not all(math.isfinite(x) and x >= 0 for x in numbers) or not all(math.isfinite(x) for x in (b.thickness for b in p.bodies)):
                return f"wrong: the plan has {numbers}"
        again = path.with_name("again.json")
        again.write_text(dump(found), encoding="utf-8")
        if load(again) != found:
            return "wrong: another scene after writing and reading"
        return "valid"
    except SceneError as error:
        said = str(error)
        if "\n" in said or not said.isprintable():
            return f"wrong: the sentence is not one line: {said[:200]!r}"
        return "sentence" if 10 < len(said) < 1500 else f"wrong: a sentence of {len(said)} letters: {said[:200]}"
    except Late:
        return "hang"
    except BaseException as error:
        import traceback

        where = traceback.extract_tb(error.__traceback__)
        own = [f for f in where if "taichi_sph" in f.filename] or list(where)
        return f"traceback: {type(error).__name__}: {str(error)[:150]} in {Path(own[-1].filename).name}:{own[-1].lineno}"


class Late(BaseException):
    """A case that takes too long."""


def late(*_: object) -> None:
    raise Late


def main(folder: Path, first: int, last: int) -> None:
    """Counts outcomes; run in a process of its own."""
    known = bases()
    if BYTES:
        resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES))
    counts.MAX_NODES = 300_000  # what is larger may be made, and takes its time
    signal.signal(signal.SIGPROF, late)
    warnings.simplefilter("error", RuntimeWarning)  # they would be more lines on the screen
    outcomes: Counter[str] = Counter()
    slow = 0.0
    for number in range(first, last):
        chance = random.Random(number)
        name, text = chance.choice(known)
        data = json.loads(text)
        for _ in range(chance.choice([1, 1, 1, 2, 4])):
            if not isinstance(data, dict) or not places(data):
                break
            data = changed(data, chance)
        path = folder / "case.json"
        path.write_bytes(text_of(data, chance))
        signal.setitimer(signal.ITIMER_PROF, SECONDS)
        began = time.process_time()
        outcome = judged(path)
        signal.setitimer(signal.ITIMER_PROF, 0)
        took = time.process_time() - began
        if outcome == "sentence":
            slow = max(slow, took)
        if took > 2 and outcome != "valid":
            print(f"case {number} ({name}): {outcome} after {took:.1f} s", flush=True)
        if outcome not in ("valid", "sentence"):
            print(f"case {number} ({name}): {outcome}", flush=True)
        outcomes[outcome.partition(":")[0]] += 1
    print(json.dumps(outcomes | {"slowest sentence": slow}))  # type: ignore[operator]


def check(folder: Path, cases: range) -> None:
    done = subprocess.run(
        [sys.executable, "-c", "from tests.scene.test_fuzz import main\nimport sys\nfrom pathlib import Path\n"
         f"main(Path(sys.argv[1]), {cases.start}, {cases.stop})", str(folder)],
        capture_output=True, text=True, timeout=200 + 2 * len(cases), cwd=ROOT,
    )  # fmt: skip
    assert done.returncode == 0, f"ended with {done.returncode}: {done.stdout[-3000:]} {done.stderr[-3000:]}"
    outcomes = json.loads(done.stdout.strip().splitlines()[-1])
    print(outcomes)
    assert set(outcomes) <= {"sentence", "valid", "slowest sentence"}, done.stdout[-5000:]
    assert outcomes["sentence"] + outcomes["valid"] == len(cases) and outcomes["sentence"] > len(cases) / 4


def test_spoiled_scenes_are_valid_or_refused_in_one_sentence(tmp_path: Path) -> None:
    check(tmp_path, range(FEW))


@pytest.mark.long
@pytest.mark.timeout(30_000)
@pytest.mark.parametrize("part", range(20))
def test_many_spoiled_scenes(part: int, tmp_path: Path) -> None:
    each = MANY // 20
    check(tmp_path, range(FEW + part * each, FEW + (part + 1) * each))
