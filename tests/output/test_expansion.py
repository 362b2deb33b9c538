"""Measures of a tube that is driven outward, on frames that are made by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from taichi_sph.errors import SceneError
from taichi_sph.frame import BodyFrame
from taichi_sph.output.measures.expansion import cone_angle, expansion_speed, expansion_speed_max

RADIUS, HEIGHT, THICKNESS = 0.024, 0.2, 0.003  # m
AROUND, ALONG = 24, 41


def tube(radius) -> np.ndarray:
    """(N, 3) nodes of a tube whose radius at z is radius(z)."""
    angle = np.tile(2 * np.pi * np.arange(AROUND) / AROUND, ALONG)
    z = np.repeat(np.linspace(0, HEIGHT, ALONG), AROUND)
    return np.column_stack([radius(z) * np.cos(angle), radius(z) * np.sin(angle), z])


def frame(radius, speed: float, time: float) -> BodyFrame:
    k, j = np.meshgrid(np.arange(ALONG - 1), np.arange(AROUND), indexing="ij")
    one, two = (k * AROUND + j).ravel(), (k * AROUND + (j + 1) % AROUND).ravel()
    cells = np.column_stack([one, two, two + AROUND, one + AROUND]).astype(np.int32)
    points, start = tube(radius), tube(lambda z: np.full_like(z, RADIUS))
    out = points * [1, 1, 0] / np.linalg.norm(points[:, :2], axis=1)[:, None]
    return BodyFrame("tube", points, cells, {"reference": start, "velocity": speed * out})


def run_of(frames: list[BodyFrame], times: list[float]) -> SimpleNamespace:
    class Frames(list):
        times: np.ndarray

        def body(self, k: int) -> BodyFrame:
            return self[k]

    held = Frames(frames)
    held.times = np.array(times)
    return SimpleNamespace(frames=lambda name: held)


SCENE = SimpleNamespace(shells=[SimpleNamespace(name="tube", thickness=THICKNESS)])


def test_the_speed_at_a_ratio_is_that_of_the_inner_wall():
    # the wall thins as it grows: r_in = r - e R / 2 r
    radii = [RADIUS, 1.5 * RADIUS, 2.5 * RADIUS]
    frames = [frame(lambda z, r=r: np.full_like(z, r), v, 0.0) for r, v in zip(radii, (0.0, 1000.0, 1400.0))]
    run = run_of(frames, [0.0, 1e-5, 2e-5])
    inner = [(r - 0.5 * THICKNESS * RADIUS / r) / (RADIUS - 0.5 * THICKNESS) for r in radii]
    assert expansion_speed(run, SCENE, along=0.1, ratio=inner[2]) == pytest.approx(1400, rel=1e-6)
    assert expansion_speed(run, SCENE, along=0.1, ratio=0.5 * (inner[1] + inner[2])) == pytest.approx(1200, rel=1e-6)
    assert expansion_speed(run, SCENE, along=0.1, ratio=4.0) is None
    assert expansion_speed_max(run, SCENE, along=0.1) == pytest.approx(1400)


def test_the_angle_of_a_cone():
    def cone(z):
        return RADIUS + np.tan(np.radians(11.0)) * np.maximum(0.15 - z, 0.0)

    still, moved = frame(lambda z: np.full_like(z, RADIUS), 0.0, 0.0), frame(cone, 1500.0, 2e-5)
    run = run_of([still, moved], [0.0, 2e-5])
    assert cone_angle(run, SCENE, time=1.9e-5) == pytest.approx(11.0, abs=1e-6)
    assert cone_angle(run, SCENE, time=0.0) is None
    ring = frame(lambda z: RADIUS + 1e-3 * (z == 0.0), 100.0, 1e-6)  # one ring alone has no angle
    assert cone_angle(run_of([ring], [1e-6]), SCENE, time=1e-6) is None


def test_a_place_outside_of_the_tube_is_told():
    run = run_of([frame(lambda z: np.full_like(z, RADIUS), 0.0, 0.0)], [0.0])
    with pytest.raises(SceneError, match="tube 'tube' has no node near along = 1 m"):
        expansion_speed_max(run, SCENE, along=1.0)
