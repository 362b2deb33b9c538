"""Finite elements of metal and of concrete: the laws of all shells at their points, what one point does not see, the ledger."""

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.errors import SceneError
from taichi_sph.scene import (
    Box,
    Delay,
    JohnsonCook,
    LemaitreChaboche,
    Mazars,
    Numerics,
    Perfect,
    Plate,
    Power,
    PrescribedVelocity,
    Ramp,
    Scene,
    Shell,
)

from ..shells import STEEL, of_nodes, pose, shell_scene, start

MATERIALS = {
    "perfect": {"strength": Perfect(yield_stress=2e8)},
    "layers": {"strength": Power(A=2e8, B=3e8, n=0.4, layers=5)},
    "rate": {"strength": JohnsonCook(A=2e8, B=3e8, n=0.4, C=0.05, rate0=1.0)},
    "ductile": {
        "strength": Power(A=2e8, B=3e8, n=0.4, layers=3),
        "damage": LemaitreChaboche(threshold=0.0, rupture=0.2, critical=0.5),
        "delay": Delay(a=1, tau_c=1e-5),
    },
    "mazars": {"young": 32e9, "poisson": 0.2, "damage": Mazars(threshold=1e-4, A=0.8, B=1e3), "delay": Delay(a=1, tau_c=1e-5)},
}
QUICK = ("ductile",)
FORMS = {"galerkin": "galerkin", "elements": {"kind": "elements"}, "elements_1": {"kind": "elements", "points": 1}}
FIELDS = ("strain", "stress", "plastic", "delayed", "lost", "dissipated")


def scene_of(form: str, **more):
    more = {"n": 3, "thickness": 0.03} | more
    return shell_scene("flat", **more).derive(**{"numerics.formulation": FORMS[form]})


def history(form: str, material: dict) -> tuple[dict[str, np.ndarray], dict[str, float]]:
    """The states of the points after an even stretch and shear, back and forth, over a mesh moved at random; and the energies."""
    sim = start(scene_of(form, material=material))
    shell = sim.shell
    X = shell.mesh.points
    size = 2e-3 if "damage" in material and "strength" not in material else 0.05
    G = size * np.array([[1.0, 0.3, 0], [0.1, -0.4, 0], [0, 0, 0]])
    for part in np.concatenate([np.linspace(0, 1, 41)[1:], np.linspace(1, 0.2, 21)[1:]]):
        pose(sim, part * X @ G.T, np.zeros_like(X))
        shell.internal.strain(1e-6)
    points = shell.points
    used = runtime.get(points.area, points.n) > 0
    per_area = runtime.get(points.area, points.n)[used]
    found = {name: runtime.get(getattr(points, name), points.n)[used] for name in FIELDS if hasattr(points, name)}
    found |= {name: found[name] / per_area for name in ("lost", "dissipated") if name in found}
    return found, shell.entries().internal


@pytest.mark.parametrize("name", [*QUICK, *(pytest.param(name, marks=pytest.mark.long) for name in MATERIALS if name not in QUICK)])
def test_an_even_strain_gives_what_it_gives_to_particles(name):
    """The same stress, plastic strain, damage and energies at every point, and nothing in what one point does not see."""
    wanted, energies = history("galerkin", MATERIALS[name])
    assert max(np.abs(wanted["delayed"]).max(), np.abs(wanted.get("plastic", np.zeros(1))).max()) > 0.01
    for form in ("elements", "elements_1"):
        found, internal = history(form, MATERIALS[name])
        for key, values in found.items():
            first = wanted[key][:1]
            assert values == pytest.approx(np.broadcast_to(first, values.shape), rel=1e-9, abs=1e-9 * np.abs(wanted[key]).max() + 1e-12), (
                key
            )
        for key in ("elastic", "damage", "plastic"):
            if key in internal:
                assert internal[key] == pytest.approx(energies[key], rel=1e-6, abs=1e-9 * max(energies.values())), key


def bent(form: str, material: dict, **more):
    """A cantilever whose end is turned up by a motion, to a plastic hinge or to cracks all over."""
    ends = [
        PrescribedVelocity(shell="shell", where=Box(hi=(1e-6, None, None)), velocity=(0, 0, 0), spin=(0, 0, 0)),
        PrescribedVelocity(
            shell="shell", where=Box(lo=(1 - 1e-6, None, None)), velocity=(None, None, 20.0), spin=(0, None, 0), history=Ramp(rise=2e-3)
        ),
    ]
    return start(scene_of(form, n=4, material=material, motions=ends, duration=2e-2, irregularity=0.1, **more))


