"""The user says nothing here: what ties elements and particles of a body belongs to the body (`patch` in bodies/shell/said.py and
bodies/solid/said.py)."""

from __future__ import annotations

from ...scene.kinds import Kind

KIND = Kind("arlequin", "", None, "taichi_sph.couplings.arlequin.coupling:couplings", rank=9)  # after contact: sees all other impulses
