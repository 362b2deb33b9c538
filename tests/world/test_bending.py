"""Bent shells at work: equilibrium against theory, frequencies, follower pressure, spinning, extremes, buckling."""

import math

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.errors import SceneError
from taichi_sph.scene import (
    Box,
    Galerkin,
    Material,
    Modes,
    NodalForce,
    NodalMoment,
    Numerics,
    Plate,
    PrescribedVelocity,
    Ramp,
    Scene,
    Shell,
    Static,
    StepLimit,
    SurfacePressure,
    load_scene,
)
from taichi_sph.scene.supports import Edge, clamped, held

from ..shells import forces, of_nodes, shell_scene, spin, start, turned
from . import ritz

ROOT = __import__("pathlib").Path(__file__).resolve().parents[2]


def plate(n=10, e=0.01, *, load, clamp=True, **more):
    """A square plate, clamped all round, brought to equilibrium; the displacement of the middle."""
    edges = [[clamped(a, 0.0, "above"), clamped(a, 1.0, "below")] for a in "xy"]
    scene = shell_scene(
        "flat", n=n, thickness=e, duration=1.0, static=Static(residual=1e-6), motions=held("shell", 1.0 / n, *edges), **load, **more
    )
    sim = start(scene)
    sim.advance(1)
    X, u = sim.shell.mesh.points, of_nodes(sim, "u")
    return sim, u[np.argmin(np.linalg.norm(X - [0.5, 0.5, 0], axis=1))]


def rigidity(e, nu=0.3):
    return 210e9 * e**3 / 12 / (1 - nu**2)


@pytest.mark.parametrize("e", [0.1, 1e-4])
def test_clamped_plate_does_not_lock(e):
    """A3, coarse: within 5 % on 10 x 10 cells from e/L = 0.1 to 1e-4."""
    small = 1e-4 * e
    q = small * rigidity(e) / ritz.clamped_deflection(e)
    sim, middle = plate(e=e, load={"pressures": [SurfacePressure(shell="shell", value=q, kind="dead")]}, irregularity=0.0)
    assert middle[2] / small == pytest.approx(1.0, abs=0.05)
    assert sim.status()["residual"] < 1e-6


@pytest.mark.long
def test_gravity_pressure_and_nodal_forces_agree():
    e, q = 0.02, 1.0
    loads = [
        {"pressures": [SurfacePressure(shell="shell", value=q, kind="dead")]},
        {"pressures": [SurfacePressure(shell="shell", value=q)]},
        {"gravity": (0, 0, q / (e * 7800))},
        {"forces": [NodalForce(shell="shell", where=Box(), total=(0, 0, q))]},
    ]
    found = [plate(e=e, load=load)[1][2] for load in loads]
    assert found == pytest.approx([found[0]] * 4, rel=0.02)


@pytest.mark.long
def test_supported_and_free_frequencies():
    """A8, coarse: within 6 % on 12 x 12 cells."""
    n, e = 12, 0.01
    scale = math.sqrt(rigidity(e) / (7800 * e)) / (2 * math.pi)
    x, y = (0, None, None), (None, 0, None)
    up = (None, None, 0)
    sides = [Edge("x", 0.0, "above", up, x), Edge("x", 1.0, "below", up, x)]
    ends = [Edge("y", 0.0, "above", up, y), Edge("y", 1.0, "below", up, y)]
    for motions, wanted in (((), ritz.free_frequencies(e)), (held("shell", 1.0 / n, sides, ends), ritz.supported_frequencies(e))):
        sim = start(shell_scene("flat", n=n, thickness=e, duration=6.0, modes=Modes(count=6), motions=motions))
        assert sim.instead.frequency / scale == pytest.approx(wanted, rel=0.06)
        sim.advance(6)
        assert sim.status()["mode"] == 6
        assert sim.status()["frequency"] == pytest.approx(sim.instead.frequency[-1])


def test_reference_of_the_pinched_cylinder():
    """The series gives the classical value for a thin shell and a true point force, and the scene's for what it computes."""
    for load, series in (("point", ritz.pinched_cylinder(0.0, shear=1e5)), ("spread", ritz.pinched_cylinder(30.0))):
        scene = load_scene(ROOT / "scenes" / "pinched_cylinder.py", {"load": load, "nodes": "regular", "cells": "quad"})
        assert -scene.quantities[0].options["reference"] == pytest.approx(series, rel=3e-3 if load == "point" else 1e-5)


