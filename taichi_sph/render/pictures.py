"""The pictures of a run, written into its folder: damage at the end and over time, plots, a movie.

Everything is read from files: a picture can be drawn again without the run.
"""

from __future__ import annotations

import os
import textwrap
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")  # no display is asked for

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure

from ..errors import SceneError
from ..frame import BodyFrame
from ..output.folder import RunFolder
from ..output.measures.leak import tanks
from . import crater, plan, plots, struck
from .backend import Backend, choose
from .panel import (
    BENT,
    DAMAGE,
    MARGIN,
    MOVED,
    PLASTIC,
    SPEED,
    UPRIGHT,
    Look,
    View,
    cell_values,
    displaced,
    draw,
    magnification,
    round_down,
    view_of,
)
from .sheet import pixels, scale_bar, sheet

DPI = 170
WIDTH = 9.4  # inches of a single panel's page
STRIP_TIMES = 4
TALLEST = 7.0  # inches of a panel
LETTERS = 12  # of a panel's name in an inch
LENGTHS = ((1.0, "m"), (1e3, "mm"), (1e6, "um"), (1e9, "nm"))
MOVIE_DPI = 90
MOVIE_SECONDS = 6.0
MOVIE_BYTES = 3e6
COLOURS = 240
FAST = 99.5  # % of the cells whose speeds the colours tell apart
OWN_SCALE = "sizes are unlike: each run to its own scale"
BROKEN = "broken cells removed; small balls: nodes without cells"


def _times(run: RunFolder) -> np.ndarray:
    return run.frames().times


def look_of(runs: Sequence[RunFolder]) -> Look:
    """Colours and magnification for all pictures of some runs: damage where there is any, else plastic strain, else displacement where
    there is no time, else speed."""
    last = [body for run in runs for body in struck.whole(run, -1)]
    bends = any(shell.motion == "free" for run in runs for shell in run.scene.shells)
    factor = min(magnification(struck.whole(run, -1), BENT if bends else MOVED) for run in runs)
    if any("damage" in b.cell_data and np.max(b.cell_data["damage"], initial=0) > 0 for b in last):
        return Look("damage", "damage D [-]", DAMAGE, 0.0, 1.0, factor)
    yielded = max((float(np.max(b.cell_data["plastic"], initial=0)) for b in last if "plastic" in b.cell_data), default=0.0)
    if yielded > 0:
        return Look("plastic", "plastic strain p [-]", PLASTIC, 0.0, yielded, factor)
    if any(run.scene.increments is not None for run in runs):
        farthest = max(float(np.max(cell_values(b, "displacement"), initial=0)) for b in last) or 1.0
        scale, unit = next(((s, u) for s, u in LENGTHS if farthest * s >= 1), LENGTHS[-1])
        return Look("displacement", f"displacement [{unit}]", SPEED, 0.0, farthest, factor, scale)
    moving = [cell_values(b, "speed") for run in runs for i in (0, -1) for b in struck.whole(run, i)]
    fastest = max(float(np.percentile(v, FAST)) if len(v) else 0.0 for v in moving)  # a loose cell does not decide
    return Look("speed", "speed [m/s]", SPEED, 0.0, fastest or 1.0, factor)


def time_text(time: float, last: float) -> str:
    scale, unit = plots.time_scale(last)
    return f"{time * scale:.3g} {unit}"


def instant(run: RunFolder, index: int, last: float | None = None) -> str:
    """What a frame shows, in words: the time; the part of the load, or the number of the mode, where there is none."""
    scene, time = run.scene, float(_times(run)[index])
    if scene.static is not None:
        part = time / scene.duration
        if scene.static.method == "arc":
            found = run.history("progress")
            part = float(found["load"][int(np.argmin(np.abs(found.time - time)))])
        return f"{100 * part:.3g} % of the load"
    if scene.modes is not None:
        number = round(scene.modes.count * time / scene.duration)
        found = run.history("progress")
        row = np.flatnonzero(found["mode"] == number)
        return f"mode {number}, {found['frequency'][row[-1]]:.4g} Hz" if number and len(row) else "at rest"
    return "" if scene.limit is not None else f"t = {time_text(time, float(_times(run)[-1]) if last is None else last)}"


def _magnified(look: Look) -> str:
    return "true deformation" if look.magnification == 1 else f"displacements × {look.magnification:g}"


def _gap(look: Look) -> str:
    return "broken cells removed" if look.field == "damage" else ""


