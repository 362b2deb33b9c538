"""`taichi-sph bench --solid`: how fast solids are here. A cube, elastic, and of a metal of Johnson and Cook with heat, damage, delay and
rupture that yields everywhere; the same of particles, elastic.

Bytes per node-step count each array that a kernel reads or writes once (TRAFFIC): what perfect caches would move. Entries are those of the
table of coefficients, 8 a cell of finite elements.
"""

from __future__ import annotations

import json
import time as clock
from pathlib import Path
from typing import Any

from ..scene import Scene
from .bench import exponent

SIZES = (10_000, 31_600, 100_000, 316_000, 1_000_000)
SECONDS = 3.0  # of stepping per size
BARS = {"elastic": 2.0e6, "metal": 0.8e6}  # node-steps/s in f64 on two cores
STEEL: dict[str, Any] = {"name": "steel", "young": 210e9, "poisson": 0.3, "density": 7800}
METAL = STEEL | {
    "strength": {
        "kind": "johnson_cook", "A": 175e6, "B": 380e6, "n": 0.32, "C": 0.02, "rate0": 1.0,
        "heat": {"m": 1.0, "melting": 1800, "capacity": 460},
    },
    "damage": {"kind": "lemaitre_chaboche", "threshold": 0.0, "rupture": 0.5, "critical": 0.25},
    "delay": {"a": 1, "tau_c": 1e-6},
    "critical_damage": 0.25,
}  # fmt: skip

# the fields that a step reads (once each) and writes, of the elastic form; how long they are their pools say
TRAFFIC = {
    "strain": ("first", "corners", "node", "B", "push", "volume", "pull", "stored", "stiffer", "broken", "nodes.u", "nodes.X"),
    "gather": ("of_node", "entry", "push", "nodes.force"),
    "motion": ("nodes.u", "nodes.u", "nodes.v", "nodes.v", "nodes.force", "nodes.mass", "nodes.kinetic"),
}
OF_METAL = ("strain", "back", "stress", "plastic", "hardening", "flow", "rate", "temperature", "damage", "delayed", "dissipated", "lost",
            "uneven", "softer")  # fmt: skip


def cube_scene(nodes: int, precision: str, kind: str) -> Scene:
    """A cube that is drawn out, by 1e-3 in a step or so where it is of metal."""
    side = 0.1
    n = max(2, round(nodes ** (1 / 3)) - 1)
    spacing = side / n
    rate = (5.0 if kind == "metal" else 0.005) / spacing  # 1/s
    strips = 50
    return Scene.model_validate(
        {
            "name": f"bench-solid-{nodes}",
            "title": "Benchmark cube",
            "source": "taichi-sph bench",
            "duration": 1e-3,
            "numerics": {"spacing": spacing, "precision": precision},
            "solids": [
                {
                    "name": "cube",
                    "shape": {"kind": "brick", "size": (side, side, side)},
                    "material": METAL if kind == "metal" else STEEL,
                    "formulation": "particles" if kind == "particles" else "trilinear",
                }
            ],
            "initial": [
                {"where": {"kind": "box", "lo": (x, None, None)}, "velocity": (rate * (x - side / 2), 0, 0)}
                for x in (side * k / strips for k in range(strips))
            ],
        }
    )


def step_bytes(world: Any, metal: bool) -> float:
    """Bytes per node that one step has to move."""
    from .. import runtime

    group = next(group for group in world.groups if group.kind == "solid")
    sizes, total = runtime.current().fields, 0.0
    for names in [*TRAFFIC.values(), *([OF_METAL, OF_METAL] if metal else [])]:
        for name in names:
            pool, field = (group.nodes, name.removeprefix("nodes.")) if name.startswith("nodes.") else (group.cells, name)
            n = pool.fields[field].n
            total += sizes[f"{pool.name}.{field}"] * n / runtime.capacity(n)
    return total / group.nodes.n


