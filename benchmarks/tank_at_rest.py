"""A sound tank, full of water, at rest under gravity: how many particles does it lose in 1e5 steps?

    python benchmarks/tank_at_rest.py [STEPS]

A steel can of 60 x 80 mm, free but for its bottom. Prints and writes benchmarks/tank_at_rest.json: particles lost, largest speed,
closed residual of the ledger, seconds.
"""

import json
import sys
import time
from pathlib import Path

from taichi_sph.scene import Box, Cylinder, Fluid, Material, Numerics, PrescribedVelocity, Scene, Shell, ShellFill
from taichi_sph.world.world import World


def tank() -> Scene:
    steel = Material(name="steel", young=210e9, poisson=0.3, density=7800)
    return Scene(
        name="tank_at_rest",
        title="A full tank at rest",
        source="benchmarks",
        shells=[Shell(name="can", surface=Cylinder(radius=0.03, length=0.08, ends="discs"), thickness=1e-3, material=steel, motion="free")],
        fluids=[Fluid(name="water", fill=ShellFill(shell="can"))],
        motions=[PrescribedVelocity(shell="can", where=Box(hi=(None, None, 1e-3)), velocity=(0, 0, 0), spin=(0, 0, 0))],
        gravity=(0, 0, -9.81),
        duration=1.0,
        numerics=Numerics(spacing=0.01),
    )


def main(steps: int) -> dict:
    sim = World(tank(), threads=1)  # so small that a second thread only waits
    began = time.perf_counter()
    while sim.step < steps:
        sim.advance(min(500, steps - sim.step))
    found = {
        "steps": sim.step,
        "time_s": sim.time,
        "particles": sim.fluid.p.n,
        "lost": int(sim.tracks()["leak"]["escaped_count"]),
        "fastest_m_per_s": sim.fluid.fastest(),
        "closed_residual_percent": sim.energies()["closed_residual_percent"],
        "seconds": time.perf_counter() - began,
    }
    print(json.dumps(found, indent=2))
    return found


if __name__ == "__main__":
    result = main(int(float(sys.argv[1])) if len(sys.argv) > 1 else 100_000)
    Path(__file__).with_suffix(".json").write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
