"""Plots of histories: the energy ledger with its balance, the speed of the crack's tip, strikers, the leak."""

from __future__ import annotations

import textwrap
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator, StrMethodFormatter

from ..output.answer import SCALES, broke_at, in_words, quantity_text
from ..output.folder import RunFolder
from ..output.measures import column, perforation
from ..output.measures import leak as leaking
from ..output.measures.fragments import free_masses
from ..output.measures.waves import rayleigh_speed
from ..scene.units import show

PALETTE = ("#1b4f80", "#c8402f", "#e0912f", "#4b8f5a", "#7a5aa6", "#3aa0a8", "#8c6d46", "#d26fa5", "#6b7680", "#a8b545")
SOFT_LINE = "#6b7680"
CLASSES, FEW = 4, 20  # classes of mass in a decade; pieces of several nodes below which there is no statistics
NARROW = 34  # letters in a line below a chart of targets
SLOW = 0.3  # of the Rayleigh speed: below, its line is left out
PERCENT = {"B_percent": ("balance B (T)", "#1b4f80"), "closed_residual_percent": ("closed residual", "#c8402f")}
STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#5a6670",
    "axes.labelcolor": "#2b333a",
    "xtick.color": "#5a6670",
    "ytick.color": "#5a6670",
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.titlesize": 11,
    "legend.frameon": False,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "text.parse_math": False,  # a title with $ is no formula
}


def time_scale(last: float) -> tuple[float, str]:
    """Factor and name of the unit that suits times up to `last` [s]."""
    return (1e6, "µs") if last < 1e-3 else (1e3, "ms") if last < 1 else (1.0, "s")


def _prefix(largest: float, unit: str) -> tuple[float, str]:
    for factor, prefix in ((1.0, ""), (1e3, "m"), (1e6, "µ"), (1e9, "n")):
        if largest * factor >= 1:
            return factor, prefix + unit
    return 1.0, unit


def _direct_labels(axes: plt.Axes, ends: list[tuple[float, str, str]], right: float, gap: float) -> None:
    """Names at the right end of the lines, pushed apart by `gap` (share of the axes) where they would overlap."""
    low, high = axes.get_ylim()
    gap *= high - low
    ends = sorted(ends)
    places = np.array([value for value, _, _ in ends])
    for i in range(1, len(places)):
        places[i] = max(places[i], places[i - 1] + gap)
    if len(places):  # those that were pushed out come back, and push those below
        places[-1] = min(places[-1], high)
    for i in range(len(places) - 2, -1, -1):
        places[i] = min(places[i], places[i + 1] - gap)
    for place, (_, name, colour) in zip(places, ends, strict=True):
        axes.annotate(name, (right, place), xytext=(6, 0), textcoords="offset points", color=colour, va="center", fontsize=9)


def energies(run: RunFolder, title: str) -> Figure | None:
    """All terms of the ledger in joules; below, the balance in percent. None without samples."""
    history = run.history("energies")
    if len(history) < 2:
        return None
    scale, unit = time_scale(float(history.time[-1]))
    # before the first step nothing is booked, not even what moves at t = 0
    first = int("injected" in history.columns and history["injected"][0] == 0 != history["injected"][1])
    time = history.time[first:] * scale
    joules = [n for n in history.columns if history.units[n] == "J" and np.abs(history[n]).max() > 0]
    largest = max((np.abs(history[n]).max() for n in joules), default=1.0)
    factor, energy_unit = _prefix(float(largest), "J")
    percents = [n for n in PERCENT if n in history.columns and np.isfinite(history[n]).any()]
    with plt.rc_context(STYLE):
        heights = [3, 1.15] if percents else [1]
        figure, axes = plt.subplots(
            len(heights), 1, sharex=True, figsize=(8.6, 5.6), height_ratios=heights, squeeze=False, layout="constrained"
        )
        top = axes[0, 0]
        ends = []
        for number, name in enumerate(joules):
            colour = PALETTE[number % len(PALETTE)]
            values = history[name][first:] * factor
            small = np.abs(history[name]).max() < 2e-3 * largest
            top.plot(time, values, color=colour, lw=1.0 if small else 1.8, ls="--" if name == "external" else "-")
            ends.append((float(values[-1]), name.replace("_", " "), colour))
        top.set_ylabel(f"energy [{energy_unit}]")
        top.set_title(title)
        top.margins(x=0)
        _direct_labels(top, ends, float(time[-1]), 0.052)
        if percents:
            bottom = axes[1, 0]
            bottom.axhline(0, color="#c3ccd3", lw=0.8)
            ends = []
            for name in percents:
                label, colour = PERCENT[name]
                bottom.plot(time, history[name][first:], color=colour, lw=1.4)
                ends.append((float(history[name][-1]), label, colour))
            _direct_labels(bottom, ends, float(time[-1]), 0.15)
            bottom.set_ylabel("error [%]")
            bottom.margins(x=0)
        axes[-1, 0].set_xlim(left=float(history.time[0]) * scale)
        axes[-1, 0].set_xlabel(f"time [{unit}]")
    return figure


