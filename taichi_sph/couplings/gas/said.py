"""A gas in a closed shell as the user says it. No Taichi here."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from ...scene.base import Frozen
from ...scene.kinds import Kind
from ...scene.units import Dimensionless, Pressure


class Gas(Frozen):
    """A gas that fills what water leaves of a closed shell, at one pressure throughout: pressure (V_0 / V)^exponent, V its volume now. Both
    pressures are absolute, `outside` is that around the shell. It presses on all of the shell; water in there has its own pressure above
    that of the gas. None of it leaves: the shell has no holes and does not break."""

    body: str | None = None
    pressure: Annotated[Pressure, Field(gt=0)]
    outside: Annotated[Pressure, Field(ge=0)] = 101325.0
    exponent: Annotated[Dimensionless, Field(ge=1, le=2)] = 1.4

    def check(self, scene: Any) -> None:
        """Against the rest of the scene."""
        where, shell = scene.key_of(self), scene.body(self.body)
        if self.body in [gas.body for gas in scene.before(self)]:
            raise ValueError(f"{where}: shell '{self.body}' holds a gas already; leave one out")
        if shell.motion == "in_plane":
            raise ValueError(f"{where}: shell '{self.body}' moves in its plane and does not bend; give it motion = 'free'")
        if shell.material.critical_damage is not None or shell.cuts:
            raise ValueError(f"{where}: gas that leaves through cracks is not possible yet; leave out critical_damage and cuts, or the gas")
        if getattr(shell.surface, "holes", ()):
            raise ValueError(f"{where}: gas that leaves through holes is not possible yet; leave out surface.holes, or the gas")
        scene.in_time("a gas is compressed", "gases")


KIND = Kind("gas", "gases", Gas, "taichi_sph.couplings.gas.coupling:couplings", rank=2)
