"""The mid-surfaces that can be asked for by their dimensions, and meshes from files and arrays.

`area` [m2] is the true one, `volume` [m3] of what a closed one encloses, `smallest` [m] the largest node spacing that still draws the
shape. Normals point out of the closed side: away from the axis, the centre, or up (+z, or `normal`) from what is flat.
"""

from __future__ import annotations

from typing import Annotated

from ..base import Choice
from .base import HoleIn, Shaped
from .box import BoxTank
from .flat import Disc, Plate, frame_of
from .given import MeshFile, Net
from .round import Bullet, Cylinder, Frustum, Roof
from .sphere import Sphere, SpherePatch
from .tank import CappedTank

__all__ = [
    "BoxTank", "Bullet", "CappedTank", "Cylinder", "Disc", "Frustum", "Generated", "Given", "HoleIn", "MeshFile", "Net", "Plate", "Roof",
    "Shaped", "Sphere", "SpherePatch", "Surface", "frame_of",
]  # fmt: skip

Generated = Plate | Disc | Cylinder | CappedTank | Frustum | Bullet | BoxTank | SpherePatch | Sphere | Roof
Given = MeshFile | Net  # their cells are what they are: spacing, cells and irregularity of the numerics do not count
Surface = Annotated[Generated | Given, *Choice]
