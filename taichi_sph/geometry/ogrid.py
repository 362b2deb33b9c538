"""A round patch of quadrangles without slivers: a rounded square in the middle, rings around it. NumPy only.

The rim has any multiple of four nodes, evenly spaced, so the patch closes a cylinder of as many columns. The net is laid out in arc length
from the pole and then bent, so it serves a flat disc and a spherical cap.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

BULGE = 0.88  # middle of a side of the core over its corner, from the pole; 0.71 a square, 1 a circle


def ogrid(
    rim: int, half_angle: float = 0.0, bent: tuple[float, Callable[[np.ndarray], np.ndarray]] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """xy (N, 2) in arc length from the pole, 1 at the rim, and quadrangles (M, 4), counter-clockwise. The last `rim`
    nodes are the rim, node k of them at the angle 2 pi (k - rim // 8) / rim.

    half_angle [rad]: of the spherical cap that it is for, 0 for a disc; bent: of any other surface of revolution, its arc length
    from pole to rim over the rim's radius, and the distance from the axis (rim 1) by the part of that length.
    """
    n = rim // 4
    rings, corner = proportions(rim, *(bent or of_sphere(half_angle)))
    core = _core(n, corner)
    number = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)  # [along x, along y]
    border = np.concatenate([number[n, :n], number[n:0:-1, n], number[0, n:0:-1], number[:n, 0]])
    angle = 2 * np.pi * (np.arange(rim) - n / 2) / rim
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    points, loops = [core], [border]
    for k in range(1, rings + 1):
        points.append(core[border] + (circle - core[border]) * (k / rings))
        loops.append((n + 1) ** 2 + (k - 1) * rim + np.arange(rim))
    cells = [np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)]
    for inner, outer in zip(loops, loops[1:]):
        cells.append(np.stack([inner, outer, np.roll(outer, -1), np.roll(inner, -1)], axis=1))
    turn = np.pi * (n % 2) / rim  # n odd: the corner of the core stands half a column beside a rim node's angle
    c, s = np.cos(turn), np.sin(turn)
    return np.concatenate(points) @ np.array([[c, s], [-s, c]]), np.concatenate(cells)


def of_sphere(half_angle: float) -> tuple[float, Callable[[np.ndarray], np.ndarray]]:
    """`bent` of a spherical cap, flat for 0."""
    if half_angle > 0:
        return half_angle / np.sin(half_angle), lambda s: np.sin(s * half_angle) / np.sin(half_angle)
    return 1.0, lambda s: s


def proportions(rim: int, arc: float, at: Callable[[np.ndarray], np.ndarray]) -> tuple[int, float]:
    """How many rings, and where the corners of the core stand (pole 0, rim 1), so that spacings differ least.

    The lengths looked at, over the rim's spacing: rings at the corners and at the middles of the core's sides, cells
    across the core, cells on its border (bent, a circle at s has the radius `at(s)`).
    """
    rings = np.arange(1, rim // 4 + 2)[:, None]
    corner = np.linspace(0.5, 0.94, 45)[None, :]
    ring = arc * rim / (2 * np.pi * rings)
    across = np.broadcast_to(4 / np.pi * BULGE * arc * corner, np.broadcast_shapes(rings.shape, corner.shape))
    border = np.broadcast_to(at(BULGE * corner), across.shape)
    ratio = np.stack([ring * (1 - corner), ring * (1 - BULGE * corner), across, border])
    worst = np.abs(np.log(ratio)).max(axis=0)
    best = np.unravel_index(np.argmin(worst), worst.shape)
    return int(rings[best[0], 0]), float(corner[0, best[1]])


def _core(n: int, corner: float) -> np.ndarray:
    """((n + 1)^2, 2): square of n x n cells with sides bent to circular arcs (Coons patch)."""
    half = corner / np.sqrt(2)
    middle = BULGE * corner
    centre = (middle**2 - corner**2) / (2 * (middle - half))  # of the arc of the right side, on the x axis
    t = np.linspace(-1, 1, n + 1) * np.pi / 4
    radius = centre * np.cos(t) + np.sqrt((middle - centre) ** 2 - (centre * np.sin(t)) ** 2)
    x, y = radius * np.cos(t), radius * np.sin(t)
    right, top = np.column_stack([x, y]), np.column_stack([y, x])
    left, bottom = right * [-1, 1], top * [1, -1]
    return coons(bottom, top, left, right).reshape(-1, 2)


def coons(bottom: np.ndarray, top: np.ndarray, left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """(n + 1, m + 1, 2): net between four sides, bottom and top (n + 1, 2) in u, left and right (m + 1, 2) in v."""
    u, v = np.meshgrid(np.linspace(0, 1, len(bottom)), np.linspace(0, 1, len(left)), indexing="ij")
    u, v = u[..., None], v[..., None]
    ruled = (1 - v) * bottom[:, None] + v * top[:, None] + (1 - u) * left[None] + u * right[None]
    corners = (1 - u) * ((1 - v) * bottom[0] + v * top[0]) + u * ((1 - v) * bottom[-1] + v * top[-1])
    return ruled - corners
