"""A patch that begins with no element (patch = "auto"): where damage comes, or a striker."""

import io

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.bodies.body import Now
from taichi_sph.bodies.shell.parts import split_of
from taichi_sph.couplings.arlequin.near import fastest_elastic
from taichi_sph.errors import RunStopped, SceneError
from taichi_sph.run.plan import plan
from taichi_sph.run.progress import Progress, bytes_text
from taichi_sph.run.tell import tell_plan
from taichi_sph.scene import Box, Material, Meeting, Pinball, Plate, PrescribedVelocity, Rigid, Shell, load_scene, material
from taichi_sph.world import growth

from ..exact import restarts_exactly
from .scenes import STEEL, patched, start, tied
from .test_rupture import CONCRETE, ROOT, momentum, torn_at

ALL = {"where": (), "grows": True}
METAL = {key: getattr(material("steel, tank"), key) for key in ("strength", "damage", "delay", "critical_damage")}
TOUGH = {"damage": CONCRETE["damage"].model_copy(update={"threshold": 0.9}), "critical_damage": 0.99}


def test_a_tear_begins_in_elements_and_goes_on_in_particles():
    """All is as with a patch that was there, but for what the change books; frames hold the same bodies all along."""
    sim = start(torn_at(0.35, **ALL))
    assert [group.shells[0].name for group in sim.groups] == ["shell"]
    first, nodes, frame, columns = momentum(sim), sim.n_nodes, sim.frame(), sim.status().keys()
    sim.advance(40)
    assert sim.grown.events >= 1 and sim.n_nodes > nodes and sim.status()["broken"] and sim.status().keys() == columns
    after = {body.name: body for body in sim.frame().bodies}
    assert after.keys() == {body.name for body in frame.bodies} == {"shell", "shell.particles"}
    for before in frame.bodies:
        now = after[before.name]
        assert (before.cells == now.cells).all() and (before.reference == now.reference).all()
        for mine, theirs in ((before.cell_data, now.cell_data), (before.point_data, now.point_data)):
            assert {k: (v.shape, v.dtype) for k, v in mine.items()} == {k: (v.shape, v.dtype) for k, v in theirs.items()}
    hidden = {body.name: body.cell_data["hidden"] for body in frame.bodies}
    assert not hidden["shell"].any() and hidden["shell.particles"].all()
    assert momentum(sim) == pytest.approx(first, abs=1e-12 * np.abs(first).max())
    assert abs(sim.energies()["closed_residual_percent"]) < 0.05
    assert tied(sim).left()[0] < 1e-12


@pytest.mark.long
def test_a_restart_before_and_after_it_begins_is_exact():
    for steps in (3, 12):
        restarts_exactly(lambda: start(torn_at(0.35, **ALL)), steps, 12)


def still(law=CONCRETE | TOUGH, **more):
    return patched(Plate(length=2.4, width=0.8), n=3, material=law, duration=1e-3, **ALL, **more)


@pytest.mark.long
def test_patches_that_meet_become_one():
    """Two begin apart; what lies between them when their overlaps touch is particles too."""
    scene = still()
    split = split_of(scene.shells[0], scene)
    assert not split.patched.any() and not split.overlap.any() and len(split.cells) == len(split.whole.cells)

    def near(*xs: float) -> np.ndarray:
        at = np.array([(x, 0.4, 0.0) for x in xs])
        return np.linalg.norm(split.whole.centres[:, None] - at, axis=2).min(axis=1) < 0.08

    assert len(split.wider(near(0.5, 1.9))) == len(split.wider(near(0.5))) + len(split.wider(near(1.9)))  # apart
    one = split.wider(near(0.5, 1.25))
    assert len(one) > len(split.wider(near(0.5))) + len(split.wider(near(1.25)))
    sim = start(scene)
    for group in sim.groups:
        X = group.mesh.points
        runtime.put(group.nodes.v, 1e-2 * np.column_stack([X[:, 0], -X[:, 1], np.sin(4 * X[:, 0])]))
    sim.dt /= 4.0  # that of particles: a change of step shows in the ledger
    sim.advance(3)
    first, booked = momentum(sim), []
    for wanted in (split.wider(near(0.5)), split.wider(near(0.5, 1.9)), split.wider(near(0.5, 1.25, 1.9))):
        growth.grow(sim, {"shell": wanted})
        sim.advance(3)
        assert tied(sim).left()[0] < 1e-12
        booked.append(len(tied(sim).factor.blocks))
        assert abs(sim.energies()["closed_residual_percent"]) < 1e-3
    assert booked[1] > booked[0] and momentum(sim) == pytest.approx(first, abs=1e-11 * np.abs(first).max())