def crack_tip(run: RunFolder, title: str, name: str = "crack_tip") -> Figure:
    """Speed of the tip against time with the Rayleigh speed and the plateau; above, how far it has come."""
    history = run.history(name)
    scale, unit = time_scale(float(history.time[-1]))
    time, speed = history.time * scale, history["speed"]
    summary = run.summary if (run.path / "summary.json").is_file() else {"quantities": {}}
    plateau = summary["quantities"].get("tip_speed_plateau", {}).get("value")
    cut = [shell for shell in run.scene.shells if shell.cuts]
    shell = next((s for s in cut if name.endswith(s.name)), cut[0])
    rayleigh = rayleigh_speed(shell.material)
    with plt.rc_context(STYLE):
        figure, (top, bottom) = plt.subplots(2, 1, sharex=True, figsize=(8.6, 5.6), height_ratios=[2, 1], layout="constrained")
        right = float(time[-1])
        top.plot(time, speed, color=PALETTE[0], lw=2)
        highest = 1.1 * float(speed.max())
        label, place = f"Rayleigh speed {rayleigh:.0f} m/s", rayleigh
        if highest > SLOW * rayleigh:
            highest = max(highest, 1.08 * rayleigh)
            top.axhline(rayleigh, color=PALETTE[1], lw=1.2, ls="--")
        else:  # a line far above would flatten the curve
            label, place = label + ", far above", highest
        top.set_ylim(0, highest)
        top.annotate(label, (float(time[0]), place), xytext=(4, -13), textcoords="offset points", color=PALETTE[1], fontsize=9)
        if plateau is not None:
            top.axhline(plateau, color="#6b7680", lw=1.0, ls=":")
            top.annotate(
                f"plateau {plateau:.0f} m/s", (right, plateau), xytext=(6, 0), textcoords="offset points",
                color="#4a545c", fontsize=9, va="center",
            )  # fmt: skip
        top.set_ylabel("speed of the tip [m/s]")
        top.set_title(title)
        bottom.plot(time, history["ahead"] * 1e3, color=PALETTE[0], lw=2)
        bottom.set_ylabel("ahead of the cut [mm]")
        bottom.set_xlabel(f"time [{unit}]")
        bottom.set_ylim(bottom=0)
        split = _bifurcation(run, shell.name)
        if split is not None:
            for axes in (top, bottom):
                axes.axvline(split * scale, color="#e0912f", lw=1.0)
            bottom.annotate(
                f"splits at {split * scale:.3g} {unit}", (split * scale, 0), xytext=(4, 6), textcoords="offset points",
                color="#b06a12", fontsize=9,
            )  # fmt: skip
        top.margins(x=0)
    return figure


def _bifurcation(run: RunFolder, body: str) -> float | None:
    from ..output.measures import measure

    return measure("bifurcation_time", run, {"body": body})


def _suiting(largest: float, unit: str) -> tuple[float, str]:
    """Factor and name of the multiple of a unit in which values up to `largest` are told."""
    for size, name in SCALES.get(unit, ()):
        if 0 < largest < 999.5 * size:
            return 1 / size, name
    return 1.0, unit


