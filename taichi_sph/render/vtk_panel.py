"""Bodies seen in parallel projection, drawn by VTK through PyVista, off screen.

Particles are drawn as points with the shading of balls: one vertex each, so a hundred thousand cost little.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np
import pyvista

from ..frame import BodyFrame
from ..geometry.mesh import SurfaceMesh
from ..output.measures.fragments import border
from ..output.measures.pattern import node_spacing
from .panel import CORE, DOT, ELEMENT, LOOSE, METAL, Look, View, cell_values, displaced, kept, outlined, point_values, scattered

SHARPER = 2  # pixels drawn per pixel shown, each way
LIT = {"ambient": 0.4, "diffuse": 0.65, "specular": 0.08, "specular_power": 15}
INSIDE = {"ambient": 0.2, "diffuse": 0.35}  # of a closed body, seen through a hole
FOLD = 40.0  # deg between two cells from which on an edge is drawn sharp


def grid(body: BodyFrame, look: Look, view: View) -> pyvista.UnstructuredGrid:
    """Sound cells of a body on magnified displacements, with the values of the look."""
    sound = kept(body)
    cells, values = body.cells[sound], cell_values(body, look.field)[sound]
    quads = cells[:, 3] >= 0
    parts = {pyvista.CellType.QUAD: cells[quads], pyvista.CellType.TRIANGLE: cells[~quads, :3]}
    made = pyvista.UnstructuredGrid({k: c for k, c in parts.items() if len(c)}, view.seen(displaced(body, look.magnification)))
    made.cell_data["shown"] = np.concatenate([values[quads], values[~quads]])
    return made


def smooth(body: BodyFrame, look: Look, view: View) -> pyvista.PolyData:
    """Sound cells as a smooth surface: values and normals are means over the live cells of a node."""
    sound = kept(body)
    cells, values = body.cells[sound], cell_values(body, look.field)[sound]
    corner = cells >= 0
    weight = np.bincount(cells[corner], minlength=len(body.points))
    total = np.bincount(cells[corner], np.broadcast_to(values[:, None], cells.shape)[corner], minlength=len(body.points))
    faces = np.column_stack([corner.sum(axis=1), cells])
    made = pyvista.PolyData(view.seen(displaced(body, look.magnification)), faces=faces[np.column_stack([corner[:, 0], corner])])
    made.point_data["shown"] = total / np.maximum(weight, 1)
    return made.compute_normals(cell_normals=False, split_vertices=True, feature_angle=FOLD, consistent_normals=False)


def closed(body: BodyFrame) -> int:
    """+1 for a body without border whose cells turn outwards, -1 inwards, 0 for one with a border."""
    if len(border(body.cells)):
        return 0
    p = body.reference[np.where(body.cells < 0, body.cells[:, :1], body.cells)] - body.reference.mean(axis=0)
    return int(np.sign(np.einsum("mi,mi->", p[:, 0], np.cross(p[:, 1], p[:, 2]))))


def _balls(plotter: pyvista.Plotter, points: np.ndarray, pixels: float, **how: object) -> None:
    plotter.add_points(
        points, style="points", render_points_as_spheres=True, point_size=max(2.0, pixels), render=False, show_scalar_bar=False, **how
    )


@functools.cache  # a new OpenGL context for each panel would take most of its time
def _plotter(lamp: bool) -> pyvista.Plotter:
    """A window that every panel sizes anew. One lamp beside the eye, so that a colour is the same from all sides, or the usual lights."""
    plotter = pyvista.Plotter(off_screen=True, lighting="none" if lamp else "light kit")
    if lamp:
        plotter.add_light(pyvista.Light(position=(0.2, 0.35, 1.0), light_type="camera light"))
    plotter.set_background("white")
    plotter.enable_parallel_projection()
    return plotter


def _pinballs(plotter: pyvista.Plotter, body: BodyFrame, view: View, cut: tuple[np.ndarray, np.ndarray] | None) -> None:
    """Balls of dark metal; one through which the plane of a section goes shows its flat inside."""
    for centre, radius in zip(body.points, body.point_data["radius"], strict=True):
        ball = pyvista.Sphere(radius=radius, center=view.seen(centre[None])[0], theta_resolution=60, phi_resolution=60)
        if cut is not None and abs((centre - cut[0]) @ cut[1]) < 0.99 * radius:
            place, normal = view.seen(cut[0][None])[0], view.seen(cut[1][None])[0]
            plotter.add_mesh(ball.slice(normal=normal, origin=place).delaunay_2d(), color=CORE, ambient=0.6, diffuse=0.4, render=False)
            ball = ball.clip(normal=normal, origin=place)
        plotter.add_mesh(ball, color=METAL, smooth_shading=True, specular=0.5, specular_power=20, render=False)


def _solid(plotter: pyvista.Plotter, body: BodyFrame, points: np.ndarray, hollow: bool) -> None:
    """A surface of dark metal; of one that is met on its inside the near side is left out where the scene is cut open."""
    count = np.where(body.cells[:, 3] < 0, 3, 4)
    faces = np.concatenate([[n, *cell[:n]] for n, cell in zip(count, body.cells)])
    hull = pyvista.PolyData(points, faces)
    plotter.add_mesh(hull, color=METAL, specular=0.5, specular_power=20, culling="back" if hollow else None, render=False)


def _inside_out(body: BodyFrame) -> bool:
    """Whether the normals of a closed surface point inward."""
    return SurfaceMesh(body.points, body.cells, 1.0).volume < 0


def image(
    bodies: Sequence[BodyFrame],
    look: Look,
    view: View,
    width: int,
    height: int,
    wet: Look | None = None,
    cut: tuple[np.ndarray, np.ndarray] | None = None,
) -> np.ndarray:
    """(height, width, 4) uint8: bodies in parallel projection, transparent where there is nothing.

    `look` is that of shells, `wet` that of fluids; rigid bodies are dark metal, halved by the plane `cut`.
    """
    plotter = _plotter(look.loose)
    plotter.clear_actors()
    # PyVista's own window_size would draw at once, and so would its camera_position
    plotter.render_window.SetSize(SHARPER * width, SHARPER * height)
    scale = SHARPER * height / (view.y1 - view.y0)  # pixels per metre
    low, high = np.inf, -np.inf  # towards the eye
    for body in bodies:
        if len(body.points) == 0:
            continue
        points = view.seen(displaced(body, look.magnification))
        room = float(np.max(body.point_data.get("radius", 0.0)))
        low, high = min(low, points[:, 2].min() - room), max(high, points[:, 2].max() + room)
        if body.form == "balls":
            _pinballs(plotter, body, view, cut)
        elif body.form == "solid":
            _solid(plotter, body, points, cut is not None and _inside_out(body))
        elif body.form == "points":
            _balls(plotter, points, DOT * (view.x1 - view.x0) * scale, color=METAL)
        elif body.form == "particles":
            if wet is None:
                continue
            values, sizes = wet.shade(point_values(body, wet.field)), body.point_data["diameter"]
            light = {"ambient": 0.35, "diffuse": 0.75}
            for size in np.unique(sizes):
                own = sizes == size
                across = float(size) * scale
                _balls(plotter, points[own], across, scalars=values[own], cmap=wet.colours, clim=(0.0, 1.0), **light)
        elif body.form == "field":
            if wet is not None and len(body.cells):
                plane = grid(body, wet, view)
                plane["shown"] = wet.shade(plane["shown"])
                colours = {"scalars": "shown", "cmap": wet.colours, "clim": (0.0, 1.0), "show_scalar_bar": False}
                plotter.add_mesh(plane, **colours, lighting=False, render=False)
        elif kept(body).any():
            surface = smooth(body, look, view) if look.loose else grid(body, look, view)
            colours = {"scalars": "shown", "cmap": look.colours, "clim": (look.low, look.high), "show_scalar_bar": False}
            hidden = closed(body) if look.loose else 0
            if hidden:
                inner, outer = ("front", "back") if hidden > 0 else ("back", "front")
                plotter.add_mesh(surface, **colours, **INSIDE, culling=inner, render=False)
                colours["culling"] = outer
            light = {} if view.turn is None else LIT if look.loose else {"ambient": 0.5, "diffuse": 0.6}
            plotter.add_mesh(surface, **colours, **light, lighting=view.turn is not None, render=False)
            if outlined(body) and view.turn is not None:
                lines = surface.extract_all_edges()
                plotter.add_mesh(lines, color=ELEMENT, line_width=0.6 * SHARPER, lighting=False, show_scalar_bar=False, render=False)
        if look.loose and body.form == "surface" and (loose := scattered(body)).any():
            _balls(plotter, points[loose], 0.6 * node_spacing(body.reference, body.cells) * scale, color=LOOSE)
    x, y = (view.x0 + view.x1) / 2, (view.y0 + view.y1) / 2
    deep = max(high - low, view.x1 - view.x0) if high > low else 1.0
    plotter.camera.position, plotter.camera.focal_point, plotter.camera.up = (x, y, high + deep), (x, y, low), (0.0, 1.0, 0.0)
    plotter.camera.parallel_scale = (view.y1 - view.y0) / 2
    plotter.camera.clipping_range = (0.5 * deep, 3 * deep)
    plotter.render()  # a screenshot alone would show what was drawn before
    pixels = np.asarray(plotter.screenshot(None, transparent_background=True, return_img=True))
    # average the extra pixels with their weight, so that edges do not darken
    tall, wide = (n // SHARPER * SHARPER for n in pixels.shape[:2])
    fine = pixels[:tall, :wide].astype(np.float32).reshape(tall // SHARPER, SHARPER, wide // SHARPER, SHARPER, 4)
    weight = fine[..., 3:].sum(axis=(1, 3))
    colour = (fine[..., :3] * fine[..., 3:]).sum(axis=(1, 3)) / np.maximum(weight, 1)
    return np.concatenate([colour, weight / SHARPER**2], axis=-1).round().astype(np.uint8)
