"""Meshes of the surfaces that a scene names by their dimensions, with exact normals. NumPy only.

A surface is one patch or several (wall and two ends, six walls of a box). A patch is a net of quadrangles in a plane chart, and the map
that bends the chart into space. Nodes are moved at random, and triangulated anew, in the chart, so they stay in the surface. Charts
keep angles (unrolled wall, stereographic cap), so Delaunay's triangles in a chart are those of the surface. Holes are cut into the
finished patch (geometry/holes.py).
"""

from __future__ import annotations

from .counts import count
from .finish import SHARPEST
from .generated import generate
from .made import mesh_key, mesh_of

__all__ = ["SHARPEST", "count", "generate", "mesh_key", "mesh_of"]
