"""Measures of a striker that goes into a solid and stays there: how deep, and how wide a crater it leaves."""

from __future__ import annotations

import numpy as np

from ...frame import BodyFrame
from ...scene import Scene
from ..folder import RunFolder
from .entry import way
from .fragments import flight
from .perforation import of

SECTORS = 24  # directions over which the radius of a crater is a mean


def penetration_depth(run: RunFolder, scene: Scene, *, striker: str | None = None, start: float = 0.0) -> float | None:
    """How far [m] a rigid body has gone along its first direction at most. `start` [m]: the gap before it at t = 0, which is taken off.
    None of one that rests at first."""
    gone = way(of(run, striker))
    return None if gone is None else float(gone.max()) - start


def struck_faces(body: BodyFrame, direction: np.ndarray) -> np.ndarray:
    """(F,) numbers of the faces of a solid on its struck side: those of the reference that lie farthest against the flight (3,)."""
    up = body.reference @ -direction
    top = up.max()
    corner = np.where(body.cells < 0, body.cells[:, :1], body.cells)
    return np.flatnonzero((up[corner] > top - 1e-6 * np.ptp(up)).all(axis=1))


def crater(body: BodyFrame, at: np.ndarray, direction: np.ndarray, damage: float, speed: float) -> tuple[np.ndarray, np.ndarray]:
    """(F,) numbers of the faces of the struck side, and (F,) whether each is in the crater about the point `at` (3,): ruptured or damaged
    by `damage` at least, reached from the point of impact over such faces, and on its way out at more than `speed` [m/s]."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    own = struck_faces(body, direction)
    cells = np.where(body.cells[own] < 0, body.cells[own, :1], body.cells[own])
    spoilt = (body.cell_data["damage"][own] >= damage) | np.isfinite(body.cell_data["rupture_time"][own])
    n = len(body.points)
    node = cells[spoilt].ravel()
    graph = coo_array((np.ones(len(node)), (np.repeat(np.flatnonzero(spoilt), 4), node)), shape=(len(own), n))
    together = connected_components(coo_array(graph @ graph.T), directed=False)[1]
    first = int(np.argmin(np.linalg.norm(np.cross(body.reference[cells].mean(axis=1) - at, direction), axis=1)))
    reached = spoilt & (together == together[first])
    leaves = body.point_data["velocity"][cells].mean(axis=1) @ -direction > speed
    return own, reached & leaves


def crater_diameter(
    run: RunFolder, scene: Scene, *, body: str | None = None, damage: float = 0.95, speed: float = 1.0, sectors: float = SECTORS
) -> float | None:
    """Diameter [m] of the crater on the struck side at the end: twice the mean over directions of how far the farthest face lies, in the
    reference, that is in it (`crater`); a direction in which none is counts as 0, one in which the body has no face does not. None
    without a crater."""
    path = flight(run)
    if path is None:
        return None
    return crater_width(run.the("solid", body).body(-1), path[0], path[1], damage, speed, int(sectors))


def crater_width(
    frame: BodyFrame, at: np.ndarray, direction: np.ndarray, damage: float, speed: float, sectors: int = SECTORS
) -> float | None:
    """`crater_diameter` of a frame of a solid, about the line of flight through `at` (3,) along `direction` (3,)."""
    own, inside = crater(frame, at, direction, damage, speed)
    if not inside.any():
        return None
    cells = np.where(frame.cells[own] < 0, frame.cells[own, :1], frame.cells[own])
    corners = frame.reference[cells] - at
    corners = corners - (corners @ direction)[:, :, None] * direction
    middle = corners.mean(axis=1)
    one = np.eye(3)[int(np.argmin(np.abs(direction)))]
    one = one - one @ direction * direction
    one /= np.linalg.norm(one)
    angle = np.arctan2(middle @ np.cross(direction, one), middle @ one)
    sector = np.floor((angle / (2 * np.pi) + 0.5) * sectors).astype(int) % sectors
    far = 0.5 * (np.linalg.norm(middle, axis=1) + np.linalg.norm(corners, axis=2).max(axis=1))  # half way between middle and rim
    radius = np.zeros(sectors)
    np.maximum.at(radius, sector[inside], far[inside])
    return 2.0 * float(radius[np.unique(sector)].mean())
