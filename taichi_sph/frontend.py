"""Taichi 1.7 reads the source of its kernels in Python, and asks for the same lines for every function that it inlines: half of a start
with kernels from the cache. Here it remembers what it read. Nothing that it makes of it changes.
"""

from __future__ import annotations

import functools
import linecache
import sys
import textwrap
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    impl: Any
    kernel_impl: Any
    snode: Any
    ast_transformer_utils: Any
else:
    from taichi.lang import impl, kernel_impl, snode
    from taichi.lang.ast import ast_transformer_utils


@functools.cache
def _wrapper(width: int) -> Any:
    """A TextWrapper that wraps each text once: Taichi shows every node of a line the line."""
    return SimpleNamespace(wrap=functools.cache(textwrap.TextWrapper(width=width).wrap))


def _inside_class(level_of_class_stackframe: int) -> bool:
    """Whether a decorator stands inside a class: the line of that frame says so. Taichi asks `inspect`, which goes through all modules."""
    try:
        frame = sys._getframe(level_of_class_stackframe)
    except ValueError:  # a kernel made by the program itself
        return False
    line = linecache.getline(frame.f_code.co_filename, frame.f_lineno).strip()
    return any(pattern.match(line) for pattern in kernel_impl._KERNEL_CLASS_STACKFRAME_STMT_RES)


def _nowhere(stacklevel: int = 1) -> str:
    """Where a field was declared, which Taichi says of fields without a place. Those of a Pool have theirs."""
    return ""


def remember() -> None:
    """From now on Taichi reads each line once. What a later Taichi has no more is left alone."""
    quick = {
        (ast_transformer_utils, "TextWrapper"): _wrapper,
        (impl, "get_traceback"): _nowhere,
        (snode, "get_traceback"): _nowhere,
        (kernel_impl, "_inside_class"): _inside_class,
        (kernel_impl, "getsourcefile"): functools.cache(kernel_impl.getsourcefile),
        (kernel_impl, "getsourcelines"): functools.cache(kernel_impl.getsourcelines),
        (kernel_impl, "textwrap"): SimpleNamespace(fill=functools.cache(textwrap.fill), dedent=functools.cache(textwrap.dedent)),
    }
    for (module, name), value in quick.items():
        if hasattr(module, name):
            setattr(module, name, value)