def _page(
    panels: Sequence[tuple[list[BodyFrame], str]],
    look: Look,
    view: View | Sequence[View],
    title: str,
    subtitle: str,
    columns: int,
    backend: Backend,
    dpi: int = DPI,
) -> Figure:
    """Panels under one title and beside one colour bar; sizes follow the view, so no space is wasted. Several views, one a panel, are of
    one aspect, and each panel has its own ticks, or in space a bar."""
    views = [view] * len(panels) if isinstance(view, View) else list(view)
    own, view = not isinstance(view, View), views[0]
    rows = -(-len(panels) // columns)
    wide = WIDTH if columns == 1 else 12.0
    left, right, top, bottom, between = 0.62, 0.95, 0.62, 0.5, 0.62 if own and view.turn is None else 0.22  # inches
    across = (wide - left - right - (columns - 1) * between) / columns
    if across * view.aspect > TALLEST:
        across = TALLEST / view.aspect
        wide = max(6.5, left + right + columns * across + (columns - 1) * between)
    names = [textwrap.fill(name, max(12, int(LETTERS * across))) for _, name in panels]
    above = 0.26 + 0.17 * max(name.count("\n") for name in names) if any(names) else 0.02
    tall = across * view.aspect
    height = top + rows * (tall + above) + (rows - 1) * 0.12 + bottom
    with plt.rc_context(plots.STYLE):
        figure = plt.figure(figsize=(wide, height), dpi=dpi)
        figure.text(left / wide, 1 - 0.2 / height, title, fontsize=13, weight="bold", va="center", color="#1d2429")
        figure.text(left / wide, 1 - 0.44 / height, subtitle, fontsize=9.5, va="center", color="#5a6670")
        for number, ((bodies, _), name) in enumerate(zip(panels, names)):
            row, column = divmod(number, columns)
            x = left + column * (across + between)
            y = height - top - (row + 1) * (tall + above) - row * 0.12
            axes = figure.add_axes((x / wide, y / height, across / wide, tall / height))
            draw(axes, bodies, look, views[number], backend.name == "vtk")
            if view.turn is not None:
                axes.set_axis_off()
                if own:
                    scale_bar(axes, views[number], round_down(0.28 * (views[number].x1 - views[number].x0)), tall)
            axes.set_title(name, fontsize=10, weight="normal", pad=3, x=MARGIN / (1 + 2 * MARGIN), color="#2b333a")
            axes.tick_params(labelsize=8, length=2.5)
            for side in axes.spines.values():
                side.set_visible(False)
            if row == rows - 1 or own or view.turn is not None:
                axes.set_xlabel("x [mm]", fontsize=9)
            else:
                axes.tick_params(bottom=False, labelbottom=False)
            if column == 0 or own:
                axes.set_ylabel("y [mm]", fontsize=9)
            else:
                axes.tick_params(left=False, labelleft=False)
        whole = rows * (tall + above) + (rows - 1) * 0.12 - above
        bar_height = min(whole, 3.2)
        bar = figure.add_axes(
            ((wide - right + 0.18) / wide, (bottom + (whole - bar_height) / 2) / height, 0.14 / wide, bar_height / height)
        )
        figure.colorbar(ScalarMappable(look.bar(), look.colours), cax=bar, extend="max" if look.field == "speed" else "neither")
        bar.set_ylabel(look.label, fontsize=9)
        bar.tick_params(labelsize=8, length=2.5)
        for side in bar.spines.values():
            side.set_visible(False)
        bar.yaxis.label.set_color("#2b333a")
    return figure


LARGEST = 300_000  # bytes of a picture that is kept in the repository


def reduced(source: Path, target: Path) -> Path:
    """A copy of a picture with 256 colours: a third of the size, and the eye does not tell. A page that is larger than LARGEST all the same
    is drawn smaller, and one of many balls with the colours that cover its range, not those that are most of it."""
    from PIL import Image

    target.parent.mkdir(parents=True, exist_ok=True)
    temporary = target.with_name(target.name + ".tmp")
    with Image.open(source) as image:
        whole = image.convert("RGB")
    most, range_ = Image.Quantize.MEDIANCUT, Image.Quantize.MAXCOVERAGE
    for share, method in ((1.0, most), (0.85, most), (0.7, most), (0.7, range_), (0.55, range_)):
        size = (round(share * whole.width), round(share * whole.height))
        page = whole if share == 1.0 else whole.resize(size, Image.Resampling.LANCZOS)
        page.quantize(256, method=method, dither=Image.Dither.NONE).save(temporary, format="PNG", optimize=True)
        if temporary.stat().st_size < LARGEST:
            break
    os.replace(temporary, target)
    return target


def _save(figure: Figure, path: Path, dpi: int = DPI) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(path.name + ".tmp")
    figure.savefig(temporary, dpi=dpi, format="png")
    plt.close(figure)
    os.replace(temporary, path)
    return path


def strip_frames(run: RunFolder, count: int = STRIP_TIMES) -> list[int]:
    """Frames at even times from the first rupture (or the start) to the last rupture (or the end)."""
    times = _times(run)
    if run.scene.modes is not None:
        return list(range(1, len(times)))
    ruptures = [
        rupture[rupture > 0]
        for b in struck.whole(run, -1)
        if "rupture_time" in b.cell_data
        for rupture in [np.asarray(b.cell_data["rupture_time"], dtype=float)]
    ]
    known = np.concatenate(ruptures) if ruptures else np.empty(0)
    first, last = (known.min(), known.max()) if len(known) else (times[0], times[-1])
    wanted = first + (last - first) * np.arange(1, count + 1) / count
    wanted[-1] = last
    after = [min(int(np.searchsorted(times, t)), len(times) - 1) for t in wanted]
    return sorted(set(after))


def _subtitle(run: RunFolder, *parts: str) -> str:
    scene = run.scene
    numerics = scene.numerics
    head = f"{scene.quality}, {scene.formulations}, spacing {numerics.spacing * 1e3:.3g} mm"
    without = f"without {', '.join(names)}" if (names := struck.hidden(run)) else ""
    return "   ·   ".join([head, *_finer(run), *(p for p in (*parts, without) if p)])


def _finer(run: RunFolder) -> list[str]:
    """Of each fluid that is finer in a part of it, how fine."""
    sizes = {fluid.name: run.frames(fluid.name).body(0).point_data["diameter"] for fluid in run.scene.fluids if fluid.finer}
    return [f"{name} {1e3 * own.max():.3g} to {1e3 * own.min():.3g} mm" for name, own in sizes.items()]


def render_run(folder: Path | str, notice: Callable[[str], None] | None = None, movie: bool = False) -> list[Path]:
    """Draws all pictures of a run into DIR/pictures; returns their paths. `notice` is told why VTK is not used.

    `movie` draws the movie alone. Without it a run of shells gets one beside its stills, a run with strikers or water does
    not: its frames take seconds each.
    """
    backend = choose()
    if backend.notice and notice is not None:
        notice(backend.notice)
    with RunFolder(folder) as run:
        if movie:
            return _movies(run, backend)
        paths = _struck(run, backend) if struck.applies(run) else _stills(run, backend)
        if "energies" in run.histories():
            figure = plots.energies(run, f"{run.scene.title}: energy")
            if figure is not None:
                paths.append(_save(figure, run.pictures / "energies.png"))
        if (figure := plots.gauges(run)) is not None:
            paths.append(_save(figure, run.pictures / "gauges.png"))
        for name in run.histories():
            if name.startswith("crack_tip"):
                figure = plots.crack_tip(run, f"{run.scene.title}: tip of the crack", name)
                paths.append(_save(figure, run.pictures / f"{name}.png"))
            if name.startswith("fragments") and (figure := plots.fragments(run, name)) is not None:
                paths.append(_save(figure, run.pictures / f"{name}.png"))
        return paths + ([] if struck.applies(run) else _movies(run, backend))


def _whole_view(run: RunFolder, look: Look) -> View:
    """The window of all pictures of a run of shells."""
    times = _times(run)
    others = [b for i in range(0, len(times) - 1, max(1, len(times) // 10)) for b in struck.whole(run, i)]
    return view_of(struck.whole(run, -1), look.magnification, others)


def _stills(run: RunFolder, backend: Backend) -> list[Path]:
    """The end and some instants of a run of shells."""
    scene, out = run.scene, run.pictures
    look = look_of([run])
    view = _whole_view(run, look)
    final = _page(
        [(struck.whole(run, -1), "")],
        look, view, scene.title,
        _subtitle(run, instant(run, -1), _magnified(look), _gap(look)),
        1, backend,
    )  # fmt: skip
    paths = [_save(final, out / f"{look.field}.png")]
    chosen = strip_frames(run)
    if len(chosen) > 1:
        strip = _page(
            [(struck.whole(run, i), instant(run, i)) for i in chosen],
            look, view, scene.title, _subtitle(run, _magnified(look), _gap(look)), 4 if view.aspect > 1.3 else 2, backend,
        )  # fmt: skip
        paths.append(_save(strip, out / f"{look.field}_over_time.png"))
    return paths


def _struck(run: RunFolder, backend: Backend) -> list[Path]:
    """The end, some instants, strikers and leak of a run with several kinds of bodies."""
    out, looks, last = run.pictures, struck.looks_of([run]), len(_times(run)) - 1
    paths = []
    if struck.suffers(run):
        words = ("true deformation", BROKEN)
        paths.append(_save(struck.final_page(run, looks, backend, _subtitle(run, instant(run, -1), *words)), out / "impact.png"))
        chosen = struck.strip_instants(run)
        if len(chosen) > 1:
            strip = struck.strip_page(run, looks, backend, _subtitle(run, *words), chosen)
            paths.append(_save(strip, out / "impact_over_time.png"))
    else:
        chosen = sorted({round(i) for i in np.linspace(0, last, 6)})
        fields = ("pressure", "speed", *(("density",) if len(struck.densities([run])) > 1 else ()))
        for field in fields if run.of_kind("fluid") else ("motion",):
            strip = struck.free_strip(run, looks, field, backend, chosen, _subtitle(run), DPI)
            paths.append(_save(strip, out / f"{field}_over_time.png"))
    for name, figure in (
        ("strikers", plots.strikers(run)),
        ("crater", crater.section(run)),
        ("plan", plan.plan(run)),
        ("pressure", plots.piston(run)),
        *((name, plots.leak(run, fluid)) for fluid, name in tanks(run).items()),
    ):
        if figure is not None:
            paths.append(_save(figure, out / f"{name}.png"))
    return paths


def _movies(run: RunFolder, backend: Backend) -> list[Path]:
    """The movie of a run, where it has more than two frames of a motion."""
    times = _times(run)
    if len(times) <= 2 or run.scene.modes is not None:
        return []
    if struck.applies(run):
        return [_movie(_struck_pages(run, backend), run.pictures / "movie.gif")]
    look = look_of([run])
    view = _whole_view(run, look)

    def pages() -> Iterator[Figure]:
        for index in range(len(times)):
            yield _page(
                [(struck.whole(run, index), "")], look, view, run.scene.title,
                _subtitle(run, instant(run, index), _magnified(look), _gap(look)), 1, backend, MOVIE_DPI,
            )  # fmt: skip

    return [_movie(pages(), run.pictures / f"{look.field}.gif")]


def _struck_pages(run: RunFolder, backend: Backend) -> Iterator[Figure]:
    looks, every = struck.looks_of([run]), range(len(_times(run)))
    if not struck.suffers(run):
        for index in every:
            yield struck.free_strip(run, looks, "pressure", backend, [index], _subtitle(run, instant(run, index)), MOVIE_DPI)
        return
    outer = "back" if abs(struck.sides(run).direction @ UPRIGHT) > 0.9 else "front"
    views = struck.views_of(run, every[:: max(1, len(every) // 12)])
    for index in every:
        shots = struck.shots_at(run, index, looks, views, (outer, "section"))
        words = _subtitle(run, instant(run, index), "true deformation", BROKEN)
        yield sheet([shots], run.scene.title, words, backend, MOVIE_DPI)


def _movie(figures: Iterator[Figure], path: Path) -> Path:
    """Figures as a GIF of about six seconds, which rests on the last one; smaller pages until it is below 3 MB."""
    from PIL import Image

    pages = []
    for figure in figures:
        pages.append(Image.fromarray(pixels(figure)))
        plt.close(figure)
    # one palette for all, or colours flicker: that of some pages side by side
    some = [pages[round(i)] for i in np.linspace(0, len(pages) - 1, min(5, len(pages)))]
    wall = Image.new("RGB", (sum(p.width for p in some), some[0].height))
    for number, page in enumerate(some):
        wall.paste(page, (number * page.width, 0))
    palette = wall.quantize(COLOURS, method=Image.Quantize.MAXCOVERAGE)
    paper = np.array(palette.getpalette()).reshape(-1, 3)
    paper[paper.min(axis=1) > 243] = 255  # the paper stays white; no colour of a look is so light
    palette.putpalette(paper.ravel().tolist())
    each = max(40, int(1000 * MOVIE_SECONDS / len(pages)))
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(path.name + ".tmp")
    share = 1.0
    while True:
        size = (round(share * pages[0].width), round(share * pages[0].height))
        small = [page if share == 1 else page.resize(size, Image.Resampling.LANCZOS) for page in pages]
        small = [page.quantize(palette=palette, dither=Image.Dither.NONE) for page in small]
        small[0].save(
            temporary, format="GIF", save_all=True, append_images=small[1:], duration=[each] * (len(small) - 1) + [2000],
            loop=0, optimize=True,
        )  # fmt: skip
        excess = temporary.stat().st_size / MOVIE_BYTES
        if excess <= 1 or share < 0.2:
            break
        share *= min(0.9, 0.97 / np.sqrt(excess))
    os.replace(temporary, path)
    return path


def render_compare(
    folders: Sequence[Path | str],
    out: Path | str,
    *,
    labels: Sequence[str] | None = None,
    title: str = "",
    columns: int = 2,
) -> Path:
    """The last frames of several runs of like bodies on one page, with the same colours and magnification.

    `labels` default to what tells the runs apart: the ends of their titles, or settings that differ.
    """
    if not folders:
        raise SceneError("nothing to compare: give the folders of at least two runs")
    runs = [RunFolder(f) for f in folders]
    try:
        names = list(labels) if labels is not None else differences(runs)
        if all(struck.applies(run) and run.of_kind("shell") for run in runs):
            return _save(struck.compare_page(runs, names, title or common_title(runs), choose()), Path(out))
        for run in runs:
            if not run.of_kind("shell"):
                raise SceneError(f"'{run.path}' holds no shell, and shells are what is compared; render shows it by itself")
        look = look_of(runs)
        views = [view_of(struck.whole(run, -1), look.magnification) for run in runs]
        turn = next((v.turn for v in views if v.turn is not None), None)
        if turn is not None:  # what is flat is seen as the others are
            flat = [_points(struck.whole(run, -1), look.magnification) for run in runs]
            views = [struck.window(points, turn, MARGIN) if v.turn is None else v for v, points in zip(views, flat)]
        view = struck.together(views)
        unlike = isinstance(view, list)
        last = max(float(_times(run)[-1]) for run in runs)
        ends = ["" if run.scene.static is not None else instant(run, -1, last) for run in runs]  # the whole load
        panels = [(struck.whole(run, -1), f"{name}   ({end})" if end else name) for run, name, end in zip(runs, names, ends, strict=True)]
        subtitle = "   ·   ".join(p for p in (f"at the end of each run, {_magnified(look)}", _gap(look), OWN_SCALE if unlike else "") if p)
        page = _page(panels, look, view, title or common_title(runs), subtitle, min(columns, len(panels)), choose())
        return _save(page, Path(out))
    finally:
        for run in runs:
            run.close()


def _points(bodies: Sequence[BodyFrame], factor: float) -> np.ndarray:
    """All nodes of surfaces, at rest and displaced (N, 3) [m]."""
    return np.concatenate([points for body in bodies for points in (body.reference, displaced(body, factor))])


def alike(folders: Sequence[Path | str]) -> bool:
    """Whether the last frames of runs without time show something at one scale: the largest displacement of each is
    a twentieth of that of all at least. Where there is time, always; without a shell never."""
    farthest = []
    for folder in folders:
        with RunFolder(folder) as run:
            if not run.of_kind("shell"):
                return False
            if run.scene.increments is None:
                return True
            farthest.append(max(float(np.max(cell_values(b, "displacement"), initial=0)) for b in struck.whole(run, -1)))
    return min(farthest) >= 0.05 * max(farthest) > 0


def render_targets(summary: dict[str, Any], out: Path | str) -> Path:
    """The numbers of a study beside what was expected of them."""
    return _save(plots.targets(summary), Path(out))


def common_title(runs: Sequence[RunFolder]) -> str:
    """The clauses that all titles begin with; where there are none what all come from, or nothing."""
    sources = {run.scene.source for run in runs}
    return _same_clauses(runs) or (runs[0].scene.source if len(sources) == 1 else "")


def _same_clauses(runs: Sequence[RunFolder]) -> str:
    return ", ".join(os.path.commonprefix([run.scene.title.split(", ") for run in runs]))


def differences(runs: Sequence[RunFolder]) -> list[str]:
    """For each run what it does not share with the others: the end of its title, its settings, its folder."""
    common = _same_clauses(runs)
    ends = [run.scene.title.removeprefix(common).lstrip(", ") for run in runs]
    if len(set(ends)) == len(runs):
        return ends
    settings = []
    for run in runs:
        scene = run.scene
        given = {k: f"{v:g}" if isinstance(v, float) else str(v) for k, v in scene.parameters.items()}
        plain = {"scene": scene.name, "quality": scene.quality, "formulation": scene.formulations}
        settings.append(given | plain | {"spacing": f"{scene.numerics.spacing * 1e3:.3g} mm"})
    names = dict.fromkeys(name for found in settings for name in found)
    telling = [name for name in names if len({found.get(name) for found in settings}) > 1]
    spoken = ("scene", "quality", "formulation")  # their values need no name
    texts = [", ".join(f[n] if n in spoken else f"{n} = {f[n]}" for n in telling if n in f) for f in settings]
    return [text or run.path.name for text, run in zip(texts, runs, strict=True)]
