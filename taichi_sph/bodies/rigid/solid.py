"""A rigid body as it is computed: mass, centre, inertia, and the balls by which it is met. NumPy only.

For a closed surface, mass, centre and inertia are sums over the tetrahedra that its triangles form with one point. Shells meet
its triangles themselves. What has no faces (water, other rigid bodies) meets balls, which stand behind
the surface and touch it from there. Their radius is `RADIUS` spacings, less where the body is thin, and they stand `PITCH` radii apart.
Between four of them a flat face is lower by 0.13 radii. Edges and corners are rounded by one radius, and so is a point, in which none fits.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import SceneError
from ...geometry.mesh import SurfaceMesh
from ...geometry.near import away_from, moved_off, sampled, triangles_of
from ...geometry.surfaces import mesh_of
from ...scene.units import show
from .said import LIKE, Rigid

RADIUS, PITCH = 1.0, 0.7
HALVINGS = 3  # of the radius, until the balls fit
POINTED, BESIDE = 0.01, 3.0  # share of the balls that may be left out in points, and radii that another one may be away there
FLAT = 0.01  # rad that two triangles fold outward: less is plane
MOST = 20_000  # balls of a body


@dataclass(frozen=True)
class Solid:
    """said; mass [kg], centre (3,) [m] and moments (3, 3) [kg m2] about it; places (B, 3) and radii (B,) [m] of its balls, all at t = 0.

    mesh: the surface that is met, its normals to the side where it is met; None of a body of pinballs."""

    said: Rigid
    mass: float
    centre: np.ndarray
    moments: np.ndarray
    places: np.ndarray
    radii: np.ndarray
    mesh: SurfaceMesh | None = None

    @property
    def name(self) -> str:
        return self.said.name

    @property
    def reach(self) -> float:
        """Of its farthest point from the centre [m]."""
        return float((np.linalg.norm(self.places - self.centre, axis=1) + self.radii).max())

    def walls(self) -> tuple[np.ndarray, np.ndarray]:
        """(T, 3) points of the surface at the corners of its triangles, and (V,) whether one can be the first to touch: those on a border
        or a convex edge. What is plane or hollow about a point is met by its own nodes first."""
        assert self.mesh is not None
        cells, x = self.mesh.cells, self.mesh.points
        corners = np.concatenate([cells[:, :3], cells[cells[:, 3] >= 0][:, [0, 2, 3]]])
        normal = np.cross(x[corners[:, 1]] - x[corners[:, 0]], x[corners[:, 2]] - x[corners[:, 0]])
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        ends = np.concatenate([corners[:, [k, (k + 1) % 3]] for k in range(3)])
        across = np.concatenate([corners[:, (k + 2) % 3] for k in range(3)])
        own = np.tile(np.arange(len(corners)), 3)
        _, edge = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
        order = np.argsort(edge, kind="stable")
        twice = np.flatnonzero(edge[order][1:] == edge[order][:-1])
        one, two = order[twice], order[twice + 1]
        side, arm = x[ends[one, 1]] - x[ends[one, 0]], x[across[two]] - x[ends[one, 0]]
        folds = np.einsum("ni,ni->n", arm, normal[own[one]])
        width = np.linalg.norm(np.cross(arm, side), axis=1) / np.linalg.norm(side, axis=1)
        tip = np.zeros(len(x), bool)
        tip[ends[one[folds < -FLAT * width]]] = True
        tip[ends[np.bincount(edge)[edge] == 1]] = True
        return corners, tip


def solid_of(body: Rigid, scene: Any) -> Solid:
    """A rigid body of a scene."""
    if body.surface is None:
        places, radii = np.array([p.centre for p in body.pinballs]), np.array([p.radius for p in body.pinballs])
        return Solid(body, body.mass or LIKE, body.centre, body.moments, places, radii)
    mesh, key = mesh_of(body, scene), scene.key_of(body)
    closed = not (mesh.edges.sides[:, 1] < 0).any()
    if body.free and not closed:
        raise SceneError(f"{key}.surface is open, so it has no volume; close it, or let the body be held or driven")
    if closed and mesh.volume < 0:
        raise SceneError(f"{key}.surface: its normals point inward; turn its cells round, so that they point outward")
    mass, centre, moments = LIKE, mesh.points.mean(axis=0), np.eye(3)
    if closed:
        volume, centre, moments = _of_volume(mesh)
        mass = body.mass or (body.density or LIKE / volume) * volume
        moments = moments * (mass / volume)
    elif body.mass is not None:
        mass = body.mass
    if body.inertia is not None:
        moments = np.diag(body.inertia).astype(float)
    if body.side == "inside":
        mesh = _turned(mesh)
    places, radius = _balls(mesh, scene.numerics_of(body).spacing, key)
    return Solid(body, mass, centre, moments, places, np.full(len(places), radius), mesh)


def _of_volume(mesh: SurfaceMesh) -> tuple[float, np.ndarray, np.ndarray]:
    """Volume [m3], centre [m], and the inertia about it for a density of one [m5]."""
    middle = mesh.points.mean(axis=0)
    a = triangles_of(mesh) - middle
    six = np.einsum("ti,ti->t", a[:, 0], np.cross(a[:, 1], a[:, 2]))
    volume = float(six.sum() / 6.0)
    first = np.einsum("t,tki->i", six, a) / 24.0
    total = a.sum(axis=1)
    second = (np.einsum("t,tki,tkj->ij", six, a, a) + np.einsum("t,ti,tj->ij", six, total, total)) / 120.0  # integral of x x
    centre = first / volume
    second -= volume * np.outer(centre, centre)
    return volume, middle + centre, np.trace(second) * np.eye(3) - second


def _turned(mesh: SurfaceMesh) -> SurfaceMesh:
    """The surface with its normals to the other side."""
    four = mesh.cells[:, 3] >= 0
    cells = mesh.cells[:, [0, 2, 1, 3]].copy()
    cells[four] = mesh.cells[four][:, [0, 3, 2, 1]]
    return SurfaceMesh(mesh.points, cells, mesh.spacing, -mesh.node_normals)


def _balls(mesh: SurfaceMesh, spacing: float, key: str) -> tuple[np.ndarray, float]:
    """(B, 3) places of the balls behind a surface, and their radius [m]."""
    from scipy.spatial import cKDTree

    walls = triangles_of(mesh)
    half, facing = np.zeros(len(walls)), np.cross(walls[:, 1] - walls[:, 0], walls[:, 2] - walls[:, 0])
    radius = RADIUS * spacing
    for _ in range(HALVINGS):
        at, areas = sampled(mesh, PITCH * radius)
        if len(at) > MOST:
            break
        normal = areas / np.linalg.norm(areas, axis=1)[:, None]
        places = moved_off(at - radius * normal, walls, half, radius)
        away, nearest = away_from(places, walls, 1.01 * radius)
        near = np.isfinite(away).all(axis=1)  # the others are farther from the surface than a radius
        behind = np.einsum("ni,ni->n", np.where(near[:, None], away, places - at), np.where(near[:, None], facing[nearest], normal)) < 0
        fits = (np.linalg.norm(away, axis=1) > 0.95 * radius) & behind
        if fits.all() or ((~fits).mean() <= POINTED and cKDTree(places[fits]).query(at[~fits])[0].max() <= BESIDE * radius):
            return places[fits], radius
        radius *= 0.5
    else:
        raise SceneError(
            f"{key}.surface is thinner than {show(4 * radius, 'm')} somewhere, where no pinballs fit behind it; lower its spacing"
        )
    raise SceneError(
        f"{key} takes more than {MOST} pinballs of {show(radius, 'm')}, which its thickness or spacing asks for; raise its spacing"
    )
