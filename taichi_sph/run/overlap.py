"""Bodies that lie in each other at the start, found before anything is compiled. NumPy and SciPy only.

Every body is seen as contact sees it (couplings/contact): a shell node as a disc half as thick as the shell on either side, which reaches
half way to the farthest corner of its cells (at a border or a cut: half way to the next node), and to another shell or the surface of a
rigid body as a thin ball that meets whole cells; a rigid body as its surface, or as its pinballs; a fluid particle as a ball, smaller where
pressure carries the fluid and contact only stands behind it. Pairs that may not meet are left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..bodies.fluid.fill import CONTACT, PINBALL, Filling
from ..bodies.rigid.solid import Solid
from ..bodies.shell.sections import mean_at_nodes, sheets_of
from ..couplings.contact.said import meeting
from ..errors import SceneError
from ..geometry.cuts import cells_cut
from ..geometry.mesh import SurfaceMesh
from ..geometry.near import away_from
from ..geometry.solids.mesh import SolidMesh
from ..scene import Scene, Shell
from ..scene.units import show

ROUNDING = 1e-3  # of the skin
SAME_PLACE = 0.5  # of D_0: two particles nearer than that fill one place


@dataclass(frozen=True)
class Balls:
    """centres (n, 3) [m], radii (n,) [m]."""

    centres: np.ndarray
    radii: np.ndarray


@dataclass(frozen=True)
class Discs:
    """centres (n, 3), normals (n, 3), radii (n,) and half (n,) [m], half the thickness; sound (n,): no border and no cut beside it;
    edges (E, 2) and cells (C, 4) between them, those that are whole, the last corner -1 in a triangle."""

    centres: np.ndarray
    normals: np.ndarray
    radii: np.ndarray
    half: np.ndarray
    sound: np.ndarray
    edges: np.ndarray
    cells: np.ndarray


def discs(shell: Shell, mesh: SurfaceMesh) -> Discs:
    """The nodes of a shell as contact has them at t = 0."""
    live = np.ones(len(mesh.cells), bool)
    for cut in shell.cuts:
        live[cells_cut(mesh, cut.start, cut.end)] = False
    n = len(mesh.points)
    near, far, sound = np.zeros(n), np.zeros(n), np.ones(n, bool)
    for corners in (3, 4):
        cells = mesh.cells[mesh.corners == corners, :corners]
        alive = live[mesh.corners == corners]
        for k in range(corners):
            node = cells[:, k]
            sound[node[~alive]] = False
            for ahead, reach in ((1, near), (corners - 1, near), (2, far)):
                length = np.linalg.norm(mesh.points[cells[:, (k + ahead) % corners]] - mesh.points[node], axis=1)
                np.maximum.at(reach, node[alive], length[alive])
    sound[np.unique(mesh.edges.nodes[(mesh.edges.sides < 0).any(axis=1)])] = False
    made = sheets_of(shell, mesh)
    thickness = np.full(n, made.sheets[0].thickness) if made.even else mean_at_nodes(mesh, made.thickness)
    radii = 0.5 * np.where(sound, np.maximum(near, far), np.where(near > 0, near, mesh.node_spacing))
    return Discs(mesh.points, mesh.node_normals, radii, 0.5 * thickness, sound, mesh.edges.nodes, mesh.cells[live])


def check_overlaps(
    scene: Scene,
    meshes: Mapping[str, SurfaceMesh],
    fillings: Mapping[str, Filling],
    solids: Mapping[str, Solid],
    made: Mapping[str, SolidMesh] | None = None,
) -> None:
    """SceneError with one sentence where two bodies that may meet lie in each other. solids: rigid ones; made: meshes of those that deform,
    which are looked at beside fluids."""
    if len(scene.bodies) < 2:
        return
    balls = {name: Balls(solid.places, solid.radii) for name, solid in solids.items()}
    lengths = [0.5 * ball.radii.min() for ball in balls.values()]
    lengths += [meshes[shell.name].spacing for shell in scene.shells] + [filling.finest for filling in fillings.values()]
    skin = 0.5 * min(lengths, default=0.0)
    shells = {shell.name: discs(shell, meshes[shell.name]) for shell in scene.shells if shell.meets}
    thin = {f.name: f.contact is None for f in scene.fluids}

    def wet(name: str, sound: bool) -> Balls:
        """A fluid's particles, against sound discs, or against lips and pinballs."""
        filling = fillings[name]
        share = PINBALL if thin[name] else CONTACT["pinballs"] if sound else CONTACT[None]
        return Balls(filling.points, share * filling.spacing / filling.parts)

    for name, mesh in (made or {}).items():
        skin_of = _skin(mesh)
        for fluid in scene.fluids:
            if scene.met(name, fluid.name).meet:
                depth = _in_solid(wet(fluid.name, True), skin_of)
                if depth > (0.5 + ROUNDING) * skin:
                    raise SceneError(
                        f"fluid '{fluid.name}' starts {1e3 * depth:.3g} mm inside solid '{name}': move one of them away; a filling that"
                        " leaves room for a body is not possible yet, boxes of water around it are"
                    )

    boxes = {name: _box(ball.centres, ball.radii.max()) for name, ball in balls.items()}
    boxes |= {name: _box(at.centres, at.radii.max() + at.half.max()) for name, at in shells.items()}
    boxes |= {name: _box(filling.points, filling.spacing) for name, filling in fillings.items()}
    for a, b in _beside(scene, boxes):
        if a in shells and b in shells:
            _shells(a, shells[a], b, shells[b], ROUNDING * skin)
        elif a in fillings and b in fillings:
            _fluids(a, fillings[a], b, fillings[b])
        elif a in shells and b in balls:
            depth = _in_discs(balls[b], shells[a]) if solids[b].mesh is None else _in_skin(shells[a], solids[b])
            _tell(scene, b, a, depth, ROUNDING * skin)
        elif a in shells and b in fillings:  # a filling may touch its vessel
            depth = max(_in_discs(wet(b, sound), shells[a], sound) for sound in (True, False))
            _tell(scene, b, a, depth, (0.5 + ROUNDING) * skin)
        elif a in fillings and b in balls:
            _tell(scene, a, b, _in_balls(wet(a, False), balls[b]), (0.5 + ROUNDING) * skin)
        elif a in balls and b in balls:
            _tell(scene, a, b, _in_balls(balls[a], balls[b]), ROUNDING * skin)


