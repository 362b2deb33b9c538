"""The answer of a run in words: did it crack or rupture, how, how fast does it leak, and can the numbers be trusted."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..frame import BodyFrame
from ..scene import Scene, Shell
from ..scene.instead import COARSE
from .folder import RunFolder
from .histories import History
from .measures import cracks, fragments, leak, openings, perforation
from .measures.pattern import SMALL, Pattern, pattern

NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")
SCALES = {
    "s": ((1e-6, "us"), (1e-3, "ms"), (1.0, "s")),
    "m": ((1e-6, "um"), (1e-3, "mm"), (1.0, "m")),
    "kg": ((1e-6, "mg"), (1e-3, "g"), (1.0, "kg")),
    "l": ((1e-6, "ul"), (1e-3, "ml"), (1.0, "l")),
    "l/s": ((1e-3, "ml/s"), (1.0, "l/s")),
    "N": ((1.0, "N"), (1e3, "kN"), (1e6, "MN")),
    "J": ((1e-3, "mJ"), (1.0, "J"), (1e3, "kJ"), (1e6, "MJ")),
    "Pa": ((1.0, "Pa"), (1e3, "kPa"), (1e6, "MPa"), (1e9, "GPa")),
}

# options of a quantity as words, in this order; {} is the value
OPTIONS = {
    "striker": "of {}", "fluid": "of {}", "mode": "of mode {}", "column": "of {}", "history": "in {}", "body": "of {}", "time": "at {}",
    "start": "from {}", "end": "to {}", "reference": "over {}",
}  # fmt: skip
MOST_GAUGES = 6  # that the answer names
MEANS = {  # of lengths that one might take for each other
    "hole_diameter": "; of the material that is missing, not the hole that one sees (seen_diameter)",
    "seen_diameter": "; between the lips, as one sees it",
    "opening_diameter": "; as one sees through it along the flight",
    "crack_opening": "; how far the lips of a crack moved apart",
}
OPEN = 5.0  # %: a closed residual above it is warned of
ENOUGH = 10  # particles that have left: fewer make no rate
PLAIN = ("surge_delay", "surge_deviation", "surge_speed")  # their start and end are no times


def in_words(name: str) -> str:
    """The name of a quantity, of a study or a run: "striker_speed(axis=x, beyond=0.0)_finer" -> "striker speed where x = 0,
    finer"."""
    what, _, rest = name.partition("(")
    options, _, case = rest.rpartition(")")
    given = dict(pair.split("=", 1) for pair in options.split(", ") if pair)
    words = [what.replace("_", " ")]
    if {"axis", "beyond"} <= given.keys():
        words.append(f"where {given.pop('axis')} = {float(given.pop('beyond')):g}")
    for key, phrase in OPTIONS.items():
        if key in given:
            value = given.pop(key)
            if key in ("time", "start", "end") and what not in PLAIN:
                value = quantity_text(float(value), "s")
            words.append(phrase.format(_plain(value)))
    text = " ".join(words)
    for part in [*(f"{key} {_plain(value)}" for key, value in given.items()), _plain(case.removeprefix("_"))]:
        text += f", {part}" if part else ""
    return text


def _plain(text: str) -> str:
    try:
        return f"{float(text):.4g}"
    except ValueError:
        return text.removeprefix("rigid_").removeprefix("probe_").replace("_", " ")


def count(number: int) -> str:
    return NUMBERS[number] if 0 <= number < len(NUMBERS) else str(number)


def quantity_text(value: float | None, unit: str) -> str:
    """A value with three digits (ratios near one with four), in a multiple of its unit that suits: 5.62e-05 s -> "56.2 us"."""
    if value is None:
        return "none"
    scales = SCALES.get(unit, ())
    for scale, name in scales:
        if 0 < abs(value) < 999.5 * scale or (value == 0 and scale == 1.0) or scale == scales[-1][0]:
            value, unit = value / scale, name
            break
    # three digits, but whole numbers are not rounded: 1450 m/s
    digits = 4 if not unit and 1 <= abs(value) < 1.1 else 3
    text = f"{value:.0f}" if 1000 <= abs(value) < 1e6 else f"{value:.{digits}g}"
    return f"{text} {unit}".strip()


