"""Checkpoints: everything that is history, written atomically, the last k kept.

A file is `MAGIC`, one line of JSON (schema version, scene hash, time, step, dt, the arrays' names, types and shapes, which of them
may hold numbers that are not finite), the bytes of the arrays one after the other, and the sha256 of all bytes before it. It is
written under another name, forced to disk and only then moved in place, so a checkpoint that exists is whole; and one that a disk
or a hand has changed since is known by its sum.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from io import BufferedReader
from pathlib import Path

import numpy as np

from ..errors import RunStopped, SceneError
from . import files

MAGIC = b"taichi-sph checkpoint\n"
SCHEMA = 2
SUFFIX = ".checkpoint"
ASIDE = ".damaged"  # added to the name of one that cannot be read
KEPT = 2  # the newest ones of a run: one, and the one before where that is damaged
HEADER = 64_000_000  # bytes, at most
SUM = hashlib.sha256().digest_size
_NAME = re.compile(rf"step_(\d{{9,18}}){re.escape(SUFFIX)}")


@dataclass(frozen=True)
class Checkpoint:
    """State at `time` [s] after `step` steps of late `dt` [s]; `extra` is small JSON of the run (seconds so far ...)."""

    path: Path
    time: float
    step: int
    dt: float
    state: dict[str, np.ndarray]
    extra: dict[str, object] = field(default_factory=dict)


def _bytes(array: np.ndarray) -> memoryview:
    return np.ascontiguousarray(array).reshape(-1).view(np.uint8).data


def state_hash(state: dict[str, np.ndarray]) -> str:
    """sha256 over names, types, shapes and bytes of the arrays, in the order of their names."""
    digest = hashlib.sha256()
    for name in sorted(state):
        array = np.asarray(state[name])
        digest.update(f"{name} {array.dtype.str} {array.shape}\n".encode())
        digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()


def not_finite(state: dict[str, np.ndarray]) -> list[str]:
    """Names of the arrays that hold a NaN or an infinity."""
    return sorted(name for name, a in state.items() if np.asarray(a).dtype.kind == "f" and not np.isfinite(a).all())


def _fsync_folder(folder: Path) -> None:
    """Makes the move itself durable, where the system lets folders be opened (not Windows)."""
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:
        return
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def save(
    folder: Path | str,
    *,
    scene_hash: str,
    time: float,
    step: int,
    dt: float,
    state: dict[str, np.ndarray],
    keep: int = KEPT,
    unset: Collection[str] | None = (),
    extra: dict[str, object] | None = None,
) -> Path:
    """Writes `folder`/step_<step>.checkpoint and removes all but the last `keep`.

    unset: last parts of the names of arrays that may hold a NaN or an infinity, where something has not happened yet (the time of a
    rupture); None: any may, as in the state of a run that failed. RunStopped where another one does: such a state is nothing to go
    on from.
    """
    folder = files.plain(Path(folder))
    arrays = {name: np.asarray(state[name]) for name in sorted(state)}
    odd = not_finite(arrays)
    wrong = [] if unset is None else [name for name in odd if name.rpartition(".")[2] not in unset]
    if wrong:
        rows = np.atleast_1d(arrays[wrong[0]])
        entry = int(np.flatnonzero(~np.isfinite(rows))[0]) // (rows.size // len(rows))
        raise RunStopped(
            f"'{wrong[0]}' holds a number that is not finite, first in entry {entry}, at t = {time:.6g} s; no checkpoint was written of it"
        )
    header = {
        "schema": SCHEMA,
        "scene_hash": scene_hash,
        "time": float(time),
        "step": int(step),
        "dt": float(dt),
        "arrays": [[name, a.dtype.str, list(a.shape)] for name, a in arrays.items()],
        "not_finite": odd,
        "extra": extra or {},
    }
    path = folder / f"step_{step:09d}{SUFFIX}"
    with files.whole(path, "wb") as file:
        digest = hashlib.sha256()
        parts: list[bytes | memoryview] = [MAGIC, json.dumps(header).encode() + b"\n", *map(_bytes, arrays.values())]
        for part in parts:
            digest.update(part)
            file.write(part)
        file.write(digest.digest())
        file.flush()
        os.fsync(file.fileno())
    _fsync_folder(folder)
    for old in list_checkpoints(folder)[:-keep]:
        old.unlink()
    return path


def list_checkpoints(folder: Path | str) -> list[Path]:
    """The checkpoints of a folder, oldest first."""
    found = {int(m[1]): p for p in Path(folder).glob(f"step_*{SUFFIX}") if (m := _NAME.fullmatch(p.name))}
    return [found[step] for step in sorted(found)]


def latest(folder: Path | str) -> Path:
    """The newest checkpoint of a folder."""
    paths = list_checkpoints(folder)
    if not paths:
        raise SceneError(f"there is no checkpoint in '{folder}': nothing to resume from")
    return paths[-1]


def newest_whole(folder: Path | str, scene_hash: str | None = None) -> tuple[Checkpoint, dict[Path, str]]:
    """The newest checkpoint that can be read, and why each newer one cannot. SceneError that names all where none can."""
    latest(folder)
    refused: dict[Path, str] = {}
    for path in reversed(list_checkpoints(folder)):
        try:
            return load(path, scene_hash), refused
        except SceneError as error:
            refused[path] = str(error)
    newest, *older = refused.values()
    raise SceneError(newest + (f"; nor can an older one be used: {'; '.join(older)}" if older else "; there is no other one"))


def put_aside(path: Path) -> Path:
    """Gives a checkpoint that cannot be read another name, so that it counts no more among those that are kept."""
    return path.replace(path.with_name(path.name + ASIDE))


def load(path: Path | str, scene_hash: str | None = None) -> Checkpoint:
    """Reads a checkpoint; refuses one that is damaged, of another version or of another scene."""
    path = Path(path)

    def refuse(why: str) -> SceneError:
        return SceneError(f"checkpoint '{path}' {why}")

    try:
        with files.read(path) as file:
            size = os.fstat(file.fileno()).st_size
            files.fits(path, size)
            return _read(file, size, path, scene_hash, refuse)
    except FileNotFoundError:
        raise refuse("does not exist") from None
    except OSError as error:
        raise refuse(f"cannot be read ({error.strerror})") from None
    except (KeyError, TypeError, ValueError, OverflowError, RecursionError, MemoryError) as error:
        raise refuse(f"has a damaged header ({type(error).__name__})") from None


def _read(file: BufferedReader, size: int, path: Path, scene_hash: str | None, refuse: Callable[[str], SceneError]) -> Checkpoint:
    """The content of an open file of `size` bytes. No array is allocated before the file is known to be as long as the header says."""
    first = file.readline(len(MAGIC))
    if first != MAGIC:
        raise refuse("is not a checkpoint of this package")
    line = file.readline(HEADER)
    if not line.endswith(b"\n"):
        raise refuse("is cut off in its header")
    header = json.loads(line)
    if header["schema"] != SCHEMA:
        raise refuse(f"has schema version {_short(header['schema'])}, this package reads version {SCHEMA}")
    kinds = [(str(name), _kind(dtype), tuple(map(_whole, shape))) for name, dtype, shape in header["arrays"]]
    for name, kind, shape in kinds:
        if kind.kind not in "fiub":
            raise refuse(f"holds an array of unknown type '{kind}'")
        if min(shape, default=0) < 0:
            raise refuse(f"holds an array '{_short(name)}' of a negative length")
    room = size - len(MAGIC) - len(line) - SUM
    need = sum(math.prod(shape) * kind.itemsize for _, kind, shape in kinds)
    if need > room:
        raise refuse("is cut off: its arrays are longer than the file")
    if need < room:
        raise refuse(f"has {room - need} bytes too many")
    digest = hashlib.sha256(first + line)
    state: dict[str, np.ndarray] = {}
    for name, kind, shape in kinds:
        array = np.empty(shape, kind)
        raw = _bytes(array)
        if file.readinto(raw) != raw.nbytes:
            raise refuse("is cut off: its arrays are longer than the file")
        digest.update(raw)
        state[name] = array
    if digest.digest() != file.read(SUM):
        raise refuse("is damaged: its checksum does not match its content")
    if len(state) != len(kinds):
        raise refuse("is damaged: it holds an array twice")
    # a sum says that a file is as it was written, not that it was written by this package
    time, step, dt = float(header["time"]), _whole(header["step"]), float(header["dt"])
    for name, value, allowed in (("time", time, 0 <= time < math.inf), ("step", step, step >= 0), ("dt", dt, 0 < dt < math.inf)):
        if not allowed:
            raise refuse(f"has {name} = {value:g}, which no run has")
    odd = set(not_finite(state)) - set(header["not_finite"])
    if odd:
        raise refuse(f"holds numbers that are not finite in '{_short(min(odd))}'")
    if scene_hash is not None and header["scene_hash"] != scene_hash:
        raise refuse("belongs to another scene: resume with the scene that wrote it")
    return Checkpoint(path, time, step, dt, state, dict(header["extra"]))


def _kind(text: object) -> np.dtype:
    """The type of an array. NumPy reads more than names of types as one: what is in brackets it takes for Python."""
    if not re.fullmatch(r"[<>|=]?[a-zA-Z]\d{0,4}", str(text)):
        raise TypeError
    return np.dtype(str(text))


def _whole(value: object) -> int:
    """A whole number of JSON as such: 2.5 is none, and true is none."""
    if type(value) is not int:
        raise TypeError
    return value


def _short(value: object) -> str:
    text = " ".join(str(value).split())
    return text if len(text) <= 60 else text[:57] + "..."
