"""The command line: `taichi-sph run | resume | validate | render | compare | results | sweep | price | bench | spectrum |
stability | doctor`, and `main(scene)` for scripts that are run themselves.

Whatever a user gives, the answer is a sentence and an exit code: 2 for a bad scene, mesh, checkpoint or
option, 3 for a run that stopped itself, 130 for an interrupt with checkpoint.
"""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from typer.exceptions import TyperException

from . import __version__
from .errors import SceneError, TaichiSphError, nearest
from .scene.schema import Scene
from .scene.script import SceneFunction, load, load_scene, parameters_of
from .scene.study import Study

SCENES = Path("scenes")

app = typer.Typer(
    name="taichi-sph",
    help="Thin shells that break, by smoothed particles. Scenes are Python scripts in scenes/.",
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)

SceneArgument = Annotated[
    str, typer.Argument(metavar="SCENE", help="A name in scenes/ or of a scene of the package, a .py script or a .json file.")
]
QualityOption = Annotated[str | None, typer.Option("--quality", "-q", help="draft, standard or paper.")]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", "-s", metavar="KEY=VALUE", help="A parameter of the scene, or a key such as numerics.spacing=1mm."),
]
OutOption = Annotated[Path | None, typer.Option("--out", "-o", metavar="DIR", help="Default: runs/<scene>-<quality>.")]
OverwriteOption = Annotated[bool, typer.Option("--overwrite", help="Replace the run that DIR holds.")]
Arch = Literal["cpu", "cuda", "vulkan", "metal"]
ArchOption = Annotated[Arch, typer.Option("--arch", help="Where to compute.")]
ThreadsOption = Annotated[int | None, typer.Option("--threads", min=1, help="CPU threads; default: all.")]
PicturesOption = Annotated[bool, typer.Option("--pictures/--no-pictures", help="Draw pictures at the end.")]
SchedulerOption = Annotated[str | None, typer.Option("--scheduler", metavar="ADDRESS", help="Of a Dask cluster; default: this machine.")]
WorkersOption = Annotated[int, typer.Option("--workers", min=1, help="Points at a time on this machine.")]
PatienceOption = Annotated[float | None, typer.Option("--patience", min=1, metavar="SECONDS", help="A point that takes longer is ended.")]
RunArgument = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a run.")]


