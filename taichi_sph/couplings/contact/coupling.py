"""Contact as a coupling of the world: pinballs of all bodies (T 3.3)."""

from __future__ import annotations

import numpy as np

from ...bodies.body import Entries, Now
from ..coupling import Coupling
from .bodies import Bodies
from .multipliers import Contact
from .said import PinballContact


def couplings(scene, groups) -> list[ContactCoupling]:
    """Contact, where something can meet something."""
    kinds = {group.kind for group in groups}
    meets = "rigid" in kinds or {"fluid", "shell"} <= kinds or any(shell.self_contact for shell in scene.shells)
    return [ContactCoupling(scene, groups)] if meets else []


class ContactCoupling(Coupling):
    """contact: the solver."""

    def __init__(self, scene, groups):
        shell = next((g for g in groups if g.kind == "shell"), None)
        self.fluid = next((g for g in groups if g.kind == "fluid"), None)
        rigid = next((g for g in groups if g.kind == "rigid"), None)
        meets_itself = any(shell.self_contact for shell in scene.shells)
        thickness = shell.shell.thickness if shell is not None else 0.0
        particles = self.fluid.body.p if self.fluid is not None else None
        pinballs = self.fluid is not None and not self.fluid.presses
        of_shell = (shell.mesh, shell.nodes, shell.cells, shell.loads) if shell is not None else (None, None, None, None)
        bodies = Bodies(*of_shell, thickness, particles, rigid.rigids if rigid is not None else None, pinballs)
        lengths = [0.5 * p.radius for body in scene.rigids for p in body.pinballs]
        if shell is not None:
            lengths.append(shell.spacing)
        if particles is not None:
            lengths.append(particles.spacing)
        self.contact = Contact(bodies, scene.numerics.contact or PinballContact(), meets_itself, 0.5 * min(lengths))
        if self.fluid is not None:
            self.fluid.pushed = True
        self.name = shell.shell.name if shell is not None else ""

    def start(self) -> None:
        """SceneError when bodies lie in each other at t = 0."""
        self.contact.check_start(self.name)

    def correct(self, now: Now) -> None:
        wet = self.fluid is not None and now.due(self.fluid)
        times = self.fluid.every if wet else 0
        self.contact.add(now.dt_before, now.dt, now.half_time, wet and self.fluid.renumbered, times)

    def entries(self) -> Entries:
        return Entries(internal={"contact": self.contact.taken()})

    def given(self) -> float:
        return self.contact.taken()

    def status(self) -> dict[str, int]:
        return {"contacts": self.contact.touching, "iterations": self.contact.iterations}

    def state(self) -> dict[str, np.ndarray]:
        return self.contact.state()

    def shapes(self) -> dict[str, tuple[int, ...]]:
        return {name: value.shape for name, value in self.state().items()}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        self.contact.restore(state)
