"""Frames on disk: one VTKHDF file per body, a temporal unstructured grid that ParaView plays.

Layout: VTKHDF 2.x, https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/. Connectivity
and every array that does not change ("reference") are stored once, the rest one chunk per step. A body
without cells (pinballs, fluid particles) is written with a vertex for each point, so that it can be seen and
thresholded; what it is, stands in the attribute "Kind".

Crash safety. Between frames the file is closed. A frame adds new chunks behind the old ones; what says that the chunks exist (a few
kilobytes of metadata) is all that changes in place, and that changes whole or not at all, see redo.py. HDF5 itself writes its metadata in
several pieces, and the single-writer mode of HDF5 leaves, after a kill, a mark that ParaView refuses. A file is created under another name
and moved in place, and one damaged beyond reading is put aside on resume rather than lost.

Damage. The format "v108" has sums over what HDF5 writes about the data. The sums of the data are ours: for each array and step those in
"Steps", beside the offsets, and the attribute "Sum" of the cells.
"""

from __future__ import annotations

import contextlib
import math
import os
import re
import zlib
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np

from ..errors import SceneError
from ..frame import NO_CELLS, BodyFrame, Frame, Kind
from . import files, redo

SUFFIX = ".vtkhdf"
VERSION = (2, 2)
VTK_VERTEX, VTK_TRIANGLE, VTK_QUAD = 1, 5, 9
STATIC = frozenset({"reference", "radius"})  # written once, the same at every step
PACKED = frozenset({"damage", "rupture_time", "plastic", "diameter"})  # much of it is the same
EXACT = frozenset({"points", "reference"})  # kept in f64: displacements are differences of these
DAMAGE = (OSError, KeyError, RuntimeError, ValueError, TypeError, IndexError, AttributeError, OverflowError)  # what HDF5 and we make of it
FILTERS = {h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SHUFFLE}
DEFLATED = 1040  # how many times smaller deflate can make anything, rounded up
KIND = re.compile(r"[a-z][a-z0-9_]{0,39}")
DEPTH = 3  # of groups: VTKHDF/Steps/PointDataOffsets


def _stored(name: str, array: np.ndarray) -> np.ndarray:
    """What goes to disk: positions in f64, other reals in f32 (exact state is in checkpoints)."""
    array = np.ascontiguousarray(array)
    if array.dtype.kind == "f":
        return array.astype(np.float64 if name in EXACT else np.float32, copy=False)
    if array.dtype == bool:
        return array.astype(np.uint8)
    return array


def _create(group: h5py.Group, name: str, array: np.ndarray, packed: bool = True) -> None:
    """A data set that grows by one chunk per step; chunks never straddle steps (crash safety)."""
    array = _stored(name.lower(), array)
    if len(array) == 0:  # HDF5 has no empty chunks
        group.create_dataset(name, data=array, maxshape=(None, *array.shape[1:]))
        return
    packing = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
    if not packed or (array.dtype.kind == "f" and name not in PACKED):
        packing = {}  # noise: packing costs more than it saves
    group.create_dataset(name, data=array, chunks=array.shape, maxshape=(None, *array.shape[1:]), **packing)


def _sum(*arrays: np.ndarray) -> int:
    """CRC-32 of arrays one after the other, as they are stored."""
    found = 0
    for array in arrays:
        found = zlib.crc32(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data, found)
    return found


def _extend(dataset: h5py.Dataset, rows: np.ndarray) -> int:
    """Appends rows; returns where they start."""
    start = dataset.shape[0]
    dataset.resize(start + len(rows), axis=0)
    dataset[start:] = rows
    return start


