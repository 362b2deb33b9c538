"""RESULTS.md and the table in README.md from recorded summaries, and which of them no longer belong to their scene.

`record_summary` copies the summary of a run or study to renders/results/; `markdown` makes the tables of what
lies there, `overview` a line for each; `stale` compares the scene that a summary was made with to the scene as it is
today.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from ..errors import SceneError
from ..scene import Scene, Study
from .answer import SCALES, in_words, quantity_text
from .folder import RunFolder, read_json, whole_summary, write_json
from .record import scene_hash

PICTURES = Path("renders")
FOLDER = PICTURES / "results"
HEADER = """# Results

Made by `taichi-sph results --out RESULTS.md` from the recorded summaries in `renders/results/`; not written by hand. B is the
balance of energy of T 2.110, the closed residual counts every dissipation; of a study both are the worst of its runs.
"""
BEGIN, END = "<!-- results -->", "<!-- /results -->"
SILENT = ("quality", "threads", "arch", "precision")  # settings that are the same everywhere or stand elsewhere
LENGTHS = ("spacing", "notch")  # settings in metres
TIMES = ("tau_c",)
LONGEST = 200  # bytes of a file's name; disks allow 255, with its ending


def record_name(summary: dict[str, Any]) -> str:
    """File name that tells runs of a scene apart: scene, quality, formulation and its own parameters."""
    parts = [summary["scene"], summary["quality"], summary["settings"].get("formulation", "")]
    known = {"quality", "formulation", "spacing", "precision", "arch", "threads"}
    parts += [f"{k}={v:g}" if isinstance(v, float) else f"{k}={v}" for k, v in summary["settings"].items() if k not in known]
    name = re.sub(r"[/\\\0-\x1f]", "_", "-".join(str(p).replace(" ", "") for p in parts if p))
    return name.encode(errors="replace")[:LONGEST].decode(errors="ignore")


def record_summary(run: RunFolder, folder: Path = FOLDER) -> Path:
    """Keeps the summary of a run or study for the table, under a name made of its settings."""
    summary = run.summary
    return write_json(folder / f"{record_name(summary)}.json", summary)


def picture_of(name: str) -> Path:
    """Where the picture of a recorded run lies."""
    return PICTURES / f"{name}.png"


def main_picture(run: RunFolder) -> Path | None:
    """The picture of a run or study that says most."""
    for pattern in ("comparison.png", "impact_over_time.png", "*_over_time.png", "damage.png", "*.png"):
        found = sorted(run.pictures.glob(pattern))
        if found:
            return found[0]
    return None


def read_summaries(folder: Path = FOLDER) -> dict[str, dict[str, Any]]:
    """name -> summary of all that is recorded."""
    found = {}
    for path in sorted(folder.glob("*.json")):
        found[path.stem] = whole_summary(read_json(path), path)
    return found


def _percent(value: float | None) -> str:
    return "" if value is None else f"{value:+.2g}"


def _row(summary: dict[str, Any], name: str, entry: dict[str, Any]) -> str:
    target = "" if entry["target"] is None else quantity_text(entry["target"], entry["unit"])
    if target and entry["tolerance"]:
        target += f" ± {quantity_text(entry['tolerance'], entry['unit'])}"
    met = {True: "yes", False: "**no**", None: ""}[entry["met"]]
    return f"| {in_words(name)} | {quantity_text(entry['value'], entry['unit'])} | {target} | {met} | {entry['source']} |"


def _setting(name: str, value: Any) -> str:
    unit = "m" if name in LENGTHS else "s" if name in TIMES else ""
    if isinstance(value, float):
        value = quantity_text(value, unit) if unit in SCALES else f"{value:g}"
    return f"{name} = {value}" if name not in ("formulation", "quality") else str(value)


def _settings(summary: dict[str, Any], silent: Iterable[str] = SILENT) -> str:
    return ", ".join(_setting(k, v) for k, v in summary["settings"].items() if k not in silent and v != "")


def overview(summaries: Iterable[dict[str, Any]]) -> str:
    """A line for each recorded run or study."""
    lines = [
        "| case | settings | as expected | B [%] | closed residual [%] | nodes | seconds |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for s in sorted(summaries, key=lambda s: s["scene"]):
        expected = [entry["met"] for entry in s["quantities"].values() if entry["met"] is not None]
        runs = f", {len(s['cases'])} runs" if "cases" in s else ""
        lines.append(
            f"| [{s['title']}](RESULTS.md#{s['scene']}) | "
            f"{', '.join(filter(None, [s['quality'], _settings(s, (*SILENT, 'spacing'))]))}{runs} | "
            f"{f'{sum(expected)} of {len(expected)}' if expected else ''} | {_percent(s['B_percent'])} | "
            f"{_percent(s['closed_residual_percent'])} | {s['nodes']} | {s['seconds'].get('advance', 0):.1f} |"
        )
    return "\n".join(lines)


def into(text: str, table: str) -> str | None:
    """A text with `table` between its two marks; None when it has no marks."""
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    return f"{before}{begin}\n{table}\n{end}{after}" if begin and end else None


def markdown(summaries: Iterable[dict[str, Any]]) -> str:
    """The whole of RESULTS.md: a table of all runs, then the quantities of each, by scene."""
    summaries = list(summaries)
    by_scene: dict[str, list[dict[str, Any]]] = {}
    for summary in summaries:
        by_scene.setdefault(summary["scene"], []).append(summary)
    text = [HEADER, overview(summaries) + "\n"]
    for scene, runs in sorted(by_scene.items()):
        text.append(f"## {scene}\n")
        for summary in runs:
            settings = _settings(summary)
            rate = summary.get("node_steps_per_second")
            cost = [f"{summary['nodes']} nodes", f"{summary['steps']} steps", f"{summary['seconds'].get('advance', 0):.1f} s"]
            if rate and round(rate / 1e6, 2) > 0:  # of a search for equilibrium there is none to show
                cost.append(f"{rate / 1e6:.2f} M node-steps/s on {summary['settings'].get('threads')} threads")
            text += [
                f"### {summary['title']}, {summary['quality']}\n",
                f"{settings}. {', '.join(cost)}. B = {_percent(summary['B_percent'])} %, "
                f"closed residual {_percent(summary['closed_residual_percent'])} %. Commit {summary['commit'] or 'unknown'}.\n",
                f"    {summary['command']}\n",
                "| quantity | value | expected | met | source |",
                "| --- | --- | --- | --- | --- |",
                *(_row(summary, name, entry) for name, entry in summary["quantities"].items()),
                "",
            ]
            text += [f"{case} stopped: {why}\n" for case, why in summary.get("failed", {}).items()]
            picture = picture_of(record_name(summary))
            if picture.is_file():
                text.append(f"![{summary['title']}, {settings}]({picture.as_posix()})\n")
    return "\n".join(text)


def stale(summaries: dict[str, dict[str, Any]], scene_of: Callable[[dict[str, Any]], Scene | Study]) -> dict[str, str]:
    """name -> why, for summaries whose scene is another one today. `scene_of` builds today's scene from
    the name, quality and settings of a summary."""
    reasons = {}
    for name, summary in summaries.items():
        try:
            today = scene_hash(scene_of(summary))
        except SceneError as error:
            reasons[name] = f"its scene cannot be built any more: {error}"
            continue
        if today != summary["scene_hash"]:
            reasons[name] = f"its scene changed; make it again with: {summary['command']}"
    return reasons