def measure(nodes: int, arch: str, threads: int | None, precision: str, kind: str) -> dict[str, Any]:
    """Steps a cube of about so many nodes for some seconds. kind: "elastic", "metal" or "particles"."""
    from .. import runtime
    from ..world.world import World

    began = clock.perf_counter()
    world = World(cube_scene(nodes, precision, kind), arch=arch, threads=threads)
    world.advance(3)
    runtime.ti.sync()
    build = clock.perf_counter() - began
    group = next(group for group in world.groups if group.kind == "solid")
    steps, spent, chunk, best = 0, 0.0, 1, 0.0
    while spent < SECONDS:
        began = clock.perf_counter()
        world.advance(chunk)
        runtime.ti.sync()
        took = clock.perf_counter() - began
        best = max(best, chunk / took)
        spent, steps = spent + took, steps + chunk
        chunk = max(1, min(2 * chunk, int(steps / spent * SECONDS / 6)))
    found = {
        "kind": kind,
        "precision": precision,
        "nodes": group.nodes.n,
        "cells": group.cells.n,
        "entries_per_cell": group.cells.fields["B"].n / group.cells.n,
        "steps": steps,
        "seconds_build": build,
        "node_steps_per_second": group.nodes.n * steps / spent,
        "best_node_steps_per_second": group.nodes.n * best,
        "memory_per_node": world.bytes / group.nodes.n,
        "bytes_per_node_step": step_bytes(world, kind == "metal"),
    }
    if kind == "metal":
        found["yielding"] = float((runtime.get(group.cells.plastic, group.cells.n) > 0).mean())
        found["broken"] = int(runtime.get(group.cells.broken, group.cells.n).sum())
    return found


def main(sizes: tuple[int, ...], arch: str, threads: int | None, precision: str, out: Path | None = None) -> None:
    """Prints the table of solids; `out` keeps it as JSON."""
    from ..numerics.triad import bandwidth
    from ..output.record import machine, versions

    about, limit = machine(), bandwidth(arch, threads)
    print(f"{about['processor']}, {about['cores']} cores, {arch}, threads {threads or 'all'}; memory (triad) {limit / 1e9:.1f} GB/s")
    print("\nkind       real     nodes  entries/cell  steps  M node-st/s   best  B/node-st   GB/s  of mem  B/node  build [s]")
    rows = []
    cases = [(size, "elastic") for size in sizes or SIZES] + [
        (size, kind) for kind in ("metal", "particles") for size in sizes or SIZES[:3]
    ]
    for size, kind in cases:
        r = measure(size, arch, threads, precision, kind)
        rows.append(r)
        moved = r["bytes_per_node_step"] * r["node_steps_per_second"]
        print(
            f"{kind:10s} {precision} {r['nodes']:9d} {r['entries_per_cell']:13.1f} {r['steps']:6d} {r['node_steps_per_second'] / 1e6:12.2f}"
            f" {r['best_node_steps_per_second'] / 1e6:6.2f} {r['bytes_per_node_step']:10.0f} {moved / 1e9:6.1f} {moved / limit:7.0%}"
            f" {r['memory_per_node']:7.0f} {r['seconds_build']:10.1f}",
            flush=True,
        )
    content: dict[str, Any] = {
        "machine": about,
        "versions": versions(),
        "arch": arch,
        "threads": threads,
        "bandwidth": limit,
        "sizes": rows,
    }
    elastic = [r for r in rows if r["kind"] == "elastic"]
    if len(elastic) > 2:
        content["exponent"] = exponent(elastic)
        print(f"cost per step ~ nodes^{content['exponent']:.3f}")
    for kind, bar in BARS.items():
        rate = max(r["node_steps_per_second"] for r in rows if r["kind"] == kind)
        print(f"bar: {kind} {bar / 1e6:g} M node-steps/s {'met' if rate >= bar else 'MISSED'}")
    if out is not None:
        out.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
        print(f"written: {out}")
