"""Every kernel of the core runs in some scene: none is dead, none escapes these tests."""

import ast
from pathlib import Path

from taichi.lang.kernel_impl import Kernel

from taichi_sph.scene import Box, PrescribedVelocity, Static, SurfacePressure

from ..plates import SIDE, plate_scene, start, tearing

PACKAGE = Path(__file__).parents[2] / "taichi_sph"
PARTS = ("numerics", "model", "laws", "forces", "solver")
ELSEWHERE = {"numerics.triad"}  # the benchmark's own


def kernels() -> set[str]:
    """module.function of everything decorated with ti.kernel."""
    found = set()
    for part in PARTS:
        for path in (PACKAGE / part).glob("*.py"):
            if f"{part}.{path.stem}" in ELSEWHERE:
                continue
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.FunctionDef) and any(ast.unparse(d) == "ti.kernel" for d in node.decorator_list):
                    found.add(f"{part}.{path.stem}.{node.name}")
    return found


def test_every_kernel_is_exercised(monkeypatch):
    run = set()
    launch = Kernel.__call__

    def recorded(self, *args, **kwargs):
        run.add(f"{self.func.__module__.removeprefix('taichi_sph.')}.{self.func.__name__}")
        return launch(self, *args, **kwargs)

    monkeypatch.setattr(Kernel, "__call__", recorded)
    for kind in ("galerkin", "collocation"):
        sim = start(tearing(kind, cells="quad", irregularity=0.0))
        sim.advance_to(6e-6)
        assert sim.status()["broken"] > 0
        sim.energies()
        sim.restore(sim.state())
    held = PrescribedVelocity(shell="plate", where=Box(hi=(0.1 * SIDE, None, None)), velocity=(0, 0, 0), spin=(0, 0, 0))
    pushed = SurfacePressure(shell="plate", value=1e4)
    bent = start(plate_scene(motion="free", motions=[held], pressures=[pushed], static=Static(residual=1e-2)))
    bent.advance(1)
    assert kernels() - run == set()
