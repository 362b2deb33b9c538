"""Measures and answers of a run with two shells, two fluids and two strikers: each names its body, or gets a sentence."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph.errors import SceneError
from taichi_sph.output.answer import answer, in_words
from taichi_sph.output.folder import RunFolder
from taichi_sph.output.measures import MEASURES, measure
from taichi_sph.output.measures.fragments import blow

from . import struck


@pytest.fixture(scope="module")
def two(tmp_path_factory) -> RunFolder:
    return struck.write_two_tanks(tmp_path_factory.mktemp("two"))


NEEDS = {
    "body": {
        "crack_length": {"how": "longest"},
        "fragments_count": {},
        "hole_diameter": {},
        "displacement": {"x": 0.0, "y": 0.0},
        "peak_pressure": {},
    },
    "fluid": {"leak_rate": {}, "leaked_litres": {}, "jet_speed": {}, "restlessness": {"start": 0.0}},
    "striker": {"striker_speed": {}, "peak_force": {}},
}


@pytest.mark.parametrize(("option", "name"), [(option, name) for option, names in NEEDS.items() for name in names])
def test_a_measure_of_one_of_several_asks_for_its_name(two, option, name) -> None:
    with pytest.raises(SceneError, match=r"name (one of|the fluid of one)") as caught:
        measure(name, two, NEEDS[option][name])
    names = {"striker": "ball_left, ball_right", "fluid": "water_left, water_right", "body": "left, right"}[option]
    assert (names if name != "peak_pressure" else "water_left, water_right") in str(caught.value)


def test_each_is_measured_by_its_name(two) -> None:
    for side, litres in struck.LEAKS.items():
        assert measure("leak_rate", two, {"fluid": f"water_{side}"}) == pytest.approx(litres, rel=0.01)
        assert measure("striker_speed", two, {"striker": f"ball_{side}"}) == pytest.approx(struck.WATER_EXIT, rel=1e-3)
        assert measure("crack_length", two, {"how": "longest", "body": side}) == pytest.approx(struck.CRACK, abs=0.05)
        assert measure("peak_pressure", two, {"body": f"water_{side}"}) > 1e7
    with pytest.raises(SceneError, match="body 'left' is a shell, and a fluid is needed: water_left, water_right"):
        measure("peak_pressure", two, {"body": "left"})
    with pytest.raises(SceneError, match="no history of a leak of 'water_lft'; did you mean 'water_left'"):
        measure("leak_rate", two, {"fluid": "water_lft"})


def test_each_body_is_struck_by_the_ball_whose_path_meets_it(two) -> None:
    for side, y in struck.SIDES.items():
        place, direction = blow(two, two.frames(side).body(-1))
        np.testing.assert_allclose(place, [-struck.TANK, y, 0], atol=0.02)
        np.testing.assert_allclose(direction, [1, 0, 0], atol=1e-9)


def test_the_answer_tells_of_each(two) -> None:
    lines = answer(two)
    for side in struck.SIDES:
        assert any(line.startswith(f"The {side} ruptured at") for line in lines)
        assert any(line.startswith(f"The ball {side} ends at") for line in lines)
    assert any(line.startswith("Water left leaks 3.1 l/s (± ") for line in lines)
    assert any(line.startswith("Water right leaks 6.2 l/s (± ") for line in lines)


def test_a_quantity_of_a_body_in_words() -> None:
    assert in_words("leak_rate(fluid=water_left)") == "leak rate of water left"


def test_every_measure_of_a_body_has_an_option_for_its_name() -> None:
    import inspect

    of_all = {"momentum_drift", "relaxation_residual", "limit_load", "step_ratio", "frequency_ratio", "time_to_rupture"}
    for name, (function, _) in MEASURES.items():
        options = set(inspect.signature(function).parameters) & {"body", "face", "fluid", "striker", "history"}
        assert options or name in of_all, name
