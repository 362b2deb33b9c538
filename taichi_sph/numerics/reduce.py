"""Sums and largest values that do not depend on the number of threads: fixed blocks, then NumPy over the blocks."""

from typing import Any

import numpy as np

from .. import runtime
from ..runtime import ti

BLOCK = 2048


@ti.data_oriented
class Reducer:
    """Scratch for up to `n` entries."""

    def __init__(self, n: int, name: str = "reduce"):
        self.blocks = max(1, -(-n // BLOCK))
        self.partial = runtime.new(f"{name}.partial", self.blocks, dtype="f64")

    def total(self, values: Any, n: int) -> float:
        """Sum of the first n entries of a scalar field, in f64."""
        used = max(1, -(-n // BLOCK))
        _block_sums(self.partial, values, n, used)
        return float(np.sum(runtime.get(self.partial, used)))

    def largest(self, vectors: Any, n: int) -> float:
        """Largest norm of the first n entries of a vector field; infinite where one is no number."""
        used = max(1, -(-n // BLOCK))
        _block_tops(self.partial, vectors, n, used)
        return float(runtime.get(self.partial, used).max())

    def top(self, values: Any, n: int) -> float:
        """Largest of the first n entries of a scalar field, 0 where none is above it; infinite where one is no number."""
        used = max(1, -(-n // BLOCK))
        _block_highest(self.partial, values, n, used)
        return float(runtime.get(self.partial, used).max())


def fastest(velocities: Any, places: Any, n: int, first: int = 0) -> tuple[int, str]:
    """The number of the fastest of n points (of the first that is no number), counted from `first` on, and where and how fast it
    moves, in words."""
    v = np.linalg.norm(runtime.get(velocities, first + n)[first:].astype(float), axis=1)
    i = int(np.argmax(np.where(np.isfinite(v), v, np.inf)))
    place = ", ".join(f"{1e3 * x:.4g}" for x in runtime.get(places, first + n)[first + i])
    return i, f"at ({place}) mm moves at {v[i]:.3g} m/s"


@ti.kernel
def _block_sums(partial: ti.template(), values: ti.template(), n: ti.i32, blocks: ti.i32):
    for b in range(blocks):
        s = ti.cast(0.0, ti.f64)
        for i in range(b * BLOCK, ti.min(n, (b + 1) * BLOCK)):
            s += ti.cast(values[i], ti.f64)
        partial[b] = s


@ti.kernel
def _block_tops(partial: ti.template(), vectors: ti.template(), n: ti.i32, blocks: ti.i32):
    for b in range(blocks):
        top = ti.cast(0.0, ti.f64)
        for i in range(b * BLOCK, ti.min(n, (b + 1) * BLOCK)):
            v = ti.cast(vectors[i].norm(), ti.f64)
            if not (v <= top):  # also true for nan
                top = v
                if not (v < ti.math.inf):
                    top = ti.math.inf
                    break
        partial[b] = top


@ti.kernel
def _block_highest(partial: ti.template(), values: ti.template(), n: ti.i32, blocks: ti.i32):
    for b in range(blocks):
        top = ti.cast(0.0, ti.f64)
        for i in range(b * BLOCK, ti.min(n, (b + 1) * BLOCK)):
            v = ti.cast(values[i], ti.f64)
            if not (v <= top):  # also true for nan
                top = v
                if not (v < ti.math.inf):
                    top = ti.math.inf
                    break
        partial[b] = top
