"""`taichi-sph bench`: how fast the shell is here, and how far from what the memory of this machine allows.

A node-step is one node, with its share of stress points, through one whole time step. Bytes per step count, for
every kernel, each array that it reads or writes once (TRAFFIC): what perfect caches would move.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import tempfile
import time as clock
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..scene import Plate, Scene
from ..scene.library import material

if TYPE_CHECKING:
    from ..pool import Pool

SIZES = (10_000, 31_600, 100_000, 316_000, 1_000_000)
SECONDS = 3.0  # of stepping per size
WARM_UP = 100  # steps at most until the first rupture
WEDGE = 4e6  # Pa, on the faces of the crack
# What a step has to keep to: node-steps/s of the galerkin shell in f64 on two cores, its share of what the bytes and
# the bandwidth allow, seconds to the end of the first step with empty and with full cache of kernels, seconds of B1.
BARS = {"node_steps_per_second": 2.0e6, "share": 0.5, "cold": 15.0, "warm": 5.0, "branching": 30.0}

# The fields that each kernel of a galerkin step in the plane reads or writes; how long they are their pools say. Gathers count each entry
# once, as a perfect cache would. What only a rupture or a growing damage touches is left out. The rows write their part of row_force, the
# edges the rest: it stands with the edges.
TRAFFIC = {
    "rows": {
        "read": ("galerkin.rows.start", "galerkin.rows.coef", "galerkin.rows.source", "nodes.u", "galerkin.stiffness", "galerkin.integrity",
                 "cells.start_of_node", "cells.of_node", "cells.broken", "cells.delayed"),
        "write": ("galerkin.edge_u", "galerkin.residual"),
    },
    "cells": {
        "read": ("cells.broken", "cells.n_corners", "cells.edge", "galerkin.side", "galerkin.edge_u", "cells.area", "cells.a1", "cells.a2",
                 "cells.damage", "cells.delayed", "cells.strain"),
        "write": ("cells.damage", "cells.delayed", "cells.strain", "galerkin.side_force"),
    },
    "edges": {"read": ("cells.sides", "galerkin.side_force"), "write": ("galerkin.row_force",)},
    "nodes": {
        "read": ("galerkin.rows.t_start", "galerkin.rows.t_coef", "galerkin.rows.t_row", "galerkin.row_force"),
        "write": ("nodes.force",),
    },
    "motion": {
        "read": ("nodes.u", "nodes.v", "nodes.force", "nodes.mass", "loads.force.total"),
        "write": ("nodes.u", "nodes.v", "nodes.kinetic"),
    },
}  # fmt: skip

FIRST_STEP = """
import sys, time
from taichi_sph.scene.script import load_scene
from taichi_sph.world.world import World
sim = World(load_scene(sys.argv[1]), arch=sys.argv[2])
sim.advance(1)
sim.energies()
"""


def plate_scene(nodes: int, precision: str = "f64", formulation: str = "galerkin") -> Scene:
    """A pre-cracked plate that tears (material T table 2.6: Mazars, delay, rupture), of about that many nodes.

    Its crack is wedged open just behind the tip, and tau_c counts as many steps as in the thesis whatever the size:
    some cells break in every few steps, as they do where a real crack runs.
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
                        "delay": {"a": 10, "tau_c": 1e-6 * spacing / 0.5e-3},
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


METAL_SIZES = (10_000, 40_000)
METAL_BAR = 1.0e6  # node-steps/s of a bent metal shell, all of it yielding, in f64 on two cores


def metal_scene(nodes: int, precision: str = "f64") -> Scene:
    """A bent plate of metal (Johnson-Cook, ductile damage, delay, rupture; material T table 2.8, torn ten times sooner),
    drawn out under a pressure, by 1e-3 in a step or so: every cell yields from the first steps on, and some break."""
    side, strips = 0.1, 50
    spacing = side / math.sqrt(nodes)
    rate = 5.0 / spacing  # 1/s
    like = material("steel, perforated plate").model_dump()
    damage = like["damage"]
    return Scene.model_validate(
        {
            "name": f"bench-metal-{nodes}",
            "title": "Benchmark plate of metal",
            "source": "T table 2.8",
            "duration": 1e-3,
            "numerics": {"spacing": spacing, "precision": precision},
            "shells": [
                {
                    "name": "plate",
                    "surface": Plate(length=side, width=side).model_dump(),
                    "thickness": 1e-3,
                    "motion": "free",
                    "material": {**like, "damage": {**damage, "rupture": 0.1}},
                    "cuts": [{"start": (side / 2, 0.4 * side, 0), "end": (side / 2, 0.6 * side, 0)}],
                }
            ],
            "pressures": [{"shell": "plate", "value": 1e6}],
            "initial": [
                {"shell": "plate", "where": {"kind": "box", "lo": (x, None, None)}, "velocity": (rate * (x - side / 2), 0, 0)}
                for x in (side * k / strips for k in range(strips))
            ],
        }
    )


