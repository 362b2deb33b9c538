"""The books of a term that takes energy from the motion of nodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...numerics.reduce import Reducer
from ...pool import Pool
from ..nodal.nodes import Nodes


class Damper(Pool):
    """A term adds its forces in `add` and books in `work` what they take; `entry` is its line in the ledger."""

    entry = ""

    def __init__(self, name: str, nodes: Nodes):
        super().__init__(name)
        self.nodes = nodes
        self.work = self.field("work", nodes.n, unit="J", doc="taken so far", keeps=True)

    def number(self, name: str, values: Sequence[float], unit: str, doc: str) -> Any:
        """A field of one number a body."""
        field = self.field(name, len(values), unit=unit, doc=doc)
        for b, value in enumerate(values):
            field[b] = value
        return field

    def add(self, dt: float) -> None:
        """Add the forces; book what they take over dt."""
        raise NotImplementedError

    def taken(self, reducer: Reducer) -> float:
        """Energy taken so far [J]."""
        return reducer.total(self.work, self.nodes.n)