def _skin(mesh: SolidMesh) -> np.ndarray:
    """(T, 3, 3) triangles of the surface of a solid, outward."""
    faces = mesh.faces.nodes[mesh.skin]
    four = faces[faces[:, 3] >= 0]
    return mesh.points[np.concatenate([faces[:, :3], four[:, [0, 2, 3]]])]


def _in_solid(balls: Balls, triangles: np.ndarray) -> float:
    """How deep the deepest ball lies in a closed surface [m]."""
    reach = float(balls.radii.max())
    low, high = triangles.min(axis=(0, 1)) - reach, triangles.max(axis=(0, 1)) + reach
    near = ((balls.centres >= low) & (balls.centres <= high)).all(axis=1)
    if not near.any():
        return 0.0
    centres, radii = balls.centres[near], balls.radii[near]
    away, number = away_from(centres, triangles, float(np.ptp(triangles, axis=(0, 1)).max()) + reach)
    corner = triangles[number]
    outward = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    height = np.linalg.norm(away, axis=1) * np.where((away * outward).sum(axis=1) < 0, -1.0, 1.0)
    return float((radii - height).max())


def _box(points: np.ndarray, reach: float) -> np.ndarray:
    """(2, 3) corners of the box about points with `reach` [m] around."""
    return np.array([points.min(axis=0) - reach, points.max(axis=0) + reach])


def _beside(scene: Scene, boxes: Mapping[str, np.ndarray]) -> list[tuple[str, str]]:
    """Pairs of different bodies that may meet and whose boxes touch, in the order of the scene: the others need no look."""
    names = [body.name for body in scene.bodies if body.name in boxes]
    corners, meets, found = np.array([boxes[name] for name in names]), meeting(scene), []
    for k, name in enumerate(names[:-1]):
        low, high = corners[k]
        after = np.flatnonzero(((corners[k + 1 :, 0] <= high) & (corners[k + 1 :, 1] >= low)).all(axis=1)) + k + 1
        found += [(name, names[m]) for m in after if meets(name, names[m])]
    return found


