"""Measures of fluids on drawn runs: water whose pressure, front, jet and momentum are given."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph.errors import SceneError
from taichi_sph.frame import NO_CELLS, BodyFrame, Frame
from taichi_sph.output.folder import RunFolder
from taichi_sph.output.frames import FramesWriter
from taichi_sph.output.histories import write_history
from taichi_sph.output.measures import fluid, measure
from taichi_sph.scene import Fluid, FluidBox, Numerics, Pinball, Rigid, Scene, dump

D, G, RHO = 0.01, 9.81, 1000.0


def water(points: np.ndarray, velocity: np.ndarray | float = 0.0, pressure: np.ndarray | float = 0.0) -> BodyFrame:
    n = len(points)
    data = {
        "reference": points,
        "velocity": np.broadcast_to(velocity, (n, 3)).astype(float),
        "pressure": np.broadcast_to(pressure, n).astype(float),
        "density": np.full(n, RHO),
        "diameter": np.full(n, D),
        "outside": np.zeros(n, np.uint8),
    }
    return BodyFrame("water", points, NO_CELLS, data, {}, "fluid")


def run_of(folder, frames: list[tuple[float, BodyFrame]], **changes) -> RunFolder:
    scene = Scene(
        name="drawn", title="drawn", source="tests", duration=frames[-1][0], numerics=Numerics(spacing=D),
        **{"gravity": (0, 0, -G), "fluids": [Fluid(name="water", fill=FluidBox(lo=(0, 0, 0), hi=(1, 1, 1)))], **changes},
    )  # fmt: skip
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scene.json").write_text(dump(scene))
    writer = FramesWriter(folder / "frames")
    for k, (time, body) in enumerate(frames):
        writer.append(Frame(time, k, (body,)))
    return RunFolder(folder)


def grid(nx: int, ny: int, nz: int) -> np.ndarray:
    return D * (np.stack(np.meshgrid(*(np.arange(k) for k in (nx, ny, nz)), indexing="ij"), axis=-1).reshape(-1, 3) + 0.5)


def test_pressure_of_still_water(tmp_path):
    x = grid(3, 3, 20)
    p = 1.1 * RHO * G * (0.2 - x[:, 2])
    run = run_of(tmp_path, [(0.0, water(x)), (0.5, water(x, 0.03, 0.9 * p)), (1.0, water(x, 0.03, 1.1 * p))])
    assert measure("pressure_slope", run, {"start": 0.4}) == pytest.approx(1.1, rel=1e-6)
    assert measure("bottom_pressure", run, {"start": 0.4, "level": 0.2}) == pytest.approx(1.1, rel=1e-6)
    assert measure("bottom_pressure", run, {"start": 0.9, "level": 0.2}) == pytest.approx(1.21, rel=1e-6)
    assert measure("pressure_slope", run, {"start": 0.4, "skip": 9.2}) is None
    rest = 0.03 * np.sqrt(3 / (2 * G * 0.19))
    assert measure("restlessness", run, {"start": 0.4}) == pytest.approx(rest, rel=1e-5)
    assert measure("layer_pressure", run, {"axis": "z", "low": 0.0, "high": D, "start": 1.0, "end": 1.0}) == pytest.approx(
        1.1 * p.max(), rel=1e-6
    )
    assert measure("layer_pressure", run, {"axis": "z", "low": 2.0, "high": 3.0, "start": 0.0, "end": 1.0}) is None
    with pytest.raises(SceneError, match="option 'axis'"):
        measure("layer_pressure", run, {"axis": "w", "low": 0.0, "high": D, "start": 0.0, "end": 1.0})


def test_a_front_that_is_as_fast_but_earlier(tmp_path):
    """The front of Martin and Moyce, 0.2 of T early and so far ahead; with that delay there is nothing left."""
    a = 0.05
    scale = np.sqrt(2 * G / a)
    T = np.linspace(0, 3.0, 121)
    Z = np.interp(T + 0.2, *fluid.MARTIN_MOYCE.T)
    frames = [(t / scale, water(np.array([[0.0, 0, 0], [a * z - 0.5 * D, 0, 0]]))) for t, z in zip(T, Z)]
    run = run_of(tmp_path, frames)
    late = {"width": a, "start": 0.8}
    assert measure("surge_deviation", run, {**late, "delay": 0.2}) < 5e-3
    assert 0.05 < measure("surge_deviation", run, {**late, "delay": 0.0}) < 0.2
    assert measure("surge_delay", run, late) == pytest.approx(0.2, abs=5e-3)
    assert measure("surge_deviation", run, late) < 5e-3
    ahead = (np.interp(2.7, *fluid.MARTIN_MOYCE.T) - np.interp(1.7, *fluid.MARTIN_MOYCE.T)) / (
        np.interp(2.5, *fluid.MARTIN_MOYCE.T) - np.interp(1.5, *fluid.MARTIN_MOYCE.T)
    )
    assert measure("surge_speed", run, {"width": a, "start": 1.5, "end": 2.5}) == pytest.approx(ahead, rel=5e-3)


def test_outflow_and_jet(tmp_path):
    """A tank of 10 x 10 D loses 2 particles a frame; its jet has 0.9 of Torricelli's speed."""
    tank = grid(10, 10, 20)
    area, radius = 0.01, 0.02
    frames, rate = [], []
    for k in range(11):
        inside = tank[: len(tank) - 2 * k]
        s = 0.03
        head = len(inside) * D**3 / area
        rate.append(np.sqrt(2 * G * head))
        jet = np.tile([[0.001, 0, -s]], (2 * k, 1))
        v = np.concatenate([np.zeros((len(inside), 3)), np.tile([[0, 0, -0.9 * np.sqrt(2 * G * (head + s))]], (2 * k, 1))])
        frames.append((0.01 * k, water(np.concatenate([inside, jet]), v)))
    run = run_of(tmp_path, frames)
    hole = {"bottom": 0.0, "area": area, "radius": radius, "start": 0.0, "end": 0.1}
    assert measure("core_speed", run, hole) == pytest.approx(0.9, rel=1e-6)
    through = 20 * D**3 / (np.pi * radius**2 * np.trapezoid(rate, dx=0.01))
    assert measure("outflow", run, hole) == pytest.approx(through, rel=1e-5)


