"""Bits that must not move: after a restart, and with another number of threads."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np


def same_state(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> list[str]:
    """Names of the entries that differ by a bit (nan equals nan)."""
    assert a.keys() == b.keys()
    return [k for k in a if np.asarray(a[k]).tobytes() != np.asarray(b[k]).tobytes()]


def restarts_exactly(make: Callable[[], Any], before: int, after: int) -> None:
    """`before` steps, then `after` more; the same from a copy of the state between them, in a world made anew."""
    world = make()
    world.advance(before)
    half = {name: np.copy(value) for name, value in world.state().items()}
    world.advance(after)
    end, energies = world.state(), world.energies()
    again = make()
    again.restore(half)
    assert same_state(again.state(), half) == []
    again.advance(after)
    assert same_state(again.state(), end) == []
    assert again.energies() == energies


def threads_change_nothing(make: Callable[[int], Any], steps: int) -> None:
    """The same state after so many steps, of worlds made for one and for two threads."""
    states = []
    for threads in (1, 2):
        world = make(threads)
        world.advance(steps)
        states.append(world.state())
    assert same_state(*states) == []
