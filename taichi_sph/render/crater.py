"""A solid that a striker goes into, cut open along its flight: damage in true deformation, cells that rupture left out."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from scipy.spatial import ConvexHull

from ..frame import BodyFrame
from ..output.folder import RunFolder
from ..output.measures.fragments import flight
from ..output.measures.penetration import penetration_depth
from . import plots
from .panel import DAMAGE, METAL

AROUND = 2.2  # depths of the striker that are shown, to each side and below
NAMES = "xyz"


def section(run: RunFolder) -> Figure | None:
    """None where no striker flies at a solid that ruptures."""
    path = flight(run)
    solids = [solid.name for solid in run.scene.solids if solid.material.critical_damage is not None]
    if path is None or not solids or solids[0] not in run.bodies():
        return None
    at, direction, _ = path
    file = run.frames(solids[0])
    body, time = file.body(-1), float(file.times[-1])
    along = int(np.argmax(np.abs(direction)))
    across, aside = (k for k in range(3) if k != along)
    faces = _plane(body, aside, at[aside])
    if not len(faces):
        return None
    sign = -float(np.sign(direction[along]))
    surface = float((sign * body.reference[:, along]).max())
    mirrored = abs(float(body.reference[:, across].min()) - at[across]) < 1e-6 * float(np.ptp(body.reference[:, across]))
    places = np.column_stack([body.points[:, across] - at[across], sign * body.points[:, along] - surface])
    scale, unit = plots.time_scale(time)
    wide = AROUND * max(penetration_depth(run, run.scene), 1e-6)
    with plt.rc_context(plots.STYLE):
        figure, axes = plt.subplots(figsize=(8.6, 6.2), layout="constrained")
        for side in (1.0, -1.0) if mirrored else (1.0,):
            corners = 1e3 * places[body.cells[faces]] * [side, 1.0]
            damage = body.cell_data["damage"][faces]
            axes.add_collection(
                PolyCollection(corners, array=damage, cmap=DAMAGE, clim=(0, 1), edgecolors="#2b333a", linewidths=0.12, rasterized=True)
            )
            loose = np.flatnonzero(body.point_data["fragment"].astype(bool) & (np.abs(body.reference[:, aside] - at[aside]) < 1e-9))
            axes.plot(side * 1e3 * places[loose, 0], 1e3 * places[loose, 1], ".", color="#5a3a20", ms=2.5)
        for name in [rigid.name for rigid in run.scene.rigids if any(rigid.velocity)]:
            points = run.frames(name).body(-1).points
            seen = 1e3 * np.column_stack([points[:, across] - at[across], sign * points[:, along] - surface])
            axes.add_patch(Polygon(seen[ConvexHull(seen).vertices], closed=True, facecolor=METAL, edgecolor="#2b333a", lw=0.8))
        _targets(axes, run, 1e3 * wide)
        axes.set_aspect("equal")
        axes.set_xlim(-1e3 * wide, 1e3 * wide)
        axes.set_ylim(-1e3 * wide, 0.6e3 * wide)
        axes.set_xlabel(f"{NAMES[across]} from the line of flight [mm]")
        axes.set_ylabel("height over the struck side [mm]")
        axes.set_title(f"{run.scene.title}: section at {time * scale:.3g} {unit}")
        figure.colorbar(ScalarMappable(Normalize(0, 1), DAMAGE), ax=axes, label="damage D [-]", shrink=0.7)
    return figure


def _plane(body: BodyFrame, aside: int, at: float) -> np.ndarray:
    """Numbers of the faces on the plane of the mesh nearest to the flight that are in a cell still whole."""
    levels = np.unique(np.round(body.reference[:, aside], 9))
    level = levels[np.argmin(np.abs(levels - at))]
    on = (body.cells[:, 3] >= 0) & (np.abs(body.reference[body.cells, aside] - level) < 2e-9).all(axis=1)
    return np.flatnonzero(on & np.isnan(body.cell_data["rupture_time"]))


def _targets(axes: plt.Axes, run: RunFolder, wide: float) -> None:
    """What the scene expects, as lines in millimetres."""
    for quantity in run.scene.quantities:
        if quantity.value is None:
            continue
        if quantity.name == "penetration_depth":
            axes.axhline(-1e3 * quantity.value, color="#1b4f80", lw=1.0, ls="--")
            axes.annotate(
                f"expected {1e3 * quantity.value:.3g} mm", (wide, -1e3 * quantity.value), xytext=(-4, 4),
                textcoords="offset points", ha="right", color="#1b4f80", fontsize=9,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.5, "alpha": 0.85},
            )  # fmt: skip
        if quantity.name == "crater_diameter":
            ends = 0.5e3 * quantity.value
            axes.add_collection(LineCollection([[(x, -0.04 * wide), (x, 0.04 * wide)] for x in (-ends, ends)], colors="#1b4f80", lw=1.6))
            axes.annotate(
                f"expected crater {1e3 * quantity.value:.3g} mm", (ends, 0.04 * wide), xytext=(4, 2),
                textcoords="offset points", color="#1b4f80", fontsize=9,
            )  # fmt: skip
