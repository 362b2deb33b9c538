"""The command: runs the points of a scene, writes and records what they found."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ...errors import RunInterrupted, RunStopped, SceneError, TaichiSphError
from ...output import files
from ...output.lock import locked
from ...output.summary import quantity_names
from ...run.draw import can_draw
from ...run.gate import check_out
from ...run.plan import plan
from ...run.progress import Progress
from ...scene.script import load_scene, parameters_of
from .. import sweep
from .judge import QUALITY_RULE, check_asked, error_of, front, judged, only_spacing, point, qualities, references
from .knobs import BASE, PAPER, THESIS, Settings, knobs, together
from .words import FOLDER, sentences, table

PICTURES = Path("renders")
MOVED = 0.05  # spacings: how far the nodes of a perturbed run are moved
LEAST = 10.0  # processor seconds
ROUNDS = 3  # of perturbed runs: a new front may hold points that were not perturbed yet
POINT_FILE = "price.json"


def main(
    path: Path,
    base: Settings,
    out: Path | None,
    *,
    quantities: Sequence[str] = (),
    also: Sequence[str] = (),
    seeds: int = 3,
    most: float = 30.0,
    scheduler: str | None = None,
    workers: int = 1,
    arch: str = "cpu",
    threads: int | None = None,
    patience: float = 300.0,
    record: bool = False,
    command: str = "",
) -> Path:
    """Runs the knobs of a scene and writes price.json, price.md, price.png and results.csv. also: points with several knobs
    turned. most: points estimated to cost
    more than that many times the scene as it is are left out, and named. record: copy to benchmarks/price and renders."""
    from ...output.folder import write_json
    from ...output.record import commit, machine

    scene = load_scene(path, base)
    if not scene.quantities:
        raise SceneError(f"scene '{scene.name}' has no quantities, so there is no error to measure")
    check_asked(quantities, [name for name, _ in quantity_names(scene)])
    options = list(parameters_of(path)) if path.suffix == ".py" else []
    out = out or Path("runs") / f"{scene.name}-price"
    check_out(out, 1_000_000, sweep.MARK)
    progress = Progress()
    threads = threads or max((os.cpu_count() or 1) // workers, 1)
    chosen, left_out = _affordable(path, base, knobs(scene, options) | together(path, scene, also), most)
    progress.say(f"{scene.title} ({scene.name}, {scene.quality}): {len(chosen)} points, {workers} at a time")
    for name, why in left_out.items():
        progress.say(f"left out: {name}, {why}")
    with locked(out, progress.say):
        write_json(out / sweep.MARK, {"scene": scene.name, "base": base, "design": chosen, "command": command})
        all_results: list[dict[str, Any]] = []

        def run(points: Sequence[Settings]) -> list[dict[str, Any]]:
            tasks = [sweep.task(path, base, settings, arch=arch, threads=threads, patience=patience) for settings in points]
            results = sweep.run_points(tasks, out / "points", scheduler=scheduler, workers=workers, progress=progress)
            all_results.extend(results)
            return results

        try:
            points = [point(name, result) for name, result in zip(chosen, run(list(chosen.values())))]
            if points[0]["status"] != "done":
                raise RunStopped(f"the scene as it is gives no answer: {points[0]['sentence']}")
            entries = all_results[0]["summary"]["quantities"]
            names, counts = judged(entries, quantities)
            series = [p for p in points if p["status"] == "done" and only_spacing(p["settings"])]
            refs = references(points[0], names, series, entries)
            thesis = next((name for name in (THESIS, PAPER) if name in chosen and scene.shells), None)
            # a search for equilibrium has few steps, and each is as long as Newton's method takes
            measure = "processor" if points[0]["processor"] >= LEAST or getattr(scene, "static", None) is not None else "node_steps"
            for p in points:
                p["error"], p["cost"] = error_of(p, refs, counts), p[measure]
            if seeds and any(shell.material.critical_damage is not None for shell in scene.shells):
                _perturb(points, run, seeds, refs, counts, thesis)
        except (KeyboardInterrupt, RunInterrupted):
            raise RunInterrupted(f"interrupted; the points that are done were kept, go on with: {command}") from None
        found = {
            "scene": scene.name,
            "title": scene.title,
            "quality": scene.quality,
            "settings": base,
            "command": command,
            "commit": commit(),
            "machine": machine(),
            "seconds": sum(p["seconds"] or 0.0 for p in points),
            "references": refs,
            "counts": counts,
            "thesis": thesis,
            "cost": measure,
            "points": points,
            "front": front(points),
            "qualities": qualities(points),
            "quality_rule": QUALITY_RULE,
            "left_out": left_out,
        }
        words = sentences(found)
        found["words"] = words
        for written in _write(found, all_results, out, progress):
            progress.say(f"written: {written}")
        if record:
            for written in _record(found, out):
                progress.say(f"recorded: {written}")
        for line in ("", *words):
            progress.say(line)
        return out


def _affordable(path: Path, base: Settings, wanted: Mapping[str, Settings], most: float) -> tuple[dict[str, Settings], dict[str, str]]:
    """Those of the knobs that are no more than `most` times the scene as it is, by the plan; and why the others are not.
    What makes no valid scene stays: its run says why."""
    chosen, left_out, own = {}, {}, 0.0
    for name, settings in wanted.items():
        try:
            cost = plan(load_scene(path, {**base, **settings})).seconds
        except TaichiSphError:
            cost = 0.0
        own = own or cost
        if cost > most * own:
            left_out[name] = f"estimated at {cost / own:.0f} times the cost"
        else:
            chosen[name] = settings
    return chosen, left_out


def _perturb(
    points: list[dict[str, Any]], run: Any, seeds: int, refs: Mapping[str, Any], counts: Sequence[str], thesis: str | None
) -> None:
    """Spread over runs with moved nodes, of the scene as it is, of the thesis's settings and of the front, until that stands."""
    for _ in range(ROUNDS):
        wanted = {BASE, thesis, *front(points)}
        new = [p for p in points if p["name"] in wanted and p["status"] == "done" and "spread" not in p]
        if not new:
            return
        moves = [{"numerics.irregularity": MOVED, "numerics.seed": 1 + k} for k in range(seeds)]
        results = run([{**p["settings"], **move} for p in new for move in moves])
        for number, p in enumerate(new):
            own = [point("", r) for r in results[number * seeds : (number + 1) * seeds]]
            errors = [p["error"], *(error_of(q, refs, counts) for q in own)]
            known = [e for e in errors if e is not None]
            p["runs"], p["other_answers"] = len(errors), len(errors) - len(known)
            p["spread"] = [min(known), max(known)] if known else None
            p["values_of_runs"] = [q["values"] for q in own]
            # most of its runs must give the answer that was expected
            p["error"] = sum(known) / len(known) if len(known) > len(errors) / 2 else None


