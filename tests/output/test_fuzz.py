"""Damage at random: checkpoints, frames, histories and JSON of a run. Each case is read as it was, or refused in one sentence.

A few hundred cases each time, 10 000 with `pytest -m long`. Cases are made from their number, so that one can be made again.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from random import Random

import numpy as np
import pytest

from taichi_sph.errors import SceneError
from taichi_sph.frame import BodyFrame, Frame
from taichi_sph.output import checkpoint
from taichi_sph.output.answer import answer
from taichi_sph.output.files import read_json, write_json
from taichi_sph.output.folder import RunFolder
from taichi_sph.output.frames import FramesFile, FramesWriter
from taichi_sph.output.histories import HistoryWriter, read_history, truncate, write_history
from taichi_sph.output.results import markdown, record_name
from taichi_sph.output.summary import measured

from ..scene.test_fuzz import changed as spoiled
from .synthetic import plate_scene, write_run

FEW, MANY = 200, 10_000
Damage = Callable[[bytes, np.random.Generator, list[bytes]], bytes]


def flipped(data: bytes, random: np.random.Generator, others: list[bytes]) -> bytes:
    """One to eight bits."""
    changed = bytearray(data)
    for _ in range(random.integers(1, 9)):
        changed[random.integers(len(changed))] ^= 1 << random.integers(8)
    return bytes(changed)


def digits(data: bytes, random: np.random.Generator, others: list[bytes]) -> bytes:
    """Another digit where a digit stands: a text that stays a text."""
    places = [i for i, letter in enumerate(data[:4000]) if chr(letter).isdigit()]
    changed = bytearray(data)
    for i in random.choice(places or [0], size=random.integers(1, 4)):
        changed[i] = ord("0") + random.integers(10)
    return bytes(changed)


def cut(data: bytes, random: np.random.Generator, others: list[bytes]) -> bytes:
    return data[: random.integers(len(data))]


def zeroed(data: bytes, random: np.random.Generator, others: list[bytes]) -> bytes:
    """A block of zeros, as a disk leaves that lost a sector."""
    size = int(random.choice([1, 16, 512, 4096]))
    start = int(random.integers(len(data)))
    return data[:start] + bytes(min(size, len(data) - start)) + data[start + size :]


def longer(data: bytes, random: np.random.Generator, others: list[bytes]) -> bytes:
    start = int(random.integers(len(data) + 1))
    return data[:start] + random.bytes(int(random.integers(1, 100))) + data[start:]


def shorter(data: bytes, random: np.random.Generator, others: list[bytes]) -> bytes:
    start = int(random.integers(len(data)))
    return data[:start] + data[start + int(random.integers(1, 100)) :]


def moved(data: bytes, random: np.random.Generator, others: list[bytes]) -> bytes:
    """A block in the place of another one."""
    size = int(random.choice([8, 64, 512]))
    a, b = (int(i) for i in random.integers(len(data), size=2))
    return data[:a] + data[b : b + size] + data[a + len(data[b : b + size]) :]


def swapped(data: bytes, random: np.random.Generator, others: list[bytes]) -> bytes:
    """A file of another kind, or of another run."""
    return others[random.integers(len(others))]


def spliced(data: bytes, random: np.random.Generator, others: list[bytes]) -> bytes:
    """The beginning of this file and the end of another one."""
    other = others[random.integers(len(others))]
    return data[: random.integers(len(data))] + other[random.integers(len(other) + 1) :]


DAMAGES: list[Damage] = [flipped, digits, cut, zeroed, longer, shorter, moved, swapped, spliced]


def count(cases: range, write: Callable[[bytes], None], valid: list[bytes], others: list[bytes], read: Callable[[bytes], bool]) -> Counter:
    """Outcomes of damaged files: read(damaged) says whether what was read is right; SceneError of one line is a sentence."""
    outcomes: Counter = Counter()
    for number in cases:
        random = np.random.default_rng(number)
        damage = DAMAGES[number % len(DAMAGES)]
        changed = damage(valid[random.integers(len(valid))], random, others)
        write(changed)
        try:
            outcome = "right" if read(changed) else "wrong"
        except SceneError as error:
            outcome = "sentence" if "\n" not in str(error) and 20 < len(str(error)) < 2000 else "no sentence"
        except Exception as error:  # what the test counts
            outcome = f"traceback: {type(error).__name__}: {error}"
        outcomes[outcome] += 1
        if outcome not in ("right", "sentence"):
            print(f"case {number} ({damage.__name__}): {outcome}")
    return outcomes


OTHERS = [
    b"",
    b"\0" * 1000,
    b"{}",
    b"[1, 2",
    b"time [s]\n1\n",
    b"PK\x03\x04" + bytes(100),
    b"\x89HDF\r\n\x1a\n" + bytes(2000),
    b"\xff\xfe" * 50,
]


def same(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> bool:
    return a.keys() == b.keys() and all(
        a[k].dtype == b[k].dtype and a[k].shape == b[k].shape and a[k].tobytes() == b[k].tobytes() for k in a
    )


def checkpoints(folder: Path, cases: range) -> Counter:
    """Damaged checkpoints of two runs, with a whole one before them, which must be what is found where the newest is refused."""
    written: dict[bytes, checkpoint.Checkpoint] = {}
    for run in range(2):
        for step in (10, 20):
            random = np.random.default_rng(100 * run + step)
            state = {
                "nodes.u": random.normal(size=(30, 3)),
                "nodes.v": random.normal(size=(30, 3)).astype(np.float32),
                "cells.broken": random.integers(0, 2, 25).astype(np.int8),
                "cells.rupture_time": np.where(random.random(25) < 0.5, np.nan, 1e-6),
                "time": np.array([step * 1e-6, 1e-6, 1e-6]),
                "step": np.array(step),
            }
            path = checkpoint.save(
                folder / str(run), scene_hash=str(run), time=step * 1e-6, step=step, dt=1e-6, state=state, keep=9, unset=["rupture_time"],
                extra={"command": "taichi-sph run x", "threads": 2, "advance": 1.5},
            )  # fmt: skip
            written[path.read_bytes()] = checkpoint.load(path, str(run))
    valid = list(written)
    target = folder / "0/step_000000020.checkpoint"
    older = written[valid[0]]

    def read(changed: bytes) -> bool:
        found, refused = checkpoint.newest_whole(folder / "0", "0")
        if target in refused and not (found.step == 10 and same(found.state, older.state)):
            return False
        found, expected = checkpoint.load(target, "0"), written.get(changed)  # refused, or whole and of this run
        if expected is None or (found.time, found.step, found.dt) != (expected.time, expected.step, expected.dt):
            return False
        return found.extra == expected.extra and same(found.state, expected.state)

    return count(cases, target.write_bytes, valid, OTHERS + valid, read)


def body(step: int) -> BodyFrame:
    random = np.random.default_rng(step)
    cells = np.array([[0, 1, 2, 3], [4, 5, 6, -1], [6, 7, 8, 5]], np.int32)
    data = {"damage": random.random(3), "broken": np.zeros(3, np.uint8), "rupture_time": np.full(3, np.nan)}
    reference = np.arange(27.0).reshape(9, 3)
    return BodyFrame("plate", random.random((9, 3)), cells, {"reference": reference, "velocity": random.random((9, 3))}, data)


def frames(folder: Path, cases: range) -> Counter:
    """Damaged frames: each that is read is what was written at its time."""
    path = folder / "plate.vtkhdf"
    writer = FramesWriter(folder)
    written = {step * 1e-6: body(step) for step in range(3)}
    for time, shown in written.items():
        writer.append(Frame(time, round(time * 1e6), (shown,)))
    valid = path.read_bytes()

    def read(changed: bytes) -> bool:
        with FramesFile(path) as file:
            shown = list(zip(file.times, file.steps, file, strict=True))
        writer = FramesWriter(folder, resume_at=1e-6)  # as a run does that goes on
        writer.append(Frame(5e-6, 5, (body(5),)))
        for left in folder.glob("*.unreadable"):
            left.unlink()
        return all(alike(found, written.get(float(time))) and step == round(time * 1e6) for time, step, found in shown)

    return count(cases, path.write_bytes, [valid], [*OTHERS, valid], read)


def alike(found: BodyFrame, expected: BodyFrame | None) -> bool:
    """Equal, but for the rounding to single precision on disk."""
    if expected is None or found.kind != expected.kind or not np.array_equal(found.points, expected.points):
        return False
    if not np.array_equal(found.cells, expected.cells):
        return False
    pairs = ((found.point_data, expected.point_data), (found.cell_data, expected.cell_data))
    return all(a.keys() == b.keys() and all(np.allclose(a[k], b[k], rtol=1e-6, equal_nan=True) for k in a) for a, b in pairs)


def histories(folder: Path, cases: range) -> Counter:
    path = folder / "energies.csv"
    units = {"time": "s", "kinetic": "J"}
    write_history(path, units, {"time": np.arange(20.0), "kinetic": np.random.default_rng(0).random(20)})
    valid = path.read_bytes()

    def read(changed: bytes) -> bool:
        read_history(path)
        truncate(path, 7.0)
        HistoryWriter(path, units, 6.0).close()
        return len(read_history(path)) <= 20  # digits of a text have no sum: what is read is what stands there

    return count(cases, path.write_bytes, [valid], [*OTHERS, valid], read)


def jsons(folder: Path, cases: range) -> Counter:
    path = folder / "summary.json"
    write_json(path, {"scene": "x", "title": "X äöü", "quantities": {"a": {"value": 1.5, "unit": "m"}}, "seconds": {"advance": 2.0}})
    valid = path.read_bytes()
    return count(cases, path.write_bytes, [valid], [*OTHERS, valid, b"[" * 100_000], lambda changed: read_json(path) == json.loads(changed))


def folders(folder: Path, cases: range) -> Counter:
    """A run folder of which one file is damaged, lost, or in the place of another: scene, record, summary, frames and histories are read,
    the crack is measured and the answer put in words. What frames hold of the body is what was written."""
    run = folder / "run"
    write_run(run, 2, plate_scene(**{"numerics.spacing": 2e-3}), spacing=2e-3)
    paths = sorted(path for path in run.rglob("*") if path.is_file() and ".lock" not in path.name)
    whole = {path: path.read_bytes() for path in paths}
    with RunFolder(run) as before:
        shown = list(before.frames("plate"))
        tips = measured(before, before.scene)
    outcomes: Counter = Counter()
    others = [*OTHERS, *whole.values()]
    for path in paths:
        mine = range(cases.start + paths.index(path), cases.stop, len(paths))

        def write(changed: bytes, path: Path = path) -> None:
            for one, content in whole.items():
                one.unlink(missing_ok=True)
                one.write_bytes(content)
            if changed == b"":  # lost
                path.unlink()
            else:
                path.write_bytes(changed)

        def read(changed: bytes, path: Path = path) -> bool:
            with RunFolder(run) as found:
                scene = found.scene
                found.summary, found.record if (run / "record.json").exists() else None
                for name in sorted(p.stem for p in (run / "histories").glob("*.csv")):
                    found.history(name)
                read_back = list(found.frames("plate"))
                values = measured(found, scene)
                answer(found)
            right = len(read_back) == len(shown) and all(map(alike, read_back, shown))
            return right and (path.suffix == ".json" or path.suffix == ".csv" or values == tips)

        outcomes += count(mine, write, [whole[path]], others, read)
    return outcomes


def summaries(folder: Path, cases: range) -> Counter:
    """A summary of which entries are lost, renamed, or of another kind: refused, or fit for an answer and for the tables of results."""
    run = write_run(folder / "run", 2, plate_scene(**{"numerics.spacing": 2e-3}), spacing=2e-3)
    path = run.path / "summary.json"
    valid = path.read_text()
    outcomes: Counter = Counter()
    for number in cases:
        path.write_text(json.dumps(spoiled(json.loads(valid), Random(number))))
        try:
            found = run.summary
            record_name(found), answer(run, found), markdown([found])
            outcome = "right"
        except SceneError as error:
            outcome = "sentence" if "\n" not in str(error) and 20 < len(str(error)) < 2000 else "no sentence"
        except Exception as error:  # what the test counts
            outcome = f"traceback: {type(error).__name__}: {error}"
        outcomes[outcome] += 1
        if outcome not in ("right", "sentence"):
            print(f"case {number}: {outcome}")
    return outcomes


KINDS = {"folders": folders, "summaries": summaries, "checkpoints": checkpoints, "frames": frames, "histories": histories, "jsons": jsons}
HERE = "import sys\nfrom pathlib import Path\nfrom tests.output.test_fuzz import KINDS\n"
HERE += "print(dict(KINDS[sys.argv[1]](Path(sys.argv[2]), range(int(sys.argv[3]), int(sys.argv[4])))))"


def check(kind: str, folder: Path, cases: range) -> None:
    """In a process of its own: a library that crashes or hangs ends no more than the cases. Its time is the processor's, on a busy machine
    too."""
    seconds = 30 + len(cases) // 10
    done = subprocess.run(
        [sys.executable, "-c", HERE, kind, str(folder), str(cases.start), str(cases.stop)],
        capture_output=True,
        text=True,
        timeout=10 * seconds,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds)),
        cwd=Path(__file__).parents[2],
    )
    assert done.returncode == 0, f"ended with {done.returncode}: {done.stdout[-2000:]} {done.stderr[-2000:]}"
    outcomes = eval(done.stdout.strip().splitlines()[-1])  # of this very file
    print(kind, outcomes)
    assert set(outcomes) <= {"right", "sentence"}, done.stdout[-3000:]
    assert outcomes["sentence"] > len(cases) / 4 and sum(outcomes.values()) == len(cases)


@pytest.mark.parametrize("kind", KINDS)
def test_damage_is_refused_in_one_sentence(kind: str, tmp_path: Path) -> None:
    check(kind, tmp_path, range(FEW // 4 if kind in ("frames", "folders", "summaries") else FEW))


@pytest.mark.long
@pytest.mark.timeout(11_000)
@pytest.mark.parametrize("kind", KINDS)
def test_damage_is_refused_in_one_sentence_at_length(kind: str, tmp_path: Path) -> None:
    check(kind, tmp_path, range(FEW, MANY))
