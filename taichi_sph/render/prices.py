"""The chart of accuracy against cost, from the record of `taichi-sph price`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from .pictures import _save
from .plots import PALETTE, SOFT_LINE, STYLE

FAMILIES = {"spacing": PALETTE[0], "quality": PALETTE[0], "thesis": PALETTE[1], "collocation": PALETTE[1], "support": PALETTE[3]}
OTHERS = PALETTE[2]
WIDE = 28  # letters of a name
LEAST = 1e-4  # an error below is drawn there: the axis is logarithmic


def render_price(record: Mapping[str, Any], path: Path) -> Path:
    """Error over processor seconds and over node-steps: every point, the front, the scene as it is, the thesis's settings."""
    points = [p for p in record["points"] if p["error"] is not None]
    with plt.rc_context(STYLE):
        figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.8), sharey=True)
        for axes, key, scale, label in (
            (left, "processor", 1.0, "processor seconds of the time loop"),
            (right, "node_steps", 1e-6, "million node-steps"),
        ):
            _points(axes, points, key, scale)
            _others(axes, [p for p in record["points"] if p["status"] == "done" and p["error"] is None], key, scale)
            axes.set_xlabel(label)
        left.set_ylabel("error of " + "\nand ".join(record["references"]), fontsize=9)
        figure.suptitle(f"{record['title']}: what accuracy costs", x=0.02, ha="left", fontweight="bold")
        figure.text(
            0.02, 0.01, "line: points that no other one beats; bar: runs with nodes moved at random; square: the scene as it is; "
            "diamond: the thesis's settings; cross: another answer", fontsize=8, color=SOFT_LINE,
        )  # fmt: skip
        figure.tight_layout(rect=(0, 0.03, 1, 0.97))
        return _save(figure, path, dpi=100)


def _points(axes: plt.Axes, points: list[Mapping[str, Any]], key: str, scale: float) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(lambda v, _: f"{100 * v:.3g} %")
    narrow = max(p["error"] for p in points) < 4 * max(min(p["error"] for p in points), LEAST)
    digits = "123456789" if narrow else "25"
    axes.yaxis.set_minor_formatter(lambda v, _: f"{100 * v:.2g} %" if f"{v:e}"[0] in digits else "")
    axes.xaxis.set_major_formatter(lambda v, _: f"{v:g}")
    axes.xaxis.set_minor_formatter(lambda v, _: f"{v:g}" if f"{v:e}"[0] in "25" else "")
    axes.grid(True, which="major", color="#e6e9ec", linewidth=0.6)
    line: list[Mapping[str, Any]] = []
    for p in sorted(points, key=lambda p: (p[key], p["error"])):
        if not p["name"].startswith("delay") and (not line or p["error"] < line[-1]["error"]):
            line.append(p)
    front = [p["name"] for p in line]
    axes.plot([p[key] * scale for p in line], [max(p["error"], LEAST) for p in line], color=SOFT_LINE, linewidth=1, zorder=1)
    for p in points:
        x, y = p[key] * scale, max(p["error"], LEAST)
        colour = FAMILIES.get(p["name"].split()[0], OTHERS)
        if p.get("spread"):
            axes.plot([x, x], [max(e, LEAST) for e in p["spread"]], color=colour, linewidth=2.5, alpha=0.35, zorder=1)
        marker = {"as it is": "s", "thesis": "D"}.get(p["name"], "o")
        axes.plot(x, y, marker, color=colour, markersize=8 if marker != "o" else 5, zorder=3)
    named = [
        p for p in points if p["name"] in (*front, "as it is") or p["name"].split()[0] in ("thesis", "collocation", "quality", "spacing")
    ]
    _label(axes, [(p["name"], p[key] * scale, max(p["error"], LEAST)) for p in named])


def _others(axes: plt.Axes, points: list[Mapping[str, Any]], key: str, scale: float) -> None:
    """Crosses along the top: what gave another number of cracks, or none."""
    for p in points:
        axes.plot(p[key] * scale, 0.985, "x", color=SOFT_LINE, markersize=6, transform=axes.get_xaxis_transform(), clip_on=False)


def _label(axes: plt.Axes, entries: list[tuple[str, float, float]]) -> None:
    """Names beside their points, one that would cover another one left out."""
    axes.figure.canvas.draw()
    taken: list[np.ndarray] = []
    for name, x, y in entries:
        at = axes.transData.transform((x, y))
        if any(abs(at[0] - t[0]) < 75 and abs(at[1] - t[1]) < 11 for t in taken):
            continue
        taken.append(at)
        axes.annotate(
            name if len(name) <= WIDE else name[: WIDE - 1] + "…",
            (x, y),
            xytext=(6, 3),
            textcoords="offset points",
            fontsize=7.5,
            color="#2b333a",
        )
