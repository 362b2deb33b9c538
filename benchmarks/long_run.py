"""A million steps of a small curved shell that flies, turns and rings, without a load: what drifts, in f64 and in f32?

At 0.85 of the limit of a linear body: from omega dt = sqrt(3), 0.866 of it, on, central differences feed the fastest
modes of a body that turns far (the third-order resonance of a nonlinear oscillator). At 0.9 this one bursts between
120 000 and 200 000 steps, at 600 rad/s.

    python benchmarks/long_run.py --out benchmarks/long_run.json
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np

from taichi_sph import runtime
from taichi_sph.errors import RunStopped
from taichi_sph.output.record import machine, versions
from taichi_sph.scene import Cylinder, Material, Numerics, Scene, Shell
from taichi_sph.world.world import World

SPIN = (120.0, 180.0, 600.0)  # rad/s
FLIGHT = (0.03, -0.01, 0.02)  # m/s; far away f32 would lose the digits that strains need
NOISE = 0.3  # m/s, on every node
SAFETY = 0.85


def shell(precision: str) -> Scene:
    """Four by four irregular cells of a steel pipe's wall."""
    return Scene(
        name="long_run",
        title="A small shell for a long time",
        source="energy and momentum of an elastic body without load stay",
        shells=[
            Shell(
                name="shell",
                surface=Cylinder(radius=0.7, length=1.0, axis="y", angle=1.4),
                thickness=0.05,
                material=Material(name="steel", young=210e9, poisson=0.3, density=7800),
                motion="free",
            )
        ],
        duration=1e2,
        numerics=Numerics(spacing=0.25, irregularity=0.2, precision=precision, time_step_safety=SAFETY),
    )


def run(precision: str, steps: int, looks: int = 50) -> dict:
    """Energy, momenta and where the mass centre is, against what they should be, every so many steps."""
    sim = World(shell(precision), threads=1)
    nodes, n = sim.shell.nodes, sim.shell.nodes.n

    def values(name: str) -> np.ndarray:
        return runtime.get(getattr(nodes, name), n).astype(np.float64)

    mass, inertia, X, N = values("mass"), values("inertia"), values("X"), values("N")
    v = np.array(FLIGHT) + np.cross(SPIN, X) + NOISE * np.random.default_rng(0).standard_normal((n, 3))
    omega = np.array(SPIN) - (N @ SPIN)[:, None] * N
    real = runtime.get(nodes.v, n).dtype
    runtime.put(nodes.v, v.astype(real))
    runtime.put(nodes.omega, omega.astype(real))

    def state() -> tuple[float, np.ndarray, np.ndarray]:
        energies = sim.energies()
        x, v = X + values("u"), values("v")
        return energies["kinetic"] + energies["elastic"], mass @ v, mass @ np.cross(x, v) + inertia @ values("omega")

    sim.advance(50)
    energy, linear, angular = state()
    began, rows, stopped = time.perf_counter(), [], None
    for _ in range(looks):
        try:
            sim.advance(steps // looks)
        except RunStopped as error:
            stopped = str(error)
            print(f"{precision} stopped after {sim.step} steps: {stopped}", flush=True)
            break
        e, p, h = state()
        rows.append(
            {
                "step": sim.step,
                "energy": e / energy - 1,
                "linear": float(np.linalg.norm(p - linear) / np.linalg.norm(linear)),
                "angular": float(np.linalg.norm(h - angular) / np.linalg.norm(angular)),
            }
        )
        r = rows[-1]
        print(f"{precision} {r['step']:8d} {r['energy']:12.2e} {r['linear']:12.2e} {r['angular']:12.2e}", flush=True)
    return {"nodes": n, "dt": sim.dt, "stopped": stopped, "turns": sim.time * float(np.linalg.norm(SPIN)) / (2 * np.pi),
            "seconds": time.perf_counter() - began, "drift": rows}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=1_000_000)
    parser.add_argument("--precision", choices=("f64", "f32"), help="only this one")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    print("real     step   energy - 1    linear momentum   angular (relative change)")
    kinds = (given.precision,) if given.precision else ("f64", "f32")
    content = {"machine": machine(), "versions": versions(), **{kind: run(kind, given.steps) for kind in kinds}}
    if given.out is not None:
        given.out.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
        print(f"written: {given.out}")


if __name__ == "__main__":
    main()
