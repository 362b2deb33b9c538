"""Kinds of bodies, a folder each. No kind is known by name here: a folder is one by the `KIND` in its said.py."""

from ..scene.kinds import Kind, Kinds

kinds = Kinds(__name__)
register = kinds.register
__all__ = ["Kind", "kinds", "register"]
