"""Rupture inside of a patch and outside of it."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.couplings.arlequin.factor import factorised
from taichi_sph.errors import RunStopped
from taichi_sph.scene import Box, Delay, InitialVelocity, Mazars, load_scene
from taichi_sph.world import growth

from ..exact import restarts_exactly, same_state
from .scenes import of_nodes, patched, start, tied

ROOT = Path(__file__).parents[2]
CONCRETE = {
    "young": 32e9,
    "poisson": 0.2,
    "density": 2450.0,
    "damage": Mazars(threshold=8.5e-5, A=1, B=7300),
    "delay": Delay(a=10, tau_c=1e-6),
    "critical_damage": 0.99,
}


def torn_at(x: float, **more):
    """Two halves that fly apart from x on; keys of Patch."""
    pull = [
        InitialVelocity(body="shell", where=Box(lo=(x, None, None)), velocity=(3.0, 0, 0)),
        InitialVelocity(body="shell", where=Box(hi=(x, None, None)), velocity=(-3.0, 0, 0)),
    ]
    return patched(motion="in_plane", n=4, material=CONCRETE, initial=pull, duration=2e-3, **more)


def test_where_elements_would_break_the_run_stops():
    sim = start(torn_at(0.21))
    columns = sim.status().keys()
    with pytest.raises(RunStopped, match="its patch is too small: at .* an element would break .* let the patch reach .* farther"):
        sim.advance_to(2e-3)
    assert sim.overlap_report()["damage"] >= 0.5 and sim.status()["% of D_c outside of the patch"] >= 50
    assert sim.status().keys() == columns  # those of histories/progress.csv


@pytest.mark.long
def test_a_crack_near_the_overlap_changes_the_constraints():
    """It breaks two particles behind the overlap, whose constraints see it; velocities stay tied, and a restart is exact."""
    sim = start(torn_at(0.53))
    before = runtime.get(tied(sim).tie.coef, 200)
    steps = 0
    while not sim.status()["broken"] and steps < 400:
        sim.advance(4)
        steps += 4
    sim.advance(20)
    assert sim.status()["broken"] and (runtime.get(tied(sim).tie.coef, 200) != before).any()
    assert tied(sim).left()[0] < 1e-12
    assert sim.energies()["overlap"] > 0.0  # what the new constraints took
    restarts_exactly(lambda: start(torn_at(0.53)), steps + 8, 20)


@pytest.mark.long
def test_what_new_constraints_take_is_booked():
    """The bullet's hole, 25 mm about its middle: cells break beside the overlap, and the constraints are made anew. Not booked, 0.3 % of
    the bullet's energy were missing."""
    scene = load_scene(ROOT / "scenes" / "empty_tank.py", {"quality": "draft", "coupled": True, "grows": True})
    sim = start(scene.derive(**{"shells.tank.patch.grows": False}))
    sim.advance(24)
    energies = sim.energies()
    assert sim.status()["broken"] and energies["overlap"] > 2e-3 * energies["injected"]
    assert abs(energies["closed_residual_percent"]) < 0.1


def test_what_new_constraints_take_does_not_depend_on_the_step():
    """Constraints that suddenly say something else take energy at once, whether the step stays or is halved there. As the work of a force
    along its path, times dt_before / kick, 0.0087 % of the energy would be missing."""
    sim = start(patched(motion="in_plane", n=3))
    coupling = tied(sim)
    for group in sim.groups:
        X = group.mesh.points
        runtime.put(group.nodes.v, np.column_stack([5.0 + 100.0 * X[:, 0], 2.0 * X[:, 0]]))
    coupling.start()
    sim.dt /= 2.0
    sim.advance(20)
    rows = coupling.factor.rows
    coupling.factor, coupling.anew = factorised(replace(rows, particles=1.05 * rows.particles), *coupling.mass), True
    coupling.tie.put(coupling.factor)
    sim.dt /= 2.0
    sim.advance(6)
    energies = sim.energies()
    assert energies["overlap"] > 2e-4 * energies["injected"] and abs(energies["closed_residual_percent"]) < 1e-3


def test_damage_near_the_border_makes_the_patch_grow():
    """The same tear goes on: elements become particles, and break. What the change takes is booked."""
    sim = start(torn_at(0.35, grows=True))
    first, nodes, frame = momentum(sim), sim.n_nodes, sim.frame()
    sim.advance(30)
    for before, after in zip(frame.bodies, sim.frame().bodies, strict=True):  # a frames file holds one set of cells
        assert before.name == after.name and (before.cells == after.cells).all() and before.cell_data.keys() == after.cell_data.keys()
        assert (before.reference == after.reference).all() and len(before.points) == len(after.points)
        hidden = [body.cell_data["hidden"].sum() for body in (before, after)]
        assert (hidden[0] < hidden[1]) == (before.name == "shell")  # fewer elements are seen, and more particles
    assert sim.grown.events == 1 and sim.n_nodes > nodes and sim.status()["broken"]
    assert momentum(sim) == pytest.approx(first, abs=1e-12 * np.abs(first).max())
    assert abs(sim.energies()["closed_residual_percent"]) < 0.05
    assert tied(sim).left()[0] < 1e-12