@app.callback(invoke_without_command=True)
def _top(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    if version:
        typer.echo(f"taichi-sph {__version__}")
        raise typer.Exit


@app.command()
def run(
    scene: SceneArgument,
    quality: QualityOption = None,
    set_: SetOption = None,
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    arch: ArchOption = "cpu",
    threads: ThreadsOption = None,
    pictures: PicturesOption = True,
) -> None:
    """Run a scene, or all scenes of a study, then say in words and pictures what happened."""
    found = load(_find(scene), settings(quality, set_))
    how: dict[str, Any] = {"arch": arch, "threads": threads, "pictures": pictures}
    _start(found, out, overwrite, **how, command=command_line(scene, quality, set_))


@app.command()
def resume(
    folder: RunArgument,
    set_: SetOption = None,
    arch: ArchOption = "cpu",
    threads: ThreadsOption = None,
    pictures: PicturesOption = True,
) -> None:
    """Go on with an interrupted run from its newest checkpoint, exactly; of a study, run what is not finished. A finished run goes on to a
    later end: --set duration=20ms. A search for equilibrium that stopped may go on with another static.method, static.residual or
    static.max_steps."""
    from .run import session

    if (folder / "study.json").is_file():
        if set_:
            raise SceneError(f"--set: '{folder}' is a study, which goes on as it was said; resume one of its cases with other settings")
        from .output.study import read_study

        _start(read_study(folder), folder, False, arch=arch, threads=threads, pictures=pictures, command="")
        return
    session.resume(folder, arch=arch, threads=threads, pictures=pictures, settings=settings(None, set_))


@app.command()
def validate(
    scene: SceneArgument,
    quality: QualityOption = None,
    set_: SetOption = None,
    out: OutOption = None,
    arch: ArchOption = "cpu",
) -> None:
    """Check a whole scene and print what a run would take; nothing is computed or written."""
    from .output.record import scene_hash
    from .run import gate
    from .run.plan import LARGE
    from .run.progress import Progress
    from .run.tell import tell_plan
    from .studies.price.words import recorded

    found = load(_find(scene), settings(quality, set_))
    folder = out or gate.default_out(found)
    if isinstance(found, Study):
        from .studies import study

        plans = study.plan_study(found, arch, LARGE)
        gate.check_out(folder, sum(p.disk for p in plans.values()), "study.json")
        study.tell_study(found, plans, Progress())
    else:
        planned = gate.checked_plan(found, arch, LARGE)
        gate.check_out(folder, planned.disk)
        tell_plan(found, planned, Progress())
        for line in recorded(found, scene_hash):
            typer.echo(f"  {line}")
    path = _find(scene)
    if path.suffix == ".py":
        names = [name for name in parameters_of(path) if name != "quality"]  # their values stand in the first line
        typer.echo(f"  --set takes {', '.join([*names, ''])}any key such as numerics.spacing")
    typer.echo("valid")


@app.command()
def new(name: Annotated[str, typer.Argument(metavar="NAME", help="The name of the scene, which becomes NAME.py.")]) -> None:
    """Write a commented scene to start from, into scenes/ where there is such a folder, else here."""
    from .run.new import write_scene

    path = write_scene(name, SCENES if SCENES.is_dir() else Path())
    typer.echo(f"written: {path}; try it with: taichi-sph run {path}")


@app.command()
def render(
    folder: RunArgument,
    movie: Annotated[bool, typer.Option("--movie", help="Draw all frames as one animated GIF instead.")] = False,
) -> None:
    """Draw the pictures of a finished or interrupted run again, from its files; of a study, the comparison."""
    from .run.draw import draw
    from .studies import study

    for path in study.draw_study(folder) if (folder / "study.json").is_file() else draw(folder, movie=movie):
        typer.echo(path)


@app.command()
def compare(
    folders: Annotated[list[Path], typer.Argument(metavar="DIR", help="The folders of runs.")],
    out: Annotated[Path, typer.Option("--out", "-o", metavar="FILE", help="Where the picture goes.")] = Path("comparison.png"),
    title: Annotated[str, typer.Option("--title", help="Default: what the titles of the runs share.")] = "",
) -> None:
    """Draw the ends of several runs on one page, with the same colours and magnification."""
    from .run.draw import can_draw
    from .run.progress import Progress

    if not can_draw(Progress()):
        return
    from .render import render_compare

    typer.echo(render_compare(folders, out, title=title))


@app.command()
def results(
    folders: Annotated[list[Path] | None, typer.Argument(metavar="DIR", help="Runs whose summaries are to be recorded first.")] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="FILE", help="Write RESULTS.md, or the table between the marks of README.md."),
    ] = None,
) -> None:
    """Record runs, and print the tables of all that are recorded: what they found against what was expected."""
    from .output import results as table
    from .output.folder import RunFolder

    for folder in folders or ():
        with RunFolder(folder) as run_folder:
            recorded = table.record_summary(run_folder)
            typer.echo(f"recorded: {recorded}")
            picture = table.main_picture(run_folder)
        if picture is not None:
            from .render import reduced

            typer.echo(f"recorded: {reduced(picture, table.picture_of(recorded.stem))}")
    summaries = table.read_summaries()
    if not summaries:
        raise SceneError(f"no run is recorded in {table.FOLDER}; record one with: taichi-sph results DIR")
    for name, why in table.stale(summaries, _scene_of).items():
        typer.echo(f"{name} is out of date: {why}", err=True)
    text = table.markdown(summaries.values())
    if out is None:
        typer.echo(text)
        return
    marked = table.into(out.read_text(encoding="utf-8"), table.overview(summaries.values())) if out.is_file() else None
    out.write_text(text if marked is None else marked, encoding="utf-8")
    typer.echo(out)


def _scene_of(summary: dict[str, Any]) -> Any:
    """Today's scene with the settings of a recorded run. Its name may come from a stranger: it is looked up and never taken for a path."""
    path = _named(str(summary["scene"]))
    named = set(parameters_of(path))
    chosen = {k: v for k, v in summary["settings"].items() if k in named or "." in k}
    return load(path, {**chosen, "quality": summary["quality"]} if summary["quality"] != "custom" else chosen)