def test_a_striker_turns_elements_before_it_meets_them():
    """A fast one; a slow one does not. Where a support holds the plate elements stay."""

    assert fastest_elastic(material("steel, tank")) == pytest.approx(36.0, abs=2.0)
    limit = fastest_elastic(Material(**STEEL | CONCRETE))
    ball = Rigid(name="ball", mass=0.1, pinballs=[Pinball(centre=(1.2, 0.4, 0.045), radius=0.02)], velocity=(0, 0, -0.5 * limit))
    held = PrescribedVelocity(body="shell", where=Box(hi=(0.01, None, None)), velocity=(0, 0, 0), spin=(0, 0, 0))
    sim = start(still(CONCRETE, rigids=[ball], motions=[held]))
    coupling = sim.couplings[-1]
    split, now = coupling.split, Now(dt=sim.dt)
    assert len(sim.groups) == 2 and not coupling.near.struck(coupling.elements, now).any()  # elements and ball
    runtime.put(sim.rigids.v, np.array([[0.0, 0.0, -2.0 * limit]]))
    near = coupling.near.struck(coupling.elements, now)
    assert np.flatnonzero(near).tolist() == np.flatnonzero(np.linalg.norm(split.whole.centres - (1.2, 0.4, 0.0), axis=1) < 0.08).tolist()
    coupling.foresee(now)
    assert len(coupling.wanted) == 36 and not split.able[split.whole.centres[:, 0] < 0.15].any()
    # to the shell it stands still, and the other way round
    _moves(coupling.elements, -2.0 * limit)
    assert not coupling.near.struck(coupling.elements, now).any()
    runtime.put(sim.rigids.v, np.zeros((1, 3)))
    _moves(coupling.elements, 2.0 * limit)
    assert (coupling.near.struck(coupling.elements, now) == near).all()
    runtime.put(sim.rigids.x, np.array([[1.2, 0.4, 0.3]]))
    assert not coupling.near.struck(coupling.elements, now).any()


def _moves(elements, along: float) -> None:
    """All nodes along the normal of the plate [m/s]."""
    v = runtime.get(elements.nodes.v, elements.nodes.n)
    v[:] = (0.0, 0.0, along)
    runtime.put(elements.nodes.v, v)


@pytest.mark.long
def test_a_small_ball_hides_no_large_one():
    """The nearest middle is that of a pellet that meets nothing yet; the ball beside it has its surface at the plate."""
    limit = fastest_elastic(Material(**STEEL | CONCRETE))
    pinballs = {"big": Pinball(centre=(1.2, 0.4, 0.5155), radius=0.5), "small": Pinball(centre=(1.2, 0.4, 0.25), radius=0.002)}
    balls = [Rigid(name=name, mass=8e3 * ball.radius**3, pinballs=[ball], velocity=(0, 0, -0.5 * limit)) for name, ball in pinballs.items()]
    apart = Meeting(between=("big", "small"), meet=False)
    sim = start(still(CONCRETE, rigids=balls, meetings=[apart]))
    near, found = sim.couplings[-1].near, []
    for names in (("big",), ("big", "small")):
        v = np.zeros((2, 3))
        v[[sim.rigids.names.index(name) for name in names]] = (0.0, 0.0, -2.0 * limit)
        runtime.put(sim.rigids.v, v)
        found.append(np.flatnonzero(near.struck(sim.couplings[-1].elements, Now(dt=sim.dt))).tolist())
    assert found[0] and found[1] == found[0]


