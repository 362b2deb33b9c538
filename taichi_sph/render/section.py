"""Bodies cut open by a plane: surfaces end there, and a fluid shows its field on the plane."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..frame import BodyFrame
from ..output.measures.pattern import cell_centres
from .panel import UPRIGHT

REACH = 2.0  # diameters: how far a particle is felt on the plane
FINE = 0.34  # of a diameter: side of the cells of the field
MOST = 400  # cells along a side
COVERED = 0.5  # share of a full neighbourhood from which on a cell holds fluid: half a diameter beyond the outermost particles


def chosen(body: BodyFrame, keep: np.ndarray) -> BodyFrame:
    """A body of points with some of them."""
    return replace(body, points=body.points[keep], point_data={k: v[keep] for k, v in body.point_data.items()})


def cut_open(bodies: Sequence[BodyFrame], places: Mapping[str, np.ndarray], removed: np.ndarray) -> list[BodyFrame]:
    """Surfaces without what lies beyond the plane through their place (by name), `removed` (3,) being its normal. Of a fluid the field
    on the plane, and the particles that are outside, whole. Balls are cut as they are drawn."""
    found = []
    for body in bodies:
        place = places[body.name]
        if body.form == "surface":
            keep = (cell_centres(body.reference, body.cells) - place) @ removed <= 1e-9
            found.append(replace(body, cells=body.cells[keep], cell_data={k: v[keep] for k, v in body.cell_data.items()}))
        elif body.form == "particles":
            found += [field_on(chosen(body, ~body.outside), place, removed), chosen(body, body.outside)]
        else:
            found.append(body)
    return found


def field_on(body: BodyFrame, place: np.ndarray, normal: np.ndarray) -> BodyFrame:
    """The pressure [Pa], density [kg/m3] and speed [m/s] of a fluid on the plane through `place` (3,) with the unit `normal` (3,): a frame
    of square cells, at whose centres the particles around are weighed by (1 - q)^4 (1 + 4 q), q = distance / (REACH diameters)."""
    away = (body.points - place) @ normal
    near = chosen(body, np.abs(away) < REACH * body.point_data["diameter"])
    up = UPRIGHT if abs(normal @ UPRIGHT) < 0.9 else np.array([0.0, 1.0, 0.0])
    up = up - (up @ normal) * normal
    up /= np.linalg.norm(up)
    axes = np.array([np.cross(up, normal), up])
    flat = (near.points - place) @ axes.T
    if not len(flat):
        return _of_cells(body, np.zeros((0, 3)), np.zeros((0, 4), np.int32), {})
    across = near.point_data["diameter"].astype(float)
    d, widest = float(across.min()), float(across.max())
    low, high = flat.min(axis=0) - widest, flat.max(axis=0) + widest
    side = max(FINE * d, float((high - low).max()) / MOST)
    n = np.ceil((high - low) / side).astype(int)
    x, y = np.meshgrid(*(low[k] + side * (np.arange(n[k]) + 0.5) for k in range(2)), indexing="ij")
    centres = np.column_stack([x.ravel(), y.ravel()])
    pairs = cKDTree(place + centres @ axes).sparse_distance_matrix(cKDTree(near.points), REACH * widest, output_type="ndarray")
    q = np.minimum(pairs["v"] / (REACH * across[pairs["j"]]), 1.0)
    weight = (1.0 - q) ** 4 * (1.0 + 4.0 * q)
    total = np.bincount(pairs["i"], weight, minlength=len(centres))
    full = np.percentile(total[total > 0], 75)  # in the middle of the fluid
    keep = np.flatnonzero(total > COVERED * full)
    values: dict[str, np.ndarray] = {name: near.point_data[name] for name in ("pressure", "density") if name in near.point_data}
    values["speed"] = np.linalg.norm(near.point_data["velocity"], axis=1)
    fields = {
        k: (np.bincount(pairs["i"], weight * v[pairs["j"]], minlength=len(centres)) / np.maximum(total, 1e-300)) for k, v in values.items()
    }
    corner = np.arange((n[0] + 1) * (n[1] + 1), dtype=np.int32).reshape(n[0] + 1, n[1] + 1)
    cells = np.stack([corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]], axis=-1).reshape(-1, 4)
    x, y = np.meshgrid(*(low[k] + side * np.arange(n[k] + 1) for k in range(2)), indexing="ij")
    points = place + np.column_stack([x.ravel(), y.ravel()]) @ axes
    return _of_cells(body, points, cells[keep], {k: v[keep] for k, v in fields.items()})


def _of_cells(body: BodyFrame, points: np.ndarray, cells: np.ndarray, data: dict[str, np.ndarray]) -> BodyFrame:
    diameter = np.full(len(points), np.median(body.point_data["diameter"]) if len(body.points) else 0.0)
    return BodyFrame(body.name, points, cells, {"reference": points, "diameter": diameter}, data, kind=body.kind)