def tolerance_text(entry: dict[str, Any], doubted: bool = False) -> str:
    """ "expected 56 us +- 6 us: met" or nothing where nothing is expected. doubted: of a run that is not to be trusted."""
    if entry["target"] is None:
        return ""
    text = f"expected {quantity_text(entry['target'], entry['unit'])}"
    if entry["tolerance"]:
        text += f" ± {quantity_text(entry['tolerance'], entry['unit'])}"
    verdict = {True: ": met", False: ": not met", None: ""}[entry["met"]]
    return text + verdict + (", but do not trust it yet" if doubted and entry["met"] else "")


def _cut_crack(p: Pattern) -> str:
    """What became of the crack that runs from the cut."""
    words = "one crack runs from the tip of the cut"
    start = float(p.linked[p.crack].min())
    place = cracks.bifurcation_place(p)
    if place is not None:
        when = cracks.passing_time(p, place)
        branches = count(cracks.count_branches(p))
        words += f" and splits in {branches}, {quantity_text(place, 'm')} ahead of it at {quantity_text(when, 's')}"
    words += f"; it starts at {quantity_text(start, 's')}"
    tip = cracks.tip_history(p)
    if tip is not None:
        words += f", runs at {quantity_text(round(tip.plateau, -1), 'm/s')} after its rise"
    arrival = cracks.arrival_time(p)
    edge = "the edge" if p.turned else "the far edge"
    aside = ", turns aside" if p.turned else ""
    if arrival is not None:
        words += f"{aside} and reaches {edge} at {quantity_text(arrival, 's')}"
    else:
        short = quantity_text(float(p.left[p.crack].min()) - p.spacing / 2, "m")
        words += f"{aside} and stops {short} short of {edge}"
    length = float(np.hypot(p.along[p.crack], p.across[p.crack]).max() + p.spacing / 2)
    if p.turned:
        length = float(p.way[p.crack].max() + p.spacing / 2)
    return words + f"; its length is {quantity_text(length, 'm')}"


def _elsewhere(p: Pattern) -> list[str]:
    """Cracks that are not linked to the cut: how long, where they begin."""
    found = []
    for number in np.flatnonzero(p.size >= SMALL):
        cells = p.component == number
        if p.crack[cells].any():
            continue
        index = np.flatnonzero(cells)
        first = index[np.argmin(p.time[index])]
        x, y = p.place(float(p.along[first]), float(p.across[first]))
        length = math.hypot(np.ptp(p.along[index]), np.ptp(p.across[index])) + p.spacing
        found.append(
            f"a crack of {quantity_text(length, 'm')} begins at x = {quantity_text(float(x), 'm')}, "
            f"y = {quantity_text(float(y), 'm')} at {quantity_text(float(p.time[first]), 's')}"
        )
    return found


def _small_hole(body: BodyFrame) -> str:
    """A rupture too short for a crack: the circle of its area."""
    broke = fragments.ruptured(body)
    gap = math.sqrt(4 / math.pi * float(fragments.cell_areas(body.reference, body.cells)[broke].sum()))
    cells = int(np.count_nonzero(broke))
    return f"a hole of {quantity_text(gap, 'm')} (the area of {count(cells)} broken stress point{'' if cells == 1 else 's'})"


def _hole(f: fragments.Fragments, hole: fragments.Hole, first: bool) -> str:
    """The hole that one sees, and the material that is missing there: two lengths."""
    across, compact = fragments.lips(f, hole)
    missing = quantity_text(hole.diameter, "m")
    head = "a hole" if first else "another"
    when = "" if first else f" at {quantity_text(hole.time, 's')}"
    if across <= 0 or not compact:  # cracks run from it: its area is no circle
        torn = f", open over {0.25e4 * math.pi * across**2:.3g} cm2 with its cracks" if across > 0 else ""
        return f"{head} of {missing}{when} by what is missing of the sheet{torn}"
    less = f"material as a disc of {missing} is missing" if first else f"{missing} missing"
    return f"{head} of {quantity_text(across, 'm')}{when}, as one sees it between its lips ({less})"


