"""A run folder from a stranger: nothing outside of it is read or written, and no claim takes memory."""

from __future__ import annotations

import os
import resource
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from taichi_sph.errors import SceneError
from taichi_sph.frame import BodyFrame, Frame
from taichi_sph.output import files
from taichi_sph.output.frames import FramesFile, FramesWriter
from taichi_sph.output.histories import HistoryWriter, read_history, write_history
from taichi_sph.scene import load

N = 9


def frame(step: int, kind: str = "shell") -> Frame:
    points = np.random.default_rng(step).random((N, 3))
    cells = np.array([[0, 1, 2, 3], [4, 5, 6, -1], [6, 7, 8, 5]], np.int32)
    point_data = {"reference": points, "velocity": points}
    cell_data = {"damage": np.linspace(0, 1, 3), "broken": np.zeros(3, np.uint8), "rupture_time": np.full(3, np.nan)}
    if kind == "shell":
        return Frame(step * 1e-6, step, (BodyFrame("plate", points, cells, point_data, cell_data),))
    point_data["diameter"] = np.ones(N)
    return Frame(step * 1e-6, step, (BodyFrame("plate", points, np.zeros((0, 4), np.int32), point_data, {}, kind="fluid"),))  # type: ignore[arg-type]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A file of four frames, beside a secret."""
    writer = FramesWriter(tmp_path / "frames")
    for step in range(4):
        writer.append(frame(step))
    with h5py.File(tmp_path / "secret.h5", "w") as file:
        file["data"] = np.arange(4 * N * 3, dtype=np.float64).reshape(-1, 3)
        file["steps"] = np.arange(4)
    return tmp_path / "frames/plate.vtkhdf"


def replaced(name: str, make: Callable[[h5py.Group, str, Path], None]) -> Callable[[Path], None]:
    """Puts something else in the place of what is called `name`."""

    def change(path: Path) -> None:
        with h5py.File(path, "r+") as file:
            group = file[name].parent
            del file[name]
            make(group, name.rpartition("/")[2], path.parents[1] / "secret.h5")

    return change


def external_link(group: h5py.Group, name: str, secret: Path) -> None:
    group[name] = h5py.ExternalLink(str(secret), "/data")


def soft_link(group: h5py.Group, name: str, secret: Path) -> None:
    group[name] = h5py.SoftLink("/VTKHDF/Points")


def hard_link(group: h5py.Group, name: str, secret: Path) -> None:
    group[name] = group.file["VTKHDF/Points"]


def virtual(group: h5py.Group, name: str, secret: Path) -> None:
    layout = h5py.VirtualLayout((4 * N, 3), "f8")
    layout[:] = h5py.VirtualSource(str(secret), "data", (4 * N, 3))
    group.create_virtual_dataset(name, layout)


def stored_elsewhere(group: h5py.Group, name: str, secret: Path) -> None:
    group.create_dataset(name, (4 * N, 3), "f8", external=[(str(secret), 0, 4 * N * 24)])


def huge(group: h5py.Group, name: str, secret: Path) -> None:
    group.create_dataset(name, (10**12, 3), "f8", chunks=(N, 3))


def huge_packed(group: h5py.Group, name: str, secret: Path) -> None:
    group.create_dataset(name, (10**12,), "f8", chunks=(N,), compression="gzip")


def huge_chunk(group: h5py.Group, name: str, secret: Path) -> None:
    group.create_dataset(name, (4 * N,), "f8", chunks=(5 * 10**8,), maxshape=(None,), compression="gzip")


def wide(group: h5py.Group, name: str, secret: Path) -> None:
    group.create_dataset(name, (4 * N, 10**9), "f4", chunks=(1, 1000))


def texts(group: h5py.Group, name: str, secret: Path) -> None:
    group.create_dataset(name, data=["x"] * 4 * N)


def cycle(group: h5py.Group, name: str, secret: Path) -> None:
    group[name] = group


def absent(group: h5py.Group, name: str, secret: Path) -> None:
    pass