@pytest.mark.parametrize(
    "scene, words",
    [
        (lambda: patched(**ALL), r"shells\[0\].patch = 'auto': nothing of shell 'shell' breaks"),
        (lambda: still().derive(**{"shells.shell.patch": "aut"}), "'aut' is no patch: it is 'auto', or has regions"),
        (lambda: still().derive(**{"shells.shell.formulation": "galerkin"}), "particles in a shell of elements"),
        (lambda: plan(still().derive(**{"numerics.cells": "triangle"})), "no element of shell 'shell' can become particles"),
        (lambda: patched(where=()), "where is empty, and no element would become particles"),
    ],
)
def test_where_no_patch_can_begin(scene, words):
    with pytest.raises((SceneError, ValueError), match=words):
        scene()


def test_a_rim_of_elements_stays_where_all_would_turn():
    """A plate that is near rupture everywhere keeps the elements at its border, one that has none to keep fewer around the place."""
    scene = patched(n=3, material=CONCRETE, **ALL)
    split = split_of(scene.shells[0], scene)
    everywhere = np.ones(len(split.whole.cells), bool)
    inner = (np.abs(split.whole.centres - (0.5, 0.2, 0.0)) < (0.4, 0.1, 1.0)).all(axis=1)
    assert split.wider(everywhere) == tuple(np.flatnonzero(inner)) and inner.sum() == 16
    wider = growth.widened(scene, {"shell": split.wider(everywhere)})
    grown = split_of(wider.shells[0], wider)
    assert grown.overlap.sum() == 24 and grown.wider(everywhere) == grown.patch.cells
    narrow = patched(Plate(length=0.5, width=0.2), n=3, material=CONCRETE, **ALL)
    split = split_of(narrow.shells[0], narrow)
    there = np.arange(10) == np.linalg.norm(split.whole.centres - (0.25, 0.05, 0.0), axis=1).argmin()
    assert split.wider(there) == tuple(np.flatnonzero(np.abs(split.whole.centres[:, 0] - 0.25) < 0.11))
    everywhere = growth.widened(narrow, {"shell": split.wider(np.ones(10, bool))})
    with pytest.raises(SceneError, match="all elements of shell 'shell' would become particles, and none would be left;"):
        split_of(everywhere.shells[0], everywhere)


def test_a_tear_at_the_border_says_that_elements_stay_there():
    """A plate that is stretched everywhere breaks at its rim too. That the patch be larger is no advice where it grows by itself."""
    sim = start(patched(motion="in_plane", n=4, material=CONCRETE, duration=2e-3, **ALL))
    for group in sim.groups:
        X = group.mesh.points
        runtime.put(group.nodes.v, np.column_stack([60.0 * (X[:, 0] - 0.5), 0.0 * X[:, 0]]))
    with pytest.raises(RunStopped, match="breaks? at t = .* its patch, which grows by itself, cannot go there: .* border of the shell"):
        sim.advance(60)
    assert sim.grown.events == 1


def test_the_plan_takes_the_step_of_the_particles_to_come():
    """As that of a patch that is there; the note says the step before, too."""
    auto, there = plan(still()), plan(patched(Plate(length=2.4, width=0.8), n=3, material=CONCRETE | TOUGH, duration=1e-3))
    (body,) = auto.bodies
    assert auto.dt == pytest.approx(there.dt, rel=0.02) and auto.dt < 0.6 * there.bodies[0].dt
    assert "once there are particles, 33.33 mm apart" in body.note


