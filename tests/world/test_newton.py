"""Statics by Newton's method: the tangent against the forces, roofs that snap through, and searches that stop and go on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from taichi_sph import runtime
from taichi_sph.bodies.shell.instead import newton
from taichi_sph.bodies.shell.instead.freedom import freedom
from taichi_sph.bodies.shell.pressure import LEAVE
from taichi_sph.bodies.shell_sph.tangent import Tangent
from taichi_sph.errors import RunStopped, SceneError
from taichi_sph.run import session
from taichi_sph.scene import Box, Cylinder, NodalForce, Plate, Ramp, Static, SurfacePressure, load_scene
from taichi_sph.scene.supports import Edge, clamped, held

from ..shells import STEEL, along, of_nodes, pose, shell_scene, start

ROOT = Path(__file__).resolve().parents[2]
PRESSURE = 3e7


def roof(**settings):
    return load_scene(ROOT / "scenes" / "hinged_roof.py", {"numerics.spacing": 0.254 / 6, "output.frames": 1, **settings})


@pytest.mark.parametrize("surface", ["curved", Cylinder(radius=0.5, length=0.6, ends="discs")], ids=["panel", "can"])
def test_the_tangent_is_the_derivative_of_the_forces(surface):
    """Far from rest, under a pressure that follows and dead moments, with directors that may turn in their own ways; a can's rim turns."""
    n = 6
    edges = [[clamped("y", 0.0, "above")], [Edge("x", 0.7, "below", (None, 0, None), (0, None, None))]]
    motions = held("shell", 1 / n, *edges) if surface == "curved" else ()
    sim = start(shell_scene(surface, n=n, motions=motions, pressures=[SurfacePressure(shell="shell", value=PRESSURE)]))
    group, rng = sim.shell, np.random.default_rng(0)
    N, moments = of_nodes(sim, "N"), 1e4 * rng.standard_normal((group.nodes.n, 3))
    u = 0.1 * rng.standard_normal(N.shape)
    d = Rotation.from_rotvec(0.3 * rng.standard_normal(N.shape)).apply(N) - N
    tangent = Tangent(group)
    assert tangent.term.turns == (surface != "curved")
    stresses, free = tangent.stresses(u, d), freedom(group, N + d)
    K = tangent.matrix(u, d, stresses, np.full(group.cells.n, PRESSURE), free, moments)

    def felt(u, d, free):
        pose(sim, u, d)
        group.internal.strain(0.0)
        group.pressures.press(1.0, LEAVE)
        group.internal.force()
        couple = of_nodes(sim, "couple")
        assert -couple == pytest.approx(tangent.pull(u, d, tangent.stresses(u, d)), abs=1e-12 * np.abs(couple).max())
        both = np.concatenate([of_nodes(sim, "force"), couple + np.cross(moments, N + d)], axis=1)
        return free.gather(np.einsum("ncf,nc->nf", free.basis, both))

    step = rng.standard_normal(free.size)
    wanted = along(step, felt, free, u, d, N)
    assert K @ step == pytest.approx(wanted, abs=1e-6 * np.abs(wanted).max())


@pytest.mark.parametrize("thickness, limit, middle", [(12.7e-3, 0.7421, 11.293e-3), (6.35e-3, 0.1953, 12.892e-3)])
def test_a_hinged_roof_snaps_through(thickness, limit, middle):
    """Sze, Liu and Lo (2004), tables 9a and 9d: load and place at which the path turns; the thin roof snaps back, below zero."""
    sim = start(roof(thickness=thickness))
    loads, places = [0.0], [0.0]
    for _ in range(40):
        sim.advance(1)
        loads.append(sim.status()["load"])
        places.append(-sim.probes()["middle"]["u_z"])
    top = next(k for k in range(1, 40) if loads[k + 1] < loads[k])
    assert loads[top] == pytest.approx(limit, rel=0.03)
    assert places[top] == pytest.approx(middle, rel=0.12)  # between two points of the path
    assert (min(loads[top:]) < -0.08) == (thickness < 1e-2)
    energies = sim.energies()
    assert energies["external"] == pytest.approx(energies["elastic"], rel=0.03)  # trapezoidal from point to point
    assert sim.status()["relaxation_steps"] == 0


