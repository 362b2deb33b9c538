"""a = b + s c over long arrays: what the memory of this machine gives to a Taichi kernel (STREAM triad)."""

import time as clock

from .. import runtime
from ..runtime import ti

LENGTH = 1 << 24  # 3 arrays of 134 MB: no cache holds them


@ti.kernel
def _triad(a: ti.template(), b: ti.template(), c: ti.template(), s: float):
    for i in a:
        a[i] = b[i] + s * c[i]


def bandwidth(arch: str = "cpu", threads: int | None = None) -> float:
    """Bytes/s, best of 6, 24 bytes per element."""
    runtime.start(arch, "f64", threads)
    a, b, c = (ti.field(ti.f64, shape=LENGTH) for _ in range(3))
    b.fill(1.0)
    c.fill(2.0)
    best = float("inf")
    for _ in range(6):
        began = clock.perf_counter()
        _triad(a, b, c, 3.0)
        ti.sync()
        best = min(best, clock.perf_counter() - began)
    return 24.0 * LENGTH / best
