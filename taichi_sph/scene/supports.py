"""Edges of a body that are held along planes, as motions that do not overlap where two edges meet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from .loads import PrescribedVelocity
from .regions import Box

Hold = tuple[Literal[0] | None, Literal[0] | None, Literal[0] | None]
FREE: Hold = (None, None, None)
FIXED: Hold = (0, 0, 0)
AXES = "xyz"


@dataclass(frozen=True)
class Edge:
    """What is held (0) on the plane `axis` = `at` [m]; the body lies "above" or "below" it along the axis."""

    axis: Literal["x", "y", "z"]
    at: float
    body: Literal["above", "below"]
    velocity: Hold = FREE
    spin: Hold = FREE


def clamped(axis: Literal["x", "y", "z"], at: float, body: Literal["above", "below"]) -> Edge:
    """Nothing moves or turns."""
    return Edge(axis, at, body, FIXED, FIXED)


def symmetry(axis: Literal["x", "y", "z"], at: float, body: Literal["above", "below"]) -> Edge:
    """The plane is one of symmetry: nothing crosses it, directors stay in it."""
    across: Hold = tuple(0 if a == axis else None for a in AXES)  # type: ignore[assignment]
    within: Hold = tuple(None if a == axis else 0 for a in AXES)  # type: ignore[assignment]
    return Edge(axis, at, body, across, within)


def held(shell: str, spacing: float, first: Sequence[Edge], second: Sequence[Edge] = ()) -> list[PrescribedVelocity]:
    """Motions that hold the nodes on the edges. Those of one group do not meet; where an edge of the first meets
    one of the second, the corner is held by both. Nodes within a quarter of `spacing` [m] are on the plane."""
    near = 0.25 * spacing
    alone = [(on, off) for group, others in ((first, second), (second, first)) for on in group for off in [others]]
    motions = [_motion(shell, [edge], others, near) for edge, others in alone]
    return motions + [_motion(shell, [a, b], (), near) for a in first for b in second]


def _motion(shell: str, on: Sequence[Edge], off: Sequence[Edge], near: float) -> PrescribedVelocity:
    lo: list[float | None] = [None] * 3
    hi: list[float | None] = [None] * 3
    for edge in on:
        lo[AXES.index(edge.axis)], hi[AXES.index(edge.axis)] = edge.at - near, edge.at + near
    for edge in off:
        (lo if edge.body == "above" else hi)[AXES.index(edge.axis)] = edge.at + (near if edge.body == "above" else -near)

    def all_of(name: str) -> Hold:
        return tuple(0 if any(getattr(e, name)[c] == 0 for e in on) else None for c in range(3))  # type: ignore[return-value]

    where = Box(lo=(lo[0], lo[1], lo[2]), hi=(hi[0], hi[1], hi[2]))
    return PrescribedVelocity(body=shell, where=where, velocity=all_of("velocity"), spin=all_of("spin"))
