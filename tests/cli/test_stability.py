"""The map of stability: bisection, what is recorded, and what holds."""

from __future__ import annotations

import json
import math

import pytest

from taichi_sph.errors import SceneError
from taichi_sph.verification import stability


def below(limit):
    return lambda value: "" if value < limit else f"{value:.3g} is too much"


@pytest.mark.parametrize("inside, outside, limit", [(0.9, 4.0, 1.234), (50.0, 2e4, 5400.0), (0.0, 1.0, 0.37)])
def test_the_edge_is_found(inside, outside, limit):
    found, why = stability.edge(below(limit), inside, outside, 0.01)
    assert found < limit and found == pytest.approx(limit, rel=0.011) and why.endswith("is too much")


def test_towards_less_and_below_zero():
    found, _ = stability.edge(lambda v: "" if v > 0.7 else "no", 1.2, 0.4, 0.01)
    assert 0.7 < found < 0.71
    found, _ = stability.edge(lambda v: "" if v > -0.93 else "no", 0.0, -1.1, 0.01)
    assert -0.93 < found < -0.92


def test_no_edge_and_nothing_to_bisect():
    assert stability.edge(lambda v: "", 1.0, 10.0, 0.1) == (None, "")
    with pytest.raises(SceneError, match="nothing to bisect: 1 does not hold, never"):
        stability.edge(lambda v: "never", 1.0, 10.0, 0.1)


def test_the_command_records_and_keeps_other_knobs(call, work, monkeypatch):
    def knob(high):
        def ranges():
            yield "a case", None, high, (None, 1.0), "it breaks; likely an unstable step"

        return ranges

    monkeypatch.setattr(stability, "KNOBS", {"one": knob(1.5), "other": knob(None)})
    code, out, err = call("stability", "--record")
    assert (code, err) == (0, "") and "one" in out and "it breaks" in out and "likely" not in out
    monkeypatch.setattr(stability, "KNOBS", {"one": knob(2.5), "other": knob(9.0)})
    assert call("stability", "--only", "one", "--record")[0] == 0
    found = json.loads((work / "benchmarks/stability.json").read_text())
    assert [(r["knob"], r["high"], r["predicted"]) for r in found["ranges"]] == [
        ("one", 2.5, [None, 1.0]),
        ("other", None, [None, 1.0]),
    ]
    assert found["machine"] and found["seconds"] >= 0
    code, _, err = call("stability", "--only", "othr")
    assert code == 2 and "--only othr: there is no such knob; did you mean 'other'" in err


@pytest.mark.long
def test_what_holds_and_what_does_not():
    measured, predicted = stability.limit(stability.sheet("triangle", 0.25, limit=stability.StepLimit()))
    assert measured / predicted == pytest.approx(1, abs=2e-3)
    assert stability.by_spectrum(stability.sheet()) == ""
    few = stability._past_checks(stability.sheet("quad", 0.25), numerics__formulation__support=0.6)
    assert stability.by_spectrum(few)
    assert stability.by_run(stability.pulled(3e-5, 50e-6), whole=True) == ""
    assert stability.by_run(stability.pulled(3e-5, 100e-6, 1.5), whole=True)
    assert math.isclose(stability.SOUND, 5439, rel_tol=1e-3)
