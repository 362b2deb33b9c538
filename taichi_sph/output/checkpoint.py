"""Checkpoints: everything that is history, written atomically, the last k kept.

A file is `MAGIC`, one line of JSON (schema version, scene hash, time, step, the arrays' names,
types and shapes, the checksum of their bytes), then the bytes of the arrays one after the other.
It is written under another name, forced to disk and only then moved in place, so a checkpoint that
exists is whole.
"""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..errors import SceneError

MAGIC = b"taichi-sph checkpoint\n"
SCHEMA = 1
SUFFIX = ".checkpoint"


@dataclass(frozen=True)
class Checkpoint:
    """State at `time` [s] after `step` steps; `extra` is small JSON of the run (seconds so far ...)."""

    path: Path
    time: float
    step: int
    state: dict[str, np.ndarray]
    extra: dict[str, object] = field(default_factory=dict)


def state_hash(state: dict[str, np.ndarray]) -> str:
    """sha256 over names, types, shapes and bytes of the arrays, in the order of their names."""
    digest = hashlib.sha256()
    for name in sorted(state):
        array = np.asarray(state[name])
        digest.update(f"{name} {array.dtype.str} {array.shape}\n".encode())
        digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()


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
    state: dict[str, np.ndarray],
    keep: int,
    extra: dict[str, object] | None = None,
) -> Path:
    """Writes `folder`/step_<step>.checkpoint and removes all but the last `keep`."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    arrays = {name: np.asarray(state[name]) for name in sorted(state)}
    header = {
        "schema": SCHEMA,
        "scene_hash": scene_hash,
        "time": float(time),
        "step": int(step),
        "checksum": state_hash(arrays),
        "arrays": [[name, a.dtype.str, list(a.shape)] for name, a in arrays.items()],
        "extra": extra or {},
    }
    path = folder / f"step_{step:09d}{SUFFIX}"
    temporary = path.with_name(path.name + ".tmp")
    with temporary.open("wb") as file:
        file.write(MAGIC)
        file.write(json.dumps(header).encode() + b"\n")
        for array in arrays.values():
            file.write(np.ascontiguousarray(array).data)
        file.flush()
        os.fsync(file.fileno())
    os.replace(temporary, path)
    _fsync_folder(folder)
    for old in list_checkpoints(folder)[:-keep]:
        old.unlink()
    return path


def list_checkpoints(folder: Path | str) -> list[Path]:
    """The checkpoints of a folder, oldest first."""
    return sorted(Path(folder).glob(f"step_*{SUFFIX}"))


def latest(folder: Path | str) -> Path:
    """The newest checkpoint of a folder."""
    paths = list_checkpoints(folder)
    if not paths:
        raise SceneError(f"there is no checkpoint in '{folder}': nothing to resume from")
    return paths[-1]


def load(path: Path | str, scene_hash: str | None = None) -> Checkpoint:
    """Reads a checkpoint; refuses one that is damaged, of another version or of another scene."""
    path = Path(path)

    def refuse(why: str) -> SceneError:
        others = [p.name for p in list_checkpoints(path.parent) if p != path]
        instead = f"; an older one is there: {others[-1]}" if others else ""
        return SceneError(f"checkpoint '{path}' {why}{instead}")

    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise refuse("does not exist") from None
    except OSError as error:
        raise refuse(f"cannot be read ({error.strerror})") from None
    if not data.startswith(MAGIC):
        raise refuse("is not a checkpoint of this package")
    end = data.find(b"\n", len(MAGIC))
    try:
        header = json.loads(data[len(MAGIC) : end]) if end > 0 else None
        if header is None:
            raise refuse("is cut off in its header")
        if header["schema"] != SCHEMA:
            raise refuse(f"has schema version {header['schema']}, this package reads version {SCHEMA}")
        if scene_hash is not None and header["scene_hash"] != scene_hash:
            raise refuse("belongs to another scene: resume with the scene that wrote it")
        state: dict[str, np.ndarray] = {}
        position = end + 1
        for name, dtype, shape in header["arrays"]:
            kind = np.dtype(dtype)
            if kind.hasobject or kind.itemsize == 0:
                raise refuse(f"holds an array of unknown type '{dtype}'")
            count = int(np.prod(shape, dtype=np.int64))
            size = count * kind.itemsize
            if count < 0 or position + size > len(data):
                raise refuse("is cut off: its arrays are longer than the file")
            state[name] = np.frombuffer(data, kind, count, position).reshape(shape).copy()
            position += size
        if position != len(data):
            raise refuse(f"has {len(data) - position} bytes too many")
        if state_hash(state) != header["checksum"]:
            raise refuse("is damaged: its checksum does not match its content")
        return Checkpoint(path, float(header["time"]), int(header["step"]), state, dict(header["extra"]))
    except (json.JSONDecodeError, UnicodeDecodeError, KeyError, TypeError, ValueError) as error:
        raise refuse(f"has a damaged header ({type(error).__name__})") from None