@pytest.mark.parametrize("thickness, nu", [(1e-3, 0.0), (0.1, 0.49), (1.0, 0.3), (10.0, 0.499)])
@pytest.mark.long
def test_predicted_step_is_at_the_limit(thickness, nu):
    """A9: never above, at most 10 % below."""
    n = 8
    scene = shell_scene("flat", n=n, thickness=min(thickness / n, 1.0), material={"poisson": nu}, duration=1.0, limit=StepLimit())
    sim = start(scene)
    sim.advance(1)
    ratio = sim.status()["ratio"]
    assert 0.9 < ratio <= 1.0


@pytest.mark.long
def test_follower_pressure_does_the_work_that_is_stored():
    """The ledger of a plate blown up by a pressure that turns with it, far into large deflections."""
    sim, middle = plate(e=0.01, load={"pressures": [SurfacePressure(shell="shell", value=2e6, history=Ramp(rise=1.0))]})
    assert middle[2] > 1.0 * 0.01  # beyond the thickness
    many = shell_scene(
        "flat", n=10, thickness=0.01, duration=1.0, static=Static(increments=12, residual=1e-6), motions=sim.scene.motions,
        pressures=[SurfacePressure(shell="shell", value=2e6, history=Ramp(rise=1.0))],
    )  # fmt: skip
    fine = start(many)
    fine.advance(12)
    energies = fine.energies()
    assert energies["external"] == pytest.approx(energies["elastic"], rel=0.01)  # trapezoidal over the increments


def test_a_dynamic_pressure_closes_the_balance():
    edges = [[clamped(a, 0.0, "above"), clamped(a, 1.0, "below")] for a in "xy"]
    sim = start(
        shell_scene(
            "flat",
            thickness=0.01,
            duration=4e-3,
            motions=held("shell", 0.125, *edges),
            pressures=[SurfacePressure(shell="shell", value=1e5)],
            safety=0.3,
        )
    )
    sim.advance_to(4e-3)
    energies = sim.energies()
    assert energies["external"] > 0
    assert abs(energies["closed_residual_percent"]) < 0.1


def test_an_end_moment_bends_a_strip_to_an_arc():
    """A4, coarse: an eighth of a circle."""
    length, n, e = 1.0, 12, 0.05
    width, angle = 2 / n, math.pi / 4
    moment = 210e9 * width * e**3 / 12 * angle / length
    tip = Box(lo=(length - 0.25 / n, None, None))
    sim = start(
        Scene(
            name="strip",
            title="strip",
            source="tests",
            shells=[
                Shell(
                    name="s",
                    surface=Plate(length=length, width=width),
                    thickness=e,
                    material=Material(name="m", young=210e9, poisson=0.0, density=7800),
                    motion="free",
                )
            ],
            motions=held("s", 1 / n, [clamped("x", 0.0, "above")]),
            moments=[NodalMoment(shell="s", where=tip, total=(0, -moment, 0), history=Ramp(rise=1.0))],
            duration=1.0,
            static=Static(increments=2, residual=1e-5),
            numerics=Numerics(spacing=1 / n),
        )
    )
    sim.advance(2)
    X, u = sim.shell.mesh.points, of_nodes(sim, "u")
    place = (X + u)[X[:, 0] > length - 0.1 / n].mean(axis=0)
    wanted = [length * math.sin(angle) / angle, width / 2, length * (1 - math.cos(angle)) / angle]
    assert place == pytest.approx(wanted, abs=0.02 * length)
    assert sim.energies()["external"] == pytest.approx(0.5 * moment * angle, rel=0.03)


@pytest.mark.long
def test_a_held_spin_leaves_no_drilling():
    """Where a director leans out of the plane in which it is held, nothing turns it about itself."""
    roof = load_scene(ROOT / "scenes" / "scordelis_lo.py", {"nodes": "irregular", "quality": "standard"})
    sim = start(roof)
    sim.advance(1)
    assert sim.step < 10_000  # 150 000 with the drilling left in
    omega, n = of_nodes(sim, "omega"), of_nodes(sim, "N") + of_nodes(sim, "d")
    assert np.abs(np.einsum("ni,ni->n", omega, n)).max() < 1e-9 * max(np.abs(omega).max(), 1e-300) + 1e-20


