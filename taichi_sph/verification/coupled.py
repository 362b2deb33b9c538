"""`taichi-sph bench --coupled`: what a coupled step costs beside its parts, and what of it no kernel does.

The parts are the water of `bench --fluid` and the metal shell of `bench --metal`, of the same counts. A step of both one after the other
would take N_w / (m r_w) + N_s / r_s seconds, r their rates, where the water takes one step in m of the shell's. The ratio that is printed
is that time over what the step takes: the coupled rate over the harmonic mean of the parts. The whole run of tank_leak is measured, in
quarters of its time, for the blow costs more than what follows. Parts are measured before the first and after each quarter, in a process
of their own: a machine that others use is not as fast at all times.

What is outside kernels is measured by Taichi's own clock of kernels: the time of a step less that in kernels is launching them and Python
between them. That clock makes every kernel anew, so it has a run of its own.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import time as clock
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..scene.schema import Scene
from ..scene.script import load_scene
from . import bench

ENTERED = 0.15e-3  # s: the bullet is in the water, and cells break
QUARTERS = 4
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


def _part(water: int, shell: int, arch: str, threads: int | None) -> tuple[float, float]:
    """Rates of the parts: particle-steps and node-steps a second."""
    return (
        bench.measure_fluid(water, arch, threads, "f64")["particle_steps_per_second"],
        bench.measure(shell, arch, threads, "f64", metal=True)["node_steps_per_second"],
    )


def parts(water: int, shell: int, arch: str, threads: int | None) -> tuple[float, float]:
    """`_part` in a process of its own: a world that was made before lives on."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        return pool.submit(_part, water, shell, arch, threads).result()


def whole(scene: Scene, arch: str, threads: int | None) -> list[dict[str, Any]]:
    """The run of a scene in quarters, and the parts around each."""
    from .. import runtime
    from ..world.world import World

    sim = World(scene, arch=arch, threads=threads)
    sim.advance(FIRST)
    fluids = [group for group in sim.groups if group.kind == "fluid"]
    water = sum(span.n for group in fluids for span in group.bodies)
    every = fluids[0].every  # all fluids of tank_leak are one
    shell = sim.n_nodes - water
    before, rows = parts(water, shell, arch, threads), []
    for k in range(QUARTERS):
        step, began = sim.step, clock.perf_counter()
        sim.advance_to((k + 1) / QUARTERS * scene.duration)
        runtime.ti.sync()
        steps, spent = sim.step - step, clock.perf_counter() - began
        after = parts(water, shell, arch, threads)
        water_rate, shell_rate = (0.5 * (one + two) for one, two in zip(before, after))
        before = after
        alone = water / (every * water_rate) + shell / shell_rate
        rows.append(
            {
                "until": sim.time, "shell": shell, "water": water, "steps": steps, "ms_per_step": 1e3 * spent / steps,
                "water_rate": water_rate, "shell_rate": shell_rate, "ms_of_parts": 1e3 * alone, "ratio": alone * steps / spent,
            }
        )  # fmt: skip
    return rows


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
    quarters = whole(tank, arch, threads)
    print(f"tank_leak {quality}: {quarters[0]['shell']} nodes of shell, {quarters[0]['water']} of water")
    print("\nuntil, ms   steps  ms/step  water M/s  metal M/s  ms of parts  ratio")
    for q in quarters:
        print(
            f"{1e3 * q['until']:9.2f} {q['steps']:7d} {q['ms_per_step']:8.2f} {q['water_rate'] / 1e6:10.2f} {q['shell_rate'] / 1e6:10.2f}"
            f" {q['ms_of_parts']:12.2f} {q['ratio']:6.0%}"
        )
    ratio = sum(q["steps"] * q["ms_of_parts"] for q in quarters) / sum(q["steps"] * q["ms_per_step"] for q in quarters)
    word = "met" if ratio >= GOAL else "MISSED"
    print(f"coupled over harmonic mean of the parts, whole run: {ratio:.0%} (goal {GOAL:.0%} {word})", flush=True)
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
        content = {
            "machine": about,
            "versions": versions(),
            "arch": arch,
            "threads": threads,
            "tank": {"ratio": ratio, "quarters": quarters},
            "outside": rows,
        }
        out.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
        print(f"written: {out}")
