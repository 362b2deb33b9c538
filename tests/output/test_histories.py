from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from taichi_sph.errors import SceneError
from taichi_sph.output.histories import HistoryWriter, read_history, write_history

UNITS = {"time": "s", "kinetic": "J", "B": "%", "broken": ""}


def fill(path: Path, times: np.ndarray, **options: object) -> None:
    with HistoryWriter(path, UNITS, **options) as writer:
        for t in times:
            writer.append({"time": t, "kinetic": np.sin(t), "B": t / 3, "broken": int(t)})


def test_round_trip_is_exact(tmp_path: Path) -> None:
    times = np.linspace(0, 7, 23)
    fill(tmp_path / "energies.csv", times)
    assert (tmp_path / "energies.csv").read_text().splitlines()[0] == "time [s],kinetic [J],B [%],broken [-]"
    history = read_history(tmp_path / "energies.csv")
    np.testing.assert_array_equal(history.time, times)
    np.testing.assert_array_equal(history["kinetic"], np.sin(times))
    assert history.units == {**UNITS, "broken": "-"}
    with pytest.raises(SceneError, match="did you mean 'kinetic'"):
        history["kinetik"]


def test_resume_goes_on_where_the_checkpoint_was(tmp_path: Path) -> None:
    times = np.linspace(0, 7, 23)
    fill(tmp_path / "whole.csv", times)
    fill(tmp_path / "cut.csv", times[:15])
    with (tmp_path / "cut.csv").open("a") as file:
        file.write("3.1,0.")  # killed while writing
    fill(tmp_path / "cut.csv", times[11:], resume_at=times[10])
    assert (tmp_path / "cut.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()


def test_unfinished_row_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("time [s],v [m/s]\n0,1\n1,2\n2,")
    assert read_history(tmp_path / "x.csv")["v"].tolist() == [1, 2]


def test_nan_and_whole_histories(tmp_path: Path) -> None:
    write_history(tmp_path / "x.csv", {"time": "s", "v": "m/s"}, {"time": np.arange(3.0), "v": np.array([1, np.nan, 2])})
    np.testing.assert_array_equal(read_history(tmp_path / "x.csv")["v"], [1, np.nan, 2])


@pytest.mark.parametrize(
    "text, sentence",
    [("", "no header"), ("time,v\n0,1\n", "no unit"), ("time [s],v [m]\n0,1\n0\n", "line 3"), ("time [s]\nx\n", "line 2")],
)
def test_bad_files(tmp_path: Path, text: str, sentence: str) -> None:
    (tmp_path / "x.csv").write_text(text)
    with pytest.raises(SceneError, match=sentence):
        read_history(tmp_path / "x.csv")


def test_wrong_columns(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="there is no history"):
        read_history(tmp_path / "none.csv")
    fill(tmp_path / "x.csv", np.arange(2.0))
    with pytest.raises(SceneError, match="other columns"):
        HistoryWriter(tmp_path / "x.csv", {"time": "s", "v": "m"}, resume_at=1.0)
    with HistoryWriter(tmp_path / "y.csv", UNITS) as writer, pytest.raises(ValueError, match="has columns"):
        writer.append({"time": 0.0})
