"""Welds: seams stay closed, a rib stiffens its plate, momentum and energy are kept; who may be welded."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.errors import SceneError
from taichi_sph.run.plan import plan
from taichi_sph.scene import (
    Brick,
    InitialVelocity,
    Material,
    Meeting,
    Numerics,
    Perfect,
    Pinball,
    Plate,
    Pulse,
    Rigid,
    Scene,
    Shell,
    Solid,
    Weld,
    checked,
)

from ..shells import STEEL, start

L, W, H, E, D = 1.0, 0.1, 0.05, 0.01, 0.025
ROD = Material(**STEEL | {"poisson": 0.0})
PLATE = Shell(name="plate", surface=Plate(length=L, width=W), thickness=E, material=ROD, motion="free")
UPRIGHT = Plate(length=L, width=H, origin=(0, 0.5 * W, 0), normal=(0, -1, 0), along=(1, 0, 0))
RIB = Shell(name="rib", surface=UPRIGHT, thickness=E, material=ROD, motion="free")


def tee(**more) -> Scene:
    options = {"duration": 1.0, "numerics": Numerics(spacing=D), "welds": [Weld(between=("plate", "rib"))]} | more
    options.setdefault("shells", [PLATE, RIB])
    return Scene(name="tee", title="", source="tests", **options)


@pytest.mark.parametrize(("spacing", "within"), [(D, 0.05), pytest.param(0.5 * D, 0.02, marks=pytest.mark.long)])
def test_a_rib_stiffens_its_plate(spacing, within):
    """The first bending mode of a free tee section, E I about its own axis: 6 times the frequency of the plate alone. Shear, which the rib
    bears alone, takes 2 % (Timoshenko); two cells across the rib leave 4 %, four half of that."""
    kick = {"velocity": (0, 0, 0.5), "pulse": Pulse(centre=0.5 * L, width=0.25 * L)}
    numerics = Numerics(spacing=spacing)
    scene = tee(numerics=numerics, initial=[InitialVelocity(body="plate", **kick), InitialVelocity(body="rib", **kick)])
    plan(scene)
    sim = start(scene)
    X, mass = sim.shell.mesh.points, runtime.get(sim.shell.nodes.mass, sim.shell.nodes.n).astype(float)
    beta = 4.730041 / L
    x = X[:, 0]
    ratio = (np.cosh(beta * L) - np.cos(beta * L)) / (np.sinh(beta * L) - np.sin(beta * L))
    shape = np.cosh(beta * x) + np.cos(beta * x) - ratio * (np.sinh(beta * x) + np.sin(beta * x))
    q, times = [], []
    v0 = mass @ runtime.get(sim.shell.nodes.v, sim.shell.nodes.n).astype(float)
    while sim.time < 6e-3:
        sim.advance(20)
        q.append((mass * shape) @ runtime.get(sim.shell.nodes.u, sim.shell.nodes.n)[:, 2].astype(float))
        times.append(sim.time)
    q, t = np.array(q), np.array(times)
    zero = np.flatnonzero(q[1:] * q[:-1] < 0)
    at = t[zero] - q[zero] * (t[zero + 1] - t[zero]) / (q[zero + 1] - q[zero])
    A, S = E * (W + H), E * H * 0.5 * H
    I = E * H**3 / 3 + W * E**3 / 12 - S**2 / A
    exact = beta**2 * np.sqrt(ROD.young * I / (ROD.density * A))
    slow = beta**2 * I / A * (1 + 2 * 1.2 * A / (E * H))  # rotary inertia, and E / G = 2 over the area of the rib
    assert np.pi / np.diff(at).mean() == pytest.approx(exact * (1 - 0.5 * slow), rel=within)
    v = mass @ runtime.get(sim.shell.nodes.v, sim.shell.nodes.n).astype(float)
    assert v == pytest.approx(v0, abs=1e-9 * abs(v0).max())
    now = X + runtime.get(sim.shell.nodes.u, sim.shell.nodes.n)
    seam = [now[body.nodes.rows][np.abs(X[body.nodes.rows] - [0, 0.5 * W, 0])[:, 1:].max(axis=1) < 1e-9] for body in sim.shell.shells]
    assert len(seam[0]) == round(L / spacing) + 1 and np.abs(seam[0] - seam[1]).max() < 1e-11
    assert abs(sim.energies()["closed_residual_percent"]) < 0.01


@pytest.mark.long
def test_a_seam_of_shells_of_two_laws_adds_up_in_their_order():
    """Two groups: places on the list of a seam rise, whatever the addresses of the groups; momentum stays and the seam moves as one."""
    other = Shell(
        name="keel", surface=Plate(length=L, width=H, origin=(0, 0.5 * W, -H), normal=(0, -1, 0), along=(1, 0, 0)), thickness=E,
        material=Material(**STEEL | {"poisson": 0.0, "strength": Perfect(yield_stress=1e10)}), motion="free",
    )  # fmt: skip
    welds = [Weld(between=("keel", "plate")), Weld(between=("plate", "rib"))]
    apart = [Meeting(between=("keel", "rib"), meet=False)]
    sim = start(
        tee(shells=[PLATE, RIB, other], welds=welds, meetings=apart, initial=[InitialVelocity(body="keel", velocity=(1.0, 2.0, 3.0))])
    )
    welded = next(c for c in sim.couplings if hasattr(c, "seams"))
    first = runtime.get(welded.seams.start, welded.seams.n + 1)
    place = runtime.get(welded.seams.place, first[-1])
    assert len(welded.surfaces) == 2 and (np.diff(first) == 3).all()
    assert all((np.diff(place[a:b]) > 0).all() for a, b in zip(first, first[1:]))
    nodes = [group.nodes for group in sim.groups]
    mass, before = ([runtime.get(getattr(one, name), one.n).astype(float) for one in nodes] for name in ("mass", "v"))
    sim.advance(5)
    after = [runtime.get(one.v, one.n).astype(float) for one in nodes]
    assert sum(m @ v for m, v in zip(mass, after)) == pytest.approx(sum(m @ v for m, v in zip(mass, before)), rel=1e-9)
    v = np.concatenate([values[runtime.get(welded.ends.who, welded.ends.n)[a:b]] for values, a, b in _parts(sim, welded, after)])
    assert all(np.ptp(v[place[a:b]], axis=0).max() < 1e-12 for a, b in zip(first, first[1:]))


def _parts(sim, welded, values):
    """Values of the nodes of each surface with where its places begin and end."""
    of = {id(group): value for group, value in zip(sim.groups, values)}
    return [(of[id(s.group)], a, b) for s, a, b in zip(welded.surfaces, welded.bounds, welded.bounds[1:])]


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"welds": [Weld(between=("plate", "rob"))]}, "welds[0].between: there is no body 'rob'; did you mean 'rib'?"),
        ({"welds": [Weld(between=("rib", "rib"))]}, "welds[0].between: 'rib' twice"),
        ({"welds": [Weld(between=("rib", "ball"))]}, "welds[0].between: 'ball' is a rigid body, and shells alone are welded"),
        ({"welds": [Weld(between=("rib", "block"))]}, "welds[0].between: 'block' is a solid, and shells alone are welded"),
        ({"welds": [Weld(between=("rib", "plate")), Weld(between=("rib", "plate"))]}, "welds[1]: 'rib' and 'plate' have a weld already"),
        (
            {"shells": [PLATE, RIB.model_copy(update={"surface": Plate(length=L, width=H, origin=(0, 0, 0.2))})]},
            "welds[0] catches no nodes: 'plate' and 'rib' have none within 2.5 mm of each other (the nearest are 200 mm apart)",
        ),
    ],
)
def test_refusals(keys, said):
    ball = Rigid(name="ball", pinballs=[Pinball(centre=(5, 5, 5), radius=0.1)], mass=30.0)
    block = Solid(name="block", shape=Brick(size=(0.1, 0.1, 0.1), origin=(2, 2, 2)), material=ROD)
    with pytest.raises(SceneError) as error:
        plan(checked(Scene, lambda: tee(rigids=[ball], solids=[block], **keys)))
    assert said in str(error.value)