def _tell(scene: Scene, one: str, other: str, depth: float, allowed: float) -> None:
    """SceneError where a body starts deeper in another than allowed [m]."""
    if depth > allowed:
        first, second = scene.body(one), scene.body(other)
        raise SceneError(
            f"{first.what} '{one}' starts {1e3 * depth:.3g} mm inside {second.what} '{other}': move one of them away, "
            "pinballs touch at most"
        )


def _near(one: np.ndarray, other: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Numbers (i, j) of points of two sets within `reach` [m] of each other."""
    from scipy.spatial import cKDTree

    low, high = other.min(axis=0) - reach, other.max(axis=0) + reach
    inside = np.flatnonzero(((one >= low) & (one <= high)).all(axis=1))
    found = cKDTree(one[inside]).sparse_distance_matrix(cKDTree(other), reach, output_type="ndarray") if len(inside) else None
    return (np.zeros(0, int), np.zeros(0, int)) if found is None else (inside[found["i"]], found["j"])


def _alike(radii: np.ndarray) -> list[np.ndarray]:
    """Numbers of the balls in groups of about one radius: a wide ball must not widen the search of the small ones."""
    size = np.frexp(radii)[1]
    return [np.flatnonzero(size == one) for one in np.unique(size)]


def _in_balls(one: Balls, other: Balls) -> float:
    """How deep the balls of two bodies lie in each other at most [m], negative where they do not touch."""
    deepest = -np.inf
    for own in _alike(other.radii):
        centres, radii = other.centres[own], other.radii[own]
        i, j = _near(one.centres, centres, float(one.radii.max() + radii.max()))
        if len(i):
            deepest = max(deepest, float((one.radii[i] + radii[j] - np.linalg.norm(one.centres[i] - centres[j], axis=1)).max()))
    return deepest


def _in_discs(balls: Balls, at: Discs, sound: bool | None = None) -> float:
    """How deep balls lie in rounded discs at most [m]; of sound ones, of the others, or (None) of all."""
    chosen = np.flatnonzero(at.sound == sound) if sound is not None else np.arange(len(at.radii))
    if not len(chosen):
        return -np.inf
    deepest = -np.inf
    for own in _alike(balls.radii):
        centres, radii = balls.centres[own], balls.radii[own]
        i, j = _near(centres, at.centres[chosen], float(radii.max() + at.half[chosen].max() + at.radii[chosen].max()))
        if len(i):
            j = chosen[j]
            deepest = max(deepest, float((radii[i] + at.half[j] - _from_flat(centres[i], at, j)).max()))
    return deepest


def _from_flat(points: np.ndarray, at: Discs, j: np.ndarray) -> np.ndarray:
    """Distance [m] of points from the flat discs of the nodes j."""
    arm = points - at.centres[j]
    up = np.einsum("ni,ni->n", arm, at.normals[j])
    across = np.sqrt(np.maximum(np.einsum("ni,ni->n", arm, arm) - up**2, 0.0))
    return np.hypot(up, np.maximum(across - at.radii[j], 0.0))


def _shells(a: str, one: Discs, b: str, other: Discs, allowed: float) -> None:
    """SceneError where two shells cross, or are nearer than the mean of their thicknesses."""
    for first, second in ((one, other), (other, one)):
        ends = first.centres[first.edges]
        half = 0.5 * np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max(initial=0.0)
        e, j = _near(ends.mean(axis=1), second.centres, float(half + second.radii.max()))
        if len(e):
            up = np.einsum("nki,ni->nk", ends[e] - second.centres[j][:, None], second.normals[j])
            crosses = up[:, 0] * up[:, 1] < 0
            share = up[:, 0] / np.where(crosses, up[:, 0] - up[:, 1], 1.0)
            at = ends[e, 0] + share[:, None] * (ends[e, 1] - ends[e, 0])
            if (crosses & (np.linalg.norm(at - second.centres[j], axis=1) < second.radii[j])).any():
                raise SceneError(f"shell '{a}' starts across shell '{b}': move one of them away")
    least, thick = np.inf, 0.0
    for first, second in ((one, other), (other, one)):
        apart, both = _from_cells(first.centres, first.half, second)
        if apart - both < least - thick:
            least, thick = apart, both
    if least < thick - allowed:
        raise SceneError(
            f"shells '{a}' and '{b}' start {show(least, 'm')} apart, nearer than the mean of their thicknesses, {show(thick, 'm')}: "
            "move one of them away"
        )


def _in_skin(shell: Discs, solid: Solid) -> float:
    """How deep a shell lies in the surface of a rigid body at most [m]: its nodes in the triangles, or in the balls behind them, or those
    points of the surface that can be the first to touch in its cells."""
    assert solid.mesh is not None
    corners, tip = solid.walls()
    points = solid.mesh.points
    x = points[corners]
    middle = x.mean(axis=1)
    size = np.linalg.norm(x - middle[:, None], axis=2).max()
    deepest = _in_balls(Balls(shell.centres, np.zeros(len(shell.centres))), Balls(solid.places, solid.radii))
    i, f = _near(shell.centres, middle, float(shell.half.max() + size))
    if len(i):
        deepest = max(deepest, float((shell.half[i] - _from_triangles(shell.centres[i], x[f, 0], x[f, 1], x[f, 2])).max()))
    apart, half = _from_cells(points[tip], np.zeros(int(tip.sum())), shell)
    return max(deepest, half - apart)


def _from_cells(centres: np.ndarray, halves: np.ndarray, shell: Discs) -> tuple[float, float]:
    """Distance [m] of places from the cells of a shell, and the half thicknesses there and at the place, where they are nearest;
    (inf, 0) where none is near. As in couplings/contact/faces.py."""
    corners = np.where(shell.cells < 0, shell.cells[:, [2]], shell.cells)
    x, half = shell.centres[corners], shell.half[corners].mean(axis=1)
    middle = x[:, :3].mean(axis=1)
    four = shell.cells[:, 3] >= 0
    middle[four] = x[four].mean(axis=1)
    size = np.linalg.norm(x - middle[:, None], axis=2).max(axis=1)
    i, f = _near(centres, middle, float(halves.max(initial=0.0) + half.max(initial=0.0) + size.max(initial=0.0)))
    if not len(i):
        return np.inf, 0.0
    apart, both = np.full(len(i), np.inf), halves[i] + half[f]
    for k in range(4):
        one, two = x[f, k], x[f, (k + 1) % 4]  # of a triangle the side from its last corner to itself adds nothing
        apart = np.minimum(apart, _from_triangles(centres[i], one, two, middle[f]))
    nearest = int(np.argmin(apart - both))
    return float(apart[nearest]), float(both[nearest])


def _from_triangles(p: np.ndarray, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """(N,) distances [m] of the points p from the triangles a, b, c, all (N, 3): inside by the normal, else to the nearest side."""
    n = np.cross(b - a, c - a)
    area = np.einsum("ni,ni->n", n, n)
    inside, nearest = area > 0, np.full(len(p), np.inf)
    for one, two in ((a, b), (b, c), (c, a)):
        side = two - one
        inside &= np.einsum("ni,ni->n", np.cross(side, p - one), n) >= 0
        along = np.einsum("ni,ni->n", p - one, side) / np.maximum(np.einsum("ni,ni->n", side, side), 1e-300)
        nearest = np.minimum(nearest, np.linalg.norm(p - one - np.clip(along, 0.0, 1.0)[:, None] * side, axis=1))
    up = np.abs(np.einsum("ni,ni->n", p - a, n)) / np.sqrt(np.maximum(area, 1e-300))
    return np.where(inside, up, nearest)


def _fluids(a: str, one: Filling, b: str, other: Filling) -> None:
    """SceneError where two fluids fill one place."""
    i, _ = _near(one.points, other.points, SAME_PLACE * min(one.finest, other.finest))
    if len(i):
        raise SceneError(
            f"fluids '{a}' and '{b}' both fill the place of {len(np.unique(i))} particles: a place holds one of them, so change a fill"
        )
