"""Launching a kernel again: Taichi 1.7 looks at every argument of every launch in Python, some 8 us each.

A launch whose templates are the same objects as in one before, and whose other arguments are numbers, needs only its numbers. That is the
launch of every step. With three templates and six numbers it takes 9 us instead of 73 (benchmarks/launch.py). All others go Taichi's way,
and so does the first, which compiles.
"""

from __future__ import annotations

import functools
import operator
import time as clock
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    cook_dtype: Any
    impl: Any
    kernel_impl: Any
    primitive_types: Any
else:
    from taichi.lang import impl, kernel_impl
    from taichi.lang.util import cook_dtype
    from taichi.types import primitive_types


VALUES = (int, float, str, tuple, list, dict, set)  # templates by their value: another object may be the same template


class Spent:
    """What the first launches of kernels took, which compile them or load what was compiled [s]; processor: of all threads."""

    seconds = 0.0
    processor = 0.0


def working() -> float:
    """A clock [s] that stands still while kernels are compiled or loaded."""
    return clock.perf_counter() - Spent.seconds


class Known(NamedTuple):
    """A launch that Taichi has made: the kernel, what it was compiled to, and its templates, so that no other object gets their ids."""

    kernel: Any
    compiled: Any
    templates: tuple[Any, ...]


class Arguments(NamedTuple):
    """Where the templates of a kernel stand, and its numbers: place, place among the numbers, whether real, what makes the number. Of
    vectors alike, with the place of each component."""

    templates: tuple[int, ...]
    numbers: tuple[tuple[int, tuple[int], bool, Callable[[Any], Any]], ...]
    vectors: tuple[tuple[int, tuple[tuple[int, int], ...], bool, Callable[[Any], Any]], ...]


def _arguments(kernel: Any) -> Arguments | None:
    """None: the kernel takes something else than templates, real and signed whole numbers and vectors of them, or gives back several."""
    returned = kernel.return_type
    if kernel.autodiff_mode != kernel_impl.AutodiffMode.NONE or (returned is not None and len(returned) != 1):
        return None
    templates: list[int] = []
    numbers: list[tuple[int, tuple[int], bool, Callable[[Any], Any]]] = []
    vectors: list[tuple[int, tuple[tuple[int, int], ...], bool, Callable[[Any], Any]]] = []
    for place, argument in enumerate(kernel.arguments):
        needed = argument.annotation
        if isinstance(needed, kernel_impl.template):
            templates.append(place)
            continue
        vector = isinstance(needed, kernel_impl.MatrixType) and needed.ndim == 1
        if not vector and id(needed) not in (*primitive_types.real_type_ids, *primitive_types.integer_type_ids):
            return None
        dtype = needed.dtype if vector else cook_dtype(needed)
        real = dtype in primitive_types.real_types
        if not real and not kernel_impl.is_signed(dtype):
            return None
        among, number = len(numbers) + len(vectors), float if real else operator.index
        if vector:
            vectors.append((place, tuple((among, k) for k in range(needed.n)), real, number))
        else:
            numbers.append((place, (among,), real, number))
    return Arguments(tuple(templates), tuple(numbers), tuple(vectors))


def _quick(slow: Callable[..., Any]) -> Callable[..., Any]:
    """Kernel.__call__, which goes the `slow` way where it does not know the launch."""

    @functools.wraps(slow)
    def call(self: Any, *args: Any, **kwargs: Any) -> Any:
        state = self.__dict__
        if "takes" not in state:
            self.takes, self.known = _arguments(self), {}
        takes = self.takes
        if takes is None or kwargs or len(args) != len(self.arguments):
            return slow(self, *args, **kwargs)
        key = tuple([id(args[place]) for place in takes.templates])
        known = self.known.get(key)
        if known is not None and not impl._root_fb.empty:  # fields without a place: Taichi lays them out, and what waits is written
            return slow(self, *args)
        if known is None:
            began, worked = clock.perf_counter(), clock.process_time()
            given = slow(self, *args)
            Spent.seconds += clock.perf_counter() - began
            Spent.processor += clock.process_time() - worked
            templates = tuple(args[place] for place in takes.templates)
            if not self.has_print and not any(isinstance(template, VALUES) for template in templates):
                kernel, program = self.compiled_kernels[self.ensure_compiled(*args)], impl.get_runtime().prog
                self.known[key] = Known(kernel, program.compile_kernel(program.config(), program.get_device_caps(), kernel), templates)
            return given
        context = known.kernel.make_launch_context()
        try:
            for place, among, real, number in takes.numbers:
                if real:
                    context.set_arg_float(among, number(args[place]))
                else:
                    context.set_arg_int(among, number(args[place]))
            for place, components, real, number in takes.vectors:
                setter, given = context.set_struct_arg_float if real else context.set_struct_arg_int, args[place]
                for component in components:
                    setter(component, number(given[component[1]]))
        except (TypeError, ValueError, OverflowError, IndexError):  # Taichi says what is wrong
            return slow(self, *args)
        program = impl.get_runtime().prog
        try:
            program.launch_kernel(known.compiled, context)
        except Exception as error:
            raise kernel_impl.handle_exception_from_cpp(error) from None
        if self.return_type is None:
            return None
        program.synchronize()
        return self.construct_kernel_ret(context, self.return_type[0], (0,))

    return call


def remember() -> None:
    """From now on Taichi looks at the templates of a launch once."""
    kernel_impl.Kernel.__call__ = _quick(kernel_impl.Kernel.__call__)


def forget() -> None:
    """All launches of the run so far, before Taichi starts afresh: what they were compiled to goes."""
    for kernel in impl.get_runtime().kernels:
        if "known" in kernel.__dict__:
            kernel.known.clear()
