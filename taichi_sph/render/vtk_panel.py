"""A body seen from above, drawn by VTK through PyVista, off screen."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np
import pyvista

from ..output.frame import BodyFrame
from .panel import Look, View, cell_values, displaced, kept

SHARPER = 2  # pixels drawn per pixel shown, each way


def grid(body: BodyFrame, look: Look, view: View) -> pyvista.UnstructuredGrid:
    """Sound cells of a body on magnified displacements, with the values of the look."""
    sound = kept(body)
    cells, values = body.cells[sound], cell_values(body, look.field)[sound]
    quads = cells[:, 3] >= 0
    parts = {pyvista.CellType.QUAD: cells[quads], pyvista.CellType.TRIANGLE: cells[~quads, :3]}
    made = pyvista.UnstructuredGrid({k: c for k, c in parts.items() if len(c)}, view.seen(displaced(body, look.magnification)))
    made.cell_data["shown"] = np.concatenate([values[quads], values[~quads]])
    return made


@functools.lru_cache(maxsize=1)  # a new OpenGL context for each page of a movie would take most of its time
def _plotter(width: int, height: int) -> pyvista.Plotter:
    plotter = pyvista.Plotter(off_screen=True, window_size=(width, height))
    plotter.set_background("white")
    plotter.enable_parallel_projection()
    return plotter


def image(bodies: Sequence[BodyFrame], look: Look, view: View, width: int, height: int) -> np.ndarray:
    """(height, width, 4) uint8: bodies in parallel projection, transparent where there is nothing."""
    plotter = _plotter(SHARPER * width, SHARPER * height)
    plotter.clear_actors()
    for body in bodies:
        if not kept(body).any():
            continue
        plotter.add_mesh(
            grid(body, look, view),
            scalars="shown",
            cmap=look.colours,
            clim=(look.low, look.high),
            lighting=view.turn is not None,
            **({} if view.turn is None else {"ambient": 0.5, "diffuse": 0.6}),
            show_scalar_bar=False,
            render=False,
        )
    x, y = (view.x0 + view.x1) / 2, (view.y0 + view.y1) / 2
    far = 10 * max(view.x1 - view.x0, view.y1 - view.y0)
    plotter.camera_position = [(x, y, far), (x, y, 0.0), (0.0, 1.0, 0.0)]
    plotter.camera.parallel_scale = (view.y1 - view.y0) / 2
    plotter.camera.clipping_range = (far / 2, 2 * far)
    plotter.render()  # a screenshot alone would show what was drawn before
    pixels = np.asarray(plotter.screenshot(None, transparent_background=True, return_img=True))
    # average the extra pixels with their weight, so that edges do not darken
    tall, wide = (n // SHARPER * SHARPER for n in pixels.shape[:2])
    fine = pixels[:tall, :wide].astype(np.float32).reshape(tall // SHARPER, SHARPER, wide // SHARPER, SHARPER, 4)
    weight = fine[..., 3:].sum(axis=(1, 3))
    colour = (fine[..., :3] * fine[..., 3:]).sum(axis=(1, 3)) / np.maximum(weight, 1)
    return np.concatenate([colour, weight / SHARPER**2], axis=-1).round().astype(np.uint8)
