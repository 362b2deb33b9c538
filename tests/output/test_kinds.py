"""Frames of rigid bodies and fluids: what is written is what VTK and our own reader get back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from taichi_sph.output.folder import RunFolder
from taichi_sph.output.frames import FramesFile, FramesWriter

from . import struck


@pytest.fixture(scope="module")
def full(tmp_path_factory) -> RunFolder:
    return struck.write_tank(tmp_path_factory.mktemp("full"), True, 0.015, 0.03, 4)


def test_bodies_of_all_kinds_come_back(full) -> None:
    assert full.bodies() == ["tank", "water", "ball"]
    assert {k: [f.name for f in full.of_kind(k)] for k in ("shell", "rigid", "fluid")} == {
        "shell": ["tank"],
        "rigid": ["ball"],
        "fluid": ["water"],
    }
    X = struck.lattice(0.03)
    for index, body in enumerate(full.frames("water")):
        expected = struck.water(float(full.frames().times[index]), X, 0.03, 2.1e-3)
        assert body.kind == "fluid" and body.cells.shape == (0, 4)
        np.testing.assert_array_equal(body.points, expected.points)
        assert set(body.point_data) == set(expected.point_data)
        for name, values in expected.point_data.items():
            np.testing.assert_allclose(body.point_data[name], values, rtol=1e-6, atol=1e-6 * np.abs(values).max())
    assert full.frames("ball").body(-1).kind == "rigid"
    np.testing.assert_allclose(full.frames("ball").body(-1).point_data["radius"], struck.SHOT, rtol=1e-6)


@pytest.mark.parametrize("name", ["ball", "water"])
def test_vtk_plays_points_as_vertices(full, name: str) -> None:
    """The reader that ParaView uses."""
    import pyvista
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline

    file = full.frames(name)
    reader = pyvista.get_reader(file.path)
    reader.reader.UpdateInformation()
    times = reader.reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    np.testing.assert_array_equal(times, file.times)
    for index, body in enumerate(file):
        reader.reader.SetStep(index)
        grid = reader.read()
        assert set(grid.celltypes) == {1} and grid.n_cells == len(body.points)
        np.testing.assert_array_equal(grid.points, body.points)
        for key, values in body.point_data.items():
            np.testing.assert_array_equal(grid.point_data[key], values)


def test_what_does_not_change_is_stored_once(full) -> None:
    with h5py.File(full.path / "frames/ball.vtkhdf", locking=False) as file:
        assert len(file["VTKHDF/PointData/radius"]) == 2
        assert len(file["VTKHDF/PointData/velocity"]) == 2 * 4


def test_resume_drops_later_frames_of_points_too(tmp_path: Path, full) -> None:
    body = full.frames("water").body(0)
    writer = FramesWriter(tmp_path)
    for i in range(5):
        writer.append(struck.Frame(i * 1e-5, i, (replace(body, points=body.points + i),)))
    resumed = FramesWriter(tmp_path, resume_at=2e-5)
    resumed.append(struck.Frame(3e-5, 3, (replace(body, points=body.points - 3),)))
    with FramesFile(tmp_path / "water.vtkhdf") as file:
        assert file.kind == "fluid"
        np.testing.assert_allclose(file.times, [0, 1e-5, 2e-5, 3e-5])
        np.testing.assert_array_equal(file.body(-1).points, body.points - 3)
        np.testing.assert_array_equal(file.body(1).points, body.points + 1)


def test_a_body_keeps_its_number_of_points(tmp_path: Path, full) -> None:
    body = full.frames("ball").body(0)
    writer = FramesWriter(tmp_path)
    writer.append(struck.Frame(0.0, 0, (body,)))
    fewer = replace(body, points=body.points[:1], point_data={k: v[:1] for k, v in body.point_data.items()})
    with pytest.raises(ValueError, match="1 points after 2"):
        writer.append(struck.Frame(1e-5, 1, (fewer,)))
