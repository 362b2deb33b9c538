"""Damaged mesh files: every one is read as a mesh without fault, or refused in one sentence.

Damage: flipped bytes, cuts, lines doubled, dropped and exchanged, numbers made large, negative or no numbers. The formats
that meshio reads are read in this process under an alarm of the processor's time, as their own process would be.
"""

from __future__ import annotations

import collections
import contextlib
import signal
import tempfile
import time
import traceback
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st

from taichi_sph.errors import SceneError
from taichi_sph.geometry.mesh import SurfaceMesh
from taichi_sph.geometry.meshfile import READERS, read_raw, surface
from taichi_sph.geometry.meshfiles import foreign

from .writers import WRITERS, box, halves

SLOW = 5.0  # s: a reader of ours that takes longer for 20 kB hangs
LIMIT = 20.0  # s of processor time for a foreign reader, whose process is ended
ROOM = 8 * 2**30  # bytes of address space meanwhile
NUMBERS = [
    b"0",
    b"-1",
    b"7",
    b"1e300",
    b"-1e-300",
    b"nan",
    b"inf",
    b"99999999999999999999",
    b"4294967295",
    b"1_0",
    b"0x10",
    b"",
    b"abc",
    b"1.5",
]
MESHES = {corners: (box()[0], box()[1] if corners == 4 else halves(box()[1])) for corners in (3, 4)}
SOUND = {(name, corners): write(*MESHES[corners]) for name, write in WRITERS.items() for corners in (3, 4)}


class Alarm(BaseException):
    """The time of a foreign reader is over."""


def flip(data: bytes, at: float, value: int) -> bytes:
    k = int(at * len(data))
    return data[:k] + bytes([data[k] ^ (value % 255 + 1)]) + data[k + 1 :]


def cut(data: bytes, at: float, value: int) -> bytes:
    return data[: int(at * len(data))]


def double(data: bytes, at: float, value: int) -> bytes:
    lines = data.split(b"\n")
    k = int(at * len(lines))
    return b"\n".join(lines[: k + 1] * 1 + lines[k : k + 1 + value % 3] + lines[k + 1 :])


def drop(data: bytes, at: float, value: int) -> bytes:
    lines = data.split(b"\n")
    k = int(at * len(lines))
    return b"\n".join(lines[:k] + lines[k + 1 + value % 3 :])


def exchange(data: bytes, at: float, value: int) -> bytes:
    lines = data.split(b"\n")
    k, j = int(at * len(lines)), value % len(lines)
    lines[k], lines[j] = lines[j], lines[k]
    return b"\n".join(lines)


def number(data: bytes, at: float, value: int) -> bytes:
    """Another word in the place of one."""
    k = int(at * len(data))
    separators = b" ,\n\t<>/"
    start = max(data.rfind(bytes([s]), 0, k) for s in separators) + 1
    stop = min(e for s in separators if (e := data.find(bytes([s]), k)) >= 0 or (e := len(data)))
    return data[:start] + NUMBERS[value % len(NUMBERS)] + data[stop:]


def insert(data: bytes, at: float, value: int) -> bytes:
    k = int(at * len(data))
    return data[:k] + bytes(range(value % 256, min(value % 256 + 4, 256))) + data[k:]


DAMAGE = [flip, cut, double, drop, exchange, number, insert]
cases = st.tuples(
    st.sampled_from(sorted(SOUND)),
    st.lists(st.tuples(st.sampled_from(DAMAGE), st.floats(0, 1, exclude_max=True), st.integers(0, 2**16)), min_size=1, max_size=3),
    st.booleans(),
)


