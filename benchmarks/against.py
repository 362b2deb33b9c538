"""Speed of two checkouts, one against the other: `bench`, `bench --metal`, `bench --fluid`, and the stepping of tank_leak at draft.

    python benchmarks/against.py OLD NEW [--runs 5] [--only bench,metal,fluid,tank]

OLD and NEW are folders. They take turns, a process for each measurement, and the best rate of a process counts. Prints the median of each
and of the ratios NEW / OLD, with the least and the largest. Rates are those after compilation. Nothing else should run on the machine.
"""

import argparse
import os
import statistics
import subprocess
import sys
from pathlib import Path

KINDS = {
    "bench": "from taichi_sph.verification.bench import measure\nprint(measure(100_000, 'cpu', None, 'f64')['best_node_steps_per_second'])",
    "metal": "from taichi_sph.verification.bench import measure\n"
    "print(measure(40_000, 'cpu', None, 'f64', metal=True)['best_node_steps_per_second'])",
    "fluid": "from taichi_sph.verification.bench import measure_fluid\n"
    "print(measure_fluid(100_000, 'cpu', None, 'f64')['best_particle_steps_per_second'])",
    "tank": "import time\n"
    "from taichi_sph.scene.script import load_scene\n"
    "from taichi_sph.world.world import World\n"
    "world = World(load_scene('scenes/tank_leak.py', {'quality': 'draft'}))\n"
    "world.advance(20)\n"
    "began = time.perf_counter()\n"
    "world.advance(250)\n"
    "print(250 * world.n_nodes / (time.perf_counter() - began))",
}


def rate(tree: Path, kind: str) -> float:
    """Node-steps per second (or particle-steps) of one process that runs the code of a checkout."""
    env = {**os.environ, "PYTHONPATH": str(tree)}
    run = subprocess.run([sys.executable, "-c", KINDS[kind]], cwd=tree, env=env, capture_output=True, text=True)
    if run.returncode:
        sys.exit(f"{kind} in {tree}: {run.stderr.strip().splitlines()[-1]}")
    return float(run.stdout.split()[-1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--only", default=",".join(KINDS))
    options = parser.parse_args()
    trees = [options.old.resolve(), options.new.resolve()]
    print("| what | old, M/s | new, M/s | new / old | least | largest |\n| --- | --- | --- | --- | --- | --- |", flush=True)
    for kind in options.only.split(","):
        pairs = [[rate(tree, kind) for tree in trees] for _ in range(options.runs)]
        ratios = [new / old for old, new in pairs]
        old, new = (statistics.median(side) / 1e6 for side in zip(*pairs))
        print(f"| {kind} | {old:.3f} | {new:.3f} | {statistics.median(ratios):.3f} | {min(ratios):.3f} | {max(ratios):.3f} |", flush=True)


if __name__ == "__main__":
    main()
