"""A disc cut along straight lines, its lips two rows of nodes in one place, as arrays for a Net (no scene itself)."""

from collections.abc import Sequence

import numpy as np

Line = tuple[tuple[float, float], tuple[float, float]]  # start and end of a cut [m]
BULGE = 0.88  # middle of a side of the core over its corner, from the axis; 0.71 a square, 1 a circle
CORNER = 0.75  # of the radius: where the corners of the core stand
ROOM = 1.25  # the cells of the core are squares to so many times the reach of the cuts
OFF = 1e-9  # m: nearer than this is on a line


def square(reach: float, d: float) -> float:
    """Side [m] of the squares about the origin for cells of about d [m]: two of them at least reach as far as the slits."""
    return reach / max(2, round(reach / d))


def disc(radius: float, reach: float, d: float, diagonals: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (N, 2) and cells (M, 4) of a disc about the origin with cells of about d [m]: a rounded core, and rings to the rim.

    About the origin the core has squares, so many that a line of nodes is `reach` [m] from each axis. `diagonals`: squares on them, within
    reach, are two triangles (-1 in the last column).
    """
    side, corner = square(reach, d), CORNER * radius
    cells = round(reach / side)
    n = max(2 * cells, round(0.5 * corner * (BULGE + np.sqrt(0.5)) / side))  # cells from the axis to the border of the core
    i, j = np.meshgrid(np.arange(-n, n + 1), np.arange(-n, n + 1), indexing="ij")
    far = np.maximum(np.abs(i), np.abs(j))  # number of the square loop that a node is on
    wide = np.abs(i) >= np.abs(j)
    turn = np.where(wide, j, i) / np.maximum(far, 1)  # -1 to 1 along a side of the loop
    size = corner * (BULGE + (1 - BULGE) * turn**2)
    along, across = size * np.cos(turn * np.pi / 4), size * np.sin(turn * np.pi / 4)
    border = np.stack([np.where(wide, np.sign(i) * along, across), np.where(wide, across, np.sign(j) * along)], axis=-1)
    own, straight = side * np.stack([i, j], axis=-1), ROOM * cells
    last = own * (straight / np.maximum(far, 1))[..., None]  # where the squares end, on the way out
    share = ((far - straight) / (n - straight))[..., None]
    core = np.where(share > 0, last + (border - last) * share, own).reshape(-1, 2)
    number = np.arange((2 * n + 1) ** 2).reshape(2 * n + 1, 2 * n + 1)
    squares = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    loop = np.concatenate([number[-1, :-1], number[:0:-1, -1], number[0, :0:-1], number[:-1, 0]])
    angle = 2 * np.pi * (np.arange(8 * n) - n) / (8 * n)
    first, circle = core[loop], radius * np.column_stack([np.cos(angle), np.sin(angle)])
    rings = max(1, round((radius - 0.5 * (1 + BULGE) * corner) / d))
    points, found = [core], [_halved(core, squares, reach) if diagonals else squares]
    for k in range(1, rings + 1):
        outer = len(core) + (k - 1) * 8 * n + np.arange(8 * n)
        points.append(first + (circle - first) * (k / rings))
        found.append(np.stack([loop, outer, np.roll(outer, -1), np.roll(loop, -1)], axis=1))
        loop = outer
    return np.concatenate(points), np.concatenate(found)


def _halved(points: np.ndarray, cells: np.ndarray, reach: float) -> np.ndarray:
    """Squares with two corners on a diagonal, both within `reach` [m] along x, as two triangles that meet there."""
    x, y = np.abs(points).T
    on = ((np.abs(x - y) < OFF) & (x < reach + OFF))[cells]
    even, odd = on[:, 0] & on[:, 2], on[:, 1] & on[:, 3]
    parts = [cells[~(even | odd)]]
    for chosen, (a, b, c, e) in ((even, (0, 1, 2, 3)), (odd, (1, 2, 3, 0))):
        some = cells[chosen]
        none = np.full(len(some), -1)
        parts += [np.stack([some[:, k] for k in three] + [none], axis=1) for three in ((a, b, c), (a, c, e))]
    return np.concatenate(parts)


def above(points: np.ndarray, cells: np.ndarray, low: tuple[float | None, float | None]) -> tuple[np.ndarray, np.ndarray]:
    """What of a mesh lies above `low` (x, y) [m]; None: all of it does."""
    inside = np.ones(len(points), bool)
    for axis, least in enumerate(low):
        inside &= least is None or points[:, axis] > least - OFF
    cells = cells[(inside[cells] | (cells < 0)).all(axis=1)]
    own = np.unique(cells[cells >= 0])
    number = np.full(len(points) + 1, -1)
    number[own] = np.arange(len(own))
    return points[own], number[cells]


def parted(points: np.ndarray, cells: np.ndarray, lines: Sequence[Line]) -> tuple[np.ndarray, np.ndarray]:
    """The mesh with the nodes on the lines doubled: each becomes as many as it has fans of cells that hang together by sides off the lines.
    Sides of cells lie on the lines. So an end inside the mesh stays one node, the tip."""
    on = [_on(points, line) for line in lines]
    found, more = cells.copy(), [points]
    count = len(points)
    for node in np.flatnonzero(np.any(on, axis=0)):
        around = np.flatnonzero((cells == node).any(axis=1))
        spokes = [_spokes(cells[cell], node) for cell in around]
        fan = list(range(len(around)))
        for a in range(len(around)):
            for b in range(a):
                if any(not any(line[node] and line[end] for line in on) for end in spokes[a] & spokes[b]):
                    fan = [fan[b] if f == fan[a] else f for f in fan]
        for twin in sorted(set(fan))[1:]:
            mine = around[np.array(fan) == twin]
            found[mine] = np.where(cells[mine] == node, count, found[mine])
            more.append(points[node : node + 1])
            count += 1
    return np.concatenate(more), found


def _spokes(cell: np.ndarray, node: int) -> set[int]:
    """The nodes at the other ends of the two sides of a cell that meet in a node."""
    ring = [int(k) for k in cell if k >= 0]
    at = ring.index(node)
    return {ring[at - 1], ring[(at + 1) % len(ring)]}


def _on(points: np.ndarray, line: Line) -> np.ndarray:
    """(N,) bool: nodes on a line, its ends among them."""
    start, end = np.array(line[0]), np.array(line[1])
    way = end - start
    share = np.clip((points - start) @ way / (way @ way), 0, 1)
    return np.linalg.norm(points - start - share[:, None] * way, axis=1) < OFF
