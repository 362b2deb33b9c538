"""What water streams past: where its surface lies, what it does not meet, and the measures of an entry against closed forms."""

from types import SimpleNamespace

import numpy as np
import pytest

from taichi_sph.bodies.rigid.surface import surface
from taichi_sph.frame import NO_CELLS, BodyFrame
from taichi_sph.output.histories import History
from taichi_sph.output.measures import entry
from taichi_sph.scene import Fluid, FluidBox, Numerics, Pinball, Rigid, Scene
from taichi_sph.world.world import World

D, R, MASS = 7.4e-3, 9e-3, 0.031  # m, m, kg


def shot(streamed: bool, spacing: float = D) -> Scene:
    return Scene(
        name="shot",
        title="a sphere into water",
        source="tests",
        rigids=[
            Rigid(name="ball", mass=MASS, pinballs=[Pinball(centre=(R + 1e-4, 0, 0), radius=R)], velocity=(-730, 0, 0), streamed=streamed)
        ],
        fluids=[Fluid(name="water", fill=FluidBox(lo=(-6 * D, -4 * D, -4 * D), hi=(0, 4 * D, 4 * D)), alpha=0.02, delta=0.0)],
        duration=1e-4,
        numerics=Numerics(spacing=spacing, time_step_safety=0.75),
    )


def test_the_surface_lies_half_a_spacing_inside() -> None:
    for streamed, radius in ((False, R), (True, R - 0.5 * D)):
        x, a = surface(shot(streamed).rigids[0], 0.45 * D)
        np.testing.assert_allclose(np.linalg.norm(x, axis=1), radius, rtol=1e-12)
        assert np.linalg.norm(a, axis=1).sum() == pytest.approx(4 * np.pi * radius**2)


def test_a_body_that_would_vanish_is_refused() -> None:
    with pytest.raises(ValueError, match=r"rigids\[0\].streamed: a pinball of 9 mm is no larger than half the spacing of 'water', 9.5 mm"):
        shot(True, 19e-3)


def test_no_pinballs_stand_behind_the_pressure() -> None:
    """There is no contact at all; momentum passes by pressure alone and none is lost."""
    sim = World(shot(True))
    assert sim.contact is None
    sim.advance(40)
    from taichi_sph import runtime

    p, ball = sim.fluid.p, runtime.get(sim.rigids.v, 1)[0]
    water = p.one * runtime.get(p.v, p.n).astype(float).sum(axis=0)
    assert water[0] < -0.1 * MASS * 730  # the water has taken some
    np.testing.assert_allclose(MASS * ball + water, [-MASS * 730, 0, 0], atol=1e-9 * MASS * 730)


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
    history = SimpleNamespace(path=SimpleNamespace(stem="rigid_ball"))
    history = History(history.path, columns, {})
    return SimpleNamespace(
        path="run", histories=lambda: ["rigid_ball"], history=lambda name: history, the=lambda kind, name: file, scene=shot(True)
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
