"""The folder of a study: study.json, a run folder per case, summary.json, pictures/. Its summary and its answer.

DIR/study.json summary.json pictures/comparison.png
    <case>/...  an ordinary run folder
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import SceneError
from ..scene import Convergence, Scene, Study, load
from . import checkpoint, files
from .answer import count, in_words, open_balance, quantity_text, tolerance_text, unaccounted
from .folder import RunFolder, read_json, write_json
from .record import commit, machine, scene_hash
from .summary import judged, quantity_names

STUDY_FILE = "study.json"
SUMMED = ("nodes", "stress_points", "steps", "node_steps", "processor_seconds")


def read_study(folder: Path | str) -> Study:
    """The study that a folder belongs to."""
    folder = Path(folder)
    files.check_links(folder, (STUDY_FILE, "summary.json", "pictures"))
    found = load(folder / STUDY_FILE)
    if not isinstance(found, Study):
        raise SceneError(f"'{folder / STUDY_FILE}' holds a scene, not a study")
    files.check_links(folder, found.cases)
    return found


def finished(folder: Path, scene: Scene) -> bool:
    """Whether `folder` holds a finished run of this very scene."""
    if not (folder / "summary.json").is_file():
        return False
    try:
        return read_json(folder / "summary.json").get("scene_hash") == scene_hash(scene)
    except (SceneError, AttributeError):
        return False


def interrupted(folder: Path, scene: Scene) -> bool:
    """Whether `folder` holds a checkpoint of this very scene to go on from; one that stopped itself begins anew."""
    if (folder / "summary.json").exists() or (folder / "stopped").exists() or not (folder / "scene.json").is_file():
        return False
    try:
        with RunFolder(folder) as run:
            return scene_hash(run.scene) == scene_hash(scene) and bool(checkpoint.list_checkpoints(run.checkpoints))
    except SceneError:
        return False


def _worst(summaries: list[dict[str, Any]], key: str) -> float | None:
    values = [s[key] for s in summaries if s.get(key) is not None]
    return max(values, key=abs) if values else None


def _order(study: Study, order: Convergence, quantities: Mapping[str, dict[str, Any]]) -> dict[str, Any]:
    """The entry of one order of convergence; its value is None where a case has none or meets its target exactly."""
    points = []
    for case in order.cases:
        entry = quantities[f"{order.quantity}_{case}"]
        if entry["value"] is not None and entry["value"] != entry["target"]:
            points.append((study.cases[case].numerics.spacing, abs(entry["value"] - entry["target"])))
    value = None
    if len(points) == len(order.cases):
        spacings, errors = np.log(np.array(points)).T
        value = float(np.polyfit(spacings, errors, 1)[0])
    met = None if order.least is None else value is not None and value >= order.least
    return {"value": value, "unit": "", "target": order.least, "tolerance": None, "source": order.source, "met": met}


def write_study_summary(out: Path, study: Study, failed: Mapping[str, str], *, command: str, arch: str, threads: int) -> dict[str, Any]:
    """summary.json of a study from those of its cases; `failed`: case -> what it stopped with.

    A quantity is called <quantity>_<case>; of a failed case its value is None. Nodes, steps and seconds are summed,
    errors are the worst.
    """
    runs = {case: read_json(out / case / "summary.json") for case in study.cases if case not in failed}
    found = list(runs.values())
    quantities: dict[str, dict[str, Any]] = {}
    for case, scene in study.cases.items():
        own = runs[case]["quantities"] if case in runs else {name: judged(q, None) for name, q in quantity_names(scene)}
        quantities |= {f"{name}_{case}": entry for name, entry in own.items()}
    for order in study.orders:
        quantities[f"order_{order.name}"] = _order(study, order, quantities)
    seconds = {key: sum(s["seconds"].get(key, 0.0) for s in found) for key in ("compile", "advance", "write")}
    totals = {key: sum(s.get(key, 0) for s in found) for key in SUMMED}
    commits = {s["commit"] for s in found}
    summary = {
        "scene": study.name,
        "title": study.title,
        "quality": study.quality,
        "settings": {**study.parameters, "arch": arch, "threads": threads},
        "command": command,
        "scene_hash": scene_hash(study),
        "commit": commits.pop() if len(commits) == 1 else commit(),
        "machine": machine(),
        "cases": list(study.cases),
        "failed": dict(failed),
        **totals,
        "bytes": max((s.get("bytes", 0) for s in found), default=0),
        "seconds": seconds,
        "node_steps_per_second": totals["node_steps"] / seconds["advance"] if seconds["advance"] > 0 else None,
        "B_percent": _worst(found, "B_percent"),
        "closed_residual_percent": _worst(found, "closed_residual_percent"),
        "quantities": quantities,
    }
    write_json(out / "summary.json", summary)
    return summary


def case_answer(name: str, summary: dict[str, Any]) -> str:
    """One case in a line: its quantities, and which did not come out as expected."""
    parts = []
    for key, entry in summary["quantities"].items():
        verdict = f" ({tolerance_text(entry)})" if entry["met"] is False else ""
        parts.append(f"{in_words(key)} {quantity_text(entry['value'], entry['unit'])}{verdict}")
    return f"{name}: {', '.join(parts) or 'finished'}"


def study_answer(study: Study, summary: dict[str, Any]) -> list[str]:
    """The study in words: what was expected of all cases, the balance of energy, the cost."""
    lines = []
    expected = [entry["met"] for entry in summary["quantities"].values() if entry["met"] is not None]
    done = len(study.cases) - len(summary["failed"])
    words = f"{count(done).capitalize()} of {count(len(study.cases))} runs finished"
    if expected:
        words += f"; {sum(expected)} of {len(expected)} numbers came out as expected"
    static = any(case.static is not None for case in study.cases.values())
    if any(expected) and unaccounted(summary["closed_residual_percent"], static):
        words += ", but do not trust those of runs that lose energy yet"
    lines.append(words + ".")
    worst = [
        f"{title} {summary[key]:+.2g} %"
        for key, title in (("B_percent", "balance B"), ("closed_residual_percent", "closed residual"))
        if summary[key] is not None
    ]
    if worst:
        lines.append(f"Energy, worst of all: {', '.join(worst)}." + open_balance(summary["closed_residual_percent"], static))
    speed, advance = summary["node_steps_per_second"], summary["seconds"]["advance"]
    if speed and round(speed / 1e6, 2) > 0:  # a search for equilibrium has no node-steps to speak of
        lines.append(f"{summary['node_steps'] / 1e6:.3g} M node-steps in {advance:.1f} s: {speed / 1e6:.2f} M node-steps/s.")
    elif advance:
        lines.append(f"{advance:.1f} s.")
    return lines
