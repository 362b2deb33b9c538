"""What ends a run before its duration."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from ..errors import nearest
from .base import Frozen
from .units import Dimensionless, Time


class LeakKnown(Frozen):
    """The run ends, `after` that time at the earliest and at the duration at the latest, when the rate of a leak is known: the standard
    error of the mean over the last tenth of the run is at most `share` of it. It ends as well when nothing is open then: what is whole
    after the blow does not leak. `fluid`: None, the only one that fills a shell.
    """

    share: Annotated[Dimensionless, Field(gt=0, lt=1)] = 0.2
    after: Annotated[Time, Field(ge=0)] = 0.0
    fluid: str | None = None

    def check(self, scene: Any) -> None:
        """Against the rest of the scene."""
        filling = [fluid.name for fluid in scene.fluids if getattr(fluid.fill, "shell", None) in [shell.name for shell in scene.shells]]
        if self.fluid is None and len(filling) != 1:
            which = f"name one of {', '.join(filling)}" if filling else "no fluid of the scene fills a shell, so none leaks; leave it out"
            raise ValueError(f"until.fluid is missing: {which}")
        if self.fluid is not None and self.fluid not in filling:
            raise ValueError(f"until.fluid: no fluid '{self.fluid}' fills a shell{nearest(self.fluid, filling)}")
        scene.in_time("a leak flows", "until")
