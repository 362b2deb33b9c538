"""Arlequin as a coupling of the world: elements and particles of one shell or solid, tied where they overlap.

Damage is watched. Elements do not tear, and where particles of the overlap break, the elements under them would hold on. A real shell
tears there. So the run stops where D_r reaches D_c in an element, or where a particle of the overlap breaks. A crack among the particles
changes the edge means of the sides near it. Where the crack comes near sides with a jump of the weight, the constraints are made anew.
Velocities before do not obey those, so the multipliers of that step do work, -1/2 l . C v_n-1/2, which is booked as `overlap`. l is an
impulse. It changes 1/2 m v_n-1/2 . v_n+1/2 by 1/2 (-C^T l) . (v_n-1/2 + v_n+1/2), and C v_n+1/2 = 0. So the steps on both sides do not
matter: times dt_n-1/2 / kick, as the work of a force along its path, it would be a third too much where the step is halved.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp

from ... import runtime
from ...bodies.body import Entries, Group, Now, holding
from ...bodies.shell.parts import Split
from ...errors import RunStopped, SceneError
from ...pool import Pool
from ...scene.schema import Scene
from ...scene.units import show
from ..coupling import Coupling
from .constraints import Constraints, Sides, constraints
from .near import OFTEN, Near
from .solid import TiedSolid
from .tied import Tied, named


def couplings(scene: Scene, groups: Sequence[Group], own: Sequence[Any]) -> list[Coupling]:
    """One for each shell of elements with a patch, which may not have begun, and for each solid with one. SceneError on devices whose
    shaders cut the long sums of its factor off."""
    shells = [shell for shell in scene.shells if shell.patch is not None]
    solids = [solid for solid in scene.solids if solid.patch is not None]
    if (shells or solids) and not runtime.functions_of_64_bits():
        whose = f"shell '{shells[0].name}'" if shells else f"solid '{solids[0].name}'"
        raise SceneError(f"arch: the patch of {whose} is not possible on '{runtime.current().arch}'; use --arch cpu or cuda")
    made: list[Coupling] = [
        (ArlequinCoupling if shell.patch is not None and shell.patch.there else Waiting)(scene, groups, shell.name, k)
        for k, shell in enumerate(shells, start=1)
    ]
    return made + [TiedSolid(scene, groups, solid.name, k) for k, solid in enumerate(solids, start=1 + len(made))]


EVERY = 50  # steps between two looks at damage, where the patch does not grow
OUTSIDE = "% of D_c outside of the patch"


class Watch(Pool):
    """worst: the largest D_r / D_c so far of the elements and of the particles of the overlap; taken: energy that constraints took when
    they were made anew [J]. Constraints follow from the links that are cut, also after a restart."""

    kept = ("worst", "taken")

    def __init__(self, coupling: ArlequinCoupling | Waiting, name: str):
        super().__init__(name)
        self.coupling, self.worst, self.taken = coupling, 0.0, 0.0

    def renew(self) -> None:
        self.coupling.follow()


class Waiting(Coupling):
    """Of a shell whose patch has not begun (patch = "auto"): all its elements, until damage or a striker comes near one of them."""

    def __init__(self, scene: Scene, groups: Sequence[Group], name: str, number: int):
        self.name = name
        self.elements: Any = holding(groups, name)[0]
        self.split = self.elements.shells[0].split
        self.critical = scene.body(name).material.critical_damage
        self.near = Near(scene, groups, name, self.split)
        self.wanted: tuple[int, ...] = ()
        self.watch = Watch(self, f"{named(number)}.watch")

    def follow(self) -> None:
        """There are no constraints."""

    def entries(self) -> Entries:
        return Entries(numerical={"overlap": self.watch.taken})

    def foresee(self, now: Now) -> None:
        self._ask(now)

    def meet(self, now: Now) -> None:
        if now.step % OFTEN == 0:
            points = self.elements.points
            delayed = runtime.get(points.delayed, points.n)
            self.watch.worst = max(self.watch.worst, float(delayed.max()) / self.critical)
            self._ask(now)
            if not self.wanted and delayed.max() >= self.critical:
                place = self.elements.mesh.centres[int(delayed.argmax()) // (points.n // self.elements.cells.n)]
                raise RunStopped(
                    f"shell '{self.name}': at ({', '.join(show(x, 'm') for x in place)}) an element would break at t = {now.time:.6g} s, "
                    "and no patch can begin there: beside it there is a triangle, a sharp edge or a support, or it is at the border of "
                    "a small shell; refine the mesh there"
                )

    def _ask(self, now: Now) -> None:
        near = self.near.damaged(self.elements, None, self.critical) | self.near.struck(self.elements, now)
        if near.any():
            self.wanted = self.split.wider(near)

    def status(self) -> dict[str, int]:
        """The columns of a history are those that it begins with: those of particles too."""
        return {"broken": 0, "loose nodes": 0, OUTSIDE: round(100 * self.watch.worst)}

    def pools(self) -> list[Pool]:
        return [self.watch]


class ArlequinCoupling(Tied):
    """The parts of a shell."""

    def __init__(self, scene: Scene, groups: Sequence[Group], name: str, number: int):
        super().__init__(scene, groups, name, number)
        self.seen, self.anew = 0, False
        self.critical = self.particles.shells[0].said.material.critical_damage
        self.grows = self.split.patch.grows
        self.near_damage = Near(scene, groups, name, self.split) if self.grows else None
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

    def follow(self) -> bool:
        """The constraints of the edge means as they are; whether a crack has changed them."""
        now = self._cut()
        if not (now != self.cut).any():
            return False
        self.cut, self.factor = now, self.factorised()
        self.tie.put(self.factor)
        return True

    def meet(self, now: Now) -> None:
        """What broke, and what is damaged."""
        if self.particles.ruptures != self.seen:
            self.seen = self.particles.ruptures
            points = self.particles.points
            broken = runtime.get(points.broken, points.n) > 0
            if (broken & (self.split.of_particles < 1.0)).any():
                self._stop(self.split.fine.mesh.centres[broken & (self.split.of_particles < 1.0)][0], now, "the overlap breaks")
            self.anew = self.follow()
        if self.critical is not None and now.step % (OFTEN if self.grows else EVERY) == 0:
            self._look(now)

    def _look(self, now: Now) -> None:
        inner, outer = (runtime.get(group.points.delayed, group.points.n) for group in (self.particles, self.elements))
        worst = max(float(outer.max()), float(inner[self.split.of_particles < 1.0].max())) / self.critical
        self.watch.worst = max(self.watch.worst, worst)
        if self.grows:
            self._ask(now)
            if self.wanted:
                return
        if outer.max() >= self.critical:
            element = int(outer.argmax()) // (self.elements.points.n // self.elements.cells.n)
            self._stop(self.elements.mesh.centres[element], now, "an element would break")

    def _ask(self, now: Now) -> None:
        """For the elements near rupture or a striker, of the overlap too, to become particles."""
        watched = self.near_damage
        assert watched is not None
        near = watched.damaged(self.elements, self.particles, self.critical) | watched.struck(self.elements, now)
        if near.any() and (wider := self.split.wider(near)) != self.split.patch.cells:
            self.wanted = wider

    def _stop(self, place: np.ndarray, now: Now, what: str) -> None:
        """RunStopped: how far beyond the particles alone, or why a patch that grows has not come so far."""
        inside = self.split.fine.mesh.centres[self.split.of_particles >= 1.0]
        beyond = float(np.linalg.norm(inside - place, axis=1).min())
        at = ", ".join(show(x, "m") for x in place)
        if self.grows:
            raise RunStopped(
                f"shell '{self.name}': at ({at}) {what} at t = {now.time:.6g} s, and its patch, which grows by itself, cannot go there: "
                "beside it there is a triangle, a sharp edge or a support, or it is among the last elements, at the border of the shell; "
                "make the elements finer there, or the whole shell of particles (formulation = 'galerkin', no patch)"
            )
        raise RunStopped(
            f"shell '{self.name}': its patch is too small: at ({at}) {what} at t = {now.time:.6g} s, {show(beyond, 'm')} outside of the "
            f"particles; let the patch reach {show(beyond + 3 * self.split.whole.spacing, 'm')} farther there"
        )

    def correct(self, now: Now) -> None:
        apart = self.apart() if self.anew else ()
        super().correct(now)
        if apart:  # of velocities; that on directors is booked in every step
            self.watch.taken += 0.5 * float((self.tie.multipliers()[:, : apart[0].shape[1]] * apart[0]).sum())
        self.anew = False

    def entries(self) -> Entries:
        return Entries(numerical={"overlap": self.watch.taken + self.tie.work()})

    def status(self) -> dict[str, int]:
        """How near damage is. From the first step on: columns of a history are those that it began with."""
        return {} if self.critical is None else {OUTSIDE: round(100 * self.watch.worst)}

    def report(self) -> dict[str, float]:
        """damage: the largest D_r / D_c of elements and overlap; velocities, directors: the largest difference that is left, of 1;
        constraints: how many."""
        velocities, directors = self.left()
        return {"damage": self.watch.worst, "velocities": velocities, "directors": directors, "constraints": self.tie.n_rows}

    def pools(self) -> list[Pool]:
        return [self.tie, self.watch]
