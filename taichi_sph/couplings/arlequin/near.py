"""Which elements of a shell must become particles, where its patch grows.

**Damage.** The law's own damage D of an element, or of a particle of the overlap, reaches a tenth of D_c.

**A striker.** A blow is over before damage tells of it: an element is heavy, and a striker that meets its nodes gives them as much of its
momentum as a sheet of the element's width would take. So elements become particles before a striker meets them, if it is fast enough to
take the sheet out of elasticity. A sheet that is struck at the speed v is strained by eps, v = sqrt(2) c eps^(3/4), where waves of tension
run ahead of the corner that the striker pushes (Smith, McCrackin and Schiefer 1958, small eps); c = sqrt(E / rho), and eps is the yield
strain, or that where a brittle law's damage begins. v is relative to the element: a shell that flies onto what stands still is struck too.
Rigid bodies and solids are strikers; other shells and water are none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ... import runtime
from ...bodies.body import Group, Now
from ...bodies.shell.parts import Split, shapes
from ...scene.laws import Material
from ...scene.schema import Scene

NEAR = 0.1  # of D_c: an element whose damage has come so far becomes particles
OFTEN = 5  # steps between two looks
AHEAD = 2  # looks: a striker that could be there by then is near
ACROSS = 5  # places along the side of an element from which a striker's distance is taken
AT_ONCE = 20_000  # pairs of a striker and an element


def fastest_elastic(material: Material) -> float:
    """Speed of a striker that leaves a sheet of the material elastic [m/s]."""
    strength, damage = material.strength, material.damage
    begins = float(getattr(damage, "threshold", 0.0))  # of damage, in strain: brittle laws have no strength
    if strength is not None:
        stress = strength.points[0][1] if strength.kind == "table" else strength.A if hasattr(strength, "A") else strength.yield_stress
        begins = stress / material.young
    return float(np.sqrt(2.0 * material.young / material.density) * begins**0.75)


class Near:
    """Of a shell whose patch grows. groups: all of the scene."""

    def __init__(self, scene: Scene, groups: Sequence[Group], name: str, split: Split):
        self.split, self.slow = split, fastest_elastic(scene.body(name).material)
        self.meets: Callable[[str], bool] = lambda other: scene.met(name, other).meet
        own = scene.body(name)
        self.strikers = [group for group in groups if not any(scene.body(span.name) is own for span in group.bodies)]
        at = np.linspace(-1.0, 1.0, ACROSS)
        r, s = (a.ravel() for a in np.meshgrid(at, at))
        self.places = shapes(r, s)
        corner = split.whole.cells[split.cells]
        self.corner = split.number[np.where(corner < 0, corner[:, :1], corner)]
        self.width, self.half = split.whole.spacing, 0.5 * own.thickness

    def damaged(self, elements: Any, particles: Any, limit: float) -> np.ndarray:
        """(M,) bool of the whole mesh: elements whose damage has come near `limit`, or that of a particle of theirs in the overlap.
        particles: their group, None where there is none yet."""
        split = self.split
        near = np.zeros(len(split.patched), bool)
        outer = runtime.get(elements.points.damage, elements.points.n) >= NEAR * limit
        near[split.cells] = outer.reshape(len(split.cells), -1).any(axis=1)
        if particles is not None:
            inner = runtime.get(particles.points.damage, particles.points.n) >= NEAR * limit
            near[split.fine.parent[inner & (split.of_particles < 1.0)]] = True
        return near

    def struck(self, elements: Any, now: Now) -> np.ndarray:
        """(M,) bool of the whole mesh: elements that a fast striker can meet before the next look but one. Fast, and how far it comes, is
        said of its velocity relative to the corners of the element."""
        from scipy.spatial import cKDTree

        near = np.zeros(len(self.split.patched), bool)
        tips = [group.tips(self.meets) for group in self.strikers]
        if not sum(len(found.places) for found in tips):
            return near
        at, radius, velocity, turning = (np.concatenate(each) for each in zip(*tips))
        nodes = elements.nodes
        v = _in_space(runtime.get(nodes.v, nodes.n).astype(np.float64))
        most = np.linalg.norm(velocity, axis=1) + turning + float(np.linalg.norm(v, axis=1).max())
        fast = most > self.slow
        if not fast.any():
            return near
        at, radius, velocity, turning, most = (values[fast] for values in (at, radius, velocity, turning, most))
        ahead, least = AHEAD * OFTEN * now.dt, 0.5 * self.width / (ACROSS - 1)
        x = (elements.mesh.points + _in_space(runtime.get(nodes.u, nodes.n)))[self.corner]
        middle = x.mean(axis=1)
        size = float(np.linalg.norm(x - middle[:, None], axis=2).max())
        within = radius + self.half + np.maximum(ahead * most, least) + size
        found = cKDTree(middle).query_ball_point(at, within)
        tip = np.repeat(np.arange(len(at)), [len(cells) for cells in found])
        cell = np.array([k for cells in found for k in cells], np.int64)
        for first in range(0, len(tip), AT_ONCE):
            t, c = tip[first : first + AT_ONCE], cell[first : first + AT_ONCE]
            speed = np.linalg.norm(velocity[t, None] - v[self.corner[c]], axis=2).max(axis=1) + turning[t]
            away = np.linalg.norm(np.einsum("pc,mci->mpi", self.places, x[c]) - at[t, None], axis=2).min(axis=1) - radius[t]
            met = (speed > self.slow) & (away <= self.half + np.maximum(ahead * speed, least))
            near[self.split.cells[c[met]]] = True
        return near


def _in_space(values: np.ndarray) -> np.ndarray:
    """(N, 3) of (N, 2) or (N, 3)."""
    return np.pad(values, ((0, 0), (0, 3 - values.shape[1])))
