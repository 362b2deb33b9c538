"""Generated surfaces: true area, closed where they should be, turned outward, no slivers, exact normals."""

from __future__ import annotations

import math

import meshio
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taichi_sph.errors import SceneError
from taichi_sph.geometry.mesh import SurfaceMesh
from taichi_sph.geometry.meshfile import read_mesh
from taichi_sph.geometry.normals import fitted_normals, report
from taichi_sph.geometry.ogrid import ogrid
from taichi_sph.geometry.surfaces import generate
from taichi_sph.run.plan import plan
from taichi_sph.scene import (
    BoxTank,
    Bullet,
    CappedTank,
    Cylinder,
    Disc,
    Frustum,
    Numerics,
    Plate,
    Roof,
    Scene,
    Shell,
    Sphere,
    SpherePatch,
    checked,
)

from ..scene.examples import spoiled

CLOSED = {
    "can": Cylinder(radius=1, length=1.5, ends="discs", axis="x"),
    "drum": CappedTank(radius=1, length=0.8, cap="flat"),
    "tank": CappedTank(radius=1, length=1, origin=(1, 2, 3)),
    "domes": CappedTank(radius=1, length=1, cap_height="40 cm", axis="y"),
    "2:1": CappedTank(radius=1, length=1, cap="elliptical", axis="x", origin=(1, 0, 0)),
    "egg": CappedTank(radius=1, length=1, cap="elliptical", cap_height=1.5),
    "kloepper": CappedTank(radius=1, length=1, cap="kloepper", axis="y"),
    "korbbogen": CappedTank(radius=1, length=1, cap="korbbogen"),
    "knuckle": CappedTank(radius=1, length=1, cap="torispherical", crown=1.5, knuckle=0.35),
    "cone": CappedTank(radius=1, length=1, cap="conical", cap_height=0.5),
    "bucket": Frustum(radius=0.8, end_radius=1.2, length=1, ends="discs", axis="x", start_angle="20 deg"),
    "box": BoxTank(size=(1, 1.5, 2), origin=(3, 2, 1)),
    "sphere": Sphere(radius=1, origin=(1, 1, 1)),
    "bullet": Bullet(radius=1, length=1, crh=1, axis="y", origin=(1, 2, 3), turned=True),
}
TUBES = {
    "tube": Cylinder(radius=1, length=2, axis="y"),
    "funnel": Frustum(radius=1, end_radius=0.5, length=0.8, axis="y", origin=(0, 1, 0)),
    "belt": Sphere(radius=1, top="40 deg", bottom="110 deg"),
}
OPEN = {
    "disc": Disc(radius=1),
    "quarter disc": Disc(radius=2, quarter=True, origin=(1, 2, 3)),
    "arc": Cylinder(radius=1, length=2, angle="100 deg", start_angle="20 deg"),
    "hemisphere": SpherePatch(radius=1, half_angle="90 deg"),
    "patch": SpherePatch(radius=2, half_angle="35 deg"),
    "roof": Roof(radius=2.5, length=5, half_angle="40 deg"),
    "half roof": Roof(radius=2.5, length=2.5, half_angle="40 deg", start_angle=0, origin=(0, 0, 1)),
    "leaning disc": Disc(radius=1, normal=(1, 2, 3), origin=(1, 0, 0)),
    "board": Plate(length=1.5, width=1, normal=(1, 0, 1), along=(0, 1, 0), origin=(1, 2, 3)),
    "skirt": Frustum(radius=2, end_radius=1.5, length=1, angle="60 deg", start_angle="30 deg"),
    "open box": BoxTank(size=(1, 1.5, 2), without=("+z",)),
    "corner": BoxTank(size=(1, 1.5, 2), without=("+x", "-y", "+z")),
    "bowl": Sphere(radius=1, bottom="130 deg", start_angle="10 deg"),
    "quarter": Sphere(radius=1, top="18 deg", bottom="90 deg", angle="90 deg"),
    "octant": Sphere(radius=1, bottom="90 deg", angle="90 deg", start_angle="45 deg"),
}
FLAT = ("board", "box", "open box", "corner")  # whose cells are the surface
ALL = CLOSED | TUBES | OPEN
EULER = dict.fromkeys(CLOSED, 2) | dict.fromkeys(TUBES, 0) | dict.fromkeys(OPEN, 1)
NETS = [("quad", 0.0), ("quad", 0.25), ("triangle", 0.0), ("triangle", 0.25)]
SPACING = 0.15