def _body(run: RunFolder, shell: Shell, named: bool) -> str:
    body = run.the("shell", shell.name).body(-1)
    head = f"{shell.name} cracked" if named else "Cracked"
    damage = float(np.max(body.cell_data["damage"], initial=0.0))
    broken = int(np.count_nonzero((body.cell_data["broken"] != 0) & (body.cell_data["rupture_time"] > 0)))
    if broken == 0:
        plastic = float(np.max(body.cell_data["plastic"], initial=0.0)) if "plastic" in body.cell_data else 0.0
        yielded = f", the largest plastic strain {plastic:.2g}" if plastic > 0 else ""
        return f"{head}: no. The largest damage is {damage:.2f}{yielded}."
    p = pattern(body, shell.cuts)  # what a cut broke at the start is no crack
    parts = []
    if shell.cuts:
        parts.append(_cut_crack(p) if p.crack.sum() >= SMALL else "the cut stays as it is")
        parts += _elsewhere(p)
    else:
        large = int(np.count_nonzero(p.size >= SMALL))
        parts.append(f"{count(large)} crack{'' if large == 1 else 's'}" if large else f"no crack, {_small_hole(body)}")
    through = len(cracks.through_cracks(p))
    if through > 1 or (through and not p.crack.any()):
        parts.append(f"{count(through)} {'cracks go' if through > 1 else 'crack goes'} through")
    pieces = int(np.count_nonzero(fragments.fragments(body, run.scene).nodes >= 2))
    if pieces > 1:
        parts.append(f"it is in {count(pieces)} pieces")
    sentences = ". ".join(part[0].upper() + part[1:] for part in parts)
    return f"{head}: yes, {broken} of {len(body.cells)} stress points broke. {sentences}."


def _rupture(run: RunFolder, shell: Shell) -> tuple[str, bool]:
    """What a struck or pressed shell came to: hole, petals, plug; or the crack. And whether it ruptured."""
    body = run.the("shell", shell.name).body(-1)
    the = f"The {shell.name.replace('_', ' ')}"
    when = perforation.first_rupture(run, shell.name)
    if when is None:
        worst = ", ".join(
            f"{title} {float(np.max(body.cell_data[key], initial=0.0)):.2g}"
            for key, title in (("plastic", "plastic strain"), ("damage", "damage"))
            if key in body.cell_data
        )
        return f"{the} did not rupture; the largest {worst}.", False
    f = fragments.fragments(body, run.scene)
    found = fragments.holes(f)
    lengths = fragments.crack_lengths(body)
    parts = []
    for number, hole in enumerate(found[:3]):
        parts.append(_hole(f, hole, number == 0))
    torn = fragments.radial_cracks(body, fragments.struck_at(run, body))
    wide = max((hole.diameter for hole in found), default=0.0)
    if len(lengths) and lengths[0] > 3 * math.pi * max(wide, fragments.node_spacing(body.reference, body.cells)):
        parts.append(f"a crack {quantity_text(float(lengths[0]), 'm')} long, open by {quantity_text(fragments.widest(body), 'm')}")
    if torn > 2:
        parts.append(f"{count(torn)} petals")
    if not f.held.any():
        whole = int(np.count_nonzero(f.nodes >= 2))
        mass = quantity_text(fragments.mass_of(f, shell, 0), "kg")
        return f"{the} ruptured at {quantity_text(when, 's')} and fell into {count(whole)} pieces, the largest of {mass}.", True
    if not parts:  # too short for a crack, too small for a hole without a node
        parts.append(_small_hole(body))
    sentences = [f"{the} ruptured at {quantity_text(when, 's')}: {', '.join(parts)}"]
    if len(f.free):
        plug = f.free[0]
        speed = float(np.linalg.norm(f.of(body.point_data["velocity"], plug)))
        across = 2 * math.sqrt(float(f.area[plug]) / math.pi)
        mass = quantity_text(fragments.mass_of(f, shell, int(plug)), "kg")
        sentences[0] += f"; a plug of {quantity_text(across, 'm')} ({mass}) flies at {quantity_text(speed, 'm/s')}"
        others = int(np.count_nonzero(f.nodes[f.free[1:]] >= 2))
        if others:
            sentences[0] += f", with {count(others)} smaller fragment{'' if others == 1 else 's'}"
    return ". ".join(sentences) + ".", True


