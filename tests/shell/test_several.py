"""Several shells in one scene: each moves as if it were alone, and a second one compiles nothing."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.bodies.body import Entries, Now
from taichi_sph.couplings.coupling import Coupling
from taichi_sph.errors import RunStopped
from taichi_sph.runtime import ti
from taichi_sph.scene import (
    Ball,
    Box,
    Collocation,
    Cut,
    Delay,
    InitialVelocity,
    Material,
    Mazars,
    Meeting,
    NodalForce,
    NodalMoment,
    Numerics,
    Output,
    Plate,
    Power,
    PrescribedVelocity,
    Probe,
    Scene,
    Shell,
    Static,
    SurfacePressure,
)
from taichi_sph.world.world import World

from ..exact import restarts_exactly, threads_change_nothing

D = 1e-3  # m
SIDE = 10 * D
CONCRETE = {"name": "concrete", "young": 32e9, "poisson": 0.2, "density": 2450.0}
BRITTLE = {"damage": Mazars(threshold=8.5e-5, A=1, B=7300), "delay": Delay(a=10, tau_c=1e-6), "critical_damage": 0.99}
METAL = {"name": "steel", "young": 210e9, "poisson": 0.3, "density": 7800.0, "strength": Power(A=2e8, B=4e8, n=0.4)}
NEAR = (0.0, SIDE + 0.5 * D, 0.0)  # half a spacing beside the first plate


def shell(name: str, origin: tuple[float, float, float], **more) -> Shell:
    given = {"thickness": 2e-3, "material": CONCRETE, "motion": "in_plane"} | more
    material = Material(**given.pop("material"))
    surface = Plate(length=SIDE, width=SIDE, origin=origin)
    return Shell(name=name, surface=surface, material=material, **given)


def scene(shells: list[Shell], numerics: dict | None = None, **more) -> Scene:
    if len(shells) > 1 and any(one.motion == "free" for one in shells):
        names = [one.name for one in shells]
        pairs = [(a, b) for k, a in enumerate(names) for b in names[k + 1 :]]
        more = {"meetings": [Meeting(between=pair, meet=False) for pair in pairs]} | more
    settings = {"spacing": D, "irregularity": 0.15, "time_step_safety": 0.5} | (numerics or {})
    given = {"duration": 1e-4} | more
    return Scene(name="several", title="Several plates", source="tests", shells=shells, numerics=Numerics(**settings), **given)


def end(axis: int, at: float, beyond: bool) -> Box:
    lo, hi = [None] * 3, [None] * 3
    (lo if beyond else hi)[axis] = at
    return Box(lo=tuple(lo), hi=tuple(hi))


def torn(name: str, origin: tuple[float, float, float], formulation: str) -> tuple[Shell, dict]:
    """A cracked brittle plate that is pulled apart along y."""
    x, y, _ = origin
    cut = Cut(start=(x, y + 0.5 * SIDE, 0.0), end=(x + 0.3 * SIDE, y + 0.5 * SIDE, 0.0))
    pull = 2.6e4 * SIDE  # N
    loads = {
        "forces": [
            NodalForce(body=name, where=end(1, y + SIDE - 1e-6, True), total=(0.0, pull, 0.0)),
            NodalForce(body=name, where=end(1, y + 1e-6, False), total=(0.0, -pull, 0.0)),
        ]
    }
    return shell(name, origin, material=CONCRETE | BRITTLE, cuts=[cut]), loads


def hit(name: str, origin: tuple[float, float, float]) -> tuple[Shell, dict]:
    """A metal plate, held along one side, whose other side starts to move across it: it yields."""
    x = origin[0]
    loads = {
        "motions": [PrescribedVelocity(body=name, where=end(0, x + 1e-6, False), velocity=(0, 0, 0), spin=(0, 0, 0))],
        "initial": [InitialVelocity(body=name, where=end(0, x + 0.7 * SIDE, True), velocity=(40.0, 0.0, -60.0))],
    }
    return shell(name, origin, material=METAL, motion="free"), loads


def pressed(name: str, origin: tuple[float, float, float]) -> tuple[Shell, dict]:
    """A brittle plate, clamped along one side, under a pressure that breaks it, and a moment on the other side."""
    x = origin[0]
    loads = {
        "motions": [PrescribedVelocity(body=name, where=end(0, x + 1e-6, False), velocity=(0, 0, 0), spin=(0, 0, 0))],
        "pressures": [SurfacePressure(body=name, value=1.5e6)],
        "moments": [NodalMoment(body=name, where=end(0, x + SIDE - 1e-6, True), total=(0.0, 0.05, 0.0))],
    }
    return shell(name, origin, material=CONCRETE | BRITTLE, motion="free"), loads


def together(*parts: tuple[Shell, dict], **more) -> Scene:
    loads: dict[str, list] = {}
    for _, own in parts:
        for key, entries in own.items():
            loads.setdefault(key, []).extend(entries)
    return scene([one for one, _ in parts], **(loads | more))


def stepped(sim: World, steps: int, dt: float | None = None) -> World:
    """That many steps of dt, whatever the stable step says."""
    dt = sim.dt if dt is None else dt
    for _ in range(steps):
        sim.dt = dt
        sim.advance(1)
    return sim


def arrays(sim: World, name: str) -> dict[str, np.ndarray]:
    """All that a frame knows of a body."""
    body = sim.frame().body(name)
    return {"points": body.points, "cells": body.cells, **body.point_data, **body.cell_data}


def differing(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> list[str]:
    assert set(a) == set(b)
    return [name for name in a if a[name].tobytes() != b[name].tobytes()]


PAIRS = {
    "brittle": (lambda name, origin: torn(name, origin, "galerkin"), {}, 150),
    "collocation": (lambda name, origin: torn(name, origin, "collocation"), {"formulation": Collocation()}, 150),
    "metal": (hit, {}, 60),
    "pressed": (pressed, {}, 120),
}


@pytest.mark.parametrize("kind", ["brittle", *(pytest.param(kind, marks=pytest.mark.long) for kind in PAIRS if kind != "brittle")])
def test_each_of_two_plates_moves_as_if_it_were_alone(kind):
    """Bit for bit, though the second stands half a spacing beside the first; and with the same kernels."""
    make, numerics, steps = PAIRS[kind]
    one, two = make("one", (0.0, 0.0, 0.0)), make("two", NEAR)
    pair = World(together(one, two, numerics=numerics))
    dt = pair.dt
    stepped(pair, steps)
    compiled, found = instances(), {name: arrays(pair, name) for name in ("one", "two")}
    assert len(pair.groups) == 1
    assert (pair.status()["broken"] > 0) == (kind != "metal")
    assert kind != "metal" or found["one"]["plastic"].max() > 1e-4
    for part in (one, two):
        alone = stepped(World(together(part, numerics=numerics)), steps, dt)
        assert instances() == compiled, "a second shell compiles nothing"
        assert differing(found[part[0].name], arrays(alone, part[0].name)) == []


def instances() -> dict[str, int]:
    """How often each kernel of the package has been compiled since the start."""
    made = [k for k in ti.lang.impl.get_runtime().kernels if k.compiled_kernels and k.func.__module__.startswith("taichi_sph.")]
    return {f"{k.func.__module__}.{k.func.__qualname__}": len(k.compiled_kernels) for k in made}


def other(name: str, origin: tuple[float, float, float]) -> tuple[Shell, dict]:
    """As `hit`, of another metal, thinner and coarser."""
    made, loads = hit(name, origin)
    softer = Material(**METAL | {"name": "aluminium", "young": 70e9, "density": 2700.0, "strength": Power(A=1e8, B=2e8, n=0.6)})
    return made.model_copy(update={"thickness": 1.2e-3, "material": softer, "spacing": 1.25 * D, "cells": "triangle"}), loads


@pytest.mark.long
def test_plates_of_other_numbers_stand_in_one_group():
    """Each moves as alone but for rounding: the order in which a row meets its neighbours follows the largest support."""
    one, two = hit("one", (0.0, 0.0, 0.0)), other("two", (0.0, 2 * SIDE, 0.0))
    pair = World(together(one, two))
    assert [group.bodies[1].name for group in pair.groups] == ["two"]
    dt = pair.dt
    stepped(pair, 40)
    found = {name: arrays(pair, name) for name in ("one", "two")}
    assert found["two"]["plastic"].max() > 1e-4
    for part in (one, two):
        name = part[0].name
        mine = arrays(stepped(World(together(part)), 40, dt), name)
        for key in ("points", "velocity", "director", "plastic", "strain", "thickness"):
            scale = np.abs(mine[key] - (mine["reference"] if key == "points" else 0.0)).max()
            assert np.abs(found[name][key] - mine[key]).max() < 1e-9 * scale, (name, key)
        assert np.array_equal(found[name]["cells"], mine["cells"])


@pytest.mark.long
def test_largest_frequencies_are_those_of_the_bodies():
    """Bit for bit: the iterations of two bodies share the evaluations of the operator, nothing else."""
    from taichi_sph.bodies.shell.stable_dt import largest_frequencies

    one, two = torn("one", (0.0, 0.0, 0.0), "galerkin"), torn("two", (0.0, 2 * SIDE, 0.0), "galerkin")
    stiff = two[0].model_copy(update={"material": Material(**CONCRETE | BRITTLE | {"young": 64e9})})
    two = (stiff, two[1])
    both, _ = largest_frequencies(World(together(one, two)).shell)
    alone = [largest_frequencies(World(together(part)).shell)[0][0] for part in (one, two)]
    assert both.tolist() == alone
    assert both[1] == pytest.approx(2**0.5 * both[0], rel=1e-3)


@pytest.mark.long
def test_other_laws_make_another_group():
    """Each group has pools of its own name; the bodies move as they do alone."""
    one, two = torn("one", (0.0, 0.0, 0.0), "galerkin"), hit("two", (0.0, 2 * SIDE, 0.0))
    parts = (one, two)
    pair = World(together(*parts))
    assert [[body.name for body in group.bodies] for group in pair.groups] == [["one"], ["two"]]
    names = [f"{pool.name}.{field}" for pool in pair.pools for field in pool.fields]
    assert len(names) == len(set(names)) and {"nodes.u", "nodes_2.u", "galerkin_2.rows.coef", "loads.force.total"} <= set(names)
    run = runtime.current()
    assert set(names) <= set(run.fields) and sum(run.fields.values()) == run.bytes, "no field takes the place of another"
    dt = pair.dt
    stepped(pair, 30)
    found = {name: arrays(pair, name) for name in ("one", "two")}
    for part in parts:
        alone = stepped(World(together(part)), 30, dt)
        assert differing(found[part[0].name], arrays(alone, part[0].name)) == []


LOADS = {
    "forces": NodalForce(body="two", where=Box(), total=(0.0, 50.0, 20.0)),
    "moments": NodalMoment(body="two", where=Box(), total=(0.3, 0.0, 0.0)),
    "pressures": SurfacePressure(body="two", value=1e4),
    "motions": PrescribedVelocity(body="two", where=Ball(centre=(0, 0, 0), radius=0.1), velocity=(0.1, None, 0.2)),
    "initial": InitialVelocity(body="two", velocity=(0.0, 0.0, 0.5)),
}


@pytest.mark.long
def test_loads_act_on_their_body_alone():
    """All kinds of loads at once on the second of two plates that lie in each other: the first does not stir."""
    plates = [shell(name, (0.0, 0.0, 0.0), motion="free") for name in ("one", "two")]
    output = Output(probes=[Probe(name=f"of_{name}", body=name, point=(SIDE, SIDE, 0.0)) for name in ("one", "two")])
    sim = stepped(World(scene(plates, output=output, **{key: [load] for key, load in LOADS.items()})), 20)
    first, second = arrays(sim, "one"), arrays(sim, "two")
    assert not first["velocity"].any() and np.array_equal(first["points"], first["reference"])
    assert second["velocity"].any(axis=1).all()
    probes = sim.probes()
    assert not any(probes["of_one"].values()) and probes["of_two"]["v_z"] == second["velocity"][-1, 2] != 0.0
    assert abs(sim.energies()["closed_residual_percent"]) < 1e-3


def test_a_cut_is_of_its_body():
    """Two plates in one place: the cut of the second breaks no cell and no link of the first."""
    cut = Cut(start=(0.0, 0.5 * SIDE, 0.0), end=(0.5 * SIDE, 0.5 * SIDE, 0.0))
    material = CONCRETE | BRITTLE
    sim = World(scene([shell("one", (0.0, 0.0, 0.0), material=material), shell("two", (0.0, 0.0, 0.0), material=material, cuts=[cut])]))
    group = sim.shell
    rows = group.internal.rows
    of_row, hidden = runtime.get(rows.body, rows.n), runtime.get(rows.cut, rows.pairs)
    row = np.repeat(np.arange(rows.n), np.diff(runtime.get(rows.start, rows.n + 1)))
    assert not arrays(sim, "one")["broken"].any() and arrays(sim, "two")["broken"].any()
    assert not hidden[of_row[row] == 0].any() and hidden[of_row[row] == 1].any()
    sources = runtime.get(rows.source, rows.pairs)
    assert np.array_equal(runtime.get(group.nodes.body, group.nodes.n)[sources], of_row[row])


def test_the_watchdog_names_the_body():
    sim = World(scene([shell("one", (0.0, 0.0, 0.0)), shell("two", (0.0, 2 * SIDE, 0.0))]))
    nodes = sim.shell.nodes
    v = runtime.get(nodes.v, nodes.n)
    v[sim.shell.bodies[1].first + 7] = [1e6, 0.0]
    runtime.put(nodes.v, v)
    with pytest.raises(RunStopped, match=r"shell 'two': node 7 at \("):
        sim.look()


@pytest.mark.long
def test_several_shells_come_to_rest_together():
    """Bit for bit as alone where they need the same number of steps, and to the residual where they do not."""

    def bent(name: str, y: float, total: float, thickness: float) -> tuple[Shell, dict]:
        held = [PrescribedVelocity(body=name, where=end(0, 1e-6, False), velocity=(0, 0, 0), spin=(0, 0, 0))]
        forces = [NodalForce(body=name, where=end(0, SIDE - 1e-6, True), total=(0.0, 0.0, total))]
        return shell(name, (0.0, y, 0.0), motion="free", thickness=thickness), {"motions": held, "forces": forces}

    static = {"static": Static(increments=2, residual=1e-7), "duration": 1.0}
    parts = bent("one", 0.0, 1.0, 2e-3), bent("two", 2 * SIDE, 1.0, 2e-3), bent("three", 4 * SIDE, 0.5, 1.5e-3)

    def settled(*some: tuple[Shell, dict]) -> World:
        sim = World(together(*some, **static))
        sim.advance(2)
        return sim

    alone = {part[0].name: arrays(settled(part), part[0].name) for part in parts}
    twins = settled(*parts[:2])
    assert twins.status()["residual"] < 1e-7
    for name in ("one", "two"):
        assert differing(arrays(twins, name), alone[name]) == []
    three = settled(*parts)
    for name in alone:
        off = np.abs(arrays(three, name)["points"] - alone[name]["points"]).max()
        assert off < 1e-5 * np.abs(alone[name]["points"] - alone[name]["reference"]).max()


# --- steps of one's own -------------------------------------------------------------------------------


def swinging(every: tuple[int, int], **more) -> Scene:
    """Two plates that swing: held along one side, the rest starts to move; and a force on each."""
    parts = []
    for k, name in enumerate(("one", "two")):
        y = 2 * SIDE * k
        loads = {
            "motions": [PrescribedVelocity(body=name, where=end(0, 1e-6, False), velocity=(0, 0, 0), spin=(0, 0, 0))],
            "initial": [InitialVelocity(body=name, where=end(0, 0.7 * SIDE, True), velocity=(0.0, 0.01, 0.02))],
            "forces": [NodalForce(body=name, where=end(0, SIDE - 1e-6, True), total=(0.0, 0.0, 0.1))],
            "moments": [NodalMoment(body=name, where=end(0, SIDE - 1e-6, True), total=(0.0, 1e-5, 0.0))],
        }
        parts.append((shell(name, (0.0, y, 0.0), motion="free", every=every[k]), loads))
    return together(*parts, **more)


class Pushes(Coupling):
    """Pushes a node at every step of the clock, as contact does, and books the work as contact does."""

    def __init__(self, group, node: int, force: float):
        self.nodes, self.node, self.force, self.work, self.ahead = group.nodes, node, force, 0.0, 0.0

    def correct(self, now: Now) -> None:
        v = float(self.nodes.v[self.node][2])
        f = self.force * np.cos(0.7 * now.step)
        self.work += 0.5 * self.ahead * now.dt_before * v + 0.5 * now.dt_before * f * v
        self.ahead = f
        self.nodes.force[self.node][2] += f

    def entries(self) -> Entries:
        return Entries(external=self.work)


@pytest.mark.long
def test_a_plate_of_two_steps_is_one_at_twice_the_step():
    """With nothing else around, the blows are the leap-frog at twice the step; its neighbour does not notice. The ledger closes."""
    sim = World(swinging((1, 2)))
    clock = 0.5 * sim.dt
    stepped(sim, 80, clock)
    assert [group.every for group in sim.groups] == [1, 2] and sim.every == 2
    found, ledger = {name: arrays(sim, name) for name in ("one", "two")}, sim.energies()
    whole = stepped(World(swinging((1, 1))), 40, 2 * clock)
    mine = arrays(whole, "two")
    for key in ("points", "velocity", "director", "strain"):
        scale = np.abs(mine[key] - (mine["reference"] if key == "points" else 0.0)).max()
        assert np.abs(found["two"][key] - mine[key]).max() < 1e-9 * scale, key
    fine = stepped(World(swinging((1, 1))), 80, clock)
    mine = arrays(fine, "one")
    assert np.abs(found["one"]["velocity"] - mine["velocity"]).max() < 1e-9 * np.abs(mine["velocity"]).max()
    print("closed", ledger["closed_residual_percent"], fine.energies()["closed_residual_percent"], "lag", ledger["lag"], ledger["kinetic"])
    assert abs(ledger["closed_residual_percent"]) < 1e-6


@pytest.mark.long
def test_two_steps_agree_with_one_to_second_order():
    off, clock = [], 0.5 * World(swinging((1, 2))).dt
    for halves in (1, 2):
        dt, steps = clock / halves, 80 * halves
        coarse = stepped(World(swinging((1, 2))), steps, dt)
        points, ledger = arrays(coarse, "two")["points"], coarse.energies()
        fine = stepped(World(swinging((1, 1))), steps, dt)
        mine, energies = arrays(fine, "two"), fine.energies()
        off.append(np.abs(points - mine["points"]).max() / np.abs(mine["points"] - mine["reference"]).max())
        assert ledger["elastic"] == pytest.approx(energies["elastic"], rel=0.05)
        assert ledger["external"] == pytest.approx(energies["external"], rel=0.02)
    print("off", off)
    assert off[1] < 0.3 * off[0] and off[0] < 0.02


@pytest.mark.long
def test_the_ledger_closes_when_others_push_between_two_steps():
    closed = []
    for every in (1, 2):
        sim = World(swinging((1, every)))
        clock = 0.25 * every * sim.dt
        group = sim.groups[-1]
        sim.couplings.append(Pushes(group, group.of("two").nodes.first + 60, 0.5))
        stepped(sim, 80, clock)
        e = sim.energies()
        closed.append(e["closed_residual_percent"])
        assert every == 1 or abs(e["lag"]) > 1e-4 * e["external"]
    print("closed", closed)
    assert max(map(abs, closed)) < 1e-6


def mixed() -> Scene:
    """Two cracked plates of one law, half a spacing apart, and a metal one that takes two steps at once."""
    metal, loads = hit("three", (0.0, 4 * SIDE, 0.0))
    metal = metal.model_copy(update={"every": 2})
    return together(torn("one", (0.0, 0.0, 0.0), "galerkin"), torn("two", NEAR, "galerkin"), (metal, loads))


@pytest.mark.long
def test_restart_and_threads():
    """Bit for bit, for shells of two laws and of two steps, from a step at which not all are due."""
    restarts_exactly(lambda: World(mixed()), 121, 60)
    threads_change_nothing(lambda threads: World(mixed(), threads=threads), 180)


@pytest.mark.long
def test_a_look_at_the_stable_step_leaves_no_force_behind():
    """A brittle plate of every second step, beside a metal one: the stable step is looked at again when a cell breaks, also between two of
    the plate's own steps. A restart there is exact, and nothing pushes its nodes."""
    one, loads = torn("one", (0.0, 0.0, 0.0), "galerkin")
    two = hit("two", (0.0, 2 * SIDE, 0.0))

    def make() -> World:
        return World(together((one.model_copy(update={"every": 2}), loads), two))

    sim = make()
    slow = next(group for group in sim.groups if group.every == 2)
    while not sim.status()["broken"]:
        sim.advance(1)
    first = sim.step
    sim.advance(1 + sim.step % 2)
    assert sim.step % 2 == 1
    slow.longest_step()
    assert not runtime.get(slow.nodes.force, slow.nodes.n).any(), "the next step at which the plate is not due would kick it"
    restarts_exactly(make, first + 1 + (first % 2), 20)