def step_bytes(pools: Iterable[Pool]) -> dict[str, float]:
    """Bytes that one galerkin step has to move, kernel by kernel (TRAFFIC): each field as far as it is in use."""
    from .. import runtime

    sizes = runtime.current().fields
    used = {}
    for pool in pools:
        for field, entry in pool.fields.items():
            name = f"{pool.name}.{field}"
            used[name] = sizes[name] * entry.n / runtime.capacity(entry.n)
    return {kernel: sum(used[name] for names in moved.values() for name in names) for kernel, moved in TRAFFIC.items()}


def measure(
    nodes: int, arch: str, threads: int | None, precision: str, formulation: str = "galerkin", metal: bool = False
) -> dict[str, Any]:
    """Builds a plate of about `nodes` nodes and steps it for some seconds, ruptures included."""
    from .. import runtime
    from ..world.world import World

    began = clock.perf_counter()
    scene = metal_scene(nodes, precision) if metal else plate_scene(nodes, precision, formulation)
    sim = World(scene, arch=arch, threads=threads)
    sim.advance(1)
    runtime.ti.sync()
    build = clock.perf_counter() - began
    while sim.status()["broken"] == 0 and sim.step < WARM_UP:
        sim.advance(5)
    steps, spent, chunk, best = 0, 0.0, 1, 0.0
    before = sim.status()["broken"]
    busy = clock.process_time()
    while spent < SECONDS:
        began = clock.perf_counter()
        sim.advance(chunk)
        runtime.ti.sync()
        took = clock.perf_counter() - began
        best = max(best, chunk / took)
        spent, steps = spent + took, steps + chunk
        chunk = max(1, min(2 * chunk, int(steps / spent * SECONDS / 6)))
    found: dict[str, Any] = {
        "formulation": formulation,
        "precision": precision,
        "nodes": sim.n_nodes,
        "stress_points": sim.stress_points,
        "steps": steps,
        "broken": sim.status()["broken"] - before,
        "seconds_build": build,
        "node_steps_per_second": sim.n_nodes * steps / spent,
        "best_node_steps_per_second": sim.n_nodes * best,
        "particle_steps_per_second": (sim.n_nodes + sim.stress_points) * steps / spent,
        "core_seconds_per_node_step": (clock.process_time() - busy) / (sim.n_nodes * steps),
        "memory_per_node": sim.bytes / sim.n_nodes,
    }
    if metal:
        yielding = runtime.get(sim.shell.cells.plastic, sim.shell.cells.n) > 0
        found["yielding"] = float(yielding.mean())
    elif formulation == "galerkin":
        rows = sim.shell.internal.rows
        found["pairs_per_node"] = rows.pairs / sim.n_nodes
        found["bytes_per_node_step"] = {kernel: size / sim.n_nodes for kernel, size in step_bytes(sim.pools).items()}
    return found


# the same of a step of water, all letters per particle (N) or per entry of a list (L); lists and sort are made anew
# in every so-many-th step, and what they move is shared among the steps between
FLUID_TRAFFIC = {
    "pack": {
        "read": {"fluid.x": "N", "fluid.v": "N", "fluid.s": "N", "fluid.rate": "N", "fluid.rate_before": "N"},
        "write": {"fluid.pair": "N"},
    },
    "act": {
        "read": {"fluid.lists.number": "N", "fluid.lists.near": "L", "fluid.pair": "N", "fluid.s": "N", "fluid.rate": "N",
                 "fluid.missed": "N", "fluid.mass": "N", "fluid.viscous": "N", "fluid.diffused": "N", "fluid.lag": "N"},
        "write": {"fluid.force": "N", "fluid.s": "N", "fluid.rate": "N", "fluid.rate_before": "N", "fluid.missed": "N",
                  "fluid.viscous": "N", "fluid.diffused": "N", "fluid.lag": "N"},
    },
    "drift": {
        "read": {"fluid.x": "N", "fluid.v": "N", "fluid.force": "N", "fluid.mass": "N", "fluid.ahead": "N"},
        "write": {"fluid.x": "N", "fluid.v": "N", "fluid.kinetic": "N"},
    },
    "moved": {"read": {"fluid.x": "N", "fluid.lists.built": "N"}, "write": {}},
}  # fmt: skip
FLUID_SIZES = (10_000, 31_600, 100_000, 316_000, 1_000_000, 2_000_000)
FLUID_BARS = {"particle_steps_per_second": 3.0e6}