@app.command()
def sweep(
    scene: SceneArgument,
    vary: Annotated[
        list[str], typer.Option("--vary", metavar="KEY=A,B,...", help="An option or key of the scene and its values; may be repeated.")
    ],
    quality: QualityOption = None,
    set_: SetOption = None,
    alone: Annotated[bool, typer.Option("--one-at-a-time", help="One setting at a time instead of every combination.")] = False,
    out: Annotated[Path | None, typer.Option("--out", "-o", metavar="DIR", help="Default: runs/<scene>-sweep.")] = None,
    scheduler: SchedulerOption = None,
    workers: WorkersOption = 1,
    patience: PatienceOption = None,
    arch: ArchOption = "cpu",
    threads: ThreadsOption = None,
) -> None:
    """Run a scene at many settings, each point in a process of its own, into one table; go on where an earlier one ended."""
    from .studies import sweep as sweeping

    words = command_line(scene, quality, set_, "sweep") + "".join(f" --vary {shlex.quote(pair)}" for pair in vary)
    words += (" --one-at-a-time" if alone else "") + (f" --out {shlex.quote(str(out))}" if out else "")
    how: dict[str, Any] = {
        "alone": alone,
        "scheduler": scheduler,
        "workers": workers,
        "arch": arch,
        "threads": threads,
        "patience": patience,
        "command": words,
    }
    sweeping.main(_find(scene), settings(quality, set_), vary, out, **how)


@app.command()
def price(
    scene: SceneArgument,
    quality: QualityOption = None,
    set_: SetOption = None,
    quantity: Annotated[
        list[str] | None, typer.Option("--quantity", help="What the error is of; may be repeated. Default: those with a target.")
    ] = None,
    also: Annotated[
        list[str] | None, typer.Option("--also", metavar="KEY=VALUE,...", help="A point with several settings at once; may be repeated.")
    ] = None,
    seeds: Annotated[int, typer.Option("--seeds", min=0, help="Runs with moved nodes, of scenes that break.")] = 3,
    most: Annotated[float, typer.Option("--most", min=1, help="Leave out what costs more than that many times the scene as it is.")] = 30.0,
    out: Annotated[Path | None, typer.Option("--out", "-o", metavar="DIR", help="Default: runs/<scene>-price.")] = None,
    scheduler: SchedulerOption = None,
    workers: WorkersOption = 1,
    patience: PatienceOption = 300.0,
    record: Annotated[bool, typer.Option("--record", help="Copy to benchmarks/price and renders; validate tells it then.")] = False,
    arch: ArchOption = "cpu",
    threads: ThreadsOption = None,
) -> None:
    """Turn the knobs of a scene one at a time: error against cost, as a chart, a table and in words."""
    from .studies.price import command as pricing

    words = command_line(scene, quality, set_, "price") + "".join(f" --quantity {shlex.quote(name)}" for name in quantity or ())
    words += "".join(f" --also {shlex.quote(text)}" for text in also or ())
    words += "" if seeds == 3 else f" --seeds {seeds}"
    words += "" if most == 30.0 else f" --most {most:g}"
    how: dict[str, Any] = {
        "scheduler": scheduler,
        "workers": workers,
        "arch": arch,
        "threads": threads,
        "patience": patience,
        "record": record,
    }
    asked: dict[str, Any] = {"quantities": quantity or (), "also": also or (), "seeds": seeds, "most": most}
    pricing.main(_find(scene), settings(quality, set_), out, **asked, **how, command=words)


