"""Finite elements: patch tests, rigid modes, rigid turns, forces that are derivatives, and the matrix of another implementation."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from taichi_sph import runtime
from taichi_sph.bodies.shell.stable_dt import Operator
from taichi_sph.verification.elements import element_stiffness, shell_stiffness

from ..plates import forces as forces_in_plane
from ..plates import linear, plane, plate_scene
from ..shells import STEEL, forces, of_nodes, shell_scene, start, turned

CASES = [(surface, cells, points) for surface in ("flat", "curved") for cells in ("quad", "triangle") for points in (4, 1)]
CASES = [case for case in CASES if case[1:] != ("triangle", 1)]  # a triangle has one point in any case
E, NU, THICKNESS, N = STEEL["young"], STEEL["poisson"], 0.05, 4
SMALL = 1e-6


def scene_of(surface: str, cells: str, points: int, **more):
    more = {"n": N, "thickness": THICKNESS} | more
    return shell_scene(surface, cells=cells, **more).derive(
        **{"numerics.formulation": {"kind": "elements", "points": points, "shear_bound": 0}}
    )


@pytest.fixture(scope="module", params=CASES, ids=["-".join(map(str, case)) for case in CASES])
def case(request):
    """What a small shell answers, as arrays: worlds do not live side by side."""
    surface, cells, points = request.param
    sim = start(scene_of(*request.param))
    shell, n = sim.shell, sim.shell.nodes.n
    X, normals = shell.mesh.points, of_nodes(sim, "N")
    rng = np.random.default_rng(1)
    got = SimpleNamespace(surface=surface, cells=cells, points=points, X=X, mesh=shell.mesh)
    # the linear answer to a random field
    got.field = rng.standard_normal((n, 6))
    got.answer = answer(sim, got.field)
    # energy around a large deformation
    u, d, h = 0.05 * rng.standard_normal((n, 3)), 0.1 * rng.standard_normal((n, 3)), 1e-6
    f, c, _ = forces(sim, u, d)
    got.forces, got.couples, got.places, got.directors = f, c, X + u, normals + d
    ahead, behind = (forces(sim, u + s * h * got.field[:, :3], d + s * h * got.field[:, 3:])[2] for s in (1, -1))
    got.slope = (ahead - behind) / (2 * h), -(f * got.field[:, :3]).sum() - (c * got.field[:, 3:]).sum()
    # rigid turns
    got.turns = []
    for turns in (0.1, 37.37, 100.0):
        pose = turned(sim, Rotation.from_rotvec(2 * np.pi * turns * np.array([0.6, 0.0, -0.8])), (3.0, -1.0, 7.0))
        got.turns.append(forces(sim, *pose))
    # all modes
    operator = Operator(shell)
    columns = []
    for k in range(6 * n):
        y = np.zeros(6 * n)
        y[k] = 1.0
        columns.append(0.5 * (operator(y.reshape(n, 6)) - operator(-y.reshape(n, 6))).ravel())  # what is of second order cancels
    operator.close()
    got.matrix = np.array(columns).T
    # patches: what the inner nodes feel, and the strains of the points
    got.patches = {}
    if surface == "flat":
        used = runtime.get(shell.points.area, shell.points.n) > 0
        for name, of in PATCHES.items():
            u, d, strain, scale = of(X)
            f = answer(sim, np.hstack([u, d]))
            forces(sim, SMALL * u, SMALL * d)
            ahead = runtime.get(shell.points.strain, shell.points.n)[used]
            forces(sim, -SMALL * u, -SMALL * d)
            seen = (ahead - runtime.get(shell.points.strain, shell.points.n)[used]) / (2 * SMALL)
            got.patches[name] = f, seen, np.array(strain), scale
    return got


def answer(sim, field: np.ndarray) -> np.ndarray:
    """(N, 6) linear forces and couples on the nodes."""
    ends = [np.hstack(forces(sim, s * SMALL * field[:, :3], s * SMALL * field[:, 3:])[:2]) for s in (1, -1)]
    return (ends[0] - ends[1]) / (2 * SMALL)


def _stretch(X):
    G = np.array([[2.0, -1.0], [3.0, 1.5]])
    u = np.zeros((len(X), 3))
    u[:, :2] = X[:, :2] @ G.T
    return u, np.zeros_like(u), [G[0, 0], G[1, 1], G[0, 1] + G[1, 0], 0, 0, 0, 0, 0], E * THICKNESS / N


def _bend(X):
    a, b, c = 1.0, -0.5, 0.7  # w = a x^2/2 + b y^2/2 + c x y, d = -grad w
    x, y, o = X[:, 0], X[:, 1], np.zeros(len(X))
    w = 0.5 * a * x**2 + 0.5 * b * y**2 + c * x * y
    u, d = np.column_stack([o, o, w]), np.column_stack([-a * x - c * y, -b * y - c * x, o])
    return u, d, [0, 0, 0, -a, -b, -2 * c, 0, 0], E * THICKNESS**3 / 12


def _shear(X):
    x, y, o = X[:, 0], X[:, 1], np.zeros(len(X))
    return np.column_stack([o, o, 0.8 * x - 0.3 * y]), np.zeros((len(X), 3)), [0, 0, 0, 0, 0, 0, 0.8, -0.3], E * THICKNESS / N


PATCHES = {"membrane": _stretch, "bending": _bend, "shear": _shear}


def test_patches(case):
    """Constant strains, curvatures and shears on a mesh moved by a quarter of the spacing: exact, and inner nodes feel nothing but what
    a constant shear asks of their directors."""
    inside = ((case.X[:, :2] > 1e-9) & (case.X[:, :2] < 1 - 1e-9)).all(axis=1)
    for name, (f, seen, strain, scale) in case.patches.items():
        assert np.abs(seen - strain).max() < 2e-9 * np.abs(strain).max(), name
        assert np.abs(f[inside, :3]).max() < 1e-8 * scale, name
        if name != "shear":  # whose moment is not in equilibrium
            assert np.abs(f[inside, 3:]).max() < 1e-8 * scale, name


def test_six_modes_are_free(case):
    """And no more: each node has five unknowns, the sixth is the length of its director."""
    n = len(case.X)
    values = np.linalg.eigvalsh(0.5 * (case.matrix + case.matrix.T))
    assert np.abs(case.matrix - case.matrix.T).max() < 1e-7 * values[-1]
    still = np.abs(values) < 1e-7 * values[-1]
    assert still.sum() == n + 6 and values[~still].min() > 1e-5 * values[-1]


def test_rigid_turns(case):
    """A2: up to 100 turns and a flight of many lengths."""
    for f, c, energy in case.turns:
        assert np.abs(f).max() < 1e-12 * E * THICKNESS and np.abs(c).max() < 1e-12 * E * THICKNESS
        assert energy < 1e-24 * E * THICKNESS


def test_forces_are_the_derivative_of_the_energy(case):
    assert case.slope[0] == pytest.approx(case.slope[1], rel=1e-8)


def test_momenta(case):
    """No force and no moment on the whole."""
    size = np.abs(case.forces).max()
    moment = np.cross(case.places, case.forces) + np.cross(case.directors, case.couples)
    assert np.abs(case.forces.sum(axis=0)).max() < 1e-13 * size * len(case.X)
    assert np.abs(moment.sum(axis=0)).max() < 1e-13 * size * len(case.X)


def test_the_matrix_of_another_implementation(case):
    """The linear MITC3 and MITC4 of verification/elements.py, integrated in full. One point is another element."""
    if case.points == 1:
        return
    K = shell_stiffness(case.mesh, E, NU, THICKNESS)
    wanted = -(K @ case.field.ravel()).reshape(case.field.shape)
    assert np.abs(case.answer - wanted).max() < 1e-8 * np.abs(wanted).max()


@pytest.mark.parametrize("cells", ["quad", "triangle"])
def test_in_the_plane(cells):
    """Finite strain of a patch, and plane stress elements of another implementation."""
    for points in (4, 1):
        sim = start(plate_scene(cells=cells).derive(**{"numerics.formulation": {"kind": "elements", "points": points}}))
        mesh, m = sim.shell.mesh, sim.scene.shells[0].material
        G = np.array([[0.10, -0.25], [0.30, -0.05]])
        f = forces_in_plane(sim, linear(sim, G))
        green = 0.5 * (G + G.T + G.T @ G)
        used = runtime.get(sim.shell.points.area, sim.shell.points.n) > 0
        seen = runtime.get(sim.shell.points.strain, sim.shell.points.n)[used]
        assert seen == pytest.approx(np.tile([green[0, 0], green[1, 1], 2 * green[0, 1]], (len(seen), 1)), abs=1e-13)
        X = plane(sim)
        inside = ((X > X.min(axis=0) + 1e-9) & (X < X.max(axis=0) - 1e-9)).all(axis=1)
        size = np.abs(f).max()
        assert size > 0 and np.abs(f[inside]).max() < 1e-12 * size
        if points == 4:
            small = 1e-9 * np.random.default_rng(0).standard_normal(X.shape)
            K = element_stiffness(mesh, m.young, m.poisson, sim.scene.shells[0].thickness)
            wanted = -(K @ small.ravel()).reshape(X.shape)
            assert np.abs(forces_in_plane(sim, small) - wanted).max() < 1e-5 * np.abs(wanted).max()