def test_momentum_of_block_and_water(tmp_path):
    x = grid(5, 5, 5)
    one = RHO * D**3
    block = Rigid(name="block", mass=0.5, pinballs=[Pinball(centre=(0, 0, 1), radius=0.05)], velocity=(0, 0, -2))
    v = [0.0, 0.5 / (125 * one)]  # the block loses 1 m/s, the water gets it, but for a tenth in the second run
    for name, share, drift in (("kept", 1.0, 0.0), ("lost", 0.9, 0.05)):
        run = run_of(tmp_path / name, [(0.0, water(x)), (1.0, water(x, np.array([0, 0, -share * v[1]])))], rigids=[block], gravity=None)
        units = {"time": "s"} | dict.fromkeys(("x", "y", "z"), "m") | dict.fromkeys(("vx", "vy", "vz"), "m/s")
        columns = {k: np.zeros(2) for k in units} | {"time": np.array([0.0, 1.0]), "vz": np.array([-2.0, -1.0])}
        write_history(run.path / "histories" / "rigid_block.csv", units, columns)
        assert measure("momentum_drift", run) == pytest.approx(drift, abs=1e-7)
        with pytest.raises(SceneError, match="needs the gravity"):
            measure("restlessness", run, {"start": 0.0})


def test_mean_and_period_of_a_history(tmp_path):
    run = run_of(tmp_path, [(0.0, water(grid(1, 1, 1))), (1.0, water(grid(1, 1, 1)))])
    t = np.linspace(0, 1, 501)
    write_history(run.path / "histories" / "h.csv", {"time": "s", "y": "m"}, {"time": t, "y": 3 + np.sin(2 * np.pi * (t - 0.03) / 0.2)})
    assert measure("history_period", run, {"history": "h", "column": "y"}) == pytest.approx(0.2, rel=1e-4)
    assert measure("history_mean", run, {"history": "h", "column": "y"}) == pytest.approx(3, abs=1e-4)
    assert measure("history_period", run, {"history": "h", "column": "y", "end": 0.1}) is None
    assert measure("history_mean", run, {"history": "h", "column": "y", "start": 2.0}) is None