def targets(summary: dict[str, Any]) -> Figure:
    """The quantities of a study that have a target, a row for each case and a column for each quantity: the value as a
    dot, red where it misses the band of what is expected."""
    rows: dict[str, list[tuple[str, dict[str, Any]]]] = {}
    for key, entry in summary["quantities"].items():
        case = max((c for c in summary["cases"] if key.endswith(f"_{c}")), key=len, default=None)
        if case is not None and entry["target"] is not None and entry["tolerance"] and entry["value"] is not None:
            rows.setdefault(key.removesuffix(f"_{case}"), []).append((case, entry))
    cases = [c for c in summary["cases"] if any(c == case for found in rows.values() for case, _ in found)]
    place = {case: len(cases) - k for k, case in enumerate(cases)}
    with plt.rc_context(STYLE):
        figure, columns = plt.subplots(
            1, len(rows), sharey=True, squeeze=False, figsize=(4.2 + 3.2 * len(rows), 1.4 + 0.26 * len(cases)), layout="constrained"
        )
        for axes, (quantity, found) in zip(columns[0], rows.items(), strict=True):
            scale, unit = _suiting(max(abs(entry["value"]) for _, entry in found), found[0][1].get("unit", ""))
            for case, entry in found:
                target, tolerance, value = (entry[key] * scale for key in ("target", "tolerance", "value"))
                y = place[case]
                axes.barh(y, 2 * tolerance, left=target - tolerance, height=0.75, color="#dfe6e4")
                axes.plot([target] * 2, [y - 0.375, y + 0.375], color="#8a969c", lw=1)
                axes.plot(value, y, "o", ms=5, color="#1b4f80" if entry["met"] else "#c8402f")
                axes.annotate(f"{value:.4g}", (1.0, y), xycoords=("axes fraction", "data"), xytext=(4, 0),
                              textcoords="offset points", va="center", fontsize=8, color="#5a6670")  # fmt: skip
            axes.set_yticks(list(place.values()), list(place))
            axes.set_xlabel(textwrap.fill(in_words(quantity) + (f" [{unit}]" if unit else ""), NARROW), fontsize=9)
            axes.tick_params(labelsize=8, length=2.5)
            axes.locator_params(axis="x", nbins=5)
            axes.ticklabel_format(axis="x", useOffset=False)
        figure.suptitle(f"{summary['title']}: numbers beside what is expected (grey)", x=0.01, ha="left", fontsize=11, weight="bold")
    return figure


def strikers(run: RunFolder) -> Figure | None:
    """Speed of the rigid bodies against time; below, the force on them. None where none moves."""
    found = {name: run.history(perforation.PREFIX + name) for name in perforation.striker_names(run)}
    found = {name: h for name, h in found.items() if len(h) > 1 and perforation.speeds(h).max() > 0}
    if not found:
        return None
    last = max(float(h.time[-1]) for h in found.values())
    scale, unit = time_scale(last)
    strongest = max(float(perforation.forces(h).max()) for h in found.values())
    factor, force = (1e-3, "kN") if strongest >= 1e3 else (1.0, "N")
    ruptured = perforation.first_rupture(run)
    with plt.rc_context(STYLE):
        figure, (top, bottom) = plt.subplots(2, 1, sharex=True, figsize=(8.6, 5.6), height_ratios=[1.4, 1], layout="constrained")
        ends = []
        for number, (name, h) in enumerate(found.items()):
            colour, v = PALETTE[number % len(PALETTE)], perforation.speeds(h)
            top.plot(h.time * scale, v, color=colour, lw=2)
            bottom.plot(h.time * scale, perforation.forces(h) * factor, color=colour, lw=1.4)
            label = f"{v[-1]:.3g} m/s" if len(found) == 1 else f"{name} {v[-1]:.3g} m/s"
            ends.append((float(v[-1]), label, colour))
        least, most = top.dataLim.y0, top.dataLim.y1
        if least > 0.7 * most:  # a small loss is to be read too
            top.set_ylim(least - 0.35 * (most - least) - 1e-9, most + 0.08 * (most - least) + 1e-9)
        else:
            top.set_ylim(0, 1.03 * most)
        top.set_ylabel("speed [m/s]")
        top.set_title(f"{run.scene.title}: striker" + ("s" if len(found) > 1 else ""))
        bottom.set_ylim(bottom=0)
        bottom.set_ylabel(f"force, sampled [{force}]")
        bottom.set_xlabel(f"time [{unit}]")
        top.margins(x=0)
        _direct_labels(top, ends, last * scale, 0.06)
        _mark(top, ruptured, scale, (top, bottom))
    return figure