def value(name: str, content: object) -> Callable[[Path], None]:
    def change(path: Path) -> None:
        with h5py.File(path, "r+") as file:
            file[name][...] = content

    return change


def attribute(name: str, content: object) -> Callable[[Path], None]:
    def change(path: Path) -> None:
        with h5py.File(path, "r+") as file:
            owner, _, key = name.rpartition("/")
            file[owner].attrs[key] = content

    return change


LIES: dict[str, tuple[Callable[[Path], None], str]] = {
    "external link": (replaced("VTKHDF/Points", external_link), "links are not followed"),
    "external link to a group": (replaced("VTKHDF/PointData", external_link), "links are not followed"),
    "soft link": (replaced("VTKHDF/PointData/velocity", soft_link), "links are not followed"),
    "two names": (replaced("VTKHDF/PointData/velocity", hard_link), "under two names"),
    "virtual": (replaced("VTKHDF/Points", virtual), "in another file"),
    "stored elsewhere": (replaced("VTKHDF/Points", stored_elsewhere), "in another file"),
    "huge": (replaced("VTKHDF/Points", huge), "more rows of '/VTKHDF/Points' than"),
    "huge and packed": (replaced("VTKHDF/CellData/damage", huge_packed), "more rows of '/VTKHDF/CellData/damage' than"),
    "a huge chunk": (replaced("VTKHDF/CellData/damage", huge_chunk), "more rows"),
    "wide": (replaced("VTKHDF/PointData/velocity", wide), "more rows"),
    "huge steps": (replaced("VTKHDF/Steps/Values", huge), "more rows"),
    "huge connectivity": (replaced("VTKHDF/Connectivity", huge), "more rows"),
    "texts": (replaced("VTKHDF/CellData/damage", texts), "in a way that no frames file has"),
    "cycle": (replaced("VTKHDF/PointData/velocity", cycle), "under two names"),
    "no points": (replaced("VTKHDF/Points", absent), "not a frames file"),
    "no steps": (replaced("VTKHDF/Steps", absent), "not a frames file"),
    "more points": (value("VTKHDF/NumberOfPoints", 10**12), "more points than it holds"),
    "negative points": (value("VTKHDF/NumberOfPoints", -1), "more"),
    "times": (value("VTKHDF/Steps/Values", np.nan), "other times than steps"),
    "points of another time": (value("VTKHDF/Steps/Values", 1.0), "not what was written"),
    "points": (value("VTKHDF/Points", 1.0), "'points' of step 3 are not what was written"),
    "data": (value("VTKHDF/CellData/damage", 0.5), "'damage' of step 3 are not what was written"),
    "steps": (attribute("VTKHDF/Steps/NSteps", 10**12), "other times than steps"),
    "corner": (value("VTKHDF/Connectivity", 10**9), "cells are not what was written"),
    "corners": (value("VTKHDF/Offsets", 0), "cells are not what was written"),
    "kind": (attribute("VTKHDF/Kind", np.bytes_("A ghost")), "no kind of body 'A ghost'"),
    "kind, a number": (attribute("VTKHDF/Kind", 7), "not a frames file"),
    "offset": (value("VTKHDF/Steps/PointOffsets", 10**9), "ends before its last step"),
    "offset of data": (value("VTKHDF/Steps/CellDataOffsets/damage", -1), "ends before its last step"),
}


@pytest.mark.parametrize("name", LIES)
def test_frames_that_lie_are_refused_in_one_sentence_and_little_memory(path: Path, name: str) -> None:
    change, sentence = LIES[name]
    change(path)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(SceneError) as caught, FramesFile(path) as file:
        file.body(-1)
    assert sentence in str(caught.value) and str(path) in str(caught.value) and "\n" not in str(caught.value)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000  # kB


