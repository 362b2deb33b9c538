"""A file changed in place is the old one or the new one, wherever the process is killed."""

from pathlib import Path
from typing import BinaryIO

import numpy as np
import pytest

from taichi_sph.errors import SceneError
from taichi_sph.output import files, redo
from taichi_sph.output.frames import FramesFile, FramesWriter

from .synthetic import frames


class Recorder:
    """A file whose writes are noted in their order, so that any first part of them can be done again."""

    def __init__(self, file: BinaryIO, done: list) -> None:
        self.file, self.done = file, done

    def write(self, data) -> int:
        self.done.append((self.file.tell(), bytes(data)))
        return self.file.write(data)

    def truncate(self, size: int) -> int:
        self.done.append(size)
        return self.file.truncate(size)

    def __getattr__(self, name: str):
        return getattr(self.file, name)

    def __enter__(self) -> "Recorder":
        return self

    def __exit__(self, *_: object) -> None:
        self.file.close()


def test_killed_after_any_write_leaves_the_old_or_the_new_frames(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    series = frames(3, spacing=0.01)
    writer = FramesWriter(tmp_path)
    path = tmp_path / "plate.vtkhdf"
    for frame in series[:2]:
        writer.append(frame)
    old, done, redone = path.read_bytes(), [], []
    opened, put, gone = Path.open, files.os.replace, Path.unlink

    def replace(source, target) -> None:
        redone.append(Path(source).read_bytes())
        done.append("redo")
        put(source, target)

    def unlink(self, missing_ok: bool = False) -> None:
        if self == redo.path_of(path):
            done.append("gone")
        gone(self, missing_ok)

    monkeypatch.setattr(
        Path, "open", lambda self, *a, **k: Recorder(opened(self, *a, **k), done) if self == path else opened(self, *a, **k)
    )
    monkeypatch.setattr(files.os, "replace", replace)
    monkeypatch.setattr(Path, "unlink", unlink)
    writer.append(series[2])
    monkeypatch.undo()
    new = path.read_bytes()
    assert done.count("redo") == 1 and done[-1] == "gone" and len(done) > 20

    for end in range(len(done) + 1):
        there = bytearray(old)
        pending = "redo" in done[:end] and "gone" not in done[:end]
        for what in done[:end]:
            if isinstance(what, int):
                there[what:] = b""
            elif not isinstance(what, str):
                there[len(there) :] = bytes(max(0, what[0] - len(there)))
                there[what[0] : what[0] + len(what[1])] = what[1]
        path.write_bytes(there)
        if pending:
            redo.path_of(path).write_bytes(redone[0])
        with FramesFile(path) as file:
            assert len(file) == (3 if "redo" in done[:end] else 2)
            for body, frame in zip(file, series, strict=False):
                assert np.array_equal(body.points, frame.bodies[0].points)
        if pending:
            with redo.changed(path):
                pass
            assert path.read_bytes() == new
        FramesWriter(tmp_path, resume_at=series[1].time)
        with FramesFile(path) as file:
            assert len(file) == 2


def test_full_disk_leaves_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    series = frames(2, spacing=0.01)
    writer = FramesWriter(tmp_path)
    writer.append(series[0])
    path = tmp_path / "plate.vtkhdf"
    old, opened = path.read_bytes(), Path.open

    class Full(Recorder):
        def write(self, data) -> int:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "open", lambda self, *a, **k: Full(opened(self, *a, **k), []) if self == path else opened(self, *a, **k))
    with pytest.raises(OSError, match="No space"):
        writer.append(series[1])
    assert path.read_bytes() == old and not redo.path_of(path).exists()


def test_raised_block_leaves_the_file(tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_bytes(b"0123456789")
    with pytest.raises(ZeroDivisionError), redo.changed(path) as held:
        held.seek(4)
        held.write(memoryview(b"abcdefghij"))
        raise ZeroDivisionError
    assert path.read_bytes() == b"0123456789" and not redo.path_of(path).exists()


def test_reads_what_it_holds_back(tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_bytes(b"0123456789")
    with redo.changed(path) as held:
        held.seek(8)
        held.write(memoryview(b"abcd"))
        held.seek(6)
        buffer = bytearray(10)
        assert held.readinto(memoryview(buffer)) == 6 and buffer[:6] == b"67abcd"
        assert path.read_bytes()[:10] == b"0123456789"
        held.truncate(11)
    assert path.read_bytes() == b"01234567abc"


def test_damaged_redo_is_one_sentence(tmp_path: Path) -> None:
    FramesWriter(tmp_path).append(frames(1, spacing=0.01)[0])
    path = tmp_path / "plate.vtkhdf"
    redo.path_of(path).write_bytes(b"redo 1\r\n" + b"\xff" * 40)
    with pytest.raises(SceneError, match="is damaged: remove that file"):
        FramesFile(path)
    with files.whole(redo.path_of(path), "wb") as file:
        file.write(b"short")
    with pytest.raises(SceneError, match="is damaged"), redo.changed(path):
        pass
