"""A sweep: one scene with some of its settings varied, each point a run in a process of its own, all of them in one table.

    points/<id>.json    what one point found, written whole or not at all; a point that is done is not run again
    results.csv         a row for each point of the design: settings, status, cost, quantities; SI units
    results.parquet     the same, typed, where pyarrow is installed

A point that crashes, stops itself or makes no valid scene is a row with its sentence. The points run on this machine, or
on the workers of a Dask cluster; there the worker is lent the scene as text and hands back its summary, so nothing needs
to be shared but the installed package (and mesh files, which must lie at the same path). Where a worker dies its point
goes to another one. Only this process writes results, one file for each point, so none is there twice.
"""

from __future__ import annotations

import csv
import hashlib
import io
import itertools
import json
import os
import shlex
import subprocess
import sys
import tempfile
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ..errors import RunInterrupted, RunStopped, SceneError, TaichiSphError, nearest
from ..output import files
from ..output.lock import locked
from ..run.gate import SUMMARY_FILE, check_out
from ..run.progress import Progress, duration_text
from ..scene import Numerics, Scene, Study
from ..scene.script import dump, load, parameters_of, value_at

MARK = "sweep.json"
COST = ("nodes", "stress_points", "steps", "node_steps", "processor_seconds", "bytes", "B_percent", "closed_residual_percent")

Settings = dict[str, Any]


# --- the design -------------------------------------------------------------------------------------


def setting_of(path: Path, found: Scene | Study, name: str) -> str:
    """The full name of a setting: an option of the script, else a dotted key; "spacing" alone means numerics.spacing,
    "support" numerics.formulation.support. SceneError with the nearest name where there is none."""
    options = list(parameters_of(path)) if path.suffix == ".py" else []
    if name in options or name == "duration":
        return name
    if "." in name:
        value_at(found, name)
        return name
    formulation = value_at(found, "numerics.formulation")
    if name in Numerics.model_fields:
        return f"numerics.{name}"
    if name in formulation and name != "kind":
        return f"numerics.formulation.{name}"
    known = [*options, *Numerics.model_fields, *(k for k in formulation if k != "kind"), "duration"]
    raise SceneError(f"--vary {name}: there is no such setting{nearest(name, known)}")


def varied(path: Path, found: Scene | Study, pairs: Sequence[str]) -> dict[str, list[str]]:
    """['spacing=1mm,2mm'] as {'numerics.spacing': ['1mm', '2mm']}; commas inside brackets do not part values."""
    design: dict[str, list[str]] = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        values = [value.strip() for value in parts(text)]
        if not equals or not name.strip() or not all(values):
            raise SceneError(f"--vary '{pair}' is not of the form key=value,value")
        key = setting_of(path, found, name.strip())
        if key in design:
            raise SceneError(f"--vary {name.strip()} is given twice")
        if len(set(values)) < len(values):
            raise SceneError(f"--vary {name.strip()}: a value is given twice")
        design[key] = values
    return design


def parts(text: str) -> Iterator[str]:
    """What stands between commas outside brackets."""
    depth, start = 0, 0
    for i, letter in enumerate(text):
        depth += (letter in "[{") - (letter in "]}")
        if letter == "," and not depth:
            yield text[start:i]
            start = i + 1
    yield text[start:]


def full(design: Mapping[str, Sequence[str]]) -> list[Settings]:
    """Every combination."""
    return [dict(zip(design, values)) for values in itertools.product(*design.values())]


def one_at_a_time(design: Mapping[str, Sequence[str]]) -> list[Settings]:
    """The scene as it is, and each value by itself."""
    return [{}, *({key: value} for key, values in design.items() for value in values)]


# --- points -----------------------------------------------------------------------------------------


def words(settings: Mapping[str, Any]) -> str:
    """'spacing = 2mm, formulation = collocation'."""
    short = {key.removeprefix("numerics.").removeprefix("formulation."): value for key, value in settings.items()}
    return ", ".join(f"{key} = {value}" for key, value in short.items()) or "as it is"