every_surface = pytest.mark.parametrize("name", ALL)
every_net = pytest.mark.parametrize("cells, irregularity", NETS)


def mesh_of(surface, spacing: float = SPACING, cells: str = "quad", irregularity: float = 0.0, seed: int = 0) -> SurfaceMesh:
    return generate(surface, Numerics(spacing=spacing, cells=cells, irregularity=irregularity, seed=seed))


def edge_lengths(mesh: SurfaceMesh) -> np.ndarray:
    return np.linalg.norm(mesh.points[mesh.edges.nodes[:, 1]] - mesh.points[mesh.edges.nodes[:, 0]], axis=1)


def corner_sines(mesh: SurfaceMesh) -> np.ndarray:
    """(M, 4) sine at each corner about the cell's normal, 1 for the corner that a triangle lacks."""
    sines = np.ones((len(mesh.cells), 4))
    for k in range(4):
        has = k < mesh.corners
        cell, last = mesh.cells[has], mesh.corners[has] - 1
        at = mesh.points[cell[:, k]]
        after = mesh.points[np.where(k == last, cell[:, 0], cell[:, min(k + 1, 3)])] - at
        before = mesh.points[np.where(k == 0, cell[np.arange(len(cell)), last], cell[:, k - 1])] - at
        turn = np.einsum("mi,mi->m", np.cross(after, before), mesh.frames[has, 2])
        sines[has, k] = turn / np.linalg.norm(after, axis=1) / np.linalg.norm(before, axis=1)
    return sines


def local(surface, points: np.ndarray) -> np.ndarray:
    """Points with the axis of the surface along z and its origin at 0."""
    back = {"x": [1, 2, 0], "y": [2, 0, 1], "z": [0, 1, 2]}["x" if isinstance(surface, Roof) else getattr(surface, "axis", "z")]
    return points[:, back]