def _mark(axes: plt.Axes, time: float | None, scale: float, through: tuple[plt.Axes, ...]) -> None:
    """A line where the first cell broke, at this time [s]."""
    if time is None:
        return
    for each in through:
        each.axvline(time * scale, color="#e0912f", lw=1.0)
    axes.annotate(
        f"first rupture at {show(time, 's')}", (time * scale, axes.get_ylim()[0]), xytext=(5, 12),
        textcoords="offset points", color="#b06a12", fontsize=9,
    )  # fmt: skip


def gauges(run: RunFolder) -> Figure | None:
    """Strain over time of all strain gauges; a cross where the cells of one broke, the most that it read then as its line's end."""
    names = [name for name in run.histories() if name.startswith("gauge_")]
    read = {name: history for name in names if len(history := run.history(name)) > 1}
    if not read:
        return None
    scale, unit = time_scale(max(float(history.time[-1]) for history in read.values()))
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(8.6, 4.2), layout="constrained")
        ends, right = [], max(float(history.time[-1]) for history in read.values()) * scale
        for number, (name, history) in enumerate(read.items()):
            colour, label = PALETTE[number % len(PALETTE)], name.removeprefix("gauge_").replace("_", " ")
            strain = 100 * history["strain"]
            axes.plot(history.time * scale, strain, color=colour, lw=1.6)
            known = np.flatnonzero(np.isfinite(strain))
            end = broke_at(history)
            if end is not None:
                axes.plot(end * scale, strain[known[-1]] if len(known) else 0.0, "x", color=colour, ms=8, mew=2)
                label += f": broke by {end * scale:.3g} {unit}"
            ends.append((float(strain[known[-1]]) if len(known) else 0.0, label, colour))
        axes.axhline(0, color="#c3ccd3", lw=0.8)
        axes.set_xlim(0, right)
        if len(ends) <= len(PALETTE):
            _direct_labels(axes, ends, right, 0.06)
        axes.set_xlabel(f"time [{unit}]")
        axes.set_ylabel("strain [%]")
        axes.set_title(f"{run.scene.title}: strain gauges")
    return figure


def piston(run: RunFolder) -> Figure | None:
    """Pressure of water on a rigid face beside the reduced model of its column, and the band of what is expected; None where the scene asks
    for no such comparison."""
    asked = next((q for q in run.scene.quantities if q.name == "column_ratio"), None)
    if asked is None:
        return None
    options: dict[str, Any] = dict(asked.options)
    time, p = column.pressure(run, run.scene, options["face"])
    if len(time) < 2:
        return None
    scale, unit = time_scale(float(time[-1]))
    reduced = column.model(**options, sound=run.scene.fluids[0].water.sound, duration=float(time[-1]))
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(8.6, 4.4), layout="constrained")
        for quantity in run.scene.quantities:
            span = quantity.options
            if quantity.name.startswith("face_pressure") and quantity.value is not None and quantity.tolerance is not None:
                low, high = (1e-5 * (quantity.value + sign * quantity.tolerance) for sign in (-1, 1))
                first, last = (scale * min(float(span.get(key, 0.0)), float(time[-1])) for key in ("start", "end"))
                axes.fill_between([first, last], low, high, color=SOFT_LINE, alpha=0.45, lw=0)
        axes.plot(reduced["time"] * scale, reduced["pressure"] * 1e-5, color=PALETTE[1], lw=1.4)
        axes.plot(time * scale, p * 1e-5, color=PALETTE[0], lw=1.6)
        ends = [(float(p[-1]) * 1e-5, "computed", PALETTE[0]), (float(reduced["pressure"][-1]) * 1e-5, "column model", PALETTE[1])]
        axes.set_ylim(bottom=0)
        axes.set_ylabel("pressure on the wall [bar]")
        axes.set_xlabel(f"time [{unit}]")
        axes.set_title(f"{run.scene.title}: pressure (grey: expected)")
        axes.margins(x=0)
        _direct_labels(axes, ends, float(time[-1]) * scale, 0.06)
    return figure


