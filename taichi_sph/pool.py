"""Fields that say what they are: whether a checkpoint keeps them, what a frame shows of them, their unit and meaning.

A Pool is the one way to allocate. Restart, bytes and frames follow from what its fields say, so nobody writes a list of names twice.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import runtime
from .errors import SceneError


@dataclass
class Entry:
    """What is known of one field: its first n rows are in use."""

    field: Any
    n: int
    unit: str
    doc: str
    keeps: bool  # part of the history: a checkpoint holds it
    shown: str  # its name in frames; empty where frames leave it out


class Pool:
    """Owner of fields and of numbers that are history.

    `name` is unique in a run; a field's full name is "pool.field". `kept` names the attributes (numbers, or NumPy arrays of a fixed
    shape) that a checkpoint holds beside the fields. `unset` names fields and attributes that may hold no finite number: what they tell
    of has not happened yet. After a restore `renew` is called: what follows from the history is made again there.
    """

    kept: tuple[str, ...] = ()
    unset: tuple[str, ...] = ()
    # kernels take pools as templates; Taichi's decorator would say so too, and make every look at an attribute a search for kernels
    _data_oriented = True

    def __init__(self, name: str):
        self.name = name
        self.fields: dict[str, Entry] = {}

    def field(
        self,
        name: str,
        n: int,
        vector: int = 0,
        dtype: str = "real",
        *,
        unit: str = "",
        doc: str = "",
        keeps: bool = False,
        shown: str = "",
        grows: bool = False,
        unset: bool = False,
    ) -> Any:
        """A dense field of n scalars, or of n vectors. unit "": a pure number.

        unset: it may hold no finite number yet. grows: it may be asked for again, longer; the old one is lost.
        """
        if name in self.fields and not grows:
            raise ValueError(f"pool '{self.name}' has a field '{name}' already")
        made = runtime.new(f"{self.name}.{name}", n, vector, dtype, again=name in self.fields)
        self.fields[name] = Entry(made, n, unit, doc, keeps, shown)
        if unset and name not in self.unset:
            self.unset = (*self.unset, name)
        return made

    def state(self) -> dict[str, np.ndarray]:
        """All that is history, by full name."""
        found = {f"{self.name}.{k}": runtime.get(e.field, e.n) for k, e in self.fields.items() if e.keeps}
        return found | {f"{self.name}.{k}": np.array(getattr(self, k)) for k in self.kept}

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shape of each entry of `state`, without reading the device."""
        found = {f"{self.name}.{k}": (e.n, *_components(e.field)) for k, e in self.fields.items() if e.keeps}
        return found | {f"{self.name}.{k}": np.shape(getattr(self, k)) for k in self.kept}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Continue exactly from `state()`; `check` has seen that all is there."""
        for k, e in self.fields.items():
            if e.keeps:
                runtime.put(e.field, np.asarray(state[f"{self.name}.{k}"]))
        for k in self.kept:
            before, value = getattr(self, k), np.asarray(state[f"{self.name}.{k}"])
            setattr(self, k, value.copy() if isinstance(before, np.ndarray) else type(before)(value))

    def renew(self) -> None:
        """Make again what follows from the history. Called after a restore, once all pools have theirs."""

    def shows(self) -> dict[str, np.ndarray]:
        """What frames show of it, by the name there; floats as f64."""
        found = {e.shown: runtime.get(e.field, e.n) for e in self.fields.values() if e.shown}
        return {k: v.astype(np.float64) if v.dtype.kind == "f" else v for k, v in found.items()}


def _components(field: Any) -> tuple[int, ...]:
    return (field.n,) if hasattr(field, "n") else ()


def state_of(pools: Iterable[Pool]) -> dict[str, np.ndarray]:
    """The history of all pools. Two entries of one name are a mistake of the program."""
    found: dict[str, np.ndarray] = {}
    for pool in pools:
        for name, value in pool.state().items():
            if name in found:
                raise ValueError(f"two pools keep '{name}'")
            found[name] = value
    return found


def check(pools: Iterable[Pool], state: dict[str, np.ndarray]) -> None:
    """SceneError when a state lacks something or has another shape."""
    for pool in pools:
        for name, shape in pool.shapes().items():
            if name not in state:
                raise SceneError(f"checkpoint: '{name}' is missing; it was written by another version or scene")
            if np.shape(state[name]) != shape:
                raise SceneError(
                    f"checkpoint: '{name}' has shape {np.shape(state[name])}, this scene needs {shape};"
                    " it belongs to another scene or quality"
                )


def restore_all(pools: Iterable[Pool], state: dict[str, np.ndarray]) -> None:
    """All pools as `state` has them, then what follows from it, in the order of the pools. Nothing is touched where `check` refuses."""
    pools = list(pools)
    check(pools, state)
    for pool in pools:
        pool.restore(state)
    for pool in pools:
        pool.renew()
