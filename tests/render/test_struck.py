"""Pictures of runs with strikers and water: both renderers, windows, sections, size of the movie."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from taichi_sph.frame import NO_CELLS, BodyFrame
from taichi_sph.output.folder import RunFolder
from taichi_sph.output.frames import FramesFile
from taichi_sph.render import backend, panel, pictures, plots, section, struck
from taichi_sph.render.sheet import Shot, length_text, sheet

from ..output import struck as drawn

HAVE_VTK = backend.choose().name == "vtk"
BOTH = ["matplotlib", pytest.param("vtk", marks=pytest.mark.skipif(not HAVE_VTK, reason="VTK cannot draw here"))]


@pytest.fixture
def renderer(request, monkeypatch: pytest.MonkeyPatch) -> str:
    chosen = backend.Backend(request.param)
    monkeypatch.setattr(pictures, "choose", lambda: chosen)
    return request.param


@pytest.fixture(scope="module")
def runs(tmp_path_factory) -> dict[str, RunFolder]:
    there = tmp_path_factory.mktemp("struck")
    return {
        "plate": drawn.write_plate(there / "plate", 1e-3, count=4),
        "empty": drawn.write_tank(there / "empty", False, 0.02, count=4),
        "full": drawn.write_tank(there / "full", True, 0.02, 0.03, 4),
        "dam": drawn.write_dam(there / "dam", 0.05, 4),
        "pond": drawn.write_pond(there / "pond"),
        "two": drawn.write_two_tanks(there / "two"),
    }


@pytest.mark.parametrize("renderer", BOTH, indirect=True)
@pytest.mark.parametrize(
    "name, expected",
    [
        ("plate", ["impact.png", "impact_over_time.png", "strikers.png", "plan.png", "energies.png"]),
        ("full", ["impact.png", "impact_over_time.png", "strikers.png", "leak.png", "energies.png"]),
        (
            "two",
            ["impact.png", "impact_over_time.png", "strikers.png", *(f"leak_water_{side}.png" for side in drawn.SIDES), "energies.png"],
        ),
        ("dam", ["pressure_over_time.png", "speed_over_time.png", "energies.png"]),
        ("pond", ["pressure_over_time.png", "speed_over_time.png", "energies.png"]),
    ],
)
def test_a_run_gets_all_its_pictures(runs, renderer: str, name: str, expected: list[str]) -> None:
    paths = pictures.render_run(runs[name].path)
    assert [p.name for p in paths] == expected
    for path in paths:
        with Image.open(path) as image:
            assert image.width > 800
            pixels = np.asarray(image.convert("RGB"))
        assert (pixels[:3, :3] == 255).all(), "white paper"
        assert len(np.unique(pixels[::9, ::9].reshape(-1, 3), axis=0)) > 20, "something is on it"


def test_the_page_holds_all_the_water_and_colours_what_tells_something(runs, monkeypatch) -> None:
    pages = []
    monkeypatch.setattr(struck, "sheet", lambda rows, *_: pages.append(rows))
    run = runs["pond"]
    struck.free_strip(run, struck.looks_of([run]), "pressure", backend.Backend("matplotlib"), [-1], "", 100)
    shot = pages[0][0][0]
    water = next(b for b in shot.bodies if b.kind == "fluid")
    seen, radius = shot.view.seen(water.points), 0.5 * water.point_data["diameter"][0]
    inside = [(low + radius <= seen[:, k]) & (seen[:, k] <= high - radius)
              for k, (low, high) in enumerate([(shot.view.x0, shot.view.x1), (shot.view.y0, shot.view.y1)])]  # fmt: skip
    assert np.mean(inside[0] & inside[1]) > 0.98
    assert [look.field for look in shot.looks] == ["pressure"]  # the plate is elastic: it has no colours


def test_colour_bars_find_room_beside_flat_bodies() -> None:
    look = [panel.Look("damage", f"D{k} [-]", panel.DAMAGE, 0.0, 1.0, 1.0) for k in range(3)]
    flat = panel.View(0.0, 1.0, 0.0, 0.02)
    none = np.zeros(0)
    nothing = BodyFrame("shell", np.zeros((0, 3)), NO_CELLS, {"reference": np.zeros((0, 3))}, {"damage": none, "broken": none}, "shell")
    row = [Shot([nothing], flat, "flat", one) for one in look]
    figure = sheet([row], "flat", "", backend.Backend("matplotlib"))
    bars = [a for a in figure.axes if a.get_title(loc="left").startswith("D")]
    assert len(bars) == 3 and all(a.get_position().height * figure.get_figheight() > 0.85 for a in bars)


@pytest.mark.parametrize("renderer", BOTH, indirect=True)
def test_the_movie_is_small(runs, renderer: str, monkeypatch: pytest.MonkeyPatch) -> None:
    (path,) = pictures.render_run(runs["dam"].path, movie=True)
    large = os.path.getsize(path)
    with Image.open(path) as image:
        assert image.n_frames == 4
        wide = image.width
    monkeypatch.setattr(pictures, "MOVIE_BYTES", 0.6 * large)
    (path,) = pictures.render_run(runs["dam"].path, movie=True)
    assert os.path.getsize(path) <= 0.6 * large
    with Image.open(path) as image:
        assert image.n_frames == 4 and image.width < wide


@pytest.mark.parametrize("renderer", ["matplotlib"], indirect=True)
def test_empty_and_full_side_by_side(runs, renderer: str, tmp_path: Path) -> None:
    path = pictures.render_compare([runs["empty"].path, runs["full"].path], tmp_path / "both.png")
    with Image.open(path) as image:
        assert image.width > image.height


def test_sides_follow_the_flight(runs) -> None:
    """The front view looks along the flight, the back view against it; up stays up."""
    for name, direction in (("plate", [0, 0, -1]), ("full", [1, 0, 0])):
        s = struck.sides(runs[name])
        np.testing.assert_allclose(s.direction, direction, atol=1e-12)
        assert s.front[2] @ s.direction < -0.5 < 0.5 < s.back[2] @ s.direction
        assert s.section[2] @ s.removed > 0.7 and abs(s.removed @ s.direction) < 1e-12
        for turn in (s.front, s.back, s.section):
            np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
            assert turn[1] @ panel.UPRIGHT > 0.3


def test_a_section_takes_away_one_half_and_leaves_the_spray(runs) -> None:
    run = runs["full"]
    s, bodies = struck.sides(run), struck.bodies_at(run, -1)
    tank, field, drops, ball = struck.cut_open(bodies, struck.middles(run), s.removed)
    whole = bodies[0]
    assert 0.45 < len(tank.cells) / len(whole.cells) < 0.55
    assert len(tank.cell_data["damage"]) == len(tank.cells) and ball is bodies[2]
    assert drops.outside.all() and len(drops.points) == bodies[1].point_data["outside"].sum() > 0
    assert field.form == "field" and np.abs((field.points - struck.middle(run)) @ s.removed).max() < 1e-12


def test_the_field_of_a_section_is_that_of_its_particles() -> None:
    """A block of water on a lattice: a linear pressure is shown as such, and the field covers what the block does, to a fifth of a spacing;
    on a plane that grazes nothing there is no field."""
    d, n = 0.01, np.array([12, 6, 20])
    x = d * (np.stack(np.meshgrid(*(np.arange(k) for k in n), indexing="ij"), axis=-1).reshape(-1, 3) + 0.5)
    data = {"pressure": 1e3 * x[:, 2], "density": np.full(len(x), 1e3), "velocity": np.tile([3.0, 0, 4.0], (len(x), 1))}
    water = BodyFrame("w", x, NO_CELLS, data | {"diameter": np.full(len(x), d), "reference": x}, {}, "fluid")
    field = section.field_on(water, np.array([0.0, 0.03, 0.0]), np.array([0.0, -1.0, 0.0]))
    corners = field.points[field.cells]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]), axis=1).sum()
    assert area == pytest.approx(0.12 * 0.20, abs=2 * 0.32 * d / 5)
    middle = corners.mean(axis=1)
    deep = (np.abs(middle[:, 2] - 0.1) < 0.08) & (np.abs(middle[:, 0] - 0.06) < 0.04)
    assert field.cell_data["pressure"][deep] == pytest.approx(1e3 * middle[deep, 2], abs=0.05 * 1e3 * d)
    assert field.cell_data["speed"] == pytest.approx(np.full(len(field.cells), 5.0))
    assert len(section.field_on(water, np.array([0.0, 1.0, 0.0]), np.array([0.0, -1.0, 0.0])).cells) == 0


def test_each_of_two_tanks_is_cut_through_its_own_middle(runs) -> None:
    run = runs["two"]
    whole = {body.name: body for body in struck.bodies_at(run, 0)}
    middles, removed = struck.middles(run), struck.sides(run).removed
    for half in struck.cut_open(list(whole.values()), middles, removed):
        if half.form == "surface":
            assert 0.4 < len(half.cells) / len(whole[half.name].cells) < 0.6, half.name
        elif half.form == "field":
            assert len(half.cells) > 10 and np.abs((half.points - middles[half.name]) @ removed).max() < 1e-12, half.name
    assert all(struck.close_up(run, name, struck.sides(run).front, -1.0) is None for name in drawn.SIDES)  # a crack over the height


@pytest.mark.parametrize("renderer", BOTH, indirect=True)
def test_a_body_of_another_kind_is_drawn_by_what_it_is_made_of(renderer: str) -> None:
    import matplotlib.pyplot as plt

    points = np.array([[0.2, 0.2, 0], [0.8, 0.8, 0]])
    look = panel.Look("damage", "", panel.DAMAGE, 0.0, 1.0, 1.0, loose=True)
    square = np.array([[0, 0, 0], [0.4, 0, 0], [0.4, 0.4, 0], [0, 0.4, 0]]) + [0.5, 0.1, 0]
    toys = [
        BodyFrame("dots", points, NO_CELLS, {"velocity": 0 * points}, {}, "toy"),
        BodyFrame("balls", points + [0, 0.1, 0], NO_CELLS, {"velocity": 0 * points, "radius": np.full(2, 0.05)}, {}, "toy"),
        BodyFrame("sheet", square, np.array([[0, 1, 2, 3]], np.int32), {"velocity": 0 * square}, {}, "toy"),
    ]
    assert [toy.form for toy in toys] == ["points", "balls", "solid"]
    for toy in toys:
        figure = plt.figure(figsize=(3, 3), dpi=100)
        panel.draw(figure.add_axes((0, 0, 1, 1)), [toy], look, panel.View(0, 1, 0, 1, np.eye(3)), renderer == "vtk")
        figure.canvas.draw()
        seen = np.asarray(figure.canvas.buffer_rgba())[..., :3]
        plt.close(figure)
        assert (seen != 255).any(axis=-1).sum() > 20, toy.name


def test_close_up_frames_the_hole(runs) -> None:
    view = struck.close_up(runs["empty"], "tank", struck.sides(runs["empty"]).front, -1.0)
    centre = np.array([-drawn.TANK, 0, 0]) @ view.turn.T
    assert view.x0 < centre[0] < view.x1 and view.y0 < centre[1] < view.y1
    assert view.x1 - view.x0 < 0.6 * drawn.HEIGHT


@pytest.mark.skipif(not HAVE_VTK, reason="VTK cannot draw here")
def test_particles_stand_where_they_are_and_are_as_large(runs) -> None:
    """One particle of 40 mm in a window of 200 mm: a disc of a fifth of the width, in its place, with the colour of its value."""
    from taichi_sph.render.vtk_panel import image

    body = runs["dam"].frames("water").body(0)
    one = struck.chosen(body, np.arange(len(body.points)) == 0)
    one = drawn.BodyFrame("water", np.array([[0.05, 0, -0.02]]), one.cells, {**one.point_data, "diameter": np.array([0.04])}, {}, "fluid")
    looks = struck.looks_of([runs["dam"]])
    view = panel.View(-0.1, 0.1, -0.1, 0.1, panel.oblique(np.array([0.0, -1.0, 0.0])))
    shot = image([one], looks.shell, view, 200, 200, looks.speed)
    rows, columns = np.nonzero(shot[..., 3] > 128)
    assert np.ptp(columns) + 1 == pytest.approx(40, abs=2) and np.ptp(rows) + 1 == pytest.approx(40, abs=2)
    assert columns.mean() == pytest.approx(150 - 0.5, abs=1) and rows.mean() == pytest.approx(120 - 0.5, abs=1)


@pytest.mark.skipif(not HAVE_VTK, reason="VTK cannot draw here")
def test_the_striker_hides_what_is_behind_it(runs) -> None:
    from taichi_sph.render.vtk_panel import image

    run = runs["plate"]
    looks, s = struck.looks_of([run]), struck.sides(run)
    before = struck.bodies_at(run, 0)
    view = struck.views_of(run, [0])["front"]
    with_ball = image(before, looks.shell, view, 200, 150)
    alone = image(before[:1], looks.shell, view, 200, 150)
    assert (np.abs(with_ball.astype(int) - alone).max(axis=-1) > 40).mean() > 0.02
    from_below = image(before, looks.shell, struck.views_of(run, [0])["back"], 200, 150)
    below = image(before[:1], looks.shell, struck.views_of(run, [0])["back"], 200, 150)
    assert (np.abs(from_below.astype(int) - below).max(axis=-1) > 40).mean() < 0.02, "the plate hides the ball"
    assert s.front is not None


def pressed(*pressures: np.ndarray) -> panel.Look:
    """The look of a run whose frames have these pressures [Pa]."""
    frames = [(np.asarray(p), np.zeros(len(p))) for p in pressures]

    class File(list):
        def array(self, _, name: str, index: int) -> np.ndarray:
            return self[index][0]

    class Run:
        def of_kind(self, kind: str) -> list:
            return [File(frames)] if kind == "fluid" else []

    return struck.pressure_look([Run()])


def test_water_at_rest_is_a_gradient_and_a_shock_beside_it_does_not_hide_it() -> None:
    rest, shock = np.linspace(0.0, 2e3, 500), np.full(60, 1e5)
    alone = pressed(rest)
    assert (alone.power, alone.high) == (1.0, 2e3) and np.ptp(alone.shade(rest)) > 0.95
    one = pressed(np.append(rest, 1e8))  # a particle alone does not decide
    assert one.high == 2e3
    both = pressed(rest, np.concatenate([rest, shock]))
    assert both.high == 1e5 and both.power == 0.5 and np.ptp(both.shade(rest)) > 0.12
    assert both.bar().vmax == pytest.approx(1e5 * both.shown)
    # pale ends of the two quantities of water: far apart in colour
    pale = [np.array(colours(0.1)[:3]) for colours in (panel.PRESSURE, panel.SPRAY)]
    assert np.abs(pale[0] - pale[1]).max() > 0.25


def test_no_legend_of_what_is_not_drawn(runs) -> None:
    looks, bodies = struck.looks_of([runs["full"]]), struck.bodies_at(runs["full"], 0)
    inside = [b for b in bodies if b.form != "particles"] + [struck.chosen(b, b.outside) for b in bodies if b.form == "particles"]
    shot = Shot(inside, panel.View(0, 1, 0, 1), "", looks.shell, looks.speed)
    assert looks.speed not in shot.looks


def test_runs_of_unlike_sizes_have_windows_of_their_own() -> None:
    small, large = panel.View(0, 0.1, 0, 0.05), panel.View(-10, 10, 3, 9)
    assert struck.together([small, small]) == small
    near = struck.together([small, panel.View(0.1, 0.4, 0, 0.02)])
    assert (near.x0, near.x1, near.y0, near.y1) == (0, 0.4, 0, 0.05)
    one, two = struck.together([small, large])
    assert one.aspect == pytest.approx(two.aspect)
    for view, own in ((one, small), (two, large)):
        assert view.x0 <= own.x0 + 1e-12 and view.x1 >= own.x1 - 1e-12 and view.y0 <= own.y0 + 1e-12 and view.y1 >= own.y1 - 1e-12
        assert view.x1 - view.x0 < 2 * max(own.x1 - own.x0, own.y1 - own.y0)


@pytest.mark.parametrize("metres, text", [(2.0, "2 m"), (0.05, "50 mm"), (5e-4, "500 µm")])
def test_lengths_in_words(metres: float, text: str) -> None:
    assert length_text(metres) == text


def test_a_ball_that_stands_for_a_plane_is_not_drawn(runs, monkeypatch):
    """A platen of 20 m over a plate of some centimetres would be all that is seen."""
    run = runs["plate"]
    striker = next(body for body in struck.bodies_at(run, 0) if body.form == "balls")
    assert struck.striker_radius(run) == striker.point_data["radius"].max()
    size = float(np.linalg.norm(np.subtract(*struck.box(run))))
    body = FramesFile.body
    for radius, shown in ((2.9 * size, True), (3.1 * size, False)):

        def swollen(self, index, radius=radius):
            found = body(self, index)
            return replace(found, point_data=found.point_data | {"radius": np.array([radius])}) if found.form == "balls" else found

        monkeypatch.setattr(FramesFile, "body", swollen)
        assert (striker.name in {b.name for b in struck.bodies_at(run, 0)}) == shown


def test_instants_show_how_it_ruptured() -> None:
    """Of two ruptures far apart, each has frames of its own, and the end; even times have none of them."""
    times = np.linspace(0, 1e-3, 101)
    broke = np.repeat([2.1e-5, 2.9e-5, 8.1e-4, 8.3e-4], 4)
    assert struck.instants(times, broke, False) == [3, 42, 81, 83, 100]
    assert struck.instants(times, np.repeat([1e-4, 2e-4, 3e-4, 4e-4], 1), False) == [11, 20, 30, 40, 100]
    assert struck.instants(times, np.zeros(0), False) == [0, 25, 50, 75, 100]
    assert struck.instants(times[:2], broke, True) == [1]


def test_shells_small_beside_what_strikes_them_are_shown_alone(runs) -> None:
    """In a window of their own; large ones keep that of the overview."""
    for name in ("plate", "full"):
        views = struck.views_of(runs[name], [-1])
        assert views["dry"] == views["front"]


def test_targets_are_told_in_units_that_suit() -> None:
    assert plots._suiting(1.03e-5, "s") == (pytest.approx(1e6), "us")
    assert plots._suiting(1.2, "") == (1.0, "")
    entry = {"value": 1.008e-5, "target": 1.01e-5, "tolerance": 1e-7, "unit": "s", "met": True, "source": ""}
    named = "peak_time(history=probe_centre, start=7.5e-06, end=1.25e-05)"
    figure = plots.targets({"title": "t", "cases": {"one": {}}, "quantities": {f"{named}_one": entry}})
    (axes,) = figure.axes
    assert "10.08" in {text.get_text() for text in axes.texts}
    lines = axes.get_xlabel().splitlines()
    assert len(lines) > 1 and max(map(len, lines)) <= plots.NARROW and lines[-1].endswith("[us]")
    plots.plt.close("all")