@pytest.mark.parametrize("method", [None, pytest.param("newton", marks=pytest.mark.long)])
def test_a_load_beyond_the_limit_is_reached_over_it(method):
    """By load, and by itself: the increment that passes the limit point ends behind it, where the path of the other test goes."""
    sim = start(roof(**{"static.method": method, "static.increments": 3}))
    sim.advance(3)
    assert sim.status()["path_points"] > 0 and sim.status()["relaxation_steps"] == 0
    assert sim.status()["load"] == 1.0 and sim.status()["residual"] < 1e-5 and not sim.status()["unstable"]
    assert sim.probes()["middle"]["u_z"] == pytest.approx(-29.2e-3, rel=0.01)


def test_a_slit_ring_stands_up():
    """Sze, Liu and Lo (2004), table 4: the lifted corner at a fifth and at all of the force. Coarse, so too soft."""
    sim = start(load_scene(ROOT / "scenes" / "slit_ring.py", {"increments": 5}))
    sim.advance(1)
    assert sim.probes()["B"]["u_z"] == pytest.approx(9.160, rel=0.05)
    sim.advance(4)
    found = [sim.probes()[name]["u_z"] for name in "AB"]
    assert found == pytest.approx([13.891, 17.528], rel=0.055)
    assert sim.status()["newton_steps"] < 60 and sim.status()["relaxation_steps"] == 0


def test_a_strip_that_buckles_is_found_aside():
    """1.62 times Euler's load, with a thousandth of it aside: in one step of load Newton's method stays straight, which is
    unstable, so the step is cut. Elastica: K(k) = pi/2 sqrt(1.62), the tip aside by 2 k / K."""
    cells = 12
    end = Box(lo=(1.0 - 0.25 / cells, None, None))
    thin, wide = 0.012 / cells, 4 / cells
    load = 4.0 * STEEL["young"] * wide * thin**3 / 12.0
    scene = shell_scene(
        Plate(length=1.0, width=wide), n=cells, thickness=thin, irregularity=0.0, material={"poisson": 0.0}, duration=1.0,
        motions=held("shell", 1 / cells, [clamped("x", 0.0, "above")]), static=Static(),
        forces=[NodalForce(shell="shell", where=end, total=(-load, 0.0, 1e-3 * load))],
    )  # fmt: skip
    sim = start(scene)
    sim.advance(1)
    found = sim.status()
    assert found["load"] == 1.0 and found["relaxation_steps"] == 0 and not found["unstable"]
    tip = of_nodes(sim, "u")[sim.shell.mesh.points[:, 0] > 1.0 - 1e-6].mean(axis=0)
    assert tip[2] == pytest.approx(0.8024, rel=0.03)


def test_a_fold_of_cells_is_no_equilibrium_of_the_shell():
    """A strip of 12 cells that is to roll up: beyond 171 degrees the row of nodes that bears the moment folds. Other cells find it."""
    sim = start(load_scene(ROOT / "scenes" / "cantilever.py", {"load": "moment", "slenderness": 1e-3, "turns": 0.5, "increments": 1}))
    with pytest.raises(RunStopped, match=r"beyond 0\.95\d* of the load, where neighbours have turned apart by \d\d degrees: take a finer"):
        sim.advance(1)
    assert sim.status()["load"] == pytest.approx(0.951, abs=0.005) and not sim.status()["unstable"]
    assert sim.status()["residual"] < 1e-5
    assert sim.energies()["external"] == pytest.approx(sim.energies()["elastic"], rel=0.1)


def pressed(**more):
    edges = [[clamped(a, 0.0, "above"), clamped(a, 1.0, "below")] for a in "xy"]
    load = [SurfacePressure(shell="shell", value=2e6, history=Ramp(rise=1.0))]
    return shell_scene("flat", n=8, thickness=0.01, duration=1.0, motions=held("shell", 1 / 8, *edges), pressures=load, **more)


@pytest.mark.long
def test_newton_and_relaxation_find_one_equilibrium():
    """A plate blown up far beyond its thickness by a pressure that turns with it."""
    found = []
    for method in ("newton", "relaxation"):
        sim = start(pressed(static=Static(residual=1e-7, method=method)))
        sim.advance(1)
        found.append(of_nodes(sim, "u"))
        steps = sim.status()["newton_steps"], sim.status()["relaxation_steps"]
        assert (steps[0] > 0, steps[1] > 0) == (method == "newton", method == "relaxation")
    assert np.abs(found[0][:, 2]).max() > 0.02
    assert found[0] == pytest.approx(found[1], abs=1e-5 * np.abs(found[1]).max())


