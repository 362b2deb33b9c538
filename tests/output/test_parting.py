"""A flap that is turned, a rim that is cut through direction by direction, and a crack from a tip, all drawn; and a disc with slits."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from taichi_sph.errors import SceneError
from taichi_sph.frame import BodyFrame, Frame
from taichi_sph.geometry.surfaces import mesh_of
from taichi_sph.output.folder import RunFolder
from taichi_sph.output.frames import FramesWriter
from taichi_sph.output.measures import measure
from taichi_sph.output.measures.fragments import live, ruptured
from taichi_sph.render.plan import plan
from taichi_sph.scene import Material, Net, Numerics, Scene, Shell, dump

sys.path.insert(0, str(Path(__file__).parents[2] / "scenes"))
from _slit_disc import above, disc, parted

RADIUS, FLAP, D = 0.04, 0.01, 2e-3
U = [((-FLAP, -FLAP), (-FLAP, FLAP)), ((-FLAP, FLAP), (FLAP, FLAP)), ((-FLAP, -FLAP), (FLAP, -FLAP))]
TURN = 0.6  # rad
TURNED, CUT, CRACK = 2e-3, 1e-3, 0.012  # s, s: when half of the rim is cut; m


def flap(low=(None, None)) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (N, 3) and cells of a disc with three sides of a flap cut."""
    points, cells = parted(*above(*disc(RADIUS, FLAP, D), low), U)
    return np.column_stack([points, 0 * points[:, 0]]), cells