def measure_fluid(particles: int, arch: str, threads: int | None, precision: str) -> dict[str, Any]:
    """Steps a cube of about so many water particles (52 neighbours, stirred at up to 50 m/s, so that lists wear out)."""
    import numpy as np

    from .. import runtime
    from ..bodies.fluid.body import FluidBody
    from ..bodies.fluid.fill import Filling
    from ..bodies.fluid.said import Fluid, FluidBox

    runtime.start(arch, precision, threads)
    side, d = round(particles ** (1 / 3)), 1e-3
    x = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    x = d * (x + 0.5 + np.random.default_rng(0).uniform(-0.15, 0.15, x.shape))
    fluid = Fluid(name="water", fill=FluidBox(lo=(0, 0, 0), hi=(side * d,) * 3))
    b = FluidBody([(fluid, Filling(x, side**3 * d**3, d, fluid.water.density))])
    b.start()
    n = b.p.n
    runtime.put(b.p.v, 30 * np.sin(40 * runtime.get(b.p.x, n)[:, [1, 2, 0]]))
    dt, before = 0.9 * b.stable_dt(), 0.0

    def step() -> None:
        nonlocal before
        b.follow(before)
        b.rates(before, dt)
        b.kick_and_drift(before, dt)
        before = dt

    for _ in range(3):
        step()
    runtime.ti.sync()
    sorts, best, steps, spent = b.sorts, 0.0, 0, 0.0
    while spent < SECONDS:
        began = clock.perf_counter()
        chunk = 0
        first = b.sorts
        while b.sorts < first + 2:  # whole lives of a list
            step()
            chunk += 1
        runtime.ti.sync()
        took = clock.perf_counter() - began
        best, steps, spent = max(best, chunk / took), steps + chunk, spent + took
    fields = runtime.current().fields
    listed = int(runtime.get(b.near.number, n).sum())
    moved = {
        kernel: sum(
            fields[name] * (listed if letter == "L" else n) / runtime.capacity(n * b.near.width if letter == "L" else n)
            for way in arrays.values()
            for name, letter in way.items()
        )
        / n
        for kernel, arrays in FLUID_TRAFFIC.items()
    }
    return {
        "precision": precision,
        "particles": n,
        "neighbours": inside(b),
        "listed": listed / n - 1,
        "steps": steps,
        "steps_per_list": steps / (b.sorts - sorts),
        "particle_steps_per_second": n * steps / spent,
        "best_particle_steps_per_second": n * best,
        "memory_per_particle": runtime.current().bytes / n,
        "bytes_per_particle_step": moved,
    }


def inside(b: Any) -> float:
    """Mean number of neighbours within the support, of a sample away from the surface."""
    import numpy as np
    from scipy.spatial import cKDTree

    from .. import runtime

    x = runtime.get(b.p.x, b.p.n)
    reach = 2 * b.support * b.p.spacing
    deep = ((x > x.min(axis=0) + reach) & (x < x.max(axis=0) - reach)).all(axis=1)
    return float(np.mean(cKDTree(x).query_ball_point(x[deep][:1000], reach, return_length=True)) - 1)


def main_fluid(sizes: tuple[int, ...], arch: str, threads: int | None, precision: str, out: Path | None = None) -> None:
    """Prints the table of the fluid; `out` keeps it as JSON."""
    from ..numerics.triad import bandwidth
    from ..output.record import machine, versions

    about = machine()
    print(f"{about['processor']}, {about['cores']} cores, {arch}, threads {threads or 'all'}")
    limit = bandwidth(arch, threads)
    print(f"memory bandwidth (triad): {limit / 1e9:.1f} GB/s")
    print("\nreal  particles  neighb.  listed  steps  per list  M part-st/s   best  B/part-st   GB/s  of mem  B/part")
    rows: list[dict[str, Any]] = []
    for size, real in [(size, precision) for size in sizes or FLUID_SIZES] + ([] if sizes else [(100_000, "f32")]):
        r = measure_fluid(size, arch, threads, real)
        moved = sum(r["bytes_per_particle_step"].values())
        r["share_of_bandwidth"] = moved * r["particle_steps_per_second"] / limit
        rows.append(r)
        print(
            f"{real}  {r['particles']:9d} {r['neighbours']:8.1f} {r['listed']:7.1f} {r['steps']:6d} {r['steps_per_list']:9.1f}"
            f" {r['particle_steps_per_second'] / 1e6:12.2f} {r['best_particle_steps_per_second'] / 1e6:6.2f} {moved:10.0f}"
            f" {moved * r['particle_steps_per_second'] / 1e9:6.1f} {r['share_of_bandwidth']:7.0%} {r['memory_per_particle']:7.0f}",
            flush=True,
        )
    content: dict[str, Any] = {"machine": about, "versions": versions(), "arch": arch, "threads": threads, "bandwidth": limit}
    content["sizes"] = rows
    if len(rows) > 2:
        plain = [
            {"nodes": r["particles"], "node_steps_per_second": r["particle_steps_per_second"]} for r in rows if r["precision"] == precision
        ]
        content["exponent"] = exponent(plain)
        print(f"cost per step ~ particles^{content['exponent']:.3f}")
    r = min(rows, key=lambda r: (r["precision"] != precision, abs(math.log(r["particles"] / 1e5))))
    bar = FLUID_BARS["particle_steps_per_second"]
    print(f"bar: {bar / 1e6:g} M particle-steps/s {'met' if r['particle_steps_per_second'] >= bar else 'MISSED'}")
    if out is not None:
        out.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
        print(f"written: {out}")


