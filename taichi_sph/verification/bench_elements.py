"""Speed of finite elements of shells, with one point and with four, beside particles on the same nodes: `taichi-sph bench --elements`."""

from __future__ import annotations

import time as clock
from pathlib import Path
from typing import Any

from ..scene import Scene
from .bench import SECONDS, metal_scene

SIZES = (10_000, 40_000)
BARS = {"elastic": 3.0e6, "metal": 1.5e6}  # node-steps/s in f64 on two cores that are quiet
FORMS: dict[str, dict[str, Any]] = {
    "particles": {"kind": "galerkin"},
    "4 points": {"kind": "elements", "points": 4},
    "1 point": {"kind": "elements", "points": 1},
}


def scene(nodes: int, form: str, metal: bool, precision: str = "f64") -> Scene:
    """The plate of `bench --metal`, drawn out under a pressure; it does not tear. Elastic, or all of it yields from the first steps on."""
    one = metal_scene(nodes, precision)
    shell = one.shells[0]
    gone = {"damage": None, "delay": None, "critical_damage": None} | ({} if metal else {"strength": None})
    said = shell.model_dump() | {"cuts": [], "formulation": FORMS[form], "material": shell.material.model_dump() | gone}
    return Scene.model_validate(one.model_dump() | {"name": f"bench-elements-{nodes}", "shells": [said]})


def measure(nodes: int, form: str, metal: bool, arch: str, threads: int | None, precision: str) -> dict[str, Any]:
    """Steps such a plate for some seconds."""
    from .. import runtime
    from ..world.world import World

    sim = World(scene(nodes, form, metal, precision), arch=arch, threads=threads)
    sim.advance(10)
    steps, spent, best, busy = 0, 0.0, 0.0, clock.process_time()
    while spent < SECONDS:
        began = clock.perf_counter()
        sim.advance(20)
        runtime.ti.sync()
        took = clock.perf_counter() - began
        steps, spent, best = steps + 20, spent + took, max(best, 20 / took)
    return {
        "form": form,
        "law": "metal" if metal else "elastic",
        "nodes": sim.n_nodes,
        "steps": steps,
        "node_steps_per_second": sim.n_nodes * steps / spent,
        "best_node_steps_per_second": sim.n_nodes * best,
        "core_seconds_per_node_step": (clock.process_time() - busy) / (sim.n_nodes * steps),
        "memory_per_node": sim.bytes / sim.n_nodes,
    }


def main(sizes: tuple[int, ...], arch: str, threads: int | None, precision: str, out: Path | None = None) -> None:
    """Prints the table; `out` keeps it as JSON."""
    from ..output.folder import write_json
    from ..output.record import machine, versions

    about = machine()
    print(f"{about['processor']}, {about['cores']} cores, {arch}, threads {threads or 'all'}, {precision}")
    print("\nlaw      form         nodes  steps  M node-st/s   best  core us/node-st  B/node")
    rows = []
    for metal in (False, True):
        for form in FORMS:
            for nodes in sizes or SIZES:
                rows.append(one := measure(nodes, form, metal, arch, threads, precision))
                print(
                    f"{one['law']:8s} {form:10s} {one['nodes']:7d} {one['steps']:6d} {one['node_steps_per_second'] / 1e6:12.2f} "
                    f"{one['best_node_steps_per_second'] / 1e6:6.2f} {1e6 * one['core_seconds_per_node_step']:16.3f} "
                    f"{one['memory_per_node']:7.0f}"
                )
    print(f"\nbars: elastic {BARS['elastic'] / 1e6:g} M, a metal that flows everywhere {BARS['metal'] / 1e6:g} M node-steps/s")
    if out:
        write_json(out, {"machine": about, "versions": versions(), "arch": arch, "precision": precision, "elements": rows})
