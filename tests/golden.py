"""Golden hashes: the bits that draft scenes had when they were recorded, and the numbers beside them.

    python -m tests.golden [CASE ...]      record the cases anew (all of them when none is named) in tests/golden.json

Bits depend on the processor (the C library and the solver of equations choose their functions by what the processor can do, and the kernels
of fluids let the compiler fuse products with sums) and on the versions of NumPy, SciPy and Taichi. So `tests/golden.json` says where it was
made: there the bits must be the same, elsewhere the numbers.
"""

from __future__ import annotations

import hashlib
import json
import platform
import sys
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from taichi_sph.scene.script import load_scene

ROOT = Path(__file__).parents[1]
RECORD = Path(__file__).with_name("golden.json")


@dataclass(frozen=True)
class Case:
    """A draft scene, some settings of its own, and how many steps (of statics and modes: increments) it is advanced."""

    scene: str
    steps: int
    settings: dict[str, Any] = field(default_factory=dict)
    near: float = 1e-6  # relative, of the numbers on another processor: a fluid's motion is chaotic


CASES = {
    "brittle": Case("crack_branching", 200),
    "collocation": Case("crack_branching", 200, {"formulation": "collocation"}),
    "single": Case("crack_branching", 200, {"numerics.precision": "f32"}, near=1e-3),
    "burst": Case("plate_burst", 200),
    "cylinder": Case("pressurised_cylinder", 200),
    "beam": Case("beam_impact", 200, {"notch": 0.0508}),
    "striker": Case("plate_perforation", 200),
    "empty": Case("empty_tank", 200),
    "filled": Case("tank_leak", 200, near=1e-3),
    "subcycled": Case("tank_leak", 60, {"fluids.0.every": 3}, near=1e-3),
    "planes": Case("dam_break", 200, near=1e-3),
    "block": Case("falling_block", 200, near=1e-3),
    "fuel": Case("fuel_over_water", 200, {"heavy": "above"}, near=1e-3),
    "tanks": Case("two_tanks", 60, near=1e-3),
    "statics": Case("clamped_plate", 1, {"slenderness": 0.1, "nodes": "regular", "cells": "quad", "static.method": "relaxation"}),
    "modes": Case("plate_modes", 3, {"edges": "free", "nodes": "regular"}),
}
QUICK = ("brittle", "planes", "statics")  # in every run of the tests; the others with `-m long`


@cache
def machine() -> dict[str, str]:
    """All that the bits depend on beside the code."""
    known: dict[str, str] = {}
    path = Path("/proc/cpuinfo")
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        name, _, value = line.partition(":")
        known.setdefault(name.strip(), value.strip())
    flags = known.get("flags", "").split()
    return {
        "processor": known.get("model name", platform.processor()),
        "model": " ".join(known.get(key, "") for key in ("cpu family", "model")),  # the name may stand for several
        # by these the C library and the solver of equations behind scipy choose their kernels
        "instructions": " ".join(sorted(name for name in flags if name.startswith(("avx", "amx")) or name in ("sse4_2", "fma"))),
        "libc": " ".join(platform.libc_ver()),
        "numpy": version("numpy"),
        "scipy": version("scipy"),
        "taichi": version("taichi"),
    }


def computed(name: str, threads: int) -> dict[str, Any]:
    """What is recorded: hashes of the last frame and of the ledger, the norm of the velocities of each body [m/s], the ledger."""
    from taichi_sph.world.world import World

    case = CASES[name]
    world = World(load_scene(ROOT / "scenes" / f"{case.scene}.py", {"quality": "draft", **case.settings}), threads=threads)
    world.advance(case.steps)
    bits, speeds = hashlib.sha256(), {}
    for body in sorted(world.frame().bodies, key=lambda body: body.name):
        for part, data in (("", {"points": body.points, "cells": body.cells}), ("p.", body.point_data), ("c.", body.cell_data)):
            for key in sorted(data):
                values = np.ascontiguousarray(data[key])
                bits.update(f"{body.name}{part}{key}{values.dtype}{values.shape}".encode())
                bits.update(values.tobytes())
        speeds[body.name] = float(np.linalg.norm(body.point_data["velocity"]))
    ledger = world.energies()
    told = json.dumps({key: ledger[key] for key in sorted(ledger)})
    return {"bits": bits.hexdigest()[:16], "ledger_bits": hashlib.sha256(told.encode()).hexdigest()[:16], "speed": speeds, "ledger": ledger}


def recorded() -> dict[str, Any]:
    return json.loads(RECORD.read_text(encoding="utf-8"))


def main() -> None:
    """Record; a case whose bits depend on the number of threads is refused."""
    names = sys.argv[1:] or list(CASES)
    content = recorded() if RECORD.exists() else {"cases": {}}
    if content.get("machine") != machine():
        names, content = list(CASES), {"cases": {}}  # one file, one machine
    for name in names:
        one, two = computed(name, 1), computed(name, 2)
        if one != two:
            sys.exit(f"{name}: one and two threads differ; nothing was written")
        before = content["cases"].get(name, {}).get("bits")
        print(f"{name}: {one['bits']}{'' if before in (None, one['bits']) else f', was {before}'}")
        content["cases"][name] = one
    RECORD.write_text(json.dumps({"machine": machine(), "cases": content["cases"]}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