def on_flap(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """(N,) bool: nodes of cells of the flap."""
    centre = np.abs(points[np.where(cells < 0, cells[:, :1], cells)].mean(axis=1))
    found = np.zeros(len(points), bool)
    found[np.unique(cells[(centre[:, :2] < FLAP).all(axis=1)])] = True
    return found


def moved(points: np.ndarray, cells: np.ndarray, angle: float) -> np.ndarray:
    """The flap turned downwards about its hinge, x = FLAP."""
    x, own = points.copy(), on_flap(points, cells)
    arm = FLAP - points[own, 0]
    x[own, 0], x[own, 2] = FLAP - arm * np.cos(angle), -arm * np.sin(angle)
    return x


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> RunFolder:
    """The flap turns with time; the rim is cut on the right at CUT, nearly all of it at 2 CUT; a crack runs along x from (FLAP, FLAP)."""
    folder = tmp_path_factory.mktemp("flap")
    points, cells = flap()
    centre = points[cells].mean(axis=1)
    away = np.hypot(*centre.T[:2])
    rim = away > RADIUS - D
    rupture = np.full(len(cells), np.nan)
    rupture[rim] = np.where(centre[rim, 0] > 0, CUT, 2 * CUT)
    rupture[rim & (centre[:, 0] < 0) & (np.abs(centre[:, 1]) < 0.4 * RADIUS)] = np.nan
    crack = (centre[:, 0] > FLAP) & (centre[:, 0] < FLAP + CRACK) & (np.abs(centre[:, 1] - FLAP - 0.5 * D) < 0.5 * D)
    rupture[crack] = 3 * CUT
    steel = Material(name="steel", young=210e9, poisson=0.3, density=7800)
    net = Net(points=points, cells=cells, merge=False)
    shell = Shell(name="plate", surface=net, thickness=1e-3, material=steel, motion="free")
    scene = Scene(name="s", title="t", source="tests", shells=[shell], duration=4e-3, numerics=Numerics(spacing=D))
    (folder / "scene.json").write_text(dump(scene))
    writer = FramesWriter(folder / "frames")
    for k, time in enumerate((0.0, TURNED, 2 * TURNED)):
        broken = (rupture <= time).astype(np.uint8)
        data = {"broken": broken, "rupture_time": np.where(broken > 0, rupture, np.nan), "damage": broken.astype(float)}
        body = BodyFrame("plate", moved(points, cells, 0.5 * k * TURN), cells, {"reference": points, "velocity": 0 * points}, data)
        writer.append(Frame(time, k, (body,)))
    return RunFolder(folder)


def test_a_flap_has_turned(run: RunFolder) -> None:
    flap_of = {"x": -0.4 * FLAP, "y": 0.0, "radius": 0.5 * FLAP}
    assert measure("turn_angle", run, flap_of) == pytest.approx(np.degrees(TURN), abs=0.1)
    assert measure("turn_angle", run, flap_of | {"time": TURNED}) == pytest.approx(0.5 * np.degrees(TURN), abs=0.1)
    assert measure("turn_angle", run, flap_of | {"axis": "x"}) == pytest.approx(0.0, abs=0.1)
    assert measure("turn_angle", run, {"x": 2.5 * FLAP, "y": 0.0, "radius": 2 * D}) == pytest.approx(0.0, abs=0.1)
    assert measure("turn_angle", run, flap_of | {"x": 1.0}) is None
    assert measure("turn_angle", run, flap_of | {"axis": "z"}) is None  # flat at first: its normal is the axis
    assert measure("turn_angle", run, flap_of | {"axis": "z", "time": 0.0}) is None
    with pytest.raises(SceneError, match="option 'axis' of measure '.*' is 'x', 'y' or 'z', not 'w'"):
        measure("turn_angle", run, flap_of | {"axis": "w"})


def test_a_rim_is_cut_through(run: RunFolder) -> None:
    """All of it but an arc of 2 asin(0.4) on the left."""
    rim = {"radius": RADIUS}
    left = 2 * np.arcsin(0.4 * RADIUS / (RADIUS - 0.5 * D)) / (2 * np.pi)
    assert measure("rim_severed", run, rim) == pytest.approx(1 - left, abs=0.02)
    assert measure("rim_severed_at", run, rim | {"share": 0.49}) == pytest.approx(CUT)
    assert measure("rim_severed_at", run, rim | {"share": 0.8}) == pytest.approx(2 * CUT)
    assert measure("rim_severed_at", run, rim) is None
    assert measure("rim_severed", run, rim | {"radius": RADIUS - 4 * D, "width": D}) == pytest.approx(0.0, abs=0.05)
    with pytest.raises(SceneError, match="above 0 and at most 1, not 1.5"):
        measure("rim_severed_at", run, rim | {"share": 1.5})
    for width in (0.0, -1e-3):
        with pytest.raises(SceneError, match=f"option 'width' is above 0 m, not {width:g}"):
            measure("rim_severed", run, rim | {"width": width})
    with pytest.raises(SceneError, match="no cell at the rim of radius 0.1 m"):
        measure("rim_severed", run, {"radius": 0.1})


def test_a_crack_from_a_tip(run: RunFolder) -> None:
    assert measure("tip_crack_length", run, {"x": FLAP, "y": FLAP}) == pytest.approx(CRACK, abs=1.5 * D)
    assert measure("tip_crack_length", run, {"x": -FLAP, "y": FLAP}) == 0.0


@pytest.mark.parametrize("low, twins, hinge", [((None, None), 29, 11), ((None, 0.0), 15, 6)], ids=["whole", "half"])
def test_slits_of_a_flap(low, twins, hinge) -> None:
    """Nodes on the cut are two, but for the tips at the hinge; the flap hangs on its hinge alone; no area is lost."""
    points, cells = flap(low)
    places = np.unique(points.round(9), axis=0)
    assert len(points) - len(places) == twins
    own = on_flap(points, cells)
    shared = own & np.isin(np.arange(len(points)), np.unique(cells[~own[cells].all(axis=1)]))
    assert np.allclose(points[shared, 0], FLAP) and shared.sum() == hinge
    body = Shell(
        name="p", surface=Net(points=points, cells=cells, merge=False), thickness=1e-3, motion="free",
        material=Material(name="m", young=1e9, poisson=0.3, density=1000),
    )  # fmt: skip
    mesh = mesh_of(body, Scene(name="s", title="t", source="t", shells=[body], duration=1e-3, numerics=Numerics(spacing=D)))
    sides = 96  # of the rim
    part = 1.0 if low[1] is None else 0.5
    assert mesh.areas.sum() == pytest.approx(part * 0.5 * sides * np.sin(2 * np.pi / sides) * RADIUS**2, rel=1e-9)
    assert 0.25 * D**2 < mesh.areas.min() and mesh.areas.max() < 3 * D**2


def test_slits_that_cross() -> None:
    """Where two slits cross a node is four, in the quarter two: the ends of two petals."""
    tip = 0.015 / np.sqrt(2)
    lines = [((-tip, -tip), (tip, tip)), ((-tip, tip), (tip, -tip))]
    for low, copies, twins in (((None, None), 4, 4 * (round(tip / D) - 1)), ((0.0, 0.0), 2, round(tip / D) - 1)):
        points, cells = parted(*above(*disc(RADIUS, tip, D, diagonals=True), low), lines)
        places, times = np.unique(points.round(9), axis=0, return_counts=True)
        middle = (np.abs(places) < 1e-9).all(axis=1)
        assert times[middle] == [copies]
        assert times[~middle].max() == 2 and (times[~middle] == 2).sum() == twins


def test_the_plan_shows_slits_and_what_broke(run: RunFolder, tmp_path: Path) -> None:
    """Cells that broke and sides of slits, each in its own collection; nothing is drawn of a plate that is whole and has no slit."""
    figure = plan(run)
    assert figure is not None
    above, beside = figure.axes[:2]
    whole, broken, slits = above.collections
    last = run.frames("plate").body(-1)
    assert len(broken.get_paths()) == ruptured(last).sum() and len(whole.get_paths()) == live(last).sum()
    assert len(slits.get_segments()) == 2 * 3 * round(2 * FLAP / D)
    lowest = min(path.vertices[:, 1].min() for path in beside.collections[0].get_paths())
    assert lowest == pytest.approx(-1e3 * 2 * FLAP * np.sin(TURN), rel=1e-6)
    (tmp_path / "scene.json").write_text(dump(run.scene))
    flat, cells = disc(RADIUS, FLAP, D)
    points, none = np.column_stack([flat, 0 * flat[:, 0]]), np.zeros(len(cells))
    data = {"broken": none.astype(np.uint8), "rupture_time": none + np.nan, "damage": none}
    body = BodyFrame("plate", points, cells, {"reference": points, "velocity": 0 * points}, data)
    FramesWriter(tmp_path / "frames").append(Frame(0.0, 0, (body,)))
    assert plan(RunFolder(tmp_path)) is None
