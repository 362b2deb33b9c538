"""A small valid scene as plain data, and how tests spoil it."""

from __future__ import annotations

import copy
from enum import Enum
from typing import Any

DELETE = Enum("Sign", "DELETE").DELETE

GOOD: dict[str, Any] = {
    "name": "small",
    "title": "A small plate",
    "source": "tests",
    "duration": "20 us",
    "numerics": {"spacing": "2 mm"},
    "shells": [
        {
            "name": "plate",
            "surface": {"kind": "plate", "length": "40 mm", "width": "20 mm"},
            "thickness": "4 mm",
            "material": {
                "name": "concrete",
                "young": "32 GPa",
                "poisson": 0.2,
                "density": 2450,
                "damage": {"threshold": 8.5e-5, "A": 1, "B": 7300},
                "delay": {"a": 10, "tau_c": "1 us"},
                "critical_damage": 0.99,
            },
            "cuts": [{"start": [0, 0.01, 0], "end": [0.02, 0.01, 0]}],
        }
    ],
    "forces": [{"shell": "plate", "where": {"kind": "box", "lo": [None, 0.019, None]}, "total": [0, 160, 0]}],
    "motions": [{"shell": "plate", "where": {"kind": "box", "hi": [None, 0.001, None]}, "velocity": [None, 0, None]}],
    "output": {"frames": 4, "samples": 8, "checkpoints": 2},
}


def spoiled(key: str = "", value: Any = None) -> dict[str, Any]:
    """GOOD with the value at a dotted key replaced, added, or (DELETE) taken away."""
    data = copy.deepcopy(GOOD)
    if not key:
        return data
    here: Any = data
    *parents, last = key.split(".")
    for part in parents:
        here = here[int(part) if isinstance(here, list) else part]
    place = int(last) if isinstance(here, list) else last
    if value is DELETE:
        del here[place]
    else:
        here[place] = value
    return data
