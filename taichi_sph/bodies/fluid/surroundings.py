"""What the particles of a fluid find beyond it: walls of other bodies, as couplings/wetted writes them."""

from __future__ import annotations

from collections.abc import Callable

from ...pool import Pool


class Surroundings(Pool):
    """`lightest` [kg/m2]: mass per area of the lightest body that the fluid can press on.

    see(renumbered, since): brings all of this up to date after the particles have moved; renumbered: they stand in another order; since
    [s]: surfaces move with their mean velocity over that time, 0: with that of now.
    """

    def __init__(self, name: str, n: int, see: Callable[[bool, float], None], lightest: float, mean: bool = False):
        super().__init__(name)
        self.see = see
        self.lightest = lightest
        self.start = self.field("start", n + 1, dtype="i32", doc="the surface points near particle i are number start[i] on of a list")
        self.met = self.field("met", n, 4, doc="w [1/m], and sum of w_k . (v - v_k) [1/s]")
        doc = "sum of w_k . (v - v_k), w_k the mean of both ends of the step before; where densities follow the mean"
        self.swept = self.field("swept", n if mean else 1, unit="1/s", doc=doc)
        self.side = self.field("side", n, 4, doc="n and 1 / gamma - 1 of particles near a surface; others have a positive D")
        self.cover = self.field("cover", n, doc="c of particles near a surface: how much of an even wall stands there")
        self.amid = self.field("amid", n, dtype="i32", doc="1: the particle or a neighbour of it has surface points within reach")
        self.stress = self.field("stress", n, unit="N m", doc="V (2 p + Pi): what the particle presses with")
