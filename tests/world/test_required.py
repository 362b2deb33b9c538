"""Only what a scene requires: its fields, its kernels, and what a step of it launches."""

from collections import Counter
from pathlib import Path

import pytest

from taichi_sph import runtime
from taichi_sph.runtime import ti
from taichi_sph.scene import Collocation, Fluid, FluidBox, Material, Mazars, Numerics, Perfect, Pinball, Plate, Rigid, Scene, Shell, Water
from taichi_sph.scene.script import load_scene
from taichi_sph.world.world import World

SCENES = Path(__file__).parents[2] / "scenes"
STEPS = 4
STEEL = {"name": "steel", "young": "210 GPa", "poisson": 0.3, "density": 7800}
BENDING = {"nodes.N", "nodes.d", "nodes.omega", "nodes.couple", "nodes.inertia"}
PLASTIC = {"cells.plastic"}


def plate(motion="in_plane", material=None, rigid=False, formulation="galerkin", **more) -> Scene:
    striker = Rigid(name="striker", mass=0.01, pinballs=[Pinball(centre=(0.01, 0.005, 0.02), radius=2e-3)], velocity=(0, 0, -1.0))
    return Scene(
        name="plate", title="A plate", source="tests", duration="1 ms",
        shells=[
            Shell(
                name="plate", surface=Plate(length=0.02, width=0.01), thickness=1e-3, motion=motion,
                material=Material(**(material or STEEL)),
            )
        ],
        rigids=[striker] if rigid else [],
        numerics=Numerics(spacing=1e-3, formulation=formulation),
        **more,
    )  # fmt: skip


@pytest.fixture
def launches(monkeypatch):
    """Counts launched kernels by name."""
    counted: Counter[str] = Counter()
    kind = ti.lang.kernel_impl.Kernel
    whole = kind.launch_kernel

    def launch(self, compiled, *arguments):
        counted[f"{self.func.__module__.removeprefix('taichi_sph.')}.{self.func.__qualname__}"] += 1
        return whole(self, compiled, *arguments)

    monkeypatch.setattr(kind, "launch_kernel", launch)
    return counted


def stepped(scene: Scene, launches=None) -> tuple[set[str], set[str], Counter]:
    """Fields, kernels, and launches of STEPS steps in the middle of a run."""
    sim = World(scene, threads=1)
    for _ in range(STEPS):
        sim.advance(1)
    if launches is not None:
        launches.clear()
    sim.advance(STEPS)
    counted = Counter() if launches is None else Counter(launches)
    return set(runtime.current().fields), set(runtime.kernels()), counted


def heads(names: set[str]) -> set[str]:
    return {name.split(".")[0] for name in names}


def modules(kernels: set[str]) -> set[str]:
    return {name.rpartition(".")[0] for name in kernels}


# what has a part of its own, by the beginning of its fields and of its kernels
NEVER_FLAT = {
    "couplings.contact.",
    "bodies.rigid.",
    "bodies.fluid",
    "observers.leak",
    "bodies.shell.metal",
    "bodies.shell.pressure",
    "laws.",
}


def test_an_elastic_plate_in_its_plane_has_nothing_of_the_others():
    fields, kernels, _ = stepped(plate())
    assert not heads(fields) & {"contact", "rigid", "water", "fluid", "relax", "viscosity", "spin_filter", "selective", "filter"}
    assert not fields & (BENDING | PLASTIC)
    assert not [k for k in kernels if any(k.startswith(prefix) for prefix in NEVER_FLAT)]
    assert {
        "bodies.shell_sph.collocation",
        "bodies.shell_sph.viscosity",
        "bodies.shell_sph.spin_filter",
        "bodies.shell_sph.edge_filter",
    }.isdisjoint(modules(kernels))


