"""Shells of finite elements at work."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ... import runtime
from ...scene.schema import Scene
from ..body import Group
from ..shell.build import Model, alike
from ..shell.group import ShellGroup
from ..shell.pressure import Pressed
from ..shell.said import Shell
from .elements import Elements
from .pressure import CornerPressures
from .tangent import Tangent


def groups(scene: Scene, others: Sequence[Group] = (), own: Sequence[Shell] = ()) -> list[ElementShells]:
    """The groups of the scene's shells of finite elements: one for each set of laws. own: shells of every form; `alike` chooses."""
    return [ElementShells(scene, some, suffix) for suffix, some in alike(scene, "shell_fe")]


class ElementShells(ShellGroup):
    """Shells of elements of the same laws. They yield and are damaged; nothing breaks."""

    def per_cell(self, form: Any) -> int:
        return form.points

    def form(self, model: Model) -> Elements:
        form: Any = self.shells[0].numerics.formulation
        return Elements(model, form.points, self.suffix)

    def stiffness(self) -> Tangent | None:
        return Tangent(self) if runtime.current().real == runtime.ti.f64 else None

    def pressed_by(self, pressed: Sequence[Pressed]) -> CornerPressures:
        """In an overlap an element bears the share of the pressure that it counts: one pressure for each weight."""
        weights = np.concatenate([np.ones(b.cells.n) if b.weights is None else b.weights.mean(axis=1) for b in self.shells])
        each = [
            replace(one, cells=one.cells[weights[one.cells] == w], value=w * one.value)
            for one in pressed
            for w in np.unique(weights[one.cells])
        ]
        return CornerPressures(each, self.internal, f"pressure{self.suffix}")

    def of_cells(self) -> dict[str, np.ndarray]:
        """Means over the points of an element, weighted by their areas."""
        if self.points is self.cells:
            return super().of_cells()
        per = self.internal.per_cell
        weight = runtime.get(self.points.area, self.points.n).astype(np.float64).reshape(-1, per)
        weight /= weight.sum(axis=1, keepdims=True)
        found = {}
        for name, values in self.points.shows().items():
            each = values.reshape(len(weight), per, -1).astype(np.float64)
            found[name] = np.einsum("mp,mpc->mc", weight, each).reshape(len(weight), *values.shape[1:])
        found["rupture_time"][:] = np.nan
        return found