def main_metal(sizes: tuple[int, ...], arch: str, threads: int | None, precision: str, out: Path | None = None) -> None:
    """Prints the table of the metal shell; `out` keeps it as JSON."""
    from ..output.record import machine, versions

    about = machine()
    print(f"{about['processor']}, {about['cores']} cores, {arch}, threads {threads or 'all'}")
    print("\nreal     nodes  steps  broken  yielding  M node-st/s   best  core-us/node-st  B/node  build [s]")
    rows = []
    for size in sizes or METAL_SIZES:
        r = measure(size, arch, threads, precision, metal=True)
        rows.append(r)
        print(
            f"{precision} {r['nodes']:9d} {r['steps']:6d} {r['broken']:7d} {r['yielding']:9.0%}"
            f" {r['node_steps_per_second'] / 1e6:12.2f} {r['best_node_steps_per_second'] / 1e6:6.2f}"
            f" {1e6 * r['core_seconds_per_node_step']:16.2f} {r['memory_per_node']:7.0f} {r['seconds_build']:10.1f}",
            flush=True,
        )
    print(f"bar: {METAL_BAR / 1e6:g} M node-steps/s {'met' if r['node_steps_per_second'] >= METAL_BAR else 'MISSED'}")
    if out is not None:
        content = {"machine": about, "versions": versions(), "arch": arch, "threads": threads, "sizes": rows}
        out.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
        print(f"written: {out}")


