"""Measures against cracks that were drawn, so the answers are known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from taichi_sph.errors import SceneError
from taichi_sph.frame import BodyFrame, Frame
from taichi_sph.output.folder import RunFolder
from taichi_sph.output.frames import FramesWriter
from taichi_sph.output.histories import write_history
from taichi_sph.output.measures import MEASURES, check_quantities, cracks, measure
from taichi_sph.output.measures.pattern import cell_centres, pattern
from taichi_sph.output.measures.waves import rayleigh_speed
from taichi_sph.scene import Cut, Output, Plate, Probe, Quantity, Scene, StrainGauge, dump

from .synthetic import ANGLE, BIFURCATION, LENGTH, SPEED, TIP, WIDTH, branched, frame_at, grid, plate_scene, write_run

CUT = (Cut(start=(0, TIP[1], 0), end=(*TIP, 0)),)
SPACING = 5e-4


@pytest.fixture(scope="module", params=[False, True], ids=["quads", "triangles"])
def two(request, tmp_path_factory) -> RunFolder:
    return write_run(tmp_path_factory.mktemp("two"), count=2, triangles=request.param)


@pytest.fixture(scope="module")
def one(tmp_path_factory) -> RunFolder:
    return write_run(tmp_path_factory.mktemp("one"), count=2, branches=1)


def test_two_branches(two: RunFolder) -> None:
    assert measure("branch_count", two) == 2
    assert measure("branch_count", two, {"station": 0.01}) == 1
    assert measure("branch_count", two, {"station": 0.04}) == 2
    assert measure("edge_arrival", two) == pytest.approx(5e-6 + (LENGTH - TIP[0] - 1.5 * SPACING) / SPEED, abs=0.4e-6)
    assert measure("tip_speed_plateau", two) == pytest.approx(SPEED / np.cos(ANGLE), rel=0.01)  # along the branch
    # branches thinner than two spacings apart are one
    assert measure("bifurcation_length", two) == pytest.approx(BIFURCATION - TIP[0], abs=8 * SPACING)
    assert measure("bifurcation_time", two) == pytest.approx(2.5e-5, abs=4e-6)
    assert measure("crack_start", two) == pytest.approx(5e-6, abs=1e-6)
    assert measure("crack_length", two) == pytest.approx(np.hypot(0.05, 0.03 * np.tan(ANGLE)), abs=2 * SPACING)


def test_mirror_image_of_quads_is_exact(tmp_path: Path) -> None:
    assert measure("asymmetry", write_run(tmp_path, count=2)) == 0


def test_one_crack(one: RunFolder) -> None:
    assert measure("branch_count", one) == 1
    assert measure("bifurcation_time", one) is None
    assert measure("tip_speed_plateau", one) == pytest.approx(SPEED, rel=1e-3)
    assert measure("tip_speed_max", one) == pytest.approx(SPEED, rel=1e-2)
    assert measure("crack_angle", one) == pytest.approx(90, abs=0.1)


def test_no_crack(tmp_path: Path) -> None:
    run = write_run(tmp_path, count=1)
    assert measure("branch_count", run) == 0 and measure("crack_count", run) == 0 and measure("crack_length", run) == 0
    for name in ("edge_arrival", "tip_speed_plateau", "asymmetry", "bifurcation_time", "crack_angle", "crack_width"):
        assert measure(name, run) is None, name


def test_isolated_broken_cells_change_nothing() -> None:
    body, rupture = branched()
    clean = pattern(frame_at(body, rupture, 1e-4, 1).bodies[0], CUT)
    stray = rupture.copy()
    centre = cell_centres(body.points, body.cells)
    away = np.abs(centre[:, 1] - TIP[1]) > 0.018
    stray[np.flatnonzero(away & np.isnan(rupture))[::97]] = 1e-6
    p = pattern(frame_at(body, stray, 1e-4, 1).bodies[0], CUT)
    assert len(p.along) > len(clean.along) and p.crack.sum() == clean.crack.sum()
    assert cracks.count_branches(p) == 2
    assert cracks.tip_history(p).plateau == cracks.tip_history(clean).plateau


def test_cells_that_break_ahead_do_not_move_the_tip() -> None:
    """A cell near the edge that breaks early belongs to the crack only from the time the crack reaches it."""
    body, rupture = branched(branches=1)
    early = rupture.copy()
    centre = cell_centres(body.points, body.cells)
    early[(centre[:, 0] > 0.097) & ~np.isnan(rupture)] = 1e-6
    p = pattern(frame_at(body, early, 1e-4, 1).bodies[0], CUT)
    assert cracks.passing_time(p, 0.0485) == pytest.approx(5e-6 + 0.047 / SPEED, abs=1e-6)


@pytest.mark.parametrize("side", [1, -1])
def test_a_crack_that_kinks_is_followed_along_itself(side: int) -> None:
    """Straight to the place where others split, then square to the cut: the same speed throughout, and the edge it meets is reached."""
    body, _ = branched(branches=1)
    centre = cell_centres(body.points, body.cells)
    x, y = centre[:, 0], side * (centre[:, 1] - TIP[1])
    reach = 0.75 * SPACING
    straight = (x > TIP[0]) & (x <= BIFURCATION + reach) & (np.abs(y) < reach)
    up = (np.abs(x - BIFURCATION) < reach) & (y > 0)
    rupture = np.where(straight, 5e-6 + (x - TIP[0]) / SPEED, np.where(up, 5e-6 + (BIFURCATION - TIP[0] + y) / SPEED, np.nan))
    p = pattern(frame_at(body, rupture, 1e-4, 1).bodies[0], CUT)
    assert p.turned
    tip = cracks.tip_history(p)
    assert tip.plateau == pytest.approx(SPEED, rel=0.03)
    assert np.median(tip.speed[len(tip.speed) * 3 // 4 :]) == pytest.approx(SPEED, rel=0.03)  # beyond the kink
    assert tip.time[-1] == pytest.approx(np.nanmax(rupture), abs=1e-7)
    last = (p.high if side > 0 else -p.low) - 1.501 * SPACING
    assert cracks.arrival_time(p) == pytest.approx(5e-6 + (BIFURCATION - TIP[0] + last) / SPEED, abs=0.4e-6)
    assert p.way[p.crack].max() == pytest.approx(BIFURCATION - TIP[0] + y[up].max(), rel=0.05)


def test_asymmetry_is_the_share_without_partner() -> None:
    body, rupture = branched()
    centre = cell_centres(body.points, body.cells)
    lower = rupture.copy()
    lower[(centre[:, 1] < TIP[1] - 2 * SPACING) & ~np.isnan(rupture)] = np.nan
    run = _Memory(frame_at(body, lower, 1e-4, 1).bodies[0])
    alone = np.count_nonzero(~np.isnan(lower) & (centre[:, 1] > TIP[1] + 2 * SPACING))
    expected = alone / np.count_nonzero(~np.isnan(lower))
    assert cracks.asymmetry(run, plate_scene()) == pytest.approx(expected, abs=0.03)


def test_cells_broken_by_the_cut_are_no_crack() -> None:
    body, rupture = branched()
    frame = frame_at(body, rupture, 1e-4, 1).bodies[0]
    clean = pattern(frame, CUT)
    centre = cell_centres(body.points, body.cells)
    on_cut = (np.abs(centre[:, 1] - TIP[1]) < SPACING) & (centre[:, 0] < TIP[0])
    frame.cell_data["broken"][on_cut] = 1
    for time in (0.0, np.nan):
        frame.cell_data["rupture_time"][on_cut] = time
        p = pattern(frame, CUT)
        assert p.crack.sum() == clean.crack.sum() and p.linked.min() == clean.linked.min()


class _Memory:
    """A run folder with one frame, not on disk."""

    def __init__(self, body: BodyFrame) -> None:
        self._body, self.name = body, body.name

    def the(self, kind: str, body: str | None = None) -> _Memory:
        return self

    def body(self, index: int) -> BodyFrame:
        return replace(self._body, cell_data=dict(self._body.cell_data))


HEIGHT, SPAN, NOTCH = 0.0762, 0.2032, 0.01905  # the beam of B3


def beam(tmp_path: Path, notch: float, paths: list[tuple[float, float, float]], thick: float = 0.0012) -> RunFolder:
    """A beam with straight cracks (x at the bottom [m], height where it begins, angle [deg])."""
    d = 1.5e-3
    nx, ny = round(SPAN / d) + 1, round(HEIGHT / d) + 1
    x, y = np.meshgrid(np.arange(nx) * d, np.arange(ny) * d)
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    corner = (np.arange(ny - 1)[:, None] * nx + np.arange(nx - 1)).ravel()
    cells = np.column_stack([corner, corner + 1, corner + nx + 1, corner + nx]).astype(np.int32)
    centre = cell_centres(points, cells)
    rupture = np.full(len(cells), np.nan)
    for start, bottom, angle in paths:
        at = start + (centre[:, 1] - bottom) / np.tan(np.radians(angle))
        broken = (centre[:, 1] > bottom) & (np.abs(centre[:, 0] - at) < thick)
        rupture[broken] = 4e-4 + (centre[broken, 1] - bottom) / 200
    base = plate_scene()
    shell = base.shells[0].model_copy(
        update={"surface": Plate(length=SPAN, width=HEIGHT), "cuts": (Cut(start=(notch, 0, 0), end=(notch, NOTCH, 0)),)}
    )
    scene: Scene = base.model_copy(update={"shells": (shell,), "quantities": ()})
    (tmp_path / "scene.json").write_text(dump(scene))
    cell_data = {
        "damage": np.where(np.isnan(rupture), 0.2, 1.0),
        "broken": (~np.isnan(rupture)).astype(np.uint8),
        "rupture_time": rupture,
    }
    body = BodyFrame("plate", points, cells, {"reference": points, "velocity": 0 * points}, cell_data)
    FramesWriter(tmp_path / "frames").append(Frame(1e-3, 10, (body,)))
    return RunFolder(tmp_path)


@pytest.mark.parametrize("notch, angle", [(2 * 0.0254, 60.0), (2 * 0.0254, 65.0), (6 * 0.0254, 120.0), (4 * 0.0254, 90.0)])
def test_angle_of_the_crack_to_the_horizontal(tmp_path: Path, notch: float, angle: float) -> None:
    run = beam(tmp_path, notch, [(notch, NOTCH, angle)])
    expected = 180 - angle if angle > 90 else angle  # leaning towards the middle, from either side
    assert measure("crack_angle", run) == pytest.approx(expected, abs=1.5)
    assert measure("crack_count", run) == 1


def test_crack_leaning_away_from_the_load(tmp_path: Path) -> None:
    notch = 2 * 0.0254
    run = beam(tmp_path, notch, [(notch, NOTCH, 70)])
    assert measure("crack_angle", run, {"load_x": 0.01}) == pytest.approx(110, abs=1.5)


def test_four_patterns(tmp_path: Path) -> None:
    centre = SPAN / 2
    for name, notch, paths, count in (
        ("both", 15 / 16 * 0.0254, [(15 / 16 * 0.0254, NOTCH, 65), (centre, 0, 90)], 2),
        ("centre", 0.5 * 0.0254, [(centre, 0, 90)], 1),
        ("stump", 2 * 0.0254, [(2 * 0.0254, NOTCH, 60)], 1),
    ):
        (tmp_path / name).mkdir()
        assert measure("crack_count", beam(tmp_path / name, notch, paths)) == count, name


def test_crack_that_stops_low_does_not_count(tmp_path: Path) -> None:
    run = beam(tmp_path, 0.0127, [(0.0127, NOTCH, 90), (SPAN / 2, 0, 90)])
    with_both = measure("crack_count", run)
    file = run.frames()
    body = file.body()
    low = (cell_centres(body.reference, body.cells)[:, 0] < 0.05) & (cell_centres(body.reference, body.cells)[:, 1] > 0.03)
    body.cell_data["broken"][low] = 0
    assert with_both == 2
    assert len(cracks.through_cracks(pattern(body, run.scene.shells[0].cuts))) == 1


@pytest.mark.parametrize("cells_wide", [1, 3, 5])
def test_width_at_mid_height(tmp_path: Path, cells_wide: int) -> None:
    d = 1.5e-3
    at = (round(0.0508 / d) + 0.5) * d
    run = beam(tmp_path, at, [(at, NOTCH, 90)], thick=(cells_wide - 0.5) * d / 2 + 1e-6)
    assert measure("crack_width", run) == pytest.approx(cells_wide * d)
    assert measure("crack_width", run, {"damage": 0.1}) == pytest.approx(round(SPAN / d) * d)


def test_pulse_and_histories(tmp_path: Path) -> None:
    run = write_run(tmp_path, count=2, spacing=0.002)
    writer = FramesWriter(tmp_path / "frames")
    points, cells = grid(0.002)
    for step, time in enumerate(np.linspace(0, 6e-5, 61)):
        velocity = np.zeros_like(points)
        velocity[:, 0] = -2.0 * np.cos(2 * np.pi * time / 6e-5) * np.exp(-(((points[:, 0] - 0.05) / 0.01) ** 2))
        body = BodyFrame("plate", points, cells, {"reference": points, "velocity": velocity}, {})
        writer.append(Frame(time, step, (body,)))
    run.close()
    assert measure("pulse_return", run, {"time": 3e-5}) == pytest.approx(-1, abs=0.01)
    assert measure("pulse_return", run, {"time": 6e-5, "width": 0.004}) == pytest.approx(1, abs=0.01)
    assert measure("pulse_return", run, {"time": 7e-5}) is None
    write_history(tmp_path / "histories/p.csv", {"time": "s", "v": "m/s"}, {"time": np.arange(5.0), "v": np.arange(5.0) ** 2})
    assert measure("history_value", run, {"history": "p", "column": "v", "time": 1.5}) == 2.5
    assert measure("history_value", run, {"history": "p", "column": "v", "time": 9.0}) is None
    assert measure("history_peak", run, {"history": "p", "column": "v", "end": 3.0}) == 9


def test_rayleigh_speed_of_the_thesis() -> None:
    assert rayleigh_speed(plate_scene().shells[0].material) == pytest.approx(2100, rel=0.005)


@pytest.mark.parametrize(
    "quantity, sentence",
    [
        (Quantity(name="branch_cuont"), "did you mean 'branch_count'"),
        (Quantity(name="edge_arrival", unit="ms"), "measured in 's'"),
        (Quantity(name="branch_count", options={"stations": 0.1}), "did you mean 'station'"),
        (Quantity(name="branch_count", options={"station": "here"}), "is a number"),
        (Quantity(name="branch_count", options={"body": 3}), "is a text"),
        (Quantity(name="history_value", options={"history": "x"}), "needs the option 'column'"),
        (Quantity(name="displacement", unit="m", options={"x": 0, "y": 0, "axis": "w"}), "is 'x', 'y' or 'z', not 'w'"),
        (Quantity(name="crack_length", unit="m", options={"how": "longst"}), "not 'longst'; did you mean 'longest'"),
        (Quantity(name="crack_length", unit="m", options={"cut": 1}), "'cut' = 1 is outside 0 to 0"),
        (Quantity(name="hole_diameter", unit="m", options={"hole": 0}), "'hole' = 0 is no whole number from 1 on"),
        (Quantity(name="face_frequency", unit="Hz", options={"face": "top", "start": 0}), "no rigid body 'top' with faces"),
        (Quantity(name="history_mean", options={"history": "energies", "column": "x", "start": 2, "end": 1}), "'end' = 1 is not after"),
        (Quantity(name="history_peak", options={"history": "probe_end", "column": "u_w"}), "no column 'u_w'; did you mean 'u_.'"),
        (
            Quantity(name="history_peak", options={"history": "probe_edn", "column": "u_x"}),
            "no history 'probe_edn'; did you mean 'probe_end'",
        ),
        (Quantity(name="history_peak", options={"history": "gauge_root", "column": "strian"}), "did you mean 'strain'"),
    ],
)
def test_wrong_quantities_are_refused(quantity: Quantity, sentence: str) -> None:
    kept = Output(probes=[Probe(name="end", point=(0, 0, 0))], gauges=[StrainGauge(name="root", point=(0, 0, 0), along=(1, 0, 0))])
    scene = plate_scene(output=kept)
    with pytest.raises(SceneError, match=sentence):
        check_quantities(scene.model_copy(update={"quantities": (quantity,)}))


def test_columns_that_are_checked_before_are_those_that_are_written() -> None:
    from taichi_sph.bodies.rigid.group import RigidGroup
    from taichi_sph.bodies.shell.gauge import Gauge
    from taichi_sph.observers.leak import UNITS
    from taichi_sph.output.measures import GAUGE, LEAK, RIGID

    for named, written in ((GAUGE, Gauge.units), (LEAK, UNITS), (RIGID, RigidGroup.track_units)):
        assert named == ("time", *written)


def test_every_measure_says_what_it_measures() -> None:
    check_quantities(plate_scene())
    for name, (function, _) in MEASURES.items():
        assert function.__doc__, name
    assert WIDTH > 0
