"""The operator of solids: bending, patches, turns, the step limit, tables, meshes."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from taichi_sph import runtime
from taichi_sph.bodies.solid.table import table_of
from taichi_sph.errors import SceneError
from taichi_sph.geometry.solids import mesh_of
from taichi_sph.scene import Brick, Cells, Ogive, Particles, Rod, Trilinear

from ..solids import STEEL, bends, forces, group_of, shaken, solid_scene, start

GRADIENT = 1e-3 * np.random.default_rng(1).standard_normal((3, 3))
TURN = Rotation.from_rotvec([1.0, 2.0, 0.5]).as_matrix()


# --- bending (an independent linear prototype gives the same three digits) -------------------------------------------------------------

TIP = {(1, 1 / 6): 0.993, (2, 1 / 6): 0.981, (1, 0.05): 3.28, (2, 0.05): 1.19, (1, 0.2): 0.829, (2, 0.2): 0.934}
FINER = {(3, 1 / 6): 0.988, (5, 1 / 6): 0.992, (5, 0.05): 1.022, (5, 0.2): 0.984}
LOCKS = {1: 0.992, 2: 0.903, 3: 0.936, 5: 0.955}  # at nu 0.499


@pytest.mark.parametrize(
    "n, gamma", [(1, 1 / 6), (2, 1 / 6), *(pytest.param(*k, marks=pytest.mark.long) for k in [*list(TIP)[2:], *FINER])]
)
def test_cantilever_against_timoshenko(n, gamma):
    assert bends(n, 0.22, gamma) == pytest.approx({**TIP, **FINER}[n, gamma], abs=0.006)


@pytest.mark.parametrize("n", [1, *(pytest.param(n, marks=pytest.mark.long) for n in (2, 3, 5))])
def test_nearly_incompressible_does_not_lock(n):
    assert bends(n, 0.499, 1 / 6) == pytest.approx(LOCKS[n], abs=0.002)


@pytest.mark.long
def test_particles_bend_as_elements_do():
    for n in (2, 3):
        assert bends(n, 0.22, 1 / 6, "particles") == pytest.approx(bends(n, 0.22, 1 / 6), abs=0.005)


# --- patches and turns ----------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=["trilinear", "particles"])
def four(request):
    """Irregular hexahedra, and tetrahedra as a second mesh: (form, worlds are made anew by the tests)."""
    return request.param


@pytest.mark.parametrize("tetrahedra", [False, True])
def test_patch_turn_and_balance(four, tetrahedra):
    """An even strain makes no force inside, a turn none at all; any motion none in sum, and no moment."""
    world = start(solid_scene(shaken((5, 5, 5), (1, 1, 1), 0.2, tetrahedra), spacing=0.2, solid={"formulation": four}))
    X = group_of(world).mesh.points
    strained = forces(world, X @ GRADIENT.T)
    deep = 1e-9 if four == "trilinear" else 0.4  # the functions of particles reach further than a cell
    inner = ((deep < X) & (1 - deep > X)).all(axis=1)
    assert inner.any() and np.abs(strained[inner]).max() < 1e-12 * np.abs(strained).max()
    turned = X @ TURN.T + [1.0, 2.0, 3.0] - X
    assert np.abs(forces(world, turned)).max() < 1e-9 * np.abs(strained).max()
    u = turned + 0.02 * np.random.default_rng(2).standard_normal(X.shape)
    f = forces(world, u)
    assert np.abs(f.sum(axis=0)).max() < 1e-9 * np.abs(f).sum()
    assert np.abs(np.cross(X + u, f).sum(axis=0)).max() < 1e-9 * np.abs(f).sum()


def test_forces_are_the_derivative_of_the_energy(four):
    """By central differences, on an irregular mesh, in a large random deformation."""
    world = start(solid_scene(shaken((3, 3, 3), (1, 1, 1), 0.2), spacing=1 / 3, solid={"formulation": four}))
    group = group_of(world)
    rng = np.random.default_rng(3)
    u, way = 0.03 * rng.standard_normal((group.nodes.n, 3)), rng.standard_normal((group.nodes.n, 3))
    energy = []
    for step in (1e-6, -1e-6):
        forces(world, u + step * way)
        energy.append(runtime.get(group.cells.stored, group.cells.n).sum())
    assert -(forces(world, u) * way).sum() == pytest.approx((energy[0] - energy[1]) / 2e-6, rel=1e-7)


# --- spectrum and step ----------------------------------------------------------------------------------------------------------------


def spectrum(shape, form, poisson=0.22):
    """All frequencies [rad/s] of a free body of unit modulus and density, and the world."""
    world = start(
        solid_scene(shape, {"young": 1e9, "poisson": poisson, "density": 1000.0}, spacing=1.0, duration=100.0, solid={"formulation": form})
    )
    group = group_of(world)
    n = group.nodes.n
    K = np.empty((3 * n, 3 * n))
    for k in range(3 * n):
        u = np.zeros(3 * n)
        u[k] = 1e-6
        K[:, k] = -forces(world, u.reshape(n, 3)).ravel() / 1e-6
    root = np.repeat(np.sqrt(runtime.get(group.nodes.mass, n)), 3)
    assert np.abs(K - K.T).max() < 1e-5 * np.abs(K).max()
    return np.sqrt(np.maximum(np.linalg.eigvalsh(0.5 * (K + K.T) / root[:, None] / root), 0.0)), world


def test_spectrum_and_step(four):
    """Six modes without stiffness, no soft ones beside; the step that is measured is that of the largest frequency."""
    found, world = spectrum(Brick(size=(3, 3, 3)), four)
    scale = np.sqrt(1e9 / 1000.0)
    assert found[5] < 1e-3 * scale and found[6] > 0.3 * scale
    stable = group_of(world).stable
    assert 0.999 * found[-1] < stable.frequency < 1.05 * found[-1]
    assert 0.75 < 2 / stable.frequency * scale < 1.1


def test_lowest_mode_of_particles_is_that_of_elements():
    one, two = (spectrum(Brick(size=(4, 2, 2)), form)[0][6] for form in ("trilinear", "particles"))
    assert two == pytest.approx(one, rel=0.05)


# --- tables and meshes ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", [Trilinear(), Particles()])
@pytest.mark.parametrize("shape", [Brick(size=(0.4, 0.3, 0.5)), Rod(radius=0.2, length=0.5), Ogive(radius=0.2, length=0.3, axis="x")])
def test_tables_are_consistent(shape, form):
    """sum B = 0 and sum X B = 1 in every cell."""
    scene = solid_scene(shape, spacing=0.1)
    mesh = mesh_of(scene.solids[0], scene)
    table = table_of(mesh, form)
    assert np.abs(np.add.reduceat(table.B, table.first[:-1])).max() < 1e-10 / mesh.spacing
    one = np.add.reduceat(mesh.points[table.node][:, :, None] * table.B[:, None, :], table.first[:-1])
    assert np.abs(one - np.eye(3)).max() < 1e-10


@pytest.mark.parametrize(
    "shape, spacing",
    [
        (Brick(size=(1, 2, 3), origin=(5, 0, 0)), 0.5),
        (Rod(radius=1, length=3, axis="y"), 0.1),
        (Ogive(radius=1, length=2, turned=True), 0.05),
    ],
)
def test_generated_shapes(shape, spacing):
    """Volume, closed surface, cells that are not folded."""
    scene = solid_scene(shape, spacing=spacing)
    mesh = mesh_of(scene.solids[0], scene)
    assert mesh.volumes.sum() == pytest.approx(shape.volume, rel=0.01)
    assert np.abs(mesh.face_areas()[mesh.skin].sum(axis=0)).max() < 1e-9
    assert mesh.straightness.min() > 0.1
    assert mesh.node_volumes.sum() == pytest.approx(mesh.volumes.sum())
    assert 0.7 < mesh.spacing / spacing < 1.3


def cube(order=range(8)):
    points = np.array([[i, j, k] for k in (0, 1) for j in (0, 1) for i in (0, 1)], float)
    cell = np.array([0, 1, 3, 2, 4, 5, 7, 6])
    return Cells(points=points, cells=[[int(cell[k]) for k in order]])


def test_inverted_cells_are_mended_or_refused():
    scene = solid_scene(cube([4, 5, 6, 7, 0, 1, 2, 3]), spacing=1.0)
    mesh = mesh_of(scene.solids[0], scene)
    assert mesh.volumes[0] == pytest.approx(1.0) and "numbered inside out" in mesh.notes[0]
    scene = solid_scene(cube([0, 1, 2, 3, 4, 6, 5, 7]), spacing=1.0)
    with pytest.raises(SceneError, match="cell 0 at .* is inverted or flat"):
        mesh_of(scene.solids[0], scene)


def test_meshio_reads_solids(tmp_path):
    import meshio

    made = mesh_of((scene := solid_scene(Rod(radius=0.2, length=0.5), spacing=0.1)).solids[0], scene)
    for name, kind in (("rod.vtu", "vtu"), ("rod.msh", "gmsh"), ("rod.inp", "abaqus")):
        meshio.write(tmp_path / name, meshio.Mesh(1e3 * made.points, [("hexahedron", made.cells)]), file_format=kind)
        scene = solid_scene({"kind": "mesh", "path": tmp_path / name, "scale": 1e-3}, spacing=0.1)
        read = mesh_of(scene.solids[0], scene)
        assert read.volumes.sum() == pytest.approx(made.volumes.sum(), rel=1e-9) and len(read.cells) == len(made.cells)
    meshio.write(tmp_path / "wedge.vtu", meshio.Mesh(made.points[:6], [("wedge", np.arange(6)[None])]))
    with pytest.raises(SceneError, match="cells of type 'wedge'; a solid is made of hexahedra and tetrahedra"):
        scene = solid_scene({"kind": "mesh", "path": tmp_path / "wedge.vtu"}, spacing=0.1)
        mesh_of(scene.solids[0], scene)
    scene = solid_scene({"kind": "mesh", "path": tmp_path / "rod.vtu"}, spacing=0.1)
    with pytest.raises(SceneError, match="is it in millimetres"):
        mesh_of(scene.solids[0], scene)


# --- what is refused ------------------------------------------------------------------------------------------------------------------

METAL = {"strength": {"kind": "perfect", "yield_stress": 3e8}}


@pytest.mark.parametrize(
    "material, more, said",
    [
        (
            {"damage": {"threshold": 1e-4, "A": 1, "B": 1e3}},
            {},
            "'mazars' is a law of shells, in plane stress; solid 'body' takes 'concrete'",
        ),
        ({"strength": {"kind": "perfect", "yield_stress": 3e8, "layers": 5}}, {}, "strength.layers is of the cross-section of a shell"),
        ({"damage": {"kind": "concrete", "tension": 2e7, "compression": 1e7, "B": 100}}, {}, "compression 10 MPa is below tension 20 MPa"),
        (METAL, {"motions": [{"where": {"kind": "box"}, "velocity": (0, 0, 0), "spin": (0, 0, 0)}]}, "do not turn"),
        (METAL, {"static": {"increments": 3}}, "a solid moves in time"),
        (METAL, {"pressures": [{"value": 1e5}]}, "pressures"),
    ],
)
def test_refusals(material, more, said):
    with pytest.raises((ValueError, SceneError), match=said):
        solid_scene(Brick(size=(1, 1, 1)), material, **more)


def test_a_law_of_solids_on_a_shell_is_refused():
    from ..shells import shell_scene

    with pytest.raises((ValueError, SceneError), match="'concrete' is a law of solids"):
        shell_scene("flat", material={**STEEL, "damage": {"kind": "concrete", "tension": 2e6, "compression": 2e7, "B": 100}})