def _write(found: dict[str, Any], results: Sequence[dict[str, Any]], out: Path, progress: Progress) -> list[Path]:
    from ...output.folder import write_json

    written = [write_json(out / POINT_FILE, found), *sweep.write_table(sweep.rows(results), out)]
    lines = [f"# {found['title']}: what accuracy costs", "", f"    {found['command']}", "", *(f"- {line}" for line in found["words"]), ""]
    lines += [f"Reference of {name}: {r['value']:.6g} {r['unit']}, {r['words']}." for name, r in found["references"].items()]
    chosen = [f"{q} = {found['qualities'][q]}" for q in ("draft", "standard", "paper") if q in found["qualities"]]
    lines += ["", table(found), "", f"Qualities by the rule ({QUALITY_RULE}): {', '.join(chosen)}.", ""]
    lines += [f"Left out: {name}, {why}." for name, why in found["left_out"].items()]
    with files.whole(out / "price.md") as file:
        file.write("\n".join(lines) + "\n")
    written.append(out / "price.md")
    if can_draw(progress):
        from ...render.prices import render_price

        written.append(render_price(found, out / "price.png"))
    return written


def _record(found: dict[str, Any], out: Path) -> list[Path]:
    from ...output.folder import write_json

    written = [write_json(FOLDER / f"{found['scene']}.json", found)]
    if (out / "price.png").is_file():
        from ...render import reduced

        written.append(reduced(out / "price.png", PICTURES / f"price_{found['scene']}.png"))
    return written
