"""A run ends when it knows how fast a tank leaks."""

import numpy as np
import pytest

from taichi_sph.output.histories import write_history
from taichi_sph.run.until import answered
from taichi_sph.scene import Cylinder, Fluid, LeakKnown, Numerics, Scene, Shell, ShellFill, material

UNITS = {"time": "s", "escaped_mass": "kg", "escaped_count": "-", "opening_area": "m2"}
ONE = 3e-3  # kg, of a particle


def tank(until=None, **changes):
    surface = Cylinder(radius=0.15, length=0.6, ends="discs")
    can = Shell(name="can", surface=surface, thickness=1e-3, material=material("steel, tank"), motion="free")
    said = {
        "name": "tank",
        "title": "a tank",
        "source": "tests",
        "shells": [can],
        "fluids": [Fluid(name="water", fill=ShellFill(shell="can"))],
        "duration": 0.02,
        "until": until,
        "numerics": Numerics(spacing=0.03),
    }
    return Scene(**(said | changes))


def after(folder, leaked, area=1e-3, end=8e-3):
    """What is said of a tank of which `leaked`(t) [kg] have left."""
    time = np.linspace(0.0, end, 320)
    count = np.floor(leaked(time) / ONE)
    columns = {"time": time, "escaped_mass": ONE * count, "escaped_count": count, "opening_area": np.full(len(time), area)}
    write_history(folder / "leak.csv", UNITS, columns)
    return answered(tank(LeakKnown(share=0.2, after=2e-3)), folder)


def test_it_ends_when_the_rate_is_known(tmp_path):
    assert "known within" in after(tmp_path, lambda t: 50.0 * t)
    assert after(tmp_path, lambda t: 0.5 * t) is None  # a particle in the last tenth, none in most of its quarters
    assert after(tmp_path, lambda t: 2e3 * np.maximum(t - 7.6e-3, 0.0)) is None  # it has just begun
    assert after(tmp_path, lambda t: 50.0 * t, end=1.9e-3) is None  # not yet after the blow


def test_it_ends_when_nothing_is_open(tmp_path):
    assert "nothing is open" in after(tmp_path, lambda t: 0.0 * t, area=0.0)
    assert after(tmp_path, lambda t: 0.0 * t) is None
    assert answered(tank(), tmp_path) is None


def test_it_is_refused_where_nothing_can_leak():
    with pytest.raises(ValueError, match="no fluid of the scene fills a shell, so none leaks"):
        tank(LeakKnown(), fluids=[])
    with pytest.raises(ValueError, match="until.fluid: no fluid 'watr' fills a shell; did you mean 'water'"):
        tank(LeakKnown(fluid="watr"))


def test_the_error_of_a_rate_is_that_of_its_quarters():
    from taichi_sph.output.measures.leak import rate_and_error

    time = np.linspace(0.0, 1.0, 401)
    rate, error = rate_and_error(time, 3.0 * time, 0.01)
    assert rate == pytest.approx(3.0) and error == pytest.approx(0.01 / 0.1, rel=0.03)  # one particle over the last tenth
