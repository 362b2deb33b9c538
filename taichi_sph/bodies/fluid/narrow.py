"""Openings too narrow for the particles of a fluid.

The rim of a shell meets a particle at D/4, and a layer of one or two particles between two walls hardly moves. So a narrow slot passes too
little. Beside what leaves at a sharp edge, a slot of 1 D passes nothing, one of 1.6 D 0.36, one of 2 D 0.43, one of 3 D 0.52
(docs/method.md).
"""

from __future__ import annotations

from collections.abc import Callable

FLOWS = 2.0  # spacings of the fluid: water passes a narrower opening haltingly or not at all
SHUT = 0.25  # spacings: a gap that is no opening
FREELY = 4.0  # spacings across an opening, of a resolution that lets it flow


def narrow(what: str, width: float, fluid: str, spacing: float, show: Callable[[float, str], str]) -> str:
    """The sentence: which opening, how wide, and what would let water flow."""
    return (
        f"{what} is {show(width, 'm')} wide, {width / spacing:.2g} D of '{fluid}': below {FLOWS:g} D water passes haltingly or not at all;"
        f" a spacing of {show(width / FREELY, 'm')} lets it flow"
    )
