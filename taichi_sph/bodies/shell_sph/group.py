"""Shells of smoothed particles at work: their form, what calms it, and rupture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ... import runtime
from ...geometry.cuts import cells_cut
from ...pool import Pool
from ...scene.schema import Scene
from ..body import Entries, Group, Now
from ..shell.build import Model, alike, quarters
from ..shell.group import ShellGroup
from ..shell.parts import Part
from ..shell.pressure import BOOK, START, Pressed
from ..shell.said import Shell
from .bearing import kept_positive
from .collocation import Collocation
from .damper import Damper
from .edge_filter import THESIS_STEP, EdgeFilter
from .galerkin import Galerkin
from .pressure import SidePressures
from .rupture import Rupture
from .spin_filter import SpinFilter
from .tangent import Tangent
from .viscosity import PairViscosity

NOTHING = 1e-9  # of the mean area of a node


def groups(scene: Scene, others: Sequence[Group] = (), own: Sequence[Shell] = ()) -> list[ParticleShells]:
    """The groups of the scene's shells of particles: one for each set of laws. The pools of the second are called "nodes_2" and so on.

    own: shells of every form; `alike` chooses."""
    return [ParticleShells(scene, some, suffix) for suffix, some in alike(scene, "shell_sph")]


class ParticleShells(ShellGroup):
    """Shells of particles of the same laws. terms: what takes energy to keep the collocation form calm; rupture: its events."""

    def __init__(self, scene: Scene, some: list[Part], suffix: str = ""):
        super().__init__(scene, some, suffix)
        self.terms = self._dampers() if isinstance(self.internal, Collocation) else []
        self.rupture = Rupture(self, f"rupture{suffix}")
        cut = [body.cells.first + cells_cut(body.mesh, c.start, c.end) for body in self.shells for c in body.said.cuts]
        self.cut_cells = np.unique(np.concatenate([*cut, np.zeros(0, np.int32)]))

    def form(self, model: Model) -> Galerkin | Collocation:
        kind = self.shells[0].numerics.formulation.kind
        return Galerkin(model, self.suffix) if kind == "galerkin" else Collocation(model, self.suffix)

    def start(self) -> None:
        """Cuts, velocities and the stable step, once all bodies are there."""
        self.rupture.cut(self.cut_cells)
        if len(self.cut_cells) and (self.loads.pushes or self.loads.twists) and self._by_cells:
            self.share_loads(self._areas_beside_cuts())
        super().start()

    def _dampers(self) -> list[Damper]:
        """The terms of the collocation form that take energy."""
        assert isinstance(self.internal, Collocation)
        forms: list[Any] = [body.numerics.formulation for body in self.shells]
        form, pairs = forms[0], self.internal.pairs
        terms: list[Damper] = []
        rates = []
        for body in self.shells:
            material = body.said.material
            rates.append(math.sqrt(material.young / material.density) / (THESIS_STEP * body.mesh.spacing))
        viscous = form.viscosity
        if viscous.alpha or viscous.beta or (viscous.gamma and self.nodes.bends):
            terms.append(PairViscosity(self.model, pairs, self.internal.area, f"viscosity{self.suffix}"))
        if form.edge_filter and self.material.breaks:
            shares = [one.edge_filter * rate for one, rate in zip(forms, rates)]
            terms.append(EdgeFilter(self.nodes, self.cells, pairs, shares, f"filter{self.suffix}"))
        if form.spin_filter and self.nodes.bends:
            shares = [one.spin_filter * rate for one, rate in zip(forms, rates)]
            terms.append(SpinFilter(self.nodes, pairs, shares, f"spin_filter{self.suffix}"))
        return terms

    def pressed_by(self, pressed: Sequence[Pressed]) -> SidePressures:
        assert isinstance(self.internal, Galerkin)  # no other form bears a pressure
        return SidePressures(pressed, self.internal, self.cells, f"pressure{self.suffix}")

    def areas_of_nodes(self, of_cells: np.ndarray | None = None) -> np.ndarray:
        """Where the shell bends, what pressures come with. In its plane nothing pushes by cells, and the border of a patch is no rim:
        quarters do."""
        own = super().areas_of_nodes(of_cells)
        if not self._by_cells:
            return own
        found = self.internal.areas(self.mesh, of_cells)
        return np.concatenate([kept_positive(found[body.nodes.rows], own[body.nodes.rows]) for body in self.shells])

    @property
    def _by_cells(self) -> bool:
        """Whether nodes own what pressures come with."""
        return isinstance(self.internal, Galerkin) and self.nodes.bends and self.shells[0].split is None

    def _areas_beside_cuts(self) -> np.ndarray:
        """(N,) areas [m2] by which nodes share in a NodalForce where cells are cut: those of a mesh without these cells."""
        dead = np.zeros(len(self.mesh.cells), bool)
        dead[self.cut_cells] = True
        found, own = self.internal.areas(self.mesh, None, dead), quarters(self.shells, (~dead).astype(np.float64))
        for body in self.shells:
            rows = body.nodes.rows
            loose = own[rows] <= 0.0  # nodes without a live cell bear nothing to speak of
            found[rows][loose] = NOTHING * own[rows].mean()
            found[rows][~loose] = kept_positive(found[rows][~loose], own[rows][~loose])
        return found

    def stiffness(self) -> Tangent | None:
        able = isinstance(self.internal, Galerkin) and runtime.current().real == runtime.ti.f64
        return Tangent(self) if able else None

    @property
    def ruptures(self) -> int:
        return self.rupture.events

    def events_of(self) -> Sequence[Pool]:
        return (self.rupture,)

    def events(self, now: Now) -> None:
        """Rupture; the work of pressures is booked around it."""
        ruptured = self.rupture.happen()
        if self.pressures is not None:
            self.pressures.press(now.time, START if ruptured else BOOK)

    def calm(self, now: Now) -> None:
        for term in self.terms:
            term.add(self.every * now.dt)

    def calming(self) -> Sequence[Pool]:
        return self.terms

    def entries(self) -> Entries:
        found = super().entries()
        found.internal["released"] = self.rupture.released
        taken: dict[str, float] = {}
        for term in self.terms:
            taken[term.entry] = taken.get(term.entry, 0.0) + term.taken(self.reducer)
        found.numerical = taken | found.numerical
        return found

    def status(self) -> dict[str, int]:
        return {"broken": self.rupture.broken - len(self.cut_cells), "loose nodes": self.rupture.loose}
