"""A solid that a striker goes into, cut open along its flight: damage in true deformation, cells that rupture left out."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PatchCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch, Polygon
from scipy.spatial import ConvexHull

from ..frame import BodyFrame
from ..output.folder import RunFolder
from ..output.measures.entry import way
from ..output.measures.fragments import SOLID, fliers
from ..output.measures.perforation import PREFIX
from . import plots
from .panel import DAMAGE, METAL

AROUND = 2.2  # depths of the striker that are shown, to each side and below
NAMES = "xyz"


def section(run: RunFolder) -> Figure | None:
    """None where no striker flies at a solid that ruptures. The striker is the fastest body that moves at the start, rigid or solid."""
    found = next(iter(fliers(run)), None)
    if found is None:
        return None
    striker, (at, direction, _) = found
    gone = _way(run, striker)
    ruptures = {solid.name for solid in run.scene.solids if solid.material.critical_damage is not None}
    solids = [file for file in run.of_kind("solid") if file.name in ruptures and file.name != striker]
    if gone is None or not solids:
        return None
    file = min(solids, key=lambda solid: float(np.linalg.norm(solid.body(0).points - at, axis=1).min()))  # it comes to that one first
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
    wide = AROUND * max(float(gone.max()), 1e-6)
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
        for name in dict.fromkeys([striker, *(rigid.name for rigid in run.scene.rigids if any(rigid.velocity))]):
            points = run.frames(name).body(-1).points
            seen = 1e3 * np.column_stack([points[:, across] - at[across], sign * points[:, along] - surface])
            balls = next((rigid.pinballs for rigid in run.scene.rigids if rigid.name == name and rigid.pinballs), None)
            if balls is None:
                outline: list[Patch] = [Polygon(seen[ConvexHull(seen).vertices], closed=True)]
            else:
                outline = [Circle(middle, 1e3 * ball.radius) for middle, ball in zip(seen, balls, strict=False)]
            axes.add_collection(PatchCollection(outline, facecolor=METAL, edgecolor="#2b333a", lw=0.8))
        _targets(axes, run, 1e3 * wide)
        axes.set_aspect("equal")
        axes.set_xlim(-1e3 * wide, 1e3 * wide)
        axes.set_ylim(-1e3 * wide, 0.6e3 * wide)
        axes.set_xlabel(f"{NAMES[across]} from the line of flight [mm]")
        axes.set_ylabel("height over the struck side [mm]")
        axes.set_title(f"{run.scene.title}: section at {time * scale:.3g} {unit}")
        figure.colorbar(ScalarMappable(Normalize(0, 1), DAMAGE), ax=axes, label="damage D [-]", shrink=0.7)
    return figure


def _way(run: RunFolder, striker: str) -> np.ndarray | None:
    """(n,) how far a striker has gone [m], by its own history; None without one."""
    name = next((name for name in (PREFIX + striker, SOLID + striker) if name in run.histories()), None)
    return None if name is None else way(run.history(name))


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
