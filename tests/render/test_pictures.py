"""Pictures: both renderers draw the same thing, at the right place, without display."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from taichi_sph.errors import SceneError
from taichi_sph.frame import BodyFrame
from taichi_sph.output.answer import answer
from taichi_sph.output.histories import write_history
from taichi_sph.render import backend, panel, pictures, plots, prices
from taichi_sph.scene import Collocation, Output, StrainGauge

from ..output.synthetic import frames, plate_scene, write_run

HAVE_VTK = backend.choose().name == "vtk"
BOTH = ["matplotlib", pytest.param("vtk", marks=pytest.mark.skipif(not HAVE_VTK, reason="VTK cannot draw here"))]


@pytest.fixture
def renderer(request, monkeypatch: pytest.MonkeyPatch) -> str:
    name = request.param
    chosen = backend.Backend(name, notice="" if name == "vtk" else "no OpenGL in this test")
    monkeypatch.setattr(pictures, "choose", lambda: chosen)
    return name


def body() -> BodyFrame:
    return frames(2, spacing=0.002)[-1].bodies[0]


@pytest.mark.parametrize("renderer", BOTH, indirect=True)
def test_a_run_gets_all_its_pictures(tmp_path: Path, renderer: str) -> None:
    write_run(tmp_path, count=5, spacing=0.001).close()
    notices: list[str] = []
    paths = pictures.render_run(tmp_path, notices.append)
    names = ["damage.png", "damage_over_time.png", "energies.png", "crack_tip.png", "damage.gif"]
    assert [p.name for p in paths] == names
    assert notices == ([] if renderer == "vtk" else ["no OpenGL in this test"])
    for path in paths:
        with Image.open(path) as image:
            assert image.width > 800
            if path.suffix == ".gif":
                assert image.n_frames == 5
            pixels = np.asarray(image.convert("RGB"))
        corner = pixels[:3, :3].reshape(-1, 3)
        assert (corner == 255).all(), "white paper"
        assert len(np.unique(pixels[::9, ::9].reshape(-1, 3), axis=0)) > 20, "something is on it"
    assert not list(tmp_path.rglob("*.tmp"))


@pytest.mark.skipif(not HAVE_VTK, reason="VTK cannot draw here")
def test_vtk_and_matplotlib_agree() -> None:
    """The same body on the same window: the pixels differ only along edges."""
    import matplotlib.pyplot as plt

    look = panel.Look("damage", "", panel.DAMAGE, 0, 1, 50.0)
    view = panel.view_of([body()], 50.0)
    drawn = []
    for with_vtk in (True, False):
        figure = plt.figure(figsize=(8, 8 * view.aspect), dpi=100)
        axes = figure.add_axes((0, 0, 1, 1))
        panel.draw(axes, [body()], look, view, with_vtk)
        axes.axis("off")
        figure.canvas.draw()
        drawn.append(np.asarray(figure.canvas.buffer_rgba())[..., :3].astype(int))
        plt.close(figure)
    difference = np.abs(drawn[0] - drawn[1]).max(axis=-1)
    assert np.mean(difference > 24) < 0.03
    assert np.mean(difference) < 3


@pytest.mark.skipif(not HAVE_VTK, reason="VTK cannot draw here")
def test_each_vtk_image_is_new() -> None:
    """The window is kept between images: what was drawn before must not come back."""
    from taichi_sph.render.vtk_panel import image

    look = panel.Look("damage", "", panel.DAMAGE, 0, 1, 1.0)
    early, late = (f.bodies[0] for f in frames(3, spacing=0.002)[1:])
    view = panel.view_of([late], 1.0)
    first, second, again = (image([b], look, view, 200, 100) for b in (early, late, early))
    assert (first != second).any()
    np.testing.assert_array_equal(first, again)
    assert first.shape == (100, 200, 4)
    assert first[0, 0, 3] == 0 and first[20, 100, 3] == 255, "transparent beside the body"


def test_broken_cells_are_gaps() -> None:
    sound = panel.kept(body())
    assert 0 < np.count_nonzero(~sound) < len(sound)
    bare = replace(body(), cell_data={})
    assert panel.kept(bare).all()


def test_magnification_is_round_and_ignores_loose_nodes() -> None:
    still = body()
    moved = replace(still, points=still.reference + np.array([0, 1e-5, 0]))
    assert panel.magnification([moved]) == 200  # 2 % of 100 mm over 10 um
    far = moved.points.copy()
    far[0] += 1.0
    assert panel.magnification([replace(moved, points=far)]) == 200
    assert panel.magnification([replace(still, points=still.reference)]) == 1
    assert panel.magnification([replace(still, points=still.reference + 0.05)]) == 1


@pytest.mark.parametrize("value, expected", [(1, 1), (1.99, 1), (2, 2), (4.9, 2), (7, 5), (99, 50), (100, 100), (0.03, 0.02)])
def test_round_down(value: float, expected: float) -> None:
    assert panel.round_down(value) == pytest.approx(expected)


@pytest.mark.parametrize("triangles", [False, True])
def test_border_is_the_outline(triangles: bool) -> None:
    plate = frames(1, spacing=0.002, triangles=triangles)[0].bodies[0]
    edges = panel.border(plate.cells)
    length = np.linalg.norm(np.diff(plate.reference[edges], axis=1), axis=-1).sum()
    assert length == pytest.approx(2 * (0.1 + 0.04))


def test_bodies_without_damage_show_speed(tmp_path: Path) -> None:
    run = write_run(tmp_path, count=1, spacing=0.002)
    assert pictures.look_of([run]).field == "damage" or run.frames().body().cell_data["damage"].max() == 0
    plate = body()
    np.testing.assert_allclose(
        panel.cell_values(replace(plate, point_data={"velocity": np.full((len(plate.points), 3), 2.0)}), "speed"), 12**0.5
    )


def test_strip_covers_the_life_of_the_crack(tmp_path: Path) -> None:
    run = write_run(tmp_path, count=13, spacing=0.001)
    chosen = pictures.strip_frames(run)
    assert len(chosen) == 4
    times = run.frames().times[chosen]
    assert times[0] > 5e-6 and times[-1] == pytest.approx(5.5e-5, abs=5e-6)


@pytest.mark.parametrize("renderer", ["matplotlib"], indirect=True)
def test_compare(tmp_path: Path, renderer: str) -> None:
    a = write_run(tmp_path / "a", count=2, spacing=0.002)
    scene = plate_scene()
    other = scene.model_copy(update={"numerics": scene.numerics.model_copy(update={"formulation": Collocation()})})
    b = write_run(tmp_path / "b", count=2, spacing=0.002, branches=1, scene=other)
    assert pictures.differences([a, b]) == ["galerkin", "collocation"]
    path = pictures.render_compare([tmp_path / "a", tmp_path / "b"], tmp_path / "both.png")
    with Image.open(path) as image:
        assert image.width > image.height
    with pytest.raises(SceneError, match="nothing to compare"):
        pictures.render_compare([], tmp_path / "none.png")


@pytest.mark.parametrize("renderer", ["matplotlib"], indirect=True)
def test_titles_are_no_formulas(tmp_path: Path, renderer: str) -> None:
    for name in ("a $\\frac{$ b", "a $x^{2$"):
        run = write_run(tmp_path / str(len(name)), count=2, spacing=0.002, scene=plate_scene(title=name))
        pictures.render_compare([run.path, run.path], tmp_path / "both.png")
        plots.energies(run, f"{run.scene.title}: energy").savefig(tmp_path / "energy.png")
        pictures.render_compare([run.path, run.path], tmp_path / "both.png", title=name)
        where = {"processor": 2.0, "node_steps": 1e6}
        points = [{"name": label, "error": 0.01, "status": "done", "spread": None, **where} for label in ("as it is", f"quality {name}")]
        prices.render_price({"title": name, "references": {name: 1.0}, "points": points}, tmp_path / "price.png")


def test_names_of_lines_keep_apart() -> None:
    """Two lines that end together at the top of their axes: their names are a gap apart, below the top."""
    _, axes = plots.plt.subplots()
    axes.set_ylim(0, 1)
    plots._direct_labels(axes, [(0.99, "a", "k"), (0.98, "b", "k"), (0.1, "c", "k")], 1.0, 0.15)
    places = sorted(text.xy[1] for text in axes.texts)
    assert np.diff(places).min() > 0.149 and places[-1] <= 1.0 and places[0] == 0.1
    plots.plt.close()


def test_pieces_by_classes_of_mass(tmp_path: Path) -> None:
    """Every piece is in a class, and the curve ends at the whole mass; a handful of pieces has no picture."""
    run = write_run(tmp_path, count=1)
    path, head = tmp_path / "histories/fragments.csv", "fragment [-],nodes [-],mass [kg],held [-]"
    rows = [f"{k},9,{(1 + k) * 1e-3},{int(k == 0)}" for k in range(30)] + ["-1,50,0.01,0"]
    path.write_text("\n".join([head, *rows]) + "\n")
    figure = plots.fragments(run, "fragments")
    assert figure is not None
    number, share = figure.axes
    (bars,), (line,) = number.patches, share.lines
    assert bars.get_data().values.sum() == 29 + 50
    masses, part = line.get_data()
    assert masses[0] == pytest.approx(30) and part[0] == pytest.approx(100 * 0.03 / 0.474) and part[-1] == pytest.approx(100)
    path.write_text("\n".join([head, *rows[:9]]) + "\n")
    assert plots.fragments(run, "fragments") is None
    plots.plt.close("all")


def test_gauges_are_told_and_drawn_and_say_when_they_broke(tmp_path: Path) -> None:
    gauges = [StrainGauge(name=name, point=(0, 0, 0), along=(0, 1, 0)) for name in ("root", "at_tip")]
    run = write_run(tmp_path, count=2, scene=plate_scene(output=Output(gauges=gauges)))
    time = np.linspace(0, 6e-5, 7)
    for name, gone in (("root", 9), ("at_tip", 4)):
        strain = np.where(np.arange(7) < gone, -1e-3 * np.sin(time / 2e-5), np.nan)
        columns = {"time": time, "strain": strain, "membrane": strain, "bending": 0 * strain}
        write_history(tmp_path / f"histories/gauge_{name}.csv", {n: "s" if n == "time" else "-" for n in columns}, columns)
    text = "\n".join(answer(run))
    assert "Gauge root: -0.0997 % strain at the most, at 30 us; -0.0141 % at the end." in text
    assert "Gauge at tip: -0.0997 % strain at the most, at 30 us; its cells broke by 40 us, after which it reads nothing (nan)." in text
    figure = plots.gauges(run)
    assert figure is not None and {t.get_text() for t in figure.axes[0].texts} == {"root", "at tip: broke by 40 µs"}
    plots.plt.close("all")
    (tmp_path / "histories/gauge_root.csv").unlink()
    (tmp_path / "histories/gauge_at_tip.csv").unlink()
    assert plots.gauges(run) is None


def test_titles_tell_runs_apart(tmp_path: Path) -> None:
    runs = [write_run(tmp_path / t, count=1, spacing=0.002, scene=plate_scene(title=f"Beam, notch at {t} in")) for t in ("2", "4")]
    assert pictures.common_title(runs) == "Beam"
    assert pictures.differences(runs) == ["notch at 2 in", "notch at 4 in"]


def test_slow_cracks_are_not_flattened_by_the_rayleigh_line(tmp_path: Path) -> None:
    import matplotlib.pyplot as plt

    run = write_run(tmp_path, count=2)
    figure = plots.crack_tip(run, "x")
    assert figure.axes[0].get_ylim()[1] > 2100
    path = tmp_path / "histories/crack_tip.csv"
    head, *rows = path.read_text().splitlines()
    slow = [",".join([*row.split(",")[:-1], "50.0"]) for row in rows]
    path.write_text("\n".join([head, *slow]) + "\n")
    assert plots.crack_tip(run, "x").axes[0].get_ylim()[1] < 100
    plt.close("all")


def test_probe_survives_a_crash(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a machine without OpenGL VTK ends the process: the probe takes that for a no."""
    monkeypatch.setattr(backend, "PROBE", "import os; os.abort()")
    backend.choose.cache_clear()
    try:
        chosen = backend.choose()
        assert chosen.name == "matplotlib" and "no EGL" in chosen.notice
        monkeypatch.setattr(backend, "PROBE", "print('drawn', 'vtkSomeWindow')")
        backend.choose.cache_clear()
        assert backend.choose() == backend.Backend("vtk", "vtkSomeWindow")
    finally:
        backend.choose.cache_clear()
        monkeypatch.undo()
        backend.choose()


def test_import_is_light() -> None:
    code = "import sys, taichi_sph.render; print({'vtk', 'vtkmodules', 'matplotlib', 'taichi', 'pyvista'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=dict(os.environ), check=True)
    assert done.stdout.strip() == "set()"