@app.command()
def bench(
    nodes: Annotated[list[int] | None, typer.Option("--nodes", help="Sizes to measure; may be repeated.")] = None,
    arch: ArchOption = "cpu",
    threads: ThreadsOption = None,
    precision: Annotated[Literal["f64", "f32"], typer.Option("--precision")] = "f64",
    fluid: Annotated[bool, typer.Option("--fluid", help="Of water instead of a shell.")] = False,
    metal: Annotated[bool, typer.Option("--metal", help="Of a bent shell of metal that yields and tears.")] = False,
    solid: Annotated[bool, typer.Option("--solid", help="Of solids: elastic, of metal, of particles.")] = False,
    elements: Annotated[bool, typer.Option("--elements", help="Of shells of finite elements beside particles.")] = False,
    coupled: Annotated[bool, typer.Option("--coupled", help="Of the filled tank beside its parts; time outside kernels.")] = False,
    quality: Annotated[str, typer.Option("--quality", "-q", help="With --coupled: of the tank.")] = "draft",
    out: Annotated[Path | None, typer.Option("--out", "-o", metavar="FILE", help="Keep the numbers as JSON.")] = None,
) -> None:
    """Measure node-steps per second, bytes per node-step, memory bandwidth and time to the first step."""
    from .verification import bench as measuring
    from .verification import bench_elements, bench_solid

    asked = {"--fluid": fluid, "--metal": metal, "--solid": solid, "--elements": elements, "--coupled": coupled}
    given = [name for name, one in asked.items() if one]
    if len(given) > 1:
        raise SceneError(f"{given[0]} and {given[1]} are both given: bench measures one of them")
    if coupled:
        if nodes or precision != "f64":
            raise SceneError("--coupled measures the tank at its own counts, in f64: leave --nodes and --precision out, or give --quality")
        from .verification import coupled as together

        together.main(_find, quality, arch, threads, out)
        return
    if elements:
        bench_elements.main(tuple(nodes or ()), arch, threads, precision, out)
        return
    (bench_solid.main if solid else measuring.main_fluid if fluid else measuring.main_metal if metal else measuring.main)(
        tuple(nodes or ()), arch, threads, precision, out
    )


@app.command()
def spectrum(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="A scene with one plate.")] = "crack_branching",
    set_: SetOption = None,
    cells: Annotated[int, typer.Option("--cells", min=4, max=40, help="Cells on a side of the square plate.")] = 12,
    count: Annotated[int, typer.Option("--count", min=1, help="How many modes are printed.")] = 12,
    picture: Annotated[Path | None, typer.Option("--picture", metavar="FILE", help="Draw the lowest modes, e.g. modes.png.")] = None,
) -> None:
    """Compare the lowest frequencies of a free plate in its plane and of a free curved patch with the finite-element method's."""
    from .verification import spectrum as measuring

    measuring.main(_scene(scene, None, set_), cells, count, picture)


@app.command()
def stability(
    only: Annotated[list[str] | None, typer.Option("--only", metavar="KNOB", help="This knob alone, e.g. 'e/D'; may be repeated.")] = None,
    record: Annotated[bool, typer.Option("--record", help="Keep in benchmarks/stability.json, draw renders/stability.png.")] = False,
) -> None:
    """Map where runs hold: for each knob the range, by bisection, beside what is predicted. Half an hour."""
    from .verification import stability as measuring

    measuring.main(only or (), record)


@app.command()
def doctor(
    arch: ArchOption = "cpu",
    scene: Annotated[
        str | None, typer.Option("--scene", metavar="SCENE", help="What this scene takes instead: fields, bytes, kernels.")
    ] = None,
    quality: QualityOption = None,
    set_: SetOption = None,
    fields: Annotated[bool, typer.Option("--fields", help="With --scene: what each of its fields is, as a table.")] = False,
) -> None:
    """Check this machine: Python, Taichi, threads, pictures, cache, disk; say how to mend what fails."""
    from .run.doctor import account, examine

    if fields:
        from .run.fields import markdown, rows
        from .world.world import World

        if scene is None:
            raise SceneError("--fields needs --scene: fields are those of a scene")
        typer.echo(markdown(rows(World(_scene(scene, quality, set_), arch=arch).pools)).strip())
        return
    if scene is not None:
        account(_scene(scene, quality, set_), arch)
        return

    if not examine(arch):
        raise typer.Exit(1)


def main(scene: SceneFunction | None = None, arguments: list[str] | None = None) -> None:
    """The program. With a scene function: `python scenes/x.py --quality standard --set a=8 --out DIR`."""
    command = app if scene is None else _command_of(scene)
    name = None if scene is None else Path(sys.argv[0]).name
    sys.exit(_guarded(command, arguments, name))