@pytest.mark.parametrize("surface", ["flat", "curved"])
@pytest.mark.long
def test_a_hundred_turns_at_speed(surface):
    """A2 in time: a free shell that turns 100 times: energy, momentum and its angular momentum stay."""
    n, e, speed = 4, 0.1, 600.0
    omega = speed * np.array([0.2, 0.3, 1.0]) / np.linalg.norm([0.2, 0.3, 1.0])
    turns = 100
    sim = start(shell_scene(surface, n=n, thickness=e, irregularity=0.2, duration=turns * 2 * math.pi / speed))
    spin(sim, omega, (3.0, -1.0, 2.0))
    mass = runtime.get(sim.shell.nodes.mass, sim.shell.nodes.n).astype(float)

    def momenta():
        v, x = of_nodes(sim, "v"), sim.shell.mesh.points + of_nodes(sim, "u")
        w, inertia = of_nodes(sim, "omega"), runtime.get(sim.shell.nodes.inertia, sim.shell.nodes.n).astype(float)
        return mass @ v, (mass[:, None] * np.cross(x, v)).sum(axis=0) + inertia @ w

    sim.advance(50)
    linear, angular = momenta()
    energy = sum(sim.energies()[k] for k in ("kinetic", "elastic"))
    sim.advance(sim.steps_left)
    after, angular_after = momenta()
    energies = sim.energies()
    assert after == pytest.approx(linear, rel=1e-9, abs=1e-9 * np.abs(linear).max())
    assert energies["kinetic"] + energies["elastic"] == pytest.approx(energy, rel=1e-3)
    assert np.linalg.norm(angular_after - angular) < 0.01 * np.linalg.norm(angular)


EXTREMES = {
    "very thin": {"thickness": 1e-4 / 8},
    "very thick": {"thickness": 1.0, "n": 10},
    "incompressible": {"material": {"poisson": 0.499}},
    "one cell": {"n": 1},
    "two cells": {"n": 2},
    "one row": {"surface": Plate(length=1.0, width=0.125)},
    "two rows": {"surface": Plate(length=1.0, width=0.25)},
    "single precision": {"precision": "f32"},
}


@pytest.mark.parametrize("name", EXTREMES)
@pytest.mark.parametrize("cells", ["quad", "triangle"])
@pytest.mark.long
def test_extremes_stay_bounded(name, cells):
    """Shaken at up to 1 m/s for 400 steps without any load: no energy appears."""
    options = dict(EXTREMES[name])
    sim = start(shell_scene(options.pop("surface", "flat"), cells=cells, duration=1.0, **options))
    rng = np.random.default_rng(4)
    v = min(1.0, 20 * sim.shell.thickness) * rng.standard_normal((sim.shell.nodes.n, 3))
    runtime.put(sim.shell.nodes.v, v.astype(runtime.get(sim.shell.nodes.v, sim.shell.nodes.n).dtype))
    sim.advance(1)
    first = sim.energies()
    sim.advance(400)
    last = sim.energies()
    total = first["kinetic"] + first["elastic"]
    assert last["kinetic"] + last["elastic"] == pytest.approx(total, rel=2e-2)


@pytest.mark.long
def test_a_hole_stays_bounded(tmp_path):
    """A plate with a hole, from a mesh file: no load, no energy; its free inner edge pulls at nothing when it turns."""
    import meshio
    from scipy.spatial.transform import Rotation

    from taichi_sph.scene import MeshFile

    n = 8
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij")
    number = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1)
    ring = np.ones((n, n), bool)
    ring[3:5, 3:5] = False
    quads = quads[ring]
    used, cells = np.unique(quads, return_inverse=True)
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)[used] / n
    meshio.write(tmp_path / "hole.vtu", meshio.Mesh(points, [("quad", cells.reshape(-1, 4))]))
    scene = shell_scene("flat", duration=1.0)
    shell = scene.shells[0].model_copy(update={"surface": MeshFile(path=tmp_path / "hole.vtu")})
    sim = start(scene.model_copy(update={"shells": (shell,)}))
    assert sim.shell.nodes.n == 80 and sim.shell.cells.n == 60
    f, couple, energy = forces(sim, *turned(sim, Rotation.from_rotvec([1.0, 0.4, -2.0]), (1.0, 0.0, 0.0)))
    assert np.abs(f).max() < 1e-11 * 210e9 * 0.05 and energy < 1e-22 * 210e9 * 0.05
    runtime.put(sim.shell.nodes.d, 0 * of_nodes(sim, "d"))
    runtime.put(sim.shell.nodes.u, 0 * of_nodes(sim, "u"))
    runtime.put(sim.shell.nodes.v, np.random.default_rng(4).standard_normal((80, 3)))
    sim.advance(1)
    first = sim.energies()
    sim.advance(400)
    last = sim.energies()
    assert last["kinetic"] + last["elastic"] == pytest.approx(first["kinetic"] + first["elastic"], rel=2e-2)


