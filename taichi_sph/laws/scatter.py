"""Scatter of ductility from cell to cell.

No piece of metal tears everywhere at once: weak places tear first, and unload what is beside them before it tears too (Mott 1947). So a
ring that is stretched evenly falls into pieces of some size, where one without scatter turns to dust.

The strains at which damage begins and is complete are those of the material times a share for each cell, with Weibull's distribution
(1951), mean 1. The share belongs to the place of the cell and the seed, not to its number: it is the same however many bodies there are
and when a patch grows.
"""

from __future__ import annotations

import math

import numpy as np

GRAIN = 1e-9  # m: places nearer to each other have one share


def shares(places: np.ndarray, variation: float, seed: int) -> np.ndarray:
    """(n,) of places (n, 3) [m]; variation: standard deviation."""
    from scipy.optimize import brentq

    def spread(k: float) -> float:
        return math.sqrt(math.gamma(1.0 + 2.0 / k) / math.gamma(1.0 + 1.0 / k) ** 2 - 1.0) - variation

    k = float(brentq(spread, 1.0, 3.0 / variation))
    return (-np.log1p(-_uniform(places, seed))) ** (1.0 / k) / math.gamma(1.0 + 1.0 / k)


def _uniform(places: np.ndarray, seed: int) -> np.ndarray:
    """(n,) numbers in [0, 1) that look random, of the places and the seed alone (Steele, Lea and Flood 2014)."""
    with np.errstate(over="ignore"):
        state = np.full(len(places), seed, np.uint64)
        for column in np.rint(places / GRAIN).astype(np.int64).T:
            state = state + np.uint64(0x9E3779B97F4A7C15) ^ column.view(np.uint64)
            state = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
            state = (state ^ (state >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
            state = state ^ (state >> np.uint64(31))
    return (state >> np.uint64(11)).astype(float) / 2.0**53