def _create_file(path: Path, body: BodyFrame, time: float, step: int) -> None:
    if len(body.cells):
        quads = body.cells[:, 3] >= 0
        size, types = np.where(quads, 4, 3), np.where(quads, VTK_QUAD, VTK_TRIANGLE)
        connectivity = body.cells[body.cells >= 0].astype(np.int64)
    else:
        size, types = np.ones(len(body.points), dtype=np.int64), np.full(len(body.points), VTK_VERTEX)
        connectivity = np.arange(len(body.points))
    temporary = files.fresh(path)
    with h5py.File(temporary, "x", libver="v108", locking=False) as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array(VERSION, dtype=np.int64)
        root.attrs.create("Type", np.bytes_("UnstructuredGrid"))
        root.attrs.create("Kind", np.bytes_(body.kind))
        counts = {"NumberOfPoints": len(body.points), "NumberOfCells": len(size), "NumberOfConnectivityIds": len(connectivity)}
        for name, count in counts.items():
            _create(root, name, np.array([count], dtype=np.int64), packed=False)
        offsets = np.concatenate([[0], np.cumsum(size)]).astype(np.int64)
        for name, array in (("Connectivity", connectivity), ("Offsets", offsets), ("Types", types.astype(np.uint8))):
            _create(root, name, array, packed=False)  # what is stored of them bounds all the rest: `check_content`
        _create(root, "Points", body.points)

        steps = root.create_group("Steps")
        steps.attrs["NSteps"] = np.int64(1)

        def series(group: h5py.Group, name: str, first: np.ndarray) -> None:
            group.create_dataset(name, data=first, maxshape=(None, *first.shape[1:]), chunks=(256, *first.shape[1:]))

        zero = np.zeros(1, dtype=np.int64)
        series(steps, "Values", np.array([time], dtype=np.float64))
        series(steps, "NumberOfParts", np.ones(1, dtype=np.int64))
        for name in ("PartOffsets", "PointOffsets"):
            series(steps, name, zero)
        for name in ("CellOffsets", "ConnectivityIdOffsets"):
            series(steps, name, zero[:, None])
        for kind, arrays in (("PointData", body.point_data), ("CellData", body.cell_data)):
            data, offsets, sums = root.create_group(kind), steps.create_group(f"{kind}Offsets"), steps.create_group(f"{kind}Sums")
            for name, array in arrays.items():
                _create(data, name, array)
                series(offsets, name, zero)
                series(sums, name, np.array([_sum(_stored(name, array))], dtype=np.int64))
        series(steps, "PointSums", _point_sum(body, time, step))
        # The step number travels as field data: one value per frame.
        series(root.create_group("FieldData"), "step", np.array([step], dtype=np.int64))
        series(steps.create_group("FieldDataOffsets"), "step", zero)
        series(steps.create_group("FieldDataSizes"), "step", np.ones((1, 2), dtype=np.int64))
        root.attrs["Sum"] = _sum(root["Offsets"][:], root["Connectivity"][:])
    os.replace(temporary, files.plain(path))


def _point_sum(body: BodyFrame, time: float, step: int) -> np.ndarray:
    """Of the points and of when they are there."""
    return np.array([_sum(np.array([time, step], dtype=np.float64), _stored("points", body.points))], dtype=np.int64)


def _append(path: Path, body: BodyFrame, time: float, step: int) -> None:
    with redo.changed(path) as held, h5py.File(held, "r+") as file:
        root = file["VTKHDF"]
        steps = root["Steps"]
        count = int(steps.attrs["NSteps"])
        if len(body.points) != int(root["NumberOfPoints"][0]):
            raise ValueError(f"{path.name}: {len(body.points)} points after {int(root['NumberOfPoints'][0])}; they must stay as many")
        for kind, arrays in (("PointData", body.point_data), ("CellData", body.cell_data)):
            if set(arrays) != set(root[kind]):
                raise ValueError(f"{path.name}: the fields changed from {sorted(root[kind])} to {sorted(arrays)}")
        _extend(steps["PointOffsets"], np.array([_extend(root["Points"], _stored("points", body.points))]))
        _extend(steps["PointSums"], _point_sum(body, time, step))
        for kind, arrays in (("PointData", body.point_data), ("CellData", body.cell_data)):
            for name, array in arrays.items():
                stored, still, sums = _stored(name, array), name in STATIC, steps[f"{kind}Sums"][name]
                _extend(steps[f"{kind}Offsets"][name], np.array([0 if still else _extend(root[kind][name], stored)]))
                _extend(sums, np.array([sums[count - 1] if still else _sum(stored)]))
        _extend(steps["FieldDataOffsets"]["step"], np.array([_extend(root["FieldData/step"], np.array([step]))]))
        _extend(steps["FieldDataSizes"]["step"], np.ones((1, 2), dtype=np.int64))
        _extend(steps["NumberOfParts"], np.ones(1, dtype=np.int64))
        _extend(steps["PartOffsets"], np.zeros(1, dtype=np.int64))
        for name in ("CellOffsets", "ConnectivityIdOffsets"):
            _extend(steps[name], np.zeros((1, 1), dtype=np.int64))
        _extend(steps["Values"], np.array([time]))
        steps.attrs["NSteps"] = np.int64(count + 1)


def _datasets(group: h5py.Group, depth: int = 0) -> Iterator[h5py.Dataset]:
    """All data sets below a group. Refuses what leads out of the file, before anything of it is read."""
    for name in group:
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            raise SceneError(f"holds a link, '{group.name}/{name}'; links are not followed")
        item = group[name]
        if h5py.h5o.get_info(item.id).rc != 1:
            raise SceneError(f"holds '{group.name}/{name}' under two names, which no frames file does")
        if isinstance(item, h5py.Dataset):
            yield item
        elif isinstance(item, h5py.Group) and depth < DEPTH:
            yield from _datasets(item, depth + 1)
        else:
            raise SceneError(f"holds '{group.name}/{name}', which no frames file has")


