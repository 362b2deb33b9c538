"""What is said and drawn of strain gauges: what they read, and that a gauge whose cells broke reads nothing any more."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from taichi_sph.output.answer import answer
from taichi_sph.output.folder import RunFolder
from taichi_sph.output.histories import write_history
from taichi_sph.scene import Output, StrainGauge

from . import synthetic

UNITS = {"time": "s", "strain": "-", "membrane": "-", "bending": "-"}
BROKE = 30  # number of the first sample without a cell


@pytest.fixture
def run(tmp_path: Path) -> RunFolder:
    """Three gauges: one whole, one that breaks, one that was broken from the start."""
    gauges = tuple(StrainGauge(name=name, point=(0.05, 0.02, 0), along=(1, 0, 0)) for name in ("whole", "torn", "gone"))
    found = synthetic.write_run(tmp_path / "run", scene=synthetic.plate_scene(output=Output(gauges=gauges)))
    time = np.linspace(0, 6e-5, 41)
    strain = np.interp(time, [0.0, 3e-5, 6e-5], [0.0, 0.02, 0.01])
    torn = np.where(np.arange(41) < BROKE, -2 * strain, np.nan)
    for name, read in (("whole", strain), ("torn", torn), ("gone", np.full(41, np.nan))):
        write_history(
            found.path / f"histories/gauge_{name}.csv", UNITS, {"time": time, "strain": read, "membrane": read, "bending": 0 * read}
        )
    return found


def test_the_answer_says_what_gauges_read_and_when_they_broke(run: RunFolder) -> None:
    lines = [line for line in answer(run) if line.startswith("Gauge")]
    assert lines[0] == "Gauge 'whole' read at most +2 % (at 30 us) and reads +1 % at the end."
    assert lines[1] == "Gauge 'torn' read at most -4 % (at 30 us); the last of its cells had broken at 45 us, and it reads nothing since."
    assert lines[2] == "Gauge 'gone' read nothing: its cells were broken from the first sample on."


def test_a_broken_gauge_is_crossed_out(run: RunFolder) -> None:
    plots = pytest.importorskip("taichi_sph.render.plots")
    figure = plots.gauges(run)
    axes = figure.axes[0]
    crosses = [line.get_xydata() for line in axes.lines if line.get_marker() == "x"]
    assert len(crosses) == 1
    assert crosses[0][0] == pytest.approx(
        [1e6 * 1.5e-6 * (BROKE - 1), -200 * np.interp(1.5e-6 * (BROKE - 1), [0.0, 3e-5, 6e-5], [0.0, 0.02, 0.01])]
    )
    assert {text.get_text() for text in axes.texts} == {"whole", "torn (broke)"}
    plots.plt.close(figure)
