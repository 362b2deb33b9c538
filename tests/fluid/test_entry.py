"""The measures of an entry into water against closed forms."""

from types import SimpleNamespace

import numpy as np
import pytest

from taichi_sph.frame import NO_CELLS, BodyFrame
from taichi_sph.output.histories import History
from taichi_sph.output.measures import entry
from taichi_sph.scene import Fluid, FluidBox, Numerics, Pinball, Rigid, Scene

D, R, MASS = 7.4e-3, 9e-3, 0.031  # m, m, kg


def flight(c_d: float) -> SimpleNamespace:
    """A run in which a sphere slows down by a constant drag coefficient, and water stands around a cavity of 20 mm at the end."""
    k = c_d * 1000.0 * np.pi * R**2 / (2 * MASS)
    t = np.linspace(0, 3e-4, 200)
    s, v, zero = np.log1p(k * 730 * t) / k, 730 / (1 + k * 730 * t), np.zeros(200)
    columns = {"time": t, "x": -s, "y": zero, "z": zero, "vx": -v, "vy": zero, "vz": zero}
    side = D * (np.arange(-9, 10) + 0.5)
    points = np.stack(np.meshgrid(side, side, side, indexing="ij"), axis=-1).reshape(-1, 3)
    points = points[np.hypot(points[:, 1], points[:, 2]) > 0.02 + 0.5 * D]
    frame = BodyFrame("water", points, NO_CELLS, {"reference": points, "diameter": np.full(len(points), D)}, {}, kind="fluid")
    file = SimpleNamespace(name="water", body=lambda i: frame, array=lambda *_: frame.point_data["diameter"])
    history = History(SimpleNamespace(stem="rigid_ball"), columns, {})
    scene = Scene(
        name="shot",
        title="a sphere into water",
        source="tests",
        rigids=[Rigid(name="ball", mass=MASS, pinballs=[Pinball(centre=(R + 1e-4, 0, 0), radius=R)], velocity=(-730, 0, 0))],
        fluids=[Fluid(name="water", fill=FluidBox(lo=(-0.1, -0.1, -0.1), hi=(0, 0.1, 0.1)))],
        duration=3e-4,
        numerics=Numerics(spacing=D),
    )
    return SimpleNamespace(
        path="run", histories=lambda: ["rigid_ball"], history=lambda name: history, the=lambda kind, name: file, scene=scene
    )


def test_drag_of_a_constant_coefficient() -> None:
    run = flight(0.35)
    found = entry.drag_coefficient(run, run.scene, radius=R, start=0.03, end=0.12)
    assert found == pytest.approx(0.35, rel=1e-9)
    assert entry.drag_coefficient(run, run.scene, radius=R, start=5.0) is None


def test_radius_of_a_cavity() -> None:
    run = flight(0.35)
    assert entry.cavity_radius(run, run.scene, depth=0.03, within=D) == pytest.approx(0.02, abs=0.5 * D)
    assert entry.cavity_radius(run, run.scene, depth=1.0, within=D) is None
