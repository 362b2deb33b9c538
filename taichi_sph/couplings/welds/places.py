"""Which nodes are welded. NumPy only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...errors import SceneError
from .said import Weld

NEAR = 0.1  # of the finer spacing


def welded(welds: Sequence[Weld], points: Mapping[str, np.ndarray], spacing: Mapping[str, float]) -> list[list[tuple[str, int]]]:
    """Seams: the nodes (body, number) that move as one; points (N, 3) [m] at t = 0 and spacing [m] of the bodies. SceneError for a weld
    without a node."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    names = list(dict.fromkeys(name for weld in welds for name in weld.between))
    first = dict(zip(names, np.cumsum([0, *(len(points[name]) for name in names)]).tolist()))
    total = sum(len(points[name]) for name in names)
    one, two = [np.zeros(0, int)], [np.zeros(0, int)]
    for number, weld in enumerate(welds):
        a, b = weld.between
        radius = weld.radius or NEAR * min(spacing[a], spacing[b])
        away, other = cKDTree(points[b]).query(points[a], distance_upper_bound=radius)
        near = np.flatnonzero(np.isfinite(away))
        if not len(near):
            least = float(cKDTree(points[b]).query(points[a])[0].min())
            raise SceneError(
                f"welds[{number}] catches no nodes: '{a}' and '{b}' have none within {1e3 * radius:.4g} mm of each other (the nearest are "
                f"{1e3 * least:.4g} mm apart); let their nodes meet, or give a radius"
            )
        one.append(first[a] + near)
        two.append(first[b] + other[near])
    i, j = np.concatenate(one), np.concatenate(two)
    label = connected_components(coo_array((np.ones(len(i)), (i, j)), shape=(total, total)), directed=False)[1]
    held = np.unique(np.concatenate([i, j]))
    whose = np.searchsorted(np.array([first[name] for name in names]), held, side="right") - 1
    seams: dict[int, list[tuple[str, int]]] = {}
    for node, body in zip(held.tolist(), whose.tolist()):
        seams.setdefault(int(label[node]), []).append((names[body], node - first[names[body]]))
    return list(seams.values())
