"""Changes of a file in place that are made whole or not at all, whenever the process is killed.

What is new is written behind the old end of the file, where no reader looks yet. What changes inside the old file is held back in memory.
At the end, the pieces held back are put in place under the name <file>.redo, whole; then they are written into the file, and the redo file
goes. A process killed before the redo file stands leaves the old file, one killed after leaves both: `pending` shows a reader the new
file, and the next `changed` writes the pieces again.
"""

from __future__ import annotations

import contextlib
import os
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from ..errors import SceneError
from . import files

_HEAD = struct.Struct("<8sQI")  # mark, size of the changed file [bytes], number of pieces
_PIECE = struct.Struct("<QQ")  # where it begins, its size [bytes]
_MARK = b"redo 1\r\n"


class Held:
    """A file as its changes leave it, with the methods that h5py asks for.

    Bytes below the old end are held back in `pieces`, bytes behind it go to the file. A write that fails (a full disk) is kept in `failed`
    rather than raised, for HDF5 does not survive an error while it closes a file.
    """

    def __init__(self, file: BinaryIO, pieces: list[tuple[int, bytes]] | None = None, end: int | None = None) -> None:
        self.file = file
        self.old = os.fstat(file.fileno()).st_size
        self.pieces = pieces or []  # (where, what), later ones over earlier ones
        self.end = self.old if end is None else end  # size of the changed file [bytes]
        self.failed: OSError | None = None
        self._place = 0

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        self._place = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._place, os.SEEK_END: self.end}[whence]
        return self._place

    def tell(self) -> int:
        return self._place

    def read(self, size: int) -> bytes:
        buffer = bytearray(size)
        return bytes(buffer[: self.readinto(memoryview(buffer))])

    def readinto(self, buffer: memoryview) -> int:
        start = self._place
        stop = max(start, min(start + len(buffer), self.end))
        self.file.seek(start)
        found = self.file.read(stop - start)
        buffer[: len(found)] = found
        buffer[len(found) : stop - start] = bytes(stop - start - len(found))
        for where, what in self.pieces:
            first, last = max(start, where), min(stop, where + len(what))
            if first < last:
                buffer[first - start : last - start] = what[first - where : last - where]
        self._place = stop
        return stop - start

    def write(self, data: memoryview) -> int:
        start, count = self._place, len(data)
        inside = max(0, min(count, self.old - start))
        if inside:
            self.pieces.append((start, bytes(data[:inside])))
        if inside < count and self.failed is None:
            try:
                self.file.seek(start + inside)
                self.file.write(data[inside:])
            except OSError as error:
                self.failed = error
        self._place = start + count
        self.end = max(self.end, self._place)
        return count

    def truncate(self, size: int | None = None) -> int:
        self.end = self._place if size is None else size
        return self.end

    def flush(self) -> None:
        """What is held back stays so until the end."""

    def close(self) -> None:
        self.file.close()


def path_of(path: Path) -> Path:
    """Where the pieces of a file are held while they are written into it."""
    return path.with_name(path.name + ".redo")


def pending(path: Path) -> Held | None:
    """The file with the changes that a killed process left beside it, for reading; None where there are none. SceneError where damaged."""
    redo = files.plain(path_of(path))
    try:
        with files.read(redo) as file:
            files.fits(redo, os.fstat(file.fileno()).st_size)
            stored = file.read()
        held = Held(files.read(path))
    except FileNotFoundError:
        return None
    try:
        held.pieces, held.end = _unpacked(stored, held.old)
    except (ValueError, struct.error):
        held.close()
        raise SceneError(f"'{redo}' is damaged: remove that file, and what its last frame changed is lost") from None
    return held


@contextlib.contextmanager
def changed(path: Path) -> Iterator[Held]:
    """A file to change in place: whole at the end of the block, as it was if the block raises or the process is killed."""
    files.plain(path, written=True)
    left = pending(path)
    if left is not None:
        left.close()
        _apply(path, left)
    with path.open("r+b") as file:
        held = Held(file)
        try:
            yield held
            file.flush()
            if held.failed is not None:
                raise held.failed
        except BaseException:
            file.truncate(held.old)
            raise
    with files.whole(path_of(path), "wb") as redo:
        redo.write(_packed(held))
    _apply(path, held)


def _apply(path: Path, held: Held) -> None:
    with path.open("r+b") as file:
        for where, what in held.pieces:
            file.seek(where)
            file.write(what)
        file.truncate(held.end)
    path_of(path).unlink()


def _packed(held: Held) -> bytes:
    found = _HEAD.pack(_MARK, held.end, len(held.pieces)) + b"".join(_PIECE.pack(at, len(what)) + what for at, what in held.pieces)
    return found + struct.pack("<I", zlib.crc32(found))


def _unpacked(stored: bytes, size: int) -> tuple[list[tuple[int, bytes]], int]:
    """Pieces and size of the changed file. ValueError or struct.error unless they are what was written, for a file of `size` bytes."""
    mark, end, count = _HEAD.unpack_from(stored)
    place, pieces = _HEAD.size, []
    if mark != _MARK or zlib.crc32(stored[:-4]) != struct.unpack("<I", stored[-4:])[0]:
        raise ValueError("not what was written")
    for _ in range(count):
        where, length = _PIECE.unpack_from(stored, place)
        place += _PIECE.size + length
        pieces.append((where, stored[place - length : place]))
        if place > len(stored) - 4 or where + length > size:
            raise ValueError("a piece leads out of the file")
    return pieces, end
