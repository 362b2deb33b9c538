"""Kinds of couplings between bodies, a folder each, found like the kinds of bodies."""

from ..scene.kinds import Kind, Kinds

kinds = Kinds(__name__)
register = kinds.register
__all__ = ["Kind", "kinds", "register"]
