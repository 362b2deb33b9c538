"""The price in words: sentences, the table, and what is recorded of a scene."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ...run.progress import bytes_text
from ...scene import Scene, Study
from .judge import usable
from .knobs import BASE

FOLDER = Path("benchmarks") / "price"


def percent(value: float | None) -> str:
    return "no answer" if value is None else f"{100 * value:.2g} %" if value < 0.995 else f"{100 * value:.0f} %"


def _error_words(p: Mapping[str, Any]) -> str:
    text = percent(p["error"])
    if p.get("spread") and p["error"] is not None:
        text += f" ({percent(p['spread'][0])} to {percent(p['spread'][1])} over {p['runs']} runs)"
    return text


def _cost(p: Mapping[str, Any]) -> str:
    return f"{p['processor']:.2g} processor seconds, {p['node_steps'] / 1e6:.2g} M node-steps"


def sentences(record: Mapping[str, Any]) -> list[str]:
    """What the chart says."""
    points = {p["name"]: p for p in record["points"]}
    base, of = points[BASE], " and ".join(record["references"])
    lines = [f"As it is ({record['quality']}): error {_error_words(base)} of {of} for {_cost(base)}."]
    chosen = usable(record["points"])
    for times, word in ((2, "Twice"), (5, "Five times"), (20, "Twenty times")):
        faster = [p for p in chosen if p["cost"] <= base["cost"] / times]
        if not faster:
            lines.append(f"{word} as fast: none of the knobs by itself.")
            break
        best = min(faster, key=lambda p: p["error"])
        lines.append(f"{word} as fast {_costs(best, base, of)}")
    better = [p for p in chosen if base["error"] is None or p["error"] < base["error"]]
    if better:
        best = min(better, key=lambda p: p["error"])
        lines.append(f"The least error, {_error_words(best)}, takes {best['cost'] / base['cost']:.3g} times the cost ({best['name']}).")
    if record["thesis"]:
        lines += _thesis(points[record["thesis"]], chosen)
    return lines


def _costs(p: Mapping[str, Any], base: Mapping[str, Any], of: str) -> str:
    how = f"({p['name']}, {base['cost'] / p['cost']:.2g} times)"
    if base["error"] is None:
        return f"{how} has error {_error_words(p)}."
    more = p["error"] - base["error"]
    told = f"{how} costs {percent(more)} of {of}" if more > 0 else f"{how} costs no accuracy: error {percent(p['error'])}"
    noise = max((q["spread"][1] - q["spread"][0] for q in (p, base) if q.get("spread")), default=0.0)
    return told + (f", which is within the spread of {percent(noise)}." if 0 < abs(more) < noise else ".")


def _thesis(thesis: Mapping[str, Any], chosen: Sequence[Mapping[str, Any]]) -> list[str]:
    # its strong form has no metal here
    which = "collocation, its spacing" if "collocation" in thesis["settings"].values() else "its spacing, in galerkin"
    if thesis["status"] != "done":
        return [f"The thesis's own settings ({which}) find no answer: {thesis['sentence']}"]
    line = f"The thesis's own settings ({which}): error {_error_words(thesis)} for {_cost(thesis)}."
    limit = math.inf if thesis["error"] is None else max(thesis["error"], *(thesis.get("spread") or (0.0,)))  # within its spread is no more
    better = [p for p in chosen if p["error"] <= limit and p["cost"] <= thesis["cost"] / 2]
    if not better:
        return [line, "No point is twice as fast as they are with no more error."]
    best = min(better, key=lambda p: p["error"])
    return [line, f"With no more error: {best['name']}, error {_error_words(best)}, {thesis['cost'] / best['cost']:.2g} times as fast."]


def table(record: Mapping[str, Any]) -> str:
    """The points as markdown, cheapest first, failed ones last."""
    names = list(record["references"])
    head = ["point", "error", *names, "processor s", "M node-steps", "MB", "vs as it is"]
    lines = [f"| {' | '.join(head)} |", f"|{' --- |' * len(head)}"]
    base = next(p for p in record["points"] if p["name"] == BASE)
    for p in sorted(record["points"], key=lambda p: p["cost"] or math.inf):
        if p["status"] != "done":
            lines.append(f"| {p['name']} | failed: {p['sentence']} |{'  |' * (len(head) - 2)}")
            continue
        name = f"**{p['name']}**" if p["name"] in record["front"] else p["name"]
        values = [f"{p['values'][n]:.4g}" if p["values"].get(n) is not None else "none" for n in names]
        error = _error_words(p) if p["error"] is not None else f"another answer: {_other(p, record['counts'])}"
        cost = [f"{p['processor']:.2f}", f"{p['node_steps'] / 1e6:.2f}", f"{p['bytes'] / 1e6:.1f}", f"{p['cost'] / base['cost']:.2f}"]
        lines.append(f"| {' | '.join([name, error, *values, *cost])} |")
    return "\n".join(lines)


def _other(p: Mapping[str, Any], counts: Sequence[str]) -> str:
    values = {name: p["values"].get(name) for name in counts if not p["met"].get(name)}
    return ", ".join(f"{name} {value:g}" for name, value in values.items() if value is not None) or "a number is missing"


def recorded(scene: Scene | Study, hashed: Callable[[Scene], str]) -> list[str]:
    """What `validate` says of the price of a scene: its measured error and cost, and the points that the rule chooses."""
    path = FOLDER / f"{scene.name}.json"
    if isinstance(scene, Study) or not scene.quantities:
        return []
    if not path.is_file():
        return [f"measured: not yet; taichi-sph price {scene.name} tells what accuracy costs"]
    record = json.loads(path.read_text(encoding="utf-8"))
    points, scene_hash = {p["name"]: p for p in record["points"]}, hashed(scene)
    same = [p for p in points.values() if p["scene_hash"] == scene_hash and p["status"] == "done"]
    said = [] if same else [f"measured: not with these settings; {path} holds {len(points)} others"]
    for p in same[:1]:
        error = (
            f"error {_error_words(p)} of {' and '.join(record['references'])}" if p["error"] is not None else "another answer than expected"
        )
        said.append(f"measured: {error}, {_cost(p)}, {bytes_text(p['bytes'])} ({path})")
    chosen = {quality: record["qualities"][quality] for quality in ("draft", "standard", "paper") if quality in record["qualities"]}
    for name in dict.fromkeys(chosen.values()):
        p, same_point = points[name], [quality for quality, one in chosen.items() if one == name]
        verb = "is" if len(same_point) == 1 else "are"
        said.append(f"by the rule {', '.join(same_point)} {verb}: {name}, error {_error_words(p)}, {_cost(p)}{_set(p['settings'])}")
    if chosen and record.get("commit"):
        said.append(f"the rule goes by what was measured at commit {record['commit'][:7]}; the scene may be another since")
    return said


def _set(settings: Mapping[str, Any]) -> str:
    """How to ask for settings."""
    return "".join(f" --set {key}={value if isinstance(value, str) else json.dumps(value)}" for key, value in settings.items())
