"""Newton's method on finite elements: the tangent against the forces, equilibria in large rotation."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from taichi_sph.bodies.shell.instead.freedom import freedom
from taichi_sph.bodies.shell.pressure import LEAVE
from taichi_sph.bodies.shell_fe.tangent import Tangent
from taichi_sph.scene import SurfacePressure, load_scene
from taichi_sph.scene.supports import Edge, clamped, held

from ..shells import along, of_nodes, pose, shell_scene, start

SCENES = Path(__file__).parents[2] / "scenes"
PRESSURE = 3e7


@pytest.mark.parametrize("points, cells", [(4, "quad"), (1, "quad"), (4, "triangle")])
def test_the_tangent_is_the_derivative_of_the_forces(points, cells):
    """Far from rest, under pressures that follow and dead ones and dead moments, with directors that turn in their own ways."""
    n = 4
    edges = [[clamped("y", 0.0, "above")], [Edge("x", 0.7, "below", (None, 0, None), (0, None, None))]]
    loads = [SurfacePressure(shell="shell", value=PRESSURE), SurfacePressure(shell="shell", value=0.3 * PRESSURE, kind="dead")]
    said = shell_scene("curved", n=n, cells=cells, motions=held("shell", 1 / n, *edges), pressures=loads)
    sim = start(said.derive(**{"numerics.formulation": {"kind": "elements", "points": points}}))
    group, rng = sim.shell, np.random.default_rng(0)
    N, moments = of_nodes(sim, "N"), 1e4 * rng.standard_normal((group.nodes.n, 3))
    u = 0.1 * rng.standard_normal(N.shape)
    d = Rotation.from_rotvec(0.3 * rng.standard_normal(N.shape)).apply(N) - N
    tangent = Tangent(group)
    stresses, free = tangent.stresses(u, d), freedom(group, N + d)
    K = tangent.matrix(u, d, stresses, np.full(group.cells.n, PRESSURE), free, moments)

    def felt(u, d, free):
        pose(sim, u, d)
        group.internal.strain(0.0)
        group.internal.force()
        inner = of_nodes(sim, "force")
        group.internal.strain(0.0)
        group.pressures.press(1.0, LEAVE)
        group.internal.force()
        pressed = tangent.pressed(u, np.full(group.cells.n, PRESSURE), np.full(group.cells.n, 0.3 * PRESSURE))
        assert of_nodes(sim, "force") - inner == pytest.approx(pressed, abs=1e-9 * np.abs(inner).max())
        couple = of_nodes(sim, "couple")
        assert -couple == pytest.approx(tangent.pull(u, d, tangent.stresses(u, d)), abs=1e-12 * np.abs(couple).max())
        both = np.concatenate([of_nodes(sim, "force"), couple + np.cross(moments, N + d)], axis=1)
        return free.gather(np.einsum("ncf,nc->nf", free.basis, both))

    step = rng.standard_normal(free.size)
    wanted = along(step, felt, free, u, d, N)
    assert K @ step == pytest.approx(wanted, abs=1e-6 * np.abs(wanted).max())


@pytest.mark.long
@pytest.mark.parametrize("form", ["elements", "elements_1"])
def test_a_strip_rolls_up(form):
    """A4: an end moment bends 20 elements to half a circle. A full one of 12, 30 degrees from element to element, is 0.06 off."""
    settings = {"quality": "standard", "load": "moment", "nodes": "irregular", "formulation": form}
    said = load_scene(SCENES / "cantilever.py", settings)
    sim = start(said)
    sim.advance(12)
    assert sim.status()["relaxation_steps"] == 0
    options = said.quantities[0].options
    i = int(((sim.shell.mesh.points - [options["x"], options["y"], 0.0]) ** 2).sum(axis=1).argmin())
    tip = sim.shell.mesh.points[i] + of_nodes(sim, "u")[i]
    assert math.dist(tip, [options["to_x"], options["to_y"], options["to_z"]]) < 0.01


@pytest.mark.parametrize("form", ["elements", "elements_1"])
def test_a_hemisphere_finds_its_equilibrium(form):
    """Relaxation takes more than 60 000 steps here."""
    said = load_scene(SCENES / "hemisphere.py", {"nodes": "regular", "formulation": form})
    sim = start(said)
    sim.advance(1)
    i = int(((sim.shell.mesh.points - [10.0, 0.0, 0.0]) ** 2).sum(axis=1).argmin())
    assert of_nodes(sim, "u")[i, 0] / said.quantities[0].options["reference"] == pytest.approx(1.0, abs=0.01)
    assert sim.status()["relaxation_steps"] == 0