def first_step(arch: str) -> dict[str, float]:
    """Seconds from the command to the end of the first step, with an empty cache of kernels and with a full one."""
    from ..scene.script import dump

    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "scene.json").write_text(dump(plate_scene(17_200)))
        (Path(folder) / "first.py").write_text(FIRST_STEP)
        command = [sys.executable, str(Path(folder) / "first.py"), str(Path(folder) / "scene.json"), arch]
        paths = os.pathsep.join(filter(None, [str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")]))
        env = {**os.environ, "TI_OFFLINE_CACHE_FILE_PATH": str(Path(folder) / "kernels"), "PYTHONPATH": paths}
        found = {}
        for name in ("cold", "warm"):
            began = clock.perf_counter()
            subprocess.run(command, env=env, check=True, capture_output=True)
            found[name] = clock.perf_counter() - began
    return found


def branching(arch: str, threads: int | None) -> dict[str, Any] | None:
    """The crack-branching scene at the thesis's resolution, after compilation; None where there is no such scene here."""
    from ..scene.script import load_scene
    from ..world.world import World

    path = Path("scenes/crack_branching.py")
    if not path.is_file():
        return None
    sim = World(load_scene(path, {"quality": "paper"}), arch=arch, threads=threads)
    began = clock.perf_counter()
    sim.advance(sim.steps_left)
    seconds = clock.perf_counter() - began
    return {
        "nodes": sim.n_nodes,
        "steps": sim.step,
        "broken": sim.status()["broken"],
        "seconds": seconds,
        "node_steps_per_second": sim.n_nodes * sim.step / seconds,
    }


def exponent(rows: list[dict[str, Any]]) -> float:
    """p in seconds per step ~ nodes^p, by least squares."""
    x = [math.log(r["nodes"]) for r in rows]
    y = [math.log(r["nodes"] / r["node_steps_per_second"]) for r in rows]
    mx, my = sum(x) / len(x), sum(y) / len(y)
    return sum((a - mx) * (b - my) for a, b in zip(x, y)) / sum((a - mx) ** 2 for a in x)


def _line(r: dict[str, Any], limit: float) -> str:
    """One row of the table; completes the row with what the bandwidth allows."""
    line = (
        f"{r['formulation']:12s} {r['precision']} {r['nodes']:8d} {r['stress_points']:8d} {r['steps']:6d} {r['broken']:7d}"
        f" {r['node_steps_per_second'] / 1e6:11.2f} {r['particle_steps_per_second'] / 1e6:11.2f}"
    )
    if "bytes_per_node_step" in r:
        moved = sum(r["bytes_per_node_step"].values())
        r["gigabytes_per_second"] = moved * r["node_steps_per_second"] / 1e9
        r["share_of_bandwidth"] = moved * r["node_steps_per_second"] / limit
        line += f" {moved:9.0f} {r['gigabytes_per_second']:6.1f} {r['share_of_bandwidth']:7.0%}"
    else:
        line += " " * 25
    return line + f" {r['seconds_build']:9.1f}"


def _verdicts(content: dict[str, Any]) -> dict[str, bool]:
    """Which bars are met. Speed and share are those of the galerkin shell in f64 at the size nearest to 1e5."""
    plain = [r for r in content["sizes"] if r["formulation"] == "galerkin" and r["precision"] == "f64"]
    met = {name: content["first_step_seconds"][name] <= BARS[name] for name in ("cold", "warm")}
    if plain:
        r = min(plain, key=lambda r: abs(math.log(r["nodes"] / 1e5)))
        met["node_steps_per_second"] = r["node_steps_per_second"] >= BARS["node_steps_per_second"]
        met["share"] = r["share_of_bandwidth"] >= BARS["share"]
    if content["branching"]:
        met["branching"] = content["branching"]["seconds"] <= BARS["branching"]
    return met


def main(sizes: tuple[int, ...], arch: str, threads: int | None, precision: str, out: Path | None = None) -> None:
    """Prints the table; `out` keeps it as JSON."""
    from ..numerics.triad import bandwidth
    from ..output.record import machine, versions

    about = machine()
    print(f"{about['processor']}, {about['cores']} cores, {arch}, threads {threads or 'all'}")
    limit = bandwidth(arch, threads)
    print(f"memory bandwidth (triad): {limit / 1e9:.1f} GB/s")
    started = first_step(arch)
    print(f"command to end of first step, 17 200 nodes: {started['cold']:.1f} s cold, {started['warm']:.1f} s warm")
    long = branching(arch, threads)
    if long:
        print(
            f"crack_branching, {long['nodes']} nodes, {long['steps']} steps: {long['seconds']:.1f} s after compilation"
            f" ({long['node_steps_per_second'] / 1e6:.2f} M node-steps/s, {long['broken']} cells broken)"
        )
    print("\nform          real    nodes   points  steps  broken  M node-st/s  M part-st/s  B/node-st   GB/s  of mem  build [s]")
    other = "f32" if precision == "f64" else "f64"
    cases = [(size, precision, "galerkin") for size in sizes or SIZES]
    if not sizes:
        cases += [(100_000, other, "galerkin"), (100_000, precision, "collocation")]
    rows = []
    for size, real, formulation in cases:
        rows.append(measure(size, arch, threads, real, formulation))
        print(_line(rows[-1], limit), flush=True)
    plain = [r for r in rows if r["formulation"] == "galerkin" and r["precision"] == precision]
    parts = ", ".join(f"{kernel} {size:.0f}" for kernel, size in plain[-1]["bytes_per_node_step"].items())
    print(f"bytes per node-step = sum over kernels of (arrays read + arrays written) / nodes: {parts}")
    limit = max(limit, bandwidth(arch, threads))  # the machine may have been busy the first time
    lines = [_line(r, limit) for r in rows]
    print(f"memory bandwidth (triad), again: {limit / 1e9:.1f} GB/s; with it:\n" + "\n".join(lines))
    content: dict[str, Any] = {"machine": about, "versions": versions(), "arch": arch, "threads": threads, "bandwidth": limit,
               "first_step_seconds": started, "branching": long, "sizes": rows}  # fmt: skip
    if len(plain) > 1:
        content["exponent"] = exponent(plain)
        print(f"cost per step ~ nodes^{content['exponent']:.3f}")
    content["bars"] = BARS
    content["met"] = _verdicts(content)
    print("bars: " + ", ".join(f"{name} {BARS[name]:g} {'met' if ok else 'MISSED'}" for name, ok in content["met"].items()))
    if out is not None:
        out.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
        print(f"written: {out}")