@pytest.mark.parametrize("name", ["external link", "virtual", "stored elsewhere"])
def test_a_run_that_goes_on_writes_through_nothing(path: Path, name: str) -> None:
    secret = (path.parents[1] / "secret.h5").read_bytes()
    LIES[name][0](path)
    writer = FramesWriter(path.parent, resume_at=2e-6)
    assert writer.aside == [path.with_suffix(".unreadable")]
    writer.append(frame(3))
    with FramesFile(path) as file:
        assert file.steps.tolist() == [3]
    assert (path.parents[1] / "secret.h5").read_bytes() == secret


@pytest.mark.parametrize("kind", ["shell", "fluid"])
def test_what_this_package_writes_is_read(tmp_path: Path, kind: str) -> None:
    writer = FramesWriter(tmp_path)
    for step in range(300):  # more than a chunk of the times
        writer.append(frame(step, kind))
    with FramesFile(tmp_path / "plate.vtkhdf") as file:
        assert len(file) == 300
        np.testing.assert_array_equal(file.body(299).points, frame(299, kind).bodies[0].points)


# --- links and devices in the folder --------------------------------------------------------------------------


@pytest.fixture
def precious(tmp_path: Path) -> Path:
    path = tmp_path / "precious"
    path.write_text("time [s]\n1.0\n")
    return path


def test_links_are_not_written_through(tmp_path: Path, precious: Path) -> None:
    there = tmp_path / "there"
    with pytest.raises(SceneError, match="symbolic link"):
        there.symlink_to(precious)
        files.append(there)
    with files.begin(there) as file:  # the link goes, not what it leads to
        file.write("new")
    there.unlink()
    there.symlink_to(precious)
    with pytest.raises(SceneError, match="symbolic link"):
        files.write_json(there, [1])
    (tmp_path / "there.tmp").symlink_to(precious)
    there.unlink()
    files.write_json(there, [1])
    assert files.read_json(there) == [1] and not there.is_symlink()
    assert precious.read_text() == "time [s]\n1.0\n"


def test_histories(tmp_path: Path, precious: Path) -> None:
    link = tmp_path / "h/energies.csv"
    link.parent.mkdir()
    link.symlink_to(precious)
    for act in (read_history, lambda p: HistoryWriter(p, {"time": "s"}, 1.0), lambda p: write_history(p, {"time": "s"}, {"time": [1]})):
        with pytest.raises(SceneError, match="symbolic link"):
            act(link)
    link.unlink()
    os.link(precious, link)
    with pytest.raises(SceneError, match="second name"):
        files.append(link)
    (tmp_path / "led").symlink_to(link.parent)
    with pytest.raises(SceneError, match="symbolic link"):
        HistoryWriter(tmp_path / "led/energies.csv", {"time": "s"})
    assert precious.read_text() == "time [s]\n1.0\n"


def test_frames(path: Path) -> None:
    moved = path.rename(path.parents[1] / "moved.vtkhdf")
    before = moved.read_bytes()
    path.symlink_to(moved)
    with pytest.raises(SceneError, match="symbolic link"):
        FramesFile(path)
    with pytest.raises(SceneError, match="symbolic link"):
        FramesWriter(path.parent, resume_at=1e-6)
    path.unlink()
    os.link(moved, path)
    with pytest.raises(SceneError, match="second name"):
        FramesWriter(path.parent, resume_at=1e-6)
    assert moved.read_bytes() == before


def test_a_pipe_does_not_hang_the_reader(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "summary.json")
    with pytest.raises(SceneError, match="neither a file nor a folder"):
        files.read_json(tmp_path / "summary.json")


def test_a_file_of_a_million_million_bytes_takes_no_memory(tmp_path: Path) -> None:
    for name, act in (("a.json", files.read_json), ("scene.json", load), ("a.csv", read_history)):
        with (tmp_path / name).open("wb") as file:
            file.truncate(10**12)
        with pytest.raises(SceneError, match="MB are read|this machine has"):
            act(tmp_path / name)


@pytest.mark.parametrize("content", [b"", b"{", b"\xff", b"[" * 200_000, b"1" * 10_000])
def test_damaged_json(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.json").write_bytes(content)
    with pytest.raises(SceneError, match="is not valid JSON"):
        files.read_json(tmp_path / "a.json")
