"""`taichi-sph bench --coupled`: what a coupled step costs beside its parts, and what of it no kernel does.

The parts are the water of `bench --fluid` and the metal shell of `bench --metal`, of the same counts, measured in the same run. A step of
both one after the other would take N_w / r_w + N_s / r_s seconds, r their rates: the coupled rate over (N_w + N_s) / that time, the
harmonic mean, is the ratio that is printed.

What is outside kernels is measured by Taichi's own clock of kernels: the time of a step less that in kernels is launching them and Python
between them. That clock makes every kernel anew, so it has a run of its own.
"""

from __future__ import annotations

import json
import os
import time as clock
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..scene.schema import Scene
from ..scene.script import load_scene
from . import bench

ENTERED = 0.15e-3  # s: the bullet is in the water, and cells break
GOAL = 0.7  # of the rate of the parts
SMALL = ("still_water", "dam_break", "empty_tank", "plate_perforation")  # drafts of about a thousand to some thousand nodes
STEPS = 200  # under the clock of kernels
FIRST = 20  # steps of a small scene that are not counted


@contextmanager
def clock_of_kernels() -> Iterator[None]:
    """Worlds that are made inside time their kernels."""
    os.environ["TI_KERNEL_PROFILER"] = "1"
    try:
        yield
    finally:
        del os.environ["TI_KERNEL_PROFILER"]


def rate(scene: Scene, arch: str, threads: int | None, start: float) -> dict[str, Any]:
    """Steps a scene from `start` [s] on for some seconds."""
    from .. import runtime
    from ..world.world import World

    sim = World(scene, arch=arch, threads=threads)
    sim.advance_to(start)
    sim.advance(FIRST)
    steps, spent, chunk, best = 0, 0.0, 10, 0.0
    while spent < bench.SECONDS and sim.steps_left >= chunk:
        began = clock.perf_counter()
        sim.advance(chunk)
        runtime.ti.sync()
        took = clock.perf_counter() - began
        spent, steps, best = spent + took, steps + chunk, max(best, chunk / took)
    water = sum(span.n for group in sim.groups if group.kind == "fluid" for span in group.bodies)
    return {
        "nodes": sim.n_nodes,
        "water": water,
        "steps": steps,
        "ms_per_step": 1e3 * spent / steps,
        "best_ms_per_step": 1e3 / best,
    }


def outside(scene: Scene, arch: str, threads: int | None, start: float) -> dict[str, float]:
    """Of a step of the scene from `start` [s] on: tasks of kernels launched, milliseconds in all and in them."""
    from .. import runtime
    from ..world.world import World

    with clock_of_kernels():
        sim = World(scene, arch=arch, threads=threads)
        sim.advance_to(start)
        sim.advance(FIRST)
        profiler = runtime.ti.profiler
        profiler.clear_kernel_profiler_info()
        began = clock.perf_counter()
        sim.advance(steps := min(STEPS, sim.steps_left))
        runtime.ti.sync()
        spent = clock.perf_counter() - began
        inside = profiler.get_kernel_profiler_total_time()
        tasks = len(profiler.kernel_profiler.get_default_kernel_profiler()._traced_records)
    return {
        "nodes": sim.n_nodes,
        "tasks": tasks / steps,
        "ms": 1e3 * spent / steps,
        "ms_in_kernels": 1e3 * inside / steps,
        "share": 1.0 - inside / spent,
    }


def main(find: Callable[[str], Path], quality: str, arch: str, threads: int | None, out: Path | None = None) -> None:
    """Prints the ratio of tank_leak at one quality and the shares of small scenes; `out` keeps them as JSON. find: path of a scene's
    script, by its name."""
    from ..output.record import machine, versions

    about = machine()
    print(f"{about['processor']}, {about['cores']} cores, {arch}, threads {threads or 'all'}")
    tank = load_scene(find("tank_leak"), {"quality": quality})
    found = rate(tank, arch, threads, ENTERED)
    shell = found["nodes"] - found["water"]
    water_rate = bench.measure_fluid(found["water"], arch, threads, "f64")["particle_steps_per_second"]
    shell_rate = bench.measure(shell, arch, threads, "f64", metal=True)["node_steps_per_second"]
    parts = 1e3 * (found["water"] / water_rate + shell / shell_rate)
    ratio = parts / found["ms_per_step"]
    found |= {"shell": shell, "water_rate": water_rate, "shell_rate": shell_rate, "ms_of_parts": parts, "ratio": ratio}
    print(
        f"tank_leak {quality}: {shell} nodes of shell, {found['water']} of water; {found['ms_per_step']:.2f} ms a step from"
        f" {1e3 * ENTERED:g} ms on ({found['best_ms_per_step']:.2f} at best)\n"
        f"  its parts alone: water {water_rate / 1e6:.2f} M particle-steps/s, metal {shell_rate / 1e6:.2f} M node-steps/s: {parts:.2f} ms\n"
        f"  coupled over harmonic mean of the parts: {ratio:.0%} (goal {GOAL:.0%} {'met' if ratio >= GOAL else 'MISSED'})",
        flush=True,
    )
    print("\noutside kernels      nodes  tasks/step  ms/step  in kernels  outside  share")
    rows = []
    for name, settings, start in [("tank_leak", {"quality": quality}, ENTERED), *((small, {"quality": "draft"}, 0.0) for small in SMALL)]:
        r: dict[str, Any] = {"scene": name, **outside(load_scene(find(name), settings), arch, threads, start)}
        rows.append(r)
        print(
            f"{name:18s} {r['nodes']:7d} {r['tasks']:11.0f} {r['ms']:8.3f} {r['ms_in_kernels']:11.3f} {r['ms'] - r['ms_in_kernels']:8.3f}"
            f" {r['share']:6.0%}",
            flush=True,
        )
    if out is not None:
        content = {"machine": about, "versions": versions(), "arch": arch, "threads": threads, "tank": found, "outside": rows}
        out.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
        print(f"written: {out}")