def _guarded(command: typer.Typer, arguments: list[str] | None, name: str | None = None) -> int:
    """Runs a command; what it has to say about failure is one line on stderr."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # a title that the terminal cannot show is no reason to stop
    try:
        return command(args=arguments, prog_name=name, standalone_mode=False) or 0
    except TaichiSphError as error:
        return _say(str(error), error.exit_code)
    except TyperException as error:
        return _say(error.format_message().replace("\n", " "), 2)
    except (KeyboardInterrupt, typer.Abort):
        return _say("interrupted; nothing more was saved", 130)
    except OSError as error:  # the disk fills up, a folder vanishes
        where = f" '{error.filename}'" if error.filename else ""
        return _say(f"{error.strerror or error}{where}", 1)


def _say(text: str, code: int) -> int:
    print(f"taichi-sph: {text}", file=sys.stderr)
    return code


def _command_of(function: SceneFunction) -> typer.Typer:
    """A program with one command: this scene."""
    single = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    options = ", ".join(f"{k} = {p.default}" for k, p in parameters_of(function).items())

    @single.command(help=f"{(sys.modules[function.__module__].__doc__ or '').strip()}\n\nOptions for --set: {options}")
    def run(
        quality: QualityOption = None,
        set_: SetOption = None,
        out: OutOption = None,
        overwrite: OverwriteOption = False,
        arch: ArchOption = "cpu",
        threads: ThreadsOption = None,
        pictures: PicturesOption = True,
    ) -> None:
        found = load(function, settings(quality, set_))
        how: dict[str, Any] = {"arch": arch, "threads": threads, "pictures": pictures}
        _start(found, out, overwrite, **how, command=command_line(found.name, quality, set_))

    return single


def command_line(scene: str, quality: str | None, pairs: list[str] | None, command: str = "run") -> str:
    """What to type to run the same again."""
    words = ["taichi-sph", command, scene]
    if quality is not None:
        words += ["--quality", quality]
    for pair in pairs or ():
        words += ["--set", pair]
    return shlex.join(words)


def settings(quality: str | None, pairs: list[str] | None) -> dict[str, Any]:
    """['a=8', 'numerics.spacing=1mm'] as a dictionary of texts."""
    found: dict[str, Any] = {}
    for pair in pairs or ():
        key, equals, value = pair.partition("=")
        if not equals or not key.strip() or not value.strip():
            raise SceneError(f"--set '{pair}' is not of the form key=value")
        if key.strip() in found:
            raise SceneError(f"--set {key.strip()} is given twice")
        found[key.strip()] = value.strip()
    if quality is not None:
        if found.setdefault("quality", quality) != quality:
            raise SceneError(f"--quality {quality} contradicts --set quality={found['quality']}")
    return found


def _find(name: str) -> Path:
    """A path as it is, or the name of a scene."""
    path = Path(name)
    if path.suffix or path.is_file():
        return path
    try:
        return _named(name)
    except SceneError as error:
        if Path(f"{name}.py").is_file():
            raise SceneError(f"there is no scene '{name}' in scenes/; the script here is '{name}.py'") from error
        raise


def _named(name: str) -> Path:
    """The script of a scene by its name alone."""
    paths = {p.stem: p for folder in reversed(scene_folders()) for p in sorted(folder.glob("[!_]*.py"))}
    if name not in paths:
        raise SceneError(f"there is no scene '{name}'{nearest(name, paths)}")
    return paths[name]


def scene_folders() -> list[Path]:
    """Where names of scenes are looked for: scenes/ in the folder one works in, then those that came with the package."""
    package = Path(__file__).resolve().parent
    shipped = package / "scenes"  # of a wheel; in a checkout they stand beside the package
    return [folder for folder in (SCENES, shipped if shipped.is_dir() else package.parent / "scenes") if folder.is_dir()]


def _start(found: Scene | Study, out: Path | None, overwrite: bool, **how: Any) -> None:
    """Run what a script returned; a run that is there already is replaced only if `overwrite` says so."""
    if isinstance(found, Study):
        from .studies.study import run_study

        run_study(found, out, overwrite=overwrite, **how)
    else:
        from .run import gate, session

        folder = out or gate.default_out(found)
        if not overwrite:
            gate.spare(folder)
        session.run(found, folder, **how)


def _scene(name: str, quality: str | None, pairs: list[str] | None) -> Scene:
    return load_scene(_find(name), settings(quality, pairs))
