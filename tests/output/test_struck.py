"""Fragments, holes, petals, strikers and leaks of drawn runs, whose numbers are known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from taichi_sph.errors import SceneError
from taichi_sph.geometry.surfaces import generate
from taichi_sph.output.answer import answer
from taichi_sph.output.folder import RunFolder
from taichi_sph.output.histories import read_history, write_history
from taichi_sph.output.measures import MEASURES, measure
from taichi_sph.output.measures import fragments as parts
from taichi_sph.scene import Cylinder, Numerics

from . import struck

SPACING = 4e-4


@pytest.fixture(scope="module")
def plate(tmp_path_factory) -> RunFolder:
    return struck.write_plate(tmp_path_factory.mktemp("plate"), SPACING)


@pytest.fixture(scope="module")
def empty(tmp_path_factory) -> RunFolder:
    return struck.write_tank(tmp_path_factory.mktemp("empty"), False, 0.004, count=5)


@pytest.fixture(scope="module")
def full(tmp_path_factory) -> RunFolder:
    return struck.write_tank(tmp_path_factory.mktemp("full"), True, 0.01, 0.03, 5)


# --- fragments --------------------------------------------------------------------------------------


def test_masses_of_fragments_and_dust_add_up(plate) -> None:
    found = read_history(plate.path / "histories/fragments.csv")
    shell = plate.scene.shells[0]
    mesh = generate(shell.surface, plate.scene.numerics)
    whole = mesh.areas.sum() * shell.thickness * shell.material.density
    assert found["mass"].sum() == pytest.approx(whole, rel=1e-9)
    assert found["nodes"].sum() == len(mesh.points)
    assert found.units["mass"] == "kg" and found.units["vx"] == "m/s"
    assert list(found["held"][:2]) == [1, 0] and found["fragment"][-1] == -1
    assert (np.diff(found["mass"][:-1]) <= 0).all(), "the largest first"
    assert found["vz"][1] == pytest.approx(-struck.PLUG_SPEED, rel=1e-6)
    assert found["size"][1] == pytest.approx(2 * struck.PLUG, abs=2 * SPACING)


def test_the_masses_of_what_came_off(plate) -> None:
    """The heaviest first; each node of the dust is a piece; what is held is none."""
    found, masses = read_history(plate.path / "histories/fragments.csv"), parts.free_masses(plate, "fragments")
    gone, dust = (found["fragment"] >= 0) & (found["held"] == 0), found["fragment"] < 0
    assert len(masses) == gone.sum() + found["nodes"][dust].sum() and (np.diff(masses) <= 0).all()
    assert masses[0] == found["mass"][1] and masses.sum() == pytest.approx(found["mass"][gone | dust].sum(), rel=1e-9)


def test_areas_of_cells_are_those_of_the_mesh() -> None:
    for cells in ("quad", "triangle"):
        mesh = generate(Cylinder(radius=0.05, length=0.1), Numerics(spacing=0.005, cells=cells))
        np.testing.assert_allclose(parts.cell_areas(mesh.points, mesh.cells), mesh.areas, rtol=2e-3)


def test_two_plates_torn_apart_are_two_fragments() -> None:
    """Cells in the column x = 0.5 broken: both halves touch the border and are held, nothing is loose but the column."""
    from .synthetic import branched

    body, _ = branched(0.002)
    x = body.points[body.cells].mean(axis=1)[:, 0]
    broken = np.abs(x - 0.049) < 1e-3
    torn = replace(body, cell_data={"broken": broken.astype(np.uint8), "rupture_time": np.where(broken, 1e-6, np.nan)})
    f = parts.fragments(torn)
    assert len(f.area) == 2 and f.held.all() and not f.dust.any()
    assert f.area.sum() == pytest.approx(0.1 * 0.04)
    wider = np.abs(x - 0.049) < 3e-3
    f = parts.fragments(replace(body, cell_data={"broken": wider.astype(np.uint8), "rupture_time": np.where(wider, 1e-6, np.nan)}))
    assert f.dust.sum() == 2 * 21, "two columns of nodes without a live cell"
    assert len(parts.holes(f)) == 1 and parts.holes(f)[0].area == pytest.approx(2 * 0.002 * 0.04)


def test_what_flies_freely_has_pieces_and_what_is_held_remains() -> None:
    """A strip broken into three: held at one end, or by both; free, all are pieces, unless one is more than half of it."""
    from taichi_sph.scene import Box, PrescribedVelocity

    from ..plates import plate_scene
    from .synthetic import branched

    body, _ = branched(0.002)
    x = body.points[body.cells].mean(axis=1)[:, 0]
    end = Box(hi=(1e-9, None, None))
    for at, held, free in (((0.033, 0.067), [], 3), ((0.033, 0.067), [end], 2), ((0.033, 0.067), [end, Box(lo=(0.0999, None, None))], 1),
                           ((0.067, 0.081), [], 2), ((0.067, 0.081), [Box(lo=(0.0999, None, None))], 1)):  # fmt: skip
        broken = np.any([np.abs(x - place) < 1e-3 for place in at], axis=0)
        torn = replace(body, cell_data={"broken": broken.astype(np.uint8), "rupture_time": np.where(broken, 1e-6, np.nan)})
        motions = [PrescribedVelocity(shell="plate", where=where, velocity=(0, 0, None)) for where in held]
        scene = plate_scene(length=0.1, width=0.04, spacing=0.002, motions=motions)
        f = parts.fragments(replace(torn, name="plate"), scene)
        assert len(f.area) == 3 and len(f.free) == free


@pytest.mark.parametrize(
    "name, expected, tolerance",
    [
        ("plug_diameter", 2 * struck.PLUG, SPACING),
        ("hole_diameter", 2 * struck.PLUG, SPACING),
        ("petals", struck.PETALS, 0),
        ("fragments_count", 1, 0),
        ("time_to_rupture", struck.HIT + 4e-6, 1e-11),
        ("striker_speed", struck.BALL_EXIT, 1e-9),
        ("striker_energy_lost", 0.5 * 0.154 * (struck.BALL_SPEED**2 - struck.BALL_EXIT**2), 1e-6),
        ("peak_force", 1.25 * 0.154 * (struck.BALL_SPEED - struck.BALL_EXIT) / 3e-5, 1.0),
    ],
)
def test_the_perforated_plate(plate, name: str, expected: float, tolerance: float) -> None:
    assert measure(name, plate) == pytest.approx(expected, abs=tolerance, rel=0)


def test_one_sees_through_between_the_petals(plate) -> None:
    """Petals bent by 62 deg about r = 9 mm leave a hole of radius 9 - (9 - 4.25) cos 62 deg mm, plus the slits between."""
    inner = struck.CRACKED - (struck.CRACKED - struck.PLUG) * np.cos(np.radians(62))
    seen = measure("opening_diameter", plate)
    assert 2 * inner - SPACING < seen < 2 * inner + 4 * SPACING
    assert seen > 1.5 * measure("hole_diameter", plate)


def test_the_hole_that_one_sees_is_not_what_is_missing(plate, empty) -> None:
    """Of the tank, through one hole one looks at the far wall, which does not close it."""
    names = ("hole_diameter", "seen_diameter", "opening_diameter")
    missing, seen, through = (measure(name, plate) for name in names)
    assert 1.5 * missing < seen == pytest.approx(through, abs=SPACING)
    missing, seen, through = (measure(name, empty) for name in names)
    assert missing < seen == pytest.approx(through, abs=0.5 * 0.004)
    assert measure("opening_diameter", empty, {"reach": 3 * struck.TANK}) == pytest.approx(through, rel=0.01)
    assert measure("seen_diameter", empty, {"hole": 3}) == 0
    text = " ".join(answer(empty))
    assert f"a hole of {1e3 * seen:.3g} mm, as one sees it between its lips" in text
    assert f"(material as a disc of {1e3 * missing:.3g} mm is missing)" in text


def test_before_the_hit_all_is_whole(plate) -> None:
    first = plate.frames().body(0)
    f = parts.fragments(first)
    assert len(f.area) == 1 and not f.dust.any() and parts.holes(f) == []
    assert parts.radial_cracks(first, np.zeros(3)) == 0 and parts.widest(first) == 0.0 and len(parts.crack_lengths(first)) == 0


def test_speed_at_a_time_and_behind_a_place(plate, empty) -> None:
    assert measure("striker_speed", plate, {"time": 2e-6}) == pytest.approx(struck.BALL_SPEED)
    assert measure("striker_speed", plate, {"time": 1.0}) is None
    assert measure("striker_speed", plate, {"beyond": -1.0}) is None
    assert measure("striker_speed", empty, {"axis": "x", "beyond": 0.0}) == pytest.approx(688.0)
    assert measure("striker_speed", empty, {"axis": "x", "beyond": struck.TANK + 0.02}) == pytest.approx(640.0)
    with pytest.raises(SceneError, match="'x', 'y' or 'z'"):
        measure("striker_speed", plate, {"axis": "w"})
    with pytest.raises(SceneError, match="no history of a rigid body 'bal'.*ball"):
        measure("striker_speed", plate, {"striker": "bal"})


def test_two_holes_of_the_empty_tank(empty) -> None:
    assert measure("hole_diameter", empty) == pytest.approx(2 * struck.SHOT, abs=1.5 * 0.004)
    assert measure("hole_diameter", empty, {"hole": 2}) > 0
    assert measure("hole_diameter", empty, {"hole": 3}) == 0
    first, second = parts.holes(parts.fragments(empty.frames().body(-1)))
    assert first.time == pytest.approx(3e-5) and second.time == pytest.approx(4.6e-4)
    assert first.centre[0] < -0.9 * struck.TANK and second.centre[0] > 0.9 * struck.TANK
    assert measure("plug_diameter", empty) == 0 and measure("fragments_count", empty) == 0
    assert measure("dust_mass", empty) > 0


def test_where_it_was_struck_follows_from_the_flight(empty) -> None:
    place = parts.struck_at(empty, empty.frames().body(-1))
    np.testing.assert_allclose(place, [-struck.TANK, 0, 0], atol=1e-3)


def test_crack_of_the_full_tank(full) -> None:
    length = measure("crack_length", full, {"how": "longest"})
    assert length == pytest.approx(struck.CRACK, abs=0.01)
    assert measure("crack_length", full, {"how": "total"}) >= length
    assert measure("crack_opening", full) == pytest.approx(struck.OPENING, rel=0.05)
    assert measure("petals", full) == 2, "one crack up, one down"
    with pytest.raises(SceneError, match="'straight', 'longest' or 'total'"):
        measure("crack_length", full, {"how": "long"})


def test_length_of_a_drawn_zigzag() -> None:
    """Of a crack that turns back, the path is longer than the distance."""
    from .synthetic import branched

    body, _ = branched(0.002)
    centre = body.points[body.cells].mean(axis=1)
    x, y = centre[:, 0], centre[:, 1]
    up = (np.abs(x - 0.021) < 1e-3) & (y > 0.01) & (y < 0.03)
    over = (np.abs(y - 0.029) < 1e-3) & (x > 0.02) & (x < 0.062)
    down = (np.abs(x - 0.061) < 1e-3) & (y > 0.01) & (y < 0.03)
    broken = up | over | down
    made = replace(body, cell_data={"broken": broken.astype(np.uint8), "rupture_time": np.where(broken, 1e-6, np.nan)})
    assert parts.crack_lengths(made)[0] == pytest.approx(0.018 + 0.04 + 0.018, abs=0.004)


# --- leaks ------------------------------------------------------------------------------------------


def test_leak_of_the_full_tank(full) -> None:
    assert measure("leak_rate", full) == pytest.approx(struck.LEAK, rel=0.01)
    assert measure("leak_rate", full, {"end": 5e-4}) == 0
    assert measure("leak_rate", full, {"start": 1e-3, "end": 2e-3}) == pytest.approx(struck.LEAK)
    assert measure("leaked_litres", full) == pytest.approx(struck.LEAK * 1.4e-3)
    assert measure("leaked_litres", full, {"time": 1.7e-3}) == pytest.approx(struck.LEAK * 1e-3, rel=1e-3)
    assert measure("jet_speed", full) == pytest.approx(struck.JET)
    assert measure("jet_speed", full, {"end": 1e-4}) is None


def test_a_leak_knows_how_well_it_is_known(full) -> None:
    """A steady leak is known but for one particle over the time that is looked at; a step in it scatters the quarters."""
    history = full.history("leak")
    one = measure("leaked_litres", full) / history["escaped_count"][-1]
    inside = history.time >= 0.9 * history.time[-1]
    assert measure("leak_rate_error", full) == pytest.approx(one / np.ptp(history.time[inside]), rel=1e-3)
    # the leak begins at 0.7 ms: of the quarters of 0.6 to 0.8 ms two have none, two have all of it
    known = np.hypot(struck.LEAK / np.sqrt(12), one / 2e-4)
    assert measure("leak_rate_error", full, {"start": 6e-4, "end": 8e-4}) == pytest.approx(known, rel=0.02)
    assert measure("leak_rate_error", full, {"start": 1e-3, "end": 1.005e-3}) is None


def test_the_orifice_of_a_crack_half_way_up(full) -> None:
    """The crack is centred at half the height: sqrt(2 g h) of its middle, and a little less for its length."""
    top = full.frames("tank").body(-1).reference[:, 2].max()
    area = full.history("leak")["opening_area"][-1]
    middle = 0.61 * area * np.sqrt(2 * 9.81 * top) / 1e-3
    assert 0.93 * middle < measure("orifice_rate", full) < middle


def test_peak_pressure_is_of_the_place(full) -> None:
    everywhere = measure("peak_pressure", full)
    assert everywhere == max(float(b.point_data["pressure"].max()) for b in full.frames("water"))
    here = measure("peak_pressure", full, {"x": 0.1, "within": 0.05})
    assert 0 < here < everywhere
    assert measure("peak_pressure", full, {"x": 5.0}) is None


def test_without_water_there_is_nothing_to_measure(empty) -> None:
    with pytest.raises(SceneError, match="no frames of a fluid"):
        measure("peak_pressure", empty)
    with pytest.raises(SceneError, match="no history 'leak'"):
        measure("leak_rate", empty)


def test_every_measure_states_its_unit_in_its_words() -> None:
    for name, (function, unit) in MEASURES.items():
        if function.__module__.endswith(("fragments", "perforation", "leak")) and unit:
            assert f"[{unit}]" in function.__doc__, name


# --- the verdict --------------------------------------------------------------------------------------


def test_the_answer_about_the_plate(plate) -> None:
    lines = answer(plate)
    assert lines[0].startswith("The plate ruptured at 9 us: a hole of 8.") and "seven petals" in lines[0]
    assert "a plug of 8." in lines[0] and "flies at 310 m/s" in lines[0]
    assert lines[1] == "The striker ends at 255 m/s after 300 m/s (27.8 % of its energy lost); the largest force of a step is 289 kN."


def test_the_answer_about_the_tank(empty, full, monkeypatch) -> None:
    assert "another of" in answer(empty)[0] and "(23.1 % of its energy lost)" in answer(empty)[1]
    lines = answer(full)
    assert "a crack 444 mm long, open by 11.4 mm" in lines[0]
    assert lines[1].startswith("It leaks 3.1 l/s (± ") and ") at the end: 4.34 ml so far, in a jet of 60 m/s, through " in lines[1]
    assert ", out of which a calm tank would leak " in lines[1]
    monkeypatch.setattr("taichi_sph.output.answer.ENOUGH", 10**9)
    assert "too few for a rate" in answer(full)[1] and answer(full)[1].startswith("It begins to leak: 4.34 ml by the end (")


def test_the_answer_when_nothing_broke(tmp_path: Path) -> None:
    run = struck.write_plate(tmp_path, 1e-3, count=1)
    assert answer(run)[0] == "The plate did not rupture; the largest plastic strain 0, damage 0."
    assert not (tmp_path / "histories/fragments.csv").exists()


def test_a_striker_that_bounces(tmp_path: Path) -> None:
    run = struck.write_plate(tmp_path, 1e-3, count=1)
    h = run.history("rigid_ball")
    back = {**h.columns, "vz": np.linspace(-300, 30, len(h))}
    write_history(h.path, struck.RIGID_UNITS, back)
    assert "The striker bounces back at 30 m/s after 300 m/s (99 % of its energy lost)" in "\n".join(answer(run))


def test_a_hole_in_the_plug_hides_no_petals(plate) -> None:
    """Broken cells at the very centre, apart from the ring of the plug."""
    body = plate.frames().body(-1)
    centre = parts.cell_centres(body.reference, body.cells)
    pierced = np.linalg.norm(centre, axis=1) < 2.1 * SPACING
    broken = (body.cell_data["broken"] != 0) | pierced
    time = np.where(pierced, struck.HIT, body.cell_data["rupture_time"])
    made = replace(body, cell_data={**body.cell_data, "broken": broken.astype(np.uint8), "rupture_time": time})
    assert pierced.sum() >= 5
    assert parts.radial_cracks(made, np.zeros(3)) == struck.PETALS
