"""Sums whose value does not depend on the number of threads: fixed blocks, then NumPy over the blocks."""

import numpy as np

from .. import runtime
from ..runtime import ti

BLOCK = 2048


@ti.data_oriented
class Reducer:
    """Scratch for sums over up to `n` entries."""

    def __init__(self, n: int):
        self.blocks = max(1, -(-n // BLOCK))
        self.partial = runtime.new("reduce.partial", self.blocks, dtype="f64")

    def total(self, values, n: int) -> float:
        """Sum of the first n entries of a scalar field, in f64."""
        used = max(1, -(-n // BLOCK))
        _block_sums(self.partial, values, n, used)
        return float(np.sum(runtime.get(self.partial, used)))


@ti.kernel
def _block_sums(partial: ti.template(), values: ti.template(), n: ti.i32, blocks: ti.i32):
    for b in range(blocks):
        s = ti.cast(0.0, ti.f64)
        for i in range(b * BLOCK, ti.min(n, (b + 1) * BLOCK)):
            s += ti.cast(values[i], ti.f64)
        partial[b] = s