def task(
    path: Path, base: Settings, settings: Settings, *, arch: str = "cpu", threads: int | None = None, patience: float | None = None
) -> dict[str, Any]:
    """What it takes to run one point anywhere: the scene as JSON, or the sentence that says why it is none. patience: seconds
    after which it is ended."""
    from ..output.measures import check_quantities
    from ..output.record import scene_hash

    key = json.dumps([path.stem, {**base, **settings}, arch], sort_keys=True, default=str)
    command = ["taichi-sph", "run", path.stem if path.suffix == ".py" else str(path)]
    for name, value in {**base, **settings}.items():
        command += ["--set", f"{name}={value if isinstance(value, str) else json.dumps(value)}"]
    point = {
        "id": hashlib.sha256(key.encode()).hexdigest()[:12],
        "settings": dict(settings),
        "arch": arch,
        "threads": threads,
        "patience": patience,
        "command": shlex.join(command),
    }
    try:
        found = load(path, {**base, **settings})
        for scene in found.cases.values() if isinstance(found, Study) else (found,):
            check_quantities(scene)
    except TaichiSphError as error:
        return {**point, "scene": None, "scene_hash": None, "sentence": str(error)}
    return {**point, "scene": dump(found), "scene_hash": scene_hash(found)}


def compute(point: Mapping[str, Any]) -> dict[str, Any]:
    """Runs one point in a process of its own and returns its result; this is what a worker of a cluster is asked to do."""
    if point["scene"] is None:
        return _result(point, None, point["sentence"])
    package = str(Path(__file__).parents[2])
    paths = os.pathsep.join(filter(None, (package, os.environ.get("PYTHONPATH", ""))))
    with tempfile.TemporaryDirectory(prefix="taichi-sph-") as folder:
        script, out = Path(folder) / "point.json", Path(folder) / "run"
        script.write_text(point["scene"], encoding="utf-8")
        command = ["run", str(script), "--out", str(out), "--no-pictures", "--arch", point["arch"]]
        if point["threads"]:
            command += ["--threads", str(point["threads"])]
        code, stderr = _child(command, {**os.environ, "PYTHONPATH": paths}, point.get("patience"))
        if code == RunInterrupted.exit_code:
            raise RunInterrupted(f"point {words(point['settings'])} was interrupted")
        if code == 0:
            summary = json.loads((out / SUMMARY_FILE).read_text(encoding="utf-8"))
            return _result(point, {**summary, "command": point["command"]}, "")
    if code is None:
        return _result(point, None, f"it was not done after {duration_text(point['patience'])}")
    if code < 0 or not stderr:
        return _result(point, None, f"the process ended with {f'signal {-code}' if code < 0 else f'exit code {code}'}")
    where = [line.strip() for line in stderr if line.startswith('  File "')][-1:]  # of an error that nobody expected
    return _result(point, None, "; ".join([stderr[-1].removeprefix("taichi-sph: "), *where]).replace(folder + os.sep, ""))


# the program, which ends when the process that started it does: its standard input closes then
CHILD = """
import os, threading
threading.Thread(target=lambda: (os.read(0, 1), os._exit(1)), daemon=True).start()
from taichi_sph.cli import main
main()
"""


def _child(arguments: Sequence[str], environment: Mapping[str, str], patience: float | None) -> tuple[int | None, list[str]]:
    """Exit code, None where it took longer than `patience` [s], and the lines of stderr."""
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as stderr:
        command = [sys.executable, "-c", CHILD, *arguments]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=stderr, env=environment) as child:
            try:
                code = child.wait(patience)
            except subprocess.TimeoutExpired:
                child.kill()
                code = None
        stderr.seek(0)
        return code, stderr.read().strip().splitlines()


def _result(point: Mapping[str, Any], summary: dict[str, Any] | None, sentence: str) -> dict[str, Any]:
    kept = {key: point[key] for key in ("id", "settings", "scene_hash")}
    return {**kept, "status": "failed" if summary is None else "done", "sentence": sentence, "summary": summary}


