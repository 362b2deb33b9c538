"""Histories of loads and fields of velocity: their closed forms, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from taichi_sph.errors import SceneError
from taichi_sph.run.plan import plan
from taichi_sph.scene import (
    Friedlander,
    HalfSine,
    InitialVelocity,
    Pulse,
    Radial,
    Ramp,
    Rotation,
    Scene,
    Step,
    TimePulse,
    TimeTable,
    Triangle,
    checked,
)
from taichi_sph.scene.histories import factor, impulse

from .examples import spoiled


def at(history, *times):
    return [factor(history.points, time) for time in times]


def test_step_and_ramp_are_what_they_were():
    """To the last bit: t / rise, then 1."""
    assert at(Step(), 0, 1e9) == [1, 1]
    rise = 0.3e-3
    for time in np.linspace(0, 2 * rise, 1001):
        assert factor(Ramp(rise=rise).points, time) == (time / rise if time < rise else 1.0)


def test_pulses():
    pulse = TimePulse(rise=1, hold=2, fall=4, start=0.5)
    assert at(pulse, 0, 0.5, 1, 1.5, 2, 3.5, 5.5, 7.5, 99) == pytest.approx([0, 0, 0.5, 1, 1, 1, 0.5, 0, 0])
    assert impulse(pulse.points) == pytest.approx(0.5 + 2 + 2)
    assert at(TimePulse(hold=2, start=1), 0.999, 1, 2.999, 3, 9) == [0, 1, 1, 0, 0]  # a rectangle: jumps, the later value holds
    assert at(TimePulse(hold=2), 0, 1, 2) == [1, 1, 0]
    assert at(Triangle(rise=1, fall=3), 0, 0.5, 1, 2.5, 4, 5) == pytest.approx([0, 0.5, 1, 0.5, 0, 0])
    assert at(Triangle(fall=2), 0, 1, 2) == [1, 0.5, 0]


def test_smooth_ones():
    sine, blast = HalfSine(duration=2, start=1), Friedlander(positive=0.5, decay=1.7, arrival=0.2)
    t = np.linspace(0, 10, 4001)
    assert at(sine, *t) == pytest.approx(np.where((t > 1) & (t < 3), np.sin(np.pi * (t - 1) / 2), 0), abs=2e-5)
    assert impulse(sine.points) == pytest.approx(2 * 2 / math.pi, rel=2e-5)
    s = (t - 0.2) / 0.5
    assert at(blast, *t) == pytest.approx(np.where(s >= 0, (1 - s) * np.exp(-1.7 * s), 0), abs=2e-4)
    assert factor(blast.points, 0.2) == 1 and factor(blast.points, 0.1999) == 0
    ended = Friedlander(positive=0.5, decay=1.7, suction=False)
    assert impulse(ended.points) == pytest.approx(0.5 * (1 / 1.7 - (1 - math.exp(-1.7)) / 1.7**2), rel=1e-4)
    assert at(ended, 0.5, 0.6) == [0, 0]


MILLISECONDS = st.integers(-1000, 1000).map(lambda n: n / 1000)


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])  # a busy machine is no fault of the tables
@given(
    points=st.lists(st.tuples(MILLISECONDS, st.integers(-50, 50)), min_size=1, max_size=20, unique_by=lambda p: p[0]), time=st.floats(-2, 2)
)
def test_tables(points, time):
    points = sorted(points)
    table = TimeTable(points=points)
    assert factor(table.points, time) == pytest.approx(np.interp(time, *zip(*points)), abs=1e-9)


def test_fields_of_velocity():
    points = np.array([[1.0, 0, 0], [0, 2, 0], [0, 0, 3], [1, 1, 1]])
    out = InitialVelocity(radial=Radial(speed=2)).at(points)
    assert out == pytest.approx(2 * points / np.linalg.norm(points, axis=1)[:, None])
    round_z = InitialVelocity(radial=Radial(speed=2, axis=(0, 0, 5), centre=(0, 0, 7))).at(points)
    assert round_z == pytest.approx(np.array([[2, 0, 0], [0, 2, 0], [0, 0, 0], [math.sqrt(2), math.sqrt(2), 0]]))
    turning = InitialVelocity(velocity=(1, 0, 0), rotation=Rotation(axis=(0, 0, 2), rate=3, centre=(0, 1, 0))).at(points)
    assert turning == pytest.approx(np.array([[4, 3, 0], [-2, 0, 0], [4, 0, 0], [1, 3, 0]]))
    hump = InitialVelocity(radial=Radial(speed=1), pulse=Pulse(centre=1, width=2)).at(points)
    assert np.linalg.norm(hump, axis=1) == pytest.approx(np.exp(-(((points[:, 0] - 1) / 2) ** 2)))


INITIAL = {"where": "box"}


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("forces.0.history", {"kind": "table", "points": [[0, 1], [0, 2]]}, "points[1]: its time 0 s is not after 0 s"),
        ("forces.0.history", {"kind": "table", "points": []}, "at least 1 needed"),
        ("forces.0.history", {"kind": "table", "points": [["1 mm", 1]]}, "is not a time"),
        ("forces.0.history", {"kind": "pulse"}, "rise, hold and fall are all 0"),
        ("forces.0.history", {"kind": "pulse", "hold": "-1 s"}, "must be at least 0 s"),
        ("forces.0.history", {"kind": "triangle"}, "fall is missing"),
        ("forces.0.history", {"kind": "friedlander", "positive": "1 ms", "decay": 0}, "must be greater than 0"),
        ("forces.0.history", {"kind": "sine"}, "did you mean 'half_sine'?"),
        ("initial", [INITIAL], "velocity is missing: give it, or radial or rotation"),
        ("initial", [INITIAL | {"radial": {"speed": 1}}], "initial[0].radial.axis must be (0, 0, 1)"),
        ("initial", [INITIAL | {"rotation": {"axis": [1, 0, 0], "rate": 1}}], "initial[0].rotation.axis must be (0, 0, 1)"),
        ("initial", [INITIAL | {"rotation": {"axis": [0, 0, 0], "rate": 1}}], "axis is (0, 0, 0), which is no direction"),
        ("initial", [INITIAL | {"rotation": {"axis": [0, 0, 1], "rate": "3 m/s"}}], "is not an angular speed"),
        ("initial", [INITIAL | {"velocity": [0, 0, 1]}], "initial[0].velocity: z must be 0"),
    ],
)  # fmt: skip
def test_refusals(key, value, said):
    with pytest.raises(SceneError) as error:
        checked(Scene, lambda: Scene(**spoiled(key, value)))
    assert said in str(error.value) and "\n" not in str(error.value)


def test_pressure_on_nothing():
    data = spoiled("shells.0.motion", "free")
    data["pressures"] = [{"value": "1 kPa", "where": {"kind": "ball", "centre": [1, 1, 1], "radius": 0.01}}]
    with pytest.raises(SceneError, match=r"pressures\[0\].where catches no cell of shell 'plate', whose nodes are 2 mm apart"):
        plan(checked(Scene, lambda: Scene(**data)))
