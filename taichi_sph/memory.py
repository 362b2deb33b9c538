"""Fields as NumPy arrays: on the CPU their own memory, so that nothing is compiled to fill a field or to read one.

Taichi's own copies are kernels, one for each field and direction: 150 of them for a tank of water, half of the time before its first
step. Here one small kernel for each tree of fields says where in memory the tree lies, and Taichi says where in the tree a field does.
Taichi lays out a tree of all fields that are new when the next kernel is compiled, and the earlier it does, the more trees there are.
So values of a field that is not laid out yet wait until then.
"""

import ctypes
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    impl: Any
    ti: Any
else:
    import taichi as ti
    from taichi.lang import impl

_TYPES = {ti.f64: np.float64, ti.f32: np.float32, ti.i32: np.int32, ti.i8: np.int8}


@ti.kernel
def _where(f: ti.template()) -> ti.u64:
    return ti.get_addr(f, [0])


class Memory:
    """The memory of all fields since Taichi was started."""

    def __init__(self) -> None:
        self._roots: dict[int, int] = {}  # address of each tree that has been looked into
        self._views: dict[int, np.ndarray] = {}  # by the number of the field's node in its tree
        self._waiting: list[tuple[Any, np.ndarray, float]] = []
        self._taichi = impl.get_runtime()
        self._taichi.materialize = self._lay_out  # Taichi calls it before it compiles a kernel or reads a field

    def _lay_out(self) -> None:
        """As Taichi's own, then what waits is written."""
        taichi = self._taichi
        if taichi.materialized and impl._root_fb.empty:
            return
        type(taichi).materialize(taichi)
        waiting, self._waiting = self._waiting, []
        for field, values, beyond in waiting:
            _write(self.view(field), values, beyond)

    def view(self, field: Any) -> np.ndarray:
        """(capacity,) or (capacity, components): the field itself. What is written there is in the field."""
        number = _number(field)
        if number not in self._views:
            self._lay_out()
            self._views[number] = self._look(field)
        return self._views[number]

    def _look(self, field: Any) -> np.ndarray:
        first = _first(field)
        place = first.snode.ptr
        tree = place.get_snode_tree_id()
        inside = place.parent.offset_bytes_in_parent_cell + place.offset_bytes_in_parent_cell
        if tree not in self._roots:
            self._roots[tree] = _where(first) - inside
        kind = np.dtype(_TYPES[first.dtype])
        shape = (*field.shape, field.n) if hasattr(field, "n") else field.shape
        size = int(np.prod(shape)) * kind.itemsize
        memory = (ctypes.c_char * size).from_address(self._roots[tree] + inside)
        return np.ndarray(shape, kind, memoryview(memory))

    def put(self, field: Any, values: np.ndarray, beyond: float = 0) -> None:
        """Values into the first rows of a field, one number into the rows beyond."""
        if impl._root_fb.empty or _number(field) in self._views:
            _write(self.view(field), values, beyond)
        else:
            self._waiting.append((field, np.array(values), beyond))


def _first(field: Any) -> Any:
    """The first component."""
    return field.get_scalar_field(0) if hasattr(field, "n") else field


def _number(field: Any) -> int:
    return _first(field).snode.ptr.id


def _write(view: np.ndarray, values: np.ndarray, beyond: float) -> None:
    if len(values):
        view[: len(values)] = values
    view[len(values) :] = beyond