def run_points(
    tasks: Sequence[dict[str, Any]],
    folder: Path,
    *,
    scheduler: str | None = None,
    workers: int = 1,
    progress: Progress | None = None,
    worker: Callable[[Mapping[str, Any]], dict[str, Any]] = compute,
) -> list[dict[str, Any]]:
    """The results of all tasks, in their order; those that `folder` holds as done are taken from there.

    scheduler: address of a Dask cluster, None for `workers` processes at a time here.
    """
    progress = progress or Progress()
    files.plain(folder).mkdir(parents=True, exist_ok=True)
    found = {point["id"]: result for point in tasks if (result := _known(folder, point))}
    open_ = {point["id"]: point for point in tasks if point["id"] not in found}
    if found:
        progress.say(f"{len(found)} of {len({p['id'] for p in tasks})} points are done already and kept")
    run = _on_cluster(open_, scheduler, worker) if scheduler else _here(open_, workers, worker)
    total = len(found) + len(open_)
    for point, returned in run:
        result = _believed(point, returned)
        files.write_json(folder / f"{point['id']}.json", result)  # whole or not at all
        found[point["id"]] = result
        progress.say(f"{len(found)} of {total}: {words(result['settings'])}: {_said(result)}")
    return [found[point["id"]] for point in tasks]


def _believed(point: Mapping[str, Any], returned: Any) -> dict[str, Any]:
    """The result of a point. Of what a worker returns only the summary and the sentence count: the point, its name on disk and its
    scene are what it was asked for, whatever the worker says."""
    try:
        summary, sentence = returned["summary"], returned["sentence"]
        if summary is None and isinstance(sentence, str):
            return _result(point, None, sentence)
        _said(_result(point, summary, ""))
        rows([_result(point, summary, "")])
        return _result(point, json.loads(json.dumps(summary)), "")
    except (KeyError, TypeError, AttributeError, ValueError, RecursionError) as error:
        return _result(point, None, f"its worker returned no result of this package ({type(error).__name__})")


def _known(folder: Path, point: Mapping[str, Any]) -> dict[str, Any] | None:
    """The stored result of a point that is done, if it was of this very scene."""
    try:
        stored = files.read_json(folder / f"{point['id']}.json")
        if stored["status"] != "done" or stored["scene_hash"] != point["scene_hash"]:
            return None
    except (SceneError, KeyError, TypeError):
        return None
    result = _believed(point, stored)
    return result if result["status"] == "done" else None


def _said(result: Mapping[str, Any]) -> str:
    if result["summary"] is None:
        return f"failed: {result['sentence']}"
    return f"done in {duration_text(sum(result['summary']['seconds'].values()))}"


def _here(tasks: Mapping[str, Any], workers: int, worker: Callable[..., Any]) -> Iterator[tuple[dict[str, Any], Any]]:
    """On this machine: threads that wait for processes. Each point with what came of it."""
    from concurrent.futures import ThreadPoolExecutor, as_completed

    pool = ThreadPoolExecutor(max(workers, 1))
    try:
        futures = {pool.submit(worker, point): point for point in tasks.values()}
        for future in as_completed(futures):
            yield futures[future], future.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _on_cluster(tasks: Mapping[str, Any], scheduler: str, worker: Callable[..., Any]) -> Iterator[tuple[dict[str, Any], Any]]:
    """On the workers of a Dask cluster, each point with what came of it.

    A point whose worker died is given to another
    one, by Dask itself, three times."""
    try:
        from distributed import Client, as_completed
    except ImportError:
        raise SceneError("--scheduler needs Dask; get it with: pip install 'taichi-sph[sweep]'") from None
    try:
        client = Client(scheduler, timeout=10, set_as_default=False)
    except (OSError, ValueError) as error:
        raise SceneError(f"--scheduler '{scheduler}': no Dask scheduler answers there ({type(error).__name__})") from None
    with client:
        session = uuid.uuid4().hex[:8]  # the scheduler must not hand back what it remembers of an earlier sweep
        futures = {client.submit(worker, point, key=f"taichi-sph-{session}-{name}", pure=False): point for name, point in tasks.items()}
        for future in as_completed(futures, loop=client.loop):
            failed = future.exception()
            said = f"{type(failed).__name__}: {failed}".replace("\n", " ")
            yield futures[future], future.result() if failed is None else _result(futures[future], None, said)


