"""A picture of the run at one instant, as plain NumPy arrays: what the solver hands to the output.

Nothing here knows Taichi, VTK or files.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class BodyFrame:
    """One body at one instant.

    points: (N, 3) current positions [m].
    cells: (M, 4) int32 node numbers, -1 in the last column of a triangle; the same at every instant.
    point_data: name -> (N,) or (N, k); holds "reference" (N, 3) [m] and "velocity" (N, 3) [m/s].
    cell_data: name -> (M,) or (M, k); holds "damage" [-], "broken" (uint8) and "rupture_time"
    [s, nan while sound].
    """

    name: str
    points: np.ndarray
    cells: np.ndarray
    point_data: dict[str, np.ndarray] = field(default_factory=dict)
    cell_data: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def reference(self) -> np.ndarray:
        """(N, 3) reference positions [m]; the current ones where none were given."""
        return self.point_data.get("reference", self.points)


@dataclass(frozen=True)
class Frame:
    """All bodies at `time` [s], after `step` steps."""

    time: float
    step: int
    bodies: tuple[BodyFrame, ...]

    def body(self, name: str) -> BodyFrame:
        for body in self.bodies:
            if body.name == name:
                return body
        raise KeyError(name)