def test_a_single_node_is_refused(tmp_path):
    import meshio

    from taichi_sph.run.plan import plan
    from taichi_sph.scene import MeshFile

    meshio.write(tmp_path / "node.vtu", meshio.Mesh(np.zeros((1, 3)), [("vertex", np.array([[0]]))]))
    scene = shell_scene("flat")
    shell = scene.shells[0].model_copy(update={"surface": MeshFile(path=tmp_path / "node.vtu")})
    with pytest.raises(SceneError):
        plan(scene.model_copy(update={"shells": (shell,)}))


@pytest.mark.long
def test_tension_to_half_its_length_again():
    """50 % of nominal strain, dynamically: no instability of particles pulled apart."""
    n = 8
    ends = [
        PrescribedVelocity(shell="shell", where=Box(hi=(0.01, None, None)), velocity=(-25.0, None, None)),
        PrescribedVelocity(shell="shell", where=Box(lo=(0.99, None, None)), velocity=(25.0, None, None)),
    ]
    sim = start(shell_scene("flat", n=n, thickness=0.02, duration=0.01, motions=ends))
    first = sim.dt
    while sim.time < 0.01 * (1 - 1e-9):  # the step is shortened on the way: a stretched shell is stiffer
        sim.advance_to(0.01)
    assert sim.dt < 0.8 * first
    x = sim.shell.mesh.points + of_nodes(sim, "u")
    assert np.ptp(x[:, 0]) == pytest.approx(1.5, rel=0.01)
    assert np.abs(x[:, 2]).max() < 1e-6
    inner = np.abs(sim.shell.mesh.points[:, 0] - 0.5) < 0.3
    assert np.abs(of_nodes(sim, "v")[inner, 0]).max() < 40.0
    assert abs(sim.energies()["closed_residual_percent"]) < 1.0


@pytest.mark.long
def test_compression_beyond_buckling():
    """A thin strip, nudged and shortened by 10 %, bows out far and stays whole; a straight Euler column would not."""
    n, e = 10, 0.01
    ends = [
        PrescribedVelocity(shell="shell", where=Box(hi=(0.01, None, None)), velocity=(2.0, 0, 0), spin=(0, 0, 0)),
        PrescribedVelocity(shell="shell", where=Box(lo=(0.99, None, None)), velocity=(-2.0, 0, 0), spin=(0, 0, 0)),
    ]
    sim = start(
        shell_scene(
            "flat",
            n=n,
            thickness=e,
            duration=0.025,
            motions=ends,
            forces=[NodalForce(shell="shell", where=Box(lo=(0.4, None, None), hi=(0.6, None, None)), total=(0, 0, 100.0))],
        )
    )
    sim.advance_to(0.025)
    x = sim.shell.mesh.points + of_nodes(sim, "u")
    assert np.isfinite(x).all()
    # the arc of a clamped column shortened by s: height 2/pi sqrt(s L); inertia may add half as much again
    height = 2 / math.pi * math.sqrt(0.1)
    assert 0.5 * height < np.abs(x[:, 2]).max() < 2 * height
    assert abs(sim.energies()["closed_residual_percent"]) < 4.0  # of the second order in dt: 0.1 at a fifth of the step


def test_a_sliver_is_refused(tmp_path):
    """A triangle without area among others."""
    import meshio

    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0.5, 1e-14, 0]], float)
    meshio.write(tmp_path / "sliver.vtu", meshio.Mesh(points, [("triangle", np.array([[0, 1, 4], [0, 4, 2], [4, 3, 2], [4, 1, 3]]))]))
    from taichi_sph.run.plan import plan
    from taichi_sph.scene import MeshFile

    scene = shell_scene("flat").model_copy(
        update={"shells": (shell_scene("flat").shells[0].model_copy(update={"surface": MeshFile(path=tmp_path / "sliver.vtu")}),)}
    )
    with pytest.raises(SceneError):
        plan(scene)


def test_settings_keep_their_default():
    """What the figures of these tests were measured with."""
    assert Galerkin().shear_bound == 0.1 and Galerkin().stabilisation == 0.2
