"""Meshes of solids: hexahedra and tetrahedra. NumPy only."""

from __future__ import annotations

from .made import count, mesh_key, mesh_of
from .mesh import SolidMesh, joined

__all__ = ["SolidMesh", "count", "joined", "mesh_key", "mesh_of"]
