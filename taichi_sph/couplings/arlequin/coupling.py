"""Arlequin as a coupling of the world: elements and particles of one shell or solid, tied where they overlap.

Damage is watched. Elements do not tear, and where particles of the overlap break, the elements under them would hold on. A real shell
tears there. So the run stops where D_r reaches D_c in an element, or where a particle of the overlap breaks. A crack among the particles
changes the edge means of the sides near it. Where the crack comes near sides with a jump of the weight, the constraints are made anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp

from ... import runtime
from ...bodies.body import Group, Now
from ...bodies.shell.parts import Split
from ...errors import RunStopped, SceneError
from ...pool import Pool
from ...scene.schema import Scene
from ...scene.units import show
from .constraints import Constraints, Sides, constraints
from .solid import TiedSolid
from .tied import Tied


def couplings(scene: Scene, groups: Sequence[Group], own: Sequence[Any]) -> list[Tied]:
    """One for each shell or solid of elements with a patch. SceneError on devices whose shaders cut the long sums of its factor off."""
    shells = [shell.name for shell in scene.shells if shell.patch is not None]
    solids = [solid.name for solid in scene.solids if solid.patch is not None]
    if (shells or solids) and not runtime.functions_of_64_bits():
        whose = f"shell '{shells[0]}'" if shells else f"solid '{solids[0]}'"
        raise SceneError(f"arch: the patch of {whose} is not possible on '{runtime.current().arch}'; use --arch cpu or cuda")
    made: list[Tied] = [ArlequinCoupling(scene, groups, name, k) for k, name in enumerate(shells, start=1)]
    return made + [TiedSolid(scene, groups, name, k) for k, name in enumerate(solids, start=1 + len(made))]


EVERY = 50  # steps between two looks at damage
OFTEN = 5  # where the patch grows
NEAR = 0.1  # of D_c: an element whose damage has come so far becomes particles, where the patch grows


class Watch(Pool):
    """worst: the largest D_r / D_c so far of the elements and of the particles of the overlap. Constraints follow from the links that are
    cut, also after a restart."""

    kept = ("worst",)

    def __init__(self, coupling: ArlequinCoupling, name: str):
        super().__init__(name)
        self.coupling, self.worst = coupling, 0.0

    def renew(self) -> None:
        self.coupling.follow()


class ArlequinCoupling(Tied):
    """The parts of a shell."""

    def __init__(self, scene: Scene, groups: Sequence[Group], name: str, number: int):
        super().__init__(scene, groups, name, number)
        self.seen = 0
        self.critical = self.particles.shells[0].said.material.critical_damage
        self.grows = self.split.patch.grows
        self.wanted: tuple[int, ...] = ()  # elements, beside those of the regions, that must be particles from now on
        self.watch = Watch(self, f"{self.tie.name}.watch")
        rows = self.particles.internal.rows
        start = runtime.get(rows.start, rows.n + 1)
        self.near = np.concatenate([np.arange(start[e], start[e + 1]) for e in Sides.of(self.split).edge])
        self.cut = self._cut()

    @property
    def split(self) -> Split:
        """The parts of the shell."""
        return self.particles.shells[0].split

    @property
    def directors(self) -> bool:
        return self.split.patch.directors

    def rows(self) -> Constraints:
        """From the edge means of the particles as they are now."""
        rows, nodes = self.particles.internal.rows, self.particles.nodes
        coef, source = (runtime.get(field, rows.pairs) for field in (rows.coef, rows.source))
        start = runtime.get(rows.start, rows.n + 1)
        means = sp.csr_array((coef.astype(np.float64), source, start), shape=(rows.n, nodes.n))[: self.particles.internal.n_edges]
        normals = self.split.fine.mesh.node_normals
        return constraints(self.split, means, self.split.fine.mesh.points, normals)

    def _cut(self) -> np.ndarray:
        """What is cut of the links of sides with a jump of the weight."""
        rows = self.particles.internal.rows
        return runtime.get(rows.cut, rows.pairs)[self.near]

    def follow(self) -> None:
        """The constraints of the edge means as they are, where a crack has changed them."""
        now = self._cut()
        if (now != self.cut).any():
            self.cut, self.factor = now, self.factorised()
            self.tie.put(self.factor)

    def meet(self, now: Now) -> None:
        """What broke, and what is damaged."""
        if self.particles.ruptures != self.seen:
            self.seen = self.particles.ruptures
            points = self.particles.points
            broken = runtime.get(points.broken, points.n) > 0
            if (broken & (self.split.of_particles < 1.0)).any():
                self._stop(self.split.fine.mesh.centres[broken & (self.split.of_particles < 1.0)][0], now, "the overlap breaks")
            self.follow()
        if self.critical is not None and now.step % (OFTEN if self.grows else EVERY) == 0:
            self._look(now)

    def _look(self, now: Now) -> None:
        inner, outer = (runtime.get(group.points.delayed, group.points.n) for group in (self.particles, self.elements))
        worst = max(float(outer.max()), float(inner[self.split.of_particles < 1.0].max())) / self.critical
        self.watch.worst = max(self.watch.worst, worst)
        if self.grows:
            self._ask()
            if self.wanted:
                return
        if outer.max() >= self.critical:
            element = int(outer.argmax()) // (self.elements.points.n // self.elements.cells.n)
            self._stop(self.elements.mesh.centres[element], now, "an element would break")

    def _ask(self) -> None:
        """For the elements near rupture, of the overlap too, to become particles."""
        split, limit = self.split, NEAR * self.critical
        outer, inner = (runtime.get(group.points.damage, group.points.n) >= limit for group in (self.elements, self.particles))
        near = np.zeros(len(split.patched), bool)
        near[split.cells] = outer.reshape(len(split.cells), -1).any(axis=1)
        near[split.fine.parent[inner & (split.of_particles < 1.0)]] = True
        if near.any() and (wider := split.wider(near)) != split.patch.cells:
            self.wanted = wider

    def _stop(self, place: np.ndarray, now: Now, what: str) -> None:
        """RunStopped: how far beyond the particles alone."""
        inside = self.split.fine.mesh.centres[self.split.of_particles >= 1.0]
        beyond = float(np.linalg.norm(inside - place, axis=1).min())
        at = ", ".join(show(x, "m") for x in place)
        raise RunStopped(
            f"shell '{self.name}': its patch is too small: at ({at}) {what} at t = {now.time:.6g} s, {show(beyond, 'm')} outside of the "
            f"particles; let the patch reach {show(beyond + 3 * self.split.whole.spacing, 'm')} farther there"
        )

    def status(self) -> dict[str, int]:
        """How near damage is. From the first step on: columns of a history are those that it began with."""
        return {} if self.critical is None else {"% of D_c outside of the patch": round(100 * self.watch.worst)}

    def report(self) -> dict[str, float]:
        """damage: the largest D_r / D_c of elements and overlap; velocities, directors: the largest difference that is left, of 1;
        constraints: how many."""
        velocities, directors = self.left()
        return {"damage": self.watch.worst, "velocities": velocities, "directors": directors, "constraints": self.tie.n_rows}

    def pools(self) -> list[Pool]:
        return [self.tie, self.watch]
