"""Every kernel of the core runs in some scene: none is dead, none escapes these tests."""

import ast
from pathlib import Path

import pytest
from taichi.lang.kernel_impl import Kernel

from taichi_sph.scene import (
    Box,
    Cut,
    Cylinder,
    Fluid,
    LemaitreChaboche,
    Meeting,
    NodalForce,
    Numerics,
    Perfect,
    Pinball,
    PrescribedVelocity,
    Rigid,
    Scene,
    Shell,
    ShellFill,
    Spring,
    Static,
    SurfacePressure,
    material,
)

from ..plates import CELLS, SIDE, plate_scene, start, tearing
from ..scene.examples import everything, more

PACKAGE = Path(__file__).parents[2] / "taichi_sph"
ELSEWHERE = {"numerics.triad"}  # the benchmark's own
ELSEWHERE_TOO = {
    *("numerics.cells._buckets", "numerics.neighbours._cells"),  # of devices without serial kernels: tests/numerics/test_doubles.py
    *(f"bodies.masses.{name}" for name in ("_look", "_offer", "_take")),  # of kinds that are brought along: tests/world/test_toy_kind.py
    *(f"couplings.contact.multipliers.{name}" for name in ("_iterate", "_error")),  # of long lists of pairs: tests/contact/test_friction.py
    "bodies.solid.port._take",  # of solids that are struck: tests/contact/test_solids.py
    "bodies.solid.forces.stiffest",  # of the stable step of solids: tests/solid/test_motion.py
    *(  # of finer water: tests/fluid/test_finer.py
        *(f"numerics.neighbours.{name}" for name in ("_cells_sized", "_build_sized")),
        *(f"bodies.fluid.{name}" for name in ("packing._uneven", "packing._settle", "port._resize")),
        *(f"bodies.shell.finer_surface.{name}" for name in ("_lay", "_bear")),
    ),
    *(
        f"couplings.{name}" for name in ("drag.law._act", "drag.law._share", "wetted.wetted._hide")
    ),  # of drag by a law: tests/fluid/test_drag.py
}


def kernels() -> set[str]:
    """module.function of everything decorated with ti.kernel."""
    found = set()
    for path in PACKAGE.rglob("*.py"):
        module = ".".join(path.relative_to(PACKAGE).with_suffix("").parts)
        if module in ELSEWHERE:
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and any(ast.unparse(d) == "ti.kernel" for d in node.decorator_list):
                found.add(f"{module}.{node.name}")
    assert len(found) > 50
    return found


@pytest.mark.long
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
    bent = start(plate_scene(motion="free", motions=[held], pressures=[pushed], static=Static(residual=1e-2, method="relaxation")))
    bent.advance(1)
    start(plate_scene(material={"strength": Perfect(yield_stress=1e6)})).advance(20)
    ductile = LemaitreChaboche(threshold=0.0, rupture=0.1, critical=0.2, spread=True)
    start(plate_scene(material={"strength": Perfect(yield_stress=1e6), "damage": ductile})).advance(2)
    thesis = {"kind": "collocation", "selective_shear": True}
    middle = Cut(start=(0.5 * SIDE, 0, 0), end=(0.5 * SIDE, 0.3 * SIDE, 0))
    start(plate_scene(motion="free", formulation=thesis, cuts=[middle])).advance(1)
    # a cut in the wall of a can: directors that leave something across, and references made anew
    can = Cylinder(radius=1, length=1.2, ends="discs")
    concrete = plate_scene(brittle=True).shells[0].material
    cut = Cut(start=(1, 0, 0.5), end=(1, 0, 0.8))
    shell = Shell(name="can", surface=can, thickness=0.05, material=concrete, motion="free", cuts=[cut])
    numerics = Numerics(spacing=0.2, irregularity=0.2)
    sim = start(Scene(name="can", title="", source="tests", shells=[shell], duration=1e-3, numerics=numerics))
    assert 0 < len(sim.shell.cut_cells) < 10
    # all bodies at once: a can that meets itself, full of water, and a striker
    bullet = Rigid(name="bullet", mass=0.03, pinballs=[Pinball(centre=(0.0605, 0, 0.1), radius=0.009)], velocity=(-300.0, 0, 0))
    can = Cylinder(radius=0.05, length=0.2, ends="discs")
    shell = Shell(name="can", surface=can, thickness=1e-3, material=material("steel, tank"), motion="free", self_contact=True)
    full = Scene(
        name="full", title="", source="tests", shells=[shell], rigids=[bullet, bullet.model_copy(update={"name": "other", "pinballs":
        (Pinball(centre=(0.09, 0, 0.1), radius=0.009),)})], fluids=[Fluid(name="water", fill=ShellFill(shell="can"))],
        duration=1e-4, numerics=Numerics(spacing=0.0125),
    )  # fmt: skip
    sim = start(full)
    sim.advance(20)
    sim.restore(sim.state())
    sim.energies(), sim.frame()
    # two plates, one with a step of its own, joined by a spring
    plate = plate_scene(motion="free").shells[0]
    shells = [plate, plate.model_copy(update={"name": "slow", "every": 2})]
    spring = Spring(name="s", between=("plate", "slow"), points=((0, 0, 0), (SIDE, 0, 0)), stiffness=1e5)
    joined = Scene(
        name="two", title="", source="tests", shells=shells, springs=[spring], duration=1e-4,
        forces=[NodalForce(body="slow", where=Box(), total=(0, 0, 1.0))], meetings=[Meeting(between=("plate", "slow"), meet=False)],
        numerics=Numerics(spacing=SIDE / CELLS),
    )  # fmt: skip
    start(joined).advance(3)
    elements = {"shells": [plate], "springs": [], "meetings": [], "forces": [], "numerics.formulation": {"kind": "elements", "points": 1}}
    start(joined.derive(pressures=[SurfacePressure(shell="plate", value=1e4)], **elements)).advance(3)
    # elements and particles in one shell, solids, welds, gas, rigid surfaces, friction
    for told in (everything(), more()):
        sim = start(Scene.model_validate(told))
        sim.advance(5)
        sim.restore(sim.state())
        sim.energies(), sim.frame()
    assert kernels() - run == ELSEWHERE_TOO