def slope_of_head(tank: CappedTank, p: np.ndarray, up: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Outward and axial part of the normal of a head at points (N, 3) `up` [m] over its rim, from the equation that they fulfil."""
    r = np.hypot(p[:, 0], p[:, 1])
    a, b = tank.radius, tank.height
    if tank.cap == "elliptical":
        assert (r / a) ** 2 + (up / b) ** 2 == pytest.approx(np.ones(len(p)), abs=1e-12)
        return r / a**2, up / b**2
    if tank.cap == "conical":
        assert up == pytest.approx(b * (1 - r / a), abs=1e-12)
        return np.where(r > 0, b, 0), np.full(len(p), a)
    crown, knuckle = tank.radii
    centre = b - crown  # of the crown, over the rim
    ring = r > crown * math.sin(tank.crown_angle)
    assert np.hypot(r, up - centre)[~ring] == pytest.approx(np.full((~ring).sum(), crown), rel=1e-12)
    assert np.hypot(r - a + knuckle, up)[ring] == pytest.approx(np.full(ring.sum(), knuckle), rel=1e-11)
    return np.where(ring, r - a + knuckle, r), np.where(ring, up, up - centre)


def normals_of_a_bullet(bullet: Bullet, p: np.ndarray) -> np.ndarray:
    """From the circle of its arc, about a point beside the rim of its nose."""
    turn = np.array([1.0, -1.0, -1.0] if bullet.turned else [1.0, 1.0, 1.0])
    p = p * turn
    r, up = np.hypot(p[:, 0], p[:, 1]), p[:, 2] - bullet.length
    out, along = (r + bullet.arc - bullet.radius) / bullet.arc, up / bullet.arc
    nose, tip, flat = up > -1e-9, r < 1e-9, np.abs(p[:, 2]) < 1e-9
    assert np.hypot(out, along)[nose] == pytest.approx(np.ones(nose.sum()), rel=1e-12)
    assert r[~nose & ~flat] == pytest.approx(np.full((~nose & ~flat).sum(), bullet.radius), rel=1e-12)
    radial = np.where(flat & (r < bullet.radius * (1 - 1e-9)), 0.0, np.where(nose, out, 1.0)) * ~tip
    axial = np.where(flat, -1.0, np.where(tip, 1.0, np.where(nose, along, 0.0)))
    normal = np.column_stack([radial[:, None] * p[:, :2] / np.maximum(r, 1e-9)[:, None], axial])
    return normal / np.linalg.norm(normal, axis=1)[:, None] * turn


def true_normals(surface, mesh: SurfaceMesh) -> np.ndarray:
    """(N, 3) from the formula of the surface, in its local axes."""
    p = local(surface, mesh.points - np.asarray(surface.origin))
    if isinstance(surface, Plate | Disc) and surface.normal is not None:
        normal = np.array([surface.normal]) / np.linalg.norm(surface.normal)
        assert np.abs(p @ normal[0]).max() < 1e-12
        return np.broadcast_to(normal, p.shape)
    if isinstance(surface, BoxTank):
        walls = np.concatenate([(p == 0) * -1.0, (p == np.asarray(surface.size)) * 1.0], axis=1)
        walls *= [f"-{c}" in surface.faces for c in "xyz"] + [f"+{c}" in surface.faces for c in "xyz"]
        normal = walls[:, :3] + walls[:, 3:]
        return normal / np.linalg.norm(normal, axis=1)[:, None]
    if isinstance(surface, Sphere):
        return p / surface.radius
    if isinstance(surface, Bullet):
        return normals_of_a_bullet(surface, p)
    if isinstance(surface, Frustum):
        r, z = np.hypot(p[:, 0], p[:, 1]), p[:, 2]
        lean = (surface.end_radius - surface.radius) / surface.length
        wall = np.abs(r - surface.radius - lean * z) < 1e-12
        normal = np.column_stack([p[:, :2] / np.maximum(r, 1e-9)[:, None], np.full(len(p), -lean)]) * wall[:, None]
        normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-9)[:, None]
        if surface.ends == "discs":
            normal[:, 2] += np.where(np.abs(z) < 1e-12, -1.0, np.where(np.abs(z - surface.length) < 1e-12, 1.0, 0.0))
        return normal / np.linalg.norm(normal, axis=1)[:, None]
    if isinstance(surface, CappedTank) and surface.cap not in ("flat", "dome"):
        r = np.hypot(p[:, 0], p[:, 1])
        normal = np.column_stack([p[:, :2] / np.maximum(r, 1e-9)[:, None], np.zeros(len(p))])
        for side, end in ((-1, 0.0), (1, surface.length)):
            head = side * (p[:, 2] - end) > -1e-9
            flat = normal[head, :2] * 1.0
            outward, up = slope_of_head(surface, p[head], np.maximum(side * (p[head, 2] - end), 0.0))
            own = np.column_stack([flat * outward[:, None], side * up])
            own /= np.linalg.norm(own, axis=1)[:, None]
            rim = np.abs(p[head, 2] - end) < 1e-9
            own[rim, :2] += flat[rim]  # with the wall's
            normal[head] = own
        return normal / np.linalg.norm(normal, axis=1)[:, None]
    if isinstance(surface, Disc):
        return np.broadcast_to([0.0, 0.0, 1.0], p.shape)
    if isinstance(surface, SpherePatch):
        return p / surface.radius
    normal = np.column_stack([p[:, :2] / surface.radius, np.zeros(len(p))])
    half = getattr(surface, "half_angle", 0.0) if isinstance(surface, CappedTank) else 0.0
    if isinstance(surface, CappedTank) or getattr(surface, "ends", "open") == "discs":
        wall = (p[:, 2] > -1e-9) & (p[:, 2] < surface.length + 1e-9) & (np.hypot(p[:, 0], p[:, 1]) > surface.radius * (1 - 1e-9))
        for side, end in ((-1, 0.0), (1, surface.length)):
            rim = wall & (np.abs(p[:, 2] - end) < 1e-9)
            beyond = ~wall & (side * (p[:, 2] - end) > -1e-9)
            slope = [math.sin(half), math.cos(half)]  # of the cap at its rim, outward and along the axis
            normal[rim] = np.column_stack([normal[rim, :2] * (1 + slope[0]), np.full(rim.sum(), side * slope[1])])
            if half:
                sphere = surface.radius / math.sin(half)
                centre = end - side * sphere * math.cos(half)
                normal[beyond] = (p[beyond] - [0, 0, centre]) / sphere
            else:
                normal[beyond] = [0, 0, side]
    return normal / np.linalg.norm(normal, axis=1)[:, None]


@every_surface
@every_net
def test_shape(name, cells, irregularity):
    surface = ALL[name]
    mesh = mesh_of(surface, cells=cells, irregularity=irregularity)
    edges = mesh.edges
    assert len(mesh.points) - len(edges.nodes) + len(mesh.cells) == EULER[name]
    assert (mesh.corners == (4 if cells == "quad" else 3)).all()
    assert set(mesh.cells[mesh.cells >= 0]) == set(range(len(mesh.points)))  # no node without a cell
    assert mesh.areas.sum() == pytest.approx(surface.area, rel=0.01)
    assert mesh.node_areas.sum() == pytest.approx(mesh.areas.sum(), rel=1e-12) and mesh.node_areas.min() > 0
    assert mesh.spacing == pytest.approx(SPACING, rel=0.12)
    length = edge_lengths(mesh)
    if name in ("funnel", "belt", "quarter", "bucket"):  # rows of as many nodes, of circles that differ
        assert corner_sines(mesh).min() > 0.2
    elif irregularity == 0:
        assert length.min() > 0.6 * SPACING and length.max() < (1.5 if cells == "quad" else 1.5 * 1.35) * SPACING
        assert np.degrees(np.arcsin(corner_sines(mesh).min())) > (35 if cells == "quad" else 17)
    else:  # all cells convex, none folded
        assert corner_sines(mesh).min() > (0.1 if cells == "quad" else 0.05)
    # neighbours run along their edge in opposite directions
    inner = edges.sides[edges.sides[:, 1] >= 0]
    cell, side = np.divmod(inner, 4)
    begin = mesh.cells[cell, side]
    assert (begin[:, 0] != begin[:, 1]).all()
    # and all cells look where the normals of their corners look
    normal = mesh.node_normals[np.where(mesh.cells < 0, mesh.cells[:, :1], mesh.cells)]
    assert np.einsum("mci,mi->mc", normal, mesh.frames[:, 2]).min() > 0.5  # halfway at edges and corners
    said = report(mesh)
    if name in CLOSED:
        assert (edges.sides[:, 1] >= 0).all() and said.startswith("closed") and "inward" not in said
    else:
        assert f"in {2 if name in TUBES else 1} loop" in said


@every_surface
@every_net
def test_nodes_and_normals_are_exact(name, cells, irregularity):
    surface = ALL[name]
    mesh = mesh_of(surface, cells=cells, irregularity=irregularity, seed=5)
    expected = true_normals(surface, mesh)
    assert local(surface, mesh.node_normals) == pytest.approx(expected, abs=1e-12)
    # the same nodes with a point of the surface moved along its normal would be noticed: radii
    p = local(surface, mesh.points - np.asarray(surface.origin))
    if isinstance(surface, SpherePatch):
        assert np.linalg.norm(p, axis=1) == pytest.approx(np.full(len(p), surface.radius), rel=1e-13)
    elif isinstance(surface, Roof) or name in ("tube", "arc"):
        assert np.hypot(p[:, 0], p[:, 1]) == pytest.approx(np.full(len(p), surface.radius), rel=1e-13)
    elif isinstance(surface, Disc) and surface.normal is None:
        assert (p[:, 2] == 0).all()


@every_surface
def test_area_converges(name):
    """To the true area at second order: halving the spacing quarters the error."""
    surface = ALL[name]
    if name in FLAT:
        assert mesh_of(surface).areas.sum() == pytest.approx(surface.area, rel=1e-12)
        return
    error = [1 - mesh_of(surface, spacing).areas.sum() / surface.area for spacing in (0.16, 0.08, 0.04)]
    assert error[2] > 0  # chords are inside
    assert math.log2(error[0] / error[2]) / 2 == pytest.approx(2.0, abs=0.35)


@pytest.mark.parametrize("name", CLOSED)
def test_volume_converges(name):
    """To the closed form, at second order or at once."""
    surface = ALL[name]
    error = [1 - mesh_of(surface, spacing).volume / surface.volume for spacing in (0.16, 0.08)]
    assert abs(error[0]) < 0.015 and (abs(error[1]) < 1e-12 or error[0] / error[1] == pytest.approx(4, rel=0.35))


HEADS = st.one_of(
    st.builds(lambda h: {"cap": "elliptical", "cap_height": h}, st.floats(0.2, 1.8)),
    st.builds(lambda h: {"cap": "conical", "cap_height": h}, st.floats(0.1, 1.5)),
    st.builds(lambda c, k: {"cap": "torispherical", "crown": c, "knuckle": k}, st.floats(1.05, 4.0), st.floats(0.1, 0.9)),
)


@settings(max_examples=25, deadline=None)
@given(head=HEADS, radius=st.floats(0.1, 10.0))
def test_any_head(head, radius):
    """Closed, and as large as the closed forms say, whatever its proportions."""
    size = {key: value * radius for key, value in head.items() if key != "cap"}
    tank = CappedTank(radius=radius, length=radius, cap=head["cap"], **size)
    mesh = mesh_of(tank, 0.12 * radius)
    assert report(mesh).startswith("closed (watertight), volume")
    assert mesh.areas.sum() == pytest.approx(tank.area, rel=0.012) and mesh.volume == pytest.approx(tank.volume, rel=0.02)
    assert (mesh.points[:, 2].max() - radius, -mesh.points[:, 2].min()) == pytest.approx((tank.height,) * 2, rel=0.02)


@pytest.mark.parametrize("crh", [0.5, 1.5, 2.5, 5.0])
def test_bullets(crh):
    """Closed, as large as the closed forms say, as long as nose and shank; half a ball has the volume of one."""
    bullet = Bullet(radius=6.3e-3, length=5e-3, crh=crh)
    mesh = mesh_of(bullet, 0.5e-3)
    assert report(mesh).startswith("closed (watertight), volume")
    assert mesh.volume == pytest.approx(bullet.volume, rel=3e-3) and mesh.areas.sum() == pytest.approx(bullet.area, rel=2e-3)
    assert np.ptp(mesh.points[:, 2]) == pytest.approx(bullet.length + bullet.nose, rel=1e-12)
    z = np.linspace(0.0, bullet.nose, 20_001)
    wide = np.sqrt(bullet.arc**2 - z**2) - bullet.arc + bullet.radius
    summed = np.pi * (bullet.radius**2 * bullet.length + np.trapezoid(wide**2, z))
    assert bullet.volume == pytest.approx(summed, rel=1e-7)
    assert wide[-1] == pytest.approx(0.0, abs=1e-9 * bullet.radius) or crh == 0.5
    if crh == 0.5:
        assert bullet.nose == bullet.radius
        assert bullet.volume == pytest.approx(np.pi * bullet.radius**2 * (bullet.length + 2 / 3 * bullet.radius))


def test_heads_of_the_standards():
    """Height and volume of tables: 0.1935 and 0.255 of the diameter for heads of zero straight flange; 0.1 and 0.1298 of its cube."""
    for cap, height, volume in (("kloepper", 0.1935, 0.1), ("korbbogen", 0.255, 0.1298)):
        tank = CappedTank(radius=0.5, length=1, cap=cap)
        assert tank.height == pytest.approx(height, rel=0.01) and tank.head_volume == pytest.approx(volume, rel=0.03)
    tank = CappedTank(radius=1, length=1, cap="elliptical", cap_height=1)  # the hemisphere
    assert (tank.head_area, tank.head_volume) == pytest.approx((2 * math.pi, 2 * math.pi / 3))
    assert CappedTank(radius=1, length=1, cap="elliptical").height == 0.5


@every_surface
@pytest.mark.parametrize("cells", ["quad", "triangle"])
def test_irregular_is_deterministic_and_keeps_the_border(name, cells):
    regular = mesh_of(ALL[name])
    one, same, other = (mesh_of(ALL[name], cells=cells, irregularity=0.25, seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(one.points, same.points) and np.array_equal(one.cells, same.cells)
    assert not np.array_equal(one.points, other.points)
    border = np.unique(regular.edges.nodes[regular.edges.sides[:, 1] < 0])
    assert np.abs(one.points[border] - regular.points[border]).max(initial=0) < 1e-12
    moved = np.linalg.norm(one.points - regular.points, axis=1)
    assert 0.1 * SPACING < np.mean(moved) < 0.25 * SPACING and moved.max() < 0.25 * math.sqrt(2) * 1.3 * SPACING
    assert np.array_equal(one.points, mesh_of(ALL[name], irregularity=0.25, seed=1).points)  # whatever the cells


@pytest.mark.parametrize("rim", [8, 12, 20, 64, 200])
@pytest.mark.parametrize("degrees", [0, 45, 90])
def test_ogrid(rim, degrees):
    """Rim where it is promised, no sliver at any count."""
    xy, quads = ogrid(rim, math.radians(degrees))
    angle = 2 * math.pi * (np.arange(rim) - rim // 8) / rim
    assert xy[-rim:] == pytest.approx(np.column_stack([np.cos(angle), np.sin(angle)]), abs=1e-14)
    mesh = SurfaceMesh(np.column_stack([xy, np.zeros(len(xy))]), quads.astype(np.int32), 1.0)
    assert len(mesh.points) - len(mesh.edges.nodes) + len(mesh.cells) == 1
    assert (mesh.edges.sides[:, 1] < 0).sum() == rim
    assert np.degrees(np.arcsin(corner_sines(mesh).min())) > 30
    lengths = edge_lengths(mesh) * rim / (2 * math.pi)
    assert degrees or (lengths.min() > (0.7 if rim > 20 else 0.5) and lengths.max() < 1.4)


def test_symmetry_and_the_middle():
    """A disc whose rim is a multiple of 8 has a node in its middle and mirrors itself in x, y and the diagonal."""
    mesh = mesh_of(Disc(radius=1), 2 * math.pi / 64)
    p = {(round(x, 9) + 0.0, round(y, 9) + 0.0) for x, y, _ in mesh.points}
    assert (0.0, 0.0) in p and (1.0, 0.0) in p and (0.0, -1.0) in p
    assert p == {(-x + 0.0, y) for x, y in p} == {(y, x) for x, y in p}


def test_directions():
    roof = mesh_of(Roof(radius=25, length=50, half_angle="40 deg"), 2.5).points
    assert roof.min(axis=0) == pytest.approx([0, -25 * math.sin(math.radians(40)), 25 * math.cos(math.radians(40))])
    assert roof.max(axis=0) == pytest.approx([50, 25 * math.sin(math.radians(40)), 25])
    quarter = mesh_of(Roof(radius=25, length=25, half_angle="40 deg", start_angle=0), 2.5).points
    assert quarter[:, 1].min() == pytest.approx(0, abs=1e-12) and quarter[:, 1].max() == pytest.approx(16.0696902)
    for axis, first, along in (("x", 1, 0), ("y", 2, 1), ("z", 0, 2)):
        p = mesh_of(Cylinder(radius=1, length=3, axis=axis, angle="10 deg", origin=(5, 5, 5)), 0.1).points - 5
        assert p[:, along].min() == pytest.approx(0) and p[:, along].max() == pytest.approx(3)
        assert p[:, first].min() == pytest.approx(math.cos(math.radians(10)))  # from this axis on
    tank = mesh_of(CappedTank(radius=1, length=2, axis="x"), 0.2).points
    assert (tank[:, 0].min(), tank[:, 0].max()) == pytest.approx((-1, 3))


@pytest.mark.parametrize("cells, irregularity", [("quad", 0.25), ("triangle", 0.25)])
@pytest.mark.parametrize("name", ["arc", "hemisphere", "tube"])
def test_fitted_normals(name, cells, irregularity):
    """At least second order on any node set, border included, and far better than area-weighted ones."""
    worst = []
    for spacing in (0.16, 0.08):
        mesh = mesh_of(ALL[name], spacing, cells, irregularity)
        bare = SurfaceMesh(mesh.points, mesh.cells, mesh.spacing)
        worst.append(np.abs(fitted_normals(bare) - mesh.node_normals).max())
        assert worst[-1] < 0.1 * np.abs(bare.node_normals - mesh.node_normals).max()
    assert worst[0] / worst[1] > 5


@pytest.mark.parametrize("cells", ["quad", "triangle"])
def test_fitted_normals_stop_at_sharp_edges(cells):
    """On a can: exact on the discs, nearly so on the wall, halfway at the rims."""
    mesh = mesh_of(CLOSED["can"], 0.1, cells, 0.2)
    fitted = fitted_normals(SurfaceMesh(mesh.points, mesh.cells, mesh.spacing))
    error = np.linalg.norm(fitted - mesh.node_normals, axis=1)
    rim = np.abs(np.abs(mesh.node_normals[:, 0]) - math.sqrt(0.5)) < 1e-9
    flat = np.abs(mesh.node_normals[:, 0]) > 0.99
    assert error[flat].max() < 1e-12 and error[~flat & ~rim].max() < 2e-3 and error[rim].max() < 0.03


@pytest.mark.parametrize("binary", [False, True])
def test_a_closed_mesh_from_a_file(tmp_path, binary):
    """An STL, whose corners are merged, comes back closed, with its volume and good normals."""
    mesh = mesh_of(CLOSED["tank"], 0.1, "triangle", 0.2)
    path = tmp_path / "tank.stl"
    meshio.write(path, meshio.Mesh(mesh.points, [("triangle", mesh.cells[:, :3])]), binary=binary)
    back = read_mesh(path)
    assert report(back).startswith("closed (watertight), volume 7.30") and len(back.points) == len(mesh.points)
    p = back.points - [1, 2, 3]
    axial = p[:, 2] - np.clip(p[:, 2], 0, 1)  # beyond the wall the normal points away from a dome's centre
    radial = np.column_stack([p[:, :2], axial])
    smooth = np.abs(p[:, 2] - 0.5) - 0.5  # at the rims the curvature jumps: one order less
    error = np.linalg.norm(back.node_normals - radial, axis=1)
    assert error.max() < 0.05 and error[np.abs(smooth) > 0.25].max() < 3e-3


def test_reports():
    mesh = mesh_of(CLOSED["tank"])
    inside_out = SurfaceMesh(mesh.points, mesh.cells[:, [0, 3, 2, 1]], mesh.spacing)
    assert report(inside_out).endswith("normals point inward")
    n, two = len(mesh.points), np.concatenate([mesh.cells, mesh.cells + len(mesh.points)])
    assert "in 2 pieces" in report(SurfaceMesh(np.concatenate([mesh.points, mesh.points + 9]), two, 1.0)) and n
    assert "4 edges bound one cell, in 1 loop" in report(SurfaceMesh(mesh.points, mesh.cells[1:], 1.0))


def scene_with(surface, spacing="5 cm", thickness="5 mm", motion="free") -> Scene:
    data = spoiled("forces", []) | {"motions": [], "duration": "1 ms", "numerics": {"spacing": spacing}}
    shell = data["shells"][0] | {"surface": surface, "thickness": thickness, "motion": motion, "cuts": []}
    return checked(Scene, lambda: Scene(**(data | {"shells": [shell]})))


def test_plan_states_mass_and_watertightness():
    tank = {"kind": "capped_tank", "radius": "150 mm", "length": "600 mm", "cap": "flat"}
    body = plan(scene_with(tank, "10 mm", "1 mm")).bodies[0]
    assert body.analytic_mass == pytest.approx(2450 * 1e-3 * math.pi * (0.3 * 0.6 + 2 * 0.15**2))
    assert body.mass == pytest.approx(body.analytic_mass, rel=2e-3)
    assert body.note.startswith("closed (watertight), volume 0.042")
    assert 6e-3 < body.spacing_min < 10e-3 < body.spacing_max < 15e-3


@pytest.mark.parametrize("surface", [Disc(radius=1), Plate(length=1, width=1)])
def test_flat_surfaces_move_in_their_plane(surface):
    assert isinstance(scene_with(surface, motion="in_plane").shells[0], Shell)


TUBE = {"kind": "cylinder", "radius": 1, "length": 2}
TANK = {"kind": "capped_tank", "radius": 1, "length": 1}
FUNNEL = {"kind": "frustum", "radius": 1, "end_radius": 0.5, "length": 1}
BOARD = {"kind": "plate", "length": 1, "width": 1}
ROOF = {"kind": "roof", "radius": 1, "length": 1, "half_angle": "40 deg"}


@pytest.mark.parametrize(
    "change, said",
    [
        ({"surface": TUBE, "motion": "in_plane"}, "is for flat bodies, and shell 'plate' is a cylinder; set motion = 'free'"),
        ({"surface": TUBE, "spacing": 1.5}, "is larger than the body: cylinder 'plate' takes at most 1 m"),
        ({"surface": TUBE, "thickness": 1.5}, "is larger than the radius of its cylinder (1 m)"),
        ({"surface": TUBE, "spacing": "1 um", "thickness": "1 mm"}, "nodes; at most 50 million"),
        ({"surface": TUBE | {"angle": "90 deg", "ends": "discs"}}, "needs the whole circle, and angle is 90 deg"),
        ({"surface": TUBE | {"angle": "400 deg"}}, "surface.angle = '400 deg' must be at most"),
        ({"surface": TUBE | {"angle": "1 m"}}, "is not an angle such as '40 deg'"),
        ({"surface": TUBE | {"angle": "40"}}, "has no unit; write an angle such as '40 deg', or a plain number of rad"),
        ({"surface": TUBE | {"axis": "w"}}, "is not allowed; valid: x, y, z"),
        ({"surface": {"kind": "sphere_patch", "radius": 1, "half_angle": "120 deg"}}, "must be at most"),
        ({"surface": {"kind": "capped_tank", "radius": 1, "length": 1, "cap_height": 2}}, "at most a hemisphere"),
        ({"surface": {"kind": "capped_tank", "radius": 1, "length": 1, "cap": "flat", "cap_height": 1}}, "a flat cap has none"),
        ({"surface": ROOF | {"start_angle": "50 deg"}}, "is outside -40 to 40 deg"),
        ({"surface": {"kind": "disc", "radius": -1}}, "must be greater than 0 m"),
        ({"surface": {"kind": "disk", "radius": 1}}, "did you mean 'disc'?"),
        ({"surface": TANK | {"cap": "kloepper", "cap_height": 1}}, "cap_height of cap = 'kloepper' follows from its radii"),
        ({"surface": TANK | {"cap": "torispherical"}}, "crown is missing: a torispherical head has"),
        ({"surface": TANK | {"crown": 1}}, "crown is for cap = 'torispherical'; this cap is 'dome'"),
        ({"surface": TANK | {"cap": "torispherical", "crown": 0.5, "knuckle": 0.1}}, "crown 0.5 m not smaller, than the radius 1 m"),
        ({"surface": TANK | {"cap": "conical"}}, "cap_height is missing: how high is the cone?"),
        ({"surface": TANK | {"cap": "conical", "cap_height": 3}}, "above twice the radius is not possible yet"),
        ({"surface": TANK | {"cap": "eliptical"}}, "did you mean 'elliptical'?"),
        ({"surface": FUNNEL | {"end_radius": 0.2}}, "radius and end_radius differ 5 times, and more than 3.5 are not possible yet"),
        ({"surface": FUNNEL | {"end_radius": 1}}, "it is a Cylinder"),
        ({"surface": FUNNEL, "thickness": 0.9}, "is larger than the radius of its frustum (500 mm)"),
        ({"surface": {"kind": "box", "size": [1, 1, 1], "without": ["+z", "+z"]}}, "without names '+z' twice"),
        ({"surface": {"kind": "box", "size": [1, 1, 1], "without": ["+x", "-x", "+y", "-y"]}}, "two walls that do not touch"),
        ({"surface": {"kind": "box", "size": [1, 1, 1], "without": ["z"]}}, "did you mean '-z'?"),
        ({"surface": {"kind": "box", "size": [1, 1, 1]}, "thickness": 0.6}, "is larger than half the smallest width of its box"),
        ({"surface": {"kind": "sphere", "radius": 1, "top": 1, "bottom": 0.5}}, "must be smaller than bottom"),
        ({"surface": {"kind": "sphere", "radius": 1, "top": "10 deg"}}, "take the mirror image, top 0 and bottom 170 deg"),
        ({"surface": {"kind": "sphere", "radius": 1, "bottom": 1, "angle": 3}}, "a sector that holds the pole is not possible yet"),
        ({"surface": {"kind": "sphere", "radius": 1, "top": "5 deg", "bottom": "90 deg"}}, "more than 3.5 are not possible yet"),
        ({"surface": BOARD | {"normal": [0, 0, 0]}}, "normal is (0, 0, 0), which is no direction"),
        ({"surface": BOARD | {"along": [0, 0, 2]}}, "along is parallel to normal"),
        ({"surface": BOARD | {"normal": [0, 1, 0]}, "motion": "in_plane"}, "is for bodies parallel to z = 0"),
    ],
)  # fmt: skip
def test_errors_are_sentences(change, said):
    with pytest.raises(SceneError) as error:
        scene_with(**change)
    assert said in str(error.value) and "\n" not in str(error.value)