@pytest.mark.parametrize("form", ["elements", "elements_1"])
@pytest.mark.parametrize("name", [pytest.param("perfect", marks=pytest.mark.long), *QUICK])
def test_the_ledger_of_a_bent_cantilever_closes(form, name):
    """With plastic flow and damage at the points, and in what one point does not see."""
    sim = bent(form, MATERIALS[name])
    sim.advance_to(1e-2)
    energies = sim.energies()
    assert energies["plastic" if name != "mazars" else "damage"] > 0.05 * energies["external"]
    assert abs(energies["closed_residual_percent"]) < 0.1
    if form == "elements_1" and name != "perfect":
        assert sim.shell.internal.lost(sim.shell.reducer) > 0.0


def test_a_hinge_within_the_plane():
    """One element of one point, bent within its plane: its moment grows as E I kappa and stays at that of a plastic hinge,
    sigma_y e h^2 / 4; what it takes is booked."""
    h, e, yields = 0.1, 0.01, 2e8
    said = Scene(
        name="hinge",
        title="an element bent within its plane",
        source="tests",
        shells=[
            Shell(
                name="shell",
                surface=Plate(length=h, width=h),
                thickness=e,
                material={**STEEL, "strength": Perfect(yield_stress=yields)},
                formulation=FORMS["elements_1"],
            )
        ],
        duration=1e-3,
        numerics=Numerics(spacing=h),
    )
    shell = start(said).shell
    X = shell.mesh.points
    arm = X[:, 1] - 0.5 * h
    moments, work, before = [], 0.0, None
    bends = np.linspace(0.0, 0.2, 101)[1:]
    for bend in bends:
        u = np.zeros((len(X), 2))
        u[:, 0], u[:, 1] = -bend * X[:, 0] * arm, 0.5 * bend * X[:, 0] ** 2
        runtime.put(shell.nodes.u, u)
        shell.internal.strain(1e-6)
        shell.internal.force()
        f = runtime.get(shell.nodes.force, shell.nodes.n)
        work += 0.5 * float(np.sum((f if before is None else f + before[0]) * (u if before is None else u - before[1])))
        before = f, u
        right = X[:, 0] > 0.5 * h
        moments.append(float((f[right, 0] * arm[right]).sum()))
    assert moments[0] == pytest.approx(STEEL["young"] * e * h**3 / 12 * bends[0], rel=2e-3)
    assert moments[-1] == pytest.approx(yields * e * h**2 / 4, rel=0.02)
    taken = shell.internal.dissipated(shell.reducer)
    assert taken > 0.9 * -work and taken + shell.stored() == pytest.approx(-work, rel=1e-3)


@pytest.mark.long
def test_a_bent_cantilever_is_as_strong_as_one_of_particles():
    """Work to bend it far, in the global form and in layers: within 4 % of the particles' on the same nodes."""
    for name in ("perfect", "layers"):
        work = {}
        for form in FORMS:
            sim = bent(form, MATERIALS[name])
            sim.advance_to(1.5e-2)
            work[form] = sim.energies()["external"]
        assert work["elements"] == pytest.approx(work["galerkin"], rel=0.04), name
        assert work["elements_1"] == pytest.approx(work["galerkin"], rel=0.04), name


def test_what_elements_cannot_do_is_said():
    with pytest.raises(SceneError, match="material.critical_damage: finite elements do not rupture; leave it out, .* 'galerkin'"):
        scene_of("elements", material={**MATERIALS["mazars"], "critical_damage": 0.9})
    with pytest.raises(SceneError, match=r"shells\[0\].cuts: finite elements do not rupture"):
        scene_of("elements").derive(**{"shells.0.cuts": [{"start": (0.2, 0.5, 0), "end": (0.4, 0.5, 0)}]})
    with pytest.raises(SceneError, match=r"points.*(1|4)"):
        scene_of("elements").derive(**{"numerics.formulation.points": 9})
    with pytest.raises(SceneError, match="support"):
        scene_of("elements").derive(**{"numerics.formulation.support": 1.2})


def test_frames_hold_the_means_of_the_points():
    sim = bent("elements", MATERIALS["ductile"])
    sim.advance_to(4e-3)
    (body,) = sim.frame().bodies
    plastic = runtime.get(sim.shell.points.plastic, sim.shell.points.n).reshape(-1, 4)
    assert body.cell_data["plastic"].shape == (len(body.cells),) and body.cell_data["strain"].shape == (len(body.cells), 8)
    assert (body.cell_data["plastic"] <= plastic.max(axis=1) + 1e-15).all() and body.cell_data["plastic"].max() > 1e-3
    assert not body.cell_data["broken"].any() and body.cell_data["thickness"].min() < 0.03
    assert np.allclose(np.linalg.norm(body.point_data["director"], axis=1), 1.0)
    assert of_nodes(sim, "u")[:, 2].max() > 1e-3
