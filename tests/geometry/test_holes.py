"""Holes in generated surfaces: round, as large as they should be, with sound cells around; what cannot be cut is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taichi_sph.errors import SceneError
from taichi_sph.geometry.mesh import SurfaceMesh
from taichi_sph.geometry.surfaces import SHARPEST
from taichi_sph.scene import BoxTank, CappedTank, Cylinder, Disc, Frustum, HoleIn, Plate, Roof, Sphere

from .test_surfaces import corner_sines, edge_lengths, mesh_of, report

D = 0.1
AT_TWELVE = 12 / (2 * math.pi) * D  # radius of a hole with 12 cells round its rim

# surface, centre of the hole, normal there
PLACES = {
    "plate": (Plate(length=2, width=2), (1.013, 0.98, 0), (0, 0, 1)),
    "on a node": (Plate(length=2, width=2), (1, 1, 0), (0, 0, 1)),
    "in a cell": (Plate(length=2, width=2), (1.05, 1.05, 0), (0, 0, 1)),
    "board": (Plate(length=2, width=2, normal=(1, 0, 0), along=(0, 1, 0)), (0, 1, 1), (1, 0, 0)),
    "disc": (Disc(radius=1), (0.2, 0.1, 0), (0, 0, 1)),
    "wall": (Cylinder(radius=1, length=2), (math.cos(0.3), math.sin(0.3), 1.03), (math.cos(0.3), math.sin(0.3), 0)),
    "seam": (Cylinder(radius=1, length=2), (1, 0, 1.03), (1, 0, 0)),
    "tank": (CappedTank(radius=1, length=2, axis="x"), (1.03, 1, 0), (0, 1, 0)),
    "lower dome": (CappedTank(radius=1, length=2, axis="x"), (-1, 0, 0), (-1, 0, 0)),
    "upper dome": (CappedTank(radius=1, length=2, axis="x"), (2 + math.sqrt(0.5), math.sqrt(0.5), 0), (1, 1, 0)),
    "crown": (CappedTank(radius=1, length=2, cap="kloepper"), (0, 0, 2.3875484503402902), (0, 0, 1)),
    "box": (BoxTank(size=(2, 2, 2)), (1, 0, 1), (0, -1, 0)),
    "sphere": (Sphere(radius=1), (0, 0.6, 0.8), (0, 0.6, 0.8)),
    "frustum": (Frustum(radius=1, end_radius=0.6, length=2), (0.8, 0, 1), (1, 0, 0.2)),
    "roof": (Roof(radius=2, length=2, half_angle="40 deg"), (1, 0, 2), (0, 0, 1)),
}  # fmt: skip


def perforated(surface, *holes: tuple[tuple[float, float, float], float]):
    return surface.model_copy(update={"holes": tuple(HoleIn(centre=centre, radius=radius) for centre, radius in holes)})


def sound(mesh: SurfaceMesh, whole: SurfaceMesh, holes: int, irregularity: float) -> None:
    """Every node is used, a rim is a closed loop, no cell is a sliver, none faces the other way."""
    assert set(mesh.cells[mesh.cells >= 0]) == set(range(len(mesh.points)))
    euler = [len(m.points) - len(m.edges.nodes) + len(m.cells) for m in (mesh, whole)]
    assert euler[1] - euler[0] == holes
    # 0.29 where a hole sits on the pole of a disc; random moves then leave less
    assert corner_sines(mesh).min() > (SHARPEST if irregularity == 0 else 0.1)
    assert edge_lengths(mesh).min() > 0.35 * edge_lengths(whole).min()
    normal = mesh.node_normals[np.where(mesh.cells < 0, mesh.cells[:, :1], mesh.cells)]
    assert np.einsum("mci,mi->mc", normal, mesh.frames[:, 2]).min() > 0.5


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("cells, irregularity", [("quad", 0.0), ("quad", 0.25), ("triangle", 0.0), ("triangle", 0.25)])
def test_a_round_hole(place, cells, irregularity):
    """With 12 cells round the rim: open within 1 %, its rim on a circle, and the surface around as it was."""
    bare, centre, normal = PLACES[place]
    surface = perforated(bare, (centre, AT_TWELVE))
    mesh, whole = mesh_of(surface, D, cells, irregularity), mesh_of(bare, D, cells, irregularity)
    sound(mesh, whole, 1, irregularity)
    assert whole.areas.sum() - mesh.areas.sum() == pytest.approx(math.pi * AT_TWELVE**2, rel=0.02)  # curved: a little more
    assert whole.areas.sum() - mesh.areas.sum() == pytest.approx(bare.area - surface.area, rel=0.01)
    axis = np.asarray(normal) / np.linalg.norm(normal)
    way = mesh.points - centre
    off = np.linalg.norm(way - np.outer(way @ axis, axis), axis=1)
    border = mesh.edges.nodes[mesh.edges.sides[:, 1] < 0]
    rim = border[(np.linalg.norm(way[border[:, 0]], axis=1) < 1.5 * AT_TWELVE)]
    assert 8 <= len(rim) <= 16
    assert np.ptp(off[rim]) < 1e-9 and AT_TWELVE < off[rim].mean() < 1.07 * AT_TWELVE
    far = np.linalg.norm(whole.points - centre, axis=1) > AT_TWELVE + 4 * D
    there = np.linalg.norm(mesh.points - centre, axis=1) > AT_TWELVE + 4 * D
    if irregularity == 0:
        assert np.abs(whole.points[far] - mesh.points[there]).max() < 1e-12


@settings(max_examples=60, deadline=None)
@given(
    x=st.integers(-100, 100).map(lambda n: n / 1000),
    y=st.integers(-100, 100).map(lambda n: n / 1000),
    radius=st.floats(1.5, 5.0),
    irregularity=st.sampled_from([0.0, 0.2]),
    seed=st.integers(0, 99),
)
@pytest.mark.parametrize("place", ["plate", "wall", "disc", "sphere"])
def test_any_hole(place, x, y, radius, irregularity, seed):
    """Wherever the lattice stands below it, whatever its size."""
    bare, centre, normal = PLACES[place]
    if place in ("plate", "disc"):
        centre = (centre[0] + x, centre[1] + y, 0)
    elif place == "wall":
        centre = (math.cos(0.3 + x), math.sin(0.3 + x), centre[2] + y)
    else:
        centre = np.array([x, 0.6 + y, 0.8])
        centre = tuple(centre / np.linalg.norm(centre))
    surface = perforated(bare, (centre, radius * D))
    mesh, whole = mesh_of(surface, D, "quad", irregularity, seed), mesh_of(bare, D, "quad", irregularity, seed)
    sound(mesh, whole, 1, irregularity)
    assert whole.areas.sum() - mesh.areas.sum() == pytest.approx(bare.area - surface.area, rel=0.01)


def test_several_holes():
    """In one wall, in several; a hole in the lower head stays in the lower head."""
    box = perforated(BoxTank(size=(2, 2, 2)), ((0, 1, 1), 0.3), ((0, 1, 1.65), 0.15), ((1, 1, 2), 0.4))
    sound(mesh_of(box, D), mesh_of(BoxTank(size=(2, 2, 2)), D), 3, 0.0)
    assert "in 3 loops" in report(mesh_of(box, D))
    for end, z in ((-1, -1.0), (1, 3.0)):
        tank = perforated(CappedTank(radius=1, length=2), ((0, 0, z), 0.3))
        mesh = mesh_of(tank, D)
        border = mesh.points[np.unique(mesh.edges.nodes[mesh.edges.sides[:, 1] < 0])]
        assert (end * (border[:, 2] - 1) > 1.9).all() and tank.volume == CappedTank(radius=1, length=2).volume


def test_area_of_a_hole():
    """What a drill takes from a sphere is a cap."""
    sphere = perforated(Sphere(radius=1), ((0, 0.6, 0.8), 0.3))
    assert 4 * math.pi - sphere.area == pytest.approx(2 * math.pi * (1 - math.sqrt(1 - 0.09)), rel=2e-3)


@pytest.mark.parametrize(
    "surface, holes, said",
    [
        (Plate(length=2, width=2), [((1, 1, 0), 0.09)], "holes[0] is 180 mm wide, less than 2 spacings of 100 mm"),
        (Plate(length=2, width=2), [((0.25, 1, 0), 0.2)], "of an edge of its part of the surface; at least one spacing, 100 mm"),
        (Plate(length=2, width=2), [((1, 1, 0.5), 0.2)], "holes[0].centre (1, 1, 0.5) m is not on the surface: its nearest"),
        (Plate(length=2, width=2), [((1, 1, 0), 0.2), ((1.5, 1, 0), 0.2)], "holes[0] and holes[1] are 100 mm apart"),
        (Cylinder(radius=0.5, length=2), [((0.5, 0, 1), 0.48)], "the surface turns away by more than 60 deg within"),
        (CappedTank(radius=1, length=1), [((1, 0, 1), 0.2)], "comes within"),
        (Sphere(radius=1), [((0, 0, 0), 0.3)], "is not on the surface"),
    ],
)  # fmt: skip
def test_refusals_are_sentences(surface, holes, said):
    with pytest.raises(SceneError) as error:
        mesh_of(perforated(surface, *holes), D)
    assert said in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize("cells", ["quad", "triangle"])
def test_a_quarter_of_a_disc_with_a_hole_about_its_middle(cells):
    """Four of it make the whole disc; what crosses a plane of symmetry, or moves nodes off it, is refused."""
    surface = Disc(radius=1, quarter=True, holes=[HoleIn(centre=(0, 0, 0), radius=AT_TWELVE)])
    mesh = mesh_of(surface, D, cells)
    x, y, _ = mesh.points.T
    assert min(x.min(), y.min()) == 0.0 and np.hypot(x, y).min() == pytest.approx(AT_TWELVE, rel=0.03)
    assert mesh.areas.sum() == pytest.approx(surface.area, rel=0.01)
    whole = mesh_of(surface.model_copy(update={"quarter": False}), D, cells)
    assert 4 * mesh.areas.sum() == pytest.approx(whole.areas.sum(), rel=1e-3)
    moved = mesh_of(surface, D, cells, irregularity=0.2)
    assert len(moved.points) == len(mesh.points) and 4 * moved.areas.sum() == pytest.approx(whole.areas.sum(), rel=1e-3)
    on_planes = (mesh.points[:, :2] == 0.0).any(axis=1)
    assert on_planes.sum() == 2 * (moved.points[:, 0] == 0.0).sum() and np.array_equal(moved.points[on_planes], mesh.points[on_planes])
    beside = Disc(radius=1, quarter=True, holes=[HoleIn(centre=(0.28, 0.28, 0), radius=0.25)])
    with pytest.raises(SceneError, match="at least one spacing"):
        mesh_of(beside, D, cells)
    for wrong in ({"holes": [HoleIn(centre=(0.1, 0.5, 0), radius=0.2)]}, {"normal": (1, 0, 0)}):
        with pytest.raises(ValueError, match="crosses a plane of symmetry|is parallel to the plane z = 0"):
            Disc(radius=1, quarter=True, **wrong)
