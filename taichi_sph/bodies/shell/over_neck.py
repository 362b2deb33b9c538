"""The plastic strain that damages, in the mean over a neck (`over_neck` of a ductile damage; laws/necking.py).

Once a sheet necks, strain gathers in the narrowest row of cells there is. Where cells are narrower than the sheet is thick, that row is
narrower than the neck, and the sheet tears at an elongation that goes to nothing with the cells. So damage follows

    p_mean(s) = sum_k w_k A_k p_k / sum_k w_k A_k,     w_k = 1 - |X_k - X_s| / R,     R = 3 e / pi

over the live points k within R of point s of one body on the reference, e its thickness. A row of cells of width D in which alone the
strain grows then counts by D / e, for any D < e: what tears the row is its elongation over the thickness, as Barba's rule has it. An
even strain is its own mean. Cells wider than R have no neighbour within it, and the mean is the point's own strain: wider ones are the
matter of `necks`.

The mean is that of the plastic strains before the step. Broken points do not count.
"""

import math
from typing import Any

import numpy as np

from ... import runtime
from ...pool import Pool
from ...runtime import ti

REACH = 3.0 / math.pi  # of the thickness


class OverNeck(Pool):
    """Who is near whom on the undeformed shell: rows of point s are start[s] on of `near` and `weight`."""

    def __init__(
        self, points: Any, places: np.ndarray, areas: np.ndarray, thickness: np.ndarray, body: np.ndarray, name: str = "over_neck"
    ):
        """points: the pool of stress points; places (n, 3) [m], areas (n,) [m2], thickness (n,) [m] and body (n,) of them."""
        super().__init__(name)
        self.points, self.n = points, len(places)
        start, near, weight = neighbours(places, areas, REACH * thickness, body)
        self.start = self.field("start", self.n + 1, dtype="i32", doc="where the neighbours of a point begin")
        self.near = self.field("near", len(near), dtype="i32", doc="points within reach, itself first")
        self.weight = self.field("weight", len(near), unit="m2", doc="w A of each")
        runtime.put(self.start, start.astype(np.int32))
        runtime.put(self.near, near.astype(np.int32))
        runtime.put(self.weight, weight)

    def look(self) -> None:
        """The means now, before the points take a step."""
        _mean(self, self.points, self.n)


def neighbours(places: np.ndarray, areas: np.ndarray, reach: np.ndarray, body: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """start (n + 1,), near and weight (m,) of the points within reach (n,) [m] of each, of its own body."""
    from scipy.spatial import cKDTree

    found = cKDTree(places).query_ball_point(places, reach)
    near = [np.array([s, *sorted(k for k in row if k != s and body[k] == body[s])]) for s, row in enumerate(found)]
    start = np.concatenate([[0], np.cumsum([len(row) for row in near])])
    flat, own = np.concatenate(near), np.repeat(np.arange(len(places)), np.diff(start))
    away = np.linalg.norm(places[flat] - places[own], axis=1)
    return start, flat, np.maximum(1.0 - away / reach[own], 0.0) * areas[flat]


@ti.kernel
def _mean(t: ti.template(), points: ti.template(), n: ti.i32):
    for s in range(n):
        if points.broken[s] == 0:
            total, size = points.plastic[s] * 0.0, points.plastic[s] * 0.0
            for m in range(t.start[s], t.start[s + 1]):
                k = t.near[m]
                if points.broken[k] == 0:
                    total += t.weight[m] * points.plastic[k]
                    size += t.weight[m]
            points.mean_before[s] = points.mean[s]
            points.mean[s] = total / size
