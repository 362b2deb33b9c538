"""The price of accuracy: one scene, its knobs turned one at a time, error against cost.

Cost: processor seconds of the time loop, of which other programs on the machine take no part, and free of the machine
node-steps and bytes of fields. Points are compared by processor seconds; where the scene as it is takes less than LEAST of
them, loading and compiling the kernels is much of it, and node-steps compare. Error of a point: the largest over the judged quantities of

    |value - reference| / |reference|

with the reference the target of the quantity (closed form, experiment), else the value that the spacings tend to
(Richardson: v(D) = v* + C D^p through the three finest, where they converge monotonically with 0.3 < p < 6), else the
finest run. Judged are the quantities with a target of their own, or those that are asked for. Those with a tolerance of 0,
counts, must come out: a point where one does not is another answer, not a worse number, and has no error.

Rupture is sensitive: the scene as it is and every point that no other one beats are run again with their nodes moved at
random, and the error of such a point is the mean over its runs, with the smallest and the largest beside it.

Qualities by rule (`QUALITY_RULE`), from the points that no other one beats in both error and cost.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..bodies.fluid.said import Fluid
from ..errors import RunInterrupted, RunStopped, SceneError, TaichiSphError, nearest
from ..output import files
from ..output.lock import locked
from ..run import session as running
from ..run.progress import Progress, bytes_text
from ..scene import MeshFile, Scene, Shell, Study
from ..scene.script import load_scene, parameters_of
from ..scene.units import show
from . import sweep

FOLDER = Path("benchmarks") / "price"
PICTURES = Path("renders")
BASE, THESIS, PAPER = "as it is", "thesis", "quality paper"
PHYSICS = "delay"  # the beginning of what changes the material: shown, but no way to buy accuracy
MOVED = 0.05  # spacings: how far the nodes of a perturbed run are moved
LEAST = 10.0  # processor seconds
ROUNDS = 3  # of perturbed runs: a new front may hold points that were not perturbed yet
DRAFT_ERROR = 0.10
QUALITY_RULE = (
    f"draft: the cheapest point with an error below {100 * DRAFT_ERROR:g} %; standard: the knee of the front from there on, the point "
    "farthest below the line from its cheapest to its most accurate one in log error over log cost; paper: the most accurate point"
)
POINT_FILE = "price.json"

Settings = dict[str, Any]


# --- the knobs --------------------------------------------------------------------------------------


def knobs(scene: Scene, options: Sequence[str] = ()) -> dict[str, Settings]:
    """name -> settings of every knob that this scene has, one at a time. options: parameters of its script."""
    n = scene.numerics
    formulation = "formulation" if "formulation" in options else "numerics.formulation"
    found: dict[str, Settings] = {BASE: {}}
    if "quality" in options:
        found |= {f"quality {q}": {"quality": q} for q in ("draft", "standard", "paper") if q != scene.quality}
        pinballs = {f"fluids.{fluid.name}.contact": "pinballs" for fluid in scene.fluids}  # T 3.3
        if scene.shells and all(shell.material.strength is None for shell in scene.shells):
            found[THESIS] = {"quality": "paper", formulation: "collocation", **pinballs}
        elif necks := {f"shells.{s.name}.material.damage.necks": False for s in scene.shells if getattr(s.material.damage, "necks", False)}:
            found[THESIS] = {"quality": "paper", **necks, **pinballs}
    if not scene.shells:
        found |= {f"spacing x {f:.3g}": {"numerics.spacing": n.spacing * f} for f in (1.5, 2 / 3)}
    if any(not isinstance(shell.surface, MeshFile) for shell in scene.shells):
        # of the water with that of its tank, which it has to fit
        spacings = {"numerics.spacing": n.spacing} | {
            f"fluids.{fluid.name}.spacing": fluid.spacing for fluid in scene.fluids if fluid.spacing is not None
        }
        found |= {f"spacing x {f:.3g}": {key: value * f for key, value in spacings.items()} for f in (2.0, 1.5, 2 / 3)}
        other = "triangle" if n.cells == "quad" else "quad"
        found[f"cells {other}"] = {"cells" if "cells" in options else "numerics.cells": other}
    if scene.shells:
        found |= _of_the_form(scene, formulation)
    found["precision f32"] = {"numerics.precision": "f32"}
    bends = any(shell.motion == "free" for shell in scene.shells)
    if scene.increments is None:
        found |= {f"time_step_safety {s:g}": {"numerics.time_step_safety": s} for s in (0.5, 0.98) if s != n.time_step_safety}
        if bends and n.raised_inertia:
            found["raised_inertia off"] = {"numerics.raised_inertia": False}
    elif scene.static is not None:
        found |= {f"residual x {f:g}": {"static.residual": scene.static.residual * f} for f in (100.0, 10.0)}
    for shell in scene.shells:
        found |= _of_the_material(shell)
    if scene.rigids or (scene.fluids and scene.shells) or any(shell.self_contact for shell in scene.shells):
        found |= {f"contact tolerance {t:g}": {"numerics.contact": {"tolerance": t}} for t in (1e-2, 1e-6)}
    for fluid in scene.fluids:
        if fluid.spacing is not None:
            found |= {f"{fluid.name} spacing x {f:g}": {f"fluids.{fluid.name}.spacing": fluid.spacing * f} for f in (1.3, 0.8)}
        found |= _of_the_fluid(fluid, bool(scene.shells))
    return found


def _of_the_form(scene: Scene, key: str) -> dict[str, Settings]:
    """Knobs of the formulation, and the other formulation where the material allows it."""
    f = scene.numerics.formulation
    inside = "numerics.formulation"
    found: dict[str, Settings] = {f"support {s:g}": {f"{inside}.support": s} for s in (1.0, 1.5) if s != f.support}
    if all(shell.material.strength is None for shell in scene.shells):
        other = "collocation" if f.kind == "galerkin" else "galerkin"
        found[other] = {key: other}
    if any(shell.motion == "free" for shell in scene.shells):
        found |= {f"shear_bound {a:g}": {f"{inside}.shear_bound": a} for a in (0.0, 0.3) if a != f.shear_bound}
    if f.kind == "galerkin":
        return found | {f"stabilisation {g:g}": {f"{inside}.stabilisation": g} for g in (0.05, 0.5)}
    found |= {f"viscosity alpha {a:g}": {f"{inside}.viscosity.alpha": a} for a in (0.0, 0.2)}
    return found | {"no filters": {f"{inside}.edge_filter": 0.0, f"{inside}.spin_filter": 0.0}}


def _of_the_fluid(fluid: Fluid, wets: bool) -> dict[str, Settings]:
    """Support, viscosity and diffusion of a fluid; where it wets a shell, its contact and how often it acts."""
    inside = f"fluids.{fluid.name}"
    found: dict[str, Settings] = {}
    found |= {f"{fluid.name} support {s:g}": {f"{inside}.support": s} for s in (1.05, 1.3) if s != fluid.support}
    found |= {f"{fluid.name} alpha {a:.3g}": {f"{inside}.alpha": a} for a in (fluid.alpha / 3, fluid.alpha * 3) if 0.0 < a <= 3.0}
    found |= {f"{fluid.name} delta {d:g}": {f"{inside}.delta": d} for d in (0.0, 0.1) if d != fluid.delta}
    if wets:
        found |= {f"{fluid.name} every {k}": {f"{inside}.every": k} for k in (2, 4) if k != fluid.every}
        if fluid.contact is None:
            found[f"{fluid.name} contact pinballs"] = {f"{inside}.contact": "pinballs"}
    return found


def _of_the_material(shell: Shell) -> dict[str, Settings]:
    """Layers or the global form through the thickness, and the delay of damage."""
    inside = f"shells.{shell.name}.material"
    found: dict[str, Settings] = {}
    strength, delay = shell.material.strength, shell.material.delay
    if strength is not None and shell.motion == "free":
        if strength.layers is None:
            found |= {f"layers {k}": {f"{inside}.strength.kappa": 0.0, f"{inside}.strength.layers": k} for k in (3, 5)}
        else:
            found["global form"] = {f"{inside}.strength.layers": None}
    if delay is not None:
        found |= {f"delay x {f:g}": {f"{inside}.delay.tau_c": delay.tau_c * f} for f in (3.0, 1 / 3)}
    return found


def together(path: Path, scene: Scene, texts: Sequence[str]) -> dict[str, Settings]:
    """name -> settings of points that turn several knobs: ['spacing=5mm,precision=f32']."""
    found = {}
    for text in texts:
        settings = {}
        for part in sweep.parts(text):
            name, equals, value = part.partition("=")
            if not equals or not name.strip() or not value.strip():
                raise SceneError(f"--also '{text}' is not of the form key=value,key=value")
            settings[sweep.setting_of(path, scene, name.strip())] = value.strip()
        found[", ".join(f"{key.rpartition('.')[2]} {value}" for key, value in settings.items())] = settings
    return found


# --- what the runs found ----------------------------------------------------------------------------


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


def _only_spacing(settings: Settings) -> bool:
    """Whether they change nothing but the spacing, of a fluid only together with that of its tank."""
    fluid = {key for key in settings if key.startswith("fluids.") and key.endswith(".spacing")}
    return settings.keys() - fluid <= {"quality", "numerics.spacing"} and (not fluid or "numerics.spacing" in settings)


def judged(entries: Mapping[str, Mapping[str, Any]], wanted: Sequence[str] = ()) -> tuple[list[str], list[str]]:
    """Names of the quantities that are judged by their error, and of the counts that must come out. entries: of a summary."""
    for name in wanted:
        if name not in entries:
            raise SceneError(f"--quantity {name}: the scene has no such quantity{nearest(name, entries)}")
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


# --- in words ---------------------------------------------------------------------------------------


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


# --- recorded ---------------------------------------------------------------------------------------


def recorded(scene: Scene | Study, scene_hash: str) -> list[str]:
    """What `validate` says of the price of a scene: its measured error and cost, and the points that the rule chooses."""
    path = FOLDER / f"{scene.name}.json"
    if isinstance(scene, Study) or not scene.quantities:
        return []
    if not path.is_file():
        return [f"measured: not yet; taichi-sph price {scene.name} tells what accuracy costs"]
    record = json.loads(path.read_text(encoding="utf-8"))
    points = {p["name"]: p for p in record["points"]}
    same = [p for p in points.values() if p["scene_hash"] == scene_hash and p["status"] == "done"]
    said = [] if same else [f"measured: not with these settings; {path} holds {len(points)} others"]
    for p in same[:1]:
        error = (
            f"error {_error_words(p)} of {' and '.join(record['references'])}" if p["error"] is not None else "another answer than expected"
        )
        said.append(f"measured: {error}, {_cost(p)}, {bytes_text(p['bytes'])} ({path})")
    for quality in ("draft", "standard", "paper"):
        if quality in record["qualities"]:
            p = points[record["qualities"][quality]]
            said.append(f"by the rule {quality} is: {p['name']}, error {_error_words(p)}, {_cost(p)}{_set(p['settings'])}")
    return said


def _set(settings: Mapping[str, Any]) -> str:
    """How to ask for settings."""
    return "".join(f" --set {key}={value if isinstance(value, str) else json.dumps(value)}" for key, value in settings.items())


# --- the command ------------------------------------------------------------------------------------


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
    from ..output.folder import write_json
    from ..output.record import commit, machine

    scene = load_scene(path, base)
    if not scene.quantities:
        raise SceneError(f"scene '{scene.name}' has no quantities, so there is no error to measure")
    options = list(parameters_of(path)) if path.suffix == ".py" else []
    out = out or Path("runs") / f"{scene.name}-price"
    running.check_out(out, 1_000_000, sweep.MARK)
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
            series = [p for p in points if p["status"] == "done" and _only_spacing(p["settings"])]
            refs = references(points[0], names, series, entries)
            thesis = next((name for name in (THESIS, PAPER) if name in chosen and scene.shells), None)
            measure = "processor" if points[0]["processor"] >= LEAST else "node_steps"
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
    from ..run.plan import plan

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
    from ..output.folder import write_json

    written = [write_json(out / POINT_FILE, found), *sweep.write_table(sweep.rows(results), out)]
    lines = [f"# {found['title']}: what accuracy costs", "", f"    {found['command']}", "", *(f"- {line}" for line in found["words"]), ""]
    lines += [f"Reference of {name}: {r['value']:.6g} {r['unit']}, {r['words']}." for name, r in found["references"].items()]
    chosen = [f"{q} = {found['qualities'][q]}" for q in ("draft", "standard", "paper") if q in found["qualities"]]
    lines += ["", table(found), "", f"Qualities by the rule ({QUALITY_RULE}): {', '.join(chosen)}.", ""]
    lines += [f"Left out: {name}, {why}." for name, why in found["left_out"].items()]
    with files.whole(out / "price.md") as file:
        file.write("\n".join(lines) + "\n")
    written.append(out / "price.md")
    if running.can_draw(progress):
        from ..render.prices import render_price

        written.append(render_price(found, out / "price.png"))
    return written


def _record(found: dict[str, Any], out: Path) -> list[Path]:
    from ..output.folder import write_json

    written = [write_json(FOLDER / f"{found['scene']}.json", found)]
    if (out / "price.png").is_file():
        from ..render import reduced

        written.append(reduced(out / "price.png", PICTURES / f"price_{found['scene']}.png"))
    return written
