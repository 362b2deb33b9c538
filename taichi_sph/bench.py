"""`taichi-sph bench`: how fast the shell is here, and how far from what the memory of this machine allows.

A node-step is one node, with its share of stress points, through one whole time step. Bytes per step count
every array that a step touches once, and once more where it is written: what perfect caches would move.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import tempfile
import time as clock
from pathlib import Path
from typing import Any

from .scene.schema import Plate, Scene

SIZES = (10_000, 100_000, 1_000_000)
SECONDS = 3.0  # of stepping per size
WEDGE = 4e6  # Pa, on the faces of the crack
# arrays of the set-up and of rupture events, which a step without rupture does not touch
IDLE = (".at", ".t1", ".t2", ".h", ".cut", ".slot", ".own", ".order", ".touched", ".n_points", ".grid.", ".X", ".centre")
WRITTEN = ("nodes.u", "nodes.v", "nodes.force", "edges.u", ".row_force", ".side_force", "cells.strain", "cells.damage", "cells.delayed")

FIRST_STEP = """
import sys, time
from taichi_sph.scene.script import load_scene
from taichi_sph.solver.simulation import Simulation
sim = Simulation(load_scene(sys.argv[1]), arch=sys.argv[2])
sim.advance(1)
sim.energies()
"""


def plate_scene(nodes: int, precision: str = "f64", formulation: str = "galerkin") -> Scene:
    """A pre-cracked plate that tears (material T table 2.6: Mazars, delay, rupture), of about that many nodes.

    Its crack is wedged open just behind the tip, so that it runs from the first steps on, whatever the size,
    and some cells break in every step, as they do where a real crack runs.
    """
    length, width, thickness = 0.1, 0.04, 0.004
    spacing = math.sqrt(length * width / nodes)
    reach = 40 * spacing
    push = WEDGE * reach * thickness
    back, tip, middle = length / 2 - reach, length / 2, width / 2
    return Scene.model_validate(
        {
            "name": f"bench-{nodes}",
            "title": "Benchmark plate",
            "source": "T 2.4.3",
            "duration": 1e-3,
            "numerics": {"spacing": spacing, "precision": precision, "formulation": formulation},
            "shells": [
                {
                    "name": "plate",
                    "surface": Plate(length=length, width=width).model_dump(),
                    "thickness": thickness,
                    "material": {
                        "name": "concrete",
                        "young": 32e9,
                        "poisson": 0.2,
                        "density": 2450,
                        "damage": {"threshold": 8.5e-5, "A": 1, "B": 7300},
                        "delay": {"a": 10, "tau_c": 1e-6},
                        "critical_damage": 0.99,
                    },
                    "cuts": [{"start": (0, middle, 0), "end": (tip, middle, 0)}],
                }
            ],
            "forces": [
                {
                    "shell": "plate",
                    "where": {"kind": "box", "lo": (back, middle + low, None), "hi": (tip, middle + high, None)},
                    "total": (0, sign * push, 0),
                }
                for low, high, sign in ((0.0, 4 * spacing, 1), (-4 * spacing, 0.0, -1))
            ],
        }
    )


def step_bytes(fields: dict[str, int]) -> int:
    """Bytes that one step moves at least, from the sizes of the fields by name."""
    total = 0
    for name, size in fields.items():
        if not any(part in name for part in IDLE):
            total += size * (2 if name.endswith(WRITTEN) else 1)
    return total


def measure(nodes: int, arch: str, threads: int | None, precision: str) -> dict[str, Any]:
    """Builds a plate of about `nodes` nodes and steps it for some seconds, ruptures included."""
    from . import runtime
    from .solver.simulation import Simulation

    began = clock.perf_counter()
    sim = Simulation(plate_scene(nodes, precision), arch=arch, threads=threads)
    sim.advance(2)
    runtime.ti.sync()
    build = clock.perf_counter() - began
    steps, spent, chunk = 0, 0.0, 1
    before = sim.status()["broken"]
    while spent < SECONDS:
        began = clock.perf_counter()
        sim.advance(chunk)
        runtime.ti.sync()
        spent += clock.perf_counter() - began
        steps += chunk
        chunk = max(1, min(2 * chunk, int(steps / spent * SECONDS / 4)))
    points = sim.n_nodes + sim.stress_points
    moved = step_bytes(runtime.current().fields) * points / runtime.capacity(points)
    return {
        "nodes": sim.n_nodes,
        "stress_points": sim.stress_points,
        "steps": steps,
        "broken": sim.status()["broken"] - before,
        "seconds_build": build,
        "node_steps_per_second": sim.n_nodes * steps / spent,
        "particle_steps_per_second": points * steps / spent,
        "bytes_per_particle_step": moved / points,
        "bandwidth": moved * steps / spent,
        "memory_per_node": sim.bytes / sim.n_nodes,
    }


def first_step(arch: str) -> dict[str, float]:
    """Seconds from the command to the end of the first step, with an empty cache of kernels and with a full one."""
    from .scene.script import dump

    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "scene.json").write_text(dump(plate_scene(17_200)))
        (Path(folder) / "first.py").write_text(FIRST_STEP)
        command = [sys.executable, str(Path(folder) / "first.py"), str(Path(folder) / "scene.json"), arch]
        paths = os.pathsep.join(filter(None, [str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")]))
        env = {**os.environ, "TI_OFFLINE_CACHE_FILE_PATH": str(Path(folder) / "kernels"), "PYTHONPATH": paths}
        found = {}
        for name in ("cold", "warm"):
            began = clock.perf_counter()
            subprocess.run(command, env=env, check=True, capture_output=True)
            found[name] = clock.perf_counter() - began
    return found


def main(sizes: tuple[int, ...], arch: str, threads: int | None, precision: str, out: Path | None = None) -> None:
    """Prints the table; `out` keeps it as JSON."""
    from .numerics.triad import bandwidth
    from .output.record import machine, versions

    about = machine()
    print(f"{about['processor']}, {about['cores']} cores, {arch}, {precision}, threads {threads or 'all'}")
    limit = bandwidth(arch, threads)
    print(f"memory bandwidth (triad): {limit / 1e9:.1f} GB/s")
    started = first_step(arch)
    print(f"command to end of first step, 17 200 nodes: {started['cold']:.1f} s cold, {started['warm']:.1f} s warm")
    print("   nodes  points    steps  broken  M node-steps/s  M particle-steps/s  B/particle-step  GB/s  of triad  build [s]")
    rows = []
    for size in sizes or SIZES:
        r = measure(size, arch, threads, precision)
        rows.append(r)
        print(
            f"{r['nodes']:8d} {r['stress_points']:7d} {r['steps']:8d} {r['broken']:7d} {r['node_steps_per_second'] / 1e6:15.2f} "
            f"{r['particle_steps_per_second'] / 1e6:19.2f} {r['bytes_per_particle_step']:16.0f} {r['bandwidth'] / 1e9:5.1f} "
            f"{r['bandwidth'] / limit:8.0%} {r['seconds_build']:10.1f}"
        )
    if out is not None:
        content = {"machine": about, "versions": versions(), "arch": arch, "precision": precision, "threads": threads,
                   "bandwidth": limit, "first_step_seconds": started, "sizes": rows}  # fmt: skip
        out.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
        print(f"written: {out}")