PARTS = {
    "bending": (plate("free"), BENDING, "nodes", set()),
    # its laws stand inside the kernel of the cells, and only where the material yields
    "plasticity": (plate("free", {**STEEL, "strength": Perfect(yield_stress=2e8)}), PLASTIC | {"material.hardening"}, "cells", set()),
    "contact": (plate("free", rigid=True), {"rigid.x"}, "contact", {"couplings.contact.multipliers", "couplings.contact.pairs"}),
    "collocation": (
        plate("free", formulation=Collocation()),
        set(),
        "viscosity",
        {"bodies.shell_sph.viscosity", "bodies.shell_sph.spin_filter"},
    ),
}


@pytest.mark.long
@pytest.mark.parametrize("part", PARTS)
def test_a_part_is_there_exactly_where_it_is_asked_for(part):
    """The counterpart: the names that the test above looks for are those of the parts."""
    scene, own, head, files = PARTS[part]
    fields, kernels, _ = stepped(scene)
    assert own <= fields and head in heads(fields) and files <= modules(kernels)


@pytest.mark.long
@pytest.mark.parametrize("name", ["crack_branching", "beam_impact", "wave"])
def test_flat_scenes_of_the_library(name):
    options = {"quality": "draft", "duration": 1e-5} | ({"nodes": "regular", "formulation": "galerkin"} if name == "wave" else {})
    fields, kernels, _ = stepped(load_scene(SCENES / f"{name}.py", options))
    assert not fields & (BENDING | PLASTIC) and not heads(fields) & {"contact", "rigid", "water", "relax"}
    assert not [k for k in kernels if any(k.startswith(prefix) for prefix in NEVER_FLAT)]


def test_water_alone_has_nothing_of_a_shell():
    pool = Fluid(name="pool", fill=FluidBox(lo=(0, 0, 0), hi=(0.05, 0.05, 0.05)), water=Water(sound=20))
    fields, kernels, _ = stepped(
        Scene(name="pool", title="A pool", source="tests", duration=0.1, fluids=[pool], numerics=Numerics(spacing=0.01))
    )
    assert not heads(fields) & {"nodes", "cells", "edges", "galerkin", "material", "contact", "rigid", "relax"}, heads(fields)
    assert not [
        k
        for k in kernels
        if k.startswith(
            (
                "bodies.shell_sph.galerkin",
                "bodies.shell.metal",
                "bodies.shell.stress",
                "couplings.contact.",
                "bodies.rigid.",
                "bodies.nodal.",
                "bodies.shell_sph.rupture",
            )
        )
    ]


STEP = {f"bodies.shell_sph.galerkin.{name}" for name in ("_row_values", "_edge_forces", "_node_forces")} | {
    "bodies.shell.stress.of_sound_cells",
    "bodies.nodal.motion.kick_and_drift",
}
STRIKER = {
    *(f"bodies.rigid.pool.{name}" for name in ("rest", "move")),
    "bodies.rigid.port._look",
    "bodies.shell.port._look",
    "couplings.contact.multipliers._wear",
    "couplings.contact.multipliers._book",
}


def per_step(counted: Counter) -> set[str]:
    """Kernels that every step launched, each once; the others look at the run now and then."""
    always = {name for name, count in counted.items() if count >= STEPS and not name.startswith(("numerics.reduce", "taichi."))}
    assert all(counted[name] == STEPS for name in always), counted
    return always


@pytest.mark.long
def test_a_step_costs_what_its_terms_cost(launches):
    """Launched per step: five kernels, whatever the material is and whether the plate bends; a striker that is far away
    six more, none of which looks at pairs."""
    brittle = {**STEEL, "damage": Mazars(threshold=0.1, A=1, B=100), "critical_damage": 0.9}
    for scene in (plate(), plate("free"), plate("free", {**STEEL, "strength": Perfect(yield_stress=2e8)}), plate(material=brittle)):
        assert per_step(stepped(scene, launches)[2]) == STEP
    assert per_step(stepped(plate("free", rigid=True), launches)[2]) == STEP | STRIKER