def leak(run: RunFolder, fluid: str) -> Figure | None:
    """What has leaked of a fluid and how fast, the speed of the jet, the opening, against time; None where nothing leaks."""
    _, h = leaking.watched(run, fluid)
    if len(h) < 2 or h["escaped_mass"].max() <= 0:
        return None
    scale, unit = time_scale(float(h.time[-1]))
    time, out = h.time * scale, leaking.litres(run, h, fluid)
    factor, litre = (1.0, "l") if out.max() >= 1 else (1e3, "ml")
    # over a moving tenth of the run: from one sample to the next single particles leave
    early, late = (
        np.clip(h.time - 0.5 * leaking.LAST * h.time[-1], 0, None),
        np.clip(h.time + 0.5 * leaking.LAST * h.time[-1], None, h.time[-1]),
    )
    rate = (np.interp(late, h.time, out) - np.interp(early, h.time, out)) / (late - early)
    curves = [
        (out * factor, f"leaked [{litre}]"),
        (rate, f"leak rate over {quantity_text(leaking.LAST * float(h.time[-1]), 's')} [l/s]"),
        (h["jet_speed"], "speed of the jet [m/s]"),
        (h["opening_area"] * 1e4, "opening [cm²]"),
    ]
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, 2, sharex=True, figsize=(9.6, 5.6), layout="constrained")
        for number, (panel, (values, label)) in enumerate(zip(axes.flat, curves, strict=True)):
            panel.plot(time, values, color=PALETTE[number], lw=1.8)
            panel.set_ylabel(label)
            if np.isfinite(values).any():
                panel.set_ylim(min(0.0, float(np.nanmin(values))), 1.12 * max(float(np.nanmax(values)), 1e-12))
            panel.margins(x=0)
        _mark(axes[0, 0], perforation.first_rupture(run), scale, (axes[0, 0],))
        mean = leaking.leak_rate(run, run.scene, fluid=fluid)
        axes[0, 1].plot([(1.0 - leaking.LAST) * time[-1], time[-1]], [mean, mean], color=SOFT_LINE, lw=2.0, ls=":")
        axes[0, 1].annotate(
            f"at the end {mean:.3g} l/s",
            (time[-1], mean),
            xytext=(0, 4),
            textcoords="offset points",
            ha="right",
            fontsize=9,
            color="#4a545c",
        )
        for panel in axes[1]:
            panel.set_xlabel(f"time [{unit}]")
        figure.suptitle(
            f"{run.scene.title}: leak" + (f" of {fluid}" if len(leaking.tanks(run)) > 1 else ""),
            x=0.01,
            ha="left",
            weight="bold",
            fontsize=11,
        )
    return figure


def fragments(run: RunFolder, name: str) -> Figure | None:
    """Pieces by classes of mass, and the mass of all pieces heavier than one, as T fig. 2.36 shows those of a burst tube. None with fewer
    than FEW pieces of several nodes."""
    if np.count_nonzero(run.history(name)["fragment"] >= 0) < FEW:
        return None
    masses = free_masses(run, name)
    scale, unit = (1.0, "kg") if masses[0] >= 1 else (1e3, "g") if masses[0] >= 1e-3 else (1e6, "mg")
    step = 1 / CLASSES
    first, last = np.floor(np.log10(scale * masses[-1]) / step), np.floor(np.log10(scale * masses[0]) / step)
    edges = 10 ** (step * np.arange(first, last + 2))
    with plt.rc_context(STYLE):
        figure, (number, share) = plt.subplots(1, 2, figsize=(9.6, 3.8), layout="constrained")
        number.stairs(np.histogram(scale * masses, edges)[0], edges, fill=True, color=PALETTE[0])
        number.set_ylabel(f"pieces in a class ({CLASSES} a decade)")
        number.set_yscale("log")
        number.set_ylim(bottom=0.7)
        number.set_title(f"{run.scene.title}: {len(masses)} pieces")
        share.step(scale * masses, 100 * np.cumsum(masses) / masses.sum(), where="post", color=PALETTE[1], lw=1.8)
        share.set_ylim(0, 102)
        share.set_ylabel(f"mass in heavier pieces [% of {quantity_text(float(masses.sum()), 'kg')}]")
        for axes in (number, share):
            axes.set_xscale("log")
            axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if edges[-1] < 1e3 * edges[0] else (1,)))
            axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
            axes.xaxis.set_minor_locator(NullLocator())
            axes.set_xlabel(f"mass of a piece [{unit}]")
    return figure
