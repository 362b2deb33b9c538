"""The reduced model of a driven column of water against closed forms."""

import math

import numpy as np
import pytest

from taichi_sph.output.measures.column import frequency, model

RIG = {"falling": 245.0, "mass": 3.0, "stiffness": 2.7e8, "radius": 0.04, "height": 0.18, "slug": 0.025, "sound": 1401.0}
AREA = math.pi * 0.04**2


def test_a_closed_column_stops_the_mass():
    """Hardly a hole: a mass on two springs in a row, stem and column; the largest force is V sqrt(k M)."""
    found = model(**RIG, speed=5.0, hole=2e-4, contraction=0.65, duration=6e-3, gravity=0.0)
    column = 1000 * 1401.0**2 * AREA / 0.18
    k = 1 / (1 / 2.7e8 + 1 / column)
    # swings of the piston stand on top: the mean over one of them
    each = np.convolve(found["pressure"], np.ones(1000) / 1000, "valid")
    assert each.max() * AREA == pytest.approx(5.0 * math.sqrt(k * 245.0), rel=0.06)


@pytest.mark.parametrize("contraction", [0.65, 0.75])
def test_late_pressure_is_that_of_the_jet(contraction):
    """p = 1/2 rho (V A / a C)^2 once the flow is established, the jet V A / a C."""
    found = model(**RIG, speed=5.0, hole=0.01, contraction=contraction, duration=9e-3)
    late = found["time"] > 3e-3
    jet = found["speed"][late].mean() * 16.0 / contraction
    assert found["jet"][late].mean() == pytest.approx(jet, rel=0.03)
    assert found["pressure"][late].mean() == pytest.approx(500 * jet**2, rel=0.07)


def test_frequency_of_the_piston_on_its_stem():
    """1600 Hz, measured for both holes (T table 5.2), within a tenth; of a sine under a trend, exactly."""
    found = model(**RIG, speed=5.0, hole=0.01, contraction=0.65, duration=8e-3)
    late = found["time"] > 1e-3
    assert frequency(found["time"][late], found["pressure"][late], 300.0, 6000.0) == pytest.approx(1600, rel=0.1)
    t = np.linspace(0, 8e-3, 900)
    assert frequency(t, 4e6 * np.exp(-t / 4e-3) + 1e6 * np.sin(2 * np.pi * 1300 * t), 300.0, 6000.0) == pytest.approx(1300, rel=0.01)
    assert frequency(t[:10], t[:10], 300.0, 6000.0) is None
