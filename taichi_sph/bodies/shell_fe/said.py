"""Shells of finite elements: what the user says of any shell, in the form of bodies/shell/said.py whose `body` is this folder."""

from __future__ import annotations

from ...scene.kinds import Kind
from ..shell.said import Shell

KIND = Kind("shell_fe", "shells", Shell, "taichi_sph.bodies.shell_fe.group:groups", rank=1)
