"""The answer of a run in words: did it crack, how, how fast, and can the numbers be trusted."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..scene import Scene, Shell
from .folder import RunFolder
from .measures import cracks
from .measures.pattern import SMALL, Pattern, pattern

NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")
SCALES = {"s": ((1e-6, "us"), (1e-3, "ms"), (1.0, "s")), "m": ((1e-6, "um"), (1e-3, "mm"), (1.0, "m"))}


def count(number: int) -> str:
    return NUMBERS[number] if 0 <= number < len(NUMBERS) else str(number)


def quantity_text(value: float | None, unit: str) -> str:
    """A value with three digits, seconds and metres in a unit that suits: 5.62e-05 s -> "56.2 us"."""
    if value is None:
        return "none"
    for scale, name in SCALES.get(unit, ()):
        if 0 < abs(value) < 1000 * scale or scale == 1.0:
            value, unit = value / scale, name
            break
    # three digits, but whole numbers are not rounded: 1450 m/s
    text = f"{value:.0f}" if 1000 <= abs(value) < 1e6 else f"{value:.3g}"
    return f"{text} {unit}".strip()


def tolerance_text(entry: dict[str, Any]) -> str:
    """ "expected 56 us +- 6 us: met" or nothing where nothing is expected."""
    if entry["target"] is None:
        return ""
    text = f"expected {quantity_text(entry['target'], entry['unit'])}"
    if entry["tolerance"]:
        text += f" ± {quantity_text(entry['tolerance'], entry['unit'])}"
    verdict = {True: ": met", False: ": not met", None: ""}[entry["met"]]
    return text + verdict


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
    arrival = cracks.passing_time(p, p.far - 1.501 * p.spacing)
    if arrival is not None:
        words += f" and reaches the far edge at {quantity_text(arrival, 's')}"
    else:
        reach = float(p.along[p.crack].max()) + p.spacing / 2
        words += f" and stops {quantity_text(p.far - reach, 'm')} short of the far edge"
    length = float(np.hypot(p.along[p.crack], p.across[p.crack]).max() + p.spacing / 2)
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


def _body(run: RunFolder, shell: Shell, named: bool) -> str:
    body = run.frames(shell.name).body(-1)
    head = f"{shell.name} cracked" if named else "Cracked"
    damage = float(np.max(body.cell_data["damage"], initial=0.0))
    broken = int(np.count_nonzero((body.cell_data["broken"] != 0) & (body.cell_data["rupture_time"] > 0)))
    if broken == 0:
        return f"{head}: no. The largest damage is {damage:.2f}."
    p = pattern(body, shell.cuts)  # what a cut broke at the start is no crack
    parts = []
    if shell.cuts:
        parts.append(_cut_crack(p) if p.crack.sum() >= SMALL else "the cut stays as it is")
        parts += _elsewhere(p)
    else:
        large = int(np.count_nonzero(p.size >= SMALL))
        parts.append(f"{count(large)} crack{'' if large == 1 else 's'}")
    through = len(cracks.through_cracks(p))
    if through > 1 or (through and not p.crack.any()):
        parts.append(f"{count(through)} {'cracks go' if through > 1 else 'crack goes'} through")
    sentences = ". ".join(part[0].upper() + part[1:] for part in parts)
    return f"{head}: yes, {broken} of {len(body.cells)} stress points broke. {sentences}."


def answer(run: RunFolder, summary: dict[str, Any] | None = None) -> list[str]:
    """Lines of text: the cracks, the quantities against their targets, the balance of energy, the cost."""
    scene: Scene = run.scene
    summary = run.summary if summary is None else summary
    breakable = [s for s in scene.shells if s.material.damage is not None and s.name in run.bodies()]
    lines = [_body(run, shell, len(scene.shells) > 1) for shell in breakable]
    for name, entry in summary["quantities"].items():
        target = tolerance_text(entry)
        lines.append(f"{name}: {quantity_text(entry['value'], entry['unit'])}" + (f" ({target})" if target else ""))
    balance = []
    for key, title in (("B_percent", "balance B"), ("closed_residual_percent", "closed residual")):
        if summary.get(key) is not None:
            balance.append(f"{title} = {summary[key]:+.2g} %")
    if balance:
        lines.append("Energy: " + ", ".join(balance) + ".")
    speed = summary.get("node_steps_per_second")
    advance = summary["seconds"].get("advance")
    if speed and advance is not None:
        lines.append(f"{summary['steps']} steps of {summary['nodes']} nodes in {advance:.1f} s: {speed / 1e6:.2f} M node-steps/s.")
    return lines