def _strikers(run: RunFolder) -> list[str]:
    """How the moving rigid bodies end."""
    found = []
    names = perforation.striker_names(run)
    for name in names:
        history = run.history(perforation.PREFIX + name)
        lost = perforation.energy_share_lost(history)
        if lost is None:
            continue
        v = perforation.speeds(history)
        turned = sum(history[c][0] * history[c][-1] for c in ("vx", "vy", "vz")) < 0
        the = (
            "The striker"
            if sum(1 for n in names if perforation.start_speed(run.history(perforation.PREFIX + n)) > 0) == 1
            else f"The {name.replace('_', ' ')}"
        )
        found.append(
            f"{the} {'bounces back' if turned else 'ends'} at {quantity_text(float(v[-1]), 'm/s')} after "
            f"{quantity_text(float(v[0]), 'm/s')} ({100 * lost:.3g} % of its energy {'lost' if lost >= 0 else 'more'}); "
            f"the largest force of a step is {quantity_text(float(history['f_max'].max()), 'N')}."
        )
    for name in fragments.thrown_solids(run):
        v = perforation.speeds(run.history(perforation.SOLID + name))
        if len(v) and v[0] > 0:
            was = f"after {quantity_text(float(v[0]), 'm/s')}"
            found.append(f"The {name.replace('_', ' ')} ends at {quantity_text(float(v[-1]), 'm/s')} {was} (its centre of mass).")
    return found


def _leaks(run: RunFolder, ruptured: dict[str, bool]) -> list[str]:
    """What leaves each tank, and how fast. ruptured: by the name of the shell."""
    tanks = leak.tanks(run)
    shells = {fluid.name: getattr(fluid.fill, "shell", "") for fluid in run.scene.fluids}
    return [line for fluid in tanks for line in _leak(run, fluid, ruptured.get(shells[fluid], False), len(tanks) > 1)]


def _leak(run: RunFolder, fluid: str, ruptured: bool, named: bool) -> list[str]:
    """What leaves one tank."""
    _, history = leak.watched(run, fluid)
    if not len(history):
        return []
    what = fluid.replace("_", " ")
    out = float(leak.litres(run, history, fluid)[-1])
    if out <= 0:
        nothing = f"Nothing of {what} leaked out" if named else "Nothing leaked out"
        if not ruptured:
            return [f"{nothing}."]
        return [f"{nothing} by {quantity_text(float(history.time[-1]), 's')}{_opening(run, fluid, '; {} are open')}."]
    it = what[0].upper() + what[1:] if named else "It"
    count = int(history["escaped_count"][-1])
    if count < ENOUGH:
        text = f"{it} begins to leak: {quantity_text(out, 'l')} by the end ({count} particle{'s' if count > 1 else ''}, too few for a rate)"
    else:
        rate = leak.leak_rate(run, run.scene, fluid=fluid)
        error = leak.leak_rate_error(run, run.scene, fluid=fluid)
        give = f" (± {quantity_text(error, 'l/s')})" if error else ""
        text = f"{it} leaks {quantity_text(rate, 'l/s')}{give} at the end: {quantity_text(out, 'l')} so far"
    speed = leak.jet_speed(run, run.scene, fluid=fluid)
    if speed is not None:
        text += f", in a jet of {quantity_text(speed, 'm/s')}"
    return [f"{text}{_opening(run, fluid, ', through {}')}."]