def faults(mesh: SurfaceMesh) -> str:
    """What is wrong with a mesh that was accepted, '' if nothing is."""
    n, m = len(mesh.points), len(mesh.cells)
    with np.errstate(all="raise", under="ignore"):
        if not (np.isfinite(mesh.points).all() and np.isfinite(mesh.spacing) and mesh.spacing > 0):
            return "numbers that are not finite"
        if not (m and (mesh.cells[:, :3] >= 0).all() and mesh.cells.max() < n and len(np.unique(mesh.cells[mesh.cells >= 0])) == n):
            return "cells of nodes that are not there, or nodes of no cell"
        if not ((mesh.areas > 0).all() and (mesh.node_areas > 0).all() and (mesh.node_spacing > 0).all()):
            return "areas that are not positive"
        if not (np.isfinite(mesh.node_normals).all() and np.allclose(np.linalg.norm(mesh.node_normals, axis=1), 1.0)):
            return "normals that do not exist"
        for k in range(4):
            has = mesh.cells[:, k] >= 0
            if not (np.einsum("mi,mi->m", mesh.node_normals[mesh.cells[has, k]], mesh.frames[has, 2]) > 0).all():
                return "normals on the wrong side"
        sides = mesh.edges.sides  # raises where an edge bounds three cells
        if not (sides[:, 1] < 0).any():
            p = mesh.points[np.where(mesh.cells < 0, mesh.cells[:, :1], mesh.cells)]
            six = sum(float(np.einsum("mi,mi->m", p[:, 0], np.cross(p[:, k], p[:, k + 1])).sum()) for k in (1, 2))
            if six <= 0:
                return "a closed mesh that is inward"
        if any(mask.shape != (m,) or not mask.any() for mask in mesh.regions.values()):
            return "regions of no cell"
        if not all(np.isfinite(t) and t >= 0 for t in mesh.thickness.values()):
            return "a thickness that is none"
    return ""


def judge(path: Path, plane: bool) -> tuple[str, str]:
    """(verdict, why) of one file: sentence, limit, valid, traceback, hang or wrong."""

    def over(*_: object) -> None:
        raise Alarm

    before = time.perf_counter()
    try:
        if path.suffix in READERS:
            mesh = surface(path.name, READERS[path.suffix](path) if path.stat().st_size else read_raw(path), plane=plane)
        else:
            old = signal.signal(signal.SIGVTALRM, over)
            signal.setitimer(signal.ITIMER_VIRTUAL, LIMIT)
            try:
                raw = foreign.read_here(path)
            except MemoryError:
                return "limit", "memory"
            finally:
                signal.setitimer(signal.ITIMER_VIRTUAL, 0)
                signal.signal(signal.SIGVTALRM, old)
            before = time.perf_counter()
            mesh = surface(path.name, raw, plane=plane)
        why = faults(mesh)
    except SceneError as error:
        sentence = str(error)
        if path.stem not in sentence or "\n" in sentence or len(sentence) > 400 or not sentence.isprintable():
            return "wrong", f"no sentence: {sentence!r}"
        verdict, why = "sentence", ""
    except Alarm:
        return "limit", "time"
    except Exception:
        return "traceback", traceback.format_exc()
    else:
        verdict = "wrong" if why else "valid"
    if time.perf_counter() - before > SLOW:
        return "hang", f"{time.perf_counter() - before:.1f} s"
    return verdict, why


@contextlib.contextmanager
def room():
    """Less address space, so that an array of any size is a MemoryError and not the end of the machine."""
    resource = pytest.importorskip("resource")
    old = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (ROOM, old[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, old)


def count(examples: int, start: int) -> collections.Counter[tuple[str, str]]:
    """Verdicts by format of so many damaged files; the first fault of a kind ends with its file's damage."""
    found: collections.Counter[tuple[str, str]] = collections.Counter()
    with tempfile.TemporaryDirectory() as folder, room():

        @seed(start)
        @settings(max_examples=examples, deadline=None, database=None, suppress_health_check=list(HealthCheck))
        @given(cases)
        def one(case):
            (name, corners), damage, plane = case
            data = SOUND[name, corners]
            for how, at, value in damage:
                if data:
                    data = how(data, at, value)
            path = Path(folder) / name
            path.write_bytes(data)
            verdict, why = judge(path, plane)
            found[name, verdict] += 1
            assert verdict in ("sentence", "limit", "valid"), f"{verdict}: {why}"

        one()
    return found


def test_sound_files_are_valid(tmp_path):
    for (name, _), data in SOUND.items():
        (tmp_path / name).write_bytes(data)
        assert judge(tmp_path / name, False) == ("valid", "")


def test_damaged_files():
    found = count(600, 1)
    verdicts = {v for _, v in found}
    assert {"sentence", "valid"} <= verdicts  # the damage neither spares nor spoils everything


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_ten_thousand_damaged_files():
    found = count(10_000, 2)
    total = collections.Counter()
    for (_, verdict), n in found.items():
        total[verdict] += n
    print(dict(total))
    for name in WRITERS:
        print(f"{name:12s}", {v: found[name, v] for v in ("sentence", "valid", "limit") if found[name, v]})
    assert sum(total.values()) >= 10_000
