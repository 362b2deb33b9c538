"""The only place that starts Taichi and allocates its fields.

Every module that holds kernels writes `from ..runtime import ti`; nothing that a user imports to
describe a scene comes here, so Taichi is loaded only when something is to be computed.

One run lives at a time: `start` throws away the fields of the run before. Capacities are rounded up
so that runs of about the same size share compiled kernels in Taichi's offline cache.
"""

from __future__ import annotations

import contextlib
import functools
import io
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")

if TYPE_CHECKING:
    ti: Any  # Taichi compiles the source of a kernel: its types are its own, and a type checker knows nothing of them
else:
    import taichi as ti

from . import frontend, launch
from .errors import SceneError
from .memory import Memory

frontend.remember()
launch.remember()

ARCHS = ("cpu", "cuda", "vulkan", "metal")


@dataclass
class Runtime:
    """What was started: `arch` name, `real` type of the state, and every field allocated since."""

    arch: str
    real: object
    threads: int
    memory: Memory | None  # of the CPU; elsewhere fields are copied by kernels
    bytes: int = 0
    fields: dict[str, int] = field(default_factory=dict)  # name -> bytes


_current: Runtime | None = None


def start(arch: str = "cpu", precision: str = "f64", threads: int | None = None) -> Runtime:
    """Start Taichi afresh. The silent fall-back to the CPU of a missing device is turned into an error."""
    global _current
    if arch not in ARCHS:
        raise SceneError(f"arch: {arch!r} is not known; choose one of {', '.join(ARCHS)}")
    if arch == "vulkan" and precision == "f64":
        raise SceneError("arch: 'vulkan' has no exp, log and powers of 64 bits; use numerics.precision = f32 there, or --arch cpu or cuda")
    real = ti.f32 if precision == "f32" else ti.f64
    options = {"cpu_max_num_threads": threads} if threads else {}
    launch.forget()
    with contextlib.redirect_stdout(io.StringIO()):  # it prints the arch whatever the log level
        ti.init(
            arch=getattr(ti, arch),
            default_fp=real,
            default_ip=ti.i32,
            fast_math=False,
            log_level=ti.ERROR,
            offline_cache=True,
            **options,
        )
    got = ti.cfg.arch
    if arch != "cpu" and got != getattr(ti, arch):
        raise SceneError(f"arch: {arch!r} was asked for, but this machine offers only {got}; use --arch cpu")
    _current = Runtime(arch, real, threads or os.cpu_count() or 1, Memory() if arch == "cpu" else None)
    return _current


def current() -> Runtime:
    """The running Taichi."""
    if _current is None:
        raise RuntimeError("runtime.start has not been called")
    return _current


def functions_of_64_bits() -> bool:
    """Whether this device has exp, log, sin and powers in f64; shaders have them in f32 only (numerics/doubles.py)."""
    return current().arch in ("cpu", "cuda")


def one_by_one() -> bool:
    """Whether this device does long loops of one thread well: a GPU does not, and drivers cut them off (Mesa's software device: after
    65535 rounds of a thread, silently). There NumPy does what must be done in order."""
    return current().arch == "cpu"


def in_any_order(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """Let this kernel add in any order and fuse products with sums, so that the compiler takes several neighbours at once (1.5 to 2 times
    faster where a loop has no branch). Bits then depend on the processor, not on the number of threads. Not for kernels that ask for NaN
    or live by compensated differences."""

    @functools.wraps(kernel)
    def call(*args: Any) -> Any:
        config = ti.lang.impl.current_cfg()
        before, config.fast_math = config.fast_math, True  # of the kernel, not of the run: it is read when the kernel is first called
        try:
            return kernel(*args)
        finally:
            config.fast_math = before

    return call


def kernels() -> list[str]:
    """Names of the kernels that were compiled, or loaded from the cache, since the start: "bodies.shell_sph.galerkin.Galerkin.gather"."""
    made = [k.func for k in ti.lang.impl.get_runtime().kernels if k.compiled_kernels]
    return sorted({f"{f.__module__.removeprefix('taichi_sph.')}.{f.__qualname__}" for f in made if f.__module__.startswith("taichi_sph.")})


def capacity(n: int) -> int:
    """n rounded up to the next of 1, 1.25, 1.5, 1.75 times a power of two."""
    n = max(int(n), 8)
    power = 1 << (n.bit_length() - 1)
    return next(c for c in (power, power * 5 // 4, power * 3 // 2, power * 7 // 4, power * 2) if c >= n)


_TYPES = {"i32": ti.i32, "i8": ti.i8, "f64": ti.f64, "f32": ti.f32}


def new(name: str, n: int, vector: int = 0, dtype: str = "real", again: bool = True) -> Any:
    """Dense field of `capacity(n)` scalars, or vectors of `vector` components side by side (AoS).

    again: the name may be in use, and its field is lost. A Pool says when; who allocates without one says nothing yet.
    """
    run = current()
    if name in run.fields and not again:
        raise ValueError(f"two fields are called '{name}'")
    kind = run.real if dtype == "real" else _TYPES[dtype]
    size = {ti.f64: 8, ti.f32: 4, ti.i32: 4, ti.i8: 1}[kind] * max(vector, 1) * capacity(n)
    run.fields[name] = size
    run.bytes += size
    if vector:
        return ti.Vector.field(vector, kind, shape=capacity(n))
    return ti.field(kind, shape=capacity(n))


def put(target: Any, values: np.ndarray) -> None:
    """Copy an array into the first rows of a field (fields are longer than what they hold)."""
    if memory := current().memory:
        memory.put(target, values)
        return
    full = np.zeros((target.shape[0],) + tuple(values.shape[1:]), values.dtype)
    full[: len(values)] = values
    target.from_numpy(full)


def get(source: Any, n: int) -> np.ndarray:
    """The first n rows of a field as an array."""
    if memory := current().memory:
        return memory.view(source)[:n].copy()
    return source.to_numpy()[:n]


def fill(field: Any, value: float) -> None:
    """One number into every entry of a field."""
    if memory := current().memory:
        memory.put(field, np.zeros(0), value)
    else:
        field.fill(value)