# --- the table --------------------------------------------------------------------------------------


def rows(results: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """One flat row for each result, all with the same columns."""
    keys = list(dict.fromkeys(key for r in results for key in r["settings"]))
    names = list(dict.fromkeys(name for r in results if r["summary"] for name in r["summary"]["quantities"]))
    table = []
    for r in results:
        s = r["summary"] or {}
        seconds = s.get("seconds", {})
        table.append(
            {
                "point": r["id"],
                **{key: r["settings"].get(key) for key in keys},
                "status": r["status"],
                **{f"seconds_{key}": seconds.get(key) for key in ("compile", "advance", "write")},
                **{key: s.get(key) for key in COST},
                **{name: s.get("quantities", {}).get(name, {}).get("value") for name in names},
                "sentence": r["sentence"],
                "commit": s.get("commit"),
            }
        )
    return table


def write_table(table: Sequence[Mapping[str, Any]], out: Path) -> list[Path]:
    """results.csv, and results.parquet where pyarrow is there."""
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(table[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(table)
    with files.whole(out / "results.csv") as file:
        file.write(text.getvalue())
    written = [out / "results.csv"]
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        return written
    columns = {name: [row[name] for row in table] for name in table[0]}
    for name, values in columns.items():
        if any(isinstance(v, str) for v in values):  # settings come as texts, as numbers or not at all
            columns[name] = [None if v is None else str(v) for v in values]
        elif any(isinstance(v, float) for v in values):
            columns[name] = [None if v is None else float(v) for v in values]
    with files.whole(out / "results.parquet", "wb") as file:
        pyarrow.parquet.write_table(pyarrow.table(columns), file)
    return [*written, out / "results.parquet"]


# --- the command ------------------------------------------------------------------------------------


def main(
    path: Path,
    base: Settings,
    pairs: Sequence[str],
    out: Path | None,
    *,
    alone: bool,
    scheduler: str | None,
    workers: int,
    arch: str,
    threads: int | None,
    patience: float | None,
    command: str,
) -> Path:
    """Runs what is not done yet of a sweep and writes its table. SceneError before anything is written; RunStopped at the
    end where points failed. alone: one setting at a time."""
    found = load(path, base)
    design = varied(path, found, pairs)
    if not design:
        raise SceneError("nothing varies: give --vary key=value,value")
    points = (one_at_a_time if alone else full)(design)
    out = out or Path("runs") / f"{found.name}-sweep"
    progress = Progress()
    check_out(out, 1_000_000, MARK)
    threads = threads or max((os.cpu_count() or 1) // workers, 1)
    tasks = [task(path, base, settings, arch=arch, threads=threads, patience=patience) for settings in points]
    where = f"on {scheduler}" if scheduler else f"here, {workers} at a time"
    progress.say(f"{found.title}: {len(points)} points, {where}")
    with locked(out, progress.say):
        files.write_json(out / MARK, {"scene": found.name, "base": base, "design": design, "one_at_a_time": alone, "command": command})
        try:
            results = run_points(tasks, out / "points", scheduler=scheduler, workers=workers, progress=progress)
        except (KeyboardInterrupt, RunInterrupted):
            raise RunInterrupted(f"interrupted; the points that are done were kept, go on with: {command}") from None
        for written in write_table(rows(results), out):
            progress.say(f"written: {written}")
    failed = sum(r["status"] == "failed" for r in results)
    if failed:
        raise RunStopped(f"{failed} of {len(results)} points failed; column 'sentence' of {out / 'results.csv'} says why")
    return out