def test_the_plan_says_how_far_it_may_grow():
    """From elements alone to all that can turn: the counts are those of the parts that are really made then."""
    scene = still()
    split = split_of(scene.shells[0], scene)
    cells = split.wider(split.able)
    patch = scene.shells[0].patch.model_copy(update={"cells": cells})
    grown = scene.model_copy(update={"shells": (scene.shells[0].model_copy(update={"patch": patch}),)})
    made = split_of(grown.shells[0], grown)
    assert split.counted(split.able) == (len(made.nodes), len(made.fine.mesh.points))
    p, full, text = plan(scene), plan(grown), io.StringIO()
    assert p.nodes == len(split.whole.points) and p.nodes * p.most == pytest.approx(full.nodes)
    assert p.memory < p.most_memory == pytest.approx(full.memory, rel=1e-6)
    assert full.most == 1.0 and full.most_memory == full.memory
    tell_plan(scene, p, Progress(text))
    assert f"{p.nodes} nodes at first" in text.getvalue() and f"and {full.nodes} where all {split.able.sum()} elements" in text.getvalue()
    assert f"memory {bytes_text(p.memory)} to {bytes_text(full.memory)}" in text.getvalue()


def test_of_two_shells_the_more_damaged_one_is_told():
    scene = still()
    other = scene.shells[0].model_copy(update={"name": "other", "surface": Plate(length=2.4, width=0.8, origin=(0, 0, 1.0))})
    sim = start(scene.model_copy(update={"shells": (*scene.shells, other)}))
    for coupling, worst in zip((one for one in sim.couplings if hasattr(one, "watch")), (0.6, 0.5), strict=True):
        coupling.watch.worst = worst
    assert sim.status()["% of D_c outside of the patch"] == 60


def test_a_switch_with_a_word_says_it():
    tank = ROOT / "scenes" / "empty_tank.py"
    assert load_scene(tank, {"coupled": "auto"}).shells[0].patch.where == () and load_scene(tank, {"coupled": "true"}).shells[0].patch.where
    with pytest.raises(SceneError, match="coupled = 'maybe' is neither true nor false, nor 'auto'$"):
        load_scene(tank, {"coupled": "maybe"})
    with pytest.raises(SceneError, match="grows = True: .* set coupled = True as well, or 'auto' alone"):
        load_scene(tank, {"coupled": "auto", "grows": True})


def test_auto_is_said_in_a_word():
    scene = still().derive(**{"shells.shell.patch": "auto"})
    patch = scene.shells[0].patch
    assert patch.grows and not patch.there and patch.apart(0.3) == pytest.approx(0.1)
    assert split_of(scene.shells[0], scene).n == 3
    metal = Shell(
        name="a", surface=Plate(length=1, width=1), thickness=0.01, formulation="elements", patch="auto",
        material=material("steel, tank"), motion="free",
    )  # fmt: skip
    assert metal.patch == patch


@pytest.mark.long
def test_a_metal_in_motion_begins_a_patch():
    """A ball through a plate of steel: closed, broken, and the same as from an initial patch to some percent."""
    ball = Rigid(name="ball", mass=0.05, pinballs=[Pinball(centre=(0.2, 0.2, 0.0165), radius=0.015)], velocity=(0, 0, -400.0))
    surface, keys = (
        Plate(length=0.4, width=0.4),
        {"side": 0.02, "points": 1, "thickness": 1e-3, "duration": 2e-4, "rigids": [ball], "material": METAL},
    )
    speeds = []
    for where in ({"where": (Box(lo=(0.12, 0.12, None), hi=(0.28, 0.28, None)),), "grows": True}, ALL):
        sim = start(patched(surface, **where, **keys))
        sim.advance_to(1.2e-4)
        assert abs(sim.energies()["closed_residual_percent"]) < 0.5 and sim.status()["broken"]
        speeds.append(sim.tracks()["rigid_ball"]["vz"])
    assert speeds[1] == pytest.approx(speeds[0], rel=0.02)