def _opening(run: RunFolder, fluid: str, words: str) -> str:
    """How wide a tank is open, and what it will leak when the water has come to rest; nothing where nothing is open."""
    area = float(leak.watched(run, fluid)[1]["opening_area"][-1])
    if area <= 0:
        return ""
    text = words.format(f"{area * 1e4:.3g} cm2")
    if (calm := leak.orifice_rate(run, run.scene, fluid=fluid)) is not None:
        text += f", out of which a calm tank would leak {quantity_text(calm, 'l/s')}"
    return text


def _struck(run: RunFolder, shells: list[Shell]) -> list[str]:
    """The verdict on shells that are struck or filled."""
    told = {shell.name: _rupture(run, shell) for shell in shells}
    return [*(text for text, _ in told.values()), *_leaks(run, {name: broke for name, (_, broke) in told.items()}), *_strikers(run)]


def _supports(run: RunFolder) -> list[str]:
    """What the supports and drives of the scene bear at the end, and the most that one of them bore."""
    together, most = np.zeros(3), (0.0, 0, 0.0)
    numbers = [k for k in range(1, len(run.scene.motions) + 1) if (run.path / "histories" / f"support_{k}.csv").exists()]
    for k in numbers:
        history = run.history(f"support_{k}")
        force = np.stack([history[c] for c in ("fx", "fy", "fz")], axis=1)
        if not len(force):
            return []
        together += force[-1]
        size = np.linalg.norm(force, axis=1)
        most = max(most, (float(size.max()), k, float(history.time[np.argmax(size)])))
    if most[0] == 0.0:
        return []
    bear = ", ".join(quantity_text(float(f) if abs(f) > 1e-6 * most[0] else 0.0, "N") for f in together)
    one = "The support bears" if len(numbers) == 1 else f"The {count(len(numbers))} supports bear together"
    which = "" if len(numbers) == 1 else f" of one (support {most[1]})"
    return [f"{one} ({bear}) at the end; the largest force{which} is {quantity_text(most[0], 'N')} at {quantity_text(most[2], 's')}."]


def broke_at(history: History) -> float | None:
    """When [s] the last cell of a strain gauge was found broken: the first sample without a number; None: it held."""
    gone = np.flatnonzero(np.isnan(history["strain"]))
    return float(history.time[gone[0]]) if len(gone) else None


def _gauges(run: RunFolder) -> list[str]:
    """What the strain gauges read: the most, the end, or when they broke with the shell."""
    found = []
    for gauge in run.scene.output.gauges[:MOST_GAUGES]:
        if f"gauge_{gauge.name}" not in run.histories():
            continue
        history = run.history(f"gauge_{gauge.name}")
        strain, end = history["strain"], broke_at(history)
        known = np.flatnonzero(np.isfinite(strain))
        the = f"Gauge {gauge.name.replace('_', ' ')}"
        broke = None if end is None else f"its cells broke by {quantity_text(end, 's')}, after which it reads nothing (nan)"
        if not len(known):
            found.append(f"{the}: {broke or 'no sample'}.")
            continue
        most = int(known[np.argmax(np.abs(strain[known]))])
        last = broke or f"{100 * strain[known[-1]]:.3g} % at the end"
        found.append(f"{the}: {100 * strain[most]:.3g} % strain at the most, at {quantity_text(float(history.time[most]), 's')}; {last}.")
    if (more := len(run.scene.output.gauges) - MOST_GAUGES) > 0 and found:
        found.append(f"{more} more gauges: histories/gauge_*.csv.")
    return found


def unaccounted(residual: float | None, static: bool) -> bool:
    """Whether a closed residual [%] says that numbers are not to be trusted. That of a search for equilibrium says nothing of what it
    found: it is the error of the work, a sum of trapezoids from one equilibrium to the next."""
    return not static and residual is not None and abs(residual) > OPEN


