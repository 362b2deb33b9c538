"""What a run shows at one instant, as plain NumPy arrays: the world hands frames to the output.

Nothing here knows Taichi, VTK or files.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

Kind = str  # of the body: "shell", "rigid", "fluid", or another one
Form = Literal["surface", "field", "solid", "balls", "particles", "points"]


@dataclass(frozen=True)
class BodyFrame:
    """One body at one instant. N and the order of the points are the same at every instant.

    points: (N, 3) current positions [m].
    cells: (M, 4) int32 node numbers, -1 in the last column of a triangle; the same at every instant;
    (0, 4) where the body is made of points only.
    point_data: name -> (N,) or (N, k); holds "reference" (N, 3) [m] and "velocity" (N, 3) [m/s].
    cell_data: name -> (M,) or (M, k).

    kind "shell": cell_data holds "damage" [-], "broken" (uint8) and "rupture_time" [s, nan while sound]; a metal's
    also "plastic", its cumulated plastic strain p [-], and "thickness" [m]. Of a shell in parts, elements and particles,
    "weight" [-] is what a cell counts, and "hidden" (uint8) is 1 for elements in whose place there are particles.
    kind "rigid": the points are the centres of its pinballs; point_data holds "radius" (N,) [m]; of a body with a surface they
    are the nodes of that, without cell_data.
    kind "fluid": point_data holds "pressure" [Pa], "density" [kg/m3], "diameter" (N,) [m] and "outside" (uint8, 1
    once a particle has left its tank).
    """

    name: str
    points: np.ndarray
    cells: np.ndarray
    point_data: dict[str, np.ndarray] = field(default_factory=dict)
    cell_data: dict[str, np.ndarray] = field(default_factory=dict)
    kind: Kind = "shell"

    @property
    def form(self) -> Form:
        """What a body is made of, whatever its kind: cells of a surface; a field, cells of the plane of a section that particles with a
        "diameter" fill; a solid, cells without any data; balls with a "radius"; particles with a "diameter"; points."""
        if len(self.cells) or self.cell_data:  # a section may leave it no cell
            return "field" if "diameter" in self.point_data else "surface" if self.cell_data else "solid"
        return "balls" if "radius" in self.point_data else "particles" if "diameter" in self.point_data else "points"

    @property
    def outside(self) -> np.ndarray:
        """(N,) bool: particles that have left their tank."""
        return np.asarray(self.point_data.get("outside", np.zeros(len(self.points)))) != 0

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


NO_CELLS = np.empty((0, 4), dtype=np.int32)