def check_content(file: h5py.File) -> None:
    """SceneError where a file leads elsewhere, or claims more than it holds, before memory is taken.

    Every number that is read later is bounded by bytes that are there: points and cells are stored unpacked, what is packed has their
    number of rows for each step. A step more may be begun: a killed run leaves that.
    """
    root = file["VTKHDF"]
    for dataset in _datasets(file):
        made = dataset.id.get_create_plist()
        if made.get_layout() == h5py.h5d.VIRTUAL or made.get_external_count():
            raise SceneError(f"keeps '{dataset.name}' in another file; other files are not read")
        if dataset.dtype.kind not in "iuf" or {made.get_filter(i)[0] for i in range(made.get_nfilters())} - FILTERS:
            raise SceneError(f"stores '{dataset.name}' in a way that no frames file has")
    points, steps = root["Points"], root["Steps/Values"]
    n, m = int(root["NumberOfPoints"][0]), root["Types"].shape[0]
    for dataset in _datasets(root):
        place, stored = dataset.name.removeprefix(f"{root.name}/"), dataset.id.get_storage_size()
        each = n if place == "Points" else {"PointData": n, "CellData": m}.get(place.partition("/")[0])  # rows a step
        row = dataset.dtype.itemsize * math.prod(dataset.shape[1:])
        claimed = dataset.shape[0] * row
        most = stored * (DEFLATED if dataset.compression else 1) + (each or 1) * row
        chunks = dataset.chunks or (0, *dataset.shape[1:])
        strange = chunks[1:] != dataset.shape[1:] or chunks[0] > max(each or 0, 256 if dataset.compression else stored // max(row, 1), 256)
        if strange or len(dataset.shape) > 2 or claimed > most or (each is not None and dataset.shape[0] > each * (steps.shape[0] + 1)):
            raise SceneError(f"claims more rows of '{dataset.name}' than it holds")
    if not 0 <= n <= points.shape[0] or n * 24 > points.id.get_storage_size():
        raise SceneError("claims more points than it holds")


def truncate(path: Path, time: float) -> int:
    """Drops the steps later than `time` [s]; returns how many are left (file deleted when none)."""
    with redo.changed(path) as held, h5py.File(held, "r+") as file:
        check_content(file)
        root = file["VTKHDF"]
        steps = root["Steps"]
        values = steps["Values"][:]
        keep = int(np.count_nonzero(values <= time * (1 + 1e-12)))
        if 0 < keep < len(values):
            for kind in ("PointData", "CellData"):
                for name in root[kind]:
                    if name not in STATIC:
                        dataset = root[kind][name]
                        dataset.resize(dataset.shape[0] // len(values) * keep, axis=0)
            points = root["Points"]
            points.resize(points.shape[0] // len(values) * keep, axis=0)
            root["FieldData/step"].resize(keep, axis=0)

            def shorten(_: str, item: object) -> None:
                if isinstance(item, h5py.Dataset):
                    item.resize(keep, axis=0)

            steps.visititems(shorten)
            steps.attrs["NSteps"] = np.int64(keep)
    if keep == 0:
        path.unlink()
    return keep


class FramesWriter:
    """Writes frames into `folder`/<body>.vtkhdf.

    `resume_at` None starts anew; a time [s] keeps the frames up to it and goes on behind them.
    `aside` names the files that could not be read on resume and were moved away.
    """

    def __init__(self, folder: Path | str, resume_at: float | None = None) -> None:
        self.folder = files.plain(Path(folder))
        self.folder.mkdir(parents=True, exist_ok=True)
        self.aside: list[Path] = []
        self._last_step: dict[str, int] = {}
        for path in sorted(self.folder.glob("*" + SUFFIX)):
            if resume_at is None:
                path.unlink()
                redo.path_of(path).unlink(missing_ok=True)
                continue
            try:
                if truncate(path, resume_at):
                    with FramesFile(path) as file:
                        self._last_step[path.stem] = int(file.steps[-1])
            except (*DAMAGE, SceneError):
                files.plain(path, written=True)
                redo.path_of(path).unlink(missing_ok=True)
                self.aside.append(path.rename(path.with_suffix(".unreadable")))

    def path(self, body: str) -> Path:
        return self.folder / (body + SUFFIX)

    def append(self, frame: Frame) -> list[Path]:
        """Adds one instant; a step that is already the last one is left alone (resumed runs)."""
        paths = []
        for body in frame.bodies:
            path = self.path(body.name)
            last = self._last_step.get(body.name)
            if last is None:
                _create_file(path, body, frame.time, frame.step)
            elif frame.step > last:
                _append(path, body, frame.time, frame.step)
            elif frame.step < last:
                raise ValueError(f"frame of step {frame.step} after step {last}")
            self._last_step[body.name] = frame.step
            paths.append(path)
        return paths


class FramesFile:
    """Reads one body's file with h5py only: `times` [s], `steps`, its `kind`, and the body at any of them.

    SceneError where the file is none of ours, is damaged, or leads to other files.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self.name = self.path.stem
        with self._said():
            files.plain(self.path)
            self._held = redo.pending(self.path)
            self._file = h5py.File(self.path, "r", locking=False) if self._held is None else h5py.File(self._held, "r")
        try:
            with self._said():
                self._open()
        except SceneError:
            self.close()
            raise

    @contextlib.contextmanager
    def _said(self) -> Iterator[None]:
        """Whatever a damaged file does to its reader, as a sentence."""
        try:
            yield
        except FileNotFoundError:
            raise SceneError(f"there is no frames file '{self.path}'") from None
        except SceneError as error:
            raise SceneError(str(error) if str(self.path) in str(error) else f"'{self.path}' {error}") from None
        except DAMAGE as error:
            raise SceneError(f"'{self.path}' is not a frames file of this package ({' '.join(str(error).split())})") from None

    def _open(self) -> None:
        check_content(self._file)
        self._root = self._file["VTKHDF"]
        self._steps = self._root["Steps"]
        count = int(self._steps.attrs["NSteps"])
        self.times: np.ndarray = self._steps["Values"][:count]
        self.steps: np.ndarray = self._root["FieldData/step"][:count]
        if not 1 <= count == len(self.times) == len(self.steps) or not np.isfinite(self.times).all():
            raise SceneError("is damaged: it has other times than steps")
        self._points = int(self._root["NumberOfPoints"][0])
        self.kind: Kind = self._root.attrs.get("Kind", b"shell").decode()
        if not KIND.fullmatch(self.kind):
            raise SceneError(f"is damaged: there is no kind of body '{' '.join(self.kind.split())[:60]}'")
        self.cells = NO_CELLS
        offsets, corners = self._root["Offsets"][:], self._root["Connectivity"][:]
        if self._root.attrs["Sum"] != _sum(offsets, corners):
            raise SceneError("is damaged: its cells are not what was written")
        if (self._root["Types"][:] != VTK_VERTEX).any():
            sizes = np.diff(offsets)
            if offsets[:1] != 0 or not np.isin(sizes, (3, 4)).all() or offsets[-1] != len(corners):
                raise SceneError("is damaged: its cells have neither three nor four corners")
            if corners.min(initial=0) < 0 or corners.max(initial=-1) >= self._points:
                raise SceneError("is damaged: its cells have corners that are no points")
            self.cells = np.full((len(sizes), 4), -1, dtype=np.int32)
            self.cells[np.arange(4) < sizes[:, None]] = corners

    def __len__(self) -> int:
        return len(self.times)

    def __enter__(self) -> FramesFile:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[BodyFrame]:
        return (self.body(i) for i in range(len(self)))

    def close(self) -> None:
        self._file.close()
        if self._held is not None:
            self._held.close()

    def nearest(self, time: float) -> int:
        """Index of the frame nearest to `time` [s]."""
        return int(np.argmin(np.abs(self.times - time)))

    def _rows(self, dataset: h5py.Dataset, start: int, count: int) -> np.ndarray:
        if not 0 <= start <= dataset.shape[0] - count:
            raise SceneError(f"is damaged: '{dataset.name}' ends before its last step")
        return dataset[start : start + count]

    def _changed(self, name: str, index: int) -> SceneError:
        return SceneError(f"is damaged: its '{name}' of step {self.steps[index]} are not what was written")

    def array(self, kind: str, name: str, index: int) -> np.ndarray:
        """One array at frame `index`; kind "PointData" or "CellData"."""
        with self._said():
            start = int(self._steps[f"{kind}Offsets"][name][index])
            found = self._rows(self._root[kind][name], start, self._points if kind == "PointData" else len(self.cells))
            if self._steps[f"{kind}Sums"][name][index] != _sum(found):
                raise self._changed(name, index)
        return found

    def body(self, index: int = -1) -> BodyFrame:
        """The body at frame `index` (negative counts from the end)."""
        index = range(len(self))[index]
        with self._said():
            points = self._rows(self._root["Points"], int(self._steps["PointOffsets"][index]), self._points)
            if self._steps["PointSums"][index] != _sum(np.array([self.times[index], self.steps[index]], dtype=np.float64), points):
                raise self._changed("points", index)
            return BodyFrame(
                name=self.name,
                points=points,
                cells=self.cells,
                point_data={n: self.array("PointData", n, index) for n in self._root["PointData"]},
                cell_data={n: self.array("CellData", n, index) for n in self._root["CellData"]},
                kind=self.kind,
            )