def open_balance(residual: float | None, static: bool) -> str:
    """What to think of a closed residual [%] that is not small."""
    if residual is None or abs(residual) <= OPEN:
        return ""
    if unaccounted(residual, static):
        return (
            f" More than {OPEN:g} % of the energy is not accounted for: do not trust these numbers yet, take a finer spacing or a shorter"
            " step."
        )
    return (
        " That is the error of the work, a sum over the increments; the equilibria stand on their unbalanced force alone. Take more"
        " increments where energies count."
    )


def equilibrium(run: RunFolder) -> tuple[list[str], bool]:
    """How the last equilibrium was found, and what is wrong with it; whether it is not to be trusted."""
    found = run.history("progress")
    last = {name: float(found[name][-1]) for name in found.columns} if len(found) else {}
    if "load" not in last:
        return [], False
    ways = []
    if steps := int(last["newton_steps"]):
        arc = run.scene.static is not None and run.scene.static.method == "arc"
        way = "the path of the load" if arc else "Newton's method"
        ways.append(f"{way} ({steps} factorisation{'' if steps == 1 else 's'})")
    if points := int(last.get("path_points", 0)):
        ways.append(f"the length of the path ({points} point{'' if points == 1 else 's'}), where no step of load was short enough")
    if steps := int(last["relaxation_steps"]):
        ways.append(f"dynamic relaxation ({steps} steps)")
    lines, doubted = [f"Equilibrium by {', then '.join(ways)}."] if ways else [], []
    if last["load"] < 1.0 - 1e-9:
        most = float(found["load"].max())
        lines.append(f"Not all of the load is borne: {100 * last['load']:.3g} % at the end, {100 * most:.3g} % at the most.")
    if last["unstable"] and run.scene.static is not None and run.scene.static.method == "arc":
        lines.append("The last point of the path is unstable: the least push would move the shell on, to another equilibrium.")
    elif last["unstable"]:
        doubted.append("it is unstable, the least push would move the shell on, to another")
    if (turn := last.get("turn_per_cell", 0.0)) > COARSE:
        doubted.append(f"neighbours have turned apart by {math.degrees(turn):.0f} degrees: take a finer spacing, or spread the load")
    return [*lines, *(f"Do not trust this equilibrium yet: {why}." for why in doubted)], bool(doubted)


def answer(run: RunFolder, summary: dict[str, Any] | None = None) -> list[str]:
    """Lines of text: the cracks, the quantities against their targets, the balance of energy, the cost."""
    scene: Scene = run.scene
    summary = run.summary if summary is None else summary
    breakable = [s for s in scene.shells if s.material.damage is not None and s.name in run.bodies()]
    if run.of_kind("rigid") or run.of_kind("fluid") or (breakable and fragments.thrown_solids(run)):
        lines = _struck(run, breakable)
    else:
        lines = [_body(run, shell, len(scene.shells) > 1) for shell in breakable]
    lines += [*openings.too_narrow(run, quantity_text), *_supports(run), *_gauges(run)]
    static = scene.static is not None
    told, doubted = equilibrium(run) if static else ([], False)
    lines += told
    doubted = doubted or unaccounted(summary.get("closed_residual_percent"), static)
    for name, entry in summary["quantities"].items():
        target = tolerance_text(entry, doubted)
        lines.append(
            f"{in_words(name)}: {quantity_text(entry['value'], entry['unit'])}"
            + (f" ({target})" if target else "")
            + MEANS.get(name.partition("(")[0], "")
        )
    balance = []
    for key, title in (("B_percent", "balance B"), ("closed_residual_percent", "closed residual")):
        if summary.get(key) is not None:
            balance.append(f"{title} = {summary[key]:+.2g} %")
    if balance:
        lines.append("Energy: " + ", ".join(balance) + "." + open_balance(summary.get("closed_residual_percent"), static))
    speed = summary.get("node_steps_per_second")
    advance = summary["seconds"].get("advance")
    if speed and advance is not None and round(speed / 1e6, 2) > 0:  # not of a search for equilibrium
        lines.append(f"{summary['steps']} steps of {summary['nodes']} nodes in {advance:.1f} s: {speed / 1e6:.2f} M node-steps/s.")
    return lines
