"""Meshes of solids: hexahedra and tetrahedra. NumPy only."""

from __future__ import annotations

from .made import count, mesh_key, mesh_of
from .mesh import SolidMesh, joined
from .split import Split
from .subdivide import subdivided

__all__ = ["SolidMesh", "Split", "count", "joined", "mesh_key", "mesh_of", "subdivided"]
