"""What acts between bodies. A coupling sees movers and surfaces of the groups, never a kind of body.

Two sorts: one adds forces at n (`add`), the other corrects the half-step velocities to come (`correct`), once all forces are known.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..bodies.body import Entries, Now

if TYPE_CHECKING:
    from ..pool import Pool


class Coupling:
    """The steps in which a coupling may take part; each does nothing unless it is written."""

    def pools(self) -> Sequence[Pool]:
        """All that has fields or history."""
        return ()

    def meet(self, now: Now) -> None:
        """What each body sees of the other at x_n: lists, weights."""

    def add(self, now: Now) -> None:
        """Forces at n."""

    def correct(self, now: Now) -> None:
        """Impulses on v_n+1/2, as forces; sees what the couplings before it did."""

    def book(self, now: Now) -> None:
        """All impulses on v_n+1/2 are known: energies that depend on those that came after one's own."""

    def start(self) -> None:
        """All bodies stand where they are at t = 0."""

    def foresee(self, now: Now) -> None:
        """The first step is known: what must be otherwise before it (`wanted`)."""

    def longest_step(self) -> dict[str, float]:
        """The longest step of the clock [s] that the coupling bears, by what rules it."""
        return {}

    def entries(self) -> Entries:
        """Energies at the time of the last force evaluation."""
        return Entries()

    def given(self) -> float:
        """Energy to give back at t = 0 [J]: what the first step took before anything was given."""
        return 0.0

    def report(self) -> dict[str, float]:
        """How well a coupling that solves was solved, with the `seconds` of it, for the summary; empty for one that only adds."""
        return {}

    def status(self) -> dict[str, int]:
        """Small numbers for the progress line."""
        return {}