@pytest.mark.long
def test_where_newton_finds_nothing_the_shell_is_relaxed(monkeypatch):
    monkeypatch.setattr(newton, "SHORTEST", 2.0)  # no step of load is short enough

    def nothing(*_):
        raise newton.Lost

    monkeypatch.setattr(newton.Path, "at", nothing)
    monkeypatch.setattr(newton.Path, "along", nothing)
    sim = start(pressed(static=Static(residual=1e-4)))
    sim.advance(1)
    assert sim.status()["relaxation_steps"] > 0 and sim.status()["residual"] < 1e-4
    stuck = start(pressed(static=Static(residual=1e-4, method="newton")))
    with pytest.raises(RunStopped, match="no equilibrium beyond 0 of the load"):
        stuck.advance(1)
    assert stuck.time == 0.0


def test_a_search_that_stopped_goes_on_with_another_limit(tmp_path):
    """It ends where one that was never stopped does; other keys, and other runs, are refused."""
    scene = pressed(static=Static(residual=1e-4, method="relaxation", max_steps=60))
    with pytest.raises(
        RunStopped, match="at load 1 after 60 steps; .*: follow the path with static.method = 'arc', or raise static.max_steps"
    ):
        session.run(scene, tmp_path / "run", pictures=False)
    with pytest.raises(SceneError, match="takes static.method, static.residual, static.max_steps"):
        session.resume(tmp_path / "run", pictures=False, settings={"static.increments": "3"})
    session.resume(tmp_path / "run", pictures=False, settings={"static.max_steps": "100000"})
    whole = session.run(pressed(static=Static(residual=1e-4, method="relaxation")), tmp_path / "whole", pictures=False)
    from taichi_sph.output.answer import answer
    from taichi_sph.output.folder import RunFolder

    with RunFolder(tmp_path / "run") as one, RunFolder(whole) as other:
        places = [run.the("shell", None).body(-1).points for run in (one, other)]
        assert one.scene.static.max_steps == 100_000
        assert any(line.startswith("Equilibrium by dynamic relaxation (") for line in answer(other))
    assert places[0] == pytest.approx(places[1], abs=1e-6)  # m; the middle rises by 0.03


def test_a_path_goes_on_bit_for_bit():
    """From a state in the middle of it."""
    scene = roof()
    sim = start(scene)
    sim.advance(4)
    state = sim.state()
    sim.advance(3)
    wanted = sim.state()
    again = start(scene)
    again.restore(state)
    again.advance(3)
    assert {k for k, v in again.state().items() if v.tobytes() != wanted[k].tobytes()} == set()


@pytest.mark.long
def test_a_body_that_stays_in_its_plane():
    """A body without directors: a strip that is pulled to 1.2 times its length, nu = 0."""
    end = NodalForce(shell="shell", where=Box(lo=(0.99, None, None)), total=(210e9 * 0.05 * 0.264, 0.0, 0.0))
    hold = [[Edge("x", 0.0, "above", (0, None, None))], [Edge("y", 0.0, "above", (None, 0, None))]]
    scene = shell_scene(
        "flat", n=6, duration=1.0, material={"poisson": 0.0}, motions=held("shell", 1 / 6, *hold), forces=[end],
        static=Static(method="newton", increments=2),
    )  # fmt: skip
    shell = scene.shells[0].model_copy(update={"motion": "in_plane"})
    motions = tuple(m.model_copy(update={"spin": (None, None, None)}) for m in scene.motions)
    sim = start(scene.model_copy(update={"shells": (shell,), "motions": motions}))
    sim.advance(2)
    u = runtime.get(sim.shell.nodes.u, sim.shell.nodes.n)
    # dead force F on the reference: F = E e b E11 l, E11 = (l^2 - 1) / 2; shares by node areas are not those of an even stress
    assert u[sim.shell.mesh.points[:, 0] > 0.99, 0].mean() == pytest.approx(0.2, rel=0.02)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"static.method": "newton", "numerics.formulation": "collocation"}, "'newton' needs a stiffness, and shell 'roof' is of the form"),
        ({"static.method": "newton", "numerics.precision": "f32"}, "needs numerics.precision = 'f64'; use that, or 'relaxation'"),
        ({"static.method": "arc", "static.increments": 2}, "'arc' makes so many points of a path, at least 3"),
        ({"static.method": "arc", "forces": []}, "'arc' follows the path of a load, and the scene has none"),
        (
            {"static.method": "arc", "forces.0.history": {"kind": "half_sine", "duration": 1.0}},
            "'arc' lets all loads grow in proportion; leave out forces[0].history (kind 'half_sine')",
        ),
        ({"static.method": "riks"}, "static.method = 'riks' is not allowed"),
    ],
)
def test_a_method_that_cannot_be_is_refused(settings, words):
    with pytest.raises(SceneError) as refused:
        roof().derive(**settings)
    assert words in str(refused.value)
