"""A flat shell that was slit, or that tore: where its cells broke, in plan, drawn in the reference, and how it lies at the end, from the
side.

What planes of symmetry mirror is drawn too. The plan is seen against z.
"""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from scipy.spatial import cKDTree

from ..frame import BodyFrame
from ..output.folder import RunFolder
from ..output.measures.fragments import border, live, ruptured
from . import plots
from .panel import PLASTIC

FLAT = 1e-6  # of its size: a shell that is as thin as that is flat
BROKEN, SLIT = "#d1242f", "#0d1117"
LINES: dict[str, Any] = {"edgecolors": "#57606a", "linewidths": 0.15}
NEAR = 1e-5  # of its size: nodes so near each other stand in one place


def plan(run: RunFolder) -> Figure | None:
    """The first shell that is flat, parallel to z = 0, and has slits or broken cells; None where there is none."""
    for file in run.of_kind("shell"):
        body = file.body(-1)
        size = np.ptp(body.reference, axis=0)
        if size[2] > FLAT * size.max() or "broken" not in body.cell_data:
            continue
        slits = _slits(body)
        if len(slits) or ruptured(body).any():
            return _drawn(run, body, slits, float(file.times[-1]))
    return None


def _slits(body: BodyFrame) -> np.ndarray:
    """(K, 2) nodes of the sides along which other cells of the body lie whose nodes are others."""
    edges = border(body.cells)
    size = float(np.ptp(body.reference, axis=0).max())
    pairs = cKDTree(body.reference[edges].mean(axis=1)).query_pairs(NEAR * size, output_type="ndarray")
    return edges[np.unique(pairs)]


def _mirrors(run: RunFolder, body: BodyFrame) -> list[tuple[float, float]]:
    """(1 or -1, 1 or -1): signs of x and y under which the body is seen, itself first. Walls through the origin are planes of symmetry
    where the body ends on them."""
    signs = [(1.0, 1.0)]
    for axis in (0, 1):
        ends = abs(float(body.reference[:, axis].min())) < NEAR * float(np.ptp(body.reference[:, axis]))
        normal = [0.0, 0.0, 0.0]
        normal[axis] = 1.0
        if ends and any(np.allclose(wall.normal, normal) and abs(wall.point[axis]) < 1e-12 for wall in run.scene.walls):
            signs += [(-a, b) if axis == 0 else (a, -b) for a, b in signs]
    return signs


def _drawn(run: RunFolder, body: BodyFrame, slits: np.ndarray, time: float) -> Figure:
    corners = np.where(body.cells < 0, body.cells[:, :1], body.cells)
    broken, whole = ruptured(body), live(body)
    strain = np.asarray(body.cell_data.get("plastic", body.cell_data["damage"]), float)
    scale, unit = plots.time_scale(time)
    bar = float(np.quantile(strain[whole], 0.99)) if whole.any() else 1.0
    norm = Normalize(0.0, max(bar, 1e-6))
    with plt.rc_context(plots.STYLE):
        figure, (above, beside) = plt.subplots(
            2, 1, figsize=(7.2, 9.4), layout="constrained", gridspec_kw={"height_ratios": [2.6, 1.0]}, sharex=True
        )
        for sign in _mirrors(run, body):
            places = 1e3 * body.reference[:, :2] * sign
            above.add_collection(PolyCollection(places[corners[~broken]], array=strain[~broken], cmap=PLASTIC, norm=norm, **LINES))
            above.add_collection(PolyCollection(places[corners[broken]], facecolors=BROKEN, edgecolors=BROKEN, linewidths=0.3))
            above.add_collection(LineCollection(places[slits], colors=SLIT, linewidths=1.4))
            now = 1e3 * body.points * [*sign, 1.0]
            beside.add_collection(PolyCollection(now[corners[whole]][..., [0, 2]], array=strain[whole], cmap=PLASTIC, norm=norm, **LINES))
        above.plot([], [], "s", color=BROKEN, label="broken cells")
        if len(slits):
            above.plot([], [], color=SLIT, label="slits")
        above.legend(loc="upper right", frameon=False)
        for axes, name in ((above, "y"), (beside, "z")):
            axes.autoscale_view()
            axes.set_aspect("equal")
            axes.set_ylabel(f"{name} [mm]")
        beside.set_xlabel("x [mm]")
        above.set_title(f"{run.scene.title}: {body.name} in the reference")
        beside.set_title(f"from the side, at {time * scale:.3g} {unit}")
        label = "plastic strain" if "plastic" in body.cell_data else "damage"
        figure.colorbar(ScalarMappable(norm, PLASTIC), ax=[above, beside], label=label, shrink=0.6, extend="max")
    return figure
