"""Elements and particles of one body, tied in every step: what shells and solids have in common."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ... import launch, runtime
from ...bodies.body import Group, Now, holding
from ...bodies.shell.said import PARTICLES
from ...errors import SceneError
from ...pool import Pool
from ...scene.schema import Scene
from ..coupling import Coupling
from .constraints import Constraints
from .factor import LEAST, Factor, factorised
from .tie import Tie

STARTING = 3  # sweeps over the directors of the velocities that are given


def named(number: int) -> str:
    """Of the pool of the coupling with that number."""
    return f"arlequin_{number}" if number > 1 else "arlequin"


class Tied(Coupling):
    """groups: that of the elements and that of the particles; tie: the constraints at work; seconds: of wall clock that they took."""

    def __init__(self, scene: Scene, groups: Sequence[Group], name: str, number: int):
        self.name = name
        self.groups: tuple[Any, Any] = (holding(groups, name)[0], holding(groups, name + PARTICLES)[0])
        self.elements, self.particles = self.groups
        one, two = (runtime.get(group.nodes.mass, group.nodes.n).astype(np.float64) for group in self.groups)
        self.mass = one, two
        self.factor = self.factorised()
        if self.factor.smallest < LEAST:
            raise SceneError(
                f"{scene.key_of(scene.body(name))}.patch: the constraints of its overlap depend on each other (a pivot of "
                f"{self.factor.smallest:.2g}); choose another region or another weight"
            )
        bends = self.elements.nodes.bends
        self.tie = Tie(self.factor, self.mass, bends, self.directors, named(number))
        self._loose(scene)
        self.seconds = 0.0

    @property
    def directors(self) -> bool:
        """Whether they are tied too."""
        return False

    def rows(self) -> Constraints:
        """C of the parts as they are now."""
        raise NotImplementedError

    def factorised(self) -> Factor:
        """The constraints of the parts as they are now, with H."""
        return factorised(self.rows(), *self.mass)

    def _loose(self, scene: Scene) -> None:
        """SceneError where a support holds a node that is tied."""
        for group, used in zip(self.groups, self.tie.used):
            held = int((runtime.get(group.nodes.fixed, group.nodes.n)[used] > 0).sum())
            if held:
                raise SceneError(
                    f"{scene.key_of(scene.body(self.name))}.patch: a prescribed motion holds {held} nodes that the overlap ties; move the "
                    "patch three of its spacings away from the support"
                )

    def start(self) -> None:
        """The velocities, at t = 0 or where the patch has grown, as near as the constraints let them be."""
        self._project("v", False)
        if self.tie.turns:
            for _ in range(STARTING):
                self._project("omega", True)

    def _project(self, name: str, turning: bool) -> None:
        fields = [getattr(group.nodes, name) for group in self.groups]
        now = [runtime.get(field, group.nodes.n) for field, group in zip(fields, self.groups)]
        if not any(values.any() for values in now):
            return
        normals = [_directors(group) for group in self.groups] if turning else [np.zeros(3)] * 2
        rates = [np.cross(w, n) for w, n in zip(now, normals)] if turning else now
        rows, L = self.factor.rows, self.factor.dense
        C = rows.elements, -1.0 * rows.particles
        lengths = np.ones(len(self.mass[0])), rows.length
        l = np.linalg.solve(L @ L.T, rows(rates[0], rows.length[:, None] * rates[1] if turning else rates[1]))
        for field, values, n, part, mass, length in zip(fields, rates, normals, C, self.mass, lengths):
            change = (part.T @ l) / mass[:, None]
            after = np.cross(n, values - length[:, None] * change) if turning else values - change
            runtime.put(field, after.astype(values.dtype))

    def correct(self, now: Now) -> None:
        began = launch.working()
        self.tie.act(self.groups, now.kick, now.dt_before > 0.0)
        self.seconds += launch.working() - began

    def rates(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Of elements and of particles: velocities, and rates of directors where those are tied, with their lengths."""
        found = []
        for turning in (False, True)[: 2 if self.tie.turns else 1]:
            values = []
            for group in self.groups:
                nodes = group.nodes
                v = runtime.get(nodes.omega if turning else nodes.v, nodes.n).astype(np.float64)
                if turning:
                    v = np.cross(v, _directors(group))
                values.append(v)
            found.append((values[0], self.factor.rows.length[:, None] * values[1] if turning else values[1]))
        return found

    def apart(self) -> list[np.ndarray]:
        """(R, c) C v, and C d: what the velocities are off the constraints."""
        return [self.factor.rows(*rates) for rates in self.rates()]

    def left(self) -> tuple[float, float]:
        """Largest difference of what is tied: velocities over the largest one, and rates of directors over the largest one."""
        rows, found = self.factor.rows, []
        for of_elements, of_particles in self.rates():
            size = np.sqrt(max(float(((abs(rows.elements) @ np.abs(of_elements)) ** 2).sum(axis=1).max()), 1e-300))
            found.append(float(np.abs(rows(of_elements, of_particles)).max()) / size)
        return found[0], found[-1] if self.tie.turns else 0.0

    def pools(self) -> list[Pool]:
        return [self.tie]


def _directors(group: Any) -> np.ndarray:
    """(N, 3) n of the nodes of a group."""
    nodes = group.nodes
    return runtime.get(nodes.N, nodes.n).astype(np.float64) + runtime.get(nodes.d, nodes.n)
