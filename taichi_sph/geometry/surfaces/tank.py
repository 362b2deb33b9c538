"""Walls with an end on each rim: cans and tanks. NumPy only."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...scene.surfaces import Bullet, CappedTank
from ..heads import Meridian, meridian, ogive
from ..mesh import SurfaceMesh
from ..ogrid import ogrid
from .patch import Finish, Patch, Place, mesh_from, mirrored, then
from .round import cap


def head(tank: CappedTank, rim: int) -> Patch:
    """A head of a tank over its rim in z = 0."""
    if tank.cap in ("flat", "dome"):
        return cap(rim, tank.radius, tank.half_angle)
    return _turned(meridian(tank), tank.radius, rim, tank.cap == "conical")


def nose(bullet: Bullet, rim: int) -> Patch:
    """The nose of a bullet over its rim in z = 0."""
    return _turned(ogive(bullet), bullet.radius, rim, True)


def _turned(line: Meridian, radius: float, rim: int, sharp: bool) -> Patch:
    """What a meridian draws over its rim; sharp: it ends in a point."""
    xy, quads = ogrid(rim, bent=(line.arc[-1] / radius, line.width))
    inner = np.arange(len(xy)) < len(xy) - rim
    if sharp:
        inner[np.argmin(np.linalg.norm(xy, axis=1))] = False  # the tip stays where it is
    return Patch(line.laid_out(xy), quads, inner, line.bend)


def closed(side: Patch, length: float, start: float, caps: Sequence[Patch], finish: Finish, there: Place) -> SurfaceMesh:
    """A wall with a cap on each rim, whose nodes they share. There the normal is the mean of the two sides'."""
    wall = finish(side, there)
    rim = _columns(side)
    n_wall = len(wall.points)
    first = (np.arange(rim) - rim // 8) % rim  # of the rim's nodes of a cap, in the wall's lowest row
    turn = np.array([[np.cos(start), np.sin(start), 0], [-np.sin(start), np.cos(start), 0], [0, 0, 1]])
    points, normals, cells = [wall.points], [wall.node_normals.copy()], [wall.cells]
    for top in (False, True):
        seat = seated(turn, top, length)
        lid = finish(caps[top], then(seat, there))
        own = len(lid.points) - rim
        at, normal = seat(lid.points, lid.node_normals)
        cell = lid.cells
        if not top:  # a mirror image, its cells turned round
            cell = mirrored(cell)
        place = sum(len(p) for p in points)
        number = np.concatenate([place + np.arange(own), first + (n_wall - rim if top else 0), [-1]])
        cells.append(number[cell])
        points.append(at[:own])
        normals.append(normal[:own])
        normals[0][number[own:-1]] += normal[own:]
    normal = np.concatenate(normals)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return mesh_from(np.concatenate(points), np.concatenate(cells), normal)


def _columns(wall: Patch) -> int:
    """Nodes in a row of a wall that closes on itself."""
    return int(np.count_nonzero(wall.chart[:, 1] == wall.chart[0, 1]))


def seated(turn: np.ndarray, top: bool, length: float) -> Place:
    """From a cap on z = 0 to its place on a wall: turned, the lower one mirrored, the upper one lifted."""

    def seat(points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        points, normals = points @ turn, normals @ turn
        if not top:
            points, normals = points * [1, 1, -1], normals * [1, 1, -1]
        return points + [0, 0, length if top else 0], normals

    return seat
