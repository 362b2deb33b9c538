"""Arlequin as a coupling of the world: elements and particles of one shell, tied where they overlap."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp

from ... import runtime
from ...bodies.body import Group, Now, holding
from ...bodies.shell.said import PARTICLES
from ...errors import SceneError
from ...pool import Pool
from ...scene.schema import Scene
from ..coupling import Coupling
from .constraints import constraints
from .factor import LEAST, Factor, factorised
from .tie import SWEEPS, Tie


def couplings(scene: Scene, groups: Sequence[Group], own: Sequence[Any]) -> list[ArlequinCoupling]:
    """One for each shell of elements with a patch."""
    patched = [shell for shell in scene.shells if shell.patch is not None]
    return [ArlequinCoupling(scene, groups, shell.name, k) for k, shell in enumerate(patched, start=1)]


class ArlequinCoupling(Coupling):
    """groups: that of the elements and that of the particles; tie: the constraints at work."""

    def __init__(self, scene: Scene, groups: Sequence[Group], name: str, number: int):
        self.name = name
        self.groups: tuple[Any, Any] = (holding(groups, name)[0], holding(groups, name + PARTICLES)[0])
        self.elements, self.particles = self.groups
        self.split = self.particles.shells[0].split
        self.mass = tuple(runtime.get(group.nodes.mass, group.nodes.n).astype(np.float64) for group in self.groups)
        self.factor = self._factor()
        if self.factor.smallest < LEAST:
            raise SceneError(
                f"{scene.key_of(scene.body(name))}.patch: the constraints of its overlap depend on each other (a pivot of "
                f"{self.factor.smallest:.2g}); choose another region or another weight"
            )
        bends = self.elements.nodes.bends
        self.tie = Tie(self.factor, self.mass, bends, self.split.patch.directors, f"arlequin_{number}" if number > 1 else "arlequin")
        self._loose(scene)

    def _factor(self) -> Factor:
        """From the edge means of the particles as they are now."""
        rows, nodes = self.particles.internal.rows, self.particles.nodes
        coef, source = (runtime.get(field, rows.pairs) for field in (rows.coef, rows.source))
        start = runtime.get(rows.start, rows.n + 1)
        means = sp.csr_array((coef.astype(np.float64), source, start), shape=(rows.n, nodes.n))[: self.particles.internal.n_edges]
        normals = self.split.fine.mesh.node_normals
        return factorised(constraints(self.split, means, self.split.fine.mesh.points, normals), *self.mass)

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
        """The velocities at t = 0 as near as the constraints let them be."""
        self._project("v", False)
        if self.tie.turns:
            for _ in range(SWEEPS):
                self._project("omega", True)

    def _project(self, name: str, turning: bool) -> None:
        fields = [getattr(group.nodes, name) for group in self.groups]
        now = [runtime.get(field, group.nodes.n) for field, group in zip(fields, self.groups)]
        if not any(values.any() for values in now):
            return
        normals = [body.mesh.node_normals for group in self.groups for body in group.shells]
        rates = [np.cross(w, n) for w, n in zip(now, normals)] if turning else now
        rows, L = self.factor.rows, self.factor.dense
        C = rows.elements, -1.0 * rows.particles
        lengths = np.ones(len(self.mass[0])), rows.length
        l = np.linalg.solve(L @ L.T, rows(*rates, turning=turning))
        for field, values, n, part, mass, length in zip(fields, rates, normals, C, self.mass, lengths):
            change = (part.T @ l) / mass[:, None]
            after = np.cross(n, values - length[:, None] * change) if turning else values - change
            runtime.put(field, after.astype(values.dtype))

    def correct(self, now: Now) -> None:
        self.tie.act(self.groups, now.kick)

    def left(self) -> tuple[float, float]:
        """Largest difference of what is tied: velocities over the largest one, and rates of directors over the largest one."""
        rows, found = self.factor.rows, []
        for turning in (False, True)[: 2 if self.tie.turns else 1]:
            values = []
            for group in self.groups:
                nodes = group.nodes
                v = runtime.get(nodes.omega if turning else nodes.v, nodes.n).astype(np.float64)
                if turning:
                    v = np.cross(v, runtime.get(nodes.N, nodes.n) + runtime.get(nodes.d, nodes.n))
                values.append(v)
            size = np.sqrt(max(float(((abs(rows.elements) @ np.abs(values[0])) ** 2).sum(axis=1).max()), 1e-300))
            found.append(float(np.abs(rows(*values, turning=turning)).max()) / size)
        return found[0], found[-1] if self.tie.turns else 0.0

    def pools(self) -> list[Pool]:
        return [self.tie]
