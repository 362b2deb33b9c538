"""The finite elements that the spectrum is compared with, the benchmark's scene, speeds remembered."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.geometry.mesh import plate
from taichi_sph.pool import Pool
from taichi_sph.run import speed
from taichi_sph.run.plan import plan
from taichi_sph.scene import Scene
from taichi_sph.scene.script import load_scene
from taichi_sph.verification.bench import TRAFFIC, exponent, plate_scene, step_bytes
from taichi_sph.verification.spectrum import _lowest, element_stiffness, square

from ..scene.examples import GOOD

SCENES = Path(__file__).parents[2] / "scenes"


@pytest.mark.parametrize("cells", ["triangle", "quad"])
@pytest.mark.parametrize("irregularity", [0.0, 0.2])
def test_elements_pass_the_patch_test(cells, irregularity):
    mesh = plate(1.0, 0.7, 0.1, cells, irregularity, seed=3)
    K = element_stiffness(mesh, 200.0, 0.3, 0.1)
    x, y = mesh.points[:, 0], mesh.points[:, 1]
    inner = (x > 0) & (x < 1) & (y > 0) & (y < 0.7)
    for field in ((1 + 0 * x, 0 * x), (-y, x)):  # rigid
        assert np.abs(K @ np.column_stack(field).ravel()).max() < 1e-12 * abs(K).max()
    u = np.column_stack([0.1 * x + 0.3 * y, 0.2 * y - 0.1 * x])
    assert np.abs((K @ u.ravel()).reshape(-1, 2)[inner]).max() < 1e-12 * abs(K).max()
    # 1/2 u K u = 1/2 sigma : eps A e, worked out by hand
    eps = np.array([0.1, 0.2, 0.2])
    C = 200 / (1 - 0.09) * np.array([[1, 0.3, 0], [0.3, 1, 0], [0, 0, 0.35]])
    assert u.ravel() @ (K @ u.ravel()) == pytest.approx(eps @ C @ eps * 0.7 * 0.1, rel=1e-12)


def test_the_lowest_frequency_of_a_long_bar():
    """Free bar: f = c / 2L; plane stress with nu = 0 is exactly one-dimensional."""
    mesh = plate(1.0, 0.02, 0.02, "quad")
    K = element_stiffness(mesh, 1e9, 0.0, 0.1)
    found = _lowest(K, mesh.node_areas * 0.1 * 1000, 30)
    c = np.sqrt(1e9 / 1000)
    assert np.abs(found - c / 2).min() < 1e-3 * c / 2


def test_square_has_no_loads():
    plain = square(Scene.model_validate(GOOD), 10)
    assert plan(plain).nodes == 121 and not plain.forces and not plain.motions and not plain.shells[0].cuts


def test_bench_scene_has_the_size_asked_for():
    for nodes in (1000, 17_200):
        assert plan(plate_scene(nodes)).nodes == pytest.approx(nodes, rel=0.1)


def test_bytes_are_counted_kernel_by_kernel():
    """Each field of 10 numbers of 8 bytes, in as many pools as their names say."""
    runtime.start("cpu", "f64", 1)
    pools: dict[str, Pool] = {}
    for name in {name for moved in TRAFFIC.values() for names in moved.values() for name in names}:
        pool, _, field = name.rpartition(".")
        pools.setdefault(pool, Pool(pool)).field(field, 10)
    assert step_bytes(pools.values()) == pytest.approx({kernel: 80 * (len(a["read"]) + len(a["write"])) for kernel, a in TRAFFIC.items()})


def test_cost_exponent():
    rows = [{"nodes": n, "node_steps_per_second": 1e6 * n ** (1 - 1.1)} for n in (1e3, 1e4, 1e5)]
    assert exponent(rows) == pytest.approx(1.1)


def test_what_runs_took_is_remembered_and_forgiven():
    """The same scene first, then one that has the same in it; a plan is right about what it was told."""
    scene = Scene.model_validate(GOOD)
    assert speed.recall(scene, "cpu") == speed.Costs()
    plain = plan(scene)
    took = {"advance": 3 * plain.seconds, "compile": 7.0, "write": 2 * plain.writing, "draw": 0.0}
    speed.remember(scene, "cpu", plain, took)
    learnt = plan(scene, speed.recall(scene, "cpu"))
    assert (learnt.seconds, learnt.compiling, learnt.writing) == pytest.approx((3 * plain.seconds, 7.0, 2 * plain.writing))
    assert learnt.drawing == plain.drawing  # there were no pictures
    assert learnt.total() == pytest.approx(speed.BEGIN + learnt.seconds + 7.0 + learnt.writing + learnt.drawing)
    assert learnt.total(pictures=False) == pytest.approx(learnt.total() - learnt.drawing)
    finer = scene.model_copy(update={"name": "another"})
    assert speed.recall(finer, "cpu").pace == pytest.approx(3) and speed.recall(scene, "cuda") == speed.Costs()
    speed.remember(finer, "cpu", plain, took | {"advance": 5 * plain.seconds})
    assert speed.recall(scene, "cpu").pace == pytest.approx(3)
    path = speed.cache_folder() / "seconds.json"
    for text in (
        "",
        "[]",
        '{"cpu": "fast"}',
        json.dumps({"cpu": {"pace": None}}),
        json.dumps(dict.fromkeys(speed._keys(scene, "cpu"), {"pace": -1})),
    ):
        path.write_text(text)
        assert speed.recall(scene, "cpu") == speed.Costs()


def test_what_is_in_a_scene_makes_it_dearer():
    """Metal, contact, and ties of elements and particles."""
    tank = SCENES / "empty_tank.py"
    alone, tied = (plan(load_scene(tank, {"coupled": coupled})) for coupled in (False, True))
    rates = {body.name: body.rate for body in alone.bodies}
    assert rates == {"tank": speed.RATE["metal"], "bullet": 0.0}
    assert tied.compiling > alone.compiling
    assert tied.seconds / tied.steps - speed.OVERLAP > speed.CONTACT
