"""Files of a run folder: written whole or not at all, never through a link, never larger in memory than the machine.

A run folder may come from somebody else. What lies in such a folder under one of our names must be an ordinary file or folder: a symbolic
link would lead a reader to files of this machine that the folder does not hold, and a writer to destroy them. The folder itself may be
reached through links: the user named it.
"""

from __future__ import annotations

import contextlib
import json
import os
import stat
from collections.abc import Iterable, Iterator
from io import BufferedReader
from pathlib import Path
from typing import Any, TextIO

from ..errors import SceneError
from ..scene.script import JSON_BYTES

# what the folder of a run holds, and what that of a study or of a sweep holds beside its runs
RUN = (
    "scene.json",
    "scene.next.json",
    "record.json",
    "summary.json",
    "log.txt",
    "frames",
    "histories",
    "checkpoints",
    "stopped",
    "pictures",
)
STUDIES = ("study.json", "sweep.json", "points", "results.csv", "results.parquet", "price.json", "price.md", "price.png")
_NOFOLLOW = getattr(os, "O_NOFOLLOW", 0)  # not on Windows


def memory() -> int | None:
    """Bytes of main memory, None where the system does not say."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return None


def plain(path: Path, written: bool = False) -> Path:
    """`path`, if nothing is there, or an ordinary file or folder. SceneError for a link or a device.

    written: the file is going to be changed in place; then it must not be known by a second name (a hard link) either.
    """
    try:
        found = path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return path
    if stat.S_ISLNK(found.st_mode):
        raise SceneError(f"'{path}' is a symbolic link; links inside a run folder are not followed: put the file itself there")
    if not (stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode)):
        raise SceneError(f"'{path}' is neither a file nor a folder; a run folder holds nothing else")
    if written and stat.S_ISREG(found.st_mode) and found.st_nlink > 1:
        raise SceneError(f"'{path}' has a second name (a hard link), and that file would be changed too: copy the folder first")
    return path


def check_links(folder: Path, names: Iterable[str]) -> None:
    """Refuses links and devices among `names` in a folder, and anywhere below them."""
    for name in names:
        path = plain(folder / name)
        if path.is_dir():
            with os.scandir(path) as entries:
                check_links(path, [entry.name for entry in entries])


@contextlib.contextmanager
def whole(path: Path, mode: str = "w") -> Iterator[Any]:
    """A new file, put in place when it is complete, so that a reader never meets half a file. Mode "w" (UTF-8) or "wb"."""
    temporary = fresh(plain(path))
    text = "b" not in mode
    new = mode.replace("w", "x")  # which never goes through a link
    try:
        with open(temporary, new, encoding="utf-8" if text else None, newline="" if text else None) as file:
            yield file
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    os.replace(temporary, path)


def fresh(path: Path) -> Path:
    """The name under which a file is written before it is moved to `path`; nothing is there."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(path.name + ".tmp")
    temporary.unlink(missing_ok=True)  # what a killed run left, or a link: the link goes, not what it leads to
    return temporary


def append(path: Path) -> TextIO:
    """A text file to go on with, made where there is none."""
    plain(path, written=True)
    return open(path, "a", encoding="utf-8", newline="", opener=lambda name, flags: os.open(name, flags | _NOFOLLOW, 0o666))


def begin(path: Path) -> TextIO:
    """A text file written from its start on, line by line (for what must be readable meanwhile)."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    return path.open("x", encoding="utf-8", newline="")


def read(path: Path) -> BufferedReader:
    """An ordinary file, opened for reading bytes; a folder or a link is refused."""
    return open(plain(path), "rb", opener=lambda name, flags: os.open(name, flags | _NOFOLLOW))


def fits(path: Path, size: int) -> None:
    """Refuses what the memory of this machine cannot hold, before any of it is taken."""
    available = memory()
    if available is not None and size > available:
        raise SceneError(f"'{path}' needs {size / 1e9:.3g} GB of memory; this machine has {available / 1e9:.3g} GB")


def read_text(path: Path, largest: int | None = None) -> str:
    """A text file. SceneError where its size is above `largest` [bytes], or half of the memory."""
    with read(path) as file:
        size = os.fstat(file.fileno()).st_size
        if largest is not None and size > largest:
            raise SceneError(f"'{path}' holds {size / 1e6:.3g} MB; at most {largest / 1e6:.3g} MB are read of such a file")
        fits(path, 2 * size)
        return file.read().decode("utf-8")


def write_json(path: Path, content: Any) -> Path:
    """JSON put in place when complete."""
    with whole(path) as file:
        file.write(json.dumps(content, indent=2, ensure_ascii=False) + "\n")
    return path


def read_json(path: Path) -> Any:
    """SceneError where there is none, or where it is damaged."""
    try:
        return json.loads(read_text(path, JSON_BYTES))
    except FileNotFoundError:
        raise SceneError(f"there is no '{path}'") from None
    except OSError as error:
        raise SceneError(f"'{path}' cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError):
        raise SceneError(f"'{path}' is not valid JSON") from None
