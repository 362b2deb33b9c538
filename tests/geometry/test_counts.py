"""Sizes before anything exists: counts of nodes and particles, refusals at once and without memory."""

from __future__ import annotations

import time
import tracemalloc
from pathlib import Path

import pytest

from taichi_sph.bodies.fluid.count import count as particles
from taichi_sph.bodies.fluid.fill import fill_fluid
from taichi_sph.errors import SceneError
from taichi_sph.geometry.surfaces import count, generate, mesh_of
from taichi_sph.run.plan import plan
from taichi_sph.scene.script import load_scene
from taichi_sph.scene.surfaces import CappedTank, Cylinder, Disc, Plate, Roof, SpherePatch

from .test_surfaces import Numerics

SCENES = Path(__file__).parents[2] / "scenes"
SURFACES = [
    Plate(length=1, width=0.5),
    Disc(radius=1),
    Disc(radius=1, quarter=True),
    SpherePatch(radius=1, half_angle=0.7),
    Roof(radius=1, length=1, half_angle=0.5),
    Cylinder(radius=1, length=2),
    Cylinder(radius=1, length=2, angle=1.0),
    Cylinder(radius=1, length=2, ends="discs"),
    CappedTank(radius=1, length=2),
    CappedTank(radius=1, length=2, cap="flat"),
]


@pytest.mark.parametrize("surface", SURFACES, ids=lambda s: s.kind + "-quarter" * bool(getattr(s, "quarter", None)))
def test_nodes_are_counted(surface):
    for spacing in (0.3, 0.1, 0.03):
        assert count(surface, Numerics(spacing=spacing)) == len(generate(surface, Numerics(spacing=spacing)).points)
    fine = len(generate(surface, Numerics(spacing=0.0056)).points)  # above a thousand columns round a rim
    assert count(surface, Numerics(spacing=0.0056)) == pytest.approx(fine, rel=0.01)
    for spacing in (1e-5, 1e-50):
        assert count(surface, Numerics(spacing=spacing)) > 1e9


@pytest.mark.parametrize("name", ["tank_leak", "dam_break"])
def test_particles_are_counted(name):
    scene = load_scene(SCENES / f"{name}.py")
    fluid = scene.fluids[0]
    shell = next((s for s in scene.shells), None)
    true = len(fill_fluid(fluid, scene, {s.name: mesh_of(s, scene) for s in scene.shells}).points)
    found = particles(fluid, scene.numerics.spacing, shell.surface if shell else None, shell.thickness if shell else 0.0)
    assert found == pytest.approx(true, rel=0.05)


@pytest.mark.parametrize(
    ("name", "key", "value", "words"),
    [
        ("dam_break", "numerics.spacing", 1e-5, "gives fluid 'water' 7e+10 particles; at most 50 million are allowed"),
        ("tank_leak", "fluids.0.spacing", 5e-4, "fluids[0].spacing 500 um gives fluid 'water' 3.4e+08 particles"),
        ("tank_leak", "numerics.spacing", 1e-5, "at most 50 million are allowed"),
        ("crack_branching", "numerics.spacing", 1e-6, "at most 50 million are allowed"),
        ("dam_break", "duration", 1e9, "time steps"),
    ],
)
def test_what_is_too_large_is_refused_at_once(name, key, value, words):
    path = SCENES / f"{name}.py"
    load_scene(path)  # imports done
    tracemalloc.start()
    before = time.process_time()
    with pytest.raises(SceneError) as caught:
        plan(load_scene(path, {key: value}))
    assert words in str(caught.value) and "\n" not in str(caught.value)
    assert time.process_time() - before < 2.0 and tracemalloc.get_traced_memory()[1] < 100e6
    tracemalloc.stop()
