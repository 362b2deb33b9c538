"""Shells of particles: what the user says of any shell, in one of the forms of bodies/shell/said.py whose `body` is this folder."""

from __future__ import annotations

from ...scene.kinds import Kind
from ..shell.said import Shell

KIND = Kind("shell_sph", "shells", Shell, "taichi_sph.bodies.shell_sph.group:groups", rank=0)
