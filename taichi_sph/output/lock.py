"""One process at a time writes into a folder.

The lock is the system's own (flock) on DIR/.lock, so that it ends with the process that holds it, however that process ends. The file
says in words who holds it; it is removed at the end. What a killed process left in it is told and written over. Where the disk knows no
such lock (some network disks), the words decide: a process of this machine that is gone, or that ran before the machine was started
anew, holds nothing; of another machine nobody can tell, and the sentence says which file to remove. On Windows nothing is locked.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import platform
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

from ..errors import SceneError
from .files import plain

LOCK_FILE = ".lock"
_NO_LOCKS = (errno.ENOLCK, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS, errno.EINVAL)
_PATIENCE = 1.0  # s that a holder may take to say who it is


@contextlib.contextmanager
def locked(folder: Path, say: Callable[[str], None] = lambda _: None) -> Iterator[None]:
    """Holds the lock of `folder`, which is made where it does not exist, and removed at the end where nothing came into it.

    SceneError that names the process, where another one holds it. `say` is told whose lock was taken over.
    """
    made = _make(folder)
    if fcntl is None:
        yield
        return
    try:
        handle = _take(folder)
        try:
            left = _read(handle)
            if left:
                say(f"'{folder}' was left locked by {_who(left)}, {_gone(left) or 'which gave it up'}; going on")
            _write(handle, _me())
            yield
        finally:
            with contextlib.suppress(OSError):
                if _same(handle, folder / LOCK_FILE):
                    (folder / LOCK_FILE).unlink()  # while it is held: who opened this file looks whether it is still there
            os.close(handle)
    finally:
        with contextlib.suppress(OSError):
            for each in made:
                each.rmdir()


def _make(folder: Path) -> list[Path]:
    """Makes a folder with its parents; those that were made, the deepest first."""
    made = []
    there = folder
    while not there.exists():
        made.append(there)
        there = there.parent
    folder.mkdir(parents=True, exist_ok=True)
    return made


def _take(folder: Path) -> int:
    """An open handle of the lock file, with the lock."""
    path = folder / LOCK_FILE
    while True:
        plain(path)
        handle = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_CLOEXEC", 0), 0o644)
        try:
            if not _lock(handle):
                holder = _holder(handle)
                elsewhere = f" (if it is gone: remove '{path}')" if holder and holder["host"] != platform.node() else ""
                raise SceneError(f"'{folder}' is in use by {_who(holder)}: wait for its end, or give another folder with --out{elsewhere}")
            if _same(handle, path):
                return handle
        except BaseException:
            os.close(handle)
            raise
        os.close(handle)  # removed by its holder between the opening and the lock


def _lock(handle: int) -> bool:
    """Whether the folder was free and is ours now."""
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise
        left = _read(handle)
        return not left or bool(_gone(left))
    return True


def _same(handle: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(handle), path.lstat())
    except FileNotFoundError:
        return False


def _holder(handle: int) -> dict[str, Any]:
    """What the holder wrote; it may be about to."""
    until = time.monotonic() + _PATIENCE
    while not (found := _read(handle)) and time.monotonic() < until:
        time.sleep(0.02)
    return found


def _me() -> dict[str, Any]:
    now = time.strftime("%Y-%m-%d %H:%M:%S")
    return {"process": os.getpid(), "host": platform.node(), "since": now, "boot": _boot(), "started": _started(os.getpid())}


def _read(handle: int) -> dict[str, Any]:
    """The words of a lock file; empty where there are none, or none of ours."""
    os.lseek(handle, 0, os.SEEK_SET)
    try:
        found = json.loads(os.read(handle, 4096))
        return {k: found[k] for k in ("process", "host", "since", "boot", "started")} if type(found["process"]) is int else {}
    except (ValueError, KeyError, TypeError, RecursionError):
        return {}


def _write(handle: int, words: dict[str, Any]) -> None:
    os.ftruncate(handle, 0)
    os.lseek(handle, 0, os.SEEK_SET)
    os.write(handle, json.dumps(words).encode() + b"\n")


def _who(words: dict[str, Any]) -> str:
    if not words:
        return "another process"
    host, since = (" ".join(str(words[k]).split())[:64] for k in ("host", "since"))
    return f"process {words['process']} on {host} since {since}"


def _gone(words: dict[str, Any]) -> str:
    """Why the process that wrote the words cannot live any more; empty where it may."""
    if words["host"] != platform.node():
        return ""
    if words["boot"] != _boot():
        return "before this machine was started anew"
    if words["started"] != _started(words["process"]):
        return "which is gone"
    return ""


def _boot() -> str:
    """What tells one start of this machine from another, where the system says so (Linux)."""
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    except OSError:
        return ""


def _started(process: int) -> str:
    """What tells a process from a later one with its number: its start, in ticks since the machine's (Linux); elsewhere only that it
    lives. Empty where there is no such process."""
    if Path("/proc/self/stat").exists():
        try:
            return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[19]
        except (OSError, IndexError):
            return ""
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return ""
    except PermissionError:
        pass
    return "lives"