def test_where_a_patch_cannot_grow_the_run_stops_as_it_was():
    """It cannot take all elements; what has been computed is there to be written."""
    sim = start(torn_at(0.35, grows=True))
    sim.advance(2)
    before, scene = sim.state(), sim.scene
    with pytest.raises(RunStopped, match="damage or a fast striker comes near .* 'shell', whose patch cannot grow there: .* all elements"):
        growth.grow(sim, {"shell": tuple(range(tied(sim).split.cells.max() + 1))})
    assert sim.scene is scene and same_state(sim.state(), before) == []


def test_a_border_that_moves_forgets_what_its_directors_dropped():
    """As many nodes are tied after it as before, but they are others."""
    sim = start(patched(n=3, material=CONCRETE, grows=True, duration=1e-3))
    for group in sim.groups:
        X = group.mesh.points
        runtime.put(group.nodes.v, 1e-2 * np.column_stack([0.0 * X[:, :2], np.sin(4 * X[:, 0])]))
    sim.advance(3)
    before = tied(sim).tie
    assert (runtime.get(before.dropped, before.n) != 0.0).any()
    growth.grow(sim, {"shell": tied(sim).split.wider(tied(sim).split.overlap)})
    after = tied(sim).tie
    assert after.n == before.n and after is not before and not runtime.get(after.dropped, after.n).any()


def test_only_what_contact_pushed_in_the_last_step_counts_as_touch(monkeypatch):
    """Impulses on bodies that met nothing in it are those of a step before."""
    group = SimpleNamespace(nodes=SimpleNamespace(n=2))
    surfaces = [SimpleNamespace(group=group, first=SimpleNamespace(mover=0), n=2)]
    port = SimpleNamespace(
        who=np.array([0, 1]), whose=np.array([0, 1]), impulse=np.ones((2, 3)), pushed=np.array([1, 0]), n_bodies=2, surfaces=surfaces
    )
    contact = SimpleNamespace(touching=1, pairs=SimpleNamespace(n_who=2), port=port)
    monkeypatch.setattr(growth, "runtime", SimpleNamespace(get=lambda field, n: field[:n]))
    found = growth._touch(SimpleNamespace(couplings=[], contact=contact, step=1), group, 0.5)
    assert found.tolist() == [[2.0] * 3, [0.0] * 3]


@pytest.mark.long
def test_a_restart_before_and_after_growth_is_exact():
    for steps in (3, 12):
        restarts_exactly(lambda: start(torn_at(0.35, grows=True)), steps, 12)


@pytest.mark.long
def test_an_even_motion_does_not_feel_growth():
    """A plate of even strain that spreads evenly: strains and momentum stay; kinetic energy moves by what another lattice makes of it."""
    sim = start(patched(n=3, material=CONCRETE, grows=True, duration=1e-3))
    for group in sim.groups:
        X = group.mesh.points - np.array([0.5, 0.2, 0.0])
        rate = np.array([[1e-6, 2e-7, 0.0], [0.0, -5e-7, 0.0], [0.0, 0.0, 0.0]])
        runtime.put(group.nodes.u, X @ rate)
        runtime.put(group.nodes.v, 1e5 * X @ rate + np.array([1.0, -2.0, 3.0]))
    tied(sim).start()
    sim.take(0.0, 1e-9)
    sim.clock.dt_before = sim.dt = 1e-9
    first, before, coupling = momentum(sim), sim.entries(), tied(sim)
    strain, cells = runtime.get(coupling.particles.points.strain, 1), coupling.particles.cells.n
    growth.grow(sim, {"shell": coupling.split.wider(coupling.split.overlap)})
    after, points = sim.entries(), tied(sim).particles.points
    strains = runtime.get(points.strain, points.n)
    assert points.n > cells and np.abs(strains - strain).max() < 1e-9 * np.abs(strain).max()
    assert momentum(sim) == pytest.approx(first, rel=1e-12)
    assert abs(sim.grown.booked[-1]) < 1e-6 * before.kinetic and after.kinetic == pytest.approx(before.kinetic, rel=1e-6)
    assert after.internal["elastic"] == pytest.approx(before.internal["elastic"], rel=1e-6)


def momentum(sim) -> np.ndarray:
    return sum(of_nodes(group, "mass") @ of_nodes(group, "v") for group in sim.groups)
