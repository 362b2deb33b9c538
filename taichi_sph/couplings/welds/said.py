"""Welds as the user says them: two shells that hang together where their nodes meet. No Taichi here."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from ...errors import nearest
from ...scene.base import Frozen
from ...scene.kinds import Kind
from ...scene.units import Length


class Weld(Frozen):
    """Nodes of two shells `between` that stand within `radius` of each other at the start (None: a tenth of the finer spacing, so nodes in
    one place) move as one: a rib on a plate, a baffle in a tank. It carries forces, and no moments: the shells may turn about it as about a
    hinge. Welded shells do not meet by contact."""

    between: tuple[str, str]
    radius: Annotated[Length, Field(gt=0)] | None = None

    def check(self, scene: Any) -> None:
        """Against the rest of the scene."""
        where = scene.key_of(self)
        names = [body.name for body in scene.bodies]
        for name in self.between:
            if name not in names:
                raise ValueError(f"{where}.between: there is no body '{name}'{nearest(name, names)}")
            body = scene.body(name)
            if all(body is not shell for shell in scene.shells):
                raise ValueError(f"{where}.between: '{name}' is a {body.what}, and shells alone are welded; hold it by springs")
            if not body.meets:
                raise ValueError(f"{where}.between: {body.what} '{name}' moves in its plane; give it motion = 'free'")
        if self.between[0] == self.between[1]:
            raise ValueError(f"{where}.between: '{self.between[0]}' twice; merge the nodes of one shell in its mesh")
        if any({*self.between} == {*other.between} for other in scene.before(self)):
            raise ValueError(f"{where}: '{self.between[0]}' and '{self.between[1]}' have a weld already")
        scene.in_time("a weld holds moving bodies together", "welds")


KIND = Kind("weld", "welds", Weld, "taichi_sph.couplings.welds.coupling:couplings", rank=9)  # after contact: what is welded moves as one
