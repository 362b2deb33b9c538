"""What it costs to launch a kernel again: three templates and six numbers, as Taichi does it and as taichi_sph/launch.py does.

python benchmarks/launch.py
"""

import time

from taichi_sph import runtime
from taichi_sph.pool import Pool
from taichi_sph.runtime import ti

LAUNCHES = 5000


@ti.kernel
def add(a: ti.template(), b: ti.template(), c: ti.template(), i: ti.i32, j: ti.i32, k: ti.i32, p: ti.f64, q: ti.f64, r: ti.f64):
    ti.loop_config(serialize=True)
    for _ in range(1):
        a.x[0] += b.x[0] * p + c.x[0] * q


def microseconds(launch, *args) -> float:
    launch(*args)
    start = time.perf_counter()
    for _ in range(LAUNCHES):
        launch(*args)
    return (time.perf_counter() - start) / LAUNCHES * 1e6


def main() -> None:
    runtime.start(threads=1)
    args = []
    for name in "abc":
        args.append(Pool(name))
        args[-1].x = args[-1].field("x", 8, dtype="f64", doc="a number")
    args += [1, 2, 3, 1.0, 2.0, 3.0]
    again, asking = microseconds(add, *args), microseconds(type(add._primal).__call__.__wrapped__, add._primal, *args)
    print(f"{again:.1f} us again, {asking:.1f} us as Taichi does it")


if __name__ == "__main__":
    main()
