"""What the runs found: errors against references, the front of cost and error, and the qualities by rule."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...errors import SceneError, nearest
from ...scene.units import show
from .knobs import Settings

PHYSICS = "delay"  # the beginning of what changes the material: shown, but no way to buy accuracy
DRAFT_ERROR = 0.10
QUALITY_RULE = (
    f"draft: the cheapest point with an error below {100 * DRAFT_ERROR:g} %; standard: the knee of the front from there on, the point "
    "farthest below the line from its cheapest to its most accurate one in log error over log cost; paper: the most accurate point"
)


def point(name: str, result: Mapping[str, Any]) -> dict[str, Any]:
    """One run as the record keeps it. spacing [m], seconds of wall clock and processor [s], bytes of fields."""
    s = result["summary"] or {}
    return {
        "name": name,
        "settings": result["settings"],
        "scene_hash": result["scene_hash"],
        "status": result["status"],
        "sentence": result["sentence"],
        "command": s.get("command"),
        "spacing": s.get("settings", {}).get("spacing"),
        **{key: s.get(key) for key in ("nodes", "steps", "node_steps", "bytes")},
        "seconds": s.get("seconds", {}).get("advance"),
        "processor": s.get("processor_seconds"),
        "values": {name: entry["value"] for name, entry in s.get("quantities", {}).items()},
        "met": {name: entry["met"] for name, entry in s.get("quantities", {}).items()},
        "B_percent": s.get("B_percent"),
    }


def only_spacing(settings: Settings) -> bool:
    """Whether they change nothing but spacings, of a body only together with that of the scene."""
    own = {key for key in settings if key.endswith(".spacing") and key != "numerics.spacing"}
    return settings.keys() - own <= {"quality", "numerics.spacing"} and (not own or "numerics.spacing" in settings)


def check_asked(wanted: Sequence[str], names: Sequence[str]) -> None:
    """Refuses a quantity that is asked for and that the scene does not have, before any point runs. names: of its quantities."""
    for name in wanted:
        if name not in names:
            raise SceneError(f"--quantity {name}: the scene has no such quantity{nearest(name, names)}")


def judged(entries: Mapping[str, Mapping[str, Any]], wanted: Sequence[str] = ()) -> tuple[list[str], list[str]]:
    """Names of the quantities that are judged by their error, and of the counts that must come out. entries: of a summary."""
    counts = [k for k, e in entries.items() if e["tolerance"] == 0 and e["target"] is not None and k not in wanted]
    own = [k for k, e in entries.items() if e["target"] and k not in counts]
    return list(wanted) or own or [k for k in entries if k not in counts][:1], counts


def references(
    base: Mapping[str, Any], names: Sequence[str], series: Sequence[Mapping[str, Any]], entries: Mapping[str, Any]
) -> dict[str, dict[str, Any]]:
    """For each judged quantity the reference, and in words where it comes from. series: points of different spacings."""
    found = {}
    for name in names:
        fine = sorted((p["spacing"], p["values"][name]) for p in series if p["values"].get(name) is not None)
        fine = list(dict(fine).items())[:3]
        limit = richardson(*zip(*fine)) if len(fine) == 3 else None
        if limit is not None:
            words = f"the spacings {', '.join(show(d, 'm') for d, _ in fine)} tend to {limit[0]:.5g} with order {limit[1]:.2g}"
        else:
            words = f"the spacings do not converge monotonically ({', '.join(f'{v:.4g}' for _, v in fine)} from the finest on)"
        target = entries[name]["target"]
        if target:
            value, kind = target, "target"
            words = f"{entries[name]['source'] or 'target of the scene'}; {words}"
        elif limit is not None:
            value, kind = limit[0], "richardson"
        else:
            value, kind = fine[0][1] if fine else base["values"][name], "finest"
            words = f"the finest run; {words}"
        tends, order = limit or (None, None)
        found[name] = {"value": value, "unit": entries[name]["unit"], "kind": kind, "words": words, "limit": tends, "order": order}
    return found


def richardson(spacings: Sequence[float], values: Sequence[float]) -> tuple[float, float] | None:
    """(v*, p) of v(D) = v* + C D^p through three spacings, finest first; None where they do not converge like that."""
    (a, b, c), (u, v, w) = spacings, values
    if v == u or (w - v) / (v - u) <= 0:
        return None
    ratio = (w - v) / (v - u)

    def of(p: float) -> float:
        return (c**p - b**p) / (b**p - a**p) - ratio

    low, high = 0.3, 6.0
    if of(low) * of(high) > 0:
        return None
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if of(low) * of(middle) > 0 else (low, middle)
    return u - (v - u) / (b**low - a**low) * a**low, low


def error_of(p: Mapping[str, Any], refs: Mapping[str, Mapping[str, Any]], counts: Sequence[str]) -> float | None:
    """The largest relative error; None where the point failed, a number is missing or a count is another one."""
    values = [p["values"].get(name) for name in refs]
    if p["status"] != "done" or any(v is None for v in values) or any(not p["met"].get(name) for name in counts):
        return None
    return max(abs(v - r["value"]) / abs(r["value"] or 1.0) for v, r in zip(values, refs.values()))


def usable(points: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Points that gave the answer, of the material that was asked for."""
    return [p for p in points if p["error"] is not None and not p["name"].startswith(PHYSICS)]


def front(points: Sequence[Mapping[str, Any]]) -> list[str]:
    """Names of the points that no other one beats in both cost and error, cheapest first."""
    names, best = [], math.inf
    for p in sorted(usable(points), key=lambda p: (p["cost"], p["error"])):
        if p["error"] < best:
            names.append(p["name"])
            best = p["error"]
    return names


def qualities(points: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """quality -> name of its point, by QUALITY_RULE; without a draft where no point is good enough."""
    by_name = {p["name"]: p for p in points}
    ends = [by_name[name] for name in front(points)]
    if not ends:
        return {}
    found = {"paper": ends[-1]["name"]}
    good = [p for p in ends if p["error"] < DRAFT_ERROR]
    if good:
        found["draft"] = good[0]["name"]
        ends = good
    x = np.log([p["cost"] for p in ends])
    y = np.log([max(p["error"], 1e-9) for p in ends])
    share = (x - x[0]) / max(x[-1] - x[0], 1e-12)
    found["standard"] = ends[int(np.argmax(y[0] + share * (y[-1] - y[0]) - y))]["name"]
    return found
