"""The books of a term that takes energy from the motion of nodes."""

from __future__ import annotations

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

    def add(self, dt: float) -> None:
        """Add the forces; book what they take over dt."""
        raise NotImplementedError

    def taken(self, reducer: Reducer) -> float:
        """Energy taken so far [J]."""
        return reducer.total(self.work, self.nodes.n)
