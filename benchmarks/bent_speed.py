"""The full elastic shell (membrane, bending, shear, stabilisation, finite rotation): node-steps per second in f64 and f32.

A piece of a cylinder, irregular quadrangles, shaken. Mean of some seconds, and the best of their parts, for a machine
that others use too; bytes of all fields per node.

    python benchmarks/bent_speed.py --out benchmarks/bent_speed.json
"""

from __future__ import annotations

import argparse
import json
import math
import time
from pathlib import Path

import numpy as np

from taichi_sph import runtime
from taichi_sph.output.record import machine, versions
from taichi_sph.scene import Cylinder, Material, Numerics, Scene, Shell
from taichi_sph.world.world import World

PARTS, SECONDS = 12, 1.0


def shell(nodes: int, precision: str) -> Scene:
    """One radian of a pipe's wall, as long as wide, of about so many nodes."""
    spacing = 1.0 / (math.sqrt(nodes) - 1)
    return Scene(
        name="bent_speed",
        title="Piece of a cylinder, free",
        source="benchmark",
        shells=[
            Shell(
                name="wall",
                surface=Cylinder(radius=1.0, length=1.0, axis="y", angle=1.0),
                thickness=0.02,
                material=Material(name="steel", young=210e9, poisson=0.3, density=7800),
                motion="free",
            )
        ],
        duration=0.5,
        numerics=Numerics(spacing=spacing, irregularity=0.2, precision=precision),
    )


def measure(nodes: int, precision: str, threads: int | None) -> dict:
    sim = World(shell(nodes, precision), threads=threads)
    n = sim.shell.nodes.n
    shake = 0.1 * np.random.default_rng(0).standard_normal((n, 3))
    runtime.put(sim.shell.nodes.v, shake.astype(runtime.get(sim.shell.nodes.v, n).dtype))
    sim.advance(5)
    steps, rates = 5, []
    while len(rates) < PARTS:
        began = time.perf_counter()
        sim.advance(steps)
        runtime.ti.sync()
        took = time.perf_counter() - began
        if took < 0.5 * SECONDS:
            steps = max(steps + 1, int(steps * SECONDS / max(took, 1e-3)))
            continue
        rates.append(n * steps / took)
    return {"nodes": n, "precision": precision, "mean": float(np.mean(rates)), "best": max(rates), "bytes_per_node": sim.bytes / n}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--nodes", type=int, default=100_000)
    parser.add_argument("--threads", type=int)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    rows = [measure(given.nodes, precision, given.threads) for precision in ("f64", "f32")]
    for r in rows:
        print(
            f"{r['precision']} {r['nodes']} nodes: {r['mean'] / 1e6:.2f} M node-steps/s, best {r['best'] / 1e6:.2f};"
            f" {r['bytes_per_node']:.0f} bytes per node"
        )
    print(f"f32 over f64: {rows[1]['mean'] / rows[0]['mean']:.2f}, of the best {rows[1]['best'] / rows[0]['best']:.2f}")
    if given.out is not None:
        content = {"machine": machine(), "versions": versions(), "threads": given.threads, "sizes": rows}
        given.out.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
        print(f"written: {given.out}")


if __name__ == "__main__":
    main()
