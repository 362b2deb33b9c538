"""Frames: what is written is what VTK and our own reader get back, step by step."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from taichi_sph.errors import SceneError
from taichi_sph.output.frames import FramesFile, FramesWriter

from .synthetic import frames


@pytest.fixture(scope="module")
def series():
    return frames(5, spacing=0.002)


@pytest.mark.parametrize("triangles", [False, True])
def test_pyvista_reads_the_time_series(tmp_path: Path, triangles: bool) -> None:
    import pyvista
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline

    written = frames(4, spacing=0.002, triangles=triangles)
    writer = FramesWriter(tmp_path)
    for frame in written:
        paths = writer.append(frame)
    reader = pyvista.get_reader(paths[0])
    reader.reader.UpdateInformation()
    key = vtkStreamingDemandDrivenPipeline.TIME_STEPS()
    assert list(reader.reader.GetOutputInformation(0).Get(key)) == [f.time for f in written]  # what ParaView plays
    for index, frame in enumerate(written):
        reader.reader.SetStep(index)
        grid, body = reader.read(), frame.bodies[0]
        assert reader.reader.GetTimeValue() == frame.time
        assert set(grid.celltypes) == ({5} if triangles else {9})
        np.testing.assert_array_equal(grid.points, body.points)
        np.testing.assert_array_equal(grid.cells_dict[grid.celltypes[0]], body.cells[body.cells >= 0].reshape(len(body.cells), -1))
        np.testing.assert_array_equal(grid.point_data["reference"], body.point_data["reference"])
        for name in ("damage", "broken", "rupture_time"):
            np.testing.assert_array_equal(grid.cell_data[name], body.cell_data[name].astype(grid.cell_data[name].dtype))
        assert int(grid.field_data["step"][0]) == frame.step


def test_own_reader(tmp_path: Path, series) -> None:
    writer = FramesWriter(tmp_path)
    for frame in series:
        writer.append(frame)
    with FramesFile(tmp_path / "plate.vtkhdf") as file:
        assert len(file) == len(series)
        np.testing.assert_array_equal(file.steps, [f.step for f in series])
        for frame, body in zip(series, file, strict=True):
            np.testing.assert_array_equal(body.points, frame.bodies[0].points)
            np.testing.assert_array_equal(body.cells, frame.bodies[0].cells)
            np.testing.assert_allclose(body.cell_data["rupture_time"], frame.bodies[0].cell_data["rupture_time"], rtol=1e-7)
        assert file.nearest(series[2].time * 1.01) == 2
        np.testing.assert_array_equal(file.body(-1).points, series[-1].bodies[0].points)


def test_resume_drops_later_frames(tmp_path: Path, series) -> None:
    whole, cut = FramesWriter(tmp_path / "whole"), FramesWriter(tmp_path / "cut")
    for frame in series:
        whole.append(frame)
        cut.append(frame)
    resumed = FramesWriter(tmp_path / "cut", resume_at=series[2].time)
    for frame in series[2:]:  # the frame of the checkpoint itself is not doubled
        resumed.append(frame)
    with FramesFile(tmp_path / "whole/plate.vtkhdf") as a, FramesFile(tmp_path / "cut/plate.vtkhdf") as b:
        np.testing.assert_array_equal(a.times, b.times)
        for x, y in zip(a, b, strict=True):
            np.testing.assert_array_equal(x.points, y.points)
            for name in x.cell_data:
                np.testing.assert_array_equal(x.cell_data[name], y.cell_data[name])


def test_static_arrays_are_stored_once(tmp_path: Path, series) -> None:
    import h5py

    writer = FramesWriter(tmp_path)
    for frame in series:
        path = writer.append(frame)[0]
    with h5py.File(path) as file:
        assert len(file["VTKHDF/PointData/reference"]) == len(series[0].bodies[0].points)
        assert len(file["VTKHDF/Connectivity"]) == series[0].bodies[0].cells.size


def test_unreadable_file_is_put_aside_on_resume(tmp_path: Path, series) -> None:
    (tmp_path / "plate.vtkhdf").write_bytes(b"\x89HDF\r\n\x1a\n" + b"0" * 100)
    writer = FramesWriter(tmp_path, resume_at=1.0)
    assert [p.name for p in writer.aside] == ["plate.unreadable"]
    writer.append(series[0])
    assert len(FramesFile(tmp_path / "plate.vtkhdf")) == 1


def test_foreign_file_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "x.vtkhdf").write_text("hello")
    with pytest.raises(SceneError, match="not a frames file"):
        FramesFile(tmp_path / "x.vtkhdf")
    with pytest.raises(SceneError, match="there is no frames file"):
        FramesFile(tmp_path / "y.vtkhdf")


@pytest.mark.skipif(os.name == "nt", reason="SIGKILL")
def test_killed_run_leaves_a_readable_file(tmp_path: Path) -> None:
    code = (
        "import itertools, sys\n"
        "from dataclasses import replace\n"
        "from tests.output.synthetic import frames\n"
        "from taichi_sph.output.frames import FramesWriter\n"
        "frame = frames(2, spacing=0.001)[1]\n"
        f"writer = FramesWriter({str(tmp_path)!r})\n"
        "for i in itertools.count():\n"
        "    writer.append(replace(frame, time=i * 1e-6, step=i))\n"
        "    if i == 0: print('up', flush=True)\n"
    )
    for delay in (0.05, 0.13, 0.21):
        process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, cwd=Path(__file__).parents[2])
        assert process.stdout is not None and process.stdout.readline() == b"up\n"
        time.sleep(delay)
        process.send_signal(signal.SIGKILL)
        process.communicate()
        with FramesFile(tmp_path / "plate.vtkhdf") as file:
            assert len(file) >= 1
            for body in file:
                assert np.isfinite(body.points).all()
